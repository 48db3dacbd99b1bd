"""Pages of a proof: their frame, the title block on the first, a running foot on the others."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backend_bases import RendererBase
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from umbra.version import __version__
from umbra.writers.paper import INK, QUIET, RULE, SMALL, Leaf, Paper, measure_text, wrap
from umbra.writers.proof.pen import fit

__all__ = ["MARGIN", "SIZES", "Book", "Titles"]

SIZES = {"a3": (16.54, 11.69), "a4": (11.69, 8.27)}
"""Landscape [inch]."""
MARGIN = 0.45
"""Of a page [inch]."""
_BLOCK = {"a3": 1.2, "a4": 1.15}  # height of the title block [inch]
_PAD = 0.12  # of a cell [inch]
_TINY = 6.0  # size of the names of cells
_LOGO = 2.2  # greatest width of a logo [inch]


@dataclass(frozen=True, eq=False, kw_only=True)
class Titles:
    """What the title block says."""

    title: str
    project: str = ""
    author: str = ""
    number: str = ""
    date: str = ""
    logo: NDArray[np.uint8] | None = None


class Book:
    """
    Pages of one size.

    Parameters
    ----------
    paper : {'a3', 'a4'}
    titles : Titles
    """

    def __init__(self, paper: str, titles: Titles) -> None:
        self.width, self.height = SIZES[paper]
        self.block = _BLOCK[paper]
        self.titles = titles
        self.leaves: list[Leaf] = []

    def turn(self) -> Paper:
        """Begin a page."""
        leaf = Leaf(self.width, self.height)
        self.leaves.append(leaf)
        paper = Paper(leaf)
        x0, x1, y0, y1 = MARGIN, self.width - MARGIN, MARGIN, self.height - MARGIN
        paper.rule([np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])], RULE, 0.7)
        return paper

    @property
    def foot(self) -> float:
        """Height of the first line above the foot of a page without a block [inch]."""
        return MARGIN + 0.42

    def finish(self, scale: int) -> None:
        """Write the title block and the feet, which tell the number of pages."""
        self._draw_block(Paper(self.leaves[0]), scale)
        for k, leaf in enumerate(self.leaves[1:], 2):
            paper, y, right = Paper(leaf), MARGIN + 0.12, self.width - MARGIN - 0.15
            line = y + 0.17
            paper.rule([np.array([(MARGIN, line), (self.width - MARGIN, line)])], RULE, 0.5)
            number = f"sheet {k} of {len(self.leaves)}"
            paper.write(right, y, number, SMALL, ha="right", color=QUIET)
            titles = self.titles
            end = " · ".join(filter(None, (titles.number, titles.date)))
            room = right - MARGIN - 0.6 - measure_text(number, SMALL) - measure_text(end, SMALL)
            head = " · ".join(filter(None, (titles.title, titles.project)))
            text = " · ".join(filter(None, (fit(head, SMALL, room), end)))
            paper.write(MARGIN + 0.15, y, text, SMALL, color=QUIET)

    def _draw_block(self, paper: Paper, scale: int) -> None:
        """Draw the title block: logo, title and project, and cells with what identifies it."""
        x0, x1, y0 = MARGIN, self.width - MARGIN, MARGIN
        top = y0 + self.block
        paper.rule([np.array([(x0, top), (x1, top)])], RULE, 0.7)
        titles, x = self.titles, x0
        if titles.logo is not None:
            rows, cols = titles.logo.shape[:2]
            high = min(self.block - 2 * _PAD, _LOGO * rows / cols)
            size = (high * cols / rows, high)
            paper.leaf.add(_Logo(titles.logo, (x + _PAD, y0 + (self.block - high) / 2), size))
            x += size[0] + 2 * _PAD
            paper.rule([np.array([(x, y0), (x, top)])], RULE, 0.5)
        cells = x1 - 0.36 * (x1 - x0)
        self._write_titles(paper, x + _PAD, cells - _PAD, top, y0)
        row, half = self.block / 3, (cells + x1) / 2
        paper.rule([np.array([(cells, y0), (cells, top)])], RULE, 0.5)
        sheet = f"1 of {len(self.leaves)}"
        by_row: list[list[tuple[str, str]]] = [
            [("author", titles.author)],
            [("number", titles.number), ("date", titles.date)],
            [("scale of the plan", f"1 : {scale:,.0f}"), ("sheet", sheet)],
        ]
        for k, own in enumerate(by_row):
            high = top - k * row
            if k:
                paper.rule([np.array([(cells, high), (x1, high)])], RULE, 0.5)
            for at, end, (name, text) in zip((cells, half), (half, x1), own, strict=False):
                right = x1 if len(own) == 1 else end
                if at == half:
                    paper.rule([np.array([(half, high), (half, high - row)])], RULE, 0.5)
                paper.write(at + _PAD / 1.5, high - 0.115, name, _TINY, color=QUIET)
                paper.write(at + _PAD / 1.5, high - row + 0.085,
                            *_shrink(text, right - at - _PAD, 9.0, 6.5))  # fmt: skip

    def _write_titles(self, paper: Paper, x: float, right: float, top: float, low: float) -> None:
        """Write title and project on some lines each, smaller if need be."""
        room, y = right - x, top - 0.03
        for text, sizes, weight in (
            (self.titles.title, ((13.0, 1), (11.0, 2), (9.5, 3)), "bold"),
            (self.titles.project, ((9.5, 1), (8.0, 2)), "normal"),
        ):
            if not text:
                continue
            for size, most in sizes:
                lines = wrap(text, size, room, weight)
                if len(lines) <= most:
                    break
            else:
                lines = [*lines[: most - 1], fit(" ".join(lines[most - 1 :]), size, room, weight)]
            for line in lines:
                y -= size * 1.3 / 72
                paper.write(x, y, line, size, weight=weight, color=INK)
            y -= 0.05
        credit = f"made with umbra {__version__}; the assumptions are part of this sheet"
        paper.write(x, low + 0.08, fit(credit, _TINY, room), _TINY, color=QUIET)


def _shrink(text: str, room: float, size: float, least: float) -> tuple[str, float]:
    """Return a text and the size at which it fits; cut where none does."""
    while size > least and measure_text(text, size) > room:
        size -= 0.5
    return fit(text, size, room), size


class _Logo(Artist):
    """A picture at its own resolution, in a box [inch]; of PDF and SVG alone."""

    def __init__(
        self, image: NDArray[np.uint8], position: tuple[float, float], size: tuple[float, float]
    ) -> None:
        super().__init__()
        self.image, self.place, self.size = image[::-1], position, size

    def draw(self, renderer: RendererBase) -> None:
        leaf: Any = self.get_figure()
        x, y, *size = np.multiply((*self.place, *self.size), leaf.dpi)
        renderer.draw_image(renderer.new_gc(), x, y, self.image, Affine2D().scale(*size))
