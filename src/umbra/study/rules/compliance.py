"""Judgement by rules: a share of a plan's area, named places, points or parts."""

import datetime as dt
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Period, make_period
from umbra.receivers.standing import find_crossings
from umbra.rules.first_format import Check, Rules
from umbra.rules.record import Place
from umbra.scene.grid import Grid
from umbra.study.accumulators.intervals import SunIntervalTable
from umbra.study.loop import make_tile_run
from umbra.study.result import Study
from umbra.study.rules.measurement import (
    Verdict,
    find_check_intervals,
    meets_limit,
    pick_hours,
    say_how,
    say_intervals,
    say_limit,
)
from umbra.sun.clock import say_hours

__all__ = ["judge", "judge_parts", "judge_points", "name_standing"]

_TILE = 2048
_SLACK = 1e-6  # surfaces at most this far above the ground count as ground [m]
_STEEP = 60.0  # tilt from which a surface is a wall [degrees]


def judge(study: Study, rules: Rules) -> list[Verdict]:
    """
    Measure and judge every check of a rule file.

    Each check is counted on its own dates, hours and steps, on the study's receivers.

    Parameters
    ----------
    study : Study
    rules : Rules

    Returns
    -------
    verdicts : list of Verdict
        In order of checks and dates; one for each place, point or part.

    Raises
    ------
    InputError
        If rules cannot judge such receivers, a place lies outside the plan, or a date, hour or
        area does not exist.
    """
    study.kind.check_judged(study.receivers)
    verdicts: list[Verdict] = []
    judge_one: Callable[[Any, Check, Period], list[Verdict]] = _judge_plan
    if not study.kind.is_plan:
        judge_one = judge_parts if study.kind.belongs_to_parts else judge_points
    for check in rules.checks:
        for date in check.dates:
            period = make_period(
                _find_day(study.period, check, date), check.start, check.end, check.every,
                study.site, refraction=study.refraction,
            )  # fmt: skip
            period = replace(period, horizon=study.period.horizon)
            verdicts += judge_one(study, check, period)
    return verdicts


def _find_day(studied: Period, check: Check, date: tuple[int | None, int, int]) -> dt.date:
    """Return a date of a check; without a year, in the study's year."""
    year, month, day = date
    try:
        return dt.date(year or studied.days[0].year, month, day)
    except ValueError as error:
        msg = f"check '{check.name}': there is no {month:02}-{day:02} in the study's year"
        raise InputError(msg) from error


def _judge_plan(study: Study, check: Check, period: Period) -> list[Verdict]:
    """Judge a check's places, one verdict each, or a share of the area."""
    if check.places:
        return [_judge_place(study, check, period, place) for place in check.places]
    return [_judge_area(study, check, period)]


def _judge_area(study: Study, check: Check, period: Period) -> Verdict:
    counts = _find_area(study, check)
    hours = np.zeros(counts.shape, np.float32)
    for rows, cols, tile in study.grid.tiles(_TILE):
        hours[rows, cols] = pick_hours(check, period, _measure_plan(study, check, period, tile))
    counted = hours[counts]
    share = 100 * float(meets_limit(check, counted).mean())
    worst = np.flatnonzero(counts.ravel())[counted.argmin() if check.is_least else counted.argmax()]
    row, col = divmod(int(worst), counts.shape[1])
    grid = study.grid
    wide, deep, area = grid.cols * grid.dx, grid.rows * grid.dy, counted.size * grid.dx * grid.dy
    return Verdict(
        check.name,
        period.days[0],
        check.area.replace("_", " "),
        f"{say_limit(check)} on {check.share:g} % of the area",
        f"{share:.1f} % of the area",
        share >= check.share - 1e-9,
        f"{share * area / 100:,.0f} of {area:,.0f} m² in a plan of {wide:,.0f} x {deep:,.0f} m; "
        f"mean {say_hours(float(counted.mean()))}, "
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
    # The point itself, not its cell's centre.
    intervals = _measure_plan(study, check, period, replace(grid, x0=x, y0=y, cols=1, rows=1))
    hours = pick_hours(check, period, intervals)
    standing = name_standing(study, x, y)
    return Verdict(
        check.name,
        period.days[0],
        place.name,
        say_limit(check),
        say_hours(float(hours[0, 0])),
        bool(meets_limit(check, hours)[0, 0]),
        (f"{standing}: " if standing else "")
        + f"{say_intervals(study.site.zone, intervals, (0, 0))}; {say_how(check)}",
        place,
        standing,
    )


def _find_area(study: Study, check: Check) -> NDArray[np.bool_]:
    stands = study.heights > study.ground + 1e-6
    if study.kind.lies_under_roofs and not study.kind.is_level:
        stands = ~study.kind.find_open(study)
    if check.area == "everywhere":
        return np.isfinite(study.heights)
    if check.area == "roofs" and not study.kind.has_roofs:
        msg = f"check '{check.name}' is for roofs; run the study with receivers='top'"
        raise InputError(msg, option="receivers")
    if check.area == "walls":
        msg = f"check '{check.name}' is for walls; run the study with receivers='surfaces'"
        raise InputError(msg, option="receivers")
    counts = stands if check.area == "roofs" else ~stands & np.isfinite(study.heights)
    if not counts.any():
        msg = (
            f"check '{check.name}' finds no {check.area.replace('_', ' ')} in the plan; with a "
            "terrain name 'everywhere' or places"
        )
        raise InputError(msg)
    return counts


def _measure_plan(study: Study, check: Check, period: Period, grid: Grid) -> SunIntervalTable:
    """Measure a check's instants on some cells."""
    run = make_tile_run(study.model.make_tile(grid), study.model.canopy)
    return find_check_intervals(check, period, run, study.model.canopy)


def name_standing(study: Study, x: float, y: float) -> str:
    """
    Describe the building that a place of a plan lies in, under or on: ``inside Church``.

    Counts where a vertical line through the place, in the scene's local frame [m], enters and
    leaves each part above the ground: a part left more often than entered holds the place.
    Empty in the open.
    """
    scene, soup = study.model.scene, study.model.soup
    near, z, turn = find_crossings(soup, x, y)
    names = np.array([scene.parts[part].name for part in soup.part[near]], object)
    ground = study.model.ground
    is_above = z > (-np.inf if ground is None else ground + _SLACK)
    if not is_above.any():
        return ""
    if not study.kind.lies_under_roofs:
        return f"on top of {names[z.argmax()]}"
    above = names[is_above]
    turns = {name: int(turn[is_above & (names == name)].sum()) for name in above}
    inside = [name for name, left in turns.items() if left != 0]
    lowest = above[z[is_above].argmin()]
    return f"inside {inside[0]}" if inside else f"under {lowest}"


def judge_points(study: Study, check: Check, period: Period) -> list[Verdict]:
    """Judge each given point."""
    _refuse_places(check)
    if check.area in {"roofs", "walls"}:
        msg = (
            f"check '{check.name}' names {check.area} of a model; leave 'where' out: the points "
            "are those of the study"
        )
        raise InputError(msg)
    given = study.more.get("name")
    verdicts: list[Verdict] = []
    for intervals in _measure_samples(study, check, period):
        hours = pick_hours(check, period, intervals)
        passes = meets_limit(check, hours)
        for k in range(len(hours)):
            n = len(verdicts)
            verdicts.append(
                Verdict(
                    check.name,
                    period.days[0],
                    f"point {n + 1}" if given is None else str(given[1][n]),
                    say_limit(check),
                    say_hours(float(hours[k])),
                    bool(passes[k]),
                    f"{say_intervals(study.site.zone, intervals, (k,))}; {say_how(check)}",
                )
            )
    return verdicts


def judge_parts(study: Study, check: Check, period: Period) -> list[Verdict]:
    """Judge each part by a share of its area, or of its roofs' or walls' area."""
    _refuse_places(check)
    is_named = _find_named(study, check)
    if not is_named.any():
        msg = (
            f"check '{check.name}' finds no {check.area} among what is sampled; choose parts that "
            "have some with on=, or leave 'where' out"
        )
        raise InputError(msg, option="on")
    pieces = [
        pick_hours(check, period, intervals) for intervals in _measure_samples(study, check, period)
    ]
    hours = np.concatenate(pieces)
    passes = meets_limit(check, hours)
    owner = study.more["surface_part"][1][np.asarray(study.more["surface_of_sample"][1])]
    area = np.asarray(study.more["area"][1]) * is_named
    what = f" of its {check.area}" if check.area in {"roofs", "walls"} else ""
    verdicts = []
    for k, name in enumerate(study.more["part"][1].tolist()):
        is_own = (owner == k) & (area > 0)
        whole = float(area[is_own].sum())
        if not whole > 0:
            continue
        share = 100 * float(area[is_own & passes].sum()) / whole
        mean = float(np.average(hours[is_own], weights=area[is_own]))
        least, most = float(hours[is_own].min()), float(hours[is_own].max())
        verdicts.append(
            Verdict(
                check.name,
                period.days[0],
                str(name),
                f"{say_limit(check)} on {check.share:g} % of the area{what}",
                f"{share:.1f} % of the area{what}",
                share >= check.share - 1e-9,
                f"{share * whole / 100:,.1f} of {whole:,.1f} m²; mean {say_hours(mean)}, "
                f"{say_hours(least)} to {say_hours(most)}; {say_how(check)}",
            )
        )
    return verdicts


def _refuse_places(check: Check) -> None:
    if check.places:
        msg = (
            f"check '{check.name}' names places of a plan; leave 'where' out: the points are those "
            "of the study"
        )
        raise InputError(msg)


def _find_named(study: Study, check: Check) -> NDArray[np.bool_]:
    """Find the samples that a check names: walls are steep, roofs are not."""
    owner = np.asarray(study.more["surface_of_sample"][1])
    is_wall = np.asarray(study.more["surface_tilt"][1])[owner] >= _STEEP
    if check.area == "walls":
        return is_wall
    return ~is_wall if check.area == "roofs" else np.ones(len(owner), np.bool_)


def _measure_samples(study: Study, check: Check, period: Period) -> Iterator[SunIntervalTable]:
    """Measure a check's instants on all points, in chunks."""
    canopy = study.model.canopy
    for _, make in study.laid.make_ray_tiles():
        yield find_check_intervals(check, period, make_tile_run(make(), canopy), canopy)
