"""The start of the command `gpi`: Ctrl-C and SIGTERM end it at any moment, without a traceback.

This package is imported before all others, and imports nothing that takes time. Its handlers do not raise an
exception: an exception can be lost in a destructor or a callback, or leave an import half done. They remove
what is temporary, say so, and end the process. While results take their place, `gpi_hammerstein.files` defers
the signals for some milliseconds.
"""

# The module `signal` imports `enum`, which takes milliseconds without a handler; this is the part in C of it.
import _signal as signal  # type: ignore[import-not-found]
import os
import sys

# 128 plus the number of the signal, as shells do.
INTERRUPTED, TERMINATED = 130, 143
SHOW_CURSOR = b"\x1b[?25h"


def leave(number: int, frame: object) -> None:
    """Remove what is temporary, and end the process with the exit code of the signal."""
    # A second signal must not interrupt the first one's work.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    word, code = ("interrupted", INTERRUPTED) if number == signal.SIGINT else ("terminated", TERMINATED)
    temporary = sys.modules.get("gpi_hammerstein.files.temporary")
    try:
        untouched = True
        # The module may be half imported.
        if temporary is not None and hasattr(temporary, "sweep"):
            temporary.abandon()
            untouched = temporary.is_untouched()
        text = f"gpi: {word}{'; nothing was written' if untouched else ''}\n".encode()
        os.write(2, (SHOW_CURSOR if os.isatty(2) else b"") + text)
    except OSError:
        pass  # standard error is closed
    finally:
        os._exit(code)


def main() -> None:
    """Run the command `gpi` and exit with its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        # A shell starts a command in the background with Ctrl-C ignored; this is respected.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, leave)
    from gpi_hammerstein.cli import run

    sys.exit(run())
