"""The proof as one page of HTML: no script, no address, all words escaped."""

import base64
import html
from collections.abc import Sequence

from umbra.writers.proof.book import Titles
from umbra.writers.proof.flow import TableOf
from umbra.writers.units import keep_units

__all__ = ["make_sheet_page"]

_SHORT = 20  # letters of a cell that is not broken
_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1c1c22; margin: 0 auto; max-width: 70rem;
  padding: 1.5rem; }
header { border-bottom: 2px solid #1c1c22; margin-bottom: 1rem; }
h1 { font-size: 1.5rem; margin: 0 0 .2rem; } h2 { font-size: 1.1rem; margin: 2rem 0 .2rem; }
header dl { display: flex; flex-wrap: wrap; gap: .2rem 1.5rem; margin: .3rem 0 .8rem; }
header dl div { display: flex; gap: .4rem; }
header dt, .remark, figcaption { color: #5a5a64; }
header dd { margin: 0; }
header img { max-height: 4rem; max-width: 14rem; float: right; margin-left: 1rem; }
header h1, header dd, td { overflow-wrap: anywhere; } td.short { white-space: nowrap; }
ul.verdicts { list-style: none; padding: 0; }
ul.verdicts li { border-left: 6px solid #6a6a74; padding: .15rem .8rem; margin: .6rem 0; }
ul.verdicts li.pass { border-color: #1f7a60; } ul.verdicts li.fail { border-color: #c23a1a; }
figure { margin: 1rem 0; } figure img { width: 100%; border: 1px solid #d0d0d6; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th, td { text-align: left; padding: .25rem .7rem .25rem 0; border-bottom: 1px solid #e2e2e6;
  vertical-align: top; }
th { color: #5a5a64; font-weight: normal; border-color: #8c8c96; white-space: nowrap; }
td.pass { color: #1f7a60; font-weight: 600; }
td.fail { color: #c23a1a; font-weight: 600; }
td.unknown { color: #6a6a74; font-weight: 600; }
dl.facts { display: grid; grid-template-columns: minmax(8rem, 14rem) 1fr; gap: .3rem 1rem; }
dl.facts dt { color: #5a5a64; }
dl.facts dd { margin: 0; overflow-wrap: anywhere; white-space: pre-line; }
@page { size: landscape; margin: 12mm; }
@media print { body { max-width: none; padding: 0; font-size: 9pt; }
  /* A box that scrolls is one piece, in which no heading stands again. */
  .wide { overflow: visible; } thead { display: table-header-group; }
  tr, li, figure, dl.facts dt { break-inside: avoid; } h2, .remark { break-after: avoid; }
  figure img { max-height: 125mm; object-fit: contain; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
@media (max-width: 40rem) { dl.facts { grid-template-columns: 1fr; } }
"""


def make_sheet_page(
    titles: Titles,
    sentences: Sequence[tuple[str, str]],
    picture: bytes,
    caption: str,
    tables: Sequence[TableOf],
    facts: Sequence[tuple[str, str]],
    logo: bytes | None,
) -> str:
    """Return the page; ``picture`` is an SVG, the logo a PNG."""
    shown = html.escape
    mark = "" if logo is None else f'<img alt="" src="data:image/png;base64,{_encode(logo)}">'
    block = "".join(
        f"<div><dt>{name}</dt><dd>{shown(text)}</dd></div>"
        for name, text in (
            ("project", titles.project), ("author", titles.author), ("number", titles.number),
            ("date", titles.date),
        )
        if text
    )  # fmt: skip
    verdicts = "".join(
        f'<li class="{verdict}">{shown(keep_units(sentence))}</li>'
        for verdict, sentence in sentences
    )
    listed = "".join(f"<dt>{shown(name)}</dt><dd>{shown(text)}</dd>" for name, text in facts)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'">
<title>{shown(titles.title)}</title><style>{_STYLE}</style></head><body>
<header>{mark}<h1>{shown(titles.title)}</h1><dl>{block}</dl></header>
<main><ul class="verdicts">{verdicts}</ul>
<figure><img alt="{shown(caption)}" src="data:image/svg+xml;base64,{_encode(picture)}">
<figcaption>{shown(caption)}</figcaption></figure>
{"".join(_make_table(table) for table in tables)}
<h2>Assumptions, sources and files</h2><dl class="facts">{listed}</dl></main></body></html>
"""


def _encode(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _make_table(table: TableOf) -> str:
    verdict = list(table.columns).index("verdict")

    def cell(k: int, text: str) -> str:
        word = "short" if len(text) <= _SHORT else ""
        if k == verdict and text in {"pass", "fail", "unknown"}:
            word = text
        return f'<td class="{word}">{html.escape(text)}</td>'

    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in table.columns)
    rows = "".join(
        "<tr>" + "".join(cell(k, text) for k, text in enumerate(row)) + "</tr>"
        for row in table.rows
    )
    return (
        f"<h2>{html.escape(table.heading)}</h2>"
        f'<p class="remark">{html.escape(keep_units(table.remark))}</p>'
        f'<div class="wide"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )
