"""Timing contenders in turn: whatever slows the machine slows all of them."""

import gc
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self, TypeVar

import numpy as np

__all__ = ["Contender", "Spent", "Timing", "counted", "repeat_work", "run_in_turn", "timed"]

T = TypeVar("T")
Contender = Callable[[], float]
"""Does its work once and gives the seconds that count."""


class Spent(NamedTuple):
    """What some work took: by the clock, and of all processors together [s]."""

    wall: float
    processor: float


@dataclass(frozen=True)
class Timing:
    """
    How long a contender took.

    Parameters
    ----------
    median, least : float
        Of all its runs [s].
    processor : float, optional
        Median of the time that it kept processors busy, all of them together [s]:
        more than the clock's where threads work, and what a busy machine disturbs least.
    """

    median: float
    least: float
    processor: float | None = None

    @classmethod
    def of(cls, seconds: Sequence[float]) -> Self:
        """Return the timing of some runs [s]."""
        return cls(float(np.median(seconds)), min(seconds))

    def divide(self, by: float) -> "Timing":
        """Return the time of each of so many equal pieces of work."""
        return Timing(self.median / by, self.least / by)

    def to_ms(self, name: str = "") -> dict[str, float]:
        """Return the median and the least for programs, after the work's name [ms]."""
        return {f"{name}ms": 1e3 * self.median, f"{name}min_ms": 1e3 * self.least}


def timed(work: Callable[[], object], at_least: float = 0.0) -> Contender:
    """
    Let all of some work count.

    Work that is done over and over, as frames are, is repeated within its turn until
    ``at_least`` [s] have passed, and the mean counts: else it would always meet caches
    that its peer has filled.
    """
    return _repeat_in_turn(work, at_least, time.perf_counter)


def counted(work: Callable[[], object], at_least: float = 0.0) -> Contender:
    """
    Let the time count that some work kept processors busy, all of them together.

    For work on one thread: what waits for a busy machine's processors does not count.
    """
    return _repeat_in_turn(work, at_least, time.process_time)


def _repeat_in_turn(
    work: Callable[[], object], at_least: float, clock: Callable[[], float]
) -> Contender:
    def run() -> float:
        begun = clock()
        done = 0
        while not done or clock() - begun < at_least:
            work()
            done += 1
        return (clock() - begun) / done

    return run


def repeat_work(work: Callable[[], T], times: int) -> tuple[T, Timing]:
    """Do some work over and over; return its last result, and what it took by the clock."""
    taken = []
    for _ in range(times):
        begun = time.perf_counter()
        found = work()
        taken.append(time.perf_counter() - begun)
    return found, Timing.of(taken)


def run_in_turn(contenders: Mapping[str, Contender], repeat: int) -> dict[str, Timing]:
    """
    Run contenders A B C A B C ..., after one run of each that does not count.

    Parameters
    ----------
    contenders : dict of Contender
    repeat : int
        Runs of each that count.

    Returns
    -------
    timings : dict of Timing
    """
    seconds: dict[str, list[float]] = {name: [] for name in contenders}
    for run in contenders.values():
        run()
    gc.collect()
    for _ in range(repeat):
        for name, run in contenders.items():
            seconds[name].append(run())
    return {name: Timing.of(all_) for name, all_ in seconds.items()}
