"""
The paper of a picture and the maps on it.

Everything is placed in inches from the lower left corner, by measured text, with
matplotlib's figure and its canvases alone: no pyplot, no axes, no style that a user's
matplotlibrc could turn, and no pixel of the map resampled once more.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Rectangle
from matplotlib.patheffects import Stroke
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from numpy.typing import ArrayLike, NDArray

from umbra.writers.pixels import write_png
from umbra.writers.plan import DOTS_PER_INCH, Plan

__all__ = [
    "INK",
    "LINE",
    "NIGHT",
    "QUIET",
    "RULE",
    "SMALL",
    "SUBTITLE",
    "TITLE",
    "Panel",
    "Paper",
    "find_font",
    "make_figure",
    "measure",
    "to_pixels",
    "wrap",
]

TITLE, SUBTITLE, SMALL = 13.0, 9.5, 7.5  # sizes of type [point]
LINE = 1.42 / 72  # from one line of type to the next [inch per point]


def find_font(size: float, weight: str = "normal") -> FontProperties:
    """Return the one typeface, which comes with matplotlib."""
    return FontProperties(family="DejaVu Sans", size=size, weight=weight)


@lru_cache(maxsize=4096)
def measure(text: str, size: float, weight: str = "normal") -> float:
    """Return the width of a line of type [inch]."""
    width, _, _ = text_to_path.get_text_width_height_descent(text, find_font(size, weight), False)
    return width / 72


def wrap(text: str, size: float, width: float, weight: str = "normal") -> list[str]:
    """Break a text into lines no wider than ``width`` [inch]: between its parts if it can be."""
    if text and measure(text, size, weight) <= width:
        return [text]
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


NIGHT = "the sun stays below the horizon"
INK, QUIET, RULE = "#1c1c22", "#5a5a64", "#8c8c96"
# Type stays type, and the same picture is the same file.
_VECTORS: Any = {"pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "umbra"}


class _Pixels(Artist):
    """An image drawn pixel by pixel; matplotlib would resample it."""

    def __init__(self, image: NDArray[np.uint8], place: tuple[int, int]) -> None:
        super().__init__()
        self.place = place
        self.image = np.full((*image.shape[:2], 4), 255, np.uint8)
        self.image[..., :3] = image

    def draw(self, renderer: RendererBase) -> None:
        # The PNG's canvas measures in pixels, PDF's and SVG's in points.
        unit = float(renderer.points_to_pixels(72)) / DOTS_PER_INCH  # type: ignore[arg-type]
        x, y = self.place
        renderer.draw_image(renderer.new_gc(), x * unit, y * unit, self.image)


class _Letters(Text):
    """A line of type, its halo drawn apart from it, so that type stays type in PDF and SVG."""

    def draw(self, renderer: RendererBase) -> None:
        halo = self.get_path_effects()
        if halo:
            super().draw(renderer)
            self.set_path_effects([])
        super().draw(renderer)
        self.set_path_effects(halo)


def make_figure(width: float, height: float) -> Figure:
    """Return white paper of whole pixels [inch]."""
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def to_pixels(length: float) -> float:
    """Round a length up to whole pixels, so that maps lie on them [inch]."""
    return float(np.ceil(length * DOTS_PER_INCH - 1e-9) / DOTS_PER_INCH)


@dataclass(frozen=True, eq=False)
class Paper:
    """Paper of a figure, with drawing methods in inches."""

    figure: Figure

    def write(self, x: float, y: float, text: str, size: float = SMALL, **style: object) -> Text:
        """Write one line of type at a place [inch]."""
        weight = str(style.pop("weight", "normal"))
        halo = style.pop("halo", None)
        style = {"color": INK, "ha": "left", "va": "baseline", "usetex": False, **style}
        written = _Letters(x, y, text, fontproperties=find_font(size, weight), **style)  # type: ignore[arg-type]
        written.set_parse_math(False)  # a dollar in a file's name is a dollar
        written.set_transform(self.figure.dpi_scale_trans)
        if halo is not None:
            written.set_path_effects([Stroke(linewidth=2.2, foreground=halo)])
        self.figure.add_artist(written)
        return written

    def rule(self, lines: list, color: object = INK, width: float = 0.6) -> LineCollection:
        """Draw polylines, each (n, 2) [inch]."""
        artist = LineCollection(
            lines, colors=color, linewidths=width, transform=self.figure.dpi_scale_trans
        )
        artist.set_capstyle("butt")
        self.figure.add_artist(artist)
        return artist

    def fill(
        self, polygons: list, colors: object, edge: object = INK, width: float = 0.5
    ) -> PolyCollection:
        """Fill polygons, each (n, 2) [inch]."""
        artist = PolyCollection(
            polygons,
            facecolors=colors,
            edgecolors=edge,
            linewidths=width,
            transform=self.figure.dpi_scale_trans,
        )
        self.figure.add_artist(artist)
        return artist

    def paste(self, image: NDArray, x: float, y: float) -> None:
        """Put an sRGB image (rows, cols, 3), in [0, 1] or uint8, its row 0 lowest."""
        if image.dtype != np.uint8:
            image = (np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8)
        place = (round(x * DOTS_PER_INCH), round(y * DOTS_PER_INCH))
        self.figure.add_artist(_Pixels(image, place))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Draw it all and write a PNG, a PDF or an SVG, by the path's ending."""
        ending = Path(path).suffix.lower()
        if ending in {".pdf", ".svg"}:
            undated = {"CreationDate": None} if ending == ".pdf" else {"Date": None}
            with mpl.rc_context():
                mpl.rcdefaults()
                mpl.rcParams.update(_VECTORS)
                self.figure.savefig(path, format=ending[1:], facecolor="white", metadata=undated)
            return
        canvas = self.figure.canvas
        canvas.draw()
        write_png(path, np.asarray(canvas.buffer_rgba())[..., :3], DOTS_PER_INCH)  # type: ignore[attr-defined]


@dataclass(frozen=True, eq=False)
class Panel(Paper):
    """A map on the paper, which may hold others."""

    plan: Plan
    map_box: tuple[float, float, float, float]  # x, y, width, height [inch]
    map_size: tuple[int, int]  # rows and columns of pixels

    def place(self, points: ArrayLike) -> NDArray[np.float64]:
        """Turn points (n, 2) in model coordinates [m] into places on the paper [inch]."""
        x0, x1, y0, y1 = self.plan.extent
        x, y, width, height = self.map_box
        scale = (width / (x1 - x0), height / (y1 - y0))
        return (np.asarray(points, np.float64) - (x0, y0)) * scale + (x, y)

    def rule_map(self, lines: list, color: object = INK, width: float = 0.6) -> None:
        """Draw polylines, each (n, 2) [inch], that end at the map's frame."""
        x, y, w, h = self.map_box
        artist = self.rule(lines, color, width)
        artist.set_clip_path(Rectangle((x, y), w, h, transform=self.figure.dpi_scale_trans))

    def write_over(self, reason: str) -> None:
        """Write the reason for an empty map across it."""
        x, y, w, h = self.map_box
        self.write(x + w / 2, y + h / 2, reason, 9.0, color=QUIET, ha="center", va="center")
