"""
The shadow study: hours of shadow in every cell of a plan over a part of a day.

The period is cut into steps and each step is judged at its midpoint, so that hours
add up to exactly the period less the night. The profile is drawn at the steps' ends.
"""

import datetime as dt
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from umbra.errors import InputError
from umbra.receivers import find_kind
from umbra.scene import Scene
from umbra.study.call import check_names, check_scene, pick_options
from umbra.study.checks import find_reaching_suns
from umbra.study.layout import TILE, lay_out
from umbra.study.level import Level, describe_level, find_level
from umbra.study.model import prepare_model
from umbra.study.options import Date, Refraction, StudyOptions
from umbra.study.points import PointStudy, run_point_study
from umbra.study.result import Study
from umbra.study.setup import Progress, Setup
from umbra.study.terrain import choose_receivers, has_terrain
from umbra.study.view_study import run_camera, run_elevation
from umbra.study.views import find_direction
from umbra.sun import Site

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["run", "run_study", "shadow_study"]

PLANS = ("ground", "top")
STREAMED_TILE = 1024
"""Side of the tiles of a study whose instants pass in order: each cell holds more then."""


def run_study(
    scene: Scene,
    site: Site,
    *,
    receivers: str = "auto",
    ground: float | None = None,
    extent: Sequence[float] | None = None,
    cell: float | None = None,
    size: tuple[int, int] | None = None,
    eye: Sequence[float] | None = None,
    target: Sequence[float] | None = None,
    fov: float = 50.0,
    on: Sequence[str] = (),
    progress: Progress = lambda _done, _all: None,
    **options: Any,
) -> Study:
    """
    Run a study and keep what its pictures need; see ``shadow_study``.

    ``progress`` is told how many instants are done, and of how many.
    """
    if receivers == "auto":
        receivers = choose_receivers(scene, ground)
    direction = None if receivers in {*PLANS, "camera"} else find_direction(receivers)
    setup = Setup.of(scene, site, **options)
    level, assumed = find_level(scene, receivers, ground)
    has_end = receivers == "top" and assumed is not None and has_terrain(scene)
    if not np.isfinite(level):
        msg = f"the ground's height must be a finite number; got {level:g}"
        raise InputError(msg, ground=ground)
    shown = scene.select(on) if on else None
    if setup.canopy is not None and receivers not in PLANS:
        shown = setup.canopy.find_receivers(scene, on)
    if shown and receivers in PLANS:
        msg = "on= is for elevations, cameras and surfaces; a plan shows all parts"
        raise InputError(msg, on=on)
    if receivers == "camera":
        return run_camera(
            setup, level, eye=eye, target=target, fov=fov, size=size, shown=shown,
            progress=progress,
        )  # fmt: skip
    raster = {
        "extent": extent,
        "cell": cell,
        "size": size,
        "masks": setup.bytes_of_masks,
        "kept": setup.bytes_kept,
        "threads": setup.threads,
        "by_day": setup.wanted.by_day,
    }
    if direction is not None:
        return run_elevation(setup, direction, level, raster, shown, progress)
    return _run_plan(setup, receivers, level, raster, progress, assumed, has_end=has_end)


def _run_plan(
    setup: Setup,
    receivers: str,
    level: float,
    raster: dict[str, Any],
    progress: Progress,
    assumed: Level | None,
    *,
    has_end: bool,
) -> Study:
    """Run a study of the ground or of whatever is topmost."""
    scene = setup.scene
    origin = scene.origin
    model = prepare_model(
        scene, setup.casters, receivers, level - origin[2], setup.threads, setup.canopy,
        has_end=has_end,
    )  # fmt: skip
    corners = model.soup.find_corners() + origin
    if setup.canopy is not None:
        crowns = scene.triangles(setup.canopy.casting)
        corners = np.concatenate([corners, crowns.find_corners() + origin])
    # Where nothing receives beside a terrain no shadow has to be followed.
    reaching = np.zeros((0, 3)) if has_end else find_reaching_suns(setup.period)
    grid, x, y = lay_out(corners, reaching, level, **raster)
    local = replace(grid, x0=grid.x0 - origin[0], y0=grid.y0 - origin[1])
    heights = np.zeros((grid.rows, grid.cols))
    nothing, bare = np.zeros(heights.shape, np.bool_), np.zeros(heights.shape, np.bool_)
    side = min(TILE, STREAMED_TILE) if setup.wanted.is_streamed else TILE

    def make_tile(where: tuple[slice, slice], part: Any) -> Any:
        tile = model.make_tile(part)
        heights[where] = tile.surface.heights + origin[2]
        nothing[where] = tile.nothing
        bare[where] = tile.surface.face < 0
        return tile

    tiles = [
        ((rows, cols), partial(make_tile, (rows, cols), part))
        for rows, cols, part in local.tiles(setup.asked.limit_tiles(side, len(setup.period.days)))
    ]
    done = setup.count(model, heights.shape, tiles, progress)
    ledger, dims = done.ledger, ("y", "x")
    if nothing.any():
        heights[nothing] = np.nan
        ledger.blank(nothing)
        done.answer.blank(nothing)
    return Study(
        x=x,
        y=y,
        period=setup.period,
        shadow_hours=ledger.shadow_hours,
        up_hours=ledger.up_hours,
        heights=heights,
        ground=level,
        masks=ledger.masks,
        facts=setup.describe(
            receivers,
            done.seconds,
            ground_z=level,
            device=done.device,
            **describe_level(scene, receivers, level, assumed, (bare & ~nothing).mean()),
        ),
        model=model,
        grid=local,
        more={**ledger.variables(dims), **done.answer.variables(dims, grid.dx * grid.dy)},
    )


def run(
    scene: Scene,
    site: Site,
    options: StudyOptions,
    progress: Progress = lambda _done, _all: None,
) -> Study | PointStudy:
    """Run a study of any receivers; ``progress`` is told how many instants of how many are done."""
    way: Any = run_study if find_kind(options.receivers).is_raster else run_point_study
    return way(scene, site, progress=progress, **pick_options(options, way, Setup.of))


@check_names
def shadow_study(
    scene: Scene,
    site: Site,
    *,
    date: Date | Sequence[Date],
    start: str | dt.time = "09:00",
    end: str | dt.time = "17:00",
    every: str | dt.timedelta = "15min",
    every_days: int = 1,
    by_day: bool | None = None,
    refraction: Refraction = "standard",
    receivers: str = "auto",
    spacing: float = 0.5,
    on: str | Sequence[str] = (),
    points: ArrayLike | str | Path | None = None,
    names: Sequence[str] = (),
    eye: Sequence[float] | None = None,
    target: Sequence[float] | None = None,
    fov: float = 50.0,
    ground: float | None = None,
    extent: Sequence[float] | None = None,
    cell: float | None = None,
    size: Sequence[int] | None = None,
    cast: str | Sequence[str] = (),
    no_cast: str | Sequence[str] = (),
    canopy: str | Sequence[str] = (),
    transmissivity: str | float | Sequence[float] | None = None,
    leaf_on: str | None = None,
    by: Literal["part", "kind", "layer"] | None = None,
    who: str | Sequence[str] = (),
    proposed: str | Sequence[str] = (),
    under: str | float | dt.timedelta | None = None,
    spells: bool = False,
    exact: bool | float = False,
    min_spell: str | dt.timedelta | None = None,
    masks: bool = False,
    device: Literal["auto", "cpu", "gl"] = "auto",
    threads: int | None = None,
) -> "xr.Dataset":
    """
    Find how long every cell of a plan lies in shadow on a day.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    site : Site
        Latitude, longitude, time zone and true north.
    date : str, date, datetime64, Timestamp, or a sequence of them
        Local date, ``"2026-09-18"``; or several: joined by commas, a range
        ``"2026-03-21..2026-09-23"``, a month ``"2026-06"``, a year ``"2026"``, a day of
        every month ``"2026-*-21"``.
    every_days : int
        Of a range, a month or a year take every so many days.
    by_day : bool, optional
        Give every result for each date as well, along ``day``; up to 12 dates by default.
    start, end : str
        Local clock times, ``"09:00"`` and ``"17:00"`` by default.
    every : str
        Step, ``"15min"`` by default.
    spells : bool
        Also find first and last sun, the number of spells, the longest unbroken one and
        the shaded share of the time with the sun up.
    min_spell : str, optional
        Also the hours in spells of at least this length, ``"30min"``; implies ``spells``.
    exact : bool or float
        Solve when each cell enters and leaves shadow, and when the sun rises and sets, to
        a second (or so many) instead of adding up steps.
    who : sequence of str
        Shell patterns of parts; find the hours that are due to each pattern's parts.
    by : {'part', 'kind', 'layer'}, optional
        Find the hours due to each part, kind or layer: of all, or of those in ``who``.
    proposed : sequence of str
        Shell patterns of parts that are not there yet: find what they take from the others.
    under : str or float
        Where fewer hours of sun are left than this, but were not without ``proposed``.
    receivers : str
        ``'auto'`` (default): ``'top'`` where the model brings ground of its own and no
        ``ground`` is given, else ``'ground'``.
        ``'ground'``, the plane z = ``ground``; ``'top'``, the topmost surface of the plan;
        an elevation from ``'north'``, ``'east'``, ``'south'``, ``'west'`` or an azimuth such
        as ``'217'``; a view from above, ``'215/35'``; ``'camera'``; ``'surfaces'``;
        ``'points'``.
    eye, target : (3,) float, optional
        Of the camera [m]; with ``fov``, its vertical field of view [degrees].
    spacing : float
        Between the samples of surfaces, 0.5 by default [m].
    on : sequence of str
        Shell patterns of the parts that are sampled, or seen in an elevation or by the
        camera; all by default.
    points : (n, 3) or (n, 6) float, or path, optional
        Receivers 'points', with normals or without [m]; or a table of them.
    names : sequence of str
        Of the points.
    ground : float, optional
        z of the ground [m]; by default what the file says, else where the middle one of
        the model's buildings stands, and for ``'top'`` the lowest. What is assumed is told
        in the attributes ``assumption`` and ``assumed_ground_share``.
    extent : (4,) float, optional
        xmin, ymin, xmax, ymax in the model's own coordinates [m]; the model and its
        shadows by default.
    cell : float, optional
        Side of a cell [m]; or ``size``, (columns, rows).
    cast, no_cast : sequences of str
        Shell patterns of the names or kinds of parts that cast, or do not.
    canopy : sequence of str
        Shell patterns of casters that weaken the light instead of blocking it, such as
        trees; they receive nothing.
    transmissivity : float, str or (float, float), optional
        Share of the light that they let through, 0.03 by default; ``"0.03:0.5"`` with
        leaves and without.
    leaf_on : str, optional
        When leaves are on, both dates included: ``"04-15..10-31"``.
    masks : bool
        Keep every instant as ``in_shadow``.
    refraction : {'standard', 'none'}
        Whether the sun stands where it is seen (default) or where it is.
    device : {'auto', 'cpu', 'gl'}
        Where plans are counted; ``'auto'`` takes a GPU that proves faster on large ones.
    threads : int, optional
        All cores by default; results do not depend on it.

    Returns
    -------
    dataset : xarray.Dataset
        ``shadow_hours`` and ``sun_hours`` (y, x) [h], ``receiver_z`` [m], and the sun
        at each step's midpoint; see the contract in the docs.

    Raises
    ------
    InputError
        If an option is wrong, a pattern matches no part, or the raster is too large.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> site = umbra.find_site(scene)
    >>> study = umbra.shadow_study(scene, site, date="2026-03-21", receivers="top", cell=0.5)
    >>> study.shadow_hours.plot()
    >>> study.sun_hours.sel(x=2705, y=340092, method="nearest")
    """
    given = {name: value for name, value in locals().items() if name not in {"scene", "site"}}
    check_scene(scene, site)
    return run(scene, site, StudyOptions(**given)).to_dataset()
