"""Measuring what a rule asks for, on its own dates and hours, and judging it."""

import datetime as dt
import zoneinfo
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene.grid import Grid
from umbra.study import Study
from umbra.study.canopy import Canopy
from umbra.study.period import Period, make_period
from umbra.study.rules.read import Check, Place, Rules
from umbra.study.rules.standing import find_standing
from umbra.study.spells import Spells, SpellState, to_hours

__all__ = ["Verdict", "judge"]

Finder = Callable[[NDArray[np.float64]], NDArray[np.uint8]]

_TILE = 2048
_SLACK = 1e-4  # of sums of microseconds kept as float32 hours [h]
_WORDS = {
    "sun_hours": "sun",
    "longest_sun_hours": "unbroken sun",
    "sun_hours_in_spells": "sun in spells",
    "shadow_hours": "shadow",
}


@dataclass(frozen=True)
class Verdict:
    """
    A check's outcome on one date at one receiver.

    Parameters
    ----------
    check : str
    date : datetime.date
    where : str
        An area, or a place's name.
    wanted, measured : str
        In words, with units.
    passes : bool
    evidence : str
        What the verdict rests on.
    place : Place, optional
        Where a named place is.
    standing : str
        What it lies in, under or on: ``inside Church``.
    """

    check: str
    date: dt.date
    where: str
    wanted: str
    measured: str
    passes: bool
    evidence: str
    place: Place | None = None
    standing: str = ""


def judge(study: Study, rules: Rules) -> list[Verdict]:
    """
    Measure and judge every check of a rule file.

    Each is counted anew on its own dates, hours and steps, on the study's cells and
    receivers, whatever day the study itself shows.

    Parameters
    ----------
    study : Study
    rules : Rules

    Returns
    -------
    verdicts : list of Verdict
        A check and date after another; of places, one each.

    Raises
    ------
    InputError
        If a place lies outside the plan, a date or hour does not exist, or there is no
        such area.
    """
    if study.receivers not in {"ground", "top"}:
        msg = f"rules are judged on a plan, and this study has receivers={study.receivers!r}"
        raise InputError(msg)
    verdicts = []
    for check in rules.checks:
        for date in check.dates:
            day = find_day(study.period, check, date)
            period = make_period(
                day, check.start, check.end, check.every, study.site, refraction=study.refraction
            )
            if check.places:
                for place in check.places:
                    verdicts.append(_judge_place(study, check, period, place))
            else:
                verdicts.append(_judge_area(study, check, period))
    return verdicts


def find_day(studied: Period, check: Check, date: tuple[int | None, int, int]) -> dt.date:
    """Give a date of a check; one without a year lies in the study's."""
    year, month, day = date
    try:
        return dt.date(year or studied.days[0].year, month, day)
    except ValueError as error:
        msg = f"check '{check.name}': there is no {month:02}-{day:02} in the study's year"
        raise InputError(msg) from error


def _measure(study: Study, check: Check, period: Period, grid: Grid) -> Spells:
    """Let the instants that count pass over some cells."""
    tile = study.model.make_tile(grid)
    canopy = study.model.canopy
    solid = None if canopy is None else tile.with_casters().make_counter().masks
    shape = (grid.rows, grid.cols)
    return measure(check, period, shape, tile.make_counter().masks, canopy, solid)


def measure(
    check: Check,
    period: Period,
    shape: tuple[int, ...],
    find_masks: Finder,
    canopy: Canopy | None = None,
    find_solid: Finder | None = None,
) -> Spells:
    """
    Let the instants that a check counts pass over some receivers.

    Parameters
    ----------
    check : Check
    period : Period
        Of one date of the check.
    shape : tuple of int
        Of the receivers.
    find_masks : callable
        Tells for (n, 3) suns which receivers are in shadow, (n, ...) uint8.
    canopy : Canopy, optional
        What lets light through; hours behind it alone count by its share, and are in no
        spell.
    find_solid : callable, optional
        As ``find_masks``, without canopies.

    Returns
    -------
    spells : Spells
    """
    least = check.min_spell // dt.timedelta(microseconds=1)
    state = SpellState(shape, least)
    share = 0.0 if canopy is None else canopy.season.find_share(period.days[0])
    behind = np.zeros(shape, np.int64)
    counted = np.flatnonzero(period.sun.is_up & (period.sun.altitude >= check.min_altitude))
    starts, ends = period.starts, period.ends
    for first in range(0, len(counted), 8):
        some = counted[first : first + 8]
        masks = find_masks(period.sun.direction[some])
        if find_solid is not None:
            solid = find_solid(period.sun.direction[some])
            behind += np.tensordot((ends - starts)[some], masks & ~solid, 1)
            masks = solid if share >= 1 else masks
        state.add_steps(masks, starts[some], ends[some])
    spells = state.finish()
    return spells if find_solid is None else spells.add_behind(behind, share)


def pick_hours(check: Check, period: Period, spells: Spells) -> NDArray[np.float32]:
    """Give what the check measures [h]."""
    light = spells.sun if spells.light is None else spells.light
    if check.measure == "longest_sun_hours":
        return to_hours(spells.longest)
    if check.measure == "sun_hours_in_spells":
        return to_hours(spells.counted)
    if check.measure == "shadow_hours":
        is_counted = period.sun.is_up & (period.sun.altitude >= check.min_altitude)
        return (period.hours[is_counted].sum() - to_hours(light)).astype(np.float32)
    return to_hours(light)


def meets_limit(check: Check, hours: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Tell which hours are enough, or few enough."""
    limit = check.limit.total_seconds() / 3600
    return hours >= limit - _SLACK if check.is_least else hours <= limit + _SLACK


def _judge_area(study: Study, check: Check, period: Period) -> Verdict:
    counts = _find_area(study, check)
    hours = np.zeros(counts.shape, np.float32)
    for rows, cols, tile in study.grid.tiles(_TILE):
        hours[rows, cols] = pick_hours(check, period, _measure(study, check, period, tile))
    found = hours[counts]
    share = 100 * float(meets_limit(check, found).mean())
    worst = np.flatnonzero(counts.ravel())[found.argmin() if check.is_least else found.argmax()]
    row, col = divmod(int(worst), counts.shape[1])
    area = found.size * study.grid.dx * study.grid.dy
    return Verdict(
        check.name,
        period.days[0],
        check.area.replace("_", " "),
        f"{say_limit(check)} on {check.share:g} % of the area",
        f"{share:.1f} % of the area",
        share >= check.share - 1e-9,
        f"{share * area / 100:,.0f} of {area:,.0f} m²; mean {say_hours(float(found.mean()))}, "
        f"{'least' if check.is_least else 'most'} {say_hours(float(hours[row, col]))} "
        f"at x {study.x[col]:.1f}, y {study.y[row]:.1f}; {say_how(check)}",
    )


def _judge_place(study: Study, check: Check, period: Period, place: Place) -> Verdict:
    grid = study.grid
    shift_x, shift_y = study.x[0] - grid.x0, study.y[0] - grid.y0
    x, y = place.x - shift_x, place.y - shift_y
    col, row = round((x - grid.x0) / grid.dx), round((y - grid.y0) / grid.dy)
    if not (0 <= col < grid.cols and 0 <= row < grid.rows):
        msg = (
            f"the place '{place.name}' of check '{check.name}' at {place.x:g}, {place.y:g} lies "
            f"outside the plan; its extent is {study.x[0]:.6g} to {study.x[-1]:.6g}, "
            f"{study.y[0]:.6g} to {study.y[-1]:.6g}"
        )
        raise InputError(msg, place=place.name)
    # The point itself, not its cell's middle.
    spells = _measure(study, check, period, replace(grid, x0=x, y0=y, cols=1, rows=1))
    hours = pick_hours(check, period, spells)
    standing = find_standing(study, x, y)
    return Verdict(
        check.name,
        period.days[0],
        place.name,
        say_limit(check),
        say_hours(float(hours[0, 0])),
        bool(meets_limit(check, hours)[0, 0]),
        (f"{standing}: " if standing else "")
        + f"{say_spells(study.site.zone, spells, (0, 0))}; {say_how(check)}",
        place,
        standing,
    )


def _find_area(study: Study, check: Check) -> NDArray[np.bool_]:
    stands = study.heights > study.ground + 1e-6
    if check.area == "everywhere":
        return np.isfinite(study.heights)
    if check.area == "roofs" and study.receivers != "top":
        msg = f"check '{check.name}' is for roofs; run the study with receivers='top'"
        raise InputError(msg)
    if check.area == "walls":
        msg = f"check '{check.name}' is for walls; run the study with receivers='surfaces'"
        raise InputError(msg)
    counts = stands if check.area == "roofs" else ~stands & np.isfinite(study.heights)
    if not counts.any():
        msg = (
            f"check '{check.name}' finds no {check.area.replace('_', ' ')} in the plan; with a "
            "terrain name 'everywhere' or places"
        )
        raise InputError(msg)
    return counts


def say_hours(hours: float) -> str:
    """Write hours as a person says them."""
    minutes = round(hours * 60)
    h, m = divmod(minutes, 60)
    return f"{m} min" if not h and m else f"{h} h" + (f" {m} min" if m else "")


def say_limit(check: Check) -> str:
    """Say what is wanted."""
    limit = check.limit.total_seconds() / 3600
    spells = f" of at least {say_hours(check.min_spell.total_seconds() / 3600)}"
    return (
        f"at {'least' if check.is_least else 'most'} {say_hours(limit)} of {_WORDS[check.measure]}"
        + (spells if check.min_spell else "")
    )


def say_how(check: Check) -> str:
    """Say when and in what steps it was measured."""
    altitude = f", sun at {check.min_altitude:g}° or higher" if check.min_altitude > 0 else ""
    return f"{check.start} to {check.end}, steps of {check.every}{altitude}"


def say_spells(zone: str, spells: Spells, place: tuple[int, ...]) -> str:
    """Say when one receiver has sun."""
    first, last = spells.first[place], spells.last[place]
    behind = ""
    if spells.behind is not None and spells.behind[place] > 0:
        behind = f", {say_hours(float(to_hours(spells.behind)[place]))} more behind canopies"
    if np.isnat(first):
        return f"no sun{behind}"
    n = int(spells.count[place])
    hours = float(to_hours(spells.sun)[place])
    return (
        f"{say_hours(hours)} of sun in {n} spell{'s' if n > 1 else ''}, "
        f"from {read_clock(zone, first)} to {read_clock(zone, last)}{behind}"
    )


def read_clock(zone: str, instant: np.datetime64) -> str:
    """Read an instant off the local clock."""
    local = instant.astype("datetime64[us]").item().replace(tzinfo=dt.UTC)
    return f"{local.astimezone(zoneinfo.ZoneInfo(zone)):%H:%M}"
