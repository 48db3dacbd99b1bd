"""
Integrals over parts of the sky in closed form, from the arcs of great circles around them.

The first moment of a spherical polygon (the integral of w over its directions w) is Lambert's sum
over its arcs, 1/2 sum t n; the second moment adds sum (p + q) n t' / 3, irradiance tensors (Arvo
1995). Here each arc from p to q stands for the triangle between it and the zenith, whose other two
sides are meridians: the free sky is a sum of such triangles, those above its lower edges less those
above its upper edges.

Nothing is sampled, so the results are right to rounding.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, inlined

__all__ = ["FULL", "add_arc", "find_open", "sum_tensors"]

FULL = 7.0 * np.pi / 9.0
"""Illuminance of an open level plane under the CIE overcast sky, by that of its zenith's unit."""
_SHORT = 0.02  # sine below which an arc's length is taken from its series


@inlined
def add_arc(s0, z0, s1, z1, ax, ay, bx, by, sign, moments):
    """
    Add the triangle between an arc and the zenith to the moments, times a sign.

    The arc goes from (s0 a, z0) to (s1 b, z1), unit vectors at the horizontal unit directions a and
    b, b counter-clockwise of a by less than half a turn. ``moments`` (7,): the integrals of w
    (x, y, z), of w times its z (x, y, z), and the solid angle.
    """
    px, py, qx, qy = s0 * ax, s0 * ay, s1 * bx, s1 * by
    nx, ny, nz = py * z1 - z0 * qy, z0 * qx - px * z1, px * qy - py * qx
    sine = math.sqrt(nx * nx + ny * ny + nz * nz)
    cosine = px * qx + py * qy + z0 * z1
    if sine < _SHORT and cosine > 0.0:
        e = sine * sine
        scale = 1.0 + e * (1.0 / 6 + e * (3.0 / 40 + e * (15.0 / 336 + e * (105.0 / 3456))))
    else:
        scale = math.atan2(sine, cosine) / sine
    half = 0.5 * sign
    up0, up1 = math.atan2(s0, z0), math.atan2(s1, z1)
    moments[0] += half * (scale * nx + up1 * by - up0 * ay)
    moments[1] += half * (scale * ny - up1 * bx + up0 * ax)
    moments[2] += half * scale * nz
    omega = 2.0 * math.atan2(nz, 1.0 + cosine + z0 + z1)
    along = sign * nz / (3.0 * (1.0 + cosine))
    moments[3] += along * (px + qx)
    moments[4] += along * (py + qy)
    moments[5] += along * (z0 + z1) + sign * omega / 3.0
    moments[6] += sign * omega


@borrowing
def sum_tensors(moments, normal):
    """
    Return the view factor, and the overcast sky's light relative to an open level plane's.

    For a plane of unit normal (3,), from moments (7,) over free sky before the plane.
    """
    first = second = 0.0
    for k in range(3):
        first += normal[k] * moments[k]
        second += normal[k] * moments[3 + k]
    return first / np.pi, (first + 2.0 * second) / (3.0 * FULL)


def find_open(normals: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Return the view factor and the overcast share of open planes with unit normals (n, 3).

    The upper sky before a plane tilted by b is a lune of angle pi - b between the horizon and the
    plane. Both in closed form: (1 + cos b) / 2, and the light by the moments of the lune.
    """
    cosine = np.clip(normals[:, 2], -1.0, 1.0)
    sine = np.hypot(normals[:, 0], normals[:, 1])
    tilt = np.arctan2(sine, cosine)
    # In the plane's own axes (h toward its horizontal side, z up) the lune's arcs are half circles
    # around the axis through both ends: w = sin u (cos v, sin v) with v from 0 to pi - tilt.
    angle = np.pi - tilt
    first_h, first_z = np.pi / 2 * np.sin(angle), np.pi / 2 * (1.0 - np.cos(angle))
    second_h = 2.0 / 3.0 * np.sin(angle) ** 2
    second_z = 2.0 / 3.0 * (angle - np.sin(angle) * np.cos(angle))
    first = sine * first_h + cosine * first_z
    second = sine * second_h + cosine * second_z
    return first / np.pi, (first + 2.0 * second) / (3.0 * FULL)
