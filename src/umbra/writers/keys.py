"""Keys of pictures: a colour bar, a list of swatches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.writers.lettering import SMALL, measure, wrap
from umbra.writers.paper import INK, QUIET, RULE
from umbra.writers.plan import DOTS_PER_INCH
from umbra.writers.sheet import Sheet

__all__ = ["Swatch", "draw_color_bar", "draw_swatches"]

THICK = 0.2  # of a bar [inch]
PITCH = 0.2  # from swatch to swatch below a bar [inch]


@dataclass(frozen=True)
class Swatch:
    """
    What a colour or a hatch beside the scale stands for.

    Parameters
    ----------
    label : str
    face, edge : str or tuple
        Colours.
    hatch : str
        As matplotlib draws it.
    """

    label: str
    face: object
    edge: object = RULE
    hatch: str = ""

    def draw(self, sheet: Sheet, x: float, y: float, width: float) -> float:
        """Draw it and its label from a lower left corner, the label broken; give the height."""
        box = [(x, y), (x + 0.22, y), (x + 0.22, y + 0.14), (x, y + 0.14)]
        artist = sheet.fill([box], self.face, self.edge)
        if self.hatch:
            artist.set_hatch(self.hatch)
        lines = wrap(self.label, SMALL, width - 0.29)
        for n, line in enumerate(lines):
            sheet.write(x + 0.29, y + 0.07 - 0.14 * n, line, SMALL, va="center_baseline")
        return PITCH + 0.14 * (len(lines) - 1)

    def measure(self, width: float) -> float:
        """Give the height that ``draw`` takes."""
        return PITCH + 0.14 * (len(wrap(self.label, SMALL, width - 0.29)) - 1)


def draw_color_bar(
    sheet: Sheet,
    colors: NDArray,
    ticks: list[tuple[float, str]],
    title: list[str],
    remark: str = "",
    swatches: Sequence[Swatch] = (),
) -> None:
    """
    Draw a colour bar in the sheet's key box.

    Parameters
    ----------
    sheet : Sheet
    colors : (n, 3) float64
        sRGB, from the low end to the high.
    ticks : list of (position, label)
        Position 0 at the low end and 1 at the high.
    title : list of str
        Lines above the bar: what it shows and the unit.
    remark : str
        A line below it.
    swatches : sequence of Swatch
        What else is painted on the map, below the bar or beside its title.
    """
    x, y, w, h = sheet.key_box
    below = sum(swatch.measure(w) for swatch in swatches)
    if sheet.is_wide:
        heading = " ".join(title) + (f", {remark}" if remark else "")
        sheet.write(x, y + h - 0.1, heading, 8.0)
        at = x + measure(heading, 8.0) + 0.35
        for swatch in swatches:
            swatch.draw(sheet, at, y + h - 0.12, 9.0)
            at += measure(swatch.label, SMALL) + 0.29 + 0.3
        length, thick = w, 0.15
        y += h - 0.17 - thick
    else:
        top = y + h
        for n, line in enumerate(title):
            sheet.write(x, top - 0.12 - 0.155 * n, line, 8.0)
        length = min(h - 0.155 * len(title) - (0.4 if remark else 0.15) - below, 3.6)
        y, thick = top - 0.155 * len(title) - 0.1 - length, THICK
        if remark:
            sheet.write(x, y - 0.24, remark, SMALL - 0.5, color=QUIET)
        at = y - (0.55 if remark else 0.32)
        for swatch in swatches:
            at -= swatch.draw(sheet, x, at, w)
    pixels = round(length * DOTS_PER_INCH)
    length, width = pixels / DOTS_PER_INCH, round(thick * DOTS_PER_INCH)
    x, y, thick = (round(v * DOTS_PER_INCH) / DOTS_PER_INCH for v in (x, y, thick))
    strip = np.asarray(colors)[np.arange(pixels) * len(colors) // pixels]
    strip = np.repeat(strip[:, None], width, axis=1)
    sheet.paste(strip.transpose(1, 0, 2) if sheet.is_wide else strip, x, y)
    across, up = (length, thick) if sheet.is_wide else (thick, length)
    box = [(x, y), (x + across, y), (x + across, y + up), (x, y + up), (x, y)]
    sheet.rule([box], RULE)
    for position, label in ticks:
        at = position * length
        if sheet.is_wide:
            sheet.rule([[(x + at, y - 0.04), (x + at, y)]], RULE)
            sheet.write(x + at, y - 0.065, label, SMALL, color=INK, ha="center", va="top")
        else:
            sheet.rule([[(x + thick, y + at), (x + thick + 0.04, y + at)]], RULE)
            sheet.write(x + thick + 0.09, y + at, label, SMALL, color=INK, va="center_baseline")


def draw_swatches(
    sheet: Sheet,
    colors: NDArray,
    labels: list[str],
    title: list[str],
    remark: str = "",
    swatches: Sequence[Swatch] = (),
) -> None:
    """
    Draw a list of named colours in the sheet's key box.

    Parameters
    ----------
    sheet : Sheet
    colors : (n, 3) float64
        sRGB.
    labels : list of str
    title : list of str
        Lines above the list.
    remark : str
        A line below it.
    swatches : sequence of Swatch
        What else is painted on the map, below all that or beside the title.
    """
    x, y, w, h = sheet.key_box
    top = y + h
    if sheet.is_wide:
        heading = " ".join(title) + (f", {remark}" if remark else "")
        sheet.write(x, top - 0.1, heading, 8.0)
        at = x + measure(heading, 8.0) + 0.35
        for swatch in swatches:
            swatch.draw(sheet, at, top - 0.12, 9.0)
            at += measure(swatch.label, SMALL) + 0.29 + 0.3
        per_row = max(1, int(w / 0.72))
        per_row = -(-len(labels) // -(-len(labels) // per_row))  # rows of even length
        places = [
            (x + 0.72 * (n % per_row), top - 0.4 - 0.22 * (n // per_row))
            for n in range(len(labels))
        ]
    else:
        for n, line in enumerate(title):
            sheet.write(x, top - 0.12 - 0.155 * n, line, 8.0)
        top -= 0.155 * len(title) + 0.28
        room = top - y - sum(swatch.measure(w) for swatch in swatches)
        pitch = min(0.23, room / max(len(labels), 1))
        places = [(x, top - pitch * n) for n in range(len(labels))]
        if remark:
            sheet.write(x, places[-1][1] - 0.24, remark, SMALL - 0.5, color=QUIET)
        at = places[-1][1] - (0.55 if remark else 0.32)
        for swatch in swatches:
            at -= swatch.draw(sheet, x, at, w)
    boxes = [[(a, b), (a + 0.22, b), (a + 0.22, b + 0.14), (a, b + 0.14)] for a, b in places]
    sheet.fill(boxes, colors, RULE)
    for (a, b), label in zip(places, labels, strict=True):
        sheet.write(a + 0.29, b + 0.07, label, SMALL, va="center_baseline")
