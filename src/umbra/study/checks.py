"""What every kind of study makes of its options, whatever receives the shadows."""

import datetime as dt
from collections.abc import Callable, Sequence

from umbra.errors import InputError
from umbra.scene import Scene
from umbra.study.accumulators.arrays import FEW_DAYS, ResultOptions
from umbra.study.accumulators.exact import find_least_interval
from umbra.study.options import StudyOptions
from umbra.study.period import Period
from umbra.sun.clock import parse_duration

__all__ = [
    "describe_period",
    "find_results",
    "make_advance",
    "select_casters",
]

LEAST_TOLERANCE, MOST_TOLERANCE = 1e-3, 60
"""Within which instants can be solved [s]."""
_MICROSECOND = dt.timedelta(microseconds=1)


def select_casters(scene: Scene, cast: Sequence[str], no_cast: Sequence[str]) -> list[int]:
    """Give the indices of the parts that cast; there must be one."""
    casters = scene.select(cast, no_cast)
    if not casters:
        msg = "no part is left to cast a shadow; take a no_cast= pattern away"
        raise InputError(msg)
    return casters


def find_results(period: Period, options: StudyOptions) -> ResultOptions:
    """Find what is to be kept: ``min_spell`` implies ``spells``, few dates imply ``by_day``."""
    tolerance = float(options.exact)  # True is a second
    if not (tolerance == 0 or LEAST_TOLERANCE <= tolerance <= MOST_TOLERANCE):
        msg = f"exact instants are solved to 0.001 to 60 s; got {options.exact}"
        raise InputError(msg, exact=options.exact)
    least = 0
    if options.min_spell is not None:
        least = parse_duration(options.min_spell, "least spell") // _MICROSECOND
    by_day = options.by_day
    if by_day is None:
        by_day = 1 < len(period.days) <= FEW_DAYS
    return ResultOptions(by_day, options.spells or least > 0, least, options.masks, tolerance)


def describe_period(period: Period, results: ResultOptions) -> dict[str, object]:
    """Say in attributes what the time axis was, where it is more than one plain day."""
    facts: dict[str, object] = {}
    if len(period.days) > 1:
        facts["days"] = len(period.days)
        facts["first_date"] = str(period.days[0])
        facts["last_date"] = str(period.days[-1])
    if results.min_spell:
        facts["min_spell_minutes"] = results.min_spell / 6e7
    if results.tolerance:
        facts["exact_tolerance_seconds"] = results.tolerance
        facts["exact_least_spell_seconds"] = find_least_interval(period)
    return facts


def make_advance(
    progress: Callable[[int, int], object], tile: int, tiles: int, works: int
) -> Callable[[int], object]:
    """Turn progress within one of several tiles, of equal work, into progress of them all."""
    done = tile * works

    def advance(n: int) -> None:
        nonlocal done
        done += n
        progress(done, tiles * works)

    return advance
