"""Judging single points one by one, and sampled surfaces part by part."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.scene import Scene
from umbra.study import PointStudy
from umbra.study.model import Casting, prepare_casting
from umbra.study.period import Period, make_period
from umbra.study.rules.judge import (
    Finder,
    Verdict,
    find_day,
    measure,
    meets_limit,
    pick_hours,
    say_hours,
    say_how,
    say_limit,
    say_spells,
)
from umbra.study.rules.read import Check, Rules
from umbra.study.spells import Spells

__all__ = ["judge_points"]

_CHUNK = 65_536  # points that are measured at a time
_STEEP = 60.0  # tilt from which a surface is a wall [degrees]


def judge_points(
    study: PointStudy, rules: Rules, scene: Scene, casters: Sequence[int], threads: int
) -> list[Verdict]:
    """
    Measure and judge every check at a study's points.

    Given points are judged one by one; of sampled surfaces it is judged for each part
    how much of its area, or of that of its roofs or walls, meets the limit.

    Parameters
    ----------
    study : PointStudy
    rules : Rules
    scene : Scene
        That was studied.
    casters : sequence of int
        Parts that cast.
    threads : int

    Returns
    -------
    verdicts : list of Verdict

    Raises
    ------
    InputError
        If a check names places, which are for plans, or what was not sampled.
    """
    casting = prepare_casting(scene, list(casters), threads, study.model.canopy)
    points = study.places.points - scene.origin
    verdicts: list[Verdict] = []
    for check in rules.checks:
        _check_where(study, check)
        for date in check.dates:
            day = find_day(study.period, check, date)
            period = make_period(
                day, check.start, check.end, check.every, study.period.site,
                refraction=study.period.refraction,
            )  # fmt: skip
            parts = [
                _measure(casting, points[some], study.places.normals[some], check, period)
                for some in (slice(k, k + _CHUNK) for k in range(0, len(points), _CHUNK))
            ]
            judged = _judge_parts if study.receivers == "surfaces" else _judge_each
            verdicts += judged(study, check, period, parts)
    return verdicts


def _check_where(study: PointStudy, check: Check) -> None:
    """Refuse what lies on no point or surface of the study."""
    if check.places:
        msg = (
            f"check '{check.name}' names places of a plan; leave 'where' out: the points are those "
            "of the study"
        )
        raise InputError(msg)
    if check.area not in {"roofs", "walls"}:
        return
    if study.samples is None:
        msg = (
            f"check '{check.name}' names {check.area} of a model; leave 'where' out: the points "
            "are those of the study"
        )
        raise InputError(msg)
    if not _find_area(study, check).any():
        msg = (
            f"check '{check.name}' finds no {check.area} among what is sampled; choose parts that "
            "have some with on=, or leave 'where' out"
        )
        raise InputError(msg)


def _find_area(study: PointStudy, check: Check) -> NDArray[np.bool_]:
    """Tell which samples lie on what a check names: walls are steep, roofs are not."""
    owner = np.asarray(study.more["surface_of_sample"][1])
    is_wall = np.asarray(study.more["surface_tilt"][1])[owner] >= _STEEP
    if check.area == "walls":
        return is_wall
    return ~is_wall if check.area == "roofs" else np.ones(len(owner), np.bool_)


def _measure(
    casting: Casting, points: NDArray, normals: NDArray, check: Check, period: Period
) -> Spells:
    def look_through(tree: FaceTree) -> Finder:
        return lambda suns: find_hidden(tree, points, normals, suns, casting.threads)

    solid = None if casting.canopy is None else look_through(casting.solid.tree)
    return measure(check, period, (len(points),), look_through(casting.tree), casting.canopy, solid)


def _judge_each(
    study: PointStudy, check: Check, period: Period, parts: list[Spells]
) -> Iterator[Verdict]:
    """Give a verdict for each point."""
    n = 0
    given = study.more.get("name")
    for spells in parts:
        hours = pick_hours(check, period, spells)
        passes = meets_limit(check, hours)
        for k in range(len(hours)):
            n += 1
            yield Verdict(
                check.name,
                period.days[0],
                str(given[1][n - 1]) if given is not None else f"point {n}",
                say_limit(check),
                say_hours(float(hours[k])),
                bool(passes[k]),
                f"{say_spells(period.site.zone, spells, (k,))}; {say_how(check)}",
            )


def _judge_parts(
    study: PointStudy, check: Check, period: Period, parts: list[Spells]
) -> Iterator[Verdict]:
    """Give a verdict for each part by the share of its area."""
    hours = np.concatenate([pick_hours(check, period, spells) for spells in parts])
    passes = meets_limit(check, hours)
    arrays = {name: np.asarray(array) for name, (_, array) in study.more.items()}
    owner = arrays["surface_part"][arrays["surface_of_sample"]]
    area = arrays["area"] * _find_area(study, check)
    what = f" of its {check.area}" if check.area in {"roofs", "walls"} else ""
    for k, name in enumerate(arrays["part"].tolist()):
        mine = (owner == k) & (area > 0)
        whole = float(area[mine].sum())
        if not whole > 0:
            continue
        share = 100 * float(area[mine & passes].sum()) / whole
        mean = float(np.average(hours[mine], weights=area[mine]))
        least, most = float(hours[mine].min()), float(hours[mine].max())
        yield Verdict(
            check.name,
            period.days[0],
            str(name),
            f"{say_limit(check)} on {check.share:g} % of the area{what}",
            f"{share:.1f} % of the area{what}",
            share >= check.share - 1e-9,
            f"{share * whole / 100:,.1f} of {whole:,.1f} m²; mean {say_hours(mean)}, "
            f"{say_hours(least)} to {say_hours(most)}; {say_how(check)}",
        )
