"""The last steps to a picture: lines, transparency, sRGB, and a caption."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from umbra.calls.antialiasing import Averages
from umbra.calls.lines import draw_lines
from umbra.calls.picture_options import DrawingOptions
from umbra.calls.styles import Style
from umbra.cpu.shade import encode_srgb
from umbra.writers.typeface import fit_caption, load_font

__all__ = ["finish"]

_TYPE = 1 / 48  # of a caption: share of the picture's height
_LEAST = 10  # [pixels]
_INK, _HALO = (28, 28, 34, 255), (255, 255, 255, 210)


def finish(averages: Averages, style: Style, options: DrawingOptions) -> NDArray[np.uint8]:
    """Turn what the samples show into a picture, (rows, cols, 3 or 4) uint8."""
    linear = averages.colors
    if options.transparent:  # nothing is black, so colours are multiplied by their coverage
        linear = linear / np.maximum(averages.coverage, 1e-6)[..., None]
    if style.has_lines:
        linear = draw_lines(linear, averages.ink)
    image = encode_srgb(linear)
    if options.transparent:
        alpha = np.round(255 * averages.coverage).astype(np.uint8)
        image = np.dstack([image, alpha])
    return write_caption(image, options.caption) if options.caption else image


def write_caption(image: NDArray[np.uint8], text: str) -> NDArray[np.uint8]:
    """Write a line at the lower left of a picture, smaller if it is too long."""
    rows, cols = image.shape[:2]
    size = max(_LEAST, round(rows * _TYPE))
    margin = size
    fitting = fit_caption(text, size, cols - 2 * margin)
    font = load_font(size if fitting == size else max(_LEAST // 2, int(fitting)), text)
    layer = Image.new("RGBA", (cols, rows), (0, 0, 0, 0))
    ImageDraw.Draw(layer).text(
        (margin, rows - margin), text, _INK, font, "ls", stroke_width=max(1, size // 9),
        stroke_fill=_HALO,
    )  # fmt: skip
    below = Image.fromarray(image).convert("RGBA")
    drawn = np.asarray(Image.alpha_composite(below, layer))
    return np.ascontiguousarray(drawn[..., : image.shape[2]])
