"""Reading of some formats in another process, so that a library that fails there cannot end this one.

The libraries of HDF5 and Parquet can end a process if a file is corrupt: a wrong size makes them allocate
memory that does not exist. Their files are therefore read by a process that this one starts at the first such
file and that waits for more. If it ends or takes too long, the file is refused, and the next file starts
another one.

The request is one line of JSON, the answer is described in :mod:`gpi_hammerstein.io.transport`.
"""

import atexit
import json
import os
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

from gpi_hammerstein._native import GpiError
from gpi_hammerstein.io.limits import SECONDS, VARIABLES, limit
from gpi_hammerstein.io.tables import Table
from gpi_hammerstein.io.transport import receive

# What the interpreter runs. Option -P: the modules of the working folder are not imported.
SERVER = ("-P", "-m", "gpi_hammerstein.io.server")
# A process whose pipe is closed is about to end, and its exit code is then that of the failure.
END_SECONDS = 1.0


class Reader:
    """The other process, which is started when it is needed."""

    def __init__(self) -> None:
        self.lock: threading.Lock = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None

    def read(self, path: Path) -> list[Table]:
        """Let the other process read a file."""
        seconds = limit(SECONDS)
        settings = {name: os.environ.get(name, "") for name in VARIABLES}
        folder = ""  # the working folder can be deleted
        with suppress(OSError):
            folder = os.getcwd()
        request = {"folder": folder, "path": os.fspath(path), "settings": settings}
        with self.lock:
            process = self._running()
            assert process.stdin is not None and process.stdout is not None
            late = threading.Event()

            def stop() -> None:
                late.set()
                process.kill()

            timer = threading.Timer(seconds, stop)
            timer.daemon = True
            timer.start()
            try:
                process.stdin.write(json.dumps(request).encode() + b"\n")
                process.stdin.flush()
                return receive(process.stdout)
            except (EOFError, OSError) as error:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(END_SECONDS)
                code = self._end()
                if late.is_set():
                    raise TimeoutError(
                        f"it takes more than {seconds} s; if you trust the file, raise the limit with the "
                        f"environment variable {SECONDS}"
                    ) from error
                raise RuntimeError(f"the process that reads it ended with code {code}") from error
            except BaseException as error:
                # After an interruption, the answer to this request would be taken for that to the next one.
                if not isinstance(error, GpiError):
                    self._end()
                raise
            finally:
                timer.cancel()

    def _running(self) -> "subprocess.Popen[bytes]":
        if self.process is None or self.process.poll() is not None:
            self._end()
            self.process = subprocess.Popen(
                [sys.executable, *SERVER],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
            )
        return self.process

    def _end(self) -> int | None:
        """End the process and return its exit code."""
        process, self.process = self.process, None
        if process is None:
            return None
        process.kill()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()
        return process.wait()

    def forget(self) -> None:
        """Leave the process to the parent of this process, after a fork."""
        self.lock = threading.Lock()
        if self.process is not None:
            _OF_PARENTS.append(self.process)  # a Popen object that is deleted would wait for the process
            self.process = None

    def close(self) -> None:
        """End the process when the interpreter exits."""
        self._end()


_OF_PARENTS: list[subprocess.Popen[bytes]] = []
_READER = Reader()
atexit.register(_READER.close)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_READER.forget)


def read_apart(path: Path) -> list[Table]:
    """Read a file in another process.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    list of Table
        What :func:`~gpi_hammerstein.io.formats.read_tables` returns there.

    Raises
    ------
    DataError, ParameterError
        As raised in the other process.
    RuntimeError, TimeoutError
        The other process ended, or took too long.

    Examples
    --------
    >>> read_apart(Path("record.parquet"))  # doctest: +SKIP
    """
    return _READER.read(path)


def is_possible() -> bool:
    """Return whether this interpreter can start another one; a program that contains its interpreter cannot.

    Examples
    --------
    >>> is_possible()
    True
    """
    return bool(sys.executable) and not getattr(sys, "frozen", False)
