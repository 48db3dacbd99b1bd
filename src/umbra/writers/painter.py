"""
Separate processes for pictures, so that loading matplotlib overlaps with counting.

One child loads the modules, once, and forks where the system does so safely: as many pictures
are drawn at once as there are cores. It is a plain child with pipes, not a process pool: a pool
runs the caller's main module again, and its workers outlive a killed parent. These end with
their input, however the parent ends.
"""

import atexit
import gc
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partialmethod
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import IO, TYPE_CHECKING, Any, Self

from umbra.errors import UmbraError
from umbra.machine import HOME, count_cores, make_command
from umbra.packages import load_named

if TYPE_CHECKING:
    from umbra.writers.picture_content import DayShadows, Plan

__all__ = ["Painter"]

CHILD = (
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    "from umbra.writers.painter import serve; serve()"
)
_MOST_PENS = 4


Job = Future[None]


@dataclass(frozen=True)
class _Pen:
    """The pipes to a process that draws one picture at a time."""

    jobs: IO[bytes]
    answers: IO[bytes]

    def draw(self, job: tuple[str, Path, tuple, dict]) -> BaseException | None:
        """Have a picture drawn; return the error that it raised."""
        pickle.dump(job, self.jobs, protocol=5)
        self.jobs.flush()
        error: BaseException | None = pickle.load(self.answers)
        return error

    def close(self) -> None:
        """End the process's input, and wait until it has ended."""
        with suppress(OSError):
            self.jobs.close()
        self.answers.read()
        self.answers.close()


class Painter:
    """
    Draws pictures in child processes, started at once: several together, as cores allow.

    Where no process can be started, or it ends before its time, this one draws. Leaving the
    ``with`` block waits for the pictures and raises the first error among them; leaving it by an
    exception ends the children at once. While it waits, ``advance`` is told how many of all are
    drawn. Each picture is written with every one of the ``endings``, whichever its path has;
    without any there is no child, and nothing can be drawn.
    """

    def __init__(
        self,
        endings: Sequence[str] = ("png",),
        advance: Callable[[int, int], object] = lambda _done, _of: None,
    ) -> None:
        self._endings, self._advance = tuple(endings), advance
        self._futures: list[Job] = []
        self._is_ending = False
        self._drawing_here = Lock()
        self._child: subprocess.Popen[bytes] | None = None
        self._pens: list[_Pen] = []
        if sys.executable and endings:
            with suppress(OSError):
                self._start(min(count_cores(), _MOST_PENS) if sys.platform == "linux" else 1)
        self._free: SimpleQueue[_Pen | None] = SimpleQueue()
        pens: Sequence[_Pen | None] = self._pens or [None]
        for pen in pens:
            self._free.put(pen)
        self._threads = ThreadPoolExecutor(max(len(self._pens), 1), "umbra-painter")

    def _start(self, count: int) -> None:
        """Start the child, which serves its own pipes, and a fork for each further pair."""
        theirs: list[int] = []
        pens: list[_Pen] = []
        try:
            for _ in range(count - 1):
                (from_me, jobs), (answers, to_me) = os.pipe(), os.pipe()
                theirs += [from_me, to_me]
                pens.append(_Pen(os.fdopen(jobs, "wb"), os.fdopen(answers, "rb")))
            # A group of their own, so that all can be ended together.
            group: dict[str, Any] = {"pass_fds": theirs, "process_group": 0} if theirs else {}
            self._child = child = subprocess.Popen(
                make_command(CHILD, *map(str, theirs)), cwd=HOME,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, **group,
            )  # fmt: skip
        finally:
            for descriptor in theirs:
                os.close(descriptor)
            if self._child is None:
                for pen in pens:
                    pen.close()
        if child.stdin and child.stdout:
            self._pens = [_Pen(child.stdin, child.stdout), *pens]

    def draw_profile(
        self, path: Path, plan: "Plan", days: "Sequence[DayShadows]", **options: Any
    ) -> Job:
        """Draw with ``profile.make_profile_sheet``; reads all shadows here."""
        from umbra.writers.pixels import PackedMasks  # noqa: PLC0415  (the child starts before)

        packed = [replace(day, shadows=PackedMasks(day.shadows)) for day in days]
        return self._submit(
            "umbra.writers.profile:make_profile_sheet", path, plan, packed, **options
        )

    def wait(self) -> None:
        """Wait until every picture is a complete file."""
        for done, future in enumerate(self._futures):
            self._advance(done, len(self._futures))
            future.result()

    def _submit(self, name: str, path: Path, *args: Any, **options: Any) -> Job:
        path = Path(path).absolute()  # the child has another working folder
        for ending in self._endings:
            job = (name, path.with_suffix(f".{ending}"), args, options)
            future = self._threads.submit(self._call, job)
            self._futures.append(future)
        return future

    draw_hours = partialmethod(_submit, "umbra.writers.hours_map:make_hours_sheet")
    draw_points = partialmethod(_submit, "umbra.writers.point_map:make_points_sheet")
    draw_measure = partialmethod(_submit, "umbra.writers.measure_map:make_measure_sheet")
    draw_measured_points = partialmethod(
        _submit, "umbra.writers.measure_map:make_measured_points_sheet"
    )
    draw_who = partialmethod(_submit, "umbra.writers.caster_map:make_who_sheet")
    draw_elevations = partialmethod(_submit, "umbra.writers.elevations:make_elevations_sheet")

    def _call(self, job: tuple[str, Path, tuple, dict]) -> None:
        """Have a free child draw; without one, or if it ends before its time, draw here."""
        pen, error = self._free.get(), None
        try:
            if pen is not None:
                error = pen.draw(job)
        except (OSError, EOFError, pickle.UnpicklingError):
            pen = None
        finally:
            self._free.put(pen)
        if error is not None:
            raise error
        if pen is None and not self._is_ending:
            with self._drawing_here:  # matplotlib's settings are the whole process's
                _run(*job)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._is_ending = kind is not None
        try:
            if kind is None:
                self.wait()
        except BaseException:
            self._is_ending = True
            raise
        finally:
            if self._is_ending:
                self._kill()
            self._threads.shutdown(cancel_futures=True)
            for pen in self._pens:
                pen.close()
            if self._child is not None:
                self._child.wait()

    def _kill(self) -> None:
        """End the child and its forks."""
        if self._child is None:
            return
        if len(self._pens) > 1:
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)
        self._child.kill()


def _run(name: str, path: Path, args: tuple, options: dict) -> None:
    load_named(name)(*args, **options).save(path)


def serve() -> None:
    """Load the picture modules, then do jobs until they end; a fork serves each further pair."""
    atexit.register(gc.freeze)  # searching all objects for garbage would take 0.05 s at the end
    pipes = [(os.dup(0), os.dup(1)), *zip(*[map(int, sys.argv[1:])] * 2, strict=True)]
    # Libraries must read no jobs, and their output must not mix with the answers.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    try:
        for module in ("umbra.writers.hours_map", "umbra.writers.profile"):
            import_module(module)
        import_module("umbra.writers.paper").load_fonts()
    except UmbraError:  # the parent, which draws what no child does, tells it
        return
    pipe = pipes[0]
    for pair in pipes[1:]:
        if not os.fork():
            pipe = pair
            break
    for pair in pipes:
        if pair != pipe:  # else no one would see that its process ended
            os.close(pair[0])
            os.close(pair[1])
    with (
        suppress(BrokenPipeError),  # of what is left to write as it closes
        os.fdopen(pipe[0], "rb") as jobs,
        os.fdopen(pipe[1], "wb") as answers,
    ):
        _do(jobs, answers)


def _do(jobs: IO[bytes], answers: IO[bytes]) -> None:
    """Draw picture after picture until the jobs end."""
    with suppress(EOFError, BrokenPipeError, pickle.UnpicklingError):
        while True:
            job = pickle.load(jobs)
            error: BaseException | None = None
            try:
                _run(*job)
            except Exception as raised:  # noqa: BLE001  (the parent raises it again)
                error = raised
            pickle.dump(error, answers)
            answers.flush()
