"""Looking up textures: sRGB to linear light, between texels."""

import numpy as np
from numpy.typing import NDArray

from umbra.scene.material import Image

__all__ = ["sample", "to_linear"]

_LEVELS = np.arange(256) / 255
# sRGB as in IEC 61966-2-1.
_LINEAR = np.where(_LEVELS <= 0.04045, _LEVELS / 12.92, ((_LEVELS + 0.055) / 1.055) ** 2.4)


def to_linear(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    """
    Turn sRGB pixels into linear light; alpha is linear as it is.

    Parameters
    ----------
    pixels : (..., 4) uint8

    Returns
    -------
    linear : (..., 4) float64
        In 0 to 1.
    """
    linear = _LINEAR[pixels]
    linear[..., 3] = pixels[..., 3] / 255
    return linear


def sample(
    image: Image, uv: NDArray[np.floating], wrap: tuple[str, str] | None = None
) -> NDArray[np.float64]:
    """
    Look up an image between its four nearest texels.

    Parameters
    ----------
    image : Image
    uv : (..., 2) float
        (0, 0) is the upper left corner of the picture, (1, 1) the lower right one.
    wrap : (str, str), optional
        The image's own by default.

    Returns
    -------
    linear : (..., 4) float64
        Linear RGB and alpha.
    """
    pixels = image.pixels
    rows, cols = pixels.shape[:2]
    place = np.nan_to_num(np.asarray(uv, np.float64), posinf=0.0, neginf=0.0)
    how = wrap or image.wrap
    (left, right), along = _find_texels(place[..., 0], cols, how[0])
    (above, below), down = _find_texels(place[..., 1], rows, how[1])
    along, down = along[..., None], down[..., None]
    # Mixed in linear light, as graphics hardware does with sRGB textures.
    upper = (1 - along) * to_linear(pixels[above, left]) + along * to_linear(pixels[above, right])
    lower = (1 - along) * to_linear(pixels[below, left]) + along * to_linear(pixels[below, right])
    return (1 - down) * upper + down * lower


def _find_texels(
    place: NDArray[np.float64], count: int, wrap: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Give the texels on both sides of places, (2, ...), and how far to the second."""
    at = place * count - 0.5
    first = np.floor(at)
    share = at - first
    texel = np.stack([first, first + 1])
    if wrap == "clamp":
        texel = np.clip(texel, 0, count - 1)
    elif wrap == "repeat":
        texel = np.mod(texel, count)
    else:
        texel = np.mod(texel, 2 * count)
        texel = np.minimum(texel, 2 * count - 1 - texel)
    return texel.astype(np.int64), share
