"""Signals that arrive while results take their place: they act a moment later."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

DEFERRED = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def deferred() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM act at the end of the block.

    Only the main thread can do this, and only in it Python handles signals, so that other threads need it
    not.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    arrived: list[signal.Signals] = []

    def remember(number: int, _: FrameType | None) -> None:
        arrived.append(signal.Signals(number))

    # A handler that was not installed from Python (None) cannot be restored, and is left alone.
    before = {number: signal.getsignal(number) for number in DEFERRED}
    replaced = {number: handler for number, handler in before.items() if handler is not None}
    try:
        for number in replaced:
            signal.signal(number, remember)
        yield
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)
        for one in arrived:
            signal.raise_signal(one)
