"""Files of a public benchmark, from a local folder or from a download that is checked."""

import hashlib
import os
import urllib.request
from collections.abc import Mapping
from pathlib import Path

from gpi_hammerstein._native import DataError
from gpi_hammerstein.files import write_atomically

TIMEOUT = 60.0


def local_folder(name: str) -> Path:
    """Return the local folder of the files of a benchmark.

    Parameters
    ----------
    name
        The name of the benchmark.

    Returns
    -------
    Path
        ``measured/NAME`` in the folder of the environment variable ``GPI_DATA_DIR``, else in ``../shared`` or
        ``shared``. If there is none, a folder in the cache of the user, which may not exist yet.

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
    """Return the files of a benchmark, and download those that are not in the folder.

    Parameters
    ----------
    address
        The address to which the file names are appended.
    checksums
        The SHA-256 of each file, by its name.
    folder
        The folder of the files.

    Returns
    -------
    list[Path]
        The files, in the order of `checksums`.

    Raises
    ------
    DataError
        A file cannot be downloaded, or is not the published file.

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
                f"{address}: cannot be downloaded ({error}); put {path.name} into {path.parent} manually"
            ) from error
    found = hashlib.sha256(content).hexdigest()
    if found != digest:
        where = path if path.exists() else address
        raise DataError(
            f"{where}: not the published file (SHA-256 {found[:12]}.., not {digest[:12]}..); "
            "download it again"
        )
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)
    return path
