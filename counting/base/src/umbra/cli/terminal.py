"""
Printing: the only module that writes text to a terminal.

Progress goes to the error stream: a terminal has a bar; a file or a pipe, such as a server's
log, a line now and then. Stages of a long run note interruptions and running out of memory.
"""

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import click

from umbra.errors import UmbraError, make_printable, shorten
from umbra.machine import FIRST_RUN, find_memory, listen_to_compiler, name_memory

__all__ = ["Stages", "echo", "echo_json", "echo_path", "name_reading", "show_progress"]

_EVERY = 20.0  # between lines [s]; a run that is shorter says nothing
COUNTING = "counting shadows"


class Stages:
    """
    Stages of work that no one watches.

    Compiled code calls back into Python here and there, and an exception that is raised
    there is lost, that of Ctrl-C as well. So it is noted, and raised at the next stage.
    """

    _is_interrupted = False
    _is_compiling = False
    _stage = ""
    _triangles = 0

    def begin(self, what: str) -> None:
        """Begin a stage of unknown length."""
        self._stage, self._is_compiling = what, False
        self.check()

    def show_scene(self, scene: Any) -> None:
        """Note how large the scene is, for the message if memory runs out."""
        self._triangles = sum(part.triangles for part in scene.parts)

    def advance(self, done: int, everything: int, what: str = COUNTING, unit: str = "suns") -> None:
        """Note how much of a stage is done; the first call begins it."""
        if self._stage != what:
            self.begin(what)
        self.check()

    def tell_compiling(self) -> None:
        """Note that a kernel is compiled, as in a first run."""
        self._is_compiling = True

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


def echo(text: object = "", *, err: bool = False) -> None:
    """
    Print lines without what would command a terminal, each cut at 500 letters.

    Parameters
    ----------
    text : object
    err : bool
        Whether to print to the error stream.
    """
    lines = make_printable(str(text)).split("\n")
    click.echo("\n".join(map(shorten, lines)), err=err)


def echo_path(path: str | os.PathLike[str]) -> None:
    """Print the full path of a file that was written; for scripts byte by byte."""
    text = os.fspath(path)
    is_watched = sys.stdout is not None and sys.stdout.isatty()
    click.echo(make_printable(text) if is_watched else text)


def echo_json(result: dict[str, Any]) -> None:
    r"""Print a result as one JSON object; what would command a terminal is written ``\u001b``."""
    import orjson  # noqa: PLC0415

    options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2
    try:
        text = orjson.dumps(result, option=options).decode()
    except orjson.JSONEncodeError:  # of a file's name that is no Unicode; json escapes it
        text = json.dumps(result, indent=2, default=lambda array: array.tolist())
    click.echo(make_printable(text, is_json=True))


def name_reading(files: Sequence[str]) -> str:
    """Describe the reading stage."""
    words = f"reading {files[0] if len(files) == 1 else f'{len(files)} files'}"
    return shorten(make_printable(words))


@contextmanager
def show_progress(quiet: bool) -> Iterator[Stages]:
    """
    Show stages while the block runs; the terminal is as it was afterwards.

    Parameters
    ----------
    quiet : bool
        Show nothing.

    Yields
    ------
    stages : Stages
        Text written to the error stream meanwhile comes above the bar.
    """
    stages: Stages
    if quiet or sys.stderr is None:
        stages = Stages()
    elif sys.stderr.isatty():
        stages = _Watched(_make_bar())
    else:
        stages = _Logged()
    with stages.noting_interrupts(), listen_to_compiler(stages.tell_compiling):
        try:
            yield stages
        except MemoryError as error:
            raise UmbraError(stages.explain_memory()) from error
        finally:
            stages.end()


class _Logged(Stages):
    """Stages of a long run, printed as lines now and then."""

    def __init__(self) -> None:
        self._stage = "starting"
        self._done: tuple[int, int, str] | None = None
        self._begun = 0.0
        self._has_told = False
        self._is_over = threading.Event()
        threading.Thread(target=self._tell, daemon=True).start()

    def begin(self, what: str) -> None:
        super().begin(what)
        self._done, self._begun = None, time.monotonic()

    def advance(self, done: int, everything: int, what: str = COUNTING, unit: str = "suns") -> None:
        super().advance(done, everything, what, unit)
        self._done = done, everything, unit

    def tell_compiling(self) -> None:
        super().tell_compiling()
        if not self._has_told:  # at once: nothing else is said while a first run is prepared
            self._has_told = True
            with suppress(OSError, ValueError):
                echo(f"umbra: {FIRST_RUN}", err=True)

    def end(self) -> None:
        self._is_over.set()

    def _tell(self) -> None:
        with suppress(OSError, ValueError):  # whoever read it has gone
            while not self._is_over.wait(_EVERY):
                echo(f"umbra: {self._show()}", err=True)

    def _show(self) -> str:
        done, everything, unit = self._done or (0, 1, "")
        if self._is_compiling and not done:
            return f"{self._stage}; compiling"
        if everything == 1:
            return self._stage
        words = f"{self._stage}: {done} of {everything} {unit}"
        if not done:
            return words
        left = (time.monotonic() - self._begun) * (everything / done - 1)
        minutes, seconds = divmod(int(left), 60)
        return f"{words}, {minutes}:{seconds:02} left"


class _Watched(Stages):
    """Stages shown as a progress bar."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar
        bar.start()
        self._task = bar.add_task("starting", total=None)

    def begin(self, what: str) -> None:
        super().begin(what)
        self._bar.remove_task(self._task)
        self._task = self._bar.add_task(what, total=None)

    def advance(self, done: int, everything: int, what: str = COUNTING, unit: str = "suns") -> None:
        is_new = self._stage != what  # a short stage is seen, too
        super().advance(done, everything, what, unit)
        self._bar.update(self._task, completed=done, total=everything, unit=unit, refresh=is_new)

    def tell_compiling(self) -> None:
        self._bar.update(self._task, description=f"{self._stage}; {FIRST_RUN}")

    def end(self) -> None:
        self._bar.stop()


def _make_bar() -> Any:
    """Make the bar; only on a terminal, since Rich takes 0.04 s to import."""
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
            if task.total is None or task.total == 1:
                return Text("")
            words = f"{task.completed:.0f} of {task.total:.0f} {task.fields['unit']}"
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
