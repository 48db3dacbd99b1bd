"""
Ctrl-C that ends a command although a library is deaf to it.

Python handles a signal between two of its instructions. To parse a file of a gigabyte or to pack a
large array is one instruction, which may take minutes. So a small process stands by: Python's
handler in C writes each SIGINT to a pipe at once, and if the command lives on for `PATIENCE`
seconds, that process ends it by SIGTERM. Results are then as safe as when a run is killed: new
files take their names when all are complete, and the next run cleans up.
"""

import atexit
import os
import select
import signal
import threading
import time
from contextlib import suppress

__all__ = ["PATIENCE", "stand_by"]

PATIENCE = 1.4
"""Time that a command has to end by itself after Ctrl-C [s]."""


def stand_by() -> None:
    """
    Start the process that ends this one after a Ctrl-C it did not obey; it ends with this one.

    Call it before there are threads. Windows, which cannot copy a process, is left as it is.
    """
    if not hasattr(os, "fork") or threading.current_thread() is not threading.main_thread():
        return
    reading, writing = os.pipe()
    command = os.getpid()
    process = os.fork()
    if process == 0:
        with suppress(BaseException):  # it must not run what follows in the command
            os.close(writing)
            _watch(reading, command)
        os._exit(0)
    os.close(reading)
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    atexit.register(_dismiss, writing, process, command)


def _dismiss(pipe: int, process: int, command: int) -> None:
    """End the process, so that nothing is left of it where nobody takes in orphans."""
    if os.getpid() == command:  # not in a fork
        signal.set_wakeup_fd(-1)
        with suppress(OSError):
            os.close(pipe)
            os.waitpid(process, 0)


def _watch(pipe: int, command: int) -> None:
    """Wait for signals from a pipe that closes when the command ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to both
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):
        os.dup2(silence, stream)
    for first, end in ((3, pipe), (pipe + 1, os.sysconf("SC_OPEN_MAX"))):
        os.closerange(first, end)
    while signals := os.read(pipe, 64):
        if signal.SIGINT in signals and not _is_over(pipe) and os.getppid() == command:
            os.write(2, b"umbra: interrupted\n")
            os.kill(command, signal.SIGTERM)


def _is_over(pipe: int) -> bool:
    """Return whether the command ends in time."""
    until = time.monotonic() + PATIENCE
    while (left := until - time.monotonic()) > 0:
        if select.select([pipe], [], [], left)[0] and not os.read(pipe, 64):
            return True
    return False
