"""Outlines of shadows, with clock times at their tips."""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from umbra.writers.paper import INK, SMALL, Panel, measure
from umbra.writers.pixels import resample

__all__ = ["SHADOW_OUTLINE", "name_tips", "rule_shadows"]

SHADOW_OUTLINE = "#000000"  # 3 : 1 against every fill on both sides, for every kind of vision
WIDTH = 0.4  # of an outline [point]
LABEL = SMALL - 0.5  # size of type [point]
DOT = 0.018  # radius at a tip [inch]
GAPS = ((0.035, 0.0), (0.2, 0.1))  # from a tip to its label [inch]; the second needs a line
COARSE = 0.04  # pixel of the rasters for placing labels [inch]
ROOF = 0.1  # share of a pixel
MOST_TRIES = 400  # places on an outline
# Costs of a position besides its distance from the tip [inch]. Turns are in degrees.
TURNS = ((0, 0.0), (45, 0.03), (-45, 0.03), (90, 0.12), (-90, 0.12), (135, 0.2), (-135, 0.2))
AMONG_OTHERS, OVER_OTHERS, OVER_A_ROOF = 0.3, 0.3, 1.0

Lines = list[NDArray[np.float64]]
_Box = tuple[float, float, float, float]  # x0, y0, x1, y1 [inch]


def rule_shadows(panel: Panel, outlines: Mapping[int, Lines]) -> None:
    """Draw the outlines of shadows on a map: lines (n, 2) [inch] by stamp."""
    for lines in outlines.values():
        panel.rule_map(lines, SHADOW_OUTLINE, WIDTH)


def name_tips(
    panel: Panel,
    outlines: Mapping[int, Lines],
    labels: Sequence[str],
    away: NDArray[np.float64],
    roofs: NDArray[np.bool_] | None = None,
) -> None:
    """
    Write each shadow's clock time beside a dot on its outline: at its tip if there is room.

    The tip is the point of the outline that lies farthest from the sun: ``away`` (n_stamps, 2) is
    where the sun casts shadows, along the map's axes, of any length. Where a label would leave the
    map or meet another, or another outline runs by, the nearest free place is taken; labels keep
    off roofs (rows, cols) if they can. Outlines are lines (n, 2) [inch] by stamp, labels are of
    all.
    """
    finder = _TipFinder(panel, outlines, roofs)
    for stamp in outlines:
        place = finder.find(stamp, labels[stamp], away[stamp])
        if place is None:
            continue
        tip, (x, y) = place
        panel.rule([[tip, (x, y)]], INK, WIDTH)  # the label's halo ends it
        turn = np.linspace(0, 2 * np.pi, 13)
        panel.fill([tip + DOT * np.column_stack([np.cos(turn), np.sin(turn)])], INK, "none")
        panel.write(x, y, labels[stamp], LABEL, halo="#ffffffd8", ha="center", va="center_baseline")


class _TipFinder:
    """Finder of label positions at the tips of shadows, away from earlier labels."""

    def __init__(
        self, panel: Panel, outlines: Mapping[int, Lines], roofs: NDArray[np.bool_] | None
    ) -> None:
        self.box = x, y, w, h = panel.map_box
        self.taken: list[_Box] = []
        size = (max(1, round(h / COARSE)), max(1, round(w / COARSE)))
        self.roofs = np.zeros(size, bool) if roofs is None else resample(roofs, size) > ROOF
        self.points = {}
        self.runs_by: dict[int, NDArray[np.bool_]] = {}
        for stamp, lines in outlines.items():
            points = np.concatenate([np.zeros((0, 2)), *lines])
            inside = ((points >= (x, y)) & (points <= (x + w, y + h))).all(1)
            self.points[stamp] = points[inside]
            near = np.zeros((size[0] + 2, size[1] + 2), bool)
            row, col = self._find_pixels(points[inside])
            for down in range(3):
                for left in range(3):
                    near[row + down, col + left] = True
            self.runs_by[stamp] = near[1:-1, 1:-1]

    def find(
        self, stamp: int, text: str, away: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Find the positions of a stamp's dot and label centre [inch]; None if there is none."""
        length = np.hypot(*away)
        points = self.points[stamp]
        if not len(points) or not np.isfinite(length):
            return None
        away = away / length if length > 0 else np.array([0.0, 1.0])
        half = (measure(text, LABEL) / 2 + 0.02, LABEL / 72 * 0.6 + 0.01)
        shifts = _list_shifts(away, half)
        best: tuple[float, float, float, float, float] | None = None
        reach = points @ away
        points, reach = self._thin(points, reach)
        others = [near for other, near in self.runs_by.items() if other != stamp]
        crowded = np.any(others, 0) if others else np.zeros_like(self.roofs)
        crowd = crowded[self._find_pixels(points)]
        for (x, y), back, is_crowded in zip(
            points.tolist(), (reach[0] - reach).tolist(), crowd.tolist(), strict=True
        ):
            least = back + AMONG_OTHERS * is_crowded
            if best is not None and back >= best[0]:
                break
            for right, up, cost in shifts:
                if best is not None and least + cost >= best[0]:
                    continue
                label = _find_box(x + right, y + up, *half)
                if self._is_free(label, _find_box(x, y, DOT, DOT)):
                    window = self._find_window(label)
                    total = least + cost + OVER_A_ROOF * self.roofs[window].any()
                    total += OVER_OTHERS * float(crowded[window].mean())
                    if best is None or total < best[0]:
                        best = (total, x, y, x + right, y + up)
        if best is None:
            return None
        _, x, y, middle_x, middle_y = best
        self.taken += [_find_box(middle_x, middle_y, *half), _find_box(x, y, DOT, DOT)]
        return np.array([x, y]), np.array([middle_x, middle_y])

    def _thin(self, points: NDArray, reach: NDArray) -> tuple[NDArray, NDArray]:
        """Return the farthest point of each pixel, the farthest first."""
        order = np.argsort(-reach, kind="stable")
        row, col = self._find_pixels(points[order])
        _, first = np.unique(row * self.roofs.shape[1] + col, return_index=True)
        kept = order[np.sort(first)[:MOST_TRIES]]
        return points[kept], reach[kept]

    def _find_pixels(self, points: NDArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        x, y, w, h = self.box
        rows, cols = self.roofs.shape
        col = ((points[:, 0] - x) / w * cols).astype(np.intp)
        row = ((points[:, 1] - y) / h * rows).astype(np.intp)
        return np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)

    def _is_free(self, label: _Box, dot: _Box) -> bool:
        """Return whether a label lies on the map, and it and its dot are clear of all before."""
        x, y, w, h = self.box
        x0, y0, x1, y1 = label
        if x0 < x + 0.02 or y0 < y + 0.02 or x1 > x + w - 0.02 or y1 > y + h - 0.02:
            return False
        return not any(
            left < taken[2] and low < taken[3] and taken[0] < right and taken[1] < high
            for taken in self.taken
            for left, low, right, high in (label, dot)
        )

    def _find_window(self, label: _Box) -> tuple[slice, slice]:
        x, y, w, h = self.box
        rows, cols = self.roofs.shape
        left, right = (int((at - x) / w * cols) for at in (label[0], label[2]))
        low, high = (int((at - y) / h * rows) for at in (label[1], label[3]))
        return slice(low, high + 1), slice(left, right + 1)


def _find_box(x: float, y: float, half_width: float, half_height: float) -> _Box:
    return x - half_width, y - half_height, x + half_width, y + half_height


def _list_shifts(
    away: NDArray[np.float64], half: tuple[float, float]
) -> list[tuple[float, float, float]]:
    """List offsets of a label's centre from its dot (right, up) [inch], and their costs."""
    shifts = []
    for (degrees, cost), (gap, more) in product(TURNS, GAPS):
        turn = np.radians(degrees)
        way = np.array(
            [
                away[0] * np.cos(turn) - away[1] * np.sin(turn),
                away[0] * np.sin(turn) + away[1] * np.cos(turn),
            ]
        )
        right, up = way * (np.min(np.array(half) / np.maximum(np.abs(way), 1e-9)) + gap)
        shifts.append((float(right), float(up), cost + more))
    return shifts
