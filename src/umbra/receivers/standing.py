"""Where a place stands: the faces above and below it, and the body around it."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.scene import Scene, Triangles

__all__ = ["find_crossings", "name_holders"]


def name_holders(scene: Scene, soup: Triangles, points: ArrayLike) -> list[str]:
    """
    Return the name of an object around each point, or nothing.

    Of an object that is open above or below a point it is not known what is inside: such
    objects hold nothing.

    Parameters
    ----------
    scene : Scene
    soup : Triangles
        The scene's.
    points : (n, 3) array_like
        In the soup's frame [m].
    """
    corners = soup.vertices[:, :2][soup.faces]
    # Bounds are found once for all points, in columns: a point then reads each of them once.
    (west, south), (east, north) = corners.min(1).T.copy(), corners.max(1).T.copy()
    names = []
    for x, y, height in np.asarray(points, np.float64).reshape(-1, 3).tolist():
        near = np.flatnonzero((west <= x) & (east >= x) & (south <= y) & (north >= y))
        faces, z, turns = find_crossings(soup, x, y, near)
        groups = scene.groups()[soup.part[faces]]
        holder = ""
        for group in np.unique(groups):
            is_own = groups == group
            if turns[is_own].sum() == 0 and turns[is_own & (z > height)].sum() != 0:
                holder = str(scene.parts[soup.part[faces[is_own][0]]].full_name)
                break
        names.append(holder)
    return names


def find_crossings(
    soup: Triangles, x: float, y: float, among: NDArray[np.intp] | None = None
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.int64]]:
    """
    Find the faces that a vertical line meets.

    Parameters
    ----------
    soup : Triangles
    x, y : float
        In the soup's frame [m].
    among : (m,) int, optional
        Faces to look at; all by default.

    Returns
    -------
    faces : (n,) int
        Indices; upright faces are left out.
    z : (n,) float64
        Height at which the line meets each [m].
    turns : (n,) int
        1 where the line, upward, leaves the body that the face bounds, -1 where it enters.
    """
    near = np.arange(len(soup.faces)) if among is None else among
    a, b, c = (soup.vertices[soup.faces[near, k], :2] - (x, y) for k in range(3))
    # Twice the areas of the triangles from the place to each edge; they sum to the face's.
    shares = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], 1)
    whole = shares.sum(1)
    held = (whole != 0) & ((shares >= 0).all(1) | (shares <= 0).all(1))
    near, shares, whole = near[held], shares[held], whole[held]
    z = (shares * soup.vertices[soup.faces[near], 2]).sum(1) / whole
    return near, z, np.sign(whole).astype(np.int64)


def _cross(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
