"""
A process of its own for pictures, so that loading matplotlib overlaps with the counting.

It is a plain child with pipes rather than a process pool: a pool runs the caller's main
module again, and its workers outlive a parent that is killed. This child ends when its
input does, whatever ended the parent.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.children import HOME, make_command
from umbra.writers.plan import Plan
from umbra.writers.raster import PackedMasks

__all__ = ["Painter"]

MODULES = ("umbra.writers.hours", "umbra.writers.profile")
CHILD = (
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    "from umbra.writers.painter import serve; serve()"
)


class Painter:
    """
    Draws pictures one after another in a child process, which starts at once.

    Where no process can be started, or it ends before its time, this one draws. Leaving
    the ``with`` block waits for the pictures and raises the first error among them;
    leaving it by an exception ends the child at once.

    Parameters
    ----------
    endings : sequence of str
        Of ``umbra.writers.paper.ENDINGS``: each picture is written with every one of them,
        whichever its path has.
    """

    def __init__(self, endings: Sequence[str] = ("png",)) -> None:
        self._endings = tuple(endings)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="umbra-painter")
        self._futures: list[Future[None]] = []
        self._is_ending = False
        self._child: subprocess.Popen[bytes] | None = None
        if sys.executable:
            with suppress(OSError):
                self._child = subprocess.Popen(
                    make_command(CHILD), cwd=HOME, stdin=subprocess.PIPE, stdout=subprocess.PIPE
                )

    def draw_hours(
        self, path: os.PathLike[str], plan: Plan, hours: NDArray, *args: Any, **options: Any
    ) -> Future[None]:
        """Have ``umbra.writers.hours.draw_hours`` called; same parameters."""
        hours = np.asarray(hours, np.float32)
        return self._submit(MODULES[0], "draw_hours", (path, plan, hours, *args), options)

    def draw_hour_panels(
        self, path: os.PathLike[str], plan: Plan, days: Sequence[Any], *args: Any, **options: Any
    ) -> Future[None]:
        """Have ``umbra.writers.hours.draw_hour_panels`` called; same parameters."""
        job = (path, plan, list(days), *args)
        return self._submit("umbra.writers.hours", "draw_hour_panels", job, options)

    def draw_profile(
        self,
        path: os.PathLike[str],
        plan: Plan,
        shadows: Iterable[NDArray[np.bool_]],
        labels: Sequence[str],
        **options: Any,
    ) -> Future[None]:
        """Have ``umbra.writers.profile.draw_profile`` called; takes ``shadows`` here."""
        args = (path, plan, PackedMasks(shadows), list(labels))
        return self._submit(MODULES[1], "draw_profile", args, options)

    def draw_profiles(
        self,
        path: os.PathLike[str],
        plan: Plan,
        days: Iterable[tuple[str, Iterable[NDArray[np.bool_]], Sequence[str], NDArray | None]],
        **options: Any,
    ) -> Future[None]:
        """Have ``umbra.writers.profile.draw_profiles`` called; takes all shadows here."""
        packed = [
            (date, PackedMasks(shadows), list(labels), away) for date, shadows, labels, away in days
        ]
        return self._submit(MODULES[1], "draw_profiles", (path, plan, packed), options)

    def draw_points(self, path: os.PathLike[str], plan: Plan, *args: Any) -> Future[None]:
        """Have ``umbra.writers.point_map.draw_points`` called; same parameters."""
        return self._submit("umbra.writers.point_map", "draw_points", (path, plan, *args), {})

    def draw_point_panels(
        self, path: os.PathLike[str], plan: Plan, *args: Any, **options: Any
    ) -> Future[None]:
        """Have ``umbra.writers.point_map.draw_point_panels`` called; same parameters."""
        return self._submit(
            "umbra.writers.point_map", "draw_point_panels", (path, plan, *args), options
        )

    def draw_elevations(self, path: os.PathLike[str], *args: Any, **options: Any) -> Future[None]:
        """Have ``umbra.writers.elevations.draw_elevations`` called; same parameters."""
        return self._submit("umbra.writers.elevations", "draw_elevations", (path, *args), options)

    def wait(self) -> None:
        """Wait until every picture that was asked for is a complete file."""
        for future in self._futures:
            future.result()

    def _submit(self, module: str, name: str, args: tuple, options: dict) -> Future[None]:
        path, *rest = args
        path = Path(path).absolute()  # the child stands in another folder
        for ending in self._endings:
            job = (module, name, (path.with_suffix(f".{ending}"), *rest), options)
            future = self._thread.submit(self._call, job)
            self._futures.append(future)
        return future

    def _call(self, job: tuple[str, str, tuple, dict]) -> None:
        """Hand a job to the child and wait for its answer; without a child, do it here."""
        child = self._child
        if child is not None and child.stdin and child.stdout:
            try:
                pickle.dump(job, child.stdin, protocol=5)
                child.stdin.flush()
                error = pickle.load(child.stdout)
            except (OSError, EOFError, pickle.UnpicklingError):
                self._child = None
                if self._is_ending:
                    return
            else:
                if error is not None:
                    raise error
                return
        _run(*job)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        child = self._child
        self._is_ending = kind is not None
        try:
            if kind is None:
                self.wait()
        except BaseException:
            self._is_ending = True
            raise
        finally:
            if self._is_ending and child is not None:
                child.kill()
            self._thread.shutdown(cancel_futures=True)
            if child is not None:
                child.communicate()


def _run(module: str, name: str, args: tuple, options: dict) -> None:
    getattr(import_module(module), name)(*args, **options)


def serve() -> None:
    """Load the picture modules, then do jobs from standard input until it ends."""
    # What a library prints must not mix with the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    for module in MODULES:
        import_module(module)
    with suppress(EOFError, BrokenPipeError, pickle.UnpicklingError):
        while True:
            job = pickle.load(sys.stdin.buffer)
            error: BaseException | None = None
            try:
                _run(*job)
            except Exception as raised:  # noqa: BLE001  (the parent raises it again)
                error = raised
            pickle.dump(error, answers)
            answers.flush()
