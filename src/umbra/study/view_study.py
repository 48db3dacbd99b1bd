"""Running a study of an elevation or of a camera's picture."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.scene import Camera
from umbra.scene.grid import Grid
from umbra.study.layout import lay_out
from umbra.study.model import prepare_casting
from umbra.study.result import Study, Variables
from umbra.study.setup import Progress, Setup
from umbra.study.terrain import has_terrain
from umbra.study.views import Elevation, ViewModel, ViewTile

__all__ = ["run_camera", "run_elevation"]

_MARGIN = 0.02  # of the model's length
_AROUND = 0.08  # of it, where the ground about it is seen
_PIXELS = (1024, 768)
_PIXEL_BYTES = 200  # held for each pixel: its position, normal, depth and counts


def run_elevation(
    setup: Setup,
    direction: tuple[float, float],
    level: float,
    raster: dict[str, Any],
    shown: list[int] | None,
    progress: Progress,
) -> Study:
    """
    Study the facades that are seen from an azimuth.

    Parameters
    ----------
    setup : Setup
    direction : (float, float)
        Azimuth from where, clockwise from true north, and how far it looks down [degrees].
    level : float
        z below which an elevation shows nothing, in the model's own coordinates [m].
    raster : dict
        Extent, cell and size as ``lay_out`` takes them, and what is kept of each cell.
    shown : list of int, optional
        Parts that are seen; all by default.
    progress : callable
    """
    scene = setup.scene
    bounds = scene.bounds()
    azimuth, tilt = direction
    frame = Elevation.of(azimuth, setup.site.true_north, tilt)
    low, high = frame.find_extent(scene, shown)
    margin = _MARGIN * (high[0] - low[0]) + 1e-3
    room = min(margin, 0.1 * (high[1] - low[1]) + 1e-3)  # a long row of houses is low
    ground = None
    if not frame.is_level and not has_terrain(scene):
        ground, margin = level, _AROUND * (high[0] - low[0])  # what stands on it throws shadows
        room = margin * -frame.forward[2]
    bottom = level if frame.is_level else low[1] - room
    default = (low[0] - margin, bottom, high[0] + margin, max(high[1], bottom) + room)
    extent, size, cell = raster["extent"] or default, raster["size"], raster["cell"]
    if size is None and cell is None:
        cell = _choose_cell(extent)
    # What is seen, in the view's own axes, as the extent is.
    grid, _, _ = lay_out(
        np.array([(*low, level), (*high, level)]),
        np.zeros((0, 3)),
        level,
        **{**raster, "extent": extent, "cell": cell, "kept": raster["kept"] + _PIXEL_BYTES},
    )
    if size is not None:
        grid = _make_square(grid)
    casting = prepare_casting(scene, setup.casters, setup.threads, setup.canopy)
    model = ViewModel(
        scene, casting.soup, casting.caster, setup.threads, setup.casters,
        lambda part: frame.make_camera(part, bounds), ground, shown, canopy=setup.canopy,
    )  # fmt: skip
    facts = {"ground_z": level, "view_azimuth_deg": azimuth}
    if frame.is_level:
        return _run(setup, model, grid, ("z", "along"), "elevation", level, facts, progress)
    facts["view_tilt_deg"] = tilt
    return _run(setup, model, grid, ("up", "along"), "view", level, facts, progress)


def run_camera(
    setup: Setup,
    level: float,
    *,
    eye: Sequence[float] | None,
    target: Sequence[float] | None,
    fov: float,
    size: tuple[int, int] | None,
    shown: list[int] | None,
    progress: Progress,
) -> Study:
    """
    Study what a camera sees, the ground plane included.

    Parameters
    ----------
    setup : Setup
    level : float
        z of the ground [m].
    eye, target : (3,) float
        In the model's own coordinates [m].
    fov : float
        Vertical field of view [degrees].
    size : (int, int), optional
        Columns and rows.
    shown : list of int, optional
        Parts that are seen besides the ground; all by default.
    progress : callable
    """
    if eye is None or target is None:
        msg = "receivers 'camera' need an eye and a target; give eye= and target="
        raise InputError(msg)
    cols, rows = size or _PIXELS
    whole = Camera(np.array(eye), np.array(target), size=(cols, rows), fov=fov)
    casting = prepare_casting(setup.scene, setup.casters, setup.threads, setup.canopy)

    def make_camera(grid: Grid) -> Camera:
        return Camera(whole.eye, whole.target, size=(grid.cols, grid.rows), fov=fov)

    model = ViewModel(
        setup.scene, casting.soup, casting.caster, setup.threads, setup.casters, make_camera,
        level, shown, canopy=setup.canopy,
    )  # fmt: skip
    kept = _PIXEL_BYTES + setup.bytes_kept + setup.bytes_of_masks
    if cols * rows * kept > find_memory():
        msg = (
            f"a picture of {cols}x{rows} pixels needs {cols * rows * kept / 1e9:.1f} GB and "
            f"{name_memory(find_memory())}; give a smaller size="
        )
        raise InputError(msg, size=size)
    facts = {
        "ground_z": level,
        "eye": [float(v) for v in whole.eye],
        "target": [float(v) for v in whole.target],
        "fov_deg": float(fov),
    }
    grid = Grid(0.0, 0.0, 1.0, 1.0, cols, rows)
    return _run(setup, model, grid, ("row", "col"), "camera", level, facts, progress)


def _run(
    setup: Setup,
    model: ViewModel,
    grid: Grid,
    dims: tuple[str, str],
    receivers: str,
    level: float,
    facts: dict[str, Any],
    progress: Progress,
) -> Study:
    tile = model.make_tile(grid)
    done = setup.count(model, tile.shape, [(..., lambda: tile)], progress)
    ledger = done.ledger
    if dims[1] == "along":
        area: NDArray[np.float64] | float = grid.dx * grid.dy / _find_facing(tile)
    else:
        area = _find_areas(tile)
    ledger.blank(~tile.is_seen)
    more = {**ledger.variables(dims), **_locate(tile, dims), **done.answer.variables(dims, area)}
    return Study(
        x=grid.x,
        y=grid.y,
        period=setup.period,
        shadow_hours=ledger.shadow_hours,
        up_hours=ledger.up_hours,
        heights=np.where(tile.is_seen, 0.0, np.nan),
        ground=level,
        masks=ledger.masks,
        facts=setup.describe(receivers, done.seconds, **facts),
        model=model,
        grid=grid,
        more=more,
        dims=dims,
    )


def _locate(tile: ViewTile, dims: tuple[str, str]) -> Variables:
    """Say where on which surface each pixel's centre lies."""
    frame = tile.frame
    return {
        "position": ((*dims, "xyz"), frame.position[::-1].copy()),
        "normal": ((*dims, "xyz"), frame.normal[::-1].copy()),
        "part": (dims, frame.part[::-1].copy()),
    }


def _find_facing(tile: ViewTile) -> NDArray[np.float64]:
    """Give the cosine between each surface and the view; 1 where nothing is seen."""
    way = tile.camera.axes()[2]
    facing = -np.nan_to_num(tile.frame.normal[::-1]) @ way
    return np.where(tile.is_seen, np.maximum(facing, 1e-6), 1.0)


def _find_areas(tile: ViewTile) -> NDArray[np.float64]:
    """Give the area of surface that each pixel of a perspective picture shows [m2]."""
    camera = tile.camera
    depth = (np.nan_to_num(tile.frame.position[::-1]) - camera.eye) @ camera.axes()[2]
    ray = np.nan_to_num(tile.frame.position[::-1]) - camera.eye
    length = np.maximum(np.linalg.norm(ray, axis=-1), 1e-12)
    pixel = 2 * math.tan(math.radians(camera.fov) / 2) / camera.size[1]
    facing = -np.einsum("ijk,ijk->ij", np.nan_to_num(tile.frame.normal[::-1]), ray) / length
    cosine = np.maximum(depth / length, 1e-12)
    return np.where(tile.is_seen, pixel**2 * depth**2 / np.maximum(facing, 1e-6) * cosine, 0.0)


def _choose_cell(extent: Sequence[float]) -> float:
    """Give the 1, 2 or 5 times a power of ten that makes at most a million cells, 2048 a side."""
    wide, high = extent[2] - extent[0], extent[3] - extent[1]
    least = max(wide / 2048, high / 2048, math.sqrt(wide * high) / 1024, 1e-9)
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= least * 0.999)


def _make_square(grid: Grid) -> Grid:
    """Let the cells be square, about the same middle, and hold all that they held."""
    side = max(grid.dx, grid.dy)
    x = grid.x0 + grid.dx * (grid.cols - 1) / 2 - side * (grid.cols - 1) / 2
    y = grid.y0 + grid.dy * (grid.rows - 1) / 2 - side * (grid.rows - 1) / 2
    return Grid(x, y, side, side, grid.cols, grid.rows)
