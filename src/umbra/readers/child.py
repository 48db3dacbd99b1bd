"""
A reader's library in a child process, which may crash or hang without harm.

The child runs a generator of its target (``module:function``) and passes each piece on, as arrays
and JSON (`umbra.readers.message`); records in them are dataclasses that the target's module names.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

from umbra.errors import InputError
from umbra.machine import HOME, find_memory, make_command
from umbra.readers.message import list_records, read_message, write_message

__all__ = ["ChildLimits", "ReadingChild", "make_early_end", "serve"]

_CODE = "from umbra.readers.child import serve; serve({target!r}, {limits!r})"
_PACKAGES = 250e6  # [byte] of the packages that a child loads, beside what the file takes
_TIMES_UP = {-getattr(signal, name) for name in ("SIGPROF", "SIGXCPU") if hasattr(signal, name)}


@dataclass(frozen=True)
class ChildLimits:
    """What a child may take."""

    seconds: float  # processor time until the next piece [s]
    whole: float  # processor time in all [s]
    memory: float  # beside its packages [byte]


class ReadingChild:
    """
    Iterate over the pieces from a child; afterwards states whether they are complete.

    Parameters
    ----------
    target : str
        ``module:function``, called with ``work`` in the child, or here if Python has no program.
    work : object
        That `write_message` can write.
    limits : ChildLimits
    """

    is_done = False
    has_hung = False

    def __init__(self, target: str, work: Any, limits: ChildLimits) -> None:
        self._target, self._work, self._limits = target, work, limits

    def __iter__(self) -> Iterator[Any]:
        module, function = _find_target(self._target)
        if not sys.executable:
            yield from function(self._work)
            self.is_done = True
            return
        limits = (self._limits.seconds, self._limits.whole, self._limits.memory)
        command = make_command(_CODE.format(target=self._target, limits=limits))
        child = subprocess.Popen(command, cwd=HOME, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        asked, answers = child.stdin, child.stdout
        assert asked is not None and answers is not None  # noqa: PT018
        records = list_records(module)
        try:
            with suppress(EOFError, BrokenPipeError):
                write_message(asked, self._work)
                asked.close()
                while (piece := read_message(answers, records)) is not None:
                    if isinstance(piece, BaseException):
                        raise piece
                    yield piece
                self.is_done = True
        finally:
            if not self.is_done:
                child.kill()
            answers.close()
            self.has_hung = child.wait() in _TIMES_UP

    def make_error(self, what: str, remedy: str) -> InputError:
        """Return the error for a child that ended too early, as `make_early_end`."""
        return make_early_end(what, remedy, has_hung=self.has_hung)


def make_early_end(what: str, remedy: str, *, has_hung: bool) -> InputError:
    """Return the error for a file at which a child ended; ``what`` names its format."""
    how = "does not end" if has_hung else "ends its process"
    msg = f"is {what} at which its reader {how}; it is damaged: {remedy}"
    return InputError(msg, has_hung=has_hung)


def serve(target: str, limits: tuple[float, float, float]) -> None:
    """Read a request from standard input, and write its pieces to standard output."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # The library's output must not mix with the pieces.
    answers = os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    seconds, whole, memory = limits
    _limit(memory, whole)
    module, function = _find_target(target)
    work = read_message(sys.stdin.buffer, list_records(module))
    _start_timer(seconds)
    with suppress(BrokenPipeError):
        last: object = None
        try:
            for piece in function(work):
                _start_timer(seconds)
                write_message(answers, piece)
        except MemoryError:
            last = InputError(
                f"takes more than {memory / 1e9:.1f} GB of memory; it is damaged, or say how much "
                "it may take (max_memory=)",
                option="max_memory",
                limit=memory,
            )
        except Exception as error:  # noqa: BLE001 - the parent raises it again
            last = error
        write_message(answers, last)
    os._exit(0)  # without the library's cleanup


def _find_target(target: str) -> tuple[ModuleType, Any]:
    name, _, function = target.partition(":")
    module = import_module(name)
    return module, getattr(module, function)


def _start_timer(seconds: float) -> None:
    # By its default the signal ends the process, also in the midst of C++. Windows has none.
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _limit(memory: float, seconds: float) -> None:
    """Limit memory and processor time, so that the library fails and not the machine."""
    with suppress(ImportError, ValueError, OSError):
        import resource  # noqa: PLC0415 - not on Windows

        held = find_memory()
        most = {
            "RLIMIT_CORE": 0,
            "RLIMIT_AS": held,
            "RLIMIT_DATA": min(memory + _PACKAGES, held),
            "RLIMIT_CPU": seconds + 1,
        }
        for name, limit in most.items():
            number = getattr(resource, name)
            hard = resource.getrlimit(number)[1]
            value = int(limit) if hard == resource.RLIM_INFINITY else min(int(limit), hard)
            resource.setrlimit(number, (value, hard))
