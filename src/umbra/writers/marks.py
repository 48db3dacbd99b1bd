"""What frames a map: ticks with coordinates, a scale bar, an arrow to true north."""

import math
from collections.abc import Callable

import numpy as np

from umbra.writers.paper import INK, QUIET, RULE, Panel
from umbra.writers.plan import DOTS_PER_INCH

__all__ = ["draw_frame", "draw_north", "draw_scale_bar", "find_round", "find_ticks"]

THIN_SPACE = "\u2009"
Ticks = list[tuple[float, str]]


def draw_frame(
    panel: Panel,
    x_ticks: Ticks,
    y_ticks: Ticks,
    label_width: float,
) -> None:
    """Draw the map's outline, ticks with coordinates, and the axes' names and unit."""
    x, y, w, h = panel.map_box
    px = 0.5 / DOTS_PER_INCH
    outline = [
        (x - px, y - px),
        (x + w + px, y - px),
        (x + w + px, y + h + px),
        (x - px, y + h + px),
    ]
    panel.rule([np.array([*outline, outline[0]])], RULE, 0.6)
    x0, _, y0, _ = panel.plan.extent
    across = [panel.place((tick, y0))[0] for tick, _ in x_ticks]
    up = [panel.place((x0, tick))[1] for tick, _ in y_ticks]
    panel.rule([[(at, y - 0.045), (at, y)] for at in across], RULE)
    panel.rule([[(x - 0.045, at), (x, at)] for at in up], RULE)
    for at, (_, label) in zip(across, x_ticks, strict=True):
        panel.write(at, y - 0.075, label, color=QUIET, ha="center", va="top")
    for at, (_, label) in zip(up, y_ticks, strict=True):
        panel.write(x - 0.08, at, label, color=QUIET, ha="right", va="center_baseline")
    if not x_ticks and not y_ticks:
        return
    panel.write(x + w / 2, y - 0.25, panel.plan.axes[0], color=QUIET, ha="center", va="top")
    panel.write(
        x - 0.15 - label_width,
        y + h / 2,
        panel.plan.axes[1],
        color=QUIET,
        ha="right",
        va="center",
        rotation=90,
    )


def find_round(largest: float) -> float:
    """Find the largest of 1, 2 or 5 times a power of ten that is not above ``largest``."""
    power = 10.0 ** math.floor(math.log10(largest) + 1e-9)
    return next(m * power for m in (5, 2, 1) if m * power <= largest * (1 + 1e-9))


def _name(value: float, step: float) -> str:
    """Write a coordinate in full, thousands apart by thin spaces, never as an offset."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    text = f"{value:,.{decimals}f}".replace(",", THIN_SPACE)
    return text.replace("-", "\u2212")


def find_ticks(start: float, end: float, length: float, spacing: Callable[[str], float]) -> Ticks:
    """Choose round coordinates whose labels keep ``spacing(label)`` [inch] between them."""
    per_metre = length / (end - start)
    step = find_round((end - start) * 2)
    chosen: Ticks = []
    while step * per_metre > 0.05:
        multiples = np.arange(math.ceil(start / step - 1e-9), math.floor(end / step + 1e-9) + 1)
        ticks = [(float(n * step), _name(float(n * step), step)) for n in multiples]
        widest = max((spacing(label) for _, label in ticks), default=0)
        if step * per_metre < widest:
            # Too dense already; a short axis still gets the one tick nearest its middle.
            middle = (start + end) / 2
            return chosen or sorted(ticks, key=lambda tick: abs(tick[0] - middle))[:1]
        chosen = ticks
        step = find_round(step * 0.99)
    return chosen


def draw_scale_bar(panel: Panel, x: float, y: float, longest: float, *, zero: str = "left") -> None:
    """Draw a two-tone bar of a round length, at most ``longest`` [inch], labels above it."""
    if not panel.plan.has_scale:
        return
    x0, x1, _, _ = panel.plan.extent
    per_metre = panel.map_box[2] / (x1 - x0)
    length = find_round(longest / per_metre)
    half, thick = length * per_metre / 2, 0.06
    boxes = [
        [
            (x + n * half, y),
            (x + (n + 1) * half, y),
            (x + (n + 1) * half, y + thick),
            (x + n * half, y + thick),
        ]
        for n in (0, 1)
    ]
    panel.fill(boxes, [INK, "white"])
    unit, factor = ("km", 1e-3) if length >= 2000 else ("m", 1.0)
    panel.write(x, y + thick + 0.06, "0", ha=zero)
    end = f"{length * factor:g}{THIN_SPACE}{unit}"
    panel.write(x + 2 * half, y + thick + 0.06, end, ha="center")


def draw_north(panel: Panel, x: float, y: float) -> None:
    """Draw an arrow toward true north, its middle at (x, y); none where it is not known."""
    if panel.plan.true_north is None:
        return
    angle = math.radians(panel.plan.true_north)
    up = np.array([math.sin(angle), math.cos(angle)])
    side = np.array([up[1], -up[0]])
    lie = np.array([1.0, panel.plan.upward])  # flat on the ground, as the view sees it
    tip, tail, notch = 0.2 * up, -0.2 * up, -0.11 * up
    centre = np.array([x, y])
    halves = [centre + np.array([tip, tail + s * 0.11 * side, notch]) * lie for s in (-1, 1)]
    panel.fill(halves, [INK, "white"], width=0.7)
    letter = centre + 0.2 * up * lie + 0.09 * up
    panel.write(letter[0], letter[1], "N", 8.5, weight="bold", ha="center", va="center_baseline")
