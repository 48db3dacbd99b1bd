"""
A reader's library in a child process, which may crash or hang without harm.

The child runs a generator of its target (``module:function``) and passes each piece on;
everything that is yielded must be picklable.
"""

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from typing import Any

from umbra.machine import HOME, find_memory, make_command

__all__ = ["ReadingChild", "serve"]

_CODE = "from umbra.readers.child import serve; serve({target!r}, {seconds}, {first})"


class ReadingChild:
    """
    Iterate over the pieces from a child; afterwards states whether they are complete.

    Parameters
    ----------
    target : str
        ``module:function``, called with ``work`` in the child, or here if Python has no program.
    work : object
    seconds : float
        Processor time after which the child is ended if no further piece came [s].
    first : float
        More of it until the first piece [s].
    """

    is_done = False
    has_hung = False

    def __init__(self, target: str, work: Any, seconds: float, first: float) -> None:
        self._target, self._work = target, work
        self._code = _CODE.format(target=target, seconds=seconds, first=first)

    def __iter__(self) -> Iterator[Any]:
        if not sys.executable:
            yield from _find_target(self._target)(self._work)
            self.is_done = True
            return
        command = make_command(self._code)
        child = subprocess.Popen(command, cwd=HOME, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        asked, answers = child.stdin, child.stdout
        assert asked is not None and answers is not None  # noqa: PT018
        try:
            with suppress(EOFError, BrokenPipeError, pickle.UnpicklingError):
                pickle.dump(self._work, asked)
                asked.close()
                while (piece := pickle.load(answers)) is not None:
                    if isinstance(piece, BaseException):
                        raise piece
                    yield piece
                self.is_done = True
        finally:
            if not self.is_done:
                child.kill()
            answers.close()
            self.has_hung = child.wait() == -getattr(signal, "SIGPROF", 0)


def serve(target: str, seconds: float, first: float) -> None:
    """Read a request from standard input, and write its pieces to standard output."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # The library's output must not mix with the pieces.
    answers = os.fdopen(os.dup(1), "wb")
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    _limit_memory()
    work = pickle.load(sys.stdin.buffer)
    _start_timer(seconds + first)
    with suppress(BrokenPipeError):
        last: object = None
        try:
            for piece in _find_target(target)(work):
                _start_timer(seconds)
                pickle.dump(piece, answers, protocol=5)
                answers.flush()
        except Exception as error:  # noqa: BLE001 - the parent raises it again
            last = error
        pickle.dump(last, answers)
        answers.flush()
    os._exit(0)  # without the library's cleanup


def _find_target(target: str) -> Any:
    module, _, function = target.partition(":")
    return getattr(import_module(module), function)


def _start_timer(seconds: float) -> None:
    # By its default the signal ends the process, also in the midst of C++. Windows has none.
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _limit_memory() -> None:
    """Limit memory, so that the library fails and not the machine."""
    with suppress(ImportError, ValueError, OSError):
        import resource  # noqa: PLC0415 - not on Windows

        memory = int(find_memory())
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
