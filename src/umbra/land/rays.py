"""
Rays from a place over the earth: geodesics in the cells of a raster of any reference system.

A ray is straight in the raster between nodes some kilometres apart, where the geodesic leaves the
chord by less than 0.2 m: nothing is resampled, whatever the projection.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Eye", "Rays", "make_rays"]

_STEP = 2000.0  # between nodes of a ray [m]
_LEAST = 1.0  # distance from which a ray begins [m]
_AXIS, _SQUARE = 6_378_137.0, 0.006_694_379_990_14  # WGS 84: semi-major axis [m], e^2

FindCells = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Eye:
    """
    A place from which the land is seen.

    Parameters
    ----------
    east, north : float
        From the middle of the model [m].
    height : float
        Above the land there [m].
    azimuths : int
        Number of its rays, the first of which goes north.
    """

    east: float
    north: float
    height: float
    azimuths: int


@dataclass(frozen=True, eq=False)
class Rays:
    """
    Rays of all eyes.

    Parameters
    ----------
    eye : (n,) int64
        Number of each ray's eye.
    nodes : (n, n_nodes, 3) float64
        Column and row of cell centres, and distance [m]; not finite where the reference system
        does not reach.
    radii : (n,) float64
        Radius of the earth along each, raised by refraction [m].
    places : (n_eyes, 2) float64
        Column and row of each eye.
    """

    eye: NDArray[np.int64]
    nodes: NDArray[np.float64]
    radii: NDArray[np.float64]
    places: NDArray[np.float64]


def make_rays(
    longitude: float, latitude: float, eyes: list[Eye], nearest: float, reach: float,
    refraction: float, find_cells: FindCells,
) -> Rays:  # fmt: skip
    """
    Make the rays of some eyes about a place on WGS 84.

    Parameters
    ----------
    longitude, latitude : float
        Of the middle of the model [degrees].
    eyes : list of Eye
    nearest : float
        Radius of the circle around the middle in which no land counts [m].
    reach : float
        Length of the rays [m].
    refraction : float
        Coefficient k: light is bent as much as on an earth of 1 / (1 - k) times the radius.
    find_cells : callable
        Returns columns and rows (..., 2) of longitudes and latitudes.
    """
    from pyproj import Geod  # noqa: PLC0415 - 0.1 s

    geod = Geod(ellps="WGS84")
    count = np.array([eye.azimuths for eye in eyes])
    eye = np.repeat(np.arange(len(eyes)), count)
    azimuth = np.concatenate([np.arange(n) * 360.0 / n for n in count])
    offset = np.array([(eye.east, eye.north) for eye in eyes], np.float64)
    away = np.hypot(*offset.T)
    turn = np.degrees(np.arctan2(*offset.T))
    lon, lat = np.full(len(eyes), longitude), np.full(len(eyes), latitude)
    lon, lat, _ = geod.fwd(lon, lat, turn, away)
    # Where each ray leaves the circle; near enough to be plane.
    toward = np.column_stack([np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))])
    along = (offset[eye] * toward).sum(1)
    inside = nearest**2 - away[eye] ** 2 + along**2
    leave = np.where(inside > 0, np.sqrt(np.maximum(inside, 0.0)) - along, 0.0)
    start = np.minimum(np.maximum(leave, _LEAST), reach)
    pieces = max(int(np.ceil(reach / _STEP)), 1)
    distance = start[:, None] + (reach - start)[:, None] * np.linspace(0.0, 1.0, pieces + 1)
    east, north, toward_end = (
        np.repeat(values, pieces + 1)
        for values in (np.array(lon)[eye], np.array(lat)[eye], azimuth)
    )
    ends = geod.fwd(east, north, toward_end, distance.ravel())
    cells = find_cells(np.array(ends[0]), np.array(ends[1])).reshape(len(eye), -1, 2)
    bend = np.sin(np.radians(latitude)) ** 2 * _SQUARE
    across = _AXIS / np.sqrt(1.0 - bend)
    meridian = across * (1.0 - _SQUARE) / (1.0 - bend)
    # Euler's radius of the section at an azimuth.
    radii = 1.0 / (toward[:, 1] ** 2 / meridian + toward[:, 0] ** 2 / across) / (1.0 - refraction)
    nodes = np.concatenate([cells, distance[..., None]], axis=2)
    return Rays(eye, nodes, radii, find_cells(np.array(lon), np.array(lat)))
