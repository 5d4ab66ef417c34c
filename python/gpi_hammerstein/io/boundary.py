"""The boundary between files, which anybody may have written, and the package.

All readers work on the bytes of a file within :func:`opened`. It is the only place where the exceptions of
the libraries that read file formats are translated: whatever fails becomes a :class:`DataError` that names
the file and the reason.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from gpi_hammerstein._native import DataError, GpiError
from gpi_hammerstein.escaping import visible
from gpi_hammerstein.io.limits import Allowance

SPECIAL = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)
# A message of a library can contain a part of the file.
LONGEST_REASON = 200


@dataclass(frozen=True)
class File:
    """The bytes of a file, and what may still be taken from it."""

    path: Path
    data: bytes
    allowance: Allowance


@contextmanager
def opened(path: Path, kind: str) -> Iterator[File]:
    """Read a file, and translate every failure while its content is read.

    Parameters
    ----------
    path
        The file.
    kind
        Name of the format, for messages.

    Yields
    ------
    File
        The bytes of the file.

    Raises
    ------
    DataError
        The file cannot be opened, is not a regular file, is too large, or its content cannot be read.
        KeyboardInterrupt and SystemExit are not translated.

    Examples
    --------
    >>> with opened(Path("record.csv"), "CSV") as file:  # doctest: +SKIP
    ...     text = file.data.decode()
    """
    data, allowance = _content(path)
    try:
        yield File(path, data, allowance)
    except GpiError:
        raise
    except MemoryError as error:
        raise DataError(f"{path}: cannot be read as {kind}: there is not enough memory") from error
    except Exception as error:
        raise DataError(f"{path}: cannot be read as {kind}: {_reason(error)}") from error
    except BaseException as error:
        # A panic of Polars is not an Exception, and its class cannot be imported.
        if type(error).__name__ != "PanicException":
            raise
        raise DataError(f"{path}: cannot be read as {kind}: {_reason(error)}") from error


def _content(path: Path) -> tuple[bytes, Allowance]:
    """Read a regular file. The type is checked first, because opening a device can have an effect."""
    try:
        _require_regular(path, os.stat(path).st_mode)
        # Another process can replace the file by a pipe, which must not block.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(descriptor, "rb") as file:
            status = os.fstat(descriptor)
            _require_regular(path, status.st_mode)
            allowance = Allowance(path, status.st_size)
            allowance.spend(status.st_size)
            data = file.read(status.st_size)
    except GpiError:  # which is also a ValueError
        raise
    except FileNotFoundError:
        raise DataError(f"{path}: no such file; give a record file") from None
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise DataError(f"{path!r}: is not the name of a file ({error})") from error
    allowance.used = 0
    return data, allowance


def _require_regular(path: Path, mode: int) -> None:
    if not stat.S_ISREG(mode):
        what = next((name for test, name in SPECIAL if test(mode)), "a special file")
        raise DataError(f"{path}: is {what}; a record is a regular file")


def _reason(error: BaseException) -> str:
    """Return the first line of the message of an exception, without characters that control a terminal."""
    text = getattr(error, "strerror", None) or str(error).strip()
    line = next(iter(str(text).splitlines()), "") or type(error).__name__
    if isinstance(error, KeyError | IndexError | AttributeError | AssertionError | TypeError):
        # The message alone is only a key or a name.
        line = f"its content is inconsistent ({type(error).__name__}: {line})"
    return visible(line)[:LONGEST_REASON]
