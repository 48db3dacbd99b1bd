"""Contour lines at whole hours, and places for their labels."""

import math
from typing import Any

import contourpy
import numpy as np
from numpy.typing import NDArray

from umbra.writers.raster import resample
from umbra.writers.sheet import SMALL, Sheet, measure

__all__ = ["draw_contours", "find_levels", "trace"]

FINEST = 0.012  # the contour grid's spacing on the sheet [inch]
SHORTEST = 0.10  # a contour smaller than this is a speck [inch]
LABEL_GAP = 0.55  # between two labels' middles [inch]


def find_levels(max_hours: float, most: int = 8) -> list[int]:
    """Choose whole hours up to ``max_hours``, every 1, 2, 3, 4, 6 or 12 h: at most ``most``."""
    if not max_hours >= 1:
        return []
    last = math.floor(max_hours + 1e-6)
    step = next((s for s in (1, 2, 3, 4, 6, 12) if last // s <= most), math.ceil(last / most))
    return list(range(step, last + 1, step))


def trace(sheet: Sheet, is_inside: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    """
    Trace the border of a region of cells.

    The region's share of each point of a grid is traced at one half, so that the line
    runs between the cells and is smooth wherever cells are small.

    Parameters
    ----------
    is_inside : (rows, cols) bool

    Returns
    -------
    lines : list of (n, 2) float64
        On the sheet [inch].
    """
    x, y, w, h = sheet.map_box
    rows = min(is_inside.shape[0], max(2, round(h / FINEST)))
    cols = min(is_inside.shape[1], max(2, round(w / FINEST)))
    share = np.pad(resample(is_inside, (rows, cols)), 1, mode="edge")
    across = x + (np.arange(-1, cols + 1) + 0.5) * (w / cols)
    up = y + (np.arange(-1, rows + 1) + 0.5) * (h / rows)
    lines: Any = contourpy.contour_generator(across, up, share).lines(0.5)
    return [line for line in lines if np.ptp(line, axis=0).max() >= SHORTEST]


def draw_contours(
    sheet: Sheet,
    hours: NDArray[np.float32],
    levels: list[int],
    colors: list[tuple[str, str]],
    blocked: NDArray[np.bool_],
) -> None:
    """
    Draw and label the lines that enclose at least so many hours.

    Parameters
    ----------
    sheet : Sheet
    hours : (rows, cols) float32
        NaN where there is none.
    levels : list of int
    colors : list of (line, halo)
        One pair for each level.
    blocked : (rows, cols) bool
        Cells that no label may cover.
    """
    finder = _LabelFinder(sheet, hours, blocked)
    for level, (color, halo) in zip(levels, colors, strict=True):
        # Hours are sums of float32 steps: a cell of exactly the level lies inside.
        lines = trace(sheet, hours >= level - 1e-3)
        sheet.rule(lines, color, 0.55, on_map=True)
        for x, y, angle in finder.find(lines, f"{level} h"):
            sheet.write(
                x, y, f"{level} h", SMALL - 0.5, color=color, halo=halo, rotation=angle,
                rotation_mode="anchor", ha="center", va="center_baseline",
            )  # fmt: skip


class _LabelFinder:
    """Finds straight, free places on lines, away from labels found before."""

    def __init__(
        self, sheet: Sheet, hours: NDArray[np.float32], blocked: NDArray[np.bool_]
    ) -> None:
        self.box = sheet.map_box
        self.taken: list[tuple[float, float]] = []
        _, _, w, h = self.box
        # Small rasters of what matters to a label: about a tenth of an inch a pixel.
        size = (max(1, round(h / 0.1)), max(1, round(w / 0.1)))
        self.blocked = resample(blocked, size) > 0.02
        self.hours = np.nan_to_num(resample(hours, size))

    def find(self, lines: list[NDArray[np.float64]], text: str) -> list[tuple[float, float, float]]:
        """Find up to three places (x, y, angle in degrees) for a label on a level's lines."""
        half = measure(text, SMALL) / 2 + 0.04
        found: list[tuple[float, float, float]] = []
        for line in sorted(lines, key=len, reverse=True)[:12]:
            length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
            if length[-1] < 5 * half:
                continue
            best = None
            for at in np.linspace(
                1.5 * half, length[-1] - 1.5 * half, min(60, int(length[-1] / 0.1) + 2)
            ):
                ends = [
                    [np.interp(at + offset, length, line[:, axis]) for axis in (0, 1)]
                    for offset in (-half, 0, half)
                ]
                place = self._judge(np.array(ends), half)
                if place and (best is None or place < best):
                    best = place
            if best:
                _, x, y, angle = best
                self.taken.append((x, y))
                found.append((x, y, angle))
            if len(found) == 3:
                break
        return found

    def _judge(self, ends: NDArray, half: float) -> tuple[float, float, float, float] | None:
        """Weigh a place: how restless its surroundings are, and the place; None if unfit."""
        start, (x, y), end = ends
        along = end - start
        straight = float(np.hypot(*along)) / (2 * half)
        left, bottom, w, h = self.box
        room = half + 0.06
        if straight < 0.9:
            return None
        if not (left + room < x < left + w - room and bottom + room < y < bottom + h - room):
            return None
        if any(math.hypot(x - a, y - b) < LABEL_GAP for a, b in self.taken):
            return None
        rows, cols = self.hours.shape
        row, col = int((y - bottom) / h * rows), int((x - left) / w * cols)
        reach = math.ceil(half / 0.1)
        window = np.s_[max(0, row - reach) : row + reach + 1, max(0, col - reach) : col + reach + 1]
        if self.blocked[window].any():
            return None
        angle = math.degrees(math.atan2(along[1], along[0]))
        angle = (angle + 90) % 180 - 90  # never upside down
        return float(np.ptp(self.hours[window])) + (1 - straight), x, y, angle
