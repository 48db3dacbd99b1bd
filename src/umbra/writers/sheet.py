"""
The paper of a picture: title, map frame with its ticks, scale bar, north arrow, note.

Everything is placed in inches from the lower left corner, by measured text, with
matplotlib's figure and its Agg canvas alone: no pyplot, no axes, no style that a user's
matplotlibrc could turn, and no pixel of the map resampled once more.
"""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from numpy.typing import ArrayLike, NDArray

from umbra.writers.plan import DOTS_PER_INCH, Plan, find_map_size
from umbra.writers.png import write_png

__all__ = ["INK", "QUIET", "Sheet", "make_sheet", "measure"]

INK, QUIET, RULE = "#1c1c22", "#5a5a64", "#8c8c96"
MARGIN = 0.28
KEY_WIDTH = 1.32
NARROWEST = 4.4  # the words need this much [inch]
TITLE, SUBTITLE, SMALL = 13.0, 9.5, 7.5  # sizes of type [point]
LINE = 1.42 / 72  # from one line of type to the next [inch per point]
THIN_SPACE = "\u2009"


def _font(size: float, weight: str = "normal") -> FontProperties:
    return FontProperties(family="DejaVu Sans", size=size, weight=weight)


def measure(text: str, size: float, weight: str = "normal") -> float:
    """Give the width of a line of type [inch]."""
    width, _, _ = text_to_path.get_text_width_height_descent(text, _font(size, weight), False)
    return width / 72


def _wrap(text: str, size: float, width: float, weight: str = "normal") -> list[str]:
    """Break a text into lines no wider than ``width`` [inch]: between its parts if it can be."""
    lines: list[str] = []
    for line in _join(text.split(" · "), " · ", size, width, weight):
        lines += _join(line.split(" "), " ", size, width, weight)
    return [line for line in lines if line]


def _join(pieces: list[str], joint: str, size: float, width: float, weight: str) -> Iterator[str]:
    """Join pieces into lines as long as they fit; cut a single word that is too long."""
    line = ""
    for piece in pieces:
        longer = line + joint + piece if line else piece
        if measure(longer, size, weight) <= width:
            line = longer
            continue
        if line:
            yield line
        line = piece
        while joint == " " and measure(line, size, weight) > width:
            end = len(line) - 1
            while end > 1 and measure(line[:end], size, weight) > width:
                end -= 1
            yield line[:end]
            line = line[end:]
    yield line


class _Pixels(Artist):
    """An image whose pixels are those of the sheet; matplotlib's own are resampled."""

    def __init__(self, image: NDArray[np.uint8], place: tuple[int, int]) -> None:
        super().__init__()
        self.place = place
        self.image = np.full((*image.shape[:2], 4), 255, np.uint8)
        self.image[..., :3] = image

    def draw(self, renderer: RendererBase) -> None:
        renderer.draw_image(renderer.new_gc(), *self.place, self.image)


@dataclass(frozen=True, eq=False)
class Sheet:
    """
    A figure with a map on it and room for a key.

    Parameters
    ----------
    plan : Plan
    figure : matplotlib Figure
    map_box, key_box : (x, y, width, height)
        Of the map and of the key [inch].
    map_size : (rows, cols)
        Pixels of the map.
    is_wide : bool
        Whether the key lies below the map rather than to its right.
    """

    plan: Plan
    figure: Figure
    map_box: tuple[float, float, float, float]
    key_box: tuple[float, float, float, float]
    map_size: tuple[int, int]
    is_wide: bool

    def place(self, points: ArrayLike) -> NDArray[np.float64]:
        """Turn points (n, 2) in model coordinates [m] into places on the sheet [inch]."""
        x0, x1, y0, y1 = self.plan.extent
        x, y, width, height = self.map_box
        scale = (width / (x1 - x0), height / (y1 - y0))
        return (np.asarray(points, np.float64) - (x0, y0)) * scale + (x, y)

    def write(self, x: float, y: float, text: str, size: float = SMALL, **style: object) -> Text:
        """Write one line of type at a place [inch]."""
        weight = str(style.pop("weight", "normal"))
        halo = style.pop("halo", None)
        style = {"color": INK, "ha": "left", "va": "baseline", "usetex": False, **style}
        written = Text(x, y, text, fontproperties=_font(size, weight), **style)  # type: ignore[arg-type]
        written.set_parse_math(False)  # a dollar in a file's name is a dollar
        written.set_transform(self.figure.dpi_scale_trans)
        if halo is not None:
            written.set_path_effects([withStroke(linewidth=2.2, foreground=halo)])
        self.figure.add_artist(written)
        return written

    def rule(
        self, lines: list, color: object = INK, width: float = 0.6, *, on_map: bool = False
    ) -> None:
        """Draw polylines, each (n, 2) [inch]; on the map they end at its frame."""
        artist = LineCollection(
            lines, colors=color, linewidths=width, transform=self.figure.dpi_scale_trans
        )
        artist.set_capstyle("butt")
        self.figure.add_artist(artist)
        if on_map:
            x, y, w, h = self.map_box
            artist.set_clip_path(Rectangle((x, y), w, h, transform=self.figure.dpi_scale_trans))

    def fill(self, polygons: list, colors: object, edge: object = INK, width: float = 0.5) -> None:
        """Fill polygons, each (n, 2) [inch]."""
        self.figure.add_artist(
            PolyCollection(
                polygons,
                facecolors=colors,
                edgecolors=edge,
                linewidths=width,
                transform=self.figure.dpi_scale_trans,
            )
        )

    def paste(self, image: NDArray, x: float, y: float) -> None:
        """Put an sRGB image (rows, cols, 3), in [0, 1] or uint8, its row 0 lowest."""
        if image.dtype != np.uint8:
            image = (np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8)
        place = (round(x * DOTS_PER_INCH), round(y * DOTS_PER_INCH))
        self.figure.add_artist(_Pixels(image, place))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Draw it all and write a PNG."""
        canvas = self.figure.canvas
        canvas.draw()
        write_png(path, np.asarray(canvas.buffer_rgba())[..., :3], DOTS_PER_INCH)  # type: ignore[attr-defined]


def make_sheet(plan: Plan, key_height: float) -> Sheet:
    """
    Lay out a sheet and draw all but the map's content and its key.

    Parameters
    ----------
    plan : Plan
    key_height : float
        What the key needs where it lies below a wide map [inch].
    """
    map_size = rows, cols = find_map_size(plan)
    w, h = cols / DOTS_PER_INCH, rows / DOTS_PER_INCH
    is_wide = w > 2.6 * h
    x0, x1, y0, y1 = plan.extent
    x_ticks = _find_ticks(x0, x1, w, lambda label: measure(label, SMALL) + 0.3)
    y_ticks = _find_ticks(y0, y1, h, lambda _: 0.55)
    label_width = max((measure(label, SMALL) for _, label in y_ticks), default=0)

    left = MARGIN + 0.27 + label_width
    width = max(left + w + (MARGIN + 0.1 if is_wide else 0.32 + KEY_WIDTH + MARGIN), NARROWEST)
    words = width - 2 * MARGIN
    title = _wrap(plan.title, TITLE, words, "bold")
    subtitle = _wrap(" · ".join(filter(None, (plan.date, plan.place))), SUBTITLE, words)
    note = _wrap(plan.note, SMALL, words)

    y = MARGIN + len(note) * SMALL * LINE + (0.12 if note else 0)
    strip = y
    y += (key_height + 0.2) if is_wide else 0
    bottom = y + 0.42
    top = bottom + h
    height = (
        top + 0.16 + len(subtitle) * SUBTITLE * LINE + len(title) * TITLE * LINE + MARGIN - 0.05
    )

    # Whole pixels, so that the map lies on them.
    left, bottom, width, height = (
        math.ceil(v * DOTS_PER_INCH) / DOTS_PER_INCH for v in (left, bottom, width, height)
    )
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, facecolor="white")
    FigureCanvasAgg(figure)
    if is_wide:
        key_box = (left + 3.0, strip, w - 3.0 - 0.8, key_height)
    else:
        key_box = (left + w + 0.32, bottom + 0.6, KEY_WIDTH, h - 0.6 - 0.85)
    sheet = Sheet(plan, figure, (left, bottom, w, h), key_box, map_size, is_wide)

    y = height - MARGIN + 0.05
    for lines, size, weight, color in (
        (title, TITLE, "bold", INK),
        (subtitle, SUBTITLE, "normal", QUIET),
    ):
        for line in lines:
            y -= size * LINE
            sheet.write(MARGIN, y + size * 0.3 / 72, line, size, weight=weight, color=color)
    for n, line in enumerate(reversed(note)):
        sheet.write(MARGIN, MARGIN + n * SMALL * LINE, line, SMALL, color=QUIET)
    _draw_frame(sheet, x_ticks, y_ticks, label_width)
    if is_wide:
        _draw_scale_bar(sheet, left, strip + key_height / 2 - 0.05, 2.2)
        _draw_north(sheet, left + w - 0.3, strip + key_height / 2)
    else:
        _draw_scale_bar(sheet, key_box[0], bottom + 0.03, KEY_WIDTH - 0.25)
        _draw_north(sheet, key_box[0] + 0.3, bottom + h - 0.36)
    return sheet


def _draw_frame(
    sheet: Sheet,
    x_ticks: list[tuple[float, str]],
    y_ticks: list[tuple[float, str]],
    label_width: float,
) -> None:
    """Draw the map's outline, ticks with coordinates, and the axes' names and unit."""
    x, y, w, h = sheet.map_box
    px = 0.5 / DOTS_PER_INCH
    outline = [
        (x - px, y - px),
        (x + w + px, y - px),
        (x + w + px, y + h + px),
        (x - px, y + h + px),
    ]
    sheet.rule([np.array([*outline, outline[0]])], RULE, 0.6)
    x0, _, y0, _ = sheet.plan.extent
    across = [sheet.place((tick, y0))[0] for tick, _ in x_ticks]
    up = [sheet.place((x0, tick))[1] for tick, _ in y_ticks]
    sheet.rule([[(at, y - 0.045), (at, y)] for at in across], RULE)
    sheet.rule([[(x - 0.045, at), (x, at)] for at in up], RULE)
    for at, (_, label) in zip(across, x_ticks, strict=True):
        sheet.write(at, y - 0.075, label, color=QUIET, ha="center", va="top")
    for at, (_, label) in zip(up, y_ticks, strict=True):
        sheet.write(x - 0.08, at, label, color=QUIET, ha="right", va="center_baseline")
    sheet.write(x + w / 2, y - 0.25, sheet.plan.axes[0], color=QUIET, ha="center", va="top")
    sheet.write(
        x - 0.15 - label_width,
        y + h / 2,
        sheet.plan.axes[1],
        color=QUIET,
        ha="right",
        va="center",
        rotation=90,
    )


def _find_round(largest: float) -> float:
    """Find the largest of 1, 2 or 5 times a power of ten that is not above ``largest``."""
    power = 10.0 ** math.floor(math.log10(largest) + 1e-9)
    return next(m * power for m in (5, 2, 1) if m * power <= largest * (1 + 1e-9))


def _name(value: float, step: float) -> str:
    """Write a coordinate in full, thousands apart by thin spaces, never as an offset."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    text = f"{value:,.{decimals}f}".replace(",", THIN_SPACE)
    return text.replace("-", "\u2212")


def _find_ticks(
    start: float, end: float, length: float, spacing: object
) -> list[tuple[float, str]]:
    """Choose round coordinates whose labels keep ``spacing(label)`` [inch] between them."""
    per_metre = length / (end - start)
    step = _find_round((end - start) * 2)
    chosen: list[tuple[float, str]] = []
    while step * per_metre > 0.05:
        multiples = np.arange(math.ceil(start / step - 1e-9), math.floor(end / step + 1e-9) + 1)
        ticks = [(float(n * step), _name(float(n * step), step)) for n in multiples]
        widest = max((spacing(label) for _, label in ticks), default=0)  # type: ignore[operator]
        if step * per_metre < widest:
            # Too dense already; a short axis still gets the one tick nearest its middle.
            middle = (start + end) / 2
            return chosen or sorted(ticks, key=lambda tick: abs(tick[0] - middle))[:1]
        chosen = ticks
        step = _find_round(step * 0.99)
    return chosen


def _draw_scale_bar(sheet: Sheet, x: float, y: float, longest: float) -> None:
    """Draw a two-tone bar of a round length, at most ``longest`` [inch], labels above it."""
    if not sheet.plan.axes[0].endswith("[m]"):
        return
    x0, x1, _, _ = sheet.plan.extent
    per_metre = sheet.map_box[2] / (x1 - x0)
    length = _find_round(longest / per_metre)
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
    sheet.fill(boxes, [INK, "white"])
    unit, factor = ("km", 1e-3) if length >= 2000 else ("m", 1.0)
    sheet.write(x, y + thick + 0.06, "0", ha="center" if sheet.is_wide else "left")
    end = f"{length * factor:g}{THIN_SPACE}{unit}"
    sheet.write(x + 2 * half, y + thick + 0.06, end, ha="center")


def _draw_north(sheet: Sheet, x: float, y: float) -> None:
    """Draw an arrow toward true north, its middle at (x, y); none where it is not known."""
    if sheet.plan.true_north is None:
        return
    angle = math.radians(sheet.plan.true_north)
    up = np.array([math.sin(angle), math.cos(angle)])
    side = np.array([up[1], -up[0]])
    tip, tail, notch = 0.2 * up, -0.2 * up, -0.11 * up
    centre = np.array([x, y])
    halves = [centre + np.array([tip, tail + s * 0.11 * side, notch]) for s in (-1, 1)]
    sheet.fill(halves, [INK, "white"], width=0.7)
    letter = centre + 0.29 * up
    sheet.write(letter[0], letter[1], "N", 8.5, weight="bold", ha="center", va="center_baseline")
