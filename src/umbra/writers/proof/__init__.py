"""
The sheet of a proof: ``proof.html``, ``proof.pdf``, ``verdicts.csv`` and ``conditions.csv``.

``rows.py`` words verdicts; ``drawing.py`` collects the plan, which ``pen.py`` draws, its labels by
``labels.py``; ``paper_sheets.py`` lays pages out: ``column.py`` what stands beside the plan,
``book.py`` the title block, ``flow.py`` tables; ``html_page.py`` makes HTML.
"""

import io
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.rules.words import STANDINGS
from umbra.verdicts.judge import RuleVerdict
from umbra.verdicts.judged_receivers import Gathered
from umbra.writers.csv_tables import write_table
from umbra.writers.paper import Paper, save_pages
from umbra.writers.proof.book import SIZES, Titles
from umbra.writers.proof.column import Brief
from umbra.writers.proof.drawing import make_drawing
from umbra.writers.proof.flow import TableOf
from umbra.writers.proof.html_page import make_sheet_page
from umbra.writers.proof.paper_sheets import draw_sheets, today
from umbra.writers.proof.rows import (
    COLUMNS,
    SHOWN,
    list_brief,
    list_conditions_of,
    list_rows,
    list_shown,
    tell_reason,
    tell_rule,
)

__all__ = ["FILES", "SIZES", "ProofSheet", "write_proof"]

FILES = ("proof.html", "proof.pdf", "verdicts.csv", "conditions.csv")
_MOST_ROWS = 400  # of a table on paper


@dataclass(frozen=True, kw_only=True)
class ProofSheet:
    """
    What a sheet says besides its verdicts.

    Parameters
    ----------
    title, project, author, number : str
    logo : (rows, cols, 4) uint8, optional
    paper : {'a3', 'a4'}
    basis : tuple of (str, str)
        Facts for the first page.
    facts : tuple of (str, str)
        Assumptions and files.
    """

    title: str
    project: str = ""
    author: str = ""
    number: str = ""
    logo: NDArray[np.uint8] | None = None
    paper: str = "a3"
    basis: tuple[tuple[str, str], ...] = ()
    facts: tuple[tuple[str, str], ...] = ()


def write_proof(
    folder: Path, gathered: Gathered, verdicts: Sequence[RuleVerdict], sheet: ProofSheet
) -> list[str]:
    """
    Write the files of a proof into a folder.

    Parameters
    ----------
    folder : Path
    gathered : Gathered
        The model and what was judged of it.
    verdicts : sequence of RuleVerdict
    sheet : ProofSheet

    Returns
    -------
    names : list of str
    """
    zone = gathered.model.site.zone
    image = sheet.logo
    titles = Titles(
        title=sheet.title, project=sheet.project, author=sheet.author, number=sheet.number,
        date=today(), logo=image,
    )  # fmt: skip
    sentences = [(verdict.verdict, tell_rule(verdict)) for verdict in verdicts]
    tables = [_make_table(verdict, zone) for verdict in verdicts]
    facts = [*_list_sources(verdicts), *sheet.facts]
    drawing = make_drawing(gathered, verdicts)
    on_paper = [_cut(table) for table in tables]
    briefs = [Brief(_name_rule(verdict), verdict.verdict, tell_reason(verdict), list_brief(verdict))
              for verdict in verdicts]  # fmt: skip
    sheets = draw_sheets(
        sheet.paper, titles, briefs, drawing, on_paper, sheet.basis, facts,
        gathered.model.site.true_north,
    )  # fmt: skip
    save_pages(sheets.leaves, folder / "proof.pdf", sheet.title)
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "plan.svg"
        Paper(sheets.plan).save(path)
        picture = path.read_bytes()
    logo = None
    if image is not None:
        from PIL import Image  # noqa: PLC0415

        file = io.BytesIO()  # rewritten, without the other contents of the file
        Image.fromarray(image).save(file, "png")
        logo = file.getvalue()
    caption = "Plan: what is judged, by verdict, the proposal, and the lines of equal hours"
    page = make_sheet_page(titles, sentences, picture, caption, tables, facts, logo)
    (folder / "proof.html").write_text(page, encoding="utf-8")
    write_table(folder / "verdicts.csv", COLUMNS, list_rows(verdicts, zone))
    write_table(folder / "conditions.csv", COLUMNS, list_conditions_of(verdicts, zone))
    return list(FILES)


def _name_rule(verdict: RuleVerdict) -> str:
    """Return a rule's title with its variants."""
    variants = {name for finding in verdict.findings for name in finding.variants}
    chosen = f", {' or '.join(sorted(variants))}" if 0 < len(variants) <= 3 else ""
    if len(variants) > 3:
        chosen = f", {len(variants)} variants"
    return f"{verdict.rule.title}{chosen}"


def _make_table(verdict: RuleVerdict, zone: str) -> TableOf:
    rule = verdict.rule
    wanted = dict.fromkeys(finding.outcome.wanted for finding in verdict.findings)
    counted = dict.fromkeys(
        finding.outcome.counted for finding in verdict.findings if finding.outcome.counted
    )
    remark = (
        f"{rule.edition}; {rule.standing}: {STANDINGS[rule.standing]}. Asked: {'; '.join(wanted)}."
        + (f" Counted: {'; '.join(counted)}." if counted else "")
    )
    rows = list_shown(verdict, zone)
    filled = [k for k in range(len(SHOWN)) if any(row[k] for row in rows)]
    return TableOf(
        _name_rule(verdict), remark, tuple(SHOWN[k] for k in filled),
        [tuple(row[k] for k in filled) for row in rows],
    )  # fmt: skip


def _cut(table: TableOf) -> TableOf:
    """Cut a table that no paper should hold whole."""
    if len(table.rows) <= _MOST_ROWS:
        return table
    left = f"{len(table.rows) - _MOST_ROWS:,} more lines are in verdicts.csv. {table.remark}"
    return replace(table, rows=table.rows[:_MOST_ROWS], remark=left)


def _list_sources(verdicts: Sequence[RuleVerdict]) -> list[tuple[str, str]]:
    """Return a fact of each rule: its source and standing, what to check and what was assumed."""
    sources = []
    for verdict in verdicts:
        rule = verdict.rule
        lines = [
            f"{rule.edition}. Source: {rule.source}."
            + (f" Read {rule.read}." if rule.read else ""),
            f"Standing: {rule.standing}, {STANDINGS[rule.standing]}.",
        ]
        if rule.first_hand:
            lines.append(f"At first hand: {rule.first_hand}. From others: {rule.second_hand}.")
        if rule.before_use:
            lines.append(f"Check before use: {rule.before_use}")
        lines += [f"- {note}" for note in (*rule.notes, *verdict.notes)]
        sources.append((f"rule {rule.name}", "\n".join(lines)))
    return sources
