"""Where a place stands: the faces above and below it, and the body around it."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.scene import Scene, Triangles

__all__ = ["find_crossings", "find_holder"]


def find_crossings(
    soup: Triangles, x: float, y: float
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.int64]]:
    """
    Find the faces that a vertical line meets.

    Parameters
    ----------
    soup : Triangles
    x, y : float
        In the soup's frame [m].

    Returns
    -------
    faces : (n,) int
        Indices; upright faces are left out.
    z : (n,) float64
        Height at which the line meets each [m].
    turns : (n,) int
        1 where the line, upward, leaves the body that the face bounds, -1 where it enters.
    """
    flat = soup.vertices[:, :2] - (x, y)
    corners = flat[soup.faces]
    near = np.flatnonzero((corners.min(1) <= 0).all(1) & (corners.max(1) >= 0).all(1))
    a, b, c = (corners[near, k] for k in range(3))
    # Twice the areas of the triangles from the place to each edge; they sum to the face's.
    shares = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], 1)
    whole = shares.sum(1)
    held = (whole != 0) & ((shares >= 0).all(1) | (shares <= 0).all(1))
    near, shares, whole = near[held], shares[held], whole[held]
    z = (shares * soup.vertices[soup.faces[near], 2]).sum(1) / whole
    return near, z, np.sign(whole).astype(np.int64)


def find_holder(scene: Scene, soup: Triangles, point: ArrayLike) -> str:
    """
    Return the name of an object around a point, or nothing.

    Of an object that is open above or below the point it is not known what is inside: such
    objects hold nothing.

    Parameters
    ----------
    scene : Scene
    soup : Triangles
        The scene's.
    point : (3,) array_like
        In the soup's frame [m].
    """
    x, y, height = (float(v) for v in np.asarray(point))
    faces, z, turns = find_crossings(soup, x, y)
    things = scene.groups()[soup.part[faces]]
    for thing in np.unique(things):
        mine = things == thing
        if turns[mine].sum() == 0 and turns[mine & (z > height)].sum() != 0:
            return str(scene.parts[soup.part[faces[mine][0]]].full_name)
    return ""


def _cross(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
