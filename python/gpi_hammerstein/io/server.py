"""The process that reads files for another one; see :mod:`gpi_hammerstein.io.apart`."""

import json
import os
import signal
import sys
from pathlib import Path

from gpi_hammerstein._native import GpiError
from gpi_hammerstein.io.formats import read_tables
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.transport import send


def answer(line: bytes) -> list[Table] | GpiError:
    """Read the file that a request names.

    Parameters
    ----------
    line
        The request: a line of JSON with the working folder, the path, and the limits.

    Returns
    -------
    list of Table
        The content of the file, or the error of the package that was raised.

    Examples
    --------
    >>> request = {"folder": ".", "path": "no-such-file.csv", "settings": {}}
    >>> answer(json.dumps(request).encode())  # doctest: +SKIP
    DataError('no-such-file.csv: no such file; give a record file')
    """
    request = json.loads(line)
    if request["folder"]:
        os.chdir(request["folder"])
    os.environ.update(request["settings"])
    try:
        return read_tables(Path(request["path"]), apart=False)
    except GpiError as error:
        return error
    finally:
        os.chdir(os.path.abspath(os.sep))  # a folder that a process is in cannot be removed on some systems


def main() -> None:
    """Answer requests until the other process closes the pipe."""
    # Ctrl-C reaches all processes of a terminal; the other process decides what happens.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)  # what a library prints must not be taken for an answer
        for line in sys.stdin.buffer:
            send(out, answer(line))


if __name__ == "__main__":
    main()
