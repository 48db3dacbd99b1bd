"""Keys of pictures: a colour bar, a list of swatches."""

import numpy as np
from numpy.typing import NDArray

from umbra.writers.lettering import SMALL
from umbra.writers.paper import INK, QUIET, RULE
from umbra.writers.plan import DOTS_PER_INCH
from umbra.writers.sheet import Sheet

__all__ = ["draw_color_bar", "draw_swatches"]

THICK = 0.2  # of a bar [inch]


def draw_color_bar(
    sheet: Sheet,
    colors: NDArray,
    ticks: list[tuple[float, str]],
    title: list[str],
    remark: str = "",
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
    """
    x, y, w, h = sheet.key_box
    if sheet.is_wide:
        heading = " ".join(title) + (f", {remark}" if remark else "")
        sheet.write(x, y + h - 0.1, heading, 8.0)
        length, thick = w, 0.15
        y += h - 0.17 - thick
    else:
        top = y + h
        for n, line in enumerate(title):
            sheet.write(x, top - 0.12 - 0.155 * n, line, 8.0)
        length = min(h - 0.155 * len(title) - (0.4 if remark else 0.15), 3.6)
        y, thick = top - 0.155 * len(title) - 0.1 - length, THICK
        if remark:
            sheet.write(x, y - 0.24, remark, SMALL - 0.5, color=QUIET)
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
    sheet: Sheet, colors: NDArray, labels: list[str], title: list[str], remark: str = ""
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
    """
    x, y, w, h = sheet.key_box
    top = y + h
    if sheet.is_wide:
        sheet.write(x, top - 0.1, " ".join(title) + (f", {remark}" if remark else ""), 8.0)
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
        pitch = min(0.23, (top - y) / max(len(labels), 1))
        places = [(x, top - pitch * n) for n in range(len(labels))]
        if remark:
            sheet.write(x, places[-1][1] - 0.24, remark, SMALL - 0.5, color=QUIET)
    boxes = [[(a, b), (a + 0.22, b), (a + 0.22, b + 0.14), (a, b + 0.14)] for a, b in places]
    sheet.fill(boxes, colors, RULE)
    for (a, b), label in zip(places, labels, strict=True):
        sheet.write(a + 0.29, b + 0.07, label, SMALL, va="center_baseline")
