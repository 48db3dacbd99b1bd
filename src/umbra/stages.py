"""Stages of a long work: what it does now, whether it was interrupted, what took the memory."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from umbra.machine import find_memory, name_memory

__all__ = ["Stages"]


class Stages:
    """
    Stages of work that no one watches.

    Compiled code calls back into Python here and there, and an exception that is raised
    there is lost, that of Ctrl-C as well. So it is noted, and raised at the next stage.
    """

    _is_interrupted = False
    _stage = ""
    _triangles = 0

    def begin(self, what: str) -> None:
        """Begin work whose length is not known."""
        self._stage = what
        self.check()

    def show_scene(self, scene: Any) -> None:
        """Tell how large the scene is, for when it is too large."""
        self._triangles = sum(part.triangles for part in scene.parts)

    def advance(self, done: int, everything: int) -> None:
        """Tell how many instants are counted, and of how many."""
        self._stage = "counting shadows"
        self.check()

    def end(self) -> None:
        """Let go of what shows them."""

    def check(self) -> None:
        """Raise the Ctrl-C that was pressed, if no one has heard of it."""
        if self._is_interrupted:
            raise KeyboardInterrupt

    @contextmanager
    def noting_interrupts(self) -> Iterator[None]:
        """Lose no Ctrl-C in the block."""
        is_main = threading.current_thread() is threading.main_thread()
        if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            yield  # the caller has other plans for it
            return
        signal.signal(signal.SIGINT, self._note)
        try:
            yield
            self.check()
        except Exception as error:  # what compiled code makes of it is anything
            if self._is_interrupted:
                raise KeyboardInterrupt from error
            raise
        finally:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def explain_memory(self) -> str:
        """Say what took the memory that there is not, and what would take less."""
        held = name_memory(find_memory())
        cut = "cut the model to what matters"
        if not self._triangles:
            return f"out of memory while {self._stage}: {held}; {cut}"
        return (
            f"out of memory while {self._stage}, with {self._triangles:,} triangles: {held}; "
            f"{cut}, or choose fewer cells or pixels, or a smaller threads="
        )

    def _note(self, number: int, frame: Any) -> None:
        self._is_interrupted = True
        signal.default_int_handler(number, frame)
