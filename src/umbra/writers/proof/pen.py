"""A plan on paper: what is judged, at a standard scale, with its labels, scale bar and north."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.writers.labels import Labels, list_around
from umbra.writers.paper import INK, QUIET, RULE, SMALL, Paper, measure_text, wrap
from umbra.writers.proof.drawing import (
    BOUNDARY,
    COLORS,
    LAND,
    PROPOSAL,
    REPLACED,
    TINTS,
    Drawing,
    Spot,
    group_windows,
)

__all__ = ["draw_plan", "find_scale", "fit", "fit_name"]

Box = tuple[float, float, float, float]

_SCALES = (50, 100, 200, 250, 500, 1000, 2000, 2500, 5000, 10_000, 20_000, 25_000, 50_000)
_METRE = 39.3701  # [inch]
_MOST_NAMES = 60  # places of windows with names
_NICE = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 10**9)
_AREA, _LINE, _WINDOW = (7.0, 6.0), 6.5, 5.5  # sizes of type
_TALL = 1.25 / 72  # of a label [inch per point]
_WIDEST, _MOST_LINES = 2.6, 4  # of an area's name [inch]
_GRID = 9  # places of a label across an area
_HALO = "#ffffffe0"


def fit(text: str, size: float, room: float, weight: str = "normal") -> str:
    """Cut a text to a width."""
    while len(text) > 1 and measure_text(text, size, weight) > room:
        text = text[:-2].rstrip() + "…"
    return text


def fit_name(name: str, size: float, room: float) -> str:
    """Cut a name in its middle to a width: long names of one list differ at their end."""
    left = len(name)
    text = name
    while left > 3 and measure_text(text, size) > room:
        left -= 1
        begun = left // 2
        text = f"{name[:begun].rstrip()}…{name[len(name) - left + begun :].lstrip()}"
    return text if measure_text(text, size) <= room else fit(name, size, room)


def find_scale(box: Box, drawing: Drawing) -> int:
    """Return the standard scale at which a drawing fits into a box: n of 1 : n."""
    low_x, low_y, high_x, high_y = drawing.frame
    needed = max((high_x - low_x) * _METRE / box[2], (high_y - low_y) * _METRE / box[3])
    return next((scale for scale in _SCALES if scale >= needed), math.ceil(needed))


def draw_plan(paper: Paper, box: Box, drawing: Drawing, true_north: float) -> list[str]:
    """
    Draw the plan at a standard scale, in the middle of a box [inch].

    Returns
    -------
    numbered : list of str
        Names that had no room, in whose place stand the numbers 1, 2 and so on.
    """
    x0, y0, width, height = box
    low_x, low_y, high_x, high_y = drawing.frame
    scale = find_scale(box, drawing)
    factor = _METRE / scale
    middle = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2])
    corner = np.array([x0 + width / 2, y0 + height / 2])

    def put(points: NDArray) -> NDArray:
        return (np.asarray(points, float) - middle) * factor + corner

    pen = _Pen(paper, box, put)
    pen.fill(drawing.buildings, LAND, "#8c8c96", 0.5)
    for rings, verdict, _ in drawing.shapes:
        pen.fill_rings(rings, TINTS[verdict], COLORS[verdict], 1.1)
    pen.fill(drawing.proposal, PROPOSAL, "#8a6d1c", 0.9)
    pen.rule(drawing.replaced, REPLACED, 0.8, "--")
    pen.labels.avoid([pen.put(ring) for ring in drawing.proposal])
    for lines, _ in drawing.offsets:
        pen.rule(lines, BOUNDARY, 0.7, "--")
    pen.rule(drawing.boundary, BOUNDARY, 1.2)
    for line in drawing.lines:
        pen.rule(line.pieces, INK, 0.9)
    _draw_scale(pen, scale, factor)
    _draw_north(pen, x0 + width - 0.42, y0 + height - 0.5, true_north)
    spots = group_windows(drawing.windows)
    for spot in spots:
        pen.mark(spot)
    # Areas first: a garden without a name says nothing.
    for rings, verdict, name in drawing.shapes:
        pen.name_area(rings, name, COLORS[verdict])
    for line in drawing.lines:
        pen.label_line(line.pieces, line.short)
    for lines, label in drawing.offsets:
        pen.label_line(lines, label)
    for spot in spots if len(spots) <= _MOST_NAMES else ():
        pen.name_window(spot)
    x1, y1 = x0 + width, y0 + height
    paper.rule([np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])], RULE, 0.5)
    return pen.numbered


class _Pen:
    """Drawing within a box, in the model's coordinates."""

    def __init__(self, paper: Paper, box: Box, put: Callable) -> None:
        from matplotlib.patches import Rectangle  # noqa: PLC0415

        self.paper, self.put, self.box = paper, put, box
        x, y, w, h = box
        self.clip = Rectangle((x, y), w, h, transform=paper.leaf.dpi_scale_trans)
        self.numbered: list[str] = []
        self.labels = Labels((x + 0.03, y + 0.03, w - 0.06, h - 0.06))

    def fill(self, polygons: list[NDArray], color: str, edge: str, width: float) -> None:
        if polygons:
            shown = [self.put(polygon) for polygon in polygons]
            self.paper.fill(shown, color, edge, width).set_clip_path(self.clip)

    def fill_rings(self, rings: list[NDArray], color: str, edge: str, width: float) -> None:
        """Fill rings of which the inner are holes."""
        from matplotlib.collections import PathCollection  # noqa: PLC0415
        from matplotlib.path import Path  # noqa: PLC0415

        shown = [self.put(ring) for ring in rings]
        path = Path.make_compound_path(*(Path(ring, closed=True) for ring in shown))
        artist = PathCollection(
            [path], facecolors=color, edgecolors=edge, linewidths=width,
            transform=self.paper.leaf.dpi_scale_trans,
        )  # fmt: skip
        artist.set_clip_path(self.clip)
        self.paper.leaf.add(artist)
        self.labels.avoid(shown)

    def rule(self, lines: Sequence[NDArray], color: str, width: float, style: Any = "-") -> None:
        if len(lines):
            shown = [self.put(line) for line in lines]
            artist = self.paper.rule(shown, color, width)
            artist.set_linestyle(style)
            artist.set_clip_path(self.clip)
            self.labels.avoid(shown)

    def mark(self, spot: Spot) -> None:
        """Mark windows: a wedge that looks out, hollow for unknown."""
        at = self.put(np.array([[spot.x, spot.y]]))[0]
        if not self._holds(at):
            return
        if math.isnan(spot.azimuth):
            angles = np.radians(np.arange(0, 360, 45))
            shape = at + 0.045 * np.stack([np.sin(angles), np.cos(angles)], 1)
        else:
            out = _look(spot.azimuth)
            side = np.array([out[1], -out[0]])
            shape = at + np.array([0.11 * out, 0.055 * side, -0.055 * side])
        color = COLORS[spot.verdict]
        fill = "white" if spot.verdict == "unknown" else color
        self.paper.fill([shape], fill, color, 0.9).set_clip_path(self.clip)
        self.labels.take(shape.min(0) - 0.01, shape.max(0) + 0.01)

    def name_area(self, rings: list[NDArray], name: str, color: str) -> None:
        """Write an area's name in it, off all lines; where it has no room a number for the key."""
        ring = self.put(max(rings, key=len))
        low, high = ring.min(0), ring.max(0)
        across = float((high - low)[0]) - 0.08
        tries = [(size, wrap(name, size, room, "bold"))
                 for size in _AREA for room in (_WIDEST, across) if room > 0.3]  # fmt: skip
        number = f"{len(self.numbered) + 1}"
        for size, lines in [*tries, (_AREA[0], [number])]:
            wide = max(measure_text(line, size, "bold") for line in lines) + 0.05
            tall = _TALL * size * len(lines)
            places = self._list_inside(rings, low, high, wide, tall)
            is_number = lines == [number]
            if is_number:
                places = np.concatenate([places, list_around(low, high, wide, tall, (0.02, 0.1))])
            elif len(lines) > _MOST_LINES or any(line not in name for line in lines):
                continue
            spot = self.labels.find(places, wide, tall, may_cross=is_number)
            if spot is not None:
                break
        if is_number:
            self.numbered.append(name)
        for k, line in enumerate(lines if spot is not None else ()):
            down = (k - (len(lines) - 1) / 2) * _TALL * size
            self._write(np.subtract(spot, (0, down)), line, size, color, weight="bold")  # type: ignore[arg-type]

    def _list_inside(
        self, rings: list[NDArray], low: NDArray, high: NDArray, wide: float, tall: float
    ) -> NDArray[np.float64]:
        """Return places whose label lies in the area, those at its middle first."""
        from matplotlib.path import Path  # noqa: PLC0415

        room = high - low - (wide, tall)
        if (room < 0).any():
            return np.zeros((0, 2))
        steps = (np.arange(_GRID) + 0.5) / _GRID - 0.5
        across, up = np.meshgrid(steps * room[0], steps * room[1])
        places = (low + high) / 2 + np.stack([across.ravel(), up.ravel()], 1)
        paths = [Path(self.put(ring), closed=True) for ring in rings]

        def is_in(points: NDArray) -> NDArray[np.bool_]:  # odd: within a ring, and no hole
            return np.sum([path.contains_points(points) for path in paths], axis=0) % 2 == 1

        corners = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1), (0, 0)]) / 2 * (wide, tall)
        inside = np.all([is_in(places + corner) for corner in corners], axis=0)
        middle = self.put(rings[0])[:-1].mean(0)
        places = places[inside]
        return places[np.argsort(np.hypot(*(places - middle).T), kind="stable")]

    def label_line(self, lines: Sequence[NDArray], text: str) -> None:
        """Write a line's name beside its longest piece."""
        if not len(lines):
            return
        piece = self.put(max(lines, key=len))
        wide, tall = measure_text(text, _LINE) + 0.05, _TALL * _LINE
        middle = len(piece) // 2
        near = piece[np.argsort(np.abs(np.arange(len(piece)) - middle), kind="stable")]
        near = near[:: max(len(near) // 60, 1)]
        beside = [near + (0, sign * (tall / 2 + 0.03)) for sign in (1, -1)]
        beside += [near + (sign * (wide / 2 + 0.03), 0) for sign in (1, -1)]
        places = np.concatenate([*beside, near])
        spot = self.labels.find(places, wide, tall)
        if spot is not None:
            self._write(spot, text, _LINE, INK)

    def name_window(self, spot: Spot) -> None:
        """Write the name of what stands at a place, before it."""
        at = self.put(np.array([[spot.x, spot.y]]))[0]
        if not self._holds(at):
            return
        text = spot.label
        wide, tall = measure_text(text, _WINDOW) + 0.03, _TALL * _WINDOW
        if wide > _WIDEST:
            return
        around = list_around(at - 0.05, at + 0.05, wide, tall, (0.02, 0.07, 0.13))
        if not math.isnan(spot.azimuth):
            ahead = (around - at) @ _look(spot.azimuth)
            around = around[ahead > 0.3 * np.hypot(*(around - at).T)]
        position = self.labels.find(around, wide, tall, may_cross=False)
        if position is not None:
            self._write(position, text, _WINDOW, QUIET)

    def _write(self, spot: NDArray, text: str, size: float, color: str, **style: Any) -> None:
        self.paper.write(
            spot[0], spot[1], text, size, color=color, ha="center", va="center", halo=_HALO, **style
        )

    def _holds(self, spot: NDArray) -> bool:
        x, y, w, h = self.box
        return bool(x + 0.05 < spot[0] < x + w - 0.05 and y + 0.05 < spot[1] < y + h - 0.05)


def _look(azimuth: float) -> NDArray[np.float64]:
    turn = math.radians(azimuth)
    return np.array([math.sin(turn), math.cos(turn)])


def _draw_scale(pen: _Pen, scale: int, factor: float) -> None:
    """Draw the scale bar in the corner."""
    x, y = pen.box[0] + 0.15, pen.box[1] + 0.14
    length = next(nice for nice in _NICE if nice * factor >= 0.8)
    room, legend = length * factor, f"{length:g} m, 1 : {scale:,.0f}"
    whole = room + 0.18 + measure_text(legend, SMALL)
    low, high = np.array([x - 0.08, y - 0.08]), np.array([x + whole, y + 0.18])
    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    pen.paper.fill([corners], "#ffffff", "none")
    bar = np.array([(x, y + 0.06), (x, y), (x + room, y), (x + room, y + 0.06)])
    pen.paper.rule([bar], INK, 0.8)
    pen.paper.write(x + room + 0.08, y, legend, SMALL)
    pen.labels.take(low, high)


def _draw_north(pen: _Pen, x: float, y: float, true_north: float) -> None:
    out = _look(true_north)
    side = np.array([out[1], -out[0]])
    middle = np.array([x, y])
    turn = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    disc = middle + 0.02 * out + 0.33 * np.stack([np.sin(turn), np.cos(turn)], 1)
    pen.paper.fill([disc], "#fffffff0", "none")
    pen.paper.fill([middle + np.array([0.2 * out, -0.14 * out + 0.09 * side, -0.08 * out,
                                       -0.14 * out - 0.09 * side])], INK, INK)  # fmt: skip
    spot = middle + 0.27 * out
    pen.paper.write(spot[0], spot[1], "N", SMALL, ha="center", va="center", weight="bold")
    pen.labels.take(disc.min(0), disc.max(0))
