"""Turn a file's axes so that z is up."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Part

__all__ = ["turn_up", "turning"]

# Rotations, not reflections, and whole numbers: windings and digits stay.
TURNS = {
    "x": np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
    "y": np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    "z": np.eye(4),
}


def turning(up: str) -> NDArray[np.float64]:
    """Give the rotation (4, 4) that brings the axis ``up`` to z: y gives (x, -z, y)."""
    return TURNS[up]


def turn_up(parts: tuple[Part, ...], up: str | None) -> tuple[Part, ...]:
    """
    Turn parts so that z is up; shared meshes stay shared.

    Parameters
    ----------
    parts : tuple of Part
    up : {'x', 'y', 'z'} or None
        The axis that points up in them; None is z.

    Returns
    -------
    parts : tuple of Part
    """
    if up is None or up == "z":
        return parts
    matrix = TURNS[up]
    arrays: dict[int, NDArray[np.float64]] = {}
    turned = []
    for part in parts:
        if part.transform is not None:
            turned.append(replace(part, transform=matrix @ part.transform))
            continue
        array, normals = part.mesh.vertices, part.mesh.normals
        if id(array) not in arrays:
            arrays[id(array)] = _turn(array, matrix)
        if normals is not None:
            normals = _turn(normals, matrix)
        turned.append(replace(part, mesh=part.mesh.moved(arrays[id(array)], normals)))
    return tuple(turned)


def _turn(array: NDArray[Any], matrix: NDArray[np.float64]) -> NDArray[Any]:
    # By columns, not by a product: 0 times infinity would spread NaN.
    axes, signs = np.abs(matrix[:3, :3]).argmax(1), matrix[:3, :3].sum(1)
    return np.ascontiguousarray(array[:, axes] * signs)
