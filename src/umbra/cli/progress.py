"""A bar on the error stream, if that is a terminal: what is done now, and the time left."""

import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from umbra.printable import make_printable, shorten

__all__ = ["Stages", "name_reading", "show_progress"]

_SLOW = 2.0  # [s]
_FIRST_RUN = "preparing; a first run compiles its kernels, later ones start at once"


class Stages:
    """Stages of work that no one watches."""

    def begin(self, what: str) -> None:
        """Begin work whose length is not known."""

    def advance(self, done: int, everything: int) -> None:
        """Tell how many instants are counted, and of how many."""


def name_reading(files: Sequence[str]) -> str:
    """Say what is read."""
    words = f"reading {files[0] if len(files) == 1 else f'{len(files)} files'}"
    return shorten(make_printable(words))


@contextmanager
def show_progress(quiet: bool) -> Iterator[Stages]:
    """
    Show stages while the block runs; the terminal is as it was afterwards.

    Parameters
    ----------
    quiet : bool
        Show nothing, as when the error stream is no terminal.

    Yields
    ------
    stages : Stages
        What is written to the error stream meanwhile comes above the bar.
    """
    if quiet or not sys.stderr.isatty():
        yield Stages()
        return
    with _make_bar() as bar:
        stages = _Watched(bar)
        try:
            yield stages
        finally:
            stages.end()


class _Watched(Stages):
    """Stages shown by a bar of Rich."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar
        self._task = bar.add_task("starting", total=None)
        self._is_counting = False
        self._notice: threading.Timer | None = None

    def begin(self, what: str) -> None:
        self._show(what, None)
        self._is_counting = False
        if what == "preparing":
            self._notice = threading.Timer(_SLOW, self._explain)
            self._notice.daemon = True
            self._notice.start()

    def advance(self, done: int, everything: int) -> None:
        if not self._is_counting:
            self._show("counting shadows", everything)
            self._is_counting = True
        self._bar.update(self._task, completed=done)

    def end(self) -> None:
        """Let go of the timer."""
        if self._notice is not None:
            self._notice.cancel()
            self._notice = None

    def _show(self, what: str, total: int | None) -> None:
        self.end()
        self._bar.remove_task(self._task)
        self._task = self._bar.add_task(what, total=total)

    def _explain(self) -> None:
        if self._notice is not None:
            self._bar.update(self._task, description=_FIRST_RUN)


def _make_bar() -> Any:
    """Make the bar; Rich takes 0.04 s to import, so only for someone who watches."""
    from rich.console import Console  # noqa: PLC0415
    from rich.progress import (  # noqa: PLC0415
        BarColumn,
        Progress,
        ProgressColumn,
        SpinnerColumn,
        Task,
        TextColumn,
    )
    from rich.text import Text  # noqa: PLC0415

    class Terminal(Console):
        def show_cursor(self, show: bool = True) -> bool:
            return False  # a run that is killed would leave it hidden

    class Bar(BarColumn):
        def render(self, task: Task) -> Any:
            return Text("") if task.total is None else super().render(task)

    class Left(ProgressColumn):
        max_refresh = 0.5

        def render(self, task: Task) -> Text:
            if task.total is None:
                return Text("")
            words = f"{task.completed:.0f} of {task.total:.0f} suns"
            if task.time_remaining is not None:
                minutes, seconds = divmod(int(task.time_remaining), 60)
                words += f", {minutes}:{seconds:02} left"
            return Text(words)

    return Progress(
        SpinnerColumn(style="yellow"),
        TextColumn("{task.description}", markup=False),
        Bar(complete_style="yellow", finished_style="yellow"),
        Left(),
        console=Terminal(stderr=True, highlight=False),
        redirect_stdout=False,
        refresh_per_second=5,
        transient=True,
    )
