"""Tables and texts of a proof that run over pages."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from umbra.writers.paper import INK, QUIET, RULE, SMALL, Paper, measure_text, wrap
from umbra.writers.proof.book import MARGIN, Book
from umbra.writers.proof.drawing import COLORS
from umbra.writers.proof.pen import fit

__all__ = ["LINE", "Flow", "TableOf"]

LINE = 0.155
"""Between lines of small type [inch]."""
_GAP = 0.35  # between tables side by side [inch]
_FEW_ROWS = 12  # that stand in one column
_HEAD = 9.5  # size of headings
_NAMES = 2.1  # width of the names of facts [inch]


@dataclass(frozen=True)
class TableOf:
    """A table: a heading, a line below it, columns, and rows of text."""

    heading: str
    remark: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


class Flow:
    """A book's pages, filled from the top."""

    def __init__(self, book: Book) -> None:
        self.book = book
        self.y = 0.0
        self.paper: Paper | None = None
        self.left, self.room = MARGIN + 0.2, book.width - 2 * MARGIN - 0.4

    def _turn(self) -> None:
        self.paper = self.book.turn()
        self.y = self.book.height - MARGIN - 0.3

    def _need(self, room: float) -> Paper:
        if self.paper is None or self.y - room < self.book.foot:
            self._turn()
        assert self.paper is not None
        return self.paper

    def add_table(self, table: TableOf) -> None:
        """Set a table, side by side where it is narrow; its head stands again on each page."""
        widths = _find_widths(table, self.room)
        across = max(int((self.room + _GAP) / (sum(widths) + _GAP)), 1)
        across = min(across, max(-(-len(table.rows) // _FEW_ROWS), 1))
        rows = list(table.rows)
        first = True
        while rows or first:
            self._head(table, first=first)
            first = False
            rows = self._fill_page(table, rows, widths, across)
            if rows:
                self._turn()
        self.y -= 0.25

    def _fill_page(
        self, table: TableOf, rows: list[Sequence[str]], widths: Sequence[float], across: int
    ) -> list[Sequence[str]]:
        """Set as many rows as a page holds, in columns of about equal length; return the others."""
        paper = self._need(0.5)
        top, lowest = self.y, self.y
        share = -(-len(rows) // across)
        for column in range(across):
            self.y = top
            x = self.left + column * (sum(widths) + _GAP)
            if not rows:
                break
            self._columns(paper, table, x, widths)
            for _ in range(min(share, len(rows))):
                cells = [wrap(text, SMALL, w - 0.1) or [""]
                         for text, w in zip(rows[0], widths, strict=True)]  # fmt: skip
                high = LINE * max(map(len, cells)) + 0.03
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
                paper.write(x, self.y - LINE * k, line, SMALL, color=color, weight=weight)
            x += width

    def _head(self, table: TableOf, *, first: bool) -> None:
        remark = wrap(table.remark, SMALL, self.room) if first and table.remark else []
        words = table.heading if first else f"{table.heading} (continued)"
        heads = wrap(words, _HEAD, self.room, "bold")
        paper = self._need(0.7 + 0.2 * len(heads) + LINE * len(remark))
        for line in heads:
            paper.write(self.left, self.y, line, _HEAD, weight="bold")
            self.y -= 0.2
        for line in remark:
            paper.write(self.left, self.y, line, SMALL, color=QUIET)
            self.y -= LINE
        self.y -= 0.06

    def _columns(self, paper: Paper, table: TableOf, left: float, widths: Sequence[float]) -> None:
        x = left
        for name, width in zip(table.columns, widths, strict=True):
            paper.write(x, self.y, name, SMALL, color=QUIET)
            x += width
        paper.rule([np.array([(left, self.y - 0.05), (x, self.y - 0.05)])], RULE, 0.5)
        self.y -= 0.19

    def add_facts(self, heading: str, facts: Sequence[tuple[str, str]]) -> None:
        """Set names with texts; the heading stands again on each page."""
        paper = self._need(0.6)
        self._set_heading(paper, heading)
        for name, text in facts:
            room = self.room - _NAMES - 0.2
            lines = [line for part in text.split("\n") for line in wrap(part, SMALL, room)]
            names = wrap(name, SMALL, _NAMES)
            for k in range(max(len(lines), len(names))):
                if self.y - LINE < self.book.foot:
                    self._turn()
                    assert self.paper is not None
                    paper = self.paper
                    self._set_heading(paper, f"{heading} (continued)")
                    if k:  # whose they are
                        again = fit(f"{name} (continued)", SMALL, _NAMES)
                        paper.write(self.left, self.y, again, SMALL, color=QUIET)
                        names = []
                if k < len(names):
                    paper.write(self.left, self.y, names[k], SMALL, color=QUIET)
                if k < len(lines):
                    paper.write(self.left + _NAMES + 0.2, self.y, lines[k], SMALL)
                self.y -= LINE
            self.y -= 0.05

    def _set_heading(self, paper: Paper, heading: str) -> None:
        paper.write(self.left, self.y, fit(heading, _HEAD, self.room), _HEAD, weight="bold")
        self.y -= 0.25


def _find_widths(table: TableOf, room: float) -> list[float]:
    """Give each column the room of what it holds; the last at most what is left."""
    wanted = []
    for k, name in enumerate(table.columns):
        texts = [name, *(row[k] for row in table.rows)]
        weight = "bold" if name == "verdict" else "normal"
        wanted.append(max(measure_text(text, SMALL, weight) for text in {*texts}) + 0.15)
    wanted = [min(width, 2.5) for width in wanted[:-1]] + [wanted[-1]]
    return [*wanted[:-1], min(wanted[-1], max(room - sum(wanted[:-1]), 1.2))]
