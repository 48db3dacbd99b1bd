"""
Ctrl-C that ends a command although a library is deaf to it.

Python handles a signal between two of its instructions. To parse a file of a gigabyte or to pack a
large array is one instruction, which may take minutes. So a small process stands by: Python's
handler in C writes each SIGINT to a pipe at once, and if the command lives on for `PATIENCE`
seconds, that process ends it by SIGTERM; on a busy machine, which gives the command little of the
processor meanwhile, it waits longer, for `BUSY` seconds at most. Results are then as safe as when a
run is killed: new files take their names when all are complete, and the next run cleans up.
"""

import atexit
import math
import os
import select
import signal
import threading
import time
from contextlib import suppress

__all__ = ["BUSY", "PATIENCE", "stand_by"]

PATIENCE = 1.4
"""Time that a command has to end by itself after Ctrl-C [s]."""
BUSY = 5.0
"""The same while it gets less than half of `PATIENCE` of the processor [s]."""
_LOOK = 0.1  # between looks at what it got [s]


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
        if signal.SIGINT in signals and not _is_over(pipe, command) and os.getppid() == command:
            os.write(2, b"umbra: interrupted\n")
            os.kill(command, signal.SIGTERM)


def _is_over(pipe: int, command: int) -> bool:
    """Return whether the command ends in time."""
    begun, used = time.monotonic(), _find_used(command)
    while (passed := time.monotonic() - begun) < BUSY:
        if passed >= PATIENCE and not _find_used(command) < used + PATIENCE / 2:
            return False
        left = max(PATIENCE - passed, _LOOK)
        if select.select([pipe], [], [], left)[0] and not os.read(pipe, 64):
            return True
    return False


def _find_used(command: int) -> float:
    """Return the processor time of a process [s]; infinite where the system does not tell it."""
    try:
        with open(f"/proc/{command}/stat", "rb") as file:  # noqa: PTH123
            fields = file.read().rpartition(b")")[2].split()
    except OSError:
        return math.inf
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
