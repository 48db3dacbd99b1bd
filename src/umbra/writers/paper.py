"""
The paper of a picture and the maps on it.

Everything is placed in inches from the lower left corner, by measured text, with
matplotlib's artists and renderers alone: no pyplot, no axes, no style that a user's
matplotlibrc could turn, and no pixel of the map resampled once more.
"""

import logging
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from umbra.packages import make_folder_error

try:
    import matplotlib as mpl
except OSError as error:
    raise make_folder_error() from error
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Rectangle
from matplotlib.patheffects import Stroke
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.transforms import Affine2D, Bbox, TransformedBbox
from numpy.typing import ArrayLike, NDArray

from umbra.writers.picture_content import DOTS_PER_INCH, Plan
from umbra.writers.pixels import write_png
from umbra.writers.typeface import FACE, find_families
from umbra.writers.units import keep_units

__all__ = [
    "INK",
    "LINE",
    "NIGHT",
    "QUIET",
    "RULE",
    "SMALL",
    "SUBTITLE",
    "TITLE",
    "Leaf",
    "Panel",
    "Paper",
    "PaperPicture",
    "find_font",
    "load_fonts",
    "measure_text",
    "save_pages",
    "to_pixels",
    "wrap",
]

TITLE, SUBTITLE, SMALL = 13.0, 9.5, 7.5  # sizes of type [point]
LINE = 1.42 / 72  # from one line of type to the next [inch per point]


@lru_cache
def find_font(
    size: float, weight: str = "normal", families: tuple[str, ...] = (FACE,)
) -> FontProperties:
    """Return the one typeface, which comes with matplotlib, and others for letters it lacks."""
    return FontProperties(family=list(families), size=size, weight=weight)


@lru_cache(maxsize=4096)
def measure_text(text: str, size: float, weight: str = "normal") -> float:
    """
    Return the width of a line of type [inch]: as outlines or in pixels, whichever is wider.

    In pixels letters are moved to whole ones, which makes small type up to 6 % wider.
    """
    font = find_font(size, weight, find_families(text))
    with _pass_over_boxes():
        width, _, _ = text_to_path.get_text_width_height_descent(text, font, False)
        drawn, _, _ = _make_ruler().get_text_width_height_descent(text, font, False)
    return max(width / 72, drawn / DOTS_PER_INCH)


@lru_cache
def _make_ruler() -> RendererAgg:
    """Return a renderer that only measures."""
    return RendererAgg(1, 1, DOTS_PER_INCH)


@contextmanager
def _pass_over_boxes() -> Iterator[None]:
    """Keep matplotlib from telling of each letter or weight that a typeface lacks."""
    logger = logging.getLogger("matplotlib.font_manager")
    level = logger.level
    with warnings.catch_warnings():  # ``note_missing`` tells of them, once
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from")
        logger.setLevel(logging.ERROR)
        try:
            yield
        finally:
            logger.setLevel(level)


def load_fonts() -> None:
    """Load the typeface in both weights, which takes as long as measuring all of a sheet."""
    for weight in ("normal", "bold"):
        measure_text("0", SMALL, weight)


def wrap(text: str, size: float, width: float, weight: str = "normal") -> list[str]:
    """
    Break a text into lines no wider than ``width`` [inch]: between its parts if it can be.

    No line ends between a number and its unit.
    """
    lines: list[str] = []
    for line, length in _join(text.split(" · "), " · ", size, width, weight):
        if length <= width:
            lines.append(line)
        else:
            pieces = _join(keep_units(line).split(" "), " ", size, width, weight)
            lines += [piece.replace("\N{NO-BREAK SPACE}", " ") for piece, _ in pieces]
    return [line for line in lines if line]


def _join(
    pieces: list[str], joint: str, size: float, width: float, weight: str
) -> Iterator[tuple[str, float]]:
    """Join pieces into lines, with their lengths, as they fit; cut a word that is too long."""
    line, length, gap = "", 0.0, measure_text(joint, size, weight)
    for piece in pieces:
        own = measure_text(piece, size, weight)
        if line and length + gap + own <= width:
            line, length = line + joint + piece, length + gap + own
            continue
        if line:
            yield line, length
        line, length = piece, own
        while joint == " " and length > width:
            end = len(line) - 1
            while end > 1 and measure_text(line[:end], size, weight) > width:
                end -= 1
            yield line[:end], width
            line = line[end:]
            length = measure_text(line, size, weight)
    yield line, length


NIGHT = "the sun stays below the horizon"
INK, QUIET, RULE = "#1c1c22", "#5a5a64", "#8c8c96"
# Type stays type, and the same picture is the same file.
_VECTORS: Any = {"pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "umbra"}


class _Pixels(Artist):
    """An image drawn pixel by pixel; matplotlib would resample it."""

    def __init__(self, image: NDArray[np.uint8], position: tuple[int, int]) -> None:
        super().__init__()
        self.place = position
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


class Leaf(Artist):
    """
    White paper of whole pixels, and what is drawn on it.

    Its artists take it for their figure: matplotlib's own would load axes, which takes as long as
    drawing half a picture.

    Parameters
    ----------
    width, height : float
        Inches.
    larger : float
        How much larger the type of axes and keys is than in most pictures.
    """

    def __init__(self, width: float, height: float, larger: float = 1.0) -> None:
        super().__init__()
        self.width, self.height, self.larger = width, height, larger
        self.artists: list[Artist] = []
        self.dpi: float = DOTS_PER_INCH
        self.dpi_scale_trans = Affine2D().scale(self.dpi)
        self.bbox = TransformedBbox(Bbox.from_bounds(0, 0, width, height), self.dpi_scale_trans)

    def get_figure(self, root: bool = False) -> Any:
        """Return itself, whose resolution its artists ask for."""
        return self

    def get_children(self) -> list[Artist]:
        """Return the artists."""
        return self.artists

    def add(self, artist: Artist) -> None:
        """Add an artist."""
        artist.set_figure(self)  # type: ignore[arg-type]
        self.artists.append(artist)

    def draw(self, renderer: RendererBase) -> None:
        """Draw the artists, in pixels, or in points as PDF and SVG measure."""
        self.dpi = float(renderer.points_to_pixels(72))  # type: ignore[arg-type]
        self.dpi_scale_trans.clear().scale(self.dpi)
        with _pass_over_boxes():
            for artist in sorted(self.artists, key=Artist.get_zorder):
                artist.draw(renderer)

    def make_renderer(self) -> RendererAgg:
        """Return a renderer to its pixels, which are white."""
        size = (int(self.width * DOTS_PER_INCH), int(self.height * DOTS_PER_INCH))
        renderer = RendererAgg(*size, DOTS_PER_INCH)
        np.asarray(renderer.buffer_rgba())[:] = 255
        return renderer

    def render(self) -> NDArray[np.uint8]:
        """Return its pixels (rows, cols, 3), row 0 the top."""
        renderer = self.make_renderer()
        self.draw(renderer)
        return np.asarray(renderer.buffer_rgba())[..., :3]


def to_pixels(length: float) -> float:
    """Round a length up to whole pixels, so that maps lie on them [inch]."""
    return float(np.ceil(length * DOTS_PER_INCH - 1e-9) / DOTS_PER_INCH)


@dataclass(frozen=True, eq=False)
class Paper:
    """Paper with drawing methods in inches."""

    leaf: Leaf

    def write(self, x: float, y: float, text: str, size: float = SMALL, **style: object) -> Text:
        """Write one line of type at a place [inch]."""
        weight = str(style.pop("weight", "normal"))
        halo = style.pop("halo", None)
        style = {"color": INK, "ha": "left", "va": "baseline", "usetex": False, **style}
        font = find_font(size, weight, find_families(text))
        written = _Letters(x, y, text, fontproperties=font, **style)  # type: ignore[arg-type]
        written.set_parse_math(False)  # a dollar in a file's name is a dollar
        written.set_transform(self.leaf.dpi_scale_trans)
        if halo is not None:
            written.set_path_effects([Stroke(linewidth=2.2, foreground=halo)])
        self.leaf.add(written)
        return written

    def rule(self, lines: list, color: object = INK, width: float = 0.6) -> LineCollection:
        """Draw polylines, each (n, 2) [inch]."""
        artist = LineCollection(
            lines, colors=color, linewidths=width, transform=self.leaf.dpi_scale_trans
        )
        artist.set_capstyle("butt")
        self.leaf.add(artist)
        return artist

    def fill(
        self, polygons: list, colors: object, edge: object = INK, width: float = 0.5
    ) -> PolyCollection:
        """Fill polygons, each (n, 2) [inch]."""
        artist = PolyCollection(
            polygons, facecolors=colors, edgecolors=edge, linewidths=width,
            transform=self.leaf.dpi_scale_trans,
        )  # fmt: skip
        self.leaf.add(artist)
        return artist

    def paste(self, image: NDArray, x: float, y: float) -> None:
        """Put an sRGB image (rows, cols, 3), in [0, 1] or uint8, its row 0 lowest."""
        if image.dtype != np.uint8:
            image = (np.clip(image, 0, 1) * 255 + 0.5).astype(np.uint8)
        position = (round(x * DOTS_PER_INCH), round(y * DOTS_PER_INCH))
        self.leaf.add(_Pixels(image, position))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Draw it all and write a PNG, a PDF or an SVG, by the path's ending."""
        ending = Path(path).suffix.lower()
        if ending in {".pdf", ".svg"}:
            _save_vectors(self.leaf, path, ending[1:])
        else:
            write_png(path, self.leaf.render(), DOTS_PER_INCH)


def _save_vectors(leaf: Leaf, path: str | os.PathLike[str], ending: str) -> None:
    """Write a PDF or an SVG."""
    undated = {"CreationDate": None} if ending == "pdf" else {"Date": None}
    with _set_vectors():
        figure = _bind(leaf)
        figure.savefig(path, format=ending, facecolor="white", metadata=undated)


def save_pages(leaves: Sequence[Leaf], path: str | os.PathLike[str], title: str = "") -> None:
    """Write a PDF of several pages."""
    from matplotlib.backends.backend_pdf import PdfPages  # noqa: PLC0415

    about: Any = {"CreationDate": None, "Title": title or None}
    with _set_vectors(), PdfPages(path, metadata=about) as pages:
        for leaf in leaves:
            pages.savefig(_bind(leaf), facecolor="white")


@contextmanager
def _set_vectors() -> Iterator[None]:
    """Set matplotlib so that type stays type, whatever a user's file says."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_VECTORS)
        yield


def _bind(leaf: Leaf) -> Any:
    """Return a figure that draws a leaf."""
    from matplotlib.figure import Figure  # noqa: PLC0415  (PNG needs none)

    class Bound(Artist):
        def draw(self, renderer: RendererBase) -> None:
            leaf.draw(renderer)

    figure = Figure(figsize=(leaf.width, leaf.height), dpi=DOTS_PER_INCH)
    figure.add_artist(Bound())
    return figure


@dataclass(frozen=True, eq=False)
class PaperPicture:
    """A picture, to be written to a file or shown in a notebook."""

    paper: Paper

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a PNG, an SVG or a PDF, by the path's ending."""
        self.paper.save(path)

    def _repr_png_(self) -> bytes:
        """Show it in a notebook."""
        import io  # noqa: PLC0415

        from PIL import Image  # noqa: PLC0415

        file = io.BytesIO()
        Image.fromarray(self.paper.leaf.render()).save(file, "png")
        return file.getvalue()


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
        artist.set_clip_path(Rectangle((x, y), w, h, transform=self.leaf.dpi_scale_trans))

    def write_over(self, reason: str) -> None:
        """Write the reason for an empty map across it."""
        x, y, w, h = self.map_box
        style = {"color": INK, "halo": "#ffffffd8", "ha": "center", "va": "center"}
        self.write(x + w / 2, y + h / 2, reason, 9.0, **style)
