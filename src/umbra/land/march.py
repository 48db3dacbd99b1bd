"""
Rays over a raster of heights: the largest slope to the land along each.

Between four cell centres the land is bilinear, so along a ray it is a parabola, whose highest
elevation is at one of its ends or where its derivative is 0: nothing is sampled.
"""

import math

from umbra.kernels import inlined, kernel

__all__ = ["interpolate", "march"]

_SHORT = 1e-9  # share of a piece of a ray, within rounding of a cell's edge


@inlined
def find_land_slope(height, distance, eye, radius):
    """
    Return the tangent of the elevation at which an eye sees a place.

    Heights are above a sphere of this radius and the distance is along it [m]. Sine and versine are
    by their series: to 1e-13 up to a hundredth of the radius and twice that.
    """
    angle = distance / radius
    square = angle * angle
    low = (radius + height) * square * (0.5 - square / 24.0 * (1.0 - square / 30.0))
    away = (radius + height) * angle * (1.0 - square / 6.0 * (1.0 - square / 20.0))
    return (height - eye - low) / away


@kernel
def interpolate(heights, u, v):
    """Return the height (NaN without) at a column u and a row v of cell centres."""
    i = min(max(math.floor(u), 0), heights.shape[1] - 2)
    j = min(max(math.floor(v), 0), heights.shape[0] - 2)
    a, b = u - i, v - j
    north = heights[j, i] + a * (heights[j, i + 1] - heights[j, i])
    south = heights[j + 1, i] + a * (heights[j + 1, i + 1] - heights[j + 1, i])
    return north + b * (south - north)


@inlined
def clip(start, step, low, high, first, last):
    """Cut the share [first, last] of a line to where its coordinate is within bounds."""
    if step == 0.0:
        return (first, last) if low <= start <= high else (1.0, 0.0)
    enter, leave = (low - start) / step, (high - start) / step
    return max(first, min(enter, leave)), min(last, max(enter, leave))


@inlined
def find_reach_end(start, step, cell, first, last):
    """Return the share of a line at which its coordinate leaves a cell, at most the last."""
    if step == 0.0:
        return last
    return min(last, max((cell + (step > 0.0) - start) / step, first))


@inlined
def find_highest_land(near, far, twist, here, length, eye, radius):
    """
    Return the largest slope over one cell, and the share of the way through it where it is.

    Heights are near + t (far - near) + twist t (t - 1) at distances here + t length [m].
    """
    at, slope = 0.0, find_land_slope(near, here, eye, radius)
    other = find_land_slope(far, here + length, eye, radius)
    if other > slope:
        at, slope = 1.0, other
    # Of (height - s^2 / 2R - eye) / s, whose numerator is base + linear t + bend t^2.
    bend = twist - length * length / (2.0 * radius)
    base = near - eye - here * here / (2.0 * radius)
    linear = far - near - twist - here * length / radius
    rise = linear * here - length * base
    if rise > 0.0 > rise + bend * (length + 2.0 * here):
        t = (math.sqrt(here * here - length * rise / bend) - here) / length
        height = near + t * (far - near) + twist * t * (t - 1.0)
        other = find_land_slope(height, here + t * length, eye, radius)
        if other > slope:
            at, slope = t, other
    return slope, at


@kernel
def march(heights, frame, core, nodes, eyes, radii, slopes, distances, seen, missing):
    """
    Raise the slopes of rays by the land of one block.

    Parameters
    ----------
    heights : (rows, cols) float32
        Of a block [m]; NaN where there is none.
    frame : (4,) float64
        First column and row of the block, and columns and rows of the raster in one of its cells:
        1 where it is not thinned.
    core : (4,) float64
        Columns u and rows v of centres, u0, v0, u1, v1, between which the block counts.
    nodes : (n_rays, n_nodes, 3) float64
        Column u, row v and distance [m] along each ray, straight in between.
    eyes, radii : (n_rays,) float64
        Height of the eye; effective radius of the earth [m].
    slopes, distances : (n_rays,) float64
        Largest tangent so far, raised; and where it is [m].
    seen, missing : (n_rays,) float64
        Farthest distance with land; length of the ray over cells without heights, added [m].
    """
    rows, cols = heights.shape
    for n in range(nodes.shape[0]):
        for k in range(nodes.shape[1] - 1):
            u, v, s = nodes[n, k]
            du, dv, ds = nodes[n, k + 1, 0] - u, nodes[n, k + 1, 1] - v, nodes[n, k + 1, 2] - s
            if not (math.isfinite(u + v + du + dv) and ds > 0.0):
                continue
            first, last = clip(u, du, core[0], core[2], 0.0, 1.0)
            first, last = clip(v, dv, core[1], core[3], first, last)
            if last - first <= 0.0:
                continue
            # In centres of the block's own cells, which are thinned.
            u, du = (u + 0.5 - frame[0]) / frame[2] - 0.5, du / frame[2]
            v, dv = (v + 0.5 - frame[1]) / frame[3] - 0.5, dv / frame[3]
            first, last = clip(u, du, 0.0, cols - 1.0, first, last)
            share, last = clip(v, dv, 0.0, rows - 1.0, first, last)
            while share < last - _SHORT:
                middle = share + _SHORT
                i = min(max(math.floor(u + du * middle), 0), cols - 2)
                j = min(max(math.floor(v + dv * middle), 0), rows - 2)
                end = find_reach_end(v, dv, j, middle, find_reach_end(u, du, i, middle, last))
                z, east = heights[j, i], heights[j, i + 1] - heights[j, i]
                south = heights[j + 1, i] - z
                both = heights[j + 1, i + 1] - z - east - south
                a, b = u + du * share - i, v + dv * share - j
                c, d = u + du * end - i, v + dv * end - j
                near = z + a * east + b * south + a * b * both
                far = z + c * east + d * south + c * d * both
                here, length = s + ds * share, ds * (end - share)
                share = end
                if math.isnan(near + far):
                    missing[n] += length
                    continue
                seen[n] = max(seen[n], here + length)
                twist = both * (c - a) * (d - b)
                slope, at = find_highest_land(near, far, twist, here, length, eyes[n], radii[n])
                if slope > slopes[n]:
                    slopes[n], distances[n] = slope, here + at * length
