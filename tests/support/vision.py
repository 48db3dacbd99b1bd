"""Colours as they are seen: CIELAB and OKLab, and what is left for the colour-blind and in grey."""

import numpy as np

# G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, "A Physiologically-based Model for Simulation
# of Color Vision Deficiency", IEEE TVCG 15(6), 2009: severity 1.0, for linear sRGB.
MACHADO = {
    "protanope": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranope": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanope": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
VISIONS = ("everyone", *MACHADO, "grey")


def to_linear(rgb):
    """Turn sRGB in [0, 1] into linear light."""
    rgb = np.asarray(rgb, float)
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def to_gamma(linear):
    """Turn linear light into sRGB in [0, 1]."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def see(rgb, vision):
    """Give sRGB colours as one of ``VISIONS`` sees them."""
    linear = to_linear(rgb)
    if vision in MACHADO:
        linear = linear @ np.array(MACHADO[vision]).T
    elif vision == "grey":
        linear = np.repeat((linear @ LUMINANCE)[..., None], 3, -1)
    return to_gamma(linear)


def to_cielab(rgb):
    """Turn sRGB into CIELAB (D65; IEC 61966-2-1, CIE 15)."""
    primaries = np.array(
        [
            [0.4124564, 0.3575761, 0.1804375],
            [0.2126729, 0.7151522, 0.0721750],
            [0.0193339, 0.1191920, 0.9503041],
        ]
    )
    xyz = to_linear(rgb) @ primaries.T / primaries.sum(1)
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def to_oklab(rgb):
    """Turn sRGB into OKLab (B. Ottosson, 2020)."""
    cones = np.array(
        [
            [0.4122214708, 0.5363325363, 0.0514459929],
            [0.2119034982, 0.6806995451, 0.1073969566],
            [0.0883024619, 0.2817188376, 0.6299787005],
        ]
    )
    lab = np.array(
        [
            [0.2104542553, 0.7936177850, -0.0040720468],
            [1.9779984951, -2.4285922050, 0.4505937099],
            [0.0259040371, 0.7827717662, -0.8086757660],
        ]
    )
    return np.cbrt(to_linear(rgb) @ cones.T) @ lab.T


def contrast(one, other):
    """Give the ratio of contrast of two sRGB colours (WCAG 2.2)."""
    a, b = (to_linear(rgb) @ LUMINANCE + 0.05 for rgb in (one, other))
    return np.maximum(a, b) / np.minimum(a, b)
