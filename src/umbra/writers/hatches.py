"""Hatches over a part of a map, such as canopies: seen on every colour, in print too."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.writers.contours import trace
from umbra.writers.marks import Swatch
from umbra.writers.paper import INK, Panel
from umbra.writers.plan import DARK, DOTS_PER_INCH, LUMINANCE, SKY, Plan
from umbra.writers.raster import HALF, resample

__all__ = ["draw_hatch", "draw_hatch_swatch", "find_swatches", "hatch_canopies", "outline_canopies"]

PITCH = 14  # from line to line, along a row [pixel]
RIM = "#ffffffc8"


def draw_hatch(panel: Panel, is_inside: NDArray[np.bool_]) -> None:
    """Hatch a region of cells (rows, cols), and draw its border."""
    x, y, _, _ = panel.map_box
    inside = resample(is_inside, panel.map_size) > HALF
    rows, cols = inside.shape
    lines = []
    for first in range(-rows + PITCH // 2, cols, PITCH):
        row = np.arange(max(0, -first), min(rows, cols - first))
        is_on = np.concatenate([[False], inside[row, row + first], [False]])
        ends = np.flatnonzero(is_on[1:] != is_on[:-1]).reshape(-1, 2) + max(0, -first)
        lines += [
            np.array([(x + (r + first) / DOTS_PER_INCH, y + r / DOTS_PER_INCH) for r in pair])
            for pair in ends
        ]
    _rule(panel, lines)
    border = trace(panel, is_inside)
    panel.rule_map(border, RIM, 1.7)
    panel.rule_map(border, INK, 0.8)


def draw_hatch_swatch(panel: Panel, x: float, y: float, width: float, height: float) -> None:
    """Draw a hatched box for a key, its lower left corner at x, y [inch]."""
    box = np.array([(0, 0), (width, 0), (width, height), (0, height), (0, 0)]) + (x, y)
    step = PITCH / DOTS_PER_INCH
    lines = []
    for first in np.arange(-height + step / 2, width, step):
        ends = np.clip([first, first + height], 0, width)
        lines.append(np.column_stack([x + ends, y + ends - first]))
    panel.rule(lines, INK, 0.7)
    panel.rule([box], INK, 0.8)


def _rule(panel: Panel, lines: list[NDArray[np.float64]]) -> None:
    panel.rule_map(lines, RIM, 1.7)
    panel.rule_map(lines, INK, 0.7)


LEAF = "#1f6b2c"
_DARK, _LIGHT = np.array([(0x1F, 0x6B, 0x2C), (0xA6, 0xE3, 0xA8)], np.float32) / 255
STRIDE = 9  # pixels from a line of the hatch to the next


def hatch_canopies(image: NDArray[np.float32], plan: Plan, size: tuple[int, int]) -> None:
    """Hatch a plan's canopies on its map (rows, cols, 3), in [0, 1]; the hours show between."""
    if plan.canopies is None:
        return
    rows, cols = np.indices(size)
    lines = ((rows + cols) % STRIDE == 0) & (resample(plan.canopies, size) > HALF)
    found = image[lines]
    ink = np.where((found @ LUMINANCE)[:, None] < DARK, _LIGHT, _DARK)
    image[lines] += 0.75 * (ink - found)


def outline_canopies(panel: Panel) -> None:
    """Draw the border of the canopies of a map."""
    if panel.plan.canopies is not None:
        lines = trace(panel, panel.plan.canopies)
        panel.rule_map(lines, "#ffffffc0", 2.0)
        panel.rule_map(lines, LEAF, 0.9)


def find_swatches(plans: Sequence[Plan]) -> list[Swatch]:
    """Name what maps show besides hours."""
    swatches = []
    crowned = next((plan for plan in plans if plan.canopies is not None), None)
    if crowned is not None:
        swatches.append(Swatch(crowned.canopy_name, "white", LEAF, "/////"))
    appearances = [plan.appearance for plan in plans if plan.appearance is not None]
    if any(
        appearance.sky is not None and (appearance.sky > 127).any() for appearance in appearances
    ):
        swatches.append(Swatch("sky: no hours", SKY))
    return swatches
