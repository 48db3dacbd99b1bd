"""Streets, green and water on a map: hairlines, and pale tints where the paper is bare."""

import numpy as np
from numpy.typing import NDArray

from umbra.writers.paper import Panel

__all__ = ["CONTEXT_COLORS", "draw_context", "tint_context"]

CONTEXT_COLORS = {
    "street": "#7c7c84", "green": "#5e7f58", "water": "#557c99", "other": "#8c8c96",
}  # fmt: skip
_TINTS = {
    "street": (0.945, 0.945, 0.95), "green": (0.89, 0.945, 0.86), "water": (0.855, 0.925, 0.97),
}  # fmt: skip
_HAIRLINE = 0.45  # [point]
_BARE = 0.999  # of a pixel's darkest channel, from which it is paper


def draw_context(panel: Panel) -> None:
    """Draw the lines of a plan's context on its map; colours of hours stay those of the key."""
    for kind, color in CONTEXT_COLORS.items():
        shapes = [shape for shape in panel.plan.context if shape.kind == kind]
        lines = [panel.place(line) for shape in shapes for line in shape.lines]
        if lines:
            panel.rule_map(lines, color, _HAIRLINE)


def tint_context(image: NDArray[np.float32], panel: Panel) -> None:
    """Tint bare paper of an image (rows, cols, 3) where green, water and streets lie, in place."""
    bare = image.min(-1) >= _BARE
    for shape in panel.plan.context:
        tint = _TINTS.get(shape.kind)
        if tint is not None and shape.rings:
            _fill(image, panel, shape.rings, np.array(tint, np.float32), bare)


def _fill(
    image: NDArray[np.float32],
    panel: Panel,
    rings: tuple[NDArray[np.float64], ...],
    tint: NDArray[np.float32],
    bare: NDArray[np.bool_],
) -> None:
    """Fill rings, of which holes are those within others."""
    from PIL import Image, ImageDraw  # noqa: PLC0415

    high, wide = bare.shape
    x0, x1, y0, y1 = panel.plan.extent
    scale = np.array([wide / (x1 - x0), high / (y1 - y0)])
    places = [(ring - (x0, y0)) * scale - 0.5 for ring in rings]
    low = np.maximum(np.floor(np.min([p.min(0) for p in places], 0)), 0).astype(int)
    top = np.minimum(np.ceil(np.max([p.max(0) for p in places], 0)) + 1, (wide, high)).astype(int)
    if not (top > low).all():
        return
    size = int(top[0] - low[0]), int(top[1] - low[1])
    inside = np.zeros(size[::-1], np.bool_)
    for place in places:
        mask = Image.new("1", size)
        ImageDraw.Draw(mask).polygon([tuple(at) for at in (place - low).tolist()], fill=1)
        inside ^= np.asarray(mask)
    part = slice(low[1], top[1]), slice(low[0], top[0])
    image[part][inside & bare[part]] = tint
