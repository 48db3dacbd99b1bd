"""
Peaks between rays: the highest cell in each of ten parts between two rays of the first eye.

Rays are 0.1 degrees apart and miss a peak that is narrower. The bilinear land is highest at centres
of cells, but for the earth's bend, so those are asked as well. Squares of 64 x 64 cells are passed
over where their highest height, seen from their nearest place, is below all rays about them.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import inner, kernel
from umbra.land.march import find_land_slope

__all__ = ["PARTS", "find_spots", "raise_peaks", "sift_peaks"]

PARTS = 10
"""Parts between two rays, each of which may hold a peak."""
_SIDE = 64  # cells of a square's side
_LARGEST = 2000.0  # side of a square, in which places are bilinear within 0.1 m [m]
_LEAST = 0.002  # by which a peak rises above the line between two rays [degrees]

FindPlaces = Callable[[NDArray[np.float64]], tuple[NDArray, NDArray]]


def find_spots(
    shape: tuple[int, ...], frame: NDArray[np.float64], cell: float, site: tuple[float, float],
    find_places: FindPlaces,
) -> tuple[NDArray[np.float64], int]:  # fmt: skip
    """
    Return places east and north of a site, (rows, cols, 2) [m], at corners of a block's squares.

    By distance and azimuth from the site, and with them the cells of a square's side.

    Parameters
    ----------
    shape : (2,) int
        Rows and columns of the block.
    frame : (4,) float64
        As of ``march``.
    cell : float
        Side of a raster's cell [m].
    site : (2,) float
        Longitude and latitude.
    find_places : callable
        Returns longitudes and latitudes of columns and rows (n, 2).
    """
    from pyproj import Geod  # noqa: PLC0415 - 0.1 s

    side = int(max(min(_SIDE, _LARGEST / (cell * max(frame[2], frame[3]))), 1))
    rows, cols = (np.arange(-(-(n - 1) // side) + 1) * side for n in shape)
    u, v = np.meshgrid(cols, rows)
    points = np.column_stack([
        frame[0] + (u.ravel() + 0.5) * frame[2] - 0.5, frame[1] + (v.ravel() + 0.5) * frame[3] - 0.5
    ])  # fmt: skip
    lon, lat = find_places(points)
    same = np.full(len(lon), site[0]), np.full(len(lon), site[1])
    turn, _, away = Geod(ellps="WGS84").inv(*same, lon, lat)
    angle = np.radians(turn)
    spots = np.stack([away * np.sin(angle), away * np.cos(angle)], -1)
    return spots.reshape(len(rows), len(cols), 2), side


@kernel
def raise_peaks(heights, spots, side, eye, radii, slopes, within, peaks):
    """
    Raise the peaks between rays by the centres of one block.

    Parameters
    ----------
    heights : (rows, cols) float32
        Of a block [m]; NaN where there is none.
    spots : (n, m, 2) float64
        Places at the corners of squares of so many cells.
    side : int
    eye : float
        Height of the eye [m].
    radii, slopes : (n_rays,) float64
        Of all rays of the eye, evenly from north.
    within : (2,) float64
        Distances between which land counts [m].
    peaks : (n_rays * PARTS, 3) float64
        Slope, azimuth [rays] and distance [m] of the highest centre in each part; raised.
    """
    rows, cols = heights.shape
    rays = slopes.size
    for q in range(spots.shape[0] - 1):
        for w in range(spots.shape[1] - 1):
            top = -math.inf
            for j in range(q * side, min((q + 1) * side, rows)):
                for i in range(w * side, min((w + 1) * side, cols)):
                    top = max(top, heights[j, i]) if heights[j, i] == heights[j, i] else top
            if top == -math.inf or not _may_rise(spots, q, w, top, eye, radii, slopes, within):
                continue
            for j in range(q * side, min((q + 1) * side, rows)):
                b = (j - q * side) / side
                for i in range(w * side, min((w + 1) * side, cols)):
                    height = heights[j, i]
                    a = (i - w * side) / side
                    x, y = _blend(spots, q, w, a, b, 0), _blend(spots, q, w, a, b, 1)
                    away = math.sqrt(x * x + y * y)
                    if not (within[0] <= away <= within[1]) or math.isnan(height):
                        continue
                    at = math.atan2(x, y) / (2.0 * math.pi) * rays
                    at += rays if at < 0.0 else 0.0
                    k = min(int(at), rays - 1)
                    slope = find_land_slope(height, away, eye, radii[k])
                    part = min(int(at * PARTS), rays * PARTS - 1)
                    if slope > peaks[part, 0]:
                        peaks[part, 0], peaks[part, 1], peaks[part, 2] = slope, at, away


@inner
def _blend(spots, q, w, a, b, c):
    """Return a coordinate within a square."""
    north = spots[q, w, c] + a * (spots[q, w + 1, c] - spots[q, w, c])
    south = spots[q + 1, w, c] + a * (spots[q + 1, w + 1, c] - spots[q + 1, w, c])
    return north + b * (south - north)


@inner
def _may_rise(spots, q, w, top, eye, radii, slopes, within):
    """Return whether a square of this highest height may be above a ray about it."""
    rays = slopes.size
    x, y = _blend(spots, q, w, 0.5, 0.5, 0), _blend(spots, q, w, 0.5, 0.5, 1)
    wide = 0.0
    for k in range(4):
        dx, dy = spots[q + k // 2, w + k % 2, 0] - x, spots[q + k // 2, w + k % 2, 1] - y
        wide = max(wide, math.sqrt(dx * dx + dy * dy))
    away = math.sqrt(x * x + y * y)
    if not away - wide <= within[1] or away + wide < within[0]:
        return False
    near = max(away - wide, within[0], 1.0)
    if away <= 1.5 * wide:
        return True
    middle, half = math.atan2(x, y), math.asin(wide / away)
    first = math.floor((middle - half) / (2.0 * math.pi) * rays)
    last = math.ceil((middle + half) / (2.0 * math.pi) * rays)
    slope = -math.inf
    least = math.inf
    for k in range(first, last + 1):
        ray = k % rays
        # What is higher than the eye is steepest where it is nearest; nothing else is a peak.
        slope = max(slope, find_land_slope(top, near, eye, radii[ray]))
        least = min(least, slopes[ray])
    return slope > least


def sift_peaks(peaks: NDArray[np.float64], elevation: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return the peaks that rise above the horizon, and above the line between two rays.

    Parameters
    ----------
    peaks : (n * PARTS, 3) float64
        As of ``raise_peaks``.
    elevation : (n,) float64
        Of the rays [degrees].

    Returns
    -------
    peaks : (m, 3) float64
        Azimuth, elevation [degrees] and distance [m]; azimuths ascend.
    """
    rays = len(elevation)
    high, at = np.degrees(np.arctan(peaks[:, 0])), peaks[:, 1]
    line = np.interp(at, np.arange(rays + 1), np.append(elevation, elevation[0]))
    is_peak = (high > np.maximum(line, 0.0) + _LEAST) & (at != np.floor(at))
    sifted = np.column_stack([at * 360.0 / rays, high, peaks[:, 2]])[is_peak]
    return sifted[np.argsort(sifted[:, 0])]
