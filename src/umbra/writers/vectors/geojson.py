"""GeoJSON: longitude and latitude on WGS 84, as RFC 7946 demands, where the CRS is known."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from umbra.writers.vectors.places import find_crs, make_to_wgs84, name_crs
from umbra.writers.vectors.shapes import Layer

__all__ = ["write_geojson"]

_DEGREES, _METRES = 9, 6  # decimals: a tenth of a millimetre, and a thousandth


def write_geojson(
    path: str | os.PathLike[str], layer: Layer, crs: object = None, note: str = ""
) -> None:
    """
    Write a layer as a FeatureCollection.

    Parameters
    ----------
    path : path
    layer : Layer
        In the model's own coordinates [m].
    crs : str, optional
        Theirs. Without it they stay as they are, and the member ``coordinates_note``
        says so: the file is then no map, but programs can still place it.
    note : str
        What coordinates are where they are no map's.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    import shapely  # noqa: PLC0415  (an extra)

    system = find_crs(crs)
    geometries, decimals = layer.geometries, _METRES
    if system is not None:
        to_wgs84, decimals = make_to_wgs84(system), _DEGREES
        geometries = [shapely.transform(geometry, to_wgs84) for geometry in geometries]
    collection: dict[str, Any] = {"type": "FeatureCollection", "name": layer.name}
    collection["coordinates_note"] = (
        f"longitude, latitude on WGS 84, reprojected from {name_crs(system)}"
        if system is not None
        else f"{note or name_crs(system)}: not longitude and latitude"
    )
    collection["features"] = [
        {
            "type": "Feature",
            "properties": {name: values[k] for name, values in layer.values.items()},
            "geometry": _describe(geometry, layer.kind, decimals),
        }
        for k, geometry in enumerate(geometries)
    ]
    Path(path).write_bytes(orjson.dumps(collection, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n")


def _describe(geometry: Any, kind: str, decimals: int) -> dict[str, Any]:
    """Give a geometry as GeoJSON does, rings closed and counter-clockwise outside."""
    if kind == "Point":
        return {"type": kind, "coordinates": _round(geometry, decimals)[0]}
    if kind == "MultiPolygon":
        coordinates: list = [
            [_round(ring, decimals) for ring in (part.exterior, *part.interiors)]
            for part in geometry.geoms
        ]
    else:
        coordinates = [_round(part, decimals) for part in geometry.geoms]
    return {"type": kind, "coordinates": coordinates}


def _round(line: Any, decimals: int) -> list:
    return np.round(np.asarray(line.coords)[:, :2], decimals).tolist()
