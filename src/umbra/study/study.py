"""
The shadow study: hours of shadow in every cell of a plan over a part of a day.

The period is cut into steps and each step is judged at its midpoint, so that hours
add up to exactly the period less the night. The profile is drawn at the steps' ends.
"""

import datetime as dt
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

import umbra
from umbra.cpu.sweep import Sweep
from umbra.cpu.threads import count_cores
from umbra.errors import InputError
from umbra.scene import Scene
from umbra.scene.grid import Grid
from umbra.study.layout import TILE, lay_out
from umbra.study.model import Model, prepare_model
from umbra.sun import Site, Steps, SunPath, find_sun, make_steps

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Study", "run_study", "shadow_study"]

Refraction = Literal["standard", "none"]
RECEIVERS = ("ground", "top")


@dataclass(frozen=True, eq=False)
class Study:
    """
    A study's result and what its pictures are drawn from.

    Parameters
    ----------
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates, ascending [m].
    steps : Steps
        Of the period.
    sun : SunPath
        At the steps' midpoints.
    shadow_hours : (rows, cols) float32
    up_hours : float
        How long the sun was above the horizon [h].
    heights : (rows, cols) float64
        z of the topmost surface or the ground, in the model's own coordinates [m].
    ground : float
        z of the ground [m].
    masks : (n_steps, rows, cols) uint8, optional
        1 where in shadow at a midpoint; 0 at night.
    facts : dict
        What the result's attributes say.
    model : Model
    grid : Grid
        In the model's local frame.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    site: Site
    steps: Steps
    sun: SunPath
    shadow_hours: NDArray[np.float32]
    up_hours: float
    heights: NDArray[np.float64]
    ground: float
    masks: NDArray[np.uint8] | None
    facts: dict[str, object]
    model: Model
    grid: Grid

    @property
    def receivers(self) -> str:
        """What received the shadows: 'ground' or 'top'."""
        return str(self.facts["receivers"])

    @property
    def refraction(self) -> Refraction:
        """Where the sun was taken to stand: 'standard' or 'none'."""
        return "none" if self.facts["refraction"] == "none" else "standard"

    @property
    def sun_hours(self) -> NDArray[np.float32]:
        """Hours in the sun, (rows, cols) float32."""
        return np.float32(self.up_hours) - self.shadow_hours

    def variables(self) -> dict[str, tuple[tuple[str, ...], NDArray]]:
        """Give the arrays of ``study.nc`` by name, each with its dimensions."""
        plan = ("y", "x")
        receiver = np.full(self.heights.shape, self.ground)
        variables: dict[str, tuple[tuple[str, ...], NDArray]] = {
            "x": (("x",), self.x),
            "y": (("y",), self.y),
            "time": (("time",), self.steps.instants.astype("datetime64[ns]")),
            "xyz": (("xyz",), np.array(["x", "y", "z"])),
            "shadow_hours": (plan, self.shadow_hours),
            "sun_hours": (plan, self.sun_hours),
            "receiver_z": (plan, self.heights if self.receivers == "top" else receiver),
            "sun_altitude": (("time",), self.sun.altitude),
            "sun_azimuth": (("time",), self.sun.azimuth),
            "sun_direction": (("time", "xyz"), self.sun.direction),
        }
        if self.masks is not None:
            variables["in_shadow"] = (("time", *plan), self.masks)
        return variables

    def to_dataset(self) -> "xr.Dataset":
        """
        Give the result as a dataset, as ``study.nc`` reads back.

        Returns
        -------
        dataset : xarray.Dataset
        """
        import xarray as xr  # noqa: PLC0415  (half a second; scripts that only count do without)

        return xr.Dataset(self.variables(), attrs=self.facts)


def run_study(
    scene: Scene,
    site: Site,
    *,
    date: str | dt.date,
    start: str | dt.time = "09:00",
    end: str | dt.time = "17:00",
    every: str | dt.timedelta = "15min",
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
    if device not in {"auto", "cpu"}:
        msg = f"device '{device}' is not available; choose auto or cpu"
        raise InputError(msg, device=device)
    threads = count_cores() if threads is None else threads
    if threads < 1:
        msg = f"threads must be at least 1; got {threads}"
        raise InputError(msg, threads=threads)
    steps = make_steps(date, start, end, every, site.zone)
    sun = find_sun(site, steps.instants, refraction=refraction)
    stamps = find_sun(site, steps.stamps, refraction=refraction)
    casters = scene.select(cast, no_cast)
    if not casters:
        msg = "no part is left to cast a shadow; take a --no-cast pattern away"
        raise InputError(msg)

    begun = time.perf_counter()
    bounds = scene.bounds()
    level = float(bounds[0, 2]) if ground is None else float(ground)
    if not np.isfinite(level):
        msg = f"the ground's height must be a finite number; got {level:g}"
        raise InputError(msg, ground=ground)
    suns = sun.direction[sun.is_up]
    around = np.concatenate([suns, stamps.direction[stamps.is_up]])
    grid, x, y = lay_out(
        bounds, around, level, extent=extent, cell=cell, size=size,
        masks=len(sun.is_up) if masks else 0, threads=threads,
    )  # fmt: skip
    origin = scene.origin
    local = replace(grid, x0=grid.x0 - origin[0], y0=grid.y0 - origin[1])
    model = prepare_model(scene, casters, receivers, level - origin[2], threads)
    hours = np.zeros((grid.rows, grid.cols), np.float32)
    heights = np.zeros((grid.rows, grid.cols))
    kept = np.zeros((len(sun.is_up), grid.rows, grid.cols), np.uint8) if masks else None
    tiles = list(local.tiles(TILE))
    seconds = 0.0  # spent in counting
    for n, (rows, cols, tile) in enumerate(tiles):
        surface, sweep = model.make_sweep(tile)
        heights[rows, cols] = surface.heights
        if n == 0 and len(suns):  # one sun loads or compiles the kernels and makes the buffers
            sweep.add_steps(suns[:1], np.zeros((tile.rows, tile.cols), np.int32))

        def advance(done: int, before: int = n * len(suns)) -> None:
            progress(before + done, len(tiles) * len(suns))

        started = time.perf_counter()
        hours[rows, cols] = _count(
            sweep, steps, sun, None if kept is None else kept[:, rows, cols], advance
        )
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
        "prepare_seconds": time.perf_counter() - begun - seconds,
        "count_seconds": seconds,
    }
    return Study(
        x=x,
        y=y,
        site=site,
        steps=steps,
        sun=sun,
        shadow_hours=hours,
        up_hours=float(steps.hours[sun.is_up].sum()),
        heights=heights,
        ground=level,
        masks=kept,
        facts={name: fact for name, fact in facts.items() if fact is not None},
        model=model,
        grid=local,
    )


def _count(
    sweep: Sweep,
    steps: Steps,
    sun: SunPath,
    masks: NDArray[np.uint8] | None,
    progress: Callable[[int], object],
) -> NDArray[np.float32]:
    """Add up the hours in shadow; write every instant's mask if there is room for it."""
    up = np.flatnonzero(sun.is_up)
    shape = (sweep.grid.rows, sweep.grid.cols)
    done = 0

    def advance(n: int) -> None:
        nonlocal done
        done += n
        progress(done)

    if masks is not None:
        total = np.zeros(shape)
        for first in range(0, len(up), 8):
            some = up[first : first + 8]
            masks[some] = sweep.masks(sun.direction[some])
            for i in some:
                total += steps.hours[i] * masks[i]
            advance(len(some))
        return total.astype(np.float32)
    # All steps are equally long but for the last: at most two lengths.
    hours = np.zeros(shape, np.float32)
    for length in np.unique(steps.hours[up]):
        counts = np.zeros(shape, np.int32)
        sweep.add_steps(sun.direction[up[steps.hours[up] == length]], counts, advance)
        hours += np.multiply(counts, np.float32(length), dtype=np.float32)
    return hours


def shadow_study(scene: Scene, site: Site, **options: object) -> "xr.Dataset":
    """
    Find how long every cell of a plan lies in shadow on a day.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    site : Site
        Latitude, longitude, time zone and true north.
    date : str
        Local date, ``"2026-09-18"``.
    start, end : str
        Local clock times, ``"09:00"`` and ``"17:00"`` by default.
    every : str
        Step, ``"15min"`` by default.
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
