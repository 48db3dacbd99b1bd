"""A plan on paper: what is judged, at a standard scale, with key and north."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.writers.paper import INK, QUIET, RULE, SMALL, Paper, measure_text
from umbra.writers.proof.drawing import COLORS, TINTS, Drawing

__all__ = ["draw_plan", "fit"]

_SCALES = (50, 100, 200, 250, 500, 1000, 2000, 2500, 5000, 10_000, 20_000, 25_000, 50_000)
_METRE = 39.3701  # [inch]
_MOST_NAMES = 60  # windows with names
_NICE = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 10**9)


def fit(text: str, size: float, room: float, weight: str = "normal") -> str:
    """Cut a text to a width."""
    while len(text) > 1 and measure_text(text, size, weight) > room:
        text = text[:-2].rstrip() + "…"
    return text


def draw_plan(
    paper: Paper, box: tuple[float, float, float, float], drawing: Drawing, true_north: float
) -> None:
    """Draw the plan at a standard scale, in the middle of a box [inch]."""
    x0, y0, width, height = box
    low_x, low_y, high_x, high_y = drawing.frame
    needed = max((high_x - low_x) * _METRE / width, (high_y - low_y) * _METRE / height)
    scale = next((one for one in _SCALES if one >= needed), math.ceil(needed))
    factor = _METRE / scale
    middle = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2])
    corner = np.array([x0 + width / 2, y0 + height / 2])

    def put(points: NDArray) -> NDArray:
        return (np.asarray(points, float) - middle) * factor + corner

    pen = _Pen(paper, box, put)
    pen.fill(drawing.buildings, "#ececef", "#8c8c96", 0.5)
    for rings, verdict, _ in drawing.shapes:
        pen.fill_rings(rings, TINTS[verdict], COLORS[verdict], 1.1)
    pen.fill(drawing.proposal, "#f3e3b5", "#8a6d1c", 0.9)
    for lines, _ in drawing.offsets:
        pen.rule(lines, "#7a4fa3", 0.7, "--")
    pen.rule(drawing.boundary, "#7a4fa3", 1.2)
    for lines, label in drawing.lines:
        pen.rule(lines, INK, 0.9)
        pen.label(lines, label)
    for lines, label in drawing.offsets:
        pen.label(lines, label)
    names = len(drawing.windows) <= _MOST_NAMES
    for x, y, azimuth, verdict, name in drawing.windows:
        pen.mark(x, y, azimuth, COLORS[verdict], verdict, name if names else "")
    for rings, verdict, name in drawing.shapes:
        pen.name(rings[0], name, COLORS[verdict])
    x1, y1 = x0 + width, y0 + height
    paper.rule([np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])], RULE, 0.5)
    _draw_key(paper, box, scale, factor, drawing)
    _draw_north(paper, x1 - 0.4, y1 - 0.5, true_north)


class _Pen:
    """Drawing within a box, in the model's coordinates."""

    def __init__(self, paper: Paper, box: tuple[float, float, float, float], put: Callable) -> None:
        from matplotlib.patches import Rectangle  # noqa: PLC0415

        self.paper, self.put, self.box = paper, put, box
        x, y, w, h = box
        self.clip = Rectangle((x, y), w, h, transform=paper.leaf.dpi_scale_trans)
        self.taken: list[tuple[float, float]] = []

    def fill(self, polygons: list[NDArray], color: str, edge: str, width: float) -> None:
        if polygons:
            shown = [self.put(one) for one in polygons]
            self.paper.fill(shown, color, edge, width).set_clip_path(self.clip)

    def fill_rings(self, rings: list[NDArray], color: str, edge: str, width: float) -> None:
        """Fill rings of which the inner are holes."""
        from matplotlib.collections import PathCollection  # noqa: PLC0415
        from matplotlib.path import Path  # noqa: PLC0415

        path = Path.make_compound_path(*(Path(self.put(ring), closed=True) for ring in rings))
        artist = PathCollection(
            [path], facecolors=color, edgecolors=edge, linewidths=width,
            transform=self.paper.leaf.dpi_scale_trans,
        )  # fmt: skip
        artist.set_clip_path(self.clip)
        self.paper.leaf.add(artist)

    def rule(self, lines: list[NDArray], color: str, width: float, style: Any = "-") -> None:
        if lines:
            artist = self.paper.rule([self.put(line) for line in lines], color, width)
            artist.set_linestyle(style)
            artist.set_clip_path(self.clip)

    def label(self, lines: list[NDArray], text: str) -> None:
        """Write a line's name at its longest piece."""
        if not lines:
            return
        longest = self.put(max(lines, key=len))
        inside = [spot for spot in longest if self.holds(spot, 0.3)]
        free = [spot for spot in inside if self.is_free(spot)]
        if free:
            spot = free[len(free) // 2]
            self.taken.append((float(spot[0]), float(spot[1])))
            self.paper.write(
                spot[0], spot[1], text, 6.5, ha="center", va="center", halo="#ffffffe0"
            )

    def mark(self, x: float, y: float, azimuth: float, color: str, verdict: str, name: str) -> None:
        """Mark a window: a wedge that looks out, filled for pass, hollow for unknown."""
        spot = self.put(np.array([[x, y]]))[0]
        if not self.holds(spot, 0.05):
            return
        if math.isnan(azimuth):
            angles = np.radians(np.arange(0, 360, 45))
            shape = spot + 0.045 * np.stack([np.sin(angles), np.cos(angles)], 1)
        else:
            turn = math.radians(azimuth)
            out, side = (math.sin(turn), math.cos(turn)), (math.cos(turn), -math.sin(turn))
            shape = spot + np.array([
                0.11 * np.array(out) + 0.0 * np.array(side), 0.055 * np.array(side),
                -0.055 * np.array(side),
            ])  # fmt: skip
        self.paper.fill([shape], "white" if verdict == "unknown" else color, color, 0.9)
        if name and self.is_free(spot):
            self.taken.append((float(spot[0]), float(spot[1])))
            away = (0.0, -1.0) if math.isnan(azimuth) else out
            self.paper.write(
                spot[0] + 0.16 * away[0], spot[1] + 0.16 * away[1], name, 5.5, color=QUIET,
                ha="left" if away[0] > 0.3 else "right" if away[0] < -0.3 else "center",
                va="center", halo="#ffffffd0",
            )  # fmt: skip

    def name(self, ring: NDArray, text: str, color: str) -> None:
        """Write an area's name in it, or at the middle of its upper side."""
        spots = self.put(ring[:-1])
        spot = spots.mean(0)
        if self.holds(spot, 0.1):
            self.paper.write(spot[0], spot[1], fit(text, 7.0, 2.2), 7.0, color=color, ha="center",
                             va="center", weight="bold", halo="#ffffffe0")  # fmt: skip

    def holds(self, spot: NDArray, margin: float) -> bool:
        x, y, w, h = self.box
        return bool(x + margin < spot[0] < x + w - margin and y + margin < spot[1] < y + h - margin)

    def is_free(self, spot: NDArray) -> bool:
        return all(math.hypot(x - spot[0], y - spot[1]) > 0.28 for x, y in self.taken)


def _draw_key(
    paper: Paper, box: tuple[float, float, float, float], scale: float, factor: float,
    drawing: Drawing,
) -> None:  # fmt: skip
    """Draw the scale bar, and what colours and lines mean."""
    x, y = box[0] + 0.15, box[1] + 0.14
    entries = [(word, COLORS[word]) for word in COLORS if word]
    used = {verdict for _, verdict, _ in drawing.shapes} | {one[3] for one in drawing.windows}
    items: list[tuple[str, str, str]] = [
        ("box", word, color) for word, color in entries if word in used
    ]
    if drawing.proposal:
        items.append(("box", "proposal", "#f3e3b5"))
    if drawing.boundary:
        items.append(("line", "plot", "#7a4fa3"))
    items += [("line", label, INK) for _, label in drawing.lines[:2]]
    length = next(one for one in _NICE if one * factor >= 0.8)
    room = length * factor
    left = box[2] - 0.5 - room - 1.3
    while items and sum(0.4 + measure_text(text, SMALL) for _, text, _ in items) > left:
        items.pop()  # the last are lines, which have their names beside them
    whole = 0.3 + room + 1.3 + sum(0.4 + measure_text(text, SMALL) for _, text, _ in items)
    back = np.array([(x - 0.1, y - 0.1), (x + whole, y - 0.1), (x + whole, y + 0.22),
                     (x - 0.1, y + 0.22)])  # fmt: skip
    paper.fill([back], "#ffffffee", "none")
    paper.rule([np.array([(x, y + 0.06), (x, y), (x + room, y), (x + room, y + 0.06)])], INK, 0.8)
    told = f"{length:g} m, 1 : {scale:,.0f}"
    paper.write(x + room + 0.08, y, told, SMALL)
    x += room + 0.25 + measure_text(told, SMALL)
    for kind, text, color in items:
        if kind == "box":
            corner = np.array([(x, y), (x + 0.14, y), (x + 0.14, y + 0.1), (x, y + 0.1)])
            paper.fill([corner], color, RULE, 0.4)
        else:
            paper.rule([np.array([(x, y + 0.05), (x + 0.18, y + 0.05)])], color, 1.0)
        paper.write(x + 0.22, y, text, SMALL)
        x += 0.4 + measure_text(text, SMALL)


def _draw_north(paper: Paper, x: float, y: float, true_north: float) -> None:
    turn = math.radians(true_north)
    out, side = (
        np.array([math.sin(turn), math.cos(turn)]),
        np.array([math.cos(turn), -math.sin(turn)]),
    )
    middle = np.array([x, y])
    paper.fill([middle + np.array([0.22 * out, -0.12 * out + 0.09 * side, -0.06 * out,
                                   -0.12 * out - 0.09 * side])], INK, INK)  # fmt: skip
    spot = middle + 0.3 * out
    paper.write(spot[0], spot[1], "N", SMALL, ha="center", va="center", weight="bold",
                halo="#ffffffe0")  # fmt: skip
