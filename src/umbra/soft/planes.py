"""Penumbra wedges as four planes each: outside of them an edge does not matter."""

import numpy as np
from numba import njit

__all__ = ["is_in", "make_planes"]


@njit(cache=True, nogil=True)
def make_planes(ends, light, radius, planes):
    """
    Bound the penumbra wedge of each edge by four planes.

    Two hold the edge, two an end of it, and all touch the sphere of the light. With y
    on the edge, x in the light and P behind y, all have n·(P - y) <= 0.

    Parameters
    ----------
    ends : (n, 6) float64
        Edges, in the light's frame [m].
    light : (4,) float64
        Middle of the light; for w = 0 of length 1.
    radius : float
        Of the sphere [m]; tangent of the angle of a disc in the sky.
    planes : (n, 4, 4) float64
        Written: unit normals, outward, and offsets; 0 where the edge's line meets the
        sphere, and nothing is bounded.
    """
    e = np.empty(3)
    t = np.empty(3)
    a = np.empty(3)
    b = np.empty(3)
    is_point = light[3] > 0.0
    far_sine = radius / np.sqrt(1.0 + radius * radius)
    for i in range(ends.shape[0]):
        length = 0.0
        for k in range(3):
            t[k] = ends[i, k + 3] - ends[i, k]
            length += t[k] * t[k]
        length = np.sqrt(length)
        planes[i] = 0.0
        if length == 0.0:
            continue
        along = 0.0
        for k in range(3):
            t[k] /= length
            e[k] = light[k] - ends[i, k] if is_point else light[k]
            along += t[k] * e[k]
        apart = 0.0
        for k in range(3):
            e[k] -= along * t[k]
            apart += e[k] * e[k]
        apart = np.sqrt(apart)
        limit = radius if is_point else far_sine
        if apart <= limit * 1.0001:
            continue
        sine = limit / apart
        cosine = np.sqrt(1.0 - sine * sine)
        for k in range(3):
            e[k] /= apart
        b[0] = t[1] * e[2] - t[2] * e[1]
        b[1] = t[2] * e[0] - t[0] * e[2]
        b[2] = t[0] * e[1] - t[1] * e[0]
        for k in range(3):
            planes[i, 0, k] = cosine * b[k] + sine * e[k]
            planes[i, 1, k] = -cosine * b[k] + sine * e[k]
        for end in range(2):
            away = 0.0
            inward = 1.0 - 2.0 * end
            for k in range(3):
                a[k] = light[k] - ends[i, 3 * end + k] if is_point else light[k]
                away += a[k] * a[k]
            away = np.sqrt(away)
            along = 0.0
            for k in range(3):
                a[k] /= away
                along += a[k] * t[k] * inward
            sine = radius / away if is_point else far_sine
            cosine = np.sqrt(1.0 - sine * sine)
            across = np.sqrt(max(1.0 - along * along, 0.0))
            for k in range(3):
                # The part of the edge's way inward that is across the way to the light.
                planes[i, 2 + end, k] = (
                    sine * a[k] - cosine * (t[k] * inward - along * a[k]) / across
                )
        for p in range(4):
            first = 3 if p == 3 else 0
            for k in range(3):
                planes[i, p, 3] -= planes[i, p, k] * ends[i, first + k]


@njit(cache=True, nogil=True)
def is_in(planes, x, y, z, margin):
    """Whether a place is in a wedge of ``make_planes``, or within a margin of it."""
    for k in range(4):
        p = planes[k]
        if p[0] * x + p[1] * y + p[2] * z + p[3] > margin:
            return False
    return True
