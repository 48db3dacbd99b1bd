"""
glTF that says where on the earth it lies: in geocentric coordinates, or by its scene's CRS.

``CESIUM_RTC``, or nodes that are placed about the earth's centre as in 3D Tiles (glTF's y axis
is the earth's axis); BlenderGIS writes ``SRID``, ``crs x`` and ``crs y`` of the origin.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.readers.georeference import is_known_crs, name_crs
from umbra.readers.gltf_buffers import find_item
from umbra.readers.model import FileModel, FilePlace, ReadChoices, turning
from umbra.readers.placing import move_light, move_parts_by
from umbra.readers.tileset_frame import NEAREST, Frame
from umbra.scene.numbers import OUTSIDE

__all__ = ["find_centre", "put_on_earth"]

_CENTRE = "CESIUM_RTC"
_HEIGHTS = -1_000.0, 10_000.0  # of models above the ellipsoid [m]

Matrix = NDArray[np.float64]


def find_centre(tree: dict[str, Any]) -> Matrix:
    """Return the matrix (4, 4) from a file's coordinates, z up, to those about its centre [m]."""
    matrix = np.eye(4)
    given = tree.get("extensions", {}).get(_CENTRE)
    if given is not None:
        matrix[:3, 3] = np.array(given["center"], np.float64).reshape(3)
        if not (np.abs(matrix) <= OUTSIDE).all():
            msg = f"has a centre ({_CENTRE}) that is no place; export it again"
            raise InputError(msg)
    return matrix


def put_on_earth(model: FileModel, tree: dict[str, Any], choices: ReadChoices) -> FileModel:
    """
    Return a file's model east, north and up at its origin, with the site that it states.

    The origin is its centre, or its first node that is placed on the earth, or its first vertex.
    """
    anchor = _find_anchor(model, tree)
    if anchor is None:
        return _put_in_crs(model, tree, choices)
    wrong = turning("y").T  # as written by who leaves geocentric coordinates as they are
    frames = [(Frame(anchor), np.eye(4))]
    if choices.up is None and not _is_high(frames[0][0]):
        turned = wrong[:3, :3] @ anchor
        frames.append((Frame(turned), wrong))
    fitting = [frame for frame in frames if _is_high(frame[0])]
    if not fitting:
        msg = (
            f"lies {frames[0][0].height / 1000:,.0f} km above the ellipsoid by its geocentric "
            "coordinates; export it with the earth's axis as y, as glTF in 3D Tiles has it"
        )
        raise InputError(msg)
    frame, turn = fitting[0]
    matrix = frame.matrix @ turn
    matrix[2, 3] -= frame.height
    notes = [
        f"its geocentric coordinates are read east, north and up at latitude {frame.latitude:.6f}°,"
        f" longitude {frame.longitude:.6f}°, its origin {frame.height:.2f} m above the ellipsoid"
        + (", with z as the earth's axis, as y gives no place on it" if turn is wrong else "")
    ]
    site = FilePlace(
        frame.latitude, frame.longitude, frame.height, 0.0,
        altitude=frame.height, is_ellipsoidal=True,
    )  # fmt: skip
    return replace(
        model, parts=move_parts_by(model.parts, matrix), place=site,
        lights=tuple(move_light(light, matrix) for light in model.lights),
        notes=(*model.notes, *notes),
    )  # fmt: skip


def _is_high(frame: Frame) -> bool:
    return _HEIGHTS[0] < frame.height < _HEIGHTS[1]


def _find_anchor(model: FileModel, tree: dict[str, Any]) -> Matrix | None:
    """Return the geocentric origin of a model, (3,); None if it does not lie on the earth."""
    centre = find_centre(tree)[:3, 3]
    if _is_far(centre):
        return centre
    for part in model.parts[:1]:
        own = np.eye(4) if part.transform is None else np.asarray(part.transform)
        vertex = own[:3, :3] @ part.mesh.vertices[part.mesh.faces[0, 0]] + own[:3, 3]
        if _is_far(vertex):
            return own[:3, 3] if _is_far(own[:3, 3]) else vertex
    return None


def _is_far(matrix: Matrix) -> bool:
    return bool(NEAREST < np.linalg.norm(matrix) < 2 * NEAREST)


def _put_in_crs(model: FileModel, tree: dict[str, Any], choices: ReadChoices) -> FileModel:
    """Bring a model to the CRS that its scene's own properties name."""
    if not tree.get("scenes"):
        return model
    extras = find_item(tree, "scenes", tree.get("scene", 0)).get("extras")
    if not isinstance(extras, dict) or "SRID" not in extras:
        return model
    crs = name_crs(extras["SRID"])
    numbers = [extras.get(f"crs {axis}") for axis in "xy"]
    if crs is None or not is_known_crs(crs) or not all(type(v) in (int, float) for v in numbers):
        note = f"its scene's place in a CRS is not known: SRID {show_value(extras['SRID'])}"
        return replace(model, notes=(*model.notes, note))
    if choices.is_placed:
        return replace(model, crs=crs)
    matrix = np.eye(4)
    matrix[:2, 3] = numbers
    return replace(
        model, crs=crs, parts=move_parts_by(model.parts, matrix),
        lights=tuple(move_light(light, matrix) for light in model.lights),
    )  # fmt: skip
