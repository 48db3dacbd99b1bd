"""The part of a city to read: a box or a polygon that the bounds of kept objects meet."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.packages import need
from umbra.readers.georeference import (
    is_in_degrees,
    is_known_crs,
    is_same_plan,
    name_crs,
    show_crs,
)
from umbra.readers.model import FileModel

__all__ = ["DEGREES", "Region", "is_outside_region", "keep_inside", "make_region"]

DEGREES = "OGC:CRS84"
_FORM = "XMIN,YMIN,XMAX,YMAX[,CRS]"
_EWKT = re.compile(r"\s*SRID\s*=\s*(\d+)\s*;(.*)", re.IGNORECASE | re.DOTALL)
_WKT = re.compile(r"\s*(MULTI)?POLYGON\b", re.IGNORECASE)
_STEPS = 21  # points of an edge where it is converted to another CRS


@dataclass(frozen=True)
class Region:
    """
    A box in the plan, or a polygon in it.

    Parameters
    ----------
    box : tuple of float
        West, south, east, north.
    crs : str, optional
        By default that of the first file that names one.
    assumed : str, optional
        CRS of files that name none.
    wkt : str
        The polygon; empty for the box itself.
    option : str
        That gave it, for errors.
    """

    box: tuple[float, float, float, float]
    crs: str | None = None
    wkt: str = ""
    option: str = "bbox"
    assumed: str | None = None

    @property
    def shown(self) -> str:
        """The box and its CRS, for people."""
        numbers = ",".join(f"{value:.10g}" for value in self.box)
        return f"{self.option}={numbers}" + (f" ({show_crs(self.crs)})" if self.crs else "")

    def settle(self, crs: str | None) -> "Region":
        """Return the region in a known CRS: degrees if all numbers can be, else the file's."""
        crs = crs or self.assumed
        if self.crs is not None or crs is None:
            return self
        west, south, east, north = self.box
        if max(abs(west), abs(east)) <= 180 and max(abs(south), abs(north)) <= 90:
            return replace(self, crs=DEGREES) if is_known_crs(crs) else self
        if is_in_degrees(crs):
            msg = (
                f"{self.shown} is not in degrees, as the file is; give longitudes and latitudes, "
                f"or say its CRS ({_FORM}, for an area EWKT or GeoJSON with a crs)"
            )
            raise InputError(msg, option=self.option)
        return replace(self, crs=crs)

    def find_box(self, crs: str | None) -> tuple[float, float, float, float]:
        """Return the box in a file's CRS, in which all that the region meets meets it."""
        crs = crs or self.assumed
        if self.crs is None or crs is None or is_same_plan(self.crs, crs):
            return self.box
        west, south, east, north = _find_transformer(self.crs, crs, self.option).transform_bounds(
            *self.box, densify_pts=_STEPS
        )
        if not np.isfinite([west, south, east, north]).all():
            msg = f"{self.shown} lies outside the area where {show_crs(crs)} is used"
            raise InputError(msg, option=self.option)
        return west, south, east, north

    def meets(self, boxes: NDArray[np.float64], crs: str | None) -> NDArray[np.bool_]:
        """Return which boxes (n, 4), west, south, east, north in a file's CRS, meet it."""
        crs = crs or self.assumed
        if self.crs is not None and crs is not None and not is_same_plan(self.crs, crs):
            boxes = _convert(boxes, _find_transformer(crs, self.crs, self.option))
        west, south, east, north = self.box
        met = (boxes[:, 0] <= east) & (boxes[:, 2] >= west)
        met &= (boxes[:, 1] <= north) & (boxes[:, 3] >= south)
        if self.wkt and met.any():
            shapely = need("shapely", "gis", "an area")
            rows = np.flatnonzero(met)
            met[rows] = shapely.intersects(_parse(self.wkt), shapely.box(*boxes[rows].T))
        return met


def make_region(
    bbox: str | Sequence[float | str] | None,
    area: str | os.PathLike[str] | None,
    assumed: str | None = None,
) -> Region | None:
    """
    Make the region of the options ``bbox`` and ``area``; None without them.

    Parameters
    ----------
    bbox : str or sequence, optional
        ``XMIN,YMIN,XMAX,YMAX``, and a CRS if it is not the files'.
    area : str or path, optional
        A GeoJSON file, or a polygon as WKT or EWKT.
    assumed : str, optional
        CRS of files that name none.
    """
    if bbox is not None and area is not None:
        msg = "bbox= and area= are both given; give one of them"
        raise InputError(msg, option="area")
    if bbox is None and area is None:
        return None
    region = _make_area(area) if bbox is None else _make_box(bbox)  # type: ignore[arg-type]
    return replace(region, assumed=assumed)


def _make_box(bbox: str | Sequence[float | str]) -> Region:
    try:
        words = bbox.split(",", 4) if isinstance(bbox, str) else list(bbox)
        west, south, east, north = (float(word) for word in words[:4])
    except (TypeError, ValueError, OverflowError) as error:
        msg = f"bbox= is {_FORM}; got {show_value(bbox)}"
        raise InputError(msg, option="bbox") from error
    if not (np.isfinite([west, south, east, north]).all() and west <= east and south <= north):
        msg = f"bbox= is {_FORM}, the least first; got {show_value(bbox)}"
        raise InputError(msg, option="bbox")
    crs = _check_crs(name_crs(words[4]), "bbox") if words[4:] else None
    return Region((west, south, east, north), crs)


def _make_area(area: str | os.PathLike[str]) -> Region:
    """Read an area; its CRS is what it says, in GeoJSON degrees if nothing is said."""
    shapely = need("shapely", "gis", "an area")
    if not isinstance(area, (str, os.PathLike)):
        msg = f"area= is a polygon as WKT, or a GeoJSON file; got {show_value(area)}"
        raise InputError(msg, option="area")
    text, crs = os.fspath(area), None
    if _WKT.match(text) or _EWKT.match(text):
        named = _EWKT.match(text)
        if named:
            crs, text = _check_crs(f"EPSG:{named[1]}", "area"), named[2]
        from umbra.readers.checks import find_reason  # noqa: PLC0415

        try:
            shape = shapely.from_wkt(text)
        except shapely.errors.GEOSException as error:
            msg = f"area= is not WKT ({find_reason(error)})"
            raise InputError(msg, option="area") from error
    else:
        shape, crs = _read_area(shapely, Path(text))
    polygons = [part for part in shapely.get_parts(shape) if shapely.get_type_id(part) == 3]
    if not polygons or not np.isfinite(shapely.bounds(shape)).all():
        msg = f"area= {text[:80]} has no polygon; give a polygon as WKT or in a GeoJSON file"
        raise InputError(msg, option="area")
    whole = shapely.union_all([shapely.make_valid(part) for part in polygons])
    west, south, east, north = map(float, shapely.bounds(whole))
    return Region((west, south, east, north), crs, shapely.to_wkt(whole, -1), "area")


def _read_area(shapely: Any, path: Path) -> tuple[Any, str | None]:
    """Read the polygons of a GeoJSON file and their CRS."""
    import orjson  # noqa: PLC0415

    from umbra.readers.checks import Companions, find_reason  # noqa: PLC0415

    try:
        data = Companions(path).read(path.name)
        document = orjson.loads(data)
        named = document.get("crs")
        shape = shapely.from_geojson(data)
    except (InputError, AttributeError, ValueError, shapely.errors.GEOSException) as error:
        reason = find_reason(error, 160)
        msg = f"area= is neither WKT nor readable GeoJSON: {str(path)[:80]} ({reason})"
        raise InputError(msg, option="area") from error
    crs = name_crs(named["properties"]["name"]) if isinstance(named, dict) else None
    west, south, east, north = shapely.bounds(shape)
    if crs is None and max(abs(west), abs(east)) <= 180 and max(abs(south), abs(north)) <= 90:
        return shape, DEGREES
    return shape, None if crs is None else _check_crs(crs, "area")


def _check_crs(crs: str | None, option: str) -> str:
    if crs is None or not is_known_crs(crs):
        msg = f"{option}= names a CRS that is not known: {str(crs)[:60]}; write it as EPSG:25832"
        raise InputError(msg, option=option)
    return crs


@cache
def _parse(wkt: str) -> Any:
    import shapely  # noqa: PLC0415 - of the extra gis

    shape = shapely.from_wkt(wkt)
    shapely.prepare(shape)
    return shape


@cache
def _find_transformer(source: str, target: str, option: str) -> Any:
    from pyproj import CRS, Transformer  # noqa: PLC0415 - 0.1 s, only with a CRS

    for crs in (source, target):
        if not is_known_crs(crs):
            msg = f"{option}=: {show_crs(source)} cannot be converted to {show_crs(target)}"
            raise InputError(msg, option=option, crs=(source, target))
    start, goal = (CRS.from_user_input(crs).to_2d() for crs in (source, target))
    return Transformer.from_crs(start, goal, always_xy=True)


def _convert(boxes: NDArray[np.float64], transformer: Any) -> NDArray[np.float64]:
    """Convert boxes (n, 4) by their corners and the middles of their edges."""
    west, south, east, north = boxes.T
    x, y = (west + east) / 2, (south + north) / 2
    across = np.stack([west, x, east, west, east, west, x, east])
    along = np.stack([south, south, south, y, y, north, north, north])
    across, along = transformer.transform(across, along)
    return np.stack([across.min(0), along.min(0), across.max(0), along.max(0)], axis=1)


def keep_inside(model: FileModel, region: Region) -> tuple[FileModel, int]:
    """Leave out objects whose bounds do not meet the region; also return their number."""
    boxes: dict[str, list[NDArray[np.float64]]] = {}
    for part in model.parts:
        if part.triangles:
            boxes.setdefault(part.name, []).append(part.bounds[:, :2])
    plans = [np.concatenate(points) for points in boxes.values()]
    array = np.array([(*plan.min(0), *plan.max(0)) for plan in plans]).reshape(-1, 4)
    met = region.settle(model.crs).meets(array, model.crs)
    inside = {name for name, is_met in zip(boxes, met, strict=True) if is_met}
    parts = tuple(part for part in model.parts if part.name in inside)
    return replace(model, parts=parts), len(boxes) - len(inside)


def is_outside_region(feature: dict[str, Any], region: Region, crs: str | None) -> bool:
    """Return whether a feature of CityJSON with placed vertices (n, 3) lies wholly outside."""
    plan = feature["vertices"][:, :2]
    shapes = (geometry for item in feature["CityObjects"].values() for geometry in item["geometry"])
    if not len(plan) or any(shape["type"] == "GeometryInstance" for shape in shapes):
        return False  # placed shapes reach beyond their points
    box = np.concatenate([plan.min(0), plan.max(0)])[None]
    return not region.settle(crs).meets(box, crs)[0]
