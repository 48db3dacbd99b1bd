"""Measuring what a rule asks for, on its own dates and hours, and judging it."""

import datetime as dt
import zoneinfo
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene.grid import Grid
from umbra.study import Study
from umbra.study.period import Period, make_period
from umbra.study.spells import Spells, SpellState, to_hours
from umbra.writers.report.table import Table
from umbra.writers.rules.read import Check, Place, Rules

__all__ = ["Verdict", "judge", "make_verdict_table"]

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
    """

    check: str
    date: dt.date
    where: str
    wanted: str
    measured: str
    passes: bool
    evidence: str


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
        msg = f"rules are judged on a plan, and this study has --receivers {study.receivers}"
        raise InputError(msg)
    verdicts = []
    for check in rules.checks:
        for date in check.dates:
            day = _find_day(study, check, date)
            period = make_period(
                day, check.start, check.end, check.every, study.site, refraction=study.refraction
            )
            if check.places:
                for place in check.places:
                    verdicts.append(_judge_place(study, check, period, place))
            else:
                verdicts.append(_judge_area(study, check, period))
    return verdicts


def make_verdict_table(rules: Rules, verdicts: Sequence[Verdict]) -> Table:
    """Lay verdicts out for a report or a CSV file."""
    failed = sum(not verdict.passes for verdict in verdicts)
    outcome = "all pass" if not failed else f"{failed} of {len(verdicts)} fail"
    return Table(
        f"{rules.name}, {rules.version}: {outcome}",
        ("check", "date", "where", "wanted", "measured", "verdict", "evidence"),
        [
            (v.check, v.date.isoformat(), v.where, v.wanted, v.measured,
             "pass" if v.passes else "fail", v.evidence)
            for v in verdicts
        ],
        f"Source: {rules.source}",
    )  # fmt: skip


def _find_day(study: Study, check: Check, date: tuple[int | None, int, int]) -> dt.date:
    year, month, day = date
    try:
        return dt.date(year or study.period.days[0].year, month, day)
    except ValueError as error:
        msg = f"check '{check.name}': there is no {month:02}-{day:02} in the study's year"
        raise InputError(msg) from error


def _measure(study: Study, check: Check, period: Period, grid: Grid) -> Spells:
    """Let the instants that count pass over some cells."""
    sweep = study.model.make_tile(grid).make_counter()
    least = check.min_spell // dt.timedelta(microseconds=1)
    state = SpellState((grid.rows, grid.cols), least)
    counted = np.flatnonzero(period.sun.is_up & (period.sun.altitude >= check.min_altitude))
    starts, ends = period.starts, period.ends
    for first in range(0, len(counted), 8):
        some = counted[first : first + 8]
        masks = sweep.masks(period.sun.direction[some])
        state.add_steps(masks, starts[some], ends[some])
    return state.finish()


def _pick(check: Check, period: Period, spells: Spells) -> NDArray[np.float32]:
    """Give what the check measures [h]."""
    if check.measure == "longest_sun_hours":
        return to_hours(spells.longest)
    if check.measure == "sun_hours_in_spells":
        return to_hours(spells.counted)
    if check.measure == "shadow_hours":
        is_counted = period.sun.is_up & (period.sun.altitude >= check.min_altitude)
        return (period.hours[is_counted].sum() - to_hours(spells.sun)).astype(np.float32)
    return to_hours(spells.sun)


def _meets(check: Check, hours: NDArray[np.float32]) -> NDArray[np.bool_]:
    limit = check.limit.total_seconds() / 3600
    return hours >= limit - _SLACK if check.is_least else hours <= limit + _SLACK


def _judge_area(study: Study, check: Check, period: Period) -> Verdict:
    counts = _find_area(study, check)
    hours = np.zeros(counts.shape, np.float32)
    for rows, cols, tile in study.grid.tiles(_TILE):
        hours[rows, cols] = _pick(check, period, _measure(study, check, period, tile))
    found = hours[counts]
    share = 100 * float(_meets(check, found).mean())
    worst = np.flatnonzero(counts.ravel())[found.argmin() if check.is_least else found.argmax()]
    row, col = divmod(int(worst), counts.shape[1])
    area = found.size * study.grid.dx * study.grid.dy
    return Verdict(
        check.name,
        period.days[0],
        check.area.replace("_", " "),
        f"{_say_limit(check)} on {check.share:g} % of the area",
        f"{share:.1f} % of the area",
        share >= check.share - 1e-9,
        f"{share * area / 100:,.0f} of {area:,.0f} m²; mean {_say(float(found.mean()))}, "
        f"{'least' if check.is_least else 'most'} {_say(float(hours[row, col]))} "
        f"at x {study.x[col]:.1f}, y {study.y[row]:.1f}; {_say_how(check)}",
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
    hours = _pick(check, period, spells)
    first, last = spells.first[0, 0], spells.last[0, 0]
    evidence = "no sun"
    if not np.isnat(first):
        n = int(spells.count[0, 0])
        evidence = (
            f"{_say(float(to_hours(spells.sun)[0, 0]))} of sun in {n} spell{'s' if n > 1 else ''}, "
            f"from {_clock(study, first)} to {_clock(study, last)}"
        )
    return Verdict(
        check.name,
        period.days[0],
        place.name,
        _say_limit(check),
        _say(float(hours[0, 0])),
        bool(_meets(check, hours)[0, 0]),
        f"{evidence}; {_say_how(check)}",
    )


def _find_area(study: Study, check: Check) -> NDArray[np.bool_]:
    stands = study.heights > study.ground + 1e-6
    if check.area == "everywhere":
        return np.ones(stands.shape, bool)
    if check.area == "roofs" and study.receivers != "top":
        msg = f"check '{check.name}' is for roofs; run the study with --receivers top"
        raise InputError(msg)
    counts = stands if check.area == "roofs" else ~stands
    if not counts.any():
        msg = (
            f"check '{check.name}' finds no {check.area.replace('_', ' ')} in the plan; with a "
            "terrain name 'everywhere' or places"
        )
        raise InputError(msg)
    return counts


def _say(hours: float) -> str:
    minutes = round(hours * 60)
    h, m = divmod(minutes, 60)
    return f"{m} min" if not h and m else f"{h} h" + (f" {m} min" if m else "")


def _say_limit(check: Check) -> str:
    limit = check.limit.total_seconds() / 3600
    spells = f" of at least {_say(check.min_spell.total_seconds() / 3600)}"
    return (
        f"at {'least' if check.is_least else 'most'} {_say(limit)} of {_WORDS[check.measure]}"
        + (spells if check.min_spell else "")
    )


def _say_how(check: Check) -> str:
    altitude = f", sun at {check.min_altitude:g}° or higher" if check.min_altitude > 0 else ""
    return f"{check.start} to {check.end}, steps of {check.every}{altitude}"


def _clock(study: Study, instant: np.datetime64) -> str:
    local = instant.astype("datetime64[us]").item().replace(tzinfo=dt.UTC)
    return f"{local.astimezone(zoneinfo.ZoneInfo(study.site.zone)):%H:%M}"
