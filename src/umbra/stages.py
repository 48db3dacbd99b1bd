"""Stages of a long run: the current one, interruptions, and running out of memory."""

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
        """Begin a stage of unknown length."""
        self._stage = what
        self.check()

    def show_scene(self, scene: Any) -> None:
        """Note how large the scene is, for the message if memory runs out."""
        self._triangles = sum(part.triangles for part in scene.parts)

    def advance(self, done: int, everything: int) -> None:
        """Note how many instants of how many are counted."""
        self._stage = "counting shadows"
        self.check()

    def end(self) -> None:
        """Stop showing the stages."""

    def check(self) -> None:
        """Raise a Ctrl-C that was noted but not raised."""
        if self._is_interrupted:
            raise KeyboardInterrupt

    @contextmanager
    def noting_interrupts(self) -> Iterator[None]:
        """Note every Ctrl-C in the block, and raise it at the latest at its end."""
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
        """Describe what needed too much memory, and what would need less."""
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
