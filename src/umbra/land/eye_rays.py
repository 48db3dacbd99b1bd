"""
What eyes see of the land: a raster read block by block, and the rays over it.

This runs in a child process (`umbra.land.raster_horizon`), as GDAL may end the process at damaged
files.
"""

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.land.march import march
from umbra.land.peaks import PARTS, find_spots, raise_peaks, sift_peaks
from umbra.land.raster import LandFile
from umbra.land.rays import Eye, make_rays
from umbra.packages import need
from umbra.readers.checks import find_reason

__all__ = ["LandView", "LandWork", "Step", "view_land"]

MOST = 450_000_000
"""Cells that are read at their own resolution, of 21,000 x 21,000; of more the far ones are
thinned by the file's overviews."""
_MOST_BARE = 4_000_000_000  # cells of a file without overviews
_SHARE = 1 / 3000  # width of a thinned cell, of its distance
_SIDE = 2048  # cells of a block's side
_CACHE = 128  # of GDAL [MB]

Block = tuple[int, int, int, int, int]


@dataclass(frozen=True)
class LandWork:
    """Request for the land about a place."""

    path: str
    longitude: float
    latitude: float
    nearest: float  # radius within which the land is the model's [m]
    reach: float  # [m]
    refraction: float
    eyes: tuple[Eye, ...]


@dataclass(frozen=True)
class Step:
    """Progress: blocks read, and all."""

    done: int
    whole: int


@dataclass(frozen=True, eq=False)
class LandView:
    """
    The land as eyes see it.

    Parameters
    ----------
    eye : (n,) int64
        Number of each ray's eye.
    elevation : (n,) float64
        Highest of the land along each ray; -inf without land [degrees].
    distance : (n,) float64
        Where it is highest [m].
    seen : (n,) float64
        Farthest distance with land [m].
    missing : float
        Share of the rays' length within the raster that has no height.
    heights : (n_eyes,) float64
        Of the eyes; NaN where the land has no height [m].
    columns, rows : int
        Of the raster.
    cell : (2,) float64
        Size of a cell at the site [m].
    crs : str
    thinned : int
        Largest side of a thinned cell, in cells; 1 where none is.
    peaks : (m, 3) float64
        Azimuth, elevation [degrees] and distance [m] of what the first eye sees above the line
        between two of its rays; ascending.
    notes : tuple of str
    """

    eye: NDArray[np.int64]
    elevation: NDArray[np.float64]
    distance: NDArray[np.float64]
    seen: NDArray[np.float64]
    missing: float
    heights: NDArray[np.float64]
    columns: int
    rows: int
    cell: NDArray[np.float64]
    crs: str
    thinned: int
    peaks: NDArray[np.float64]
    notes: tuple[str, ...] = field(default=())


def view_land(work: LandWork) -> Iterator[Step | LandView]:
    """Find the land's elevations along rays: yield steps, and what is seen."""
    rasterio = need("rasterio", "gis", "GeoTIFF")
    try:
        with warnings.catch_warnings(), rasterio.Env(GDAL_CACHEMAX=_CACHE):
            warnings.simplefilter("ignore")
            with rasterio.open(work.path, driver="GTiff") as source:
                yield from _view(LandFile(source), work)
    except rasterio.errors.RasterioError as error:
        msg = f"cannot be read as a raster ({find_reason(error, 200)}); export it again as GeoTIFF"
        raise InputError(msg) from error


def _view(raster: LandFile, work: LandWork) -> Iterator[Step | LandView]:
    """Find what eyes see of an open raster."""
    site = raster.find_cells(np.array([work.longitude]), np.array([work.latitude]))[0]
    _check_site(raster, work, site)
    cell = _measure_cell(raster, site)
    reach = min(work.reach, _find_farthest(raster, work))
    rays = make_rays(
        work.longitude, work.latitude, list(work.eyes), work.nearest, reach, work.refraction,
        raster.find_cells,
    )  # fmt: skip
    heights = np.array([raster.find_height(point) for point in rays.places])
    if not math.isfinite(heights[0]):
        msg = "has no height at the site; fill it there (gdal_fillnodata.py), or give another file"
        raise InputError(msg)
    eyes = (heights + [eye.height for eye in work.eyes])[rays.eye]
    slopes = np.full(len(eyes), -np.inf)
    distances, seen, missing = np.zeros((3, len(eyes)))
    is_first = rays.eye == 0
    peaks = np.full((int(is_first.sum()) * PARTS, 3), -np.inf)
    peaks[:, 1:] = 0.0
    position = work.longitude, work.latitude
    blocks = _plan_blocks(raster, rays.nodes, site, cell)
    for k, (c0, r0, c1, r1, thin) in enumerate(blocks):
        # Centres up to the next block's first; thinned ones begin half a cell inside.
        core = np.array([c0, r0, c1, r1], np.float64)
        more = thin if thin > 1 else 0
        block, frame = raster.read(
            max(c0 - more, 0), max(r0 - more, 0), min(c1 + 1 + more, raster.columns),
            min(r1 + 1 + more, raster.rows), thin,
        )  # fmt: skip
        march(block, frame, core, rays.nodes, eyes, rays.radii, slopes, distances, seen, missing)
        spots, side = find_spots(
            block.shape, frame, float(cell.max()), position, raster.find_places
        )
        raise_peaks(
            block, spots, side, eyes[0], rays.radii[is_first], slopes[is_first],
            np.array([work.nearest, work.reach]), peaks,
        )  # fmt: skip
        yield Step(k + 1, len(blocks))
    elevation = np.degrees(np.arctan(slopes))
    yield LandView(
        rays.eye, elevation, distances, seen,
        float(missing.sum() / max((missing + np.maximum(seen - work.nearest, 0.0)).sum(), 1.0)),
        eyes[np.searchsorted(rays.eye, np.arange(len(work.eyes)))], raster.columns, raster.rows,
        cell, raster.name, max((block[4] for block in blocks), default=1),
        sift_peaks(peaks, np.maximum(elevation[is_first], 0.0)), tuple(raster.notes),
    )  # fmt: skip


def _check_site(raster: LandFile, work: LandWork, site: NDArray[np.float64]) -> None:
    """Refuse a raster that does not hold the site."""
    if raster.holds(site):
        return
    from pyproj import Geod  # noqa: PLC0415

    last = raster.last
    near = np.clip(np.where(np.isfinite(site), site, last / 2), -0.5, last)
    lon, lat = raster.find_places(near[None])
    away = math.inf
    if np.isfinite([lon[0], lat[0]]).all():
        geod = Geod(ellps="WGS84")
        _, _, away = geod.inv(work.longitude, work.latitude, float(lon[0]), float(lat[0]))
    low, high = (raster.find_places(np.array([end])) for end in ((-0.5, last[1]), (last[0], -0.5)))
    shown = f"{low[1][0]:.3f} to {high[1][0]:.3f} N, {low[0][0]:.3f} to {high[0][0]:.3f} E"
    msg = (
        f"lies {away / 1000:,.1f} km from the site ({work.latitude:.4f}, {work.longitude:.4f}), at "
        f"{shown}; give a terrain model that holds the site and the land around, or correct the "
        "site"
    )
    raise InputError(msg, distance=away)


def _measure_cell(raster: LandFile, site: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the width and the height of a cell at the site (2,) [m]."""
    from pyproj import Geod  # noqa: PLC0415

    lon, lat = raster.find_places(site + [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    _, _, sides = Geod(ellps="WGS84").inv([lon[0]] * 2, [lat[0]] * 2, lon[1:], lat[1:])
    return np.array(sides)


def _find_farthest(raster: LandFile, work: LandWork) -> float:
    """Return the distance of the raster's farthest corner [m]; inf if it has no place."""
    from pyproj import Geod  # noqa: PLC0415

    last = raster.last
    corners = np.array([(-0.5, -0.5), (last[0], -0.5), (-0.5, last[1]), last])
    lon, lat = raster.find_places(corners)
    if not np.isfinite([lon, lat]).all():
        return math.inf
    same = np.full(4, work.longitude), np.full(4, work.latitude)
    _, _, away = Geod(ellps="WGS84").inv(*same, lon, lat)
    return float(np.max(away))


def _plan_blocks(
    raster: LandFile, nodes: NDArray[np.float64], site: NDArray[np.float64],
    cell: NDArray[np.float64],
) -> list[Block]:  # fmt: skip
    """
    Cut what the rays cross into blocks: first and last column and row, and how they are thinned.

    Raises InputError for more cells than can be read in bounded time.
    """
    plan = nodes[..., :2].reshape(-1, 2)
    plan = plan[np.isfinite(plan).all(1)]
    last = np.array([raster.columns, raster.rows]) - 1
    low = np.clip(np.floor(plan.min(0)).astype(int), 0, last - 1)
    high = np.clip(np.ceil(plan.max(0)).astype(int), low + 1, last)
    tall, wide = raster.source.block_shapes[0]
    if wide >= raster.columns:  # strips, which are unpacked whole
        across = int(high[0] - low[0])
        down = max(_SIDE * _SIDE // across // tall, 1) * tall
        first = low[0], low[1] // tall * tall
    else:
        across, down = (-(-_SIDE // side) * side for side in (wide, tall))
        first = low[0] // across * across, low[1] // down * down
    overviews = sorted(raster.source.overviews(1))
    count = float(high[0] - low[0]) * float(high[1] - low[1])
    if count > _MOST_BARE and not overviews:
        msg = (
            f"has {count / 1e9:,.1f} thousand million cells within reach, and no overviews by "
            "which far ones are thinned; add them (gdaladdo -r average FILE)"
        )
        raise InputError(msg, cells=count)
    blocks: list[Block] = []
    for r0 in range(int(first[1]), int(high[1]), down):
        for c0 in range(int(first[0]), int(high[0]), across):
            c1, r1 = min(c0 + across, int(last[0])), min(r0 + down, int(last[1]))
            gap = np.maximum(np.maximum((c0, r0) - site, site - (c1, r1)), 0.0) * cell
            room = float(np.hypot(*gap)) * _SHARE / float(cell.max())
            thin = max((o for o in overviews if o <= room), default=1) if count > MOST else 1
            blocks.append((c0, r0, c1, r1, thin))
    return blocks
