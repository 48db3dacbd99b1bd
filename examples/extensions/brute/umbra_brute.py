"""
A device for umbra: every ray against every triangle, in numpy.

It counts what lies in the open (ground, roofs, walls, points, pictures) as plainly as can be, to
check faster ones by; canopies it leaves to umbra's own.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.extending import PointDevice

AT_ONCE = 2_000_000
"""Pairs of a point and a triangle whose crossings are held at a time."""
ABOVE = 1e-6
"""How far along its normal a ray begins over its surface [m]."""


class Brute(PointDevice):
    """Moeller and Trumbore's crossing of a ray and a triangle (1997), in float64."""

    name, title = "brute", "brute force"

    def find_hidden(
        self, triangles: NDArray, points: NDArray, normals: NDArray, lights: NDArray
    ) -> NDArray:
        """Return, for each light and point, 1 where a triangle lies between."""
        hidden = np.zeros((len(lights), len(points)), np.uint8)
        step = max(AT_ONCE // max(len(triangles), 1), 1)
        for first in range(0, len(points), step):
            some = slice(first, first + step)
            start = points[some] + ABOVE * np.nan_to_num(normals[some])
            for light, found in zip(lights, hidden, strict=True):
                toward = light[:3] - light[3] * start  # to a lamp, or in a direction
                toward = np.broadcast_to(toward, start.shape)
                is_behind = np.einsum("ij,ij->i", np.nan_to_num(normals[some]), toward) <= 0
                is_behind &= ~np.isnan(normals[some, 0])
                found[some] = is_behind | meets(triangles, start, toward, is_lamp=light[3] > 0)
        return hidden


def meets(
    triangles: NDArray, start: NDArray, toward: NDArray, *, is_lamp: bool
) -> NDArray[np.bool_]:
    """Return whether each ray (n, 3) meets one of the triangles (m, 3, 3) before its light."""
    first = triangles[None, :, 0]
    one, two = triangles[None, :, 1] - first, triangles[None, :, 2] - first
    across = np.cross(toward[:, None], two)
    size = np.einsum("nmk,nmk->nm", np.broadcast_to(one, across.shape), across)
    away = start[:, None] - first
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("nmk,nmk->nm", away, across) / size
        turned = np.cross(away, one)
        v = np.einsum("nmk,nmk->nm", np.broadcast_to(toward[:, None], turned.shape), turned) / size
        along = np.einsum("nmk,nmk->nm", np.broadcast_to(two, turned.shape), turned) / size
        inside = (size != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (along > 0)
    return (inside & (along < 1 if is_lamp else True)).any(1)
