"""How a picture's surfaces look under the colours of hours: their shade, and lines."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

from umbra.writers.raster import resample

__all__ = ["DARK", "LUMINANCE", "SKY", "Look", "draw_look"]

SKY = (0.86, 0.885, 0.92)  # where a view sees nothing; no colour of a scale
INK = np.array([0.11, 0.11, 0.135], np.float32)
CHALK = np.array([0.62, 0.66, 0.76], np.float32)
DARK = 0.3  # luminance below which lines are of chalk
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


@dataclass(frozen=True, eq=False)
class Look:
    """
    Shade and lines of a picture's surfaces.

    Parameters
    ----------
    shade : (rows, cols) uint8
        255 where the legend's colours stay, 0 in the deepest shade; rows ascend.
    lines : (rows, cols) uint8
        How much ink there is.
    jumps : (rows, cols) uint8
        How much of each pixel holds an edge beyond which another surface begins.
    creases : (rows, cols) uint8
        How much of each pixel holds an edge at which two surfaces meet at an angle.
    sky : (rows, cols) uint8, optional
        How much of each pixel shows nothing; None of plans.
    """

    shade: NDArray[np.uint8]
    lines: NDArray[np.uint8]
    jumps: NDArray[np.uint8]
    creases: NDArray[np.uint8]
    sky: NDArray[np.uint8] | None = None

    def find_breaks(self, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Tell which cells of a raster an edge runs through, so that no contour crosses it."""
        # A contour is smoothed over two pixels each way, and would run along the edge itself.
        # Jumps are marked on both their sides, creases on one.
        jumps, creases = (
            np.asarray(Image.fromarray(edges).filter(ImageFilter.MaxFilter(width)), np.float32)
            for edges, width in ((self.jumps, 5), (self.creases, 7))
        )
        return resample(np.maximum(jumps, creases), shape) > 0.2 * 255

    def find_shade(self, size: tuple[int, int]) -> NDArray[np.float32]:
        """Give the depth of shade at each pixel of a picture, (rows, cols) in [0, 1]."""
        return np.float32(1) - resample(self.shade.astype(np.float32), size) / np.float32(255)


def draw_look(image: NDArray[np.float32], look: Look, size: tuple[int, int]) -> None:
    """Put sky and lines on an image (rows, cols, 3), in [0, 1], that is shaded already."""
    lines = resample(look.lines.astype(np.float32), size)[..., None] / 255
    if look.sky is not None:
        image[resample(look.sky.astype(np.float32), size) > 0.5 * 255] = SKY
    ink = np.where((image @ LUMINANCE)[..., None] < DARK, CHALK, INK)
    image += lines * (ink - image)
