"""Faces and edges cut by a meridian: the half plane from the zenith's axis toward an azimuth."""

import math

from umbra.kernels import inlined

__all__ = ["ZENITH", "cut_edge", "cut_face", "cut_plane", "find_slope"]

_UPRIGHT = 1e-13  # vertical part of a normal
ZENITH = -3
"""What bounds a piece of sky that reaches the zenith."""


@inlined
def cut_face(corners, n, dx, dy):
    """
    Find what a face covers of the meridian toward (dx, dy).

    Returns the tangents of the lowest and highest altitude, and the edges there; the highest is
    infinite with edge -1 where the face holds the zenith. Nothing: the lowest is infinite.

    The edge's corner on the positive side comes second, so that both faces of an edge agree.
    """
    low, high = math.inf, -math.inf
    low_edge, high_edge = -1, -1
    over = False
    x, y = corners[n - 1, 0], corners[n - 1, 1]
    across = dx * y - dy * x
    for k in range(n):
        before = k - 1 if k > 0 else n - 1
        x, y = corners[k, 0], corners[k, 1]
        after = dx * y - dy * x
        if (across > 0.0) != (after > 0.0):
            i, j, u, v = (k, before, after, across) if across > 0.0 else (before, k, across, after)
            along = (dx * corners[i, 0] + dy * corners[i, 1]) * v
            along -= (dx * corners[j, 0] + dy * corners[j, 1]) * u
            up = corners[i, 2] * v - corners[j, 2] * u
            if along > 0.0:
                slope = up / along
                if slope < low:
                    low, low_edge = slope, before
                if slope >= high:
                    high, high_edge = slope, before
            else:
                over = True
        across = after
    if over and low < math.inf:
        return low, math.inf, low_edge, -1
    return low, high, low_edge, high_edge


@inlined
def cut_edge(a, b, dx, dy):
    """Return the unit vector (along, up) where the edge from a to b meets a meridian."""
    u = dx * a[1] - dy * a[0]
    v = dx * b[1] - dy * b[0]
    share = 0.0
    if u != v:
        share = min(max(u / (u - v), 0.0), 1.0)
    along = dx * (a[0] + share * (b[0] - a[0])) + dy * (a[1] + share * (b[1] - a[1]))
    up = a[2] + share * (b[2] - a[2])
    along = max(along, 0.0)
    length = math.sqrt(along * along + up * up)
    if length == 0.0:  # an edge through the zenith, at its end on the other side
        return 1.0, 0.0
    return along / length, up / length


@inlined
def cut_plane(normal, dx, dy):
    """
    Return the unit vector (along, up) where the receiver's plane meets a meridian.

    That is the zenith where an upright plane holds the meridian: a face that is cut there may end
    in it within a slice as narrow as rounding.
    """
    along, up = normal[2], -(normal[0] * dx + normal[1] * dy)
    if along < 0.0:
        along, up = -along, -up
    up = max(up, 0.0)
    length = math.sqrt(along * along + up * up)
    if length == 0.0:
        return 0.0, 1.0
    return along / length, up / length


@inlined
def find_slope(normal, dx, dy):
    """
    Find what lies behind the receiver's plane on a meridian, as tangents of altitudes from and to.

    Nothing: the first is infinite.
    """
    ahead = normal[0] * dx + normal[1] * dy
    if abs(normal[2]) < _UPRIGHT:
        return (0.0, math.inf) if ahead <= 0.0 else (math.inf, math.inf)
    slope = -ahead / normal[2]
    if normal[2] > 0.0:
        return (0.0, slope) if slope > 0.0 else (math.inf, math.inf)
    return max(slope, 0.0), math.inf
