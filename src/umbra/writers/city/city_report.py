"""The report of a city in tiles: verdicts, a map of the named areas, tables, pictures."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from umbra.folders.atomic import replace_file
from umbra.scene.named_places import Area
from umbra.study.area_table import AreaTable
from umbra.tiles.job import CityJob
from umbra.verdicts.judge import RuleVerdict
from umbra.verdicts.outcome import FAIL, PASS, UNKNOWN
from umbra.web.page import make_policy
from umbra.writers.city.city_figures import (
    find_figures,
    list_city_months,
    name_taker,
    tell_city_hours,
)
from umbra.writers.city.city_map import make_city_map
from umbra.writers.city.city_measures import lay_out_city_measures, tell_city_measures
from umbra.writers.city.city_plan import CityPlan
from umbra.writers.city.store_window import (
    CityResult,
    is_of_plan,
    list_neighbours,
    open_store,
    read_months,
)
from umbra.writers.folder.captions import name_model, name_sun, tell_times
from umbra.writers.folder.summary import tell_areas
from umbra.writers.report.area_rows import lay_out_area_table
from umbra.writers.report.markup import (
    Table,
    make_answers,
    make_facts,
    make_sheets,
    make_table,
)
from umbra.writers.report.measure_tables import caption_measures
from umbra.writers.report.tables import lay_out_month_table

__all__ = ["CityTold", "write_city_report"]

_REPORT = "report.html"
_PICTURES = {
    "map": "The whole city",
    "hours_lost": "Hours of sun lost to the proposed development",
    "months": "Hours of sun by month",
}
_WORST = {PASS: 0, UNKNOWN: 1, FAIL: 2}
_MOST_NEIGHBOURS = 500


@dataclass(frozen=True)
class CityTold:
    """
    What a run told besides its store.

    Parameters
    ----------
    job : CityJob
    facts : mapping
        Attributes of the result.
    areas : AreaTable, optional
    verdicts : sequence of RuleVerdict
    tables : sequence of Table
        Of the verdicts.
    notes : sequence of str
    """

    job: CityJob
    facts: Mapping[str, Any]
    areas: AreaTable | None = None
    verdicts: Sequence[RuleVerdict] = ()
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()


def write_city_report(folder: Path, told: CityTold) -> Path:
    """Write ``report.html``, of a folder whose pictures are drawn; return its path."""
    plan = CityPlan.of(CityResult(folder)) if is_of_plan(folder) else None
    figures, months = find_figures(folder), read_months(open_store(folder))
    counted = None if figures is None else figures.counted
    of = ""
    if counted is not None:
        of = f"Shares and means are of {counted.tell_whole()} of {counted.what}. "
    by_month = None
    if figures is not None:
        by_month = lay_out_month_table(list_city_months(figures, months), of)
    period = told.job.open().period
    areas: list[Area] = list(told.areas.areas) if told.areas is not None else []
    numbers = {area.name: k for k, area in enumerate(areas)}
    has_map = plan is not None and plan.result.has_hours
    tables = [_link(table, numbers) if has_map else table for table in told.tables]
    named = lay_out_area_table(told.areas, is_on_map=has_map)
    of_areas, of_all = tell_areas(told.areas), tell_city_hours(figures, told.job.open())
    quantities = told.job.options.quantities
    of_all += tell_city_measures(figures, quantities, name_taker(told.job.open()))
    answers = [*of_all, *of_areas] if tables else [*of_areas, *of_all]
    first, others = make_answers(tables, answers)
    measures = lay_out_city_measures(figures, quantities, of)
    shown = [*tables, named, by_month, _list_losses(folder), measures]
    style = _read("umbra.writers.report", "page.css") + _read(_HERE, "report.css")
    script = _read("umbra.writers.report", "tables.js") + _read(_HERE, "report.js")
    site, options = told.job.site, told.job.options
    city = told.job.open().catalogue
    title = name_model([Path(one.path).name for one in city.files if one.path])
    title += name_sun(period, range(len(period.days))) if period.days else ""
    parts = {
        "version": escape(str(told.facts["umbra_version"])),
        "title": escape(title),
        "date": escape(tell_times(period, options, range(len(period.days)))),
        "place": escape(f"{site.show()} · {site.zone}" if site else ""),
        "policy": escape(make_policy(style, script)),
        "style": style,
        "script": script,
        "answers": first,
        "more_answers": f'<div class="answers">{others}</div>' if others else "",
        "map": _make_map(plan, areas, told.verdicts) if plan is not None and has_map else "",
        "tables": "\n".join(make_table(table) for table in shown if table is not None),
        "sheets": make_sheets(
            [(words, folder / f"{name}.png")
             for name, words in (_PICTURES | caption_measures(quantities)).items()
             if (folder / f"{name}.png").exists()]
        ),
        "facts": make_facts(_list_facts(told, of)),
        "footer": escape(f"umbra {told.facts['umbra_version']}"),
    }  # fmt: skip
    page = re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _read(_HERE, "report.html"))
    path = folder / _REPORT
    with replace_file(path) as beside:
        beside.write_text(page, "utf-8", newline="\n")
    return path


_HERE = "umbra.writers.city"


def _read(package: str, name: str) -> str:
    return (files(package) / "assets" / name).read_text("utf-8")


def _link(table: Table, numbers: Mapping[str, int]) -> Table:
    """Return a table of verdicts whose rows show areas on the map."""
    index = [numbers.get(str(row[0])) for row in table.rows]
    return replace(table, kind="area", index=index)


def _make_map(plan: CityPlan, areas: Sequence[Area], verdicts: Sequence[RuleVerdict]) -> str:
    worst: dict[str, str] = {}
    for finding in (one for verdict in verdicts for one in verdict.findings):
        for name in finding.members or (finding.where,):
            if _WORST[finding.verdict] >= _WORST[worst.get(name, PASS)]:
                worst[name] = finding.verdict
    drawn = make_city_map(plan, areas, worst)
    return f'<section class="city-map" aria-label="Map">{drawn}</section>'


def _list_losses(folder: Path) -> Table | None:
    """Return the neighbours that lose sun to a proposal."""
    rows = list_neighbours(folder)
    if not rows:
        return None
    return Table(
        "Who loses sun",
        ("neighbour", "loses sun [m²]", "most lost [h]", "mean lost [h]"),
        [
            (one["name"], round(one["area_touched"], 1), round(one["most_hours_lost"], 2),
             round(one["mean_hours_lost"], 2))
            for one in rows[:_MOST_NEIGHBOURS]
        ],
    )  # fmt: skip


def _list_facts(told: CityTold, of: str) -> list[tuple[str, str]]:
    """Return what was assumed: headings with their texts."""
    facts, job = told.facts, told.job
    place, options = job.open(), job.options
    sun = "a disc, by the share that is seen" if options.disc else "a point source"
    casters = [f"{name}: {', '.join(getattr(options, name))}"
               for name in ("cast", "no_cast", "canopy", "proposed", "replace")
               if getattr(options, name)]  # fmt: skip
    cell = ""
    if job.lattice is not None and place.kind.is_plan:
        grid = job.lattice.grid
        cell = f"{grid.rows * grid.cols:,} cells of {grid.dx:g} m, each at its centre. "
    return [
        ("The sun", f"{sun}, by NREL's Solar Position Algorithm, refraction {options.refraction}"),
        ("Receivers", f"{facts['receivers']}. {cell}{of}".strip()),
        ("Ground", str(facts.get("assumption", facts.get("ground", "")))),
        ("Casters", "; ".join(casters) or "all parts of all files"),
        ("Tiles", f"{len(job.tiles()):,}; results are those of one study of all files"),
        ("Files", str(facts["source"])),
        *([("Notes", " · ".join(told.notes))] if told.notes else []),
    ]
