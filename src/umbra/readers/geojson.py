"""GeoJSON: the polygons of its features and their properties."""

from itertools import chain
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.readers.footprints import extrude_table
from umbra.readers.georeference import name_crs
from umbra.readers.model import Choices, Model
from umbra.readers.table import Rings, Table

__all__ = ["read_geojson"]


def read_geojson(documents: list[Any], choices: Choices) -> Model:
    """
    Read parsed GeoJSON: a collection, a feature, or a feature a line.

    Parameters
    ----------
    documents : list of dict
    choices : Choices
        With the columns of the heights.

    Returns
    -------
    model : Model

    Raises
    ------
    InputError
        If a feature is damaged (which), or none has a height.
    """
    features: list[Any] = []
    for document in documents:
        features += _list_features(document)
    left: dict[str, int] = {}
    polygons: list[Any] = []
    owner: list[int] = []
    for row, feature in enumerate(features):
        try:
            found = _find_polygons(feature.get("geometry"), left)
            _touch_corners(found)
        except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
            msg = (
                f"feature {row + 1} of {len(features)} has damaged coordinates; "
                "repair it or export the file again"
            )
            raise InputError(msg, feature=row + 1) from error
        polygons += found
        owner += [row] * len(found)
    rings = _flatten(polygons, owner)
    crs, note = _find_crs(documents[0], rings)
    notes = tuple(f"{what} left out: {n}" for what, n in left.items())
    return extrude_table(
        Table(
            "GeoJSON",
            rings,
            [_name(feature) for feature in features],
            _gather_columns(features),
            crs,
            (*notes, *note),
        ),
        choices,
    )


def _list_features(document: Any) -> list[Any]:
    kind = document.get("type") if isinstance(document, dict) else None
    if kind == "FeatureCollection":
        features = document.get("features")
        if not isinstance(features, list) or not all(isinstance(f, dict) for f in features):
            msg = "is GeoJSON whose features are no list of objects; export it again"
            raise InputError(msg)
        return features
    return [document] if kind == "Feature" else [{"type": "Feature", "geometry": document}]


def _find_polygons(geometry: Any, left: dict[str, int]) -> list[Any]:
    """Give the polygons of a geometry; count what is none."""
    if geometry is None:
        left["features without a geometry"] = left.get("features without a geometry", 0) + 1
        return []
    kind = geometry["type"]
    if kind == "Polygon":
        rings = geometry["coordinates"]
        return [rings] if rings else []
    if kind == "MultiPolygon":
        return [rings for rings in geometry["coordinates"] if rings]
    if kind == "GeometryCollection":
        return list(chain.from_iterable(_find_polygons(g, left) for g in geometry["geometries"]))
    what = f"{'points' if 'Point' in str(kind) else 'lines'} among the footprints"
    left[what] = left.get(what, 0) + 1
    return []


def _touch_corners(polygons: list[Any]) -> None:
    """Raise where a ring is no list of lists of two numbers, as far as its first corner tells."""
    for ring in chain.from_iterable(polygons):
        _ = ring[0][1]


def _flatten(polygons: list[Any], owner: list[int]) -> Rings:
    lengths, polygon = [], []
    points: list[Any] = []
    for index, rings in enumerate(polygons):
        for ring in rings:
            # The closing corner repeats the first.
            corners = ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring
            lengths.append(len(corners))
            polygon.append(index)
            points += [corner[:2] for corner in corners]
    try:
        array = np.array(points, np.float64).reshape(len(points), 2)
    except (TypeError, ValueError) as error:
        wrong = next((p for p in points if not all(isinstance(v, int | float) for v in p)), None)
        msg = f"has a corner that is no pair of numbers ({str(wrong)[:60]}); export it again"
        raise InputError(msg) from error
    return Rings(
        array, np.array(lengths, np.int64), np.array(polygon, np.int64), np.array(owner, np.int64)
    )


def _find_crs(head: dict[str, Any], rings: Rings) -> tuple[str | None, tuple[str, ...]]:
    """Give the CRS: as named, else degrees as the standard has it, if they can be."""
    named = head.get("crs")
    if isinstance(named, dict):
        properties = named.get("properties")
        crs = name_crs(properties.get("name")) if isinstance(properties, dict) else None
        if crs is not None:
            return crs, ()
    # NaN is neither; the scene names it.
    if not (np.abs(rings.points) > [180.0, 90.0]).any():
        return "OGC:CRS84", ()
    note = "the coordinates are not degrees and no CRS is named, so they are taken as metres"
    return None, (note,)


def _gather_columns(features: list[Any]) -> dict[str, list[Any]]:
    """Give the properties column by column."""
    rows = [feature.get("properties") for feature in features]
    filled = [row if isinstance(row, dict) else {} for row in rows]
    names = dict.fromkeys(chain.from_iterable(filled))
    return {name: [row.get(name) for row in filled] for name in names}


def _name(feature: dict[str, Any]) -> str | None:
    name = feature.get("id")
    return str(name) if isinstance(name, str | int) else None
