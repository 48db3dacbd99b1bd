"""Judging single points one by one, and sampled surfaces part by part."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.study.accumulators.intervals import SunIntervalTable
from umbra.study.loop import look
from umbra.study.period import Period
from umbra.study.result import Study
from umbra.study.rules.measure import (
    Verdict,
    measure,
    meets_limit,
    pick_hours,
    say_hours,
    say_how,
    say_intervals,
    say_limit,
)
from umbra.study.rules.read import Check

__all__ = ["judge_parts", "judge_points"]

_STEEP = 60.0  # tilt from which a surface is a wall [degrees]


def judge_points(study: Study, check: Check, period: Period) -> list[Verdict]:
    """Judge given points one by one."""
    _refuse_places(check)
    if check.area in {"roofs", "walls"}:
        msg = (
            f"check '{check.name}' names {check.area} of a model; leave 'where' out: the points "
            "are those of the study"
        )
        raise InputError(msg)
    given = study.more.get("name")
    verdicts: list[Verdict] = []
    for intervals in _measure(study, check, period):
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
    """Judge each part by the share of its area, or of that of its roofs or walls."""
    _refuse_places(check)
    is_named = _find_area(study, check)
    if not is_named.any():
        msg = (
            f"check '{check.name}' finds no {check.area} among what is sampled; choose parts that "
            "have some with on=, or leave 'where' out"
        )
        raise InputError(msg)
    found = [pick_hours(check, period, intervals) for intervals in _measure(study, check, period)]
    hours = np.concatenate(found)
    passes = meets_limit(check, hours)
    owner = study.more["surface_part"][1][study.more["surface_of_sample"][1]]
    area = np.asarray(study.more["area"][1]) * is_named
    what = f" of its {check.area}" if check.area in {"roofs", "walls"} else ""
    verdicts = []
    for k, name in enumerate(study.more["part"][1].tolist()):
        mine = (owner == k) & (area > 0)
        whole = float(area[mine].sum())
        if not whole > 0:
            continue
        share = 100 * float(area[mine & passes].sum()) / whole
        mean = float(np.average(hours[mine], weights=area[mine]))
        least, most = float(hours[mine].min()), float(hours[mine].max())
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


def _find_area(study: Study, check: Check) -> NDArray[np.bool_]:
    """Tell which samples lie on what a check names: walls are steep, roofs are not."""
    owner = np.asarray(study.more["surface_of_sample"][1])
    is_wall = np.asarray(study.more["surface_tilt"][1])[owner] >= _STEEP
    if check.area == "walls":
        return is_wall
    return ~is_wall if check.area == "roofs" else np.ones(len(owner), np.bool_)


def _measure(study: Study, check: Check, period: Period) -> Iterator[SunIntervalTable]:
    """Let the instants that a check counts pass over all points, some at a time."""
    canopy = study.model.canopy
    for _, tile in study.laid.look_again():
        yield measure(check, period, look(tile, canopy), canopy)
