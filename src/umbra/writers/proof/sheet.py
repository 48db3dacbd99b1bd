"""The sheets of a proof on A3 or A4: verdicts and plan with a title block, then tables."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.version import __version__
from umbra.writers.paper import INK, QUIET, RULE, SMALL, Leaf, Paper, measure_text, wrap
from umbra.writers.plan import DOTS_PER_INCH
from umbra.writers.proof.drawing import COLORS, Drawing
from umbra.writers.proof.pen import draw_plan, fit

__all__ = ["SIZES", "Sheets", "TableOf", "Titles", "draw_sheets"]

SIZES = {"a3": (16.54, 11.69), "a4": (11.69, 8.27)}
"""Landscape [inch]."""
_MARGIN, _BLOCK = 0.45, 0.95  # of the page; height of the title block [inch]
_LINE = 0.155  # between lines of small type [inch]
_GAP = 0.35  # between tables side by side [inch]
_FEW_ROWS = 12  # that stand in one column


@dataclass(frozen=True, eq=False, kw_only=True)
class Titles:
    """What the title block says."""

    title: str
    project: str = ""
    author: str = ""
    number: str = ""
    date: str = ""
    logo: NDArray[np.uint8] | None = None


@dataclass(frozen=True)
class TableOf:
    """A table: a heading, a line below it, columns, and rows of text."""

    heading: str
    remark: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, eq=False)
class Sheets:
    """Pages, of which the first has the plan."""

    leaves: list[Leaf]
    plan: Leaf


def draw_sheets(
    paper: str,
    titles: Titles,
    sentences: Sequence[tuple[str, str]],
    drawing: Drawing,
    tables: Sequence[TableOf],
    facts: Sequence[tuple[str, str]],
    true_north: float,
) -> Sheets:
    """
    Draw all pages.

    Parameters
    ----------
    paper : {'a3', 'a4'}
    titles : Titles
    sentences : sequence of (verdict, sentence)
    drawing : Drawing
    tables : sequence of TableOf
    facts : sequence of (str, str)
        Assumptions, sources and files: names and texts.
    true_north : float
        Azimuth of true north in the plan [degrees].
    """
    width, height = SIZES[paper]
    book = _Book(width, height, titles)
    first = book.turn()
    column = min(4.6, 0.34 * width)
    y = height - _MARGIN - 0.1
    for verdict, sentence in sentences:
        if y < _MARGIN + _BLOCK + 0.7:
            break  # the tables say the rest
        y = _write_sentence(first, _MARGIN, y, column - 0.15, verdict, sentence)
    box = (
        _MARGIN + column, _MARGIN + _BLOCK + 0.15, width - 2 * _MARGIN - column,
        height - 2 * _MARGIN - _BLOCK - 0.15,
    )  # fmt: skip
    draw_plan(first, box, drawing, true_north)
    flow = _Flow(book)
    for table in tables:
        flow.add_table(table)
    flow.add_facts(facts)
    book.number_pages()
    alone = Leaf(9.0, 7.0)
    draw_plan(Paper(alone), (0.05, 0.05, 8.9, 6.9), drawing, true_north)
    return Sheets(book.leaves, alone)


class _Book:
    """Pages with a title block each."""

    def __init__(self, width: float, height: float, titles: Titles) -> None:
        self.width, self.height, self.titles = width, height, titles
        self.leaves: list[Leaf] = []

    def turn(self) -> Paper:
        """Begin a page."""
        leaf = Leaf(self.width, self.height)
        self.leaves.append(leaf)
        paper = Paper(leaf)
        x0, x1, y0, y1 = _MARGIN, self.width - _MARGIN, _MARGIN, self.height - _MARGIN
        paper.rule([np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)])], RULE, 0.7)
        if len(self.leaves) == 1:
            self._draw_block(paper, x0, x1, y0)
        return paper

    @property
    def foot(self) -> float:
        """Height of the first line above the foot of a page without a block [inch]."""
        return _MARGIN + 0.32

    def _draw_block(self, paper: Paper, x0: float, x1: float, y0: float) -> None:
        top = y0 + _BLOCK
        paper.rule([np.array([(x0, top), (x1, top)])], RULE, 0.7)
        titles, x = self.titles, x0 + 0.15
        if titles.logo is not None:
            rows, cols = titles.logo.shape[:2]
            high = min(_BLOCK - 0.2, 2.2 * rows / cols)
            _paste_logo(paper, titles.logo, x, y0 + (_BLOCK - high) / 2, high)
            x += high * cols / rows + 0.25
        room = (x1 - x) * 0.5
        for text, size, weight, y in (
            (titles.title, 13.0, "bold", top - 0.33), (titles.project, 9.5, "normal", top - 0.58),
        ):  # fmt: skip
            if text:
                paper.write(x, y, fit(text, size, room, weight), size, weight=weight)
        left = x + room + 0.2
        rows_of = [("author", titles.author), ("number", titles.number), ("date", titles.date)]
        y = top - 0.25
        for name, text in rows_of:
            if text:
                paper.write(left, y, name, SMALL, color=QUIET)
                paper.write(left + 0.65, y, fit(text, SMALL, x1 - left - 0.8), SMALL)
                y -= 0.19
        paper.write(x0 + 0.15 if titles.logo is None else x, y0 + 0.1,
                    f"made with umbra {__version__}; the assumptions are part of this sheet",
                    SMALL, color=QUIET)  # fmt: skip

    def number_pages(self) -> None:
        """Write the number of each page, and its title."""
        for k, leaf in enumerate(self.leaves, 1):
            paper, y = Paper(leaf), _MARGIN + 0.1
            style = {"color": QUIET}
            paper.write(self.width - _MARGIN - 0.1, y, f"sheet {k} of {len(self.leaves)}", SMALL,
                        ha="right", **style)  # fmt: skip
            if k > 1:
                head = " · ".join(filter(None, (self.titles.title, self.titles.project,
                                                self.titles.number, self.titles.date)))  # fmt: skip
                paper.write(_MARGIN + 0.15, y, fit(head, SMALL, self.width - 3), SMALL, **style)


def _paste_logo(paper: Paper, logo: NDArray[np.uint8], x: float, y: float, high: float) -> None:
    """Put a logo on white, at the paper's resolution."""
    from PIL import Image  # noqa: PLC0415

    rows, cols = logo.shape[:2]
    size = (max(round(high * cols / rows * DOTS_PER_INCH), 1), max(round(high * DOTS_PER_INCH), 1))
    white = Image.new("RGBA", (cols, rows), "white")
    small = Image.alpha_composite(white, Image.fromarray(logo)).convert("RGB").resize(size)
    paper.paste(np.asarray(small)[::-1], x, y)


def _write_sentence(
    paper: Paper, x: float, y: float, room: float, verdict: str, sentence: str
) -> float:
    """Write a verdict with its colour; return the height below it."""
    lines = wrap(sentence, 9.0, room - 0.2)
    low = y - 0.18 * len(lines)
    box = np.array([(x + 0.08, low + 0.07), (x + 0.14, low + 0.07), (x + 0.14, y + 0.02),
                    (x + 0.08, y + 0.02)])  # fmt: skip
    paper.fill([box], COLORS[verdict], COLORS[verdict])
    for k, line in enumerate(lines):
        paper.write(x + 0.24, y - 0.12 - 0.18 * k, line, 9.0)
    return low - 0.14


class _Flow:
    """Tables and texts that run over pages."""

    def __init__(self, book: _Book) -> None:
        self.book = book
        self.y = 0.0
        self.paper: Paper | None = None

    def _turn(self) -> None:
        self.paper = self.book.turn()
        self.y = self.book.height - _MARGIN - 0.3

    def _need(self, room: float) -> Paper:
        if self.paper is None or self.y - room < self.book.foot:
            self._turn()
        assert self.paper is not None
        return self.paper

    def add_table(self, table: TableOf) -> None:
        """Set a table, side by side where it is narrow; its head stands again on each page."""
        left, room = _MARGIN + 0.2, self.book.width - 2 * _MARGIN - 0.4
        widths = _find_widths(table, room)
        across = max(int((room + _GAP) / (sum(widths) + _GAP)), 1)
        across = min(across, max(-(-len(table.rows) // _FEW_ROWS), 1))
        rows = list(table.rows)
        first = True
        while rows or first:
            self._head(table, left, room, first=first)
            first = False
            rows = self._fill_page(table, rows, left, widths, across)
            if rows:
                self._turn()
        self.y -= 0.25

    def _fill_page(
        self, table: TableOf, rows: list[Sequence[str]], left: float, widths: Sequence[float],
        across: int,
    ) -> list[Sequence[str]]:  # fmt: skip
        """Set as many rows as a page holds, in columns of about equal length; return the others."""
        paper = self._need(0.5)
        top, lowest = self.y, self.y
        share = -(-len(rows) // across)
        for column in range(across):
            self.y = top
            x = left + column * (sum(widths) + _GAP)
            if not rows:
                break
            self._columns(paper, table, x, widths)
            for _ in range(min(share, len(rows))):
                cells = [wrap(text, SMALL, w - 0.1) or [""]
                         for text, w in zip(rows[0], widths, strict=True)]  # fmt: skip
                high = _LINE * max(map(len, cells)) + 0.03
                if self.y - high < self.book.foot:
                    break
                self._set_row(paper, table, cells, x, widths)
                self.y -= high
                rows = rows[1:]
            lowest = min(lowest, self.y)
        self.y = lowest
        return rows

    def _set_row(
        self, paper: Paper, table: TableOf, cells: Sequence[list[str]], x: float,
        widths: Sequence[float],
    ) -> None:  # fmt: skip
        for lines, width, name in zip(cells, widths, table.columns, strict=True):
            for k, line in enumerate(lines):
                color = COLORS.get(line, INK) if name == "verdict" else INK
                weight = "bold" if name == "verdict" else "normal"
                paper.write(x, self.y - _LINE * k, line, SMALL, color=color, weight=weight)
            x += width

    def _head(self, table: TableOf, left: float, room: float, *, first: bool) -> None:
        remark = wrap(table.remark, SMALL, room) if first and table.remark else []
        paper = self._need(0.9 + _LINE * len(remark))
        words = table.heading if first else f"{table.heading} (continued)"
        paper.write(left, self.y, fit(words, 9.5, room, "bold"), 9.5, weight="bold")
        self.y -= 0.2
        for line in remark:
            paper.write(left, self.y, line, SMALL, color=QUIET)
            self.y -= _LINE
        self.y -= 0.06

    def _columns(self, paper: Paper, table: TableOf, left: float, widths: Sequence[float]) -> None:
        x = left
        for name, width in zip(table.columns, widths, strict=True):
            paper.write(x, self.y, name, SMALL, color=QUIET)
            x += width
        paper.rule([np.array([(left, self.y - 0.05), (x, self.y - 0.05)])], RULE, 0.5)
        self.y -= 0.19

    def add_facts(self, facts: Sequence[tuple[str, str]]) -> None:
        """Set names with texts."""
        left, room = _MARGIN + 0.2, self.book.width - 2 * _MARGIN - 0.4
        paper = self._need(0.6)
        paper.write(left, self.y, "Assumptions, sources and files", 9.5, weight="bold")
        self.y -= 0.25
        for name, text in facts:
            lines = [line for part in text.split("\n") for line in wrap(part, SMALL, room - 2.3)]
            names = wrap(name, SMALL, 2.1)
            for k in range(max(len(lines), len(names))):
                paper = self._need(_LINE)
                if k < len(names):
                    paper.write(left, self.y, names[k], SMALL, color=QUIET)
                if k < len(lines):
                    paper.write(left + 2.3, self.y, lines[k], SMALL)
                self.y -= _LINE
            self.y -= 0.05


def _find_widths(table: TableOf, room: float) -> list[float]:
    """Give each column the room of what it holds; the last at most what is left."""
    wanted = []
    for k, name in enumerate(table.columns):
        texts = [name, *(row[k] for row in table.rows)]
        weight = "bold" if name == "verdict" else "normal"
        wanted.append(max(measure_text(text, SMALL, weight) for text in {*texts}) + 0.15)
    wanted = [min(one, 2.5) for one in wanted[:-1]] + [wanted[-1]]
    return [*wanted[:-1], min(wanted[-1], max(room - sum(wanted[:-1]), 1.2))]


def today() -> str:
    """Return the date of the sheet."""
    return dt.datetime.now(dt.UTC).date().isoformat()
