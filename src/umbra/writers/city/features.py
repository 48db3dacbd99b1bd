"""Figures of each surface in a GLB: a property table that viewers of 3D Tiles show on a click."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.writers.glb import Glb

__all__ = ["add_features"]

_CLASS = "surface"
_NO_AZIMUTH = -1.0  # of level surfaces
_UNITS = {"azimuth": "degree", "tilt": "degree", "area": "m2"}


def add_features(glb: Glb, columns: Mapping[str, NDArray]) -> None:
    """
    Add a table of features to the last mesh, whose ``_FEATURE_ID_0`` names the rows.

    Parameters
    ----------
    glb : Glb
    columns : mapping
        Text or numbers of each feature, by name.
    """
    schema: dict[str, object] = {}
    table: dict[str, object] = {}
    count = 0
    for name, values in columns.items():
        key, count = re.sub(r"\W", "_", name), len(values)
        if values.dtype.kind == "O":
            schema[key] = {"name": name, "type": "STRING"}
            table[key] = _add_text(glb, [str(value) for value in values])
            continue
        numbers = np.nan_to_num(values, nan=_NO_AZIMUTH).astype("<f4")
        known: dict[str, object] = {"type": "SCALAR", "componentType": "FLOAT32"}
        if name == "azimuth":
            known["noData"] = _NO_AZIMUTH
        unit = _UNITS.get(name, "h")
        schema[key] = {"name": name, **known, "description": f"[{unit}]"}
        table[key] = {"values": glb.add_bytes(numbers.tobytes())}
    glb.use("EXT_mesh_features", "EXT_structural_metadata")
    glb.more["extensions"] = {
        "EXT_structural_metadata": {
            "schema": {"id": "umbra", "classes": {_CLASS: {"properties": schema}}},
            "propertyTables": [{"class": _CLASS, "count": count, "properties": table}],
        }
    }
    features = {"featureCount": count, "attribute": 0, "propertyTable": 0}
    primitives: Any = glb.meshes[-1]["primitives"]
    primitives[0]["extensions"] = {"EXT_mesh_features": {"featureIds": [features]}}


def _add_text(glb: Glb, texts: list[str]) -> dict[str, object]:
    """Add texts, one after the other, and where each begins and the last ends."""
    packed = [text.encode("utf-8", "replace") for text in texts]
    starts = np.cumsum([0, *map(len, packed)]).astype("<u4")
    return {
        "values": glb.add_bytes(b"".join(packed) or b"\0"),
        "stringOffsets": glb.add_bytes(starts.tobytes()),
        "stringOffsetType": "UINT32",
    }
