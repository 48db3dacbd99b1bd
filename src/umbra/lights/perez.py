"""
Radiance of the sky: the all-weather distribution of Perez, Seals and Michalsky.

References
----------
.. [1] R. Perez, R. Seals and J. Michalsky, "All-weather model for sky luminance distribution -
   preliminary configuration and validation", Solar Energy 50(3), 1993, with the erratum of
   51(5).
.. [2] F. Kasten and A. Young, "Revised optical air mass tables and approximation formula",
   Applied Optics 28(22), 1989.
.. [3] J. Spencer, "Fourier series representation of the position of the sun", Search 2(5), 1971.
"""

import math

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel

__all__ = ["find_shape", "sum_sky"]

_SOLAR = 1361.1  # irradiance of a plane that faces the sun, outside of the air [W/m2]
_BINS = np.array([1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200])
"""Upper ends of the classes of clearness, [1] table 2, but for the last."""
_DIM, _BRIGHT = 0.01, 0.6  # range of the sky's brightness to which the model was fitted
_AT_ONCE = 500  # skies, between which an interrupt is heard
_LOW = 0.01  # least sine of an altitude, at which the gradient is taken
_LEAST = 0.2  # brightness below which classes 2 to 4 turn negative
_COEFFICIENTS = np.array([
    [1.3525, -0.2576, -0.2690, -1.4366, -0.7670, 0.0007, 1.2734, -0.1233, 2.8000, 0.6004,
     1.2375, 1.0000, 1.8734, 0.6297, 0.9738, 0.2809, 0.0356, -0.1246, -0.5718, 0.9938],
    [-1.2219, -0.7730, 1.4148, 1.1016, -0.2054, 0.0367, -3.9128, 0.9156, 6.9750, 0.1774,
     6.4477, -0.1239, -1.5798, -0.5081, -1.7812, 0.1080, 0.2624, 0.0672, -0.2190, -0.4285],
    [-1.1000, -0.2515, 0.8952, 0.0156, 0.2782, -0.1812, -4.5000, 1.1766, 24.7219, -13.0812,
     -37.7000, 34.8438, -5.0000, 1.5218, 3.9229, -2.6204, -0.0156, 0.1597, 0.4199, -0.5562],
    [-0.5484, -0.6654, -0.2672, 0.7117, 0.7234, -0.6219, -5.6812, 2.6297, 33.3389, -18.3000,
     -62.2500, 52.0781, -3.5000, 0.0016, 1.1477, 0.1062, 0.4659, -0.3296, -0.0876, -0.0329],
    [-0.6000, -0.3566, -2.5000, 2.3250, 0.2937, 0.0496, -5.6812, 1.8415, 21.0000, -4.7656,
     -21.5906, 7.2492, -3.5000, -0.1554, 1.4062, 0.3988, 0.0032, 0.0766, -0.0656, -0.1294],
    [-1.0156, -0.3670, 1.0078, 1.4051, 0.2875, -0.5328, -3.8500, 3.3750, 14.0000, -0.9999,
     -7.1406, 7.5469, -3.4000, -0.1078, -1.0750, 1.5702, -0.0672, 0.4016, 0.3017, -0.4844],
    [-1.0000, 0.0211, 0.5025, -0.5119, -0.3000, 0.1922, 0.7023, -1.6317, 19.0000, -5.0000,
     1.2438, -1.9094, -4.0000, 0.0250, 0.3844, 0.2656, 1.0468, -0.3788, -2.4517, 1.4656],
    [-1.0500, 0.0289, 0.4260, 0.3590, -0.3250, 0.1156, 0.7781, 0.0025, 31.0625, -14.5000,
     -46.1148, 55.3750, -7.2312, 0.4050, 13.3500, 0.6234, 1.5000, -0.6426, 1.8564, 0.5636],
])  # fmt: skip
"""Coefficients of a to e by class, four each, [1] table 1."""


def find_shape(
    zenith: NDArray[np.float64], beam: NDArray[np.float64], diffuse: NDArray[np.float64],
    day: NDArray[np.integer],
) -> NDArray[np.float64]:  # fmt: skip
    """
    Find the parameters of the sky's distribution at some instants.

    Parameters
    ----------
    zenith : (n,) float64
        Of the sun; below the horizon counts as on it [rad].
    beam, diffuse : (n,) float64
        Direct normal and diffuse horizontal irradiance; the second above 0 [W/m2].
    day : (n,) int
        Of the year, 1 to 366.

    Returns
    -------
    shape : (n, 5) float64
        a (darkening or brightening to the horizon), b (gradient there), c (intensity of the
        circumsolar region), d (its width), e (light scattered back).
    """
    zenith = np.clip(zenith, 0.0, math.pi / 2)
    cube = 1.041 * zenith**3
    clearness = ((diffuse + beam) / diffuse + cube) / (1 + cube)
    degrees = np.degrees(zenith)
    mass = 1 / (np.cos(zenith) + 0.50572 * (96.07995 - degrees) ** -1.6364)  # [2] eq. 3
    turn = 2 * math.pi * (day - 1) / 365
    near = (  # [3]
        1.00011 + 0.034221 * np.cos(turn) + 0.00128 * np.sin(turn)
        + 0.000719 * np.cos(2 * turn) + 0.000077 * np.sin(2 * turn)
    )  # fmt: skip
    bright = np.clip(mass * diffuse / (_SOLAR * near), _DIM, _BRIGHT)
    number = np.searchsorted(_BINS, clearness, side="right")
    bright = np.where((number >= 1) & (number <= 4), np.maximum(bright, _LEAST), bright)
    x = _COEFFICIENTS[number].reshape(-1, 5, 4)
    shape = (
        x[:, :, 0] + x[:, :, 1] * zenith[:, None]
        + bright[:, None] * (x[:, :, 2] + x[:, :, 3] * zenith[:, None])
    )  # fmt: skip
    dull = number == 0  # [1] eq. 7 and 8
    c, d, angle, light = x[dull, 2], x[dull, 3], zenith[dull], bright[dull]
    grow = np.maximum(light * (c[:, 0] + c[:, 1] * angle), 0.0) ** c[:, 2]
    shape[dull, 2] = np.exp(grow) - c[:, 3]
    fall = -np.exp(light * (d[:, 0] + d[:, 1] * angle)) + d[:, 2] + light * d[:, 3]
    shape[dull, 3] = fall
    # A gradient above 0 would make the horizon endlessly bright and all else black.
    shape[:, 1] = np.minimum(shape[:, 1], 0.0)
    return shape


@kernel
def _sum_sky(directions, angles, suns, shape, energy, total):
    """Add up skies; see ``sum_sky``."""
    count = len(directions)
    radiance = np.zeros(count)
    for i in range(len(suns)):
        a, b, c, d, e = shape[i]
        level = 0.0
        for k in range(count):
            up = directions[k, 2]
            cosine = directions[k, 0] * suns[i, 0] + directions[k, 1] * suns[i, 1] + up * suns[i, 2]
            cosine = min(1.0, max(-1.0, cosine))
            value = 1.0 + a * math.exp(b / max(up, _LOW))
            value *= 1.0 + c * math.exp(d * math.acos(cosine)) + e * cosine * cosine
            radiance[k] = max(value, 0.0)
            level += radiance[k] * up * angles[k]
        if level <= 0.0:  # black everywhere: equally bright instead
            radiance[:] = 1.0
            level = (directions[:, 2] * angles).sum()
        total += radiance * (energy[i] / level)


def sum_sky(
    directions: NDArray[np.float64],
    angles: NDArray[np.float64],
    suns: NDArray[np.float64],
    shape: NDArray[np.float64],
    energy: NDArray[np.float64],
) -> NDArray[np.float64]:
    """
    Add up the radiance of some skies toward each direction.

    Each sky is scaled so that an open level plane receives its energy from these directions.

    Parameters
    ----------
    directions : (n, 3) float64
        Unit vectors above the horizon.
    angles : (n,) float64
        Solid angles that they stand for [sr].
    suns : (m, 3) float64
        Unit vectors toward the sun, at or above the horizon.
    shape : (m, 5) float64
        From ``find_shape``.
    energy : (m,) float64
        Of each sky on an open level plane, such as kWh/m2.

    Returns
    -------
    radiance : (n,) float64
        In units of the energy per steradian.
    """
    total = np.zeros(len(directions))
    for first in range(0, len(suns), _AT_ONCE):
        block = slice(first, first + _AT_ONCE)
        _sum_sky(directions, angles, suns[block], shape[block], energy[block], total)
    return total
