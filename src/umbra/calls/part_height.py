"""``umbra.part_height``: the greatest height of a part of the model that keeps rules."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from umbra.calls.envelope import HIGHEST, check_highest, read_chosen, read_given
from umbra.errors import check_type
from umbra.land.settle import NamedLand
from umbra.massing.bisection import PartHeight, search_part_height
from umbra.massing.rule_asks import GatheredPoints
from umbra.rules import Rule
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.sun import Site
from umbra.verdicts.sunlight import Model, check_year

__all__ = ["part_height"]


def part_height(  # noqa: PLR0913  (each option by its name)
    scene: Scene,
    site: Site,
    part: str,
    *,
    rules: str | Path | Rule | Sequence[str | Path | Rule],
    highest: float = HIGHEST,
    areas: Any = None,
    windows: Any = None,
    points: ArrayLike | str | Path | None = None,
    names: Sequence[str] = (),
    plot: Any = None,
    year: int | None = None,
    cast: str | Sequence[str] = (),
    no_cast: str | Sequence[str] = (),
    ground: float | str | Path | None = None,
    horizon: Any = None,
    horizon_from: float | str | None = None,
    threads: int | None = None,
) -> PartHeight:
    """
    Find the greatest height of a part, scaled from its base, that keeps rules, to a centimetre.

    Each height that is tried is judged by the rules as ``umbra prove`` judges a proposal, so that
    every measure is taken.

    Parameters
    ----------
    scene : Scene
    site : Site
    part : str
        Shell pattern of its name.
    rules, highest, areas, windows, points, names, year, cast, no_cast, ground, horizon
        As ``umbra.envelope``.
    horizon_from, threads
        As ``umbra.envelope``.
    plot : optional
        For rules of bands around a plot.

    Returns
    -------
    height : PartHeight
        ``height_m``, ``binding`` (what breaks a centimetre higher), ``scene``.

    Raises
    ------
    InputError
        If there is no such part, it is flat, or a rule lacks what it needs.

    Examples
    --------
    >>> umbra.part_height(scene, site, "tower", rules="bre-209-gardens", areas="gardens.geojson")
    """
    check_type("scene", scene, Scene)
    check_type("site", site, Site)
    chosen, given = read_chosen(rules), read_given(points, names)
    land = NamedLand.of(horizon, horizon_from).settle(scene.model_bounds(), site)
    options = StudyOptions(
        date="2026-03-21", cast=cast, no_cast=no_cast, threads=threads,
        ground=str(ground) if isinstance(ground, Path) else ground, horizon=land,
    )  # fmt: skip
    when = check_year(year or dt.date.today().year)

    def gather(changed: Scene) -> GatheredPoints:
        model = Model(scene=changed, site=site, year=when, options=options, proposed=(part,))
        return GatheredPoints(model, areas=areas, windows=windows, plot=plot, points=given)

    return search_part_height(scene, part, chosen, gather, check_highest(highest))
