"""The column beside a proof's plan: verdicts with what decides them, the key, and the basis."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from umbra.verdicts.outcome import FAIL, PASS, UNKNOWN
from umbra.writers.paper import QUIET, RULE, SMALL, Paper, measure_text, wrap
from umbra.writers.proof.drawing import COLORS, shorten
from umbra.writers.proof.flow import LINE
from umbra.writers.proof.key import Key, draw_key
from umbra.writers.proof.pen import fit, fit_name

__all__ = ["Brief", "draw_column"]

_HEAD, _RULE = 8.5, 8.5  # sizes of headings and of rules' titles
_ROWS = 0.15  # between rows of a table [inch]
_WORDS = 0.145  # between lines of a sentence [inch]
_SENTENCE = 7.5
_VERDICT = 0.55  # width of the column of verdicts [inch]
_RULED, _KEY = 0.17, 0.19  # between lines of titles, and of the key [inch]
_MOST_KEYS = 0.4  # of the column for the key
_ALL, _BAD = {PASS, FAIL, UNKNOWN}, {FAIL, UNKNOWN}


@dataclass(frozen=True)
class Brief:
    """
    A rule in short.

    Parameters
    ----------
    title, verdict, sentence : str
    rows : sequence of (name, value, limit, verdict)
        The worst first.
    """

    title: str
    verdict: str
    sentence: str
    rows: Sequence[tuple[str, str, str, str]]


def draw_column(
    paper: Paper,
    box: tuple[float, float, float, float],
    briefs: Sequence[Brief],
    keys: Sequence[Key],
    basis: Sequence[tuple[str, str]],
) -> None:
    """
    Fill a column: rules with their verdicts and as many rows as there is room, key and basis.

    Parameters
    ----------
    paper : Paper
    box : (4,) tuple
        x, y, width, height [inch].
    briefs : sequence of Brief
    keys : sequence of Key
    basis : sequence of (name, text)
        What a reader must know at once: place, dates, ground.
    """
    x, low, width, height = box
    most = max(int(_MOST_KEYS * height / _KEY), 1)
    if len(keys) > most:
        more = Key("", f"and {len(keys) - most + 1:,} more, in the tables", "")
        keys = [*keys[: most - 1], more]
    wrapped = [(name, wrap(text, SMALL, width - 0.65)[:3]) for name, text in basis]
    of_keys = 0.34 + _KEY * len(keys)
    of_basis = 0.24 + sum(LINE * len(lines) + 0.03 for _, lines in wrapped)
    # What there is no room for is on the next sheets: sentences of what passes, all, the basis.
    for worded, has_basis in ((_ALL, True), (_BAD, True), (set(), True), (set(), False)):
        below = of_keys + of_basis * has_basis
        heads = [_set(brief, width, is_worded=brief.verdict in worded) for brief in briefs]
        high = [_RULED * len(title) + _WORDS * len(lines) + 0.17 for title, lines in heads]
        room = height - below - 0.3 - sum(high)
        if room >= 0:
            break
    counts = _share_rows([len(brief.rows) for brief in briefs], int(room / _ROWS))
    y = _write_heading(paper, x, low + height - 0.05, width, "Verdicts")
    for k, (brief, (title, lines)) in enumerate(zip(briefs, heads, strict=True)):
        if y - high[k] < low + below:
            paper.write(x, y - 0.08, f"{len(briefs) - k} more rules on the next sheets", SMALL,
                        color=QUIET)  # fmt: skip
            break
        y = _write_brief(paper, x, y, width, brief, title, lines, counts[k])
    y = _write_heading(paper, x, low + below, width, "Key")
    for key in keys:
        draw_key(paper, x, y - 0.1, replace(key, words=fit_name(key.words, SMALL, width - 0.35)))
        y -= _KEY
    if has_basis:
        _write_basis(paper, x, y - 0.1, width, wrapped)


def _set(brief: Brief, width: float, *, is_worded: bool) -> tuple[list[str], list[str]]:
    """Break a rule's title and its sentence into lines."""
    room = width - _VERDICT - 0.3
    title = wrap(brief.title, _RULE, room, "bold")
    if not is_worded:
        return [fit(brief.title, _RULE, room, "bold")], []
    return title, wrap(brief.sentence, _SENTENCE, width - 0.2)


def _write_basis(
    paper: Paper, x: float, y: float, width: float, basis: Sequence[tuple[str, list[str]]]
) -> None:
    y = _write_heading(paper, x, y, width, "Basis")
    for name, lines in basis:
        paper.write(x, y - 0.1, name, SMALL, color=QUIET)
        for line in lines:
            paper.write(x + 0.6, y - 0.1, line, SMALL)
            y -= LINE
        y -= 0.03


def _share_rows(wanted: Sequence[int], room: int) -> list[int]:
    """Share rows among tables, of which each that is cut tells so in one more."""
    given, left = [0] * len(wanted), room
    for level in range(1, max(wanted, default=0) + 1):
        for k, most in enumerate(wanted):
            cost = (level != most or most == 1) + (level == 1 < most)
            if level <= most and given[k] == level - 1 and left >= cost:
                given[k], left = level, left - cost
    return given


def _write_heading(paper: Paper, x: float, y: float, width: float, text: str) -> float:
    paper.write(x, y - 0.12, text, _HEAD, weight="bold", color=QUIET)
    paper.rule([np.array([(x, y - 0.17), (x + width, y - 0.17)])], RULE, 0.5)
    return y - 0.24


def _write_brief(
    paper: Paper, x: float, y: float, width: float, brief: Brief, title: Sequence[str],
    lines: Sequence[str], count: int,
) -> float:  # fmt: skip
    """Write a rule's verdict; return the height below it."""
    color, top = COLORS[brief.verdict], y
    for line in title:
        paper.write(x + 0.14, y - 0.12, line, _RULE, weight="bold")
        y -= _RULED
    paper.write(x + width, top - 0.12, brief.verdict.upper(), _RULE, weight="bold", color=color,
                ha="right")  # fmt: skip
    for line in lines:
        paper.write(x + 0.14, y - 0.1, line, _SENTENCE)
        y -= _WORDS
    if count:
        y = _write_rows(paper, x + 0.14, y - 0.03, width - 0.14, brief, count)
    bar = np.array([(x, y), (x + 0.05, y), (x + 0.05, top - 0.01), (x, top - 0.01)])
    paper.fill([bar], color, "none")
    return y - 0.14


def _write_rows(paper: Paper, x: float, y: float, width: float, brief: Brief, count: int) -> float:
    """Write the first rows of a rule's table."""
    rows, limit_at = brief.rows[:count], x + width - _VERDICT
    limits = max(measure_text(row[2], SMALL) for row in rows) + 0.12
    values = max(measure_text(row[1], SMALL) for row in rows) + 0.12
    values = min(values, 0.5 * width)
    value_at = limit_at - limits - values
    names, room = [row[0] for row in brief.rows], value_at - x - 0.08
    if any(measure_text(name, SMALL) > room for name in names[:count]):
        own = shorten(names)  # without the words that all have
        names = names if own == names else [f"… {name.rstrip(',;')}" for name in own]
    for row, whole in zip(rows, names, strict=False):
        y -= _ROWS
        name = fit_name(whole, SMALL, room)
        for at, text in ((x, name), (value_at, fit(row[1], SMALL, values - 0.06)),
                         (limit_at - limits, row[2])):  # fmt: skip
            paper.write(at, y + 0.03, text, SMALL)
        paper.write(x + width, y + 0.03, row[3], SMALL, color=COLORS[row[3]], weight="bold",
                    ha="right")  # fmt: skip
    left = len(brief.rows) - len(rows)
    if left:
        y -= _ROWS
        paper.write(x, y + 0.03, f"and {left:,} more on the next sheets", SMALL, color=QUIET)
    return y
