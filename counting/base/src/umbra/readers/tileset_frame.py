"""Where 3D Tiles lie: bounding volumes, and the plane in which a set on the earth is read."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.region import DEGREES, Region
from umbra.scene import Part

__all__ = ["Frame", "find_axes", "find_tileset_frame", "find_volume", "make_matrix", "move_part"]

NEAREST = 6.2e6
"""Less than the distance of any land from the centre of the earth [m]."""
_SIGNS = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), -1).reshape(8, 3)

Points = NDArray[np.float64]


def make_matrix(numbers: Any) -> NDArray[np.float64]:
    """Return a tile's transform (4, 4), which files list by columns."""
    if numbers is None:
        return np.eye(4)
    matrix = np.array(numbers, np.float64).reshape(4, 4).T
    if not np.isfinite(matrix).all():
        msg = "has a transform of a tile that is not finite; export it again"
        raise InputError(msg)
    return matrix


def find_volume(volume: Any, matrix: NDArray[np.float64]) -> Points | None:
    """
    Return points whose bounds hold a bounding volume, (n, 3): geocentric, or in the set's frame.

    None for volumes that are not read.
    """
    if not isinstance(volume, dict):
        return None
    if "region" in volume:
        from pyproj import Transformer  # noqa: PLC0415 - 0.1 s

        west, south, east, north, low, high = map(float, volume["region"])
        lon, lat = np.meshgrid(
            np.degrees([west, (west + east) / 2, east]), np.degrees([south, north])
        )
        lon, lat = np.tile(lon.ravel(), 2), np.tile(lat.ravel(), 2)
        heights = np.repeat([low, high], 6)
        there = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
        return np.column_stack(there.transform(lon, lat, heights))
    if "box" in volume:
        numbers = np.array(volume["box"], np.float64).reshape(4, 3)
        local = numbers[0] + _SIGNS @ numbers[1:]
    elif "sphere" in volume:
        numbers = np.array(volume["sphere"], np.float64)
        local = numbers[:3] + _SIGNS * numbers[3]
    else:
        return None
    return local @ matrix[:3, :3].T + matrix[:3, 3]


class Frame:
    """
    East, north and up at a place on the earth; heights are those above the ellipsoid.

    Parameters
    ----------
    centre : (3,) float64
        Geocentric (EPSG:4978) [m].

    Attributes
    ----------
    matrix : (4, 4) float64
        From geocentric coordinates to east, north, up.
    crs : str
        The orthographic projection at the place, whose plan this is at the ellipsoid.
    latitude, longitude, height : float
        Of the place [degrees, m].
    """

    def __init__(self, centre: Points) -> None:
        from pyproj import CRS, Transformer  # noqa: PLC0415 - 0.1 s

        there = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
        lon, lat, height = (float(value) for value in there.transform(*centre))
        self.latitude, self.longitude, self.height = lat, lon, height
        self.matrix = np.eye(4)
        self.matrix[:3, :3] = find_axes(centre[None])[0].T
        self.matrix[:3, 3] = -self.matrix[:3, :3] @ centre + [0, 0, height]
        self._to_degrees = there
        text = f"+proj=ortho +lat_0={lat:.9f} +lon_0={lon:.9f} +datum=WGS84 +units=m +no_defs"
        wkt = CRS.from_proj4(f"{text} +type=crs").to_wkt()
        self.crs = wkt.replace('"unknown"', f'"east and north at {lat:.4f}°, {lon:.4f}°"', 1)


def find_axes(points: Points) -> NDArray[np.float64]:
    """Return east, north and up at geocentric points (n, 3) as columns, (n, 3, 3)."""
    from pyproj import Transformer  # noqa: PLC0415 - 0.1 s

    there = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
    a, b = np.radians(there.transform(*points.T)[:2])
    east = np.stack([-np.sin(a), np.cos(a), np.zeros_like(a)], axis=1)
    north = np.stack([-np.sin(b) * np.cos(a), -np.sin(b) * np.sin(a), np.cos(b)], axis=1)
    up = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], axis=1)
    return np.stack([east, north, up], axis=2)


def move_part(part: Part, matrix: NDArray[np.float64]) -> Part:
    """Place a part by a matrix (4, 4); the mesh stays shared, and moves no more by itself."""
    own = np.eye(4) if part.transform is None else part.transform
    return replace(part, transform=matrix @ own, binding=None)


def find_tileset_frame(points: Points | None, region: Region | None) -> Frame | None:
    """
    Return the frame of a set by points (n, 3) that bound it; None if it is not on the earth.

    It lies in the middle of the region that is wanted, since a set may hold a country.
    """
    if points is None or not len(points):
        return None
    centre = points.mean(0)
    if not np.isfinite(centre).all() or not NEAREST < np.linalg.norm(centre) < 2 * NEAREST:
        return None
    if region is not None:
        from pyproj import Transformer  # noqa: PLC0415 - 0.1 s

        west, south, east, north = region.settle(DEGREES).find_box(DEGREES)
        there = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
        middle = there.transform((west + east) / 2, (south + north) / 2, 0.0)
        centre = np.array(middle, np.float64)
    return Frame(centre)
