"""Outlines of named areas on a map, each with its name."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.writers.paper import INK, LINE, SMALL, Panel, measure_text

__all__ = ["draw_areas", "find_names", "place_names"]

COLOR, HALO = INK, "#ffffffd8"
_GAP = 0.05  # between a name and an outline [inch]
_MOST_NAMES = 60  # of more areas, those of the largest boxes

Box = tuple[float, float, float, float]  # x0, y0, x1, y1 [inch]


def draw_areas(panel: Panel) -> None:
    """Outline a plan's areas on its map, and write their names."""
    areas = panel.plan.areas
    if not areas:
        return
    rings = [[panel.place(ring) for ring in area.rings] for area in areas]
    every = [ring for own in rings for ring in own]
    panel.rule_map(every, HALO, 2.6)
    panel.rule_map(every, COLOR, 1.1)
    for name, (x0, y0, x1, y1) in find_names(panel):
        panel.write(
            (x0 + x1) / 2, (y0 + y1) / 2, name, SMALL, color=COLOR, halo=HALO, weight="bold",
            ha="center", va="center",
        )  # fmt: skip


def find_names(panel: Panel) -> list[tuple[str, Box]]:
    """Find the names of a map's areas and their boxes [inch], which lines and labels leave free."""
    areas = panel.plan.areas
    rings = [[panel.place(ring) for ring in area.rings] for area in areas]
    x, y, w, h = panel.map_box
    outer = [_bound(np.concatenate(own)) for own in rings]
    middles = [panel.place(np.array([area.middle]))[0] for area in areas]
    is_seen = [x <= at[0] <= x + w and y <= at[1] <= y + h for at in middles]
    order = sorted(np.flatnonzero(is_seen), key=lambda k: -_measure(outer[k]))[:_MOST_NAMES]
    sizes = [(measure_text(areas[k].name, SMALL, "bold"), SMALL * LINE) for k in order]
    places = place_names(
        [middles[k] for k in order], [outer[k] for k in order], sizes, (x, y, x + w, y + h)
    )
    return [
        (areas[k].name, (u - wide / 2, v - high / 2, u + wide / 2, v + high / 2))
        for k, (u, v), (wide, high) in zip(order, places, sizes, strict=True)
    ]


def place_names(
    middles: Sequence[NDArray[np.float64]],
    outer: Sequence[Box],
    sizes: Sequence[tuple[float, float]],
    frame: Box,
) -> list[tuple[float, float]]:
    """
    Place names at the middle of their areas; beside them if too wide, or if others are in the way.

    Parameters
    ----------
    middles : sequence of (2,) float64
        A place inside each area [inch].
    outer : sequence of box
        Around each area [inch].
    sizes : sequence of (float, float)
        Width and height of each name [inch].
    frame : box
        In which names stay [inch].

    Returns
    -------
    places : list of (float, float)
        Centres of the names: of five places the first that is free, else that of least overlap.
    """
    taken: list[Box] = []
    places = []
    for middle, (x0, y0, x1, y1), (w, h) in zip(middles, outer, sizes, strict=True):
        x, y = float(middle[0]), float(middle[1])
        candidates = [
            (x, y), (x, y1 + _GAP + h / 2), (x, y0 - _GAP - h / 2), (x1 + _GAP + w / 2, y),
            (x0 - _GAP - w / 2, y),
        ]  # fmt: skip
        if w > x1 - x0 or h > y1 - y0:  # its outline would run through it
            candidates = [*candidates[1:], candidates[0]]
        inside = [_keep_in(at, (w, h), frame) for at in candidates]
        boxes = [(a - w / 2, b - h / 2, a + w / 2, b + h / 2) for a, b in inside]
        best = min(range(5), key=lambda k: sum(_overlap(boxes[k], box) for box in taken))
        taken.append(boxes[best])
        places.append(inside[best])
    return places


def _keep_in(at: tuple[float, float], size: tuple[float, float], frame: Box) -> tuple[float, float]:
    """Move the centre of a name so that it lies in the frame."""
    low = [frame[k] + size[k] / 2 for k in (0, 1)]
    high = [frame[k + 2] - size[k] / 2 for k in (0, 1)]
    x, y = (max(low[k], min(at[k], high[k])) for k in (0, 1))
    return x, y


def _bound(points: NDArray[np.float64]) -> Box:
    (x0, y0), (x1, y1) = points.min(0).tolist(), points.max(0).tolist()
    return x0, y0, x1, y1


def _measure(box: Box) -> float:
    return (box[2] - box[0]) * (box[3] - box[1])


def _overlap(a: Box, b: Box) -> float:
    """Return the area that two boxes share."""
    wide, high = (min(a[k + 2], b[k + 2]) - max(a[k], b[k]) for k in (0, 1))
    return max(wide, 0.0) * max(high, 0.0)
