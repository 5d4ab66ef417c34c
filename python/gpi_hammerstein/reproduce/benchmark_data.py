"""Files of a public benchmark: from a folder, or fetched from their address and checked."""

import hashlib
import os
import urllib.request
from collections.abc import Mapping
from pathlib import Path

from gpi_hammerstein._native import DataError
from gpi_hammerstein.files import write_atomically

TIMEOUT = 60.0


def local_folder(name: str) -> Path:
    """Return where a benchmark's files are kept on this machine.

    Parameters
    ----------
    name
        The benchmark's name.

    Returns
    -------
    Path
        ``measured/NAME`` of the folder in the environment variable ``GPI_DATA_DIR``, of ``../shared`` or of
        ``shared`` if there is one; else a folder of the user's cache, which need not exist yet.

    Examples
    --------
    >>> local_folder("piezo-fsm-cubespec").name
    'piezo-fsm-cubespec'
    """
    given = os.environ.get("GPI_DATA_DIR")
    roots = [Path(given)] if given else [Path("../shared"), Path("shared")]
    for root in roots:
        if (root / "measured" / name).is_dir():
            return root / "measured" / name
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache) / "gpi-hammerstein" / name


def fetch(address: str, checksums: Mapping[str, str], folder: Path) -> list[Path]:
    """Return files of a benchmark, fetching those that the folder lacks.

    Parameters
    ----------
    address
        What the files' names are appended to.
    checksums
        SHA-256 of each file, by its name.
    folder
        Where they are kept.

    Returns
    -------
    list[Path]
        The files, in the order of `checksums`.

    Raises
    ------
    DataError
        A file cannot be fetched, or is not the one that was published.

    Examples
    --------
    >>> fetch("https://example.org/data/", {"u.npy": "2cf2..."}, Path("data"))  # doctest: +SKIP
    [PosixPath('data/u.npy')]
    """
    return [_file(address + name, digest, folder / name) for name, digest in checksums.items()]


def _file(address: str, digest: str, path: Path) -> Path:
    if path.exists():
        content = path.read_bytes()
    else:
        try:
            with urllib.request.urlopen(address, timeout=TIMEOUT) as answer:
                content = answer.read()
        except OSError as error:
            raise DataError(
                f"{address}: cannot be fetched ({error}); put {path.name} into {path.parent} yourself"
            ) from error
    found = hashlib.sha256(content).hexdigest()
    if found != digest:
        where = path if path.exists() else address
        raise DataError(
            f"{where}: not the published file (SHA-256 {found[:12]}.., not {digest[:12]}..); fetch it anew"
        )
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)
    return path
