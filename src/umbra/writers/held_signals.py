"""Signals that wait for the end of a piece of work which must not be left half done."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["hold_signals"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # Windows has the last instead of SIGHUP


@contextmanager
def hold_signals() -> Iterator[None]:
    """Let Ctrl-C and requests to end wait for the end of the block; then they do what they do."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python lets the main thread alone answer signals
        return
    held: list[int] = []
    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    previous = {}
    try:
        for number in numbers:
            # One that was ignored (nohup) stays so; one set by other than Python is left alone.
            if signal.getsignal(number) not in {signal.SIG_IGN, None}:
                previous[number] = signal.signal(number, lambda number, _: held.append(number))
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
        for number in held:
            signal.raise_signal(number)
