"""Lines and hatches on maps: labelled contours at whole hours, borders, canopies."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import contourpy
import numpy as np
from numpy.typing import NDArray

from umbra.writers.marks import Swatch
from umbra.writers.paper import INK, SMALL, Panel, measure_text
from umbra.writers.picture_content import (
    DARK,
    DOTS_PER_INCH,
    LUMINANCE,
    MISSING,
    SKY,
    Plan,
    spread_largest,
)
from umbra.writers.pixels import HALF, resample

__all__ = [
    "PROPOSED",
    "Tracer",
    "draw_contours",
    "draw_hatch",
    "draw_hatch_swatch",
    "find_levels",
    "find_swatches",
    "hatch_covers",
    "outline_covers",
    "trace",
]

FINEST = 0.012  # the contour grid's spacing on the sheet [inch]
SHORTEST = 0.10  # a contour smaller than this is a speck [inch]
COARSE = 0.05  # pixel of the rasters for placing labels [inch]
LABEL = SMALL - 0.5  # size of type [point]
STRAIGHT = 0.9  # least ratio of chord to arc length of a label's line
TOUCHED = 0.02  # blocked share of a pixel from which labels avoid it
_HOURS, _RELATIVE = 1e-3, 1e-4  # rounding of hours [h], and of other values, of the highest level
LABEL_GAP = 0.55  # between two labels' middles [inch]

Place = tuple[float, float, float]


def find_levels(max_hours: float, most: int = 8) -> list[int]:
    """Choose whole hours up to ``max_hours``, every 1, 2, 3, 4, 6 or 12 h: at most ``most``."""
    if not max_hours >= 1:
        return []
    last = math.floor(max_hours + 1e-6)
    step = next((s for s in (1, 2, 3, 4, 6, 12) if last // s <= most), math.ceil(last / most))
    return list(range(step, last + 1, step))


class Tracer:
    """
    Tracer of the borders of regions of cells, as lines on the sheet.

    A region's share at each point of a fine grid is traced at one half: lines follow the edges
    of large cells, and are smooth where cells are small. Lines end at hidden cells (rows, cols),
    where the inside is unknown.
    """

    def __init__(self, panel: Panel, is_hidden: NDArray[np.bool_] | None = None) -> None:
        x, y, w, h = panel.map_box
        self._size = rows, cols = max(2, round(h / FINEST)), max(2, round(w / FINEST))
        self._across, self._up = np.meshgrid(
            x + (np.arange(-1, cols + 1) + 0.5) * (w / cols),
            y + (np.arange(-1, rows + 1) + 0.5) * (h / rows),
        )
        self._is_shown = None
        if is_hidden is not None and is_hidden.any():
            self._is_shown = ~is_hidden
            self._known = _smooth(resample(self._is_shown, self._size))

    def trace(self, is_inside: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
        """Return the border of a region (rows, cols) as lines (n, 2) [inch]."""
        if self._is_shown is None:
            share = _smooth(resample(is_inside, self._size))
        else:
            share = _smooth(resample(is_inside & self._is_shown, self._size))
            share = np.where(self._known < HALF, np.nan, share / np.maximum(self._known, HALF))
        tracer = contourpy.contour_generator(
            self._across, self._up, share, line_type=contourpy.LineType.ChunkCombinedOffset
        )
        chunks: Any = tracer.lines(0.5)
        (points,), (ends,) = chunks
        if points is None:
            return []
        first = ends[:-1].astype(np.intp)
        size = np.maximum.reduceat(points, first) - np.minimum.reduceat(points, first)
        is_long = size.max(1) >= SHORTEST
        return [points[a:b] for a, b in zip(first[is_long], ends[1:][is_long], strict=True)]


def trace(panel: Panel, is_inside: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    """Trace the border of a region of cells (rows, cols) as lines (n, 2) on the sheet [inch]."""
    return Tracer(panel).trace(is_inside)


def _smooth(share: NDArray) -> NDArray:
    """Pad by a point and blur by a pixel, to smooth the cells' staircase."""
    # Odd reflection goes on as it came: repeated, a line would meet the frame at a right angle.
    share = np.pad(share, 1, mode="reflect", reflect_type="odd")
    for _ in range(2):
        padded = np.pad(share, 1, mode="reflect", reflect_type="odd")
        share = padded[:-2] + 2 * padded[1:-1] + padded[2:]
        share = (share[:, :-2] + 2 * share[:, 1:-1] + share[:, 2:]) / 16
    return share


def draw_contours(
    panel: Panel,
    values: NDArray[np.floating],
    levels: Sequence[float],
    colors: list[tuple[str, str]],
    blocked: NDArray[np.bool_],
    texts: Sequence[str] = (),
    names: Sequence[tuple[float, float, float, float]] = (),
) -> None:
    """
    Draw and label the lines that enclose at least a level, each level in its two colours.

    Levels are hours unless ``texts`` label them. Blocked cells have no valid values: lines and
    labels avoid them, and the boxes of names [inch], too.
    """
    finder, tracer = _LabelFinder(panel, values, blocked, names), Tracer(panel, blocked)
    slack = _RELATIVE * max(levels, default=0.0) if texts else _HOURS
    texts = texts or [f"{level} h" for level in levels]
    for level, (color, halo), text in zip(levels, colors, texts, strict=True):
        # Values are sums of float32 steps: a cell of exactly the level lies inside.
        lines = _leave_free(tracer.trace(values >= level - slack), names)
        lines, places = finder.find(lines, text)
        panel.rule_map(lines, color, 0.5)
        for x, y, angle in places:
            panel.write(
                x, y, text, LABEL, color=color, halo=halo, rotation=angle,
                rotation_mode="anchor", ha="center", va="center_baseline",
            )  # fmt: skip


def _leave_free(
    lines: list[NDArray[np.float64]], boxes: Sequence[tuple[float, float, float, float]]
) -> list[NDArray[np.float64]]:
    """Return the pieces of lines that run through no box, of points that lie densely."""
    for x0, y0, x1, y1 in boxes:
        pieces = []
        for line in lines:
            x, y = line.T
            is_in = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
            cuts = np.flatnonzero(is_in[1:] != is_in[:-1]) + 1
            firsts = [0, *cuts.tolist()]
            split = zip(np.split(line, cuts), is_in[firsts].tolist(), strict=True)
            pieces += [piece for piece, hidden in split if not hidden and len(piece) > 1]
        lines = pieces
    return lines


class _LabelFinder:
    """Finder of straight, free label positions on lines, away from earlier labels."""

    def __init__(
        self,
        panel: Panel,
        hours: NDArray[np.float32],
        blocked: NDArray[np.bool_],
        names: Sequence[tuple[float, float, float, float]] = (),
    ) -> None:
        self.box = panel.map_box
        self.taken: list[tuple[float, ...]] = []
        x, y, w, h = self.box
        # Small rasters of the values that matter to a label.
        size = (max(1, round(h / COARSE)), max(1, round(w / COARSE)))
        self.blocked = resample(blocked, size) > TOUCHED
        for x0, y0, x1, y1 in names:
            rows = slice(max(int((y0 - y) / h * size[0]), 0), math.ceil((y1 - y) / h * size[0]))
            cols = slice(max(int((x0 - x) / w * size[1]), 0), math.ceil((x1 - x) / w * size[1]))
            self.blocked[rows, cols] = True
        self.hours = np.nan_to_num(resample(hours, size))

    def find(self, lines: list[NDArray], text: str) -> tuple[list[NDArray], list[Place]]:
        """Find up to three places (x, y, angle) for a level's label, and cut its lines there."""
        half = measure_text(text, LABEL) / 2 + 0.03
        places: list[Place] = []
        parts: list[NDArray] = []
        for line in sorted(lines, key=len, reverse=True):
            length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
            best = None
            if len(places) < 3 and length[-1] > 5 * half:
                best = min(self._judge(line, length, half), default=None)
            if best is None:
                parts.append(line)
                continue
            _, at, label = best
            self.taken.append(label[:2])
            places.append(label)
            parts += [_cut(line, length, 0, at - half), _cut(line, length, at + half, length[-1])]
        return parts, places

    def _judge(
        self, line: NDArray, length: NDArray, half: float
    ) -> Iterator[tuple[float, float, Place]]:
        """Yield the label positions that fit on a line: unrest, arc length, placement."""
        tries = min(60, int(length[-1] / 0.1) + 2)
        at = np.linspace(1.5 * half, length[-1] - 1.5 * half, tries)
        start, middle, end = (_find(line, length, at + shift) for shift in (-half, 0.0, half))
        along = end - start
        straight = np.hypot(*along.T) / (2 * half)
        left, bottom, w, h = self.box
        room = half + 0.04
        inside = (middle > (left + room, bottom + room)) & (
            middle < (left + w - room, bottom + h - room)
        )
        fits = (straight >= STRAIGHT) & inside.all(1)
        for x, y in self.taken:
            fits &= np.hypot(middle[:, 0] - x, middle[:, 1] - y) >= LABEL_GAP
        rows, cols = self.hours.shape
        reach = math.ceil(half / COARSE)
        for n in np.flatnonzero(fits).tolist():
            x, y = middle[n].tolist()
            row, col = int((y - bottom) / h * rows), int((x - left) / w * cols)
            window = np.s_[
                max(0, row - reach) : row + reach + 1, max(0, col - reach) : col + reach + 1
            ]
            if self.blocked[window].any():
                continue
            angle = math.degrees(math.atan2(along[n, 1], along[n, 0]))
            angle = (angle + 90) % 180 - 90  # never upside down
            unrest = float(np.ptp(self.hours[window])) + (1 - float(straight[n]))
            yield unrest, float(at[n]), (x, y, angle)


def _cut(line: NDArray, length: NDArray, start: float, end: float) -> NDArray:
    """Return a line from one arc length to another."""
    between = length[(length > start) & (length < end)]
    return _find(line, length, np.concatenate([[start], between, [end]]))


def _find(line: NDArray, length: NDArray, at: NDArray) -> NDArray:
    """Return the points (n, 2) of a line at n arc lengths."""
    return np.column_stack([np.interp(at, length, line[:, axis]) for axis in (0, 1)])


PITCH, NARROW_PITCH = 14, 10  # from line to line, along a row [pixel]
WIDE = 24  # least width of a region with bold lines and a border [pixel]
HAIR = 0.3  # width of lines in narrower ones [point]
RIM = "#ffffffc8"


def draw_hatch(panel: Panel, is_inside: NDArray[np.bool_]) -> None:
    """
    Hatch a region of cells (rows, cols), and draw its border.

    Where it is narrow, as on small facades, hair lines without a border leave its hours visible.
    """
    inside = resample(is_inside, panel.map_size) > HALF
    wide = _open(inside)
    _rule(panel, _find_hatch(panel, wide, PITCH))
    border = trace(panel, wide)
    panel.rule_map(border, RIM, 1.7)
    panel.rule_map(border, INK, 0.8)
    fine = _find_hatch(panel, inside & ~wide, NARROW_PITCH)
    panel.rule_map(fine, RIM, 2.5 * HAIR)
    panel.rule_map(fine, INK, HAIR)


def _open(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the parts of a region that are wide in every direction, (rows, cols)."""
    outside = np.where(inside, np.uint8(0), np.uint8(1))
    core = spread_largest(np.pad(outside, WIDE // 2, mode="edge"), WIDE // 2) == 0
    opened = spread_largest(core.astype(np.uint8), WIDE // 2) > 0
    rows, cols = inside.shape
    return opened[WIDE // 2 :, WIDE // 2 :][:rows, :cols] & inside


def _find_hatch(panel: Panel, inside: NDArray[np.bool_], pitch: int) -> list[NDArray[np.float64]]:
    """Return the lines that hatch pixels (rows, cols), each (2, 2) [inch]."""
    x, y, _, _ = panel.map_box
    rows, cols = inside.shape
    lines = []
    for first in range(-rows + pitch // 2, cols, pitch):
        row = np.arange(max(0, -first), min(rows, cols - first))
        is_on = np.concatenate([[False], inside[row, row + first], [False]])
        ends = np.flatnonzero(is_on[1:] != is_on[:-1]).reshape(-1, 2) + max(0, -first)
        lines += [
            np.array([(x + (r + first) / DOTS_PER_INCH, y + r / DOTS_PER_INCH) for r in pair])
            for pair in ends
        ]
    return lines


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


LEAF, PROPOSED = "#1f6b2c", "#d0312d"


@dataclass(frozen=True, eq=False)
class _Cover:
    """See-through casters: their cells, and how they are hatched."""

    cells: NDArray[np.bool_]
    border: str
    inks: NDArray[np.float32]  # (2, 3) of the hatch on light ground, and on dark
    lean: int  # 1 or -1: the way that the lines lean
    stride: int  # pixels from a line to the next


_LEAF = np.array([(0x1F, 0x6B, 0x2C), (0xA6, 0xE3, 0xA8)], np.float32) / np.float32(255)
_RED = np.array([(0xD0, 0x31, 0x2D), (0xFF, 0xB4, 0xA8)], np.float32) / np.float32(255)


def _find_covers(plan: Plan) -> list[_Cover]:
    """List the see-through casters of a map."""
    covers = []
    if plan.canopies is not None:
        covers.append(_Cover(plan.canopies, LEAF, _LEAF, 1, 9))
    if plan.proposed is not None and plan.looks_through:
        covers.append(_Cover(plan.proposed, PROPOSED, _RED, -1, 17))
    return covers


def hatch_covers(image: NDArray[np.float32], plan: Plan, size: tuple[int, int]) -> None:
    """Hatch see-through casters on a map (rows, cols, 3), in [0, 1]; the hours show between."""
    rows, cols = np.indices(size)
    for cover in _find_covers(plan):
        lines = (rows + cover.lean * cols) % cover.stride == 0
        lines &= resample(cover.cells, size) > HALF
        colors = image[lines]
        ink = np.where((colors @ LUMINANCE)[:, None] < DARK, cover.inks[1], cover.inks[0])
        image[lines] += 0.75 * (ink - colors)


def outline_covers(panel: Panel) -> None:
    """Draw the borders of see-through casters on a map."""
    for cover in _find_covers(panel.plan):
        lines = trace(panel, cover.cells)
        panel.rule_map(lines, "#ffffffc0", 2.0)
        panel.rule_map(lines, cover.border, 0.9)


def find_swatches(plans: Sequence[Plan]) -> list[Swatch]:
    """Name the layers of maps besides hours."""
    swatches = []
    crowned = next((plan for plan in plans if plan.canopies is not None), None)
    if crowned is not None:
        swatches.append(Swatch(crowned.canopy_name, "white", LEAF, "/////"))
    bare = dict.fromkeys(plan.nothing_name for plan in plans if plan.nothing is not None)
    swatches += [Swatch(name, str(MISSING)) for name in bare]
    if any(plan.looks_through for plan in plans):
        swatches.append(Swatch("proposed, see-through", "white", PROPOSED, "\\\\\\"))
    appearances = [plan.appearance for plan in plans if plan.appearance is not None]
    if any(
        appearance.sky is not None and (appearance.sky > 127).any() for appearance in appearances
    ):
        swatches.append(Swatch("sky: no hours", SKY))
    return swatches
