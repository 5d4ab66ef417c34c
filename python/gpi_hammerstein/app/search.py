"""The search, which another process runs: the page answers meanwhile, and it can be ended at any moment."""

import json
import os
import subprocess
import sys
import threading
from contextlib import suppress
from typing import Any

# What the interpreter runs. Option -P: the modules of the working folder are not imported.
SEARCH = ("-P", "-m", "gpi_hammerstein_launcher.search")
ENDED_AT_ONCE = "The search was ended at once, and nothing was kept."
RUNNING = ("running", "stopping")


class Search:
    """A search that runs or has ended.

    Parameters
    ----------
    request
        What :mod:`gpi_hammerstein.app.worker` searches.

    Examples
    --------
    >>> search = Search({"paths": ["run.csv"], "out": "found", **others})  # doctest: +SKIP
    >>> search.status()["state"]  # doctest: +SKIP
    'running'
    """

    def __init__(self, request: dict[str, Any]) -> None:
        self._lock = threading.Lock()
        self._status: dict[str, Any] = {
            "state": "running",
            "progress": None,
            "keeps": False,
            "writing": False,
        }
        self._version = 0
        self._process = subprocess.Popen(
            [sys.executable, *SEARCH],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
        )
        # one line, which ends with the only line break
        self._send(json.dumps(request).encode() + b"\n")
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def status(self) -> dict[str, Any]:
        """Return what the search does.

        Returns
        -------
        dict
            ``state`` (running, stopping, done, stopped or failed), ``version`` (grows with each change),
            ``progress`` with the properties of `gpi_hammerstein.Progress`, ``keeps`` (whether a model is
            kept if the search is stopped now), ``writing`` (whether the results are written), and at the end
            ``result``, ``message`` or ``error``.
        """
        with self._lock:
            return {**self._status, "version": self._version}

    def is_running(self) -> bool:
        """Return whether the search has not ended."""
        return self.status()["state"] in RUNNING

    def cancel(self) -> None:
        """Stop the search and keep what was found; if it stops already, end it at once."""
        state = self.status()["state"]
        if state == "running":
            self._change(state="stopping")
            self._send(b"stop\n")
        elif state == "stopping":
            self._change(state="stopped", message=ENDED_AT_ONCE)
            self._process.kill()

    def close(self) -> None:
        """End the process, if it still runs."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()

    def _send(self, line: bytes) -> None:
        assert self._process.stdin is not None
        # the process may have ended
        with suppress(OSError):
            self._process.stdin.write(line)
            self._process.stdin.flush()

    def _change(self, **changes: Any) -> None:
        with self._lock:
            if self._status["state"] in RUNNING:
                self._status = {**self._status, **changes}
                self._version += 1

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            answer: dict[str, Any] = json.loads(line)
            if "done" in answer:
                self._change(state="done", result=answer["done"])
            elif "stopped" in answer:
                self._change(state="stopped", message=answer["stopped"])
            elif "failed" in answer:
                self._change(state="failed", **answer["failed"])
            else:
                self._change(**answer)
        code = self._process.wait()
        self._change(
            state="failed",
            error="NumericalError",
            message=f"the process that searches ended with code {code}; if the memory was exhausted, use "
            "fewer samples (experiments, or resample to a lower rate)",
        )
