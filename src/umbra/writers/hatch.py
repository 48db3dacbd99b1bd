"""A hatch over a part of a map, dark with a light rim: it is seen on every colour, in print too."""

import numpy as np
from numpy.typing import NDArray

from umbra.writers.contours import trace
from umbra.writers.paper import INK, Panel
from umbra.writers.plan import DOTS_PER_INCH
from umbra.writers.raster import resample

__all__ = ["draw_hatch", "draw_hatch_swatch"]

PITCH = 14  # from line to line, along a row [pixel]
RIM = "#ffffffc8"


def draw_hatch(panel: Panel, is_inside: NDArray[np.bool_]) -> None:
    """
    Hatch a region of cells, and draw its border.

    Parameters
    ----------
    panel : Panel
    is_inside : (rows, cols) bool
    """
    x, y, _, _ = panel.map_box
    inside = resample(is_inside, panel.map_size) > 0.5
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
