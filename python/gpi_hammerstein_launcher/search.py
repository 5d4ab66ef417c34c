"""The process in which `gpi app` searches.

It reads one line of JSON from its standard input, the request, and writes lines of JSON to its standard
output (see `gpi_hammerstein.app.worker`). Another line of input asks it to stop and to keep what was found.
If its input is closed, the app has ended, in whatever way, and it ends at once. This holds also while modules
are imported, so this one imports nothing that takes time.
"""

import json
import os
import signal
import sys
import threading
from typing import Any

PART = 1 << 16


def listen(stop: threading.Event) -> None:
    """Wait for the wish to stop; end this process if the app has ended."""
    # not through `sys.stdin`, which a thread that waits would lock at the exit of the interpreter
    while os.read(0, PART):
        stop.set()
    temporary = sys.modules.get("gpi_hammerstein.files.temporary")
    try:
        # The module may be half imported.
        if temporary is not None and hasattr(temporary, "sweep"):
            temporary.abandon()
    finally:
        os._exit(1)


def main() -> None:
    """Answer one request."""
    # Ctrl-C reaches all processes of a terminal. The app decides what happens, and closes the pipe.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    out = os.dup(1)
    os.dup2(2, 1)  # what a library prints must not be taken for an answer
    request = b""
    while not request.endswith(b"\n"):
        part = os.read(0, PART)
        if not part:
            return
        request += part
    stop = threading.Event()
    threading.Thread(target=listen, args=(stop,), daemon=True).start()

    def tell(answer: dict[str, Any]) -> None:
        line = json.dumps(answer, allow_nan=False).encode() + b"\n"
        while line:
            line = line[os.write(out, line) :]

    from gpi_hammerstein.app.worker import work

    work(json.loads(request), stop, tell)


if __name__ == "__main__":
    main()
