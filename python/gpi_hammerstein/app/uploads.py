"""The files that were dropped on the page, in a private folder.

The name of a file is a text that is shown. It is never a part of a path: only its ending, if it is one of the
known formats, appears in the name under which the file is kept.
"""

import os
import re
import secrets
import shlex
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath

from gpi_hammerstein._native import DataError, ParameterError
from gpi_hammerstein.app.settings import MOST_FILES, UPLOAD, largest_upload
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.io.formats import FORMATS, NAMES

# Longer names are cut where they are shown. File systems permit 255.
LONGEST_NAME = 255


class TooLarge(DataError):
    """A file is larger than the setting allows."""


@dataclass(frozen=True)
class Upload:
    """A file."""

    key: str
    """The random name by which the page asks for it."""
    name: str
    """The name that the user knows."""
    path: Path
    """Where it is kept."""
    size: int
    """Bytes."""


class Uploads:
    """The files of one run.

    Parameters
    ----------
    folder
        The private folder.

    Examples
    --------
    >>> Uploads(Path("private")).shown("no file is mentioned")
    'no file is mentioned'
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._kept: dict[str, Upload] = {}

    async def receive(self, name: str, announced: str | None, chunks: AsyncIterator[bytes]) -> Upload:
        """Keep a file.

        Parameters
        ----------
        name
            Its name.
        announced
            Its size in bytes as the request states it, if it does.
        chunks
            Its content.

        Returns
        -------
        Upload
            The file.

        Raises
        ------
        DataError
            It has no known format or is too large.
        """
        name = shown_name(name)
        most = largest_upload()
        if len(self._kept) >= MOST_FILES:
            raise DataError(f"{name}: {MOST_FILES} files are kept already; end `gpi app` and start it again")
        suffix = known_suffix(name)
        if announced is not None and announced.isdecimal() and int(announced) > most:
            raise too_large(name, most)
        key = secrets.token_hex(16)
        path = self._folder / f"{key}{suffix}"
        size = 0
        try:
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
            with os.fdopen(handle, "wb") as file:
                async for chunk in chunks:
                    size += len(chunk)
                    if size > most:
                        raise too_large(name, most)
                    file.write(chunk)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        upload = Upload(key, name, path, size)
        self._kept[key] = upload
        return upload

    def find(self, keys: Iterable[str]) -> list[Upload]:
        """Return files by their keys.

        Raises
        ------
        ParameterError
            There is none, or one of them is not known.
        """
        found = [self._kept[key] for key in keys if key in self._kept]
        if not found or len(found) != len(list(keys)):
            raise ParameterError("`files`: the file is not there any more; drop it on the page again")
        return found

    def shown(self, text: str, *, quoted: bool = False) -> str:
        """Return a text in which the user's names stand in place of the paths under which files are kept.

        Parameters
        ----------
        text
            A message, or a command for a shell if `quoted`.
        """
        for upload in self._kept.values():
            # the key is also in names that were made of the path, such as that of a report
            names = {str(upload.path): upload.name, upload.path.name: upload.name}
            for kept, name in {**names, upload.key: upload.name.split(".")[0]}.items():
                text = in_place_of(kept, name, text, quoted=quoted)
        return text


def in_place_of(kept: str, name: str, text: str, *, quoted: bool) -> str:
    """Return a text with a name in place of another one; in a command, the whole word is quoted.

    Parameters
    ----------
    kept, name
        The name that is in the text, and the one to show.
    text
        A message, or a command for a shell if `quoted`.
    quoted
        Whether it is a command.

    Examples
    --------
    >>> in_place_of("0f3a", "my run", "gpi report 0f3a.csv", quoted=True)
    "gpi report 'my run.csv'"
    """
    if not quoted:
        return text.replace(kept, name)
    return re.sub(rf"{re.escape(kept)}(\S*)", lambda found: shlex.quote(name + found[1]), text)


def shown_name(name: str) -> str:
    r"""Return the name of a file without folders and without invisible characters.

    Parameters
    ----------
    name
        What the browser calls the file.

    Returns
    -------
    str
        A text of one line.

    Examples
    --------
    >>> shown_name("../../etc/run.csv"), shown_name("C:\\data\\run.csv"), shown_name("..")
    ('run.csv', 'run.csv', 'record')
    """
    last = PureWindowsPath(PurePosixPath(name).name).name
    return visible(last)[:LONGEST_NAME] if last.strip(". ") else "record"


def known_suffix(name: str) -> str:
    """Return the ending of a name that decides how the file is read.

    Parameters
    ----------
    name
        The name.

    Returns
    -------
    str
        One of the endings in a fixed list.

    Raises
    ------
    DataError
        The ending belongs to no format that the app reads.

    Examples
    --------
    >>> known_suffix("Run 7.CSV.gz")
    '.gz'
    """
    suffix = PurePosixPath(name).suffix.lower()
    if suffix == ".npy":
        # its output is another file, whose path would have to be named
        raise DataError(
            f"{name}: a .npy file contains only one signal; put input and output into one .npz or .csv file, "
            "or use the command line"
        )
    if suffix not in FORMATS:
        raise DataError(f"{name}: no known format; {NAMES}")
    return suffix


def too_large(name: str, most: int) -> TooLarge:
    """Return the error for a file that is too large."""
    return TooLarge(
        f"{name}: has more than {most} bytes; start `gpi app` with a larger value of the environment "
        f"variable {UPLOAD}, or use the command line"
    )
