"""
Separate process for pictures, so that loading matplotlib overlaps with counting.

It is a plain child with pipes, not a process pool: a pool runs the caller's main module
again, and its workers outlive a killed parent. This child ends with its input, however the
parent ends.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import partialmethod
from importlib import import_module
from pathlib import Path
from typing import Any, Self

from umbra.machine import HOME, make_command
from umbra.writers.pixels import PackedMasks
from umbra.writers.plan import DayShadows, Plan

__all__ = ["Painter"]

CHILD = (
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); "
    "from umbra.writers.painter import serve; serve()"
)


Job = Future[None]


class Painter:
    """
    Draws pictures in turn in a child process, started at once.

    Where no process can be started, or it ends before its time, this one draws. Leaving the
    ``with`` block waits for the pictures and raises the first error among them; leaving it by an
    exception ends the child at once. Each picture is written with every one of the ``endings``,
    whichever its path has; without any there is no child, and nothing can be drawn.
    """

    def __init__(self, endings: Sequence[str] = ("png",)) -> None:
        self._endings = tuple(endings)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="umbra-painter")
        self._futures: list[Job] = []
        self._is_ending = False
        self._child: subprocess.Popen[bytes] | None = None
        if sys.executable and endings:
            with suppress(OSError):
                self._child = subprocess.Popen(
                    make_command(CHILD), cwd=HOME, stdin=subprocess.PIPE, stdout=subprocess.PIPE
                )

    def draw_profile(
        self, path: Path, plan: Plan, days: Sequence[DayShadows], **options: Any
    ) -> Job:
        """Draw with ``profile.make_profile_sheet``; reads all shadows here."""
        packed = [replace(day, shadows=PackedMasks(day.shadows)) for day in days]
        return self._submit("profile.make_profile_sheet", path, plan, packed, **options)

    def wait(self) -> None:
        """Wait until every picture is a complete file."""
        for future in self._futures:
            future.result()

    def _submit(self, name: str, path: Path, *args: Any, **options: Any) -> Job:
        path = Path(path).absolute()  # the child has another working folder
        for ending in self._endings:
            job = (name, path.with_suffix(f".{ending}"), args, options)
            future = self._thread.submit(self._call, job)
            self._futures.append(future)
        return future

    draw_hours = partialmethod(_submit, "hours.make_hours_sheet")
    draw_points = partialmethod(_submit, "point_map.make_points_sheet")
    draw_elevations = partialmethod(_submit, "elevations.make_elevations_sheet")

    def _call(self, job: tuple[str, Path, tuple, dict]) -> None:
        """Send a job to the child and wait for its answer; without a child, do it here."""
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


def _run(name: str, path: Path, args: tuple, options: dict) -> None:
    module, _, function = name.partition(".")
    make = getattr(import_module(f"umbra.writers.{module}"), function)
    make(*args, **options).save(path)


def serve() -> None:
    """Load the picture modules, then do jobs from standard input until it ends."""
    # Output of libraries must not mix with the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    for module in ("hours", "profile"):
        import_module(f"umbra.writers.{module}")
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
