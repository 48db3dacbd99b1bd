"""
The shadow study: hours of shadow in every cell of a plan over a part of a day.

The period is cut into steps and each step is judged at its midpoint, so that hours
add up to exactly the period less the night. The profile is drawn at the steps' ends.
"""

import datetime as dt
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

import umbra
from umbra.errors import InputError
from umbra.scene import Scene
from umbra.study.asked import Answer, Asked
from umbra.study.counting import count_period
from umbra.study.exact import count_exactly
from umbra.study.layout import TILE, lay_out
from umbra.study.ledger import Ledger
from umbra.study.model import prepare_model
from umbra.study.options import (
    check_device,
    describe_period,
    find_reaching_suns,
    find_wanted,
    make_advance,
    select_casters,
)
from umbra.study.period import Refraction, make_period
from umbra.study.result import Study
from umbra.sun import Site

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["run_study", "shadow_study"]

RECEIVERS = ("ground", "top")
STREAMED_TILE = 1024
"""Side of the tiles of a study whose instants pass in order: each cell holds more then."""


def run_study(
    scene: Scene,
    site: Site,
    *,
    date: str | dt.date | Sequence[str | dt.date],
    start: str | dt.time = "09:00",
    end: str | dt.time = "17:00",
    every: str | dt.timedelta = "15min",
    every_days: int = 1,
    by_day: bool | None = None,
    spells: bool = False,
    min_spell: str | dt.timedelta | None = None,
    exact: bool | float = False,
    who: Sequence[str] = (),
    by: str | None = None,
    proposed: Sequence[str] = (),
    under: str | float | dt.timedelta = "2h",
    receivers: str = "ground",
    ground: float | None = None,
    extent: Sequence[float] | None = None,
    cell: float | None = None,
    size: tuple[int, int] | None = None,
    cast: Sequence[str] = (),
    no_cast: Sequence[str] = (),
    masks: bool = False,
    refraction: Refraction = "standard",
    device: str = "auto",
    threads: int | None = None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> Study:
    """
    Run a study and keep what its pictures need; see ``shadow_study``.

    ``progress`` is told how many instants are done, and of how many.
    """
    if receivers not in RECEIVERS:
        msg = f"unknown receivers '{receivers}'; choose ground or top"
        raise InputError(msg, receivers=receivers)
    threads = check_device(device, threads)
    period = make_period(
        date, start, end, every, site, every_days=every_days, refraction=refraction
    )
    wanted = find_wanted(
        period, by_day=by_day, spells=spells, min_spell=min_spell, masks=masks, exact=exact
    )
    casters = select_casters(scene, cast, no_cast)
    asked = Asked.of(scene, casters, who, by, proposed, under)

    begun = time.perf_counter()
    bounds = scene.bounds()
    ground = scene.ground if ground is None else ground
    level = float(bounds[0, 2]) if ground is None else float(ground)
    if not np.isfinite(level):
        msg = f"the ground's height must be a finite number; got {level:g}"
        raise InputError(msg, ground=ground)
    sun = period.sun
    suns = sun.direction[sun.is_up]
    grid, x, y = lay_out(
        bounds, find_reaching_suns(period), level, extent=extent, cell=cell, size=size,
        masks=(len(suns) + 7) // 8 if masks else 0, threads=threads,
        kept=wanted.bytes_kept(len(period.days)) + asked.bytes_kept,
    )  # fmt: skip
    origin = scene.origin
    local = replace(grid, x0=grid.x0 - origin[0], y0=grid.y0 - origin[1])
    model = prepare_model(scene, casters, receivers, level - origin[2], threads)
    ledger = Ledger(period, (grid.rows, grid.cols), wanted)
    heights = np.zeros((grid.rows, grid.cols))
    answer = Answer(asked, model, ledger)
    side = min(TILE, STREAMED_TILE) if wanted.is_streamed else TILE
    tiles = list(local.tiles(asked.limit_tiles(side)))
    works = len(suns) * (2 if asked.groups else 1)
    seconds = 0.0  # spent in counting
    for n, (rows, cols, grid_of_tile) in enumerate(tiles):
        tile = model.make_tile(grid_of_tile)
        sweep = tile.make_counter()
        heights[rows, cols] = tile.surface.heights
        if n == 0 and len(suns):  # one sun loads or compiles the kernels and makes the buffers
            sweep.add_steps(suns[:1], np.zeros(tile.shape, np.int32))
        advance = make_advance(progress, n * works, len(tiles) * works)
        started = time.perf_counter()
        if wanted.tolerance:
            count_exactly(sweep, tile.places, model.tree, tile.shape, ledger, (rows, cols), advance)
        else:
            count_period(sweep, tile.shape, ledger, (rows, cols), advance)
        answer.add(tile, (rows, cols), advance)
        seconds += time.perf_counter() - started
    heights += origin[2]
    facts: dict[str, object] = {
        "umbra_version": umbra.__version__,
        "command": "umbra.shadow_study",
        "source": "; ".join(f"{s.name} sha256:{s.sha256}" for s in scene.sources),
        "device": "cpu",
        "threads": threads,
        "crs": scene.crs,
        "receivers": receivers,
        "ground_z": level,
        "latitude": site.latitude,
        "longitude": site.longitude,
        "time_zone": site.zone,
        "true_north_deg": site.true_north,
        "refraction": refraction,
        **describe_period(period, wanted),
        **asked.facts,
        "prepare_seconds": time.perf_counter() - begun - seconds,
        "count_seconds": seconds,
    }
    return Study(
        x=x,
        y=y,
        period=period,
        shadow_hours=ledger.shadow_hours,
        up_hours=ledger.up_hours,
        heights=heights,
        ground=level,
        masks=ledger.masks,
        facts={name: fact for name, fact in facts.items() if fact is not None},
        model=model,
        grid=local,
        more={**ledger.variables(("y", "x")), **answer.variables(("y", "x"), grid.dx * grid.dy)},
    )


def shadow_study(scene: Scene, site: Site, **options: object) -> "xr.Dataset":
    """
    Find how long every cell of a plan lies in shadow on a day.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    site : Site
        Latitude, longitude, time zone and true north.
    date : str, date, or a sequence of them
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
    receivers : {'ground', 'top'}
        The plane z = ``ground``, or the topmost surface of the plan.
    ground : float, optional
        z of the ground [m]; the model's lowest point by default.
    extent : (4,) float, optional
        xmin, ymin, xmax, ymax in the model's own coordinates [m]; the model and its
        shadows by default.
    cell : float, optional
        Side of a cell [m]; or ``size``, (columns, rows).
    cast, no_cast : sequences of str
        Shell patterns of the names or kinds of parts that cast, or do not.
    masks : bool
        Keep every instant as ``in_shadow``.
    refraction : {'standard', 'none'}
        Whether the sun stands where it is seen (default) or where it is.
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
    """
    return run_study(scene, site, **options).to_dataset()  # type: ignore[arg-type]
