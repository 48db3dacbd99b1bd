"""A STAC item of a study in tiles, so that catalogues can list it."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.folders.atomic import replace_file
from umbra.writers.city.store_window import CityResult
from umbra.writers.vectors.gis_files import find_crs, make_to_wgs84

__all__ = ["write_stac"]

_PROJECTION = "https://stac-extensions.github.io/projection/v2.0.0/schema.json"
_ALONG = 16  # points along a side: a rectangle in a plan has bent sides on the earth
_ASSETS = {
    "study": ("study.zarr", "application/vnd.zarr; version=3", "data", "all variables"),
    "hours": ("hours.vrt", "application/vnd.gdal.vrt+xml", "data", "GeoTIFFs of all tiles"),
    "map": ("map.png", "image/png", "overview", "hours in shadow"),
}


def write_stac(result: CityResult) -> Path:
    """
    Write ``item.json``, a STAC 1.1 item that lists the files that exist.

    Parameters
    ----------
    result : CityResult
        Without a known CRS the item has no geometry.
    """
    path = result.folder / "item.json"
    with replace_file(path) as beside:
        beside.write_bytes(orjson.dumps(_describe(result), option=orjson.OPT_INDENT_2) + b"\n")
    return path


def _describe(result: CityResult) -> dict[str, Any]:
    """Return the item."""
    facts, times = result.facts, result.times
    (dx, dy), extent = result.cell, result.extent
    properties: dict[str, Any] = {
        "datetime": None,
        "start_datetime": _tell(times.min()),
        "end_datetime": _tell(times.max()),
        "title": "Hours in shadow",
        "description": f"hours in shadow and in the sun, counted by umbra {_version(facts)}",
        "umbra:tiles": len(result.tiles),
        "umbra:tiles_done": len(result.tiles) - len(result.missing),
        "proj:shape": [len(result.y), len(result.x)],
        "proj:transform": [dx, 0.0, extent[0], 0.0, -dy, extent[3]],
        "proj:bbox": list(extent),
    }
    item: dict[str, Any] = {
        "type": "Feature",
        "stac_version": "1.1.0",
        "stac_extensions": [_PROJECTION],
        "id": result.folder.resolve().name or "study",
        "geometry": None,
        "properties": properties,
        "links": [],
        "assets": {
            key: {"href": f"./{name}", "type": kind, "roles": [role], "title": title}
            for key, (name, kind, role, title) in _ASSETS.items()
            if (result.folder / name).exists()
        },
    }
    system = find_crs(facts.get("crs"))
    if system is not None:
        code = system.to_epsg(min_confidence=70)
        properties["proj:code"] = f"EPSG:{code}" if code else None
        if not code:
            properties["proj:projjson"] = system.to_json_dict()
        ring = make_to_wgs84(system)(_go_around(extent))
        item["geometry"] = {"type": "Polygon", "coordinates": [ring.tolist()]}
        item["bbox"] = [*ring.min(0).tolist(), *ring.max(0).tolist()]
    return item


def _version(facts: dict[str, Any]) -> str:
    return str(facts.get("umbra_version", ""))


def _tell(instant: np.datetime64) -> str:
    """Write an instant in UTC as RFC 3339 has it."""
    return f"{np.datetime_as_string(instant, unit='s')}Z"


def _go_around(extent: tuple[float, float, float, float]) -> NDArray[np.float64]:
    """Return points around a rectangle, counter-clockwise, the last the first."""
    west, south, east, north = extent
    corners = np.array([[west, south], [east, south], [east, north], [west, north], [west, south]])
    share = np.arange(_ALONG)[:, None] / _ALONG
    sides = [a + share * (b - a) for a, b in pairwise(corners)]
    return np.concatenate([*sides, corners[:1]])
