"""Tables, figures and pictures as HTML, words escaped."""

import base64
import html
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from umbra.writers.units import keep_units

__all__ = [
    "Pin",
    "Table",
    "make_address",
    "make_answers",
    "make_facts",
    "make_notice",
    "make_sheets",
    "make_summary",
    "make_table",
]


@dataclass(frozen=True)
class Pin:
    """A place that is marked on a plan, in the model's own coordinates [m]."""

    name: str
    x: float
    y: float
    passes: bool
    standing: str = ""  # what it lies in, under or on, if anything


@dataclass(frozen=True)
class Table:
    """Rows under named columns."""

    title: str
    columns: Sequence[str]  # with their units: "sun [h]"
    # numbers or text, None for no value; cells that begin with pass or fail are marked
    rows: Sequence[Sequence[object]]
    note: str = ""
    # shown in the picture by a click on a row: a part, surface, point, or the place of a pin
    kind: str = ""
    index: Sequence[int | None] = ()  # of that, for each row; None where a row shows nothing
    link: int = 0  # the column that is clicked
    pins: Sequence[Pin] = ()  # marked on a plan
    answer: str = ""  # of verdicts, in a sentence; default: the title
    sheets: Sequence[str] = ()  # the pictures above it, by the names of their files without ending


_FIRST = 2  # sentences above the map
_MANY = 6  # columns that fit beside each other on a phone
_VERY_MANY = 9  # on paper
_NARROW, _LONG = 4, 12  # columns of a table that fits twice beside itself on paper, if it is long
_BROAD = 2.4  # width of a picture to its height, of which two and a tall one fit on a page
_SHORT, _NAME = 14, 32  # letters of a cell that is not broken: a date; a name in the first column


def make_address(png: bytes) -> str:
    """Return a picture as a data URL."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def make_summary(figures: Sequence[tuple[str, str]]) -> str:
    """Return the figures at the top."""
    cells = "".join(
        f"<div><dt>{html.escape(name)}</dt><dd>{_escape(value)}</dd></div>"
        for name, value in figures
    )
    return f'<dl class="summary">{cells}</dl>'


def make_answers(verdicts: Sequence[Table], answers: Sequence[str]) -> tuple[str, str]:
    """
    Return the sentences of a page: outcomes of verdicts, then answers.

    They are so many as leave room for the map on a first screen, and the others.
    """
    outcomes = [(table.answer or table.title, _find_outcome(table)) for table in verdicts]
    lines = [
        f'<p class="{f"answer {outcome}".strip()}">{_escape(words)}</p>'
        for words, outcome in [*outcomes, *((words, "") for words in answers)]
    ]
    return "\n".join(lines[:_FIRST]), "\n".join(lines[_FIRST:])


def _escape(words: str) -> str:
    """Return words for reading, escaped, in which no line ends before a unit."""
    return html.escape(keep_units(words))


def _find_outcome(table: Table) -> str:
    """Return fail if a row fails, pass if some pass and none is unknown, else nothing."""
    words = {str(cell).partition(" ")[0].strip(":,") for row in table.rows for cell in row}
    if "fail" in words:
        return "fail"
    return "pass" if "pass" in words and "unknown" not in words else ""


def make_facts(facts: Sequence[tuple[str, str]]) -> str:
    """Return headings with their texts."""
    return "\n".join(
        f'<tr><th scope="row">{html.escape(name)}</th><td>{html.escape(words)}</td></tr>'
        for name, words in facts
    )


def make_notice(words: str) -> str:
    """Return an important notice; nothing without words."""
    return f'<p class="notice">{_escape(words)}</p>' if words else ""


def make_sheets(sheets: Sequence[tuple[str, Path]]) -> str:
    """Return pictures with their captions as alternative texts; nothing without pictures."""
    if not sheets:
        return ""
    return f'<section aria-label="Sheets">\n<h2>Sheets</h2>\n{_make_figures(sheets)}\n</section>'


def _make_figures(sheets: Sequence[tuple[str, Path]]) -> str:
    figures = "\n".join(_make_figure(caption, path.read_bytes()) for caption, path in sheets)
    return f'<div class="figures-list">{figures}</div>' if sheets else ""


def _make_figure(caption: str, png: bytes) -> str:
    width, height = struct.unpack(">II", png[16:24])  # of its header
    broad = ' class="broad"' if width > _BROAD * height else ""
    return (
        f'<figure{broad}>{_begin_wide(caption)}<img src="{make_address(png)}" '
        f'alt="{html.escape(caption)}"></div></figure>'
    )


def make_table(table: Table, sheets: Sequence[tuple[str, Path]] = ()) -> str:
    """Turn a table into HTML, below its pictures among ``sheets``; numbers stand to the right."""
    text = html.escape
    numeric = [_is_numeric([row[k] for row in table.rows]) for k in range(len(table.columns))]
    marks = ["number" if is_number else "" for is_number in numeric]
    places = [_count_decimals([row[k] for row in table.rows]) for k in range(len(table.columns))]

    many = len(table.columns) > _MANY

    def cell(value: object, mark: str, decimals: int) -> str:
        shown = "" if value is None else str(value)
        if isinstance(value, int | float):
            digits = decimals if isinstance(value, float) else 0
            shown = f"{value:,.{digits}f}".replace("-", "\u2212")
        word = str(value).partition(" ")[0].strip(":,") if isinstance(value, str) else ""
        mark = word if word in {"pass", "fail"} else mark
        if not mark and len(shown) <= _SHORT:
            mark = "short"
        return f'<td class="{mark}">{text(shown)}</td>' if mark else f"<td>{text(shown)}</td>"

    def line(n: int, row: Sequence[object]) -> str:
        cells = list(map(cell, row, marks, places))
        if many:
            pairs = zip(cells, table.columns, strict=True)
            cells = [td.replace("<td", f'<td data-of="{text(of)}"', 1) for td, of in pairs]
        if not table.kind or table.index[n] is None:
            return f"<tr>{''.join(cells)}</tr>"
        words = str(row[table.link])
        name = f'<button type="button" class="goto">{text(words)}</button>'
        of = f' data-of="{text(table.columns[table.link])}"' if many else ""
        short = "short" if len(words) <= _NAME else ""
        cells[table.link] = f'<td{of} class="{short}">{name}</td>'
        return f'<tr data-kind="{table.kind}" data-index="{table.index[n]}">{"".join(cells)}</tr>'

    head = "".join(
        f'<th scope="col" class="{mark}">{text(name)}</th>'
        for name, mark in zip(table.columns, marks, strict=True)
    )
    body = "\n".join(line(n, row) for n, row in enumerate(table.rows))
    note = f'<p class="quiet note">{_escape(table.note)}</p>' if table.note else ""
    figures = _make_figures([one for one in sheets if one[1].stem in table.sheets])
    marked = "many very-many" if len(table.columns) > _VERY_MANY else "many" if many else ""
    is_narrow = len(table.columns) <= _NARROW and len(table.rows) > _LONG
    return (
        f'<section class="sortable">\n<h2>{text(table.title)}</h2>\n{figures}'
        f"{_begin_wide(table.title, is_narrow=is_narrow)}"
        f'<table class="{marked}"><thead><tr>{head}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>{note}\n</section>"
    )


def _begin_wide(title: str, *, is_narrow: bool = False) -> str:
    """Begin a box that keys can scroll where it is wider than the screen."""
    of = "wide narrow" if is_narrow else "wide"
    return f'<div class="{of}" tabindex="0" role="group" aria-label="{html.escape(title)}">'


def _is_numeric(values: Sequence[object]) -> bool:
    known = [value for value in values if value is not None]
    return bool(known) and all(isinstance(value, int | float) for value in known)


def _count_decimals(values: Sequence[object]) -> int:
    """Return the decimals, at most three, that a column's numbers need."""
    numbers = [value for value in values if isinstance(value, float)]
    return next((k for k in range(3) if all(round(v, k) == v for v in numbers)), 3)
