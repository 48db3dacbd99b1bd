"""Surroundings of a map: ticks with coordinates, a scale bar, a north arrow, keys of colours."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.writers.paper import INK, QUIET, RULE, SMALL, Panel, measure_text, wrap
from umbra.writers.picture_content import DOTS_PER_INCH

if TYPE_CHECKING:
    from umbra.writers.sheet import Sheet

__all__ = [
    "KEY_TITLE",
    "Swatch",
    "draw_color_bar",
    "draw_frame",
    "draw_north",
    "draw_scale_bar",
    "draw_swatches",
    "find_round",
    "find_ticks",
]

THIN_SPACE = "\u2009"
Ticks = list[tuple[float, str]]
DENSEST = 0.05  # between ticks [inch]


def draw_frame(panel: Panel, x_ticks: Ticks, y_ticks: Ticks, label_width: float) -> None:
    """Draw the map's outline, ticks with coordinates, and the axes' names and unit."""
    x, y, w, h = panel.map_box
    larger = panel.leaf.larger
    small, tick = SMALL * larger, 0.045 * larger
    px = 0.5 / DOTS_PER_INCH
    panel.rule([_find_corners(x - px, y - px, w + 2 * px, h + 2 * px, 5)], RULE, 0.6)
    x0, _, y0, _ = panel.plan.extent
    across = [panel.place((at, y0))[0] for at, _ in x_ticks]
    up = [panel.place((x0, at))[1] for at, _ in y_ticks]
    panel.rule([[(at, y - tick), (at, y)] for at in across], RULE)
    panel.rule([[(x - tick, at), (x, at)] for at in up], RULE)
    below, aside = y - 0.075 * larger, x - 0.08 * larger
    for at, (_, label) in zip(across, x_ticks, strict=True):
        panel.write(at, below, label, small, color=QUIET, ha="center", va="top")
    for at, (_, label) in zip(up, y_ticks, strict=True):
        panel.write(aside, at, label, small, color=QUIET, ha="right", va="center_baseline")
    if not x_ticks and not y_ticks:
        return
    name_x, name_y = panel.plan.axes
    panel.write(x + w / 2, y - 0.25 * larger, name_x, small, color=QUIET, ha="center", va="top")
    panel.write(
        x - 0.15 * larger - label_width, y + h / 2, name_y, small, color=QUIET, ha="right",
        va="center", rotation=90,
    )  # fmt: skip


def _find_corners(
    x: float, y: float, wide: float, high: float, count: int = 4
) -> NDArray[np.float64]:
    """Return the corners of a box from its lower left, counter-clockwise; a fifth closes it."""
    unit = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)])[:count]
    return np.array([x, y]) + unit * (wide, high)


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
    while step * per_metre > DENSEST:
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
    larger = panel.leaf.larger
    half, thick, above = length * per_metre / 2, 0.06 * larger, 0.12 * larger
    halves = [_find_corners(x + n * half, y, half, thick) for n in (0, 1)]
    panel.fill(halves, [INK, "white"])
    unit, factor = ("km", 1e-3) if length >= 2000 else ("m", 1.0)
    panel.write(x, y + above, "0", SMALL * larger, ha=zero)
    end = f"{length * factor:g}{THIN_SPACE}{unit}"
    panel.write(x + 2 * half, y + above, end, SMALL * larger, ha="center")


def draw_north(panel: Panel, x: float, y: float) -> None:
    """Draw an arrow toward true north, its middle at (x, y); none where it is not known."""
    if panel.plan.true_north is None:
        return
    angle = math.radians(panel.plan.true_north)
    up = np.array([math.sin(angle), math.cos(angle)])
    side = np.array([up[1], -up[0]])
    lie = np.array([1.0, panel.plan.upward])  # flat on the ground, as the view sees it
    larger = panel.leaf.larger
    tip, tail, notch = 0.2 * larger * up, -0.2 * larger * up, -0.11 * larger * up
    centre = np.array([x, y])
    halves = [
        centre + np.array([tip, tail + s * 0.11 * larger * side, notch]) * lie for s in (-1, 1)
    ]
    panel.fill(halves, [INK, "white"], width=0.7)
    letter = centre + larger * (0.2 * up * lie + 0.09 * up)
    panel.write(
        letter[0], letter[1], "N", 8.5 * larger, weight="bold", ha="center", va="center_baseline"
    )


KEY_TITLE = 8.0  # [point]
THICK = 0.2  # of a bar [inch]
PITCH = 0.2  # from swatch to swatch below a bar [inch]


@dataclass(frozen=True)
class Swatch:
    """The meaning of a colour, or of a hatch as matplotlib draws it, beside the scale."""

    label: str
    face: object
    edge: object = RULE
    hatch: str = ""

    def draw(self, sheet: "Sheet", x: float, y: float, width: float) -> float:
        """Draw it and its label from a lower left corner, the label broken; return the height."""
        larger = sheet.leaf.larger
        box = _find_corners(x, y, 0.22 * larger, 0.14 * larger)
        artist = sheet.fill([box], self.face, self.edge)
        if self.hatch:
            artist.set_hatch(self.hatch)
        lines = self._wrap(width, larger)
        for n, line in enumerate(lines):
            at = y + (0.07 - 0.14 * n) * larger
            sheet.write(x + 0.29 * larger, at, line, SMALL * larger, va="center_baseline")
        return self.measure(width, larger)

    def measure(self, width: float, larger: float = 1.0) -> float:
        """Return the height that ``draw`` takes, with type larger than in most pictures."""
        return (PITCH + 0.14 * (len(self._wrap(width, larger)) - 1)) * larger

    def _wrap(self, width: float, larger: float) -> list[str]:
        return wrap(self.label, SMALL * larger, width - 0.29 * larger)


def draw_color_bar(
    sheet: "Sheet",
    colors: NDArray,
    ticks: list[tuple[float, str]],
    title: list[str],
    remark: str = "",
    swatches: Sequence[Swatch] = (),
) -> None:
    """
    Draw a bar of sRGB colours (n, 3), from the low end to the high, in the sheet's key box.

    Ticks are (position, label), from 0 at the low end to 1 at the high. The title's lines, name and
    unit of the values, stand above the bar, the remark below it; swatches of all else on the map
    follow below the bar, or beside its title.
    """
    x, _, w, h = sheet.key_box
    larger = sheet.leaf.larger
    small, tick = SMALL * larger, 0.04 * larger
    top = _draw_title(sheet, title, remark, swatches)
    if sheet.is_wide:
        length, thick = w, 0.15 * larger
        y = top - 0.17 * larger - thick
    else:
        below = sum(swatch.measure(w, larger) for swatch in swatches)
        words = (0.155 * len(title) + (0.4 if remark else 0.15)) * larger
        length = min(h - words - below, 3.6 * larger)
        y, thick = top - 0.1 * larger - length, THICK * larger
        _draw_foot(sheet, y, remark, swatches)
    pixels = round(length * DOTS_PER_INCH)
    length, width = pixels / DOTS_PER_INCH, round(thick * DOTS_PER_INCH)
    x, y, thick = (round(v * DOTS_PER_INCH) / DOTS_PER_INCH for v in (x, y, thick))
    strip = np.asarray(colors)[np.arange(pixels) * len(colors) // pixels]
    strip = np.repeat(strip[:, None], width, axis=1)
    sheet.paste(strip.transpose(1, 0, 2) if sheet.is_wide else strip, x, y)
    across, up = (length, thick) if sheet.is_wide else (thick, length)
    sheet.rule([_find_corners(x, y, across, up, 5)], RULE)
    for position, label in ticks:
        at = position * length
        if sheet.is_wide:
            sheet.rule([[(x + at, y - tick), (x + at, y)]], RULE)
            low = y - 0.065 * larger
            sheet.write(x + at, low, label, small, color=INK, ha="center", va="top")
        else:
            right = x + thick
            sheet.rule([[(right, y + at), (right + tick, y + at)]], RULE)
            right += 0.09 * larger
            sheet.write(right, y + at, label, small, color=INK, va="center_baseline")


def draw_swatches(
    sheet: "Sheet",
    colors: NDArray,
    labels: list[str],
    title: list[str],
    remark: str = "",
    swatches: Sequence[Swatch] = (),
    spacing: float = 0.72,
) -> None:
    """
    Draw named sRGB colours (n, 3) in the sheet's key box; else as ``draw_color_bar``.

    In a wide key they stand ``spacing`` apart [inch].
    """
    x, y, w, _ = sheet.key_box
    top = _draw_title(sheet, title, remark, swatches)
    if sheet.is_wide:
        per_row = max(1, int(w / spacing))
        per_row = -(-len(labels) // max(-(-len(labels) // per_row), 1))  # rows of even length
        places = [
            (x + spacing * (n % per_row), top - 0.4 - 0.22 * (n // per_row))
            for n in range(len(labels))
        ]
    else:
        top -= 0.28
        room = top - y - sum(swatch.measure(w) for swatch in swatches)
        pitch = min(0.23, room / max(len(labels), 1))
        places = [(x, top - pitch * n) for n in range(len(labels))]
        _draw_foot(sheet, places[-1][1] if places else top + 0.23, remark, swatches)
    sheet.fill([_find_corners(a, b, 0.22, 0.14) for a, b in places], colors, RULE)
    for (a, b), label in zip(places, labels, strict=True):
        sheet.write(a + 0.29, b + 0.07, label, SMALL, va="center_baseline")


def _draw_title(sheet: "Sheet", title: list[str], remark: str, swatches: Sequence[Swatch]) -> float:
    """Write a key's title, with all other text beside it if wide; return its lower end."""
    x, y, _, h = sheet.key_box
    top, larger = y + h, sheet.leaf.larger
    if not sheet.is_wide:
        for n, line in enumerate(title):
            sheet.write(x, top - (0.12 + 0.155 * n) * larger, line, KEY_TITLE * larger)
        return top - 0.155 * len(title) * larger
    heading = " ".join(title) + (f", {remark}" if remark else "")
    sheet.write(x, top - 0.1, heading, KEY_TITLE)
    at = x + measure_text(heading, KEY_TITLE) + 0.35
    for swatch in swatches:
        swatch.draw(sheet, at, top - 0.12, 9.0)
        at += measure_text(swatch.label, SMALL) + 0.29 + 0.3
    return top


def _draw_foot(sheet: "Sheet", y: float, remark: str, swatches: Sequence[Swatch]) -> None:
    """Write all other text below a high key."""
    x, _, w, _ = sheet.key_box
    larger = sheet.leaf.larger
    if remark:
        sheet.write(x, y - 0.24 * larger, remark, (SMALL - 0.5) * larger, color=QUIET)
    at = y - (0.55 if remark else 0.32) * larger
    for swatch in swatches:
        at -= swatch.draw(sheet, x, at, w)
