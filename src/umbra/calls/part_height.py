"""``umbra.part_height``: the greatest height of a part of the model that keeps rules."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import Any, ParamSpec, Protocol

from umbra.calls.envelope import read_chosen, read_given
from umbra.calls.massing_options import PartOptions
from umbra.errors import check_type
from umbra.land.named_land import NamedLand
from umbra.massing.bisection import PartHeight, search_part_height
from umbra.massing.gathered_points import GatheredPoints
from umbra.scene import Scene
from umbra.signatures import takes
from umbra.study.options import StudyOptions
from umbra.sun import Site
from umbra.verdicts.sunlight import Model, check_year

__all__ = ["part_height"]

P = ParamSpec("P")


class PartCall(Protocol[P]):
    """The signature of ``umbra.part_height``."""

    def __call__(
        self, scene: Scene, site: Site, part: str, *_: P.args, **options: P.kwargs
    ) -> PartHeight: ...


def _take(record: Callable[P, PartOptions]) -> Callable[[Any], PartCall[P]]:
    return takes(record, "a height")


@_take(PartOptions)
def part_height(scene: Scene, site: Site, part: str, *, options: PartOptions) -> PartHeight:
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
    options : PartOptions
        Each by its name.

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
    chosen, given = read_chosen(options.rules), read_given(options.points, options.names)
    far = NamedLand.of(options.horizon, options.horizon_from)
    study = StudyOptions(
        date="2026-03-21", cast=options.cast, no_cast=options.no_cast, threads=options.threads,
        ground=options.ground, horizon=far.settle(scene.model_bounds(), site),
    )  # fmt: skip
    when = check_year(options.year or dt.date.today().year)

    def gather(changed: Scene) -> GatheredPoints:
        model = Model(scene=changed, site=site, year=when, options=study, proposed=(part,))
        return GatheredPoints(
            model, areas=options.areas, windows=options.windows, plot=options.plot,
            roads=options.roads, points=given,
        )  # fmt: skip

    return search_part_height(scene, part, chosen, gather, options.highest)
