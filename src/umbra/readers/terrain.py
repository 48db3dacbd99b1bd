"""Parts whose height nobody gave, set on a terrain."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Part, Scene

__all__ = ["find_ground", "stand_on"]


def stand_on(parts: Sequence[Part], terrain: Sequence[Part]) -> tuple[tuple[Part, ...], int]:
    """
    Raise each part by the lowest terrain below it.

    Below each corner counts the terrain's nearest vertex, so the height is that of a
    cell's centre and not a mean.

    Parameters
    ----------
    parts : sequence of Part
        On z = 0, without transforms.
    terrain : sequence of Part
        In the same coordinates.

    Returns
    -------
    parts : tuple of Part
    missed : int
        Parts that lie wholly outside the terrain's rectangle: its edge counts for them.
    """
    soup = Scene(tuple(parts), np.zeros(3)).triangles()
    corner = soup.faces.ravel()
    owner = np.repeat(soup.part, 3)
    height, inside = find_ground(terrain, soup.vertices[:, :2])
    lift = np.full(len(parts), np.inf)
    np.minimum.at(lift, owner, height[corner])
    missed = len(parts) - len(np.unique(owner[inside[corner]]))
    moved = []
    for part, height in zip(parts, lift.tolist(), strict=True):
        corners, faces = np.unique(part.mesh.faces, return_inverse=True)
        vertices = part.mesh.vertices[corners]
        vertices[:, 2] += height
        mesh = replace(part.mesh, vertices=vertices, faces=faces.reshape(-1, 3).astype(np.int32))
        moved.append(replace(part, mesh=mesh))
    return tuple(moved), missed


def find_ground(
    terrain: Sequence[Part], plan: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """
    Give the height of the terrain's nearest vertex: of a raster, that of the cell's centre.

    Parameters
    ----------
    terrain : sequence of Part
    plan : (n, 2) float64
        In the same coordinates.

    Returns
    -------
    heights : (n,) float64
        [m]
    inside : (n,) bool
        Which lie in the terrain's rectangle.
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    ground = Scene(tuple(terrain), np.zeros(3)).triangles()
    is_used = np.zeros(len(ground.vertices), np.bool_)
    is_used[ground.faces.ravel()] = True
    used = ground.vertices[is_used]
    _, nearest = cKDTree(used[:, :2]).query(plan)
    inside = ((plan >= used[:, :2].min(0)) & (plan <= used[:, :2].max(0))).all(1)
    return used[nearest, 2], inside
