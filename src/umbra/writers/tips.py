"""Outlines of shadows, with clock times at their tips."""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from umbra.writers.paper import INK, SMALL, Panel, measure_text
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
_Place = NDArray[np.float64]  # (2,) [inch]
_Places = NDArray[np.float64]  # (n, 2) [inch]


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
        spot = finder.find(stamp, labels[stamp], away[stamp])
        if spot is None:
            continue
        tip, (x, y) = spot
        panel.rule([[tip, (x, y)]], INK, WIDTH)  # the label's halo ends it
        turn = np.linspace(0, 2 * np.pi, 13)
        panel.fill([tip + DOT * np.column_stack([np.cos(turn), np.sin(turn)])], INK, "none")
        panel.write(x, y, labels[stamp], LABEL, halo="#ffffffd8", ha="center", va="center_baseline")


class _TipFinder:
    """Finder of label positions at the tips of shadows, away from earlier labels."""

    def __init__(
        self, panel: Panel, outlines: Mapping[int, Lines], roofs: NDArray[np.bool_] | None
    ) -> None:
        self.low = np.array(panel.map_box[:2])
        self.high = self.low + panel.map_box[2:]
        self.taken: list[tuple[_Place, _Place]] = []
        width, height = (max(1, round(side / COARSE)) for side in panel.map_box[2:])
        self.size = height, width
        self.roofs = (
            np.zeros(self.size, bool) if roofs is None else resample(roofs, self.size) > ROOF
        )
        self.points: dict[int, tuple[_Places, NDArray[np.intp]]] = {}
        self.runs_by: dict[int, NDArray[np.bool_]] = {}
        for stamp, lines in outlines.items():
            points = np.concatenate([np.zeros((0, 2)), *lines])
            points = points[((points >= self.low) & (points <= self.high)).all(1)]
            row, col = self._find_pixels(points)
            self.points[stamp] = points, row * width + col
            here = np.zeros((height + 2, width + 2), bool)
            here[row + 1, col + 1] = True
            here[1:-1] |= here[:-2] | here[2:]
            self.runs_by[stamp] = here[1:-1, 1:-1] | here[1:-1, :-2] | here[1:-1, 2:]

    def find(
        self, stamp: int, text: str, away: NDArray[np.float64]
    ) -> tuple[_Place, _Place] | None:
        """Find the positions of a stamp's dot and label centre [inch]; None if there is none."""
        length = np.hypot(*away)
        if not len(self.points[stamp][0]) or not np.isfinite(length):
            return None
        away = away / length if length > 0 else np.array([0.0, 1.0])
        half = np.array([measure_text(text, LABEL) / 2 + 0.02, LABEL / 72 * 0.6 + 0.01])
        dots, reach = self._thin(stamp, away)
        shifts, costs = _list_shifts(away, half)
        labels = dots[:, None] + shifts
        fits = ((labels - half >= self.low + 0.02) & (labels + half <= self.high - 0.02)).all(2)
        for middle, room in self.taken:
            fits &= (np.abs(labels - middle) >= half + room).any(2)
            fits &= (np.abs(dots - middle) >= DOT + room).any(1, keepdims=True)
        dot, shift = np.nonzero(fits)
        if not len(dot):
            return None
        crowded: NDArray[np.bool_] = np.zeros(self.size, bool)
        for other, near in self.runs_by.items():
            if other != stamp:
                crowded |= near
        cost = reach[0] - reach[dot] + AMONG_OTHERS * crowded[self._find_pixels(dots[dot])]
        centres = labels[fits]
        window = (*self._find_pixels(centres - half), *self._find_pixels(centres + half))
        cost += costs[shift] + OVER_A_ROOF * (_find_share(self.roofs, window) > 0)
        best = int((cost + OVER_OTHERS * _find_share(crowded, window)).argmin())
        tip, label = dots[dot[best]], centres[best]
        self.taken += [(label, half), (tip, np.array([DOT, DOT]))]
        return tip, label

    def _thin(self, stamp: int, away: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        """Return a stamp's farthest point of each pixel, the farthest first, and how far."""
        points, pixel = self.points[stamp]
        reach = points @ away
        farthest = np.full(self.roofs.size, -np.inf)
        np.maximum.at(farthest, pixel, reach)
        tips = np.flatnonzero(reach == farthest[pixel])
        chosen = tips[np.argsort(-reach[tips], kind="stable")[:MOST_TRIES]]
        return points[chosen], reach[chosen]

    def _find_pixels(self, points: NDArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the row and column of each place (n, 2) [inch]."""
        share = (points - self.low) / (self.high - self.low)
        col, row = (share * self.size[::-1]).astype(np.intp).T
        return np.clip(row, 0, self.size[0] - 1), np.clip(col, 0, self.size[1] - 1)


def _find_share(mask: NDArray[np.bool_], window: Sequence[NDArray[np.intp]]) -> NDArray[np.float64]:
    """Return the share of a mask in windows: first and last rows and columns, (n,) each."""
    south, west, north, east = window[0], window[1], window[2] + 1, window[3] + 1
    total = np.pad(mask.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    inside = total[north, east] - total[south, east] - total[north, west] + total[south, west]
    return inside / ((north - south) * (east - west))


def _list_shifts(
    away: NDArray[np.float64], half: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """List offsets of a label's centre from its dot (n, 2) [inch], and their costs (n,)."""
    shifts, costs = [], []
    for (degrees, cost), (gap, more) in product(TURNS, GAPS):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        way = np.array([away[0] * c - away[1] * s, away[0] * s + away[1] * c])
        shifts.append(way * (np.min(half / np.maximum(np.abs(way), 1e-9)) + gap))
        costs.append(cost + more)
    return np.array(shifts), np.array(costs)
