"""The sheets of a proof on A3 or A4: verdicts and plan with a title block, then tables."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass

from umbra.sun import name_date
from umbra.writers.paper import SMALL, Leaf, Paper, measure_text
from umbra.writers.proof.book import MARGIN, SIZES, Book, Titles
from umbra.writers.proof.column import Brief, draw_column
from umbra.writers.proof.drawing import Drawing
from umbra.writers.proof.flow import Flow, TableOf
from umbra.writers.proof.key import Key, draw_key, list_key
from umbra.writers.proof.pen import draw_plan, find_scale

__all__ = ["Sheets", "draw_sheets", "today"]

_ALONE = (9.0, 7.0)  # of the plan by itself [inch]
_KEY_LINE = 0.2  # of the plan by itself [inch]


@dataclass(frozen=True, eq=False)
class Sheets:
    """Pages, of which the first has the plan, and the plan by itself with its key."""

    leaves: list[Leaf]
    plan: Leaf


def draw_sheets(
    paper: str,
    titles: Titles,
    briefs: Sequence[Brief],
    drawing: Drawing,
    tables: Sequence[TableOf],
    basis: Sequence[tuple[str, str]],
    facts: Sequence[tuple[str, str]],
    true_north: float,
) -> Sheets:
    """
    Draw all pages.

    Parameters
    ----------
    paper : {'a3', 'a4'}
    titles : Titles
    briefs : sequence of Brief
        The rules in short.
    drawing : Drawing
    tables : sequence of TableOf
    basis : sequence of (str, str)
        Facts for the first page.
    facts : sequence of (str, str)
        Assumptions, sources and files: names and texts.
    true_north : float
        Azimuth of true north in the plan [degrees].
    """
    width, height = SIZES[paper]
    book = Book(paper, titles)
    first = book.turn()
    column, low = 0.34 * width - 0.3, MARGIN + book.block
    beside = (MARGIN + 0.15, low + 0.12, column - 0.3, height - MARGIN - low - 0.22)
    box = (MARGIN + column, low, width - 2 * MARGIN - column, height - MARGIN - low)
    numbered = draw_plan(first, box, drawing, true_north)
    draw_column(first, beside, briefs, list_key(drawing, numbered), basis)
    flow = Flow(book)
    for table in tables:
        flow.add_table(table)
    flow.add_facts("Assumptions, sources and files", facts)
    book.finish(find_scale(box, drawing))
    return Sheets(book.leaves, _draw_alone(drawing, true_north))


def _draw_alone(drawing: Drawing, true_north: float) -> Leaf:
    """Draw the plan by itself, its key below it."""
    width, height = _ALONE
    box = (0.05, 0.05, width - 0.1, height - 0.1)
    numbered = draw_plan(Paper(Leaf(width, height)), box, drawing, true_north)
    lines: list[list[tuple[float, Key]]] = [[]]
    x = 0.1
    for key in list_key(drawing, numbered):
        own = 0.5 + measure_text(key.words, SMALL)
        if x + own > width and lines[-1]:
            lines.append([])
            x = 0.1
        lines[-1].append((x, key))
        x += own
    below = _KEY_LINE * len(lines) + 0.1
    alone = Leaf(width, height + below)
    paper = Paper(alone)
    draw_plan(paper, (0.05, below, *box[2:]), drawing, true_north)
    for k, line in enumerate(lines):
        for x, key in line:
            draw_key(paper, x, below - 0.17 - _KEY_LINE * k, key)
    return alone


def today() -> str:
    """Return the date of the sheet."""
    return name_date(dt.datetime.now(dt.UTC).date())
