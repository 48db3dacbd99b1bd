"""Coloured models as 3D Tiles 1.1: a tileset that places GLB files on the earth."""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.sun import Site
from umbra.writers.vectors.gis_files import find_crs

__all__ = ["find_tileset_placement", "make_box", "read_place", "write_tileset"]

_STEP = 100.0  # between points whose places on the earth give the axes [m]
_GEOCENTRIC, _GEODETIC = 4978, 4979


def write_tileset(
    path: str | os.PathLike[str],
    files: Sequence[str],
    bounds: NDArray[np.float64],
    placement: NDArray[np.float64],
    facts: dict[str, Any],
) -> None:
    """
    Write ``tileset.json`` of GLB files of one model.

    Parameters
    ----------
    path : path
    files : sequence of str
        Beside it; of several, such as one a date, each is the content of a tile.
    bounds : (2, 3) float64
        Of the model, about the files' origin [m].
    placement : (4, 4) float64
        From coordinates about the origin, z up, to geocentric ones (EPSG:4978).
    facts : dict
        Kept as extras.
    """
    box, size = make_box(bounds), float(np.linalg.norm(np.ptp(bounds, axis=0)))
    root = {
        "transform": placement.T.ravel().tolist(),  # columns one after the other
        "boundingVolume": box,
        "geometricError": size,
        "refine": "ADD",
        "children": [
            {"boundingVolume": box, "geometricError": 0.0, "content": {"uri": name}}
            for name in files
        ],
    }  # fmt: skip
    tileset = {
        "asset": {"version": "1.1", "extras": facts},
        "geometricError": size,
        "root": root,
    }  # fmt: skip
    Path(path).write_bytes(orjson.dumps(tileset, option=orjson.OPT_INDENT_2, default=str) + b"\n")


def make_box(bounds: NDArray[np.float64]) -> dict[str, list[float]]:
    """Return the bounding volume of bounds (2, 3), at least 2 cm along each axis [m]."""
    axes = np.diag(np.maximum(np.ptp(bounds, axis=0) / 2, 0.01))
    return {"box": [*bounds.mean(0).tolist(), *axes.ravel().tolist()]}


def read_place(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a GLB's origin (3,) and its bounds about it, z up, (2, 3) [m]."""
    with Path(path).open("rb") as file:
        head = file.read(20)
        tree = orjson.loads(file.read(int.from_bytes(head[12:16], "little")))
    ends = [
        accessor
        for accessor in tree["accessors"]
        if accessor["type"] == "VEC3" and "min" in accessor
    ]
    low, high = (np.array([accessor[key] for accessor in ends]) for key in ("min", "max"))
    (x0, y0, z0), (x1, y1, z1) = low.min(0), high.max(0)
    bounds = np.array([[x0, -z1, y0], [x1, -z0, y1]])  # a GLB's y is up
    return np.array(tree["asset"]["extras"]["origin"]), bounds


def find_tileset_placement(
    origin: NDArray[np.float64], crs: object, site: Site
) -> NDArray[np.float64]:
    """
    Find where coordinates about an origin lie on the earth.

    Heights are taken as heights above the ellipsoid: a globe with a geoid shows a model of heights
    above the sea too low, by up to 50 m in Europe.

    Parameters
    ----------
    origin : (3,) float64
        In the model's own coordinates [m].
    crs : str, optional
        Of the model's own coordinates. Without one the origin lies at the site.
    site : Site

    Returns
    -------
    placement : (4, 4) float64
        To geocentric coordinates (EPSG:4978) [m].
    """
    from pyproj import Transformer  # noqa: PLC0415  (a tenth of a second)

    to_earth = Transformer.from_crs(_GEODETIC, _GEOCENTRIC, always_xy=True)
    system = find_crs(crs)
    if system is None:
        longitude, latitude = site.longitude, site.latitude
    else:
        to_degrees = Transformer.from_crs(system, 4326, always_xy=True)
        near = origin[:2] + _STEP * np.array([[0, 0], [1, 0], [0, 1]])
        longitudes, latitudes = to_degrees.transform(near[:, 0], near[:, 1])
        longitude, latitude = float(longitudes[0]), float(latitudes[0])
    anchor = np.array(to_earth.transform(longitude, latitude, float(origin[2])))
    east, north, up = _find_axes(longitude, latitude)
    if system is None:
        turn = math.radians(site.true_north)
        along = math.cos(turn) * east + math.sin(turn) * north
        across = math.cos(turn) * north - math.sin(turn) * east
    else:
        ends = np.column_stack(
            to_earth.transform(longitudes[1:], latitudes[1:], np.full(2, float(origin[2])))
        )
        along, across = (ends - anchor) / _STEP
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([along, across, up, anchor])
    return matrix


def _find_axes(longitude: float, latitude: float) -> NDArray[np.float64]:
    """Return the directions east, north and up at a place, geocentric, (3, 3)."""
    l, p = math.radians(longitude), math.radians(latitude)  # noqa: E741
    return np.array(
        [
            [-math.sin(l), math.cos(l), 0.0],
            [-math.sin(p) * math.cos(l), -math.sin(p) * math.sin(l), math.cos(p)],
            [math.cos(p) * math.cos(l), math.cos(p) * math.sin(l), math.sin(p)],
        ]
    )
