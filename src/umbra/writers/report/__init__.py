"""
The report: a self-contained HTML file of a whole study, without network access.

``facts.py`` states the assumptions, ``tables.py`` and ``sample_tables.py`` lay out tables;
``data.py`` packs a raster, or surfaces and points, for the script, each instant as
``umbra.study.timeline`` counts it. ``markup.py`` writes the HTML of its parts. Here all is put
into ``assets/page.html`` with its style and script.
"""

import base64
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from importlib.resources import files
from pathlib import Path

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene import Mesh, Scene
from umbra.study import Study, split_dates, tell_dates
from umbra.study.timeline import (
    Instants,
    Timeline,
    make_point_timeline,
    make_timeline,
)
from umbra.sun.clock import say_hours
from umbra.web.bundle import bundle, read_asset
from umbra.web.pack import pack_model
from umbra.web.page import make_policy
from umbra.writers.folder.summary import find_worst
from umbra.writers.live_study import describe_sky, find_face_surfaces, make_study_config
from umbra.writers.picture_content import Plan, Show, name_hours
from umbra.writers.proof.drawing import COLORS
from umbra.writers.report.area_rows import find_worst_verdicts, list_areas
from umbra.writers.report.data import (
    make_model_data,
    make_plan_data,
    tell_model,
    tell_plan,
)
from umbra.writers.report.facts import find_facts
from umbra.writers.report.markup import (
    Table,
    make_answers,
    make_facts,
    make_notice,
    make_sheets,
    make_summary,
    make_table,
)
from umbra.writers.report.measure_tables import find_means
from umbra.writers.report.packed import tell_left_out
from umbra.writers.report.sample_tables import list_receivers
from umbra.writers.report.tables import (
    UP,
    find_comparisons,
    find_figures,
    find_sun_areas,
    list_dates,
    make_month_table,
)

__all__ = ["Table", "write_report"]

MOST_TRIANGLES = 400_000
"""Most triangles of the model of a picture; of more there is no live model."""
COMMON = ("read", "timeline", "signs")
PLAN = ("zoom", "areas", "vectors", "plan")
MODEL = ("camera", "receivers", "turn")
STAGE = ("tables", "sky", "stage", "main", "live")
_MANY = 100
"""Hours that are told without minutes."""
_WORDS = {
    "plan": {
        "picture": "The receivers of the study. Arrow keys move the point, with Shift ten cells "
        "at once; plus and minus enlarge and shrink the picture, 0 shows all of it.",
        "at": "At this point",
        "hint": "Point at the picture to read another place; click or tap to keep it. Ctrl and "
        "wheel (after a click the wheel alone), two fingers, or the keys + and - enlarge it; drag "
        "it when it is larger.",
        "views": "zoom.html",
    },
    "model": {
        "picture": "The model with its hours. Arrow keys turn it, plus and minus enlarge and "
        "shrink it.",
        "at": "At this {receiver}",
        "hint": "Drag to turn the model, with Shift to move it; Ctrl and wheel, or two fingers, "
        "enlarge it. Point at it to read a place; click or tap to keep it; a click on a line of "
        "the tables below shows where it is, with everything in front of it cut away. Grey "
        "surfaces are not sampled, or backs.",
        "views": "views.html",
    },
}


def write_report(  # noqa: PLR0913  (each part of the page by its name)
    path: str | os.PathLike[str],
    study: Study,
    plan: Plan,
    sheets: Iterable[tuple[str, Path]] = (),
    *,
    tables: Sequence[Table] = (),
    casters: Sequence[str] = (),
    notes: Sequence[str] = (),
    timeline: Timeline | None = None,
    show: Show = "shadow",
    answers: Sequence[str] = (),
    proposed: Sequence[str] = (),
    obstructing: Sequence[int] | None = None,
    fine: dict[str, object] | None = None,
    measured: Sequence[Table] = (),
) -> Instants:
    """
    Write ``report.html``: one file, without network access, for any browser since 2023.

    It begins with the outcome of the verdicts and the answers, the map that shows them, and the
    verdicts; details follow. A raster is a picture that is moved through the day; surfaces and
    points stand on a model that turns. The plan gives title, place, date and note, and of rasters
    its cells. Sheets are
    (caption, PNG file), iterated over when all else is ready; tables are verdicts, comparisons
    are found in the study itself; casters and proposed are patterns of parts, notes are the
    readers'. ``obstructing`` are the indices of the parts that obstruct the sky above a place,
    which the page draws; None: all. ``fine`` is the map of ``pack_vector_map``, ``measured`` are
    the tables of ``list_measures``. A timeline that has been counted already is taken. Returns the
    instants that the page shows.
    """
    instants: Instants
    more: list[Table] = []
    if study.kind.is_raster:
        instants = timeline or make_timeline(study)
        pins = [pin for table in tables for pin in table.pins]
        data = make_plan_data(study, plan, instants, pins, proposed) | {"fine": fine}
        data |= {"verdicts": find_worst_verdicts(tables), "verdict_colors": COLORS}
        has_own_hours = "hours" in data
        told = tell_plan(study, instants, has_own_hours)
        parts = _WORDS["plan"] | {"script": _read_scripts(PLAN)}
    else:
        instants = make_point_timeline(study)
        data = make_model_data(study, instants)
        has_own_hours = True
        told = tell_model(study, instants, data)
        parts = _WORDS["model"] | {"script": _read_scripts(MODEL)}
        parts["at"] = parts["at"].format(receiver=study.kind.spot)
        more = list_receivers(study)
    first, others = make_answers(tables, answers)
    drawn = list(sheets)
    of_measures = {name for table in measured for name in table.sheets}
    live, own = _make_live(study, plan)
    parts |= live
    parts["script"] = f"{own}\n{parts['script']}"
    parts |= {
        "resolution": escape(told),
        "left_out": make_notice(tell_left_out(study, instants, has_own_hours)),
        "sheets": make_sheets([one for one in drawn if one[1].stem not in of_measures]),
        "measures": "\n".join(make_table(table, drawn) for table in measured),
        "facts": make_facts(find_facts(study, casters, notes)),
        "answers": first,
        "more_answers": f'<div class="answers">{others}</div>' if others else "",
        "verdicts": "\n".join(make_table(table) for table in tables),
        **_name_modes(study, show, data),
    }
    data["show"] = show
    data["first_day"] = _choose_first(study)
    data["sky"] = describe_sky(study, obstructing) if live["live"] else None
    Path(path).write_text(_fill_page(study, plan, data, parts, more), "utf-8", newline="\n")
    return instants


def _choose_first(study: Study) -> str | None:
    """Return the date whose map is shown first: that of the first sentence; None for sums."""
    dates = split_dates(study)
    if len(dates) < len(study.period.days):
        return None
    return str(study.period.days[find_worst(study)])


def _make_live(study: Study, plan: Plan) -> tuple[dict[str, str], str]:
    """Return the parts of the live model, and its modules as one object; empty without one."""
    scene, surface = study.model.scene, find_face_surfaces(study, study.model.scene)
    count = sum(len(part.mesh.faces) for part in scene.parts)
    if count > MOST_TRIANGLES:
        scene, surface = _keep_largest(scene, surface)
    own = f"const kit = (() => {{\n{bundle('kit')}\nreturn $kit;\n}})();"
    try:
        block = pack_model(scene, study.site, surface, study.period.horizon)
    except InputError:  # no triangle can be drawn
        return dict.fromkeys(("live", "live_config", "live_block", "live_style"), ""), own
    config = make_study_config(study, plan.title, f"{plan.date} · {plan.place}")
    return {
        "live": _read("live.html") if count <= MOST_TRIANGLES else "",
        "live_config": orjson.dumps(config).decode().replace("<", "\\u003c"),
        "live_block": base64.b64encode(block).decode(),
        "live_style": read_asset("page.css"),
    }, own


def _keep_largest(
    scene: Scene, surface: NDArray[np.int64] | None
) -> tuple[Scene, NDArray[np.int64] | None]:
    """Keep `MOST_TRIANGLES` of a scene and their surfaces: sampled ones, then the largest."""
    soup = scene.triangles()
    corners = soup.vertices[soup.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rest = np.zeros(len(soup.faces), np.bool_) if surface is None else surface < 0
    order = np.lexsort((-np.linalg.norm(normal, axis=1), rest))
    kept = np.zeros(len(soup.faces), np.bool_)
    kept[order[:MOST_TRIANGLES]] = True
    ends = np.cumsum([0, *(len(part.mesh.faces) for part in scene.parts)])
    parts = []
    for part, first, end in zip(scene.parts, ends[:-1], ends[1:], strict=True):
        if kept[first:end].any():
            mesh = part.mesh
            own = Mesh(mesh.vertices, mesh.faces[kept[first:end]], mesh.normals)
            parts.append(replace(part, mesh=own))
    return replace(scene, parts=tuple(parts)), None if surface is None else surface[kept]


def _fill_page(
    study: Study,
    plan: Plan,
    data: dict[str, object],
    parts: dict[str, str],
    tables: Sequence[Table],
) -> str:
    """Put all into the page."""
    areas = find_sun_areas(study)
    by_date, by_month = list_dates(study), make_month_table(study)
    named = list_areas(study)
    shown = [
        *([named] if named else []),
        *tables,
        *([by_date] if by_date else []),
        *([by_month] if by_month else []),
        *find_comparisons(study),
        *([areas] if areas else []),
    ]
    style = _read("page.css") + parts["live_style"]
    parts = parts | {
        "version": escape(str(study.facts["umbra_version"])),
        "title": escape(plan.title or "Shadows"),
        "subtitle": f'<p class="lead">{escape(plan.subtitle)}</p>\n' if plan.subtitle else "",
        "date": escape(plan.date),
        "place": escape(plan.place),
        "policy": escape(make_policy(style, parts["script"])),
        "views": _read(parts["views"]),
        "style": style,
        "summary": make_summary([*_sum_up(study), *find_means(study)]),
        "tables": "\n".join(make_table(table) for table in shown),
        "footer": escape(plan.foot),
        # No data can end the script element that holds it.
        "data": orjson.dumps(data, option=orjson.OPT_SERIALIZE_NUMPY)
        .decode()
        .replace("<", "\\u003c"),
    }
    # One pass: inserted text is never searched again.
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _read("page.html"))


def _name_modes(study: Study, show: Show, data: dict[str, object]) -> dict[str, str]:
    """Return the words of the map's modes; it begins with what a proposal takes, or the hours."""
    has_losses = "lost" in data
    words = '<span>Hours lost<span id="lost-sum"></span></span>'
    lost = f'<label><input type="radio" name="mode" value="lost" checked>{words}'
    return {
        "hours": name_hours(show).capitalize(),
        "hours_first": "" if has_losses else " checked",
        "lost_mode": f"{lost}</label>\n" if has_losses else "",
        "nothing": escape(study.kind.nothing),
        "newly": f"newly under {study.facts['under_hours']:g} h" if has_losses else "",
    }


def _read(name: str) -> str:
    return (files("umbra.writers.report") / "assets" / name).read_text("utf-8")


def _read_scripts(own: Sequence[str]) -> str:
    """Join the script's files, in an order in which each knows what it uses."""
    return "\n".join(_read(f"{name}.js") for name in (*COMMON, *own, *STAGE))


def _sum_up(study: Study) -> list[tuple[str, str]]:
    """Return the figures at the top: of several dates the least and the most of one."""
    dates = split_dates(study)
    sums = f", {tell_dates(study)}" if len(dates) == 1 < len(study.period.days) else ""
    figures: dict[tuple[str, str], list[float]] = {}
    for one in dates:
        for name, value, unit in find_figures(one):
            figures.setdefault((name, unit), []).append(value)
    told = []
    for (name, unit), values in figures.items():
        low, high = min(values), max(values)
        each = [f"{v:.1f} %" if unit == "%" else _say(v) for v in (low, high)]
        words = each[0] if each[0] == each[1] else f"{each[0]} to {each[1]}"
        if name == UP and high <= 0:
            words = "never"
        told.append((name + (sums if unit == "h" else ""), words))
    counted = study.kind.find_counted(study)
    if counted is not None and counted.unit == "m²" and len(told) > 1:
        told.append((f"of {counted.what}", counted.tell_whole()))
    return told


def _say(hours: float) -> str:
    """Format hours with readable digits."""
    return f"{hours:,.0f} h" if hours >= _MANY else say_hours(hours)
