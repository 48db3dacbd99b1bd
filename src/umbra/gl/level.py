"""
Sides in the ground's plane, of a light that lies in it too.

Such a side and the ground are one plane: the depth buffer cannot tell which is nearer. A point of
the ground is meant as the limit from the viewer's side, so these sides count as behind it. Nothing
else can be seen beyond them, since the ground has no end.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.flags import DRAWS
from umbra.scene.mesh import transform_points

_LIGHT_CAP = DRAWS.index(("light_cap", False))
__all__ = ["find_level_points", "is_level", "split_level"]


def is_level(light: NDArray[np.float64], ground: float | None) -> bool:
    """Return whether a light (4,) lies in the plane z = ``ground``, both in one frame."""
    return ground is not None and bool(light[2] == light[3] * ground)


def find_level_points(
    bodies: Sequence[Body], ground: float | None, n_points: int
) -> NDArray[np.bool_]:
    """Find the points (n_points,) of the geometry that lie in the plane z = ``ground``."""
    found = np.zeros(n_points, np.bool_)
    for body in bodies:
        for first, transform in zip(body.first, body.transforms, strict=True):
            heights = transform_points(transform, body.caster.vertices)[:, 2]
            found[first : first + len(heights)] = heights == ground
    return found


def split_level(
    lists: Sequence[NDArray[np.uint32]], is_level_point: NDArray[np.bool_]
) -> list[NDArray[np.uint32]]:
    """
    Take the sides in the plane out of the lists of `DRAWS`.

    Those counted behind the visible surface go to the light caps, which are always behind it.
    """
    found = list(lists)
    for place, (name, _) in enumerate(DRAWS):
        if name.startswith("sides"):
            triangles = found[place].reshape(-1, 3)
            inside = is_level_point[triangles >> np.uint32(1)].all(1)
            found[place] = triangles[~inside].ravel()
            if name == "sides_z_fail":
                found[_LIGHT_CAP] = np.concatenate([found[_LIGHT_CAP], triangles[inside].ravel()])
    return found
