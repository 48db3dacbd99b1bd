"""Puts a study into the page: pictures and masks as base64, words escaped."""

import base64
import datetime as dt
import html
import io
import os
import re
import zlib
import zoneinfo
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
import orjson
from numpy.typing import NDArray
from PIL import Image

from umbra.study import Study
from umbra.writers.color import shade_ramp
from umbra.writers.plan import Plan, shade_roofs
from umbra.writers.report.comparison import find_comparisons
from umbra.writers.report.facts import find_facts, find_sun_areas
from umbra.writers.report.table import Table
from umbra.writers.report.timeline import Timeline, make_timeline

__all__ = ["write_report"]

_AXES = {"along": "along the view", "z": "z", "row": "row", "col": "column"}
_MICROSECONDS = 1_000_000


def write_report(
    path: str | os.PathLike[str],
    study: Study,
    plan: Plan,
    sheets: Sequence[tuple[str, Path]],
    *,
    tables: Sequence[Table] = (),
    casters: Sequence[str] = (),
    notes: Sequence[str] = (),
    timeline: Timeline | None = None,
) -> Timeline:
    """
    Write ``report.html``: one file, without network access, for any browser since 2023.

    Parameters
    ----------
    path : path
    study : Study
    plan : Plan
        Title, place and date as on the sheets.
    sheets : sequence of (caption, PNG file)
    tables : sequence of Table
        Verdicts; comparisons are found in the study itself.
    casters : sequence of str
        Patterns by which casters were chosen.
    notes : sequence of str
        On the files.
    timeline : Timeline, optional
        Where one has been counted already.

    Returns
    -------
    timeline : Timeline
        What the page shows.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    timeline = timeline or make_timeline(study)
    sun_areas = find_sun_areas(study)
    shown = [*tables, *find_comparisons(study), *([sun_areas] if sun_areas else [])]
    text = html.escape
    folder = files("umbra.writers.report")
    parts = {
        "version": text(str(study.facts["umbra_version"])),
        "title": text(plan.title),
        "date": text(plan.date),
        "place": text(plan.place),
        "style": (folder / "page.css").read_text("utf-8"),
        "script": (folder / "page.js").read_text("utf-8"),
        "summary": _make_summary(study),
        "resolution": text(_tell_resolution(study, timeline)),
        "tables": "\n".join(_make_table(table) for table in shown),
        "sheets": _make_sheets(sheets),
        "facts": "\n".join(
            f'<tr><th scope="row">{text(name)}</th><td>{text(words)}</td></tr>'
            for name, words in find_facts(study, casters, notes)
        ),
        "footer": text(plan.note),
        # No data can end the script element that holds it.
        "data": orjson.dumps(_make_data(study, plan, timeline), option=orjson.OPT_SERIALIZE_NUMPY)
        .decode()
        .replace("<", "\\u003c"),
    }
    page = (folder / "page.html").read_text("utf-8")
    # One pass: what is put in is never looked through again.
    page = re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], page)
    Path(path).write_text(page, "utf-8")
    return timeline


def _make_data(study: Study, plan: Plan, timeline: Timeline) -> dict[str, object]:
    """Gather what the script reads."""
    rows, cols = timeline.shape
    x, y = timeline.x, timeline.y
    roofs = Plan(x, y, np.nan_to_num(timeline.surface).astype(np.float32))
    dx, dy = roofs.cell
    heights = np.round(timeline.surface, 2).astype("<f4") + np.float32(0)
    return {
        "rows": rows,
        "cols": cols,
        "x0": float(x[0]),
        "y0": float(y[0]),
        "dx": dx,
        "dy": dy,
        "decimals": 0 if study.receivers == "camera" else 2 if min(dx, dy) < 0.1 else 1,
        "north": plan.true_north,
        "receivers": study.receivers,
        "axes": ["y", "x"] if study.is_plan else [_AXES.get(name, name) for name in study.dims],
        "is_plan": study.is_plan,
        "has_scale": study.receivers != "camera",
        "days": [day.isoformat() for day in study.period.days],
        "steps": _make_steps(study, timeline),
        "bits": _pack(timeline.bits.tobytes()),
        "heights": _pack(heights.tobytes()),
        "roofs": _make_roofs(roofs, timeline),
        "ramp": np.round(shade_ramp(128) * 255).astype(int).tolist(),
    }


def _make_steps(study: Study, timeline: Timeline) -> dict[str, list]:
    """Give each shown step's times [s since 1970, UTC], clock, and sun."""
    period, which = study.period, timeline.which
    begins, ends = period.starts[which], period.ends[timeline.last]
    middles = period.instants.astype("datetime64[us]").astype(np.int64)[which]
    day = period.day_of_step
    zone = zoneinfo.ZoneInfo(period.site.zone)
    local = [
        dt.datetime.fromtimestamp(t, dt.UTC).astimezone(zone)
        for t in (middles / _MICROSECONDS).tolist()
    ]
    offsets = [when.utcoffset() or dt.timedelta() for when in local]
    names = [when.tzname() or "" for when in local]
    clock = [
        name if name.isalpha() else f"UTC{when.isoformat()[-6:]}"
        for name, when in zip(names, local, strict=True)
    ]
    return {
        "start": _seconds(begins),
        "end": _seconds(ends),
        "mid": _seconds(middles),
        "day": day[which].tolist(),
        "offset": [offset.total_seconds() for offset in offsets],
        "name": clock,
        "altitude": np.round(study.sun.altitude[which], 3).tolist(),
        "azimuth": np.round(study.sun.azimuth[which], 3).tolist(),
        "up": study.sun.is_up[which].astype(int).tolist(),
    }


def _seconds(microseconds: NDArray[np.int64]) -> list[float]:
    return [t // _MICROSECONDS if t % _MICROSECONDS == 0 else t / _MICROSECONDS
            for t in microseconds.tolist()]  # fmt: skip


def _pack(data: bytes) -> str:
    return base64.b64encode(zlib.compress(data, 9)).decode()


def _make_roofs(plan: Plan, timeline: Timeline) -> str:
    """Draw roofs, or what a view sees, clear where there is nothing, as a PNG in an address."""
    if timeline.shade is None:
        grey, coverage = shade_roofs(plan, timeline.shape)
    else:
        grey, coverage = timeline.shade, np.isfinite(timeline.surface).astype(np.float32)
    pixels = np.zeros((*timeline.shape, 2), np.uint8)
    pixels[..., 0] = np.round(np.clip(grey, 0, 1) * 255)
    pixels[..., 1] = np.round(np.clip(coverage, 0, 1) * 255)
    pixels[..., 0][coverage == 0] = 0
    stream = io.BytesIO()
    Image.fromarray(pixels[::-1].copy(), "LA").save(stream, "PNG", optimize=True)
    return _address(stream.getvalue())


def _address(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _make_summary(study: Study) -> str:
    """Give the figures at the top."""
    hours = study.shadow_hours
    figures = [("sun above the horizon", _say(study.up_hours))]
    if np.isfinite(hours).any():
        is_open = np.isfinite(hours)
        what = "surfaces"
        if study.receivers == "ground":
            is_open &= study.heights <= study.ground + 1e-6
            what = "open ground"
        if is_open.any():
            figures += [
                (f"mean sun, {what}", _say(float(study.sun_hours[is_open].mean()))),
                ("never in the sun", f"{100 * (study.sun_hours[is_open] <= 1e-4).mean():.1f} %"),
                ("never in shadow", f"{100 * (hours[is_open] <= 1e-4).mean():.1f} %"),
            ]
    cells = "".join(
        f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd></div>"
        for name, value in figures
    )
    return f'<dl class="summary">{cells}</dl>'


def _say(hours: float) -> str:
    """Write hours with as many digits as one reads."""
    return f"{hours:,.0f} h" if hours >= 100 else f"{hours:.3g} h"


def _tell_resolution(study: Study, timeline: Timeline) -> str:
    rows, cols = timeline.shape
    cell = Plan(timeline.x, timeline.y).cell
    words = f"This {'plan' if study.is_plan else 'view'} shows {cols:,} x {rows:,} "
    words += "pixels" if study.receivers == "camera" else f"cells of {cell[0]:.3g} m"
    if timeline.is_study:
        words += ", those of the study itself"
    else:
        words += (
            f", counted anew at their own centres; the study has {len(study.x):,} x "
            f"{len(study.y):,} of {study.grid.dx:.3g}"
        )
    days, steps = timeline.strides
    if days > 1:
        words += (
            f". Of the study's {len(study.period.days)} days it shows one in {days}; the figures "
            "at a point are of these days"
        )
    if steps > 1:
        words += f". Of a day's steps one in {steps} is judged for all"
    return words + ". First, last and longest are those of whole steps."


def _make_sheets(sheets: Sequence[tuple[str, Path]]) -> str:
    figures = "\n".join(
        f'<figure><div class="wide"><img src="{_address(path.read_bytes())}" '
        f'alt="{html.escape(caption)}"></div></figure>'
        for caption, path in sheets
    )
    return f'<section aria-label="Sheets">\n<h2>Sheets</h2>\n{figures}\n</section>'


def _make_table(table: Table) -> str:
    """Turn a table into HTML; numbers stand to the right."""
    text = html.escape
    numeric = [
        bool(table.rows) and all(isinstance(row[k], int | float) for row in table.rows)
        for k in range(len(table.columns))
    ]
    marks = ["number" if is_number else "" for is_number in numeric]

    places = [_count_decimals([row[k] for row in table.rows]) for k in range(len(table.columns))]

    def cell(value: object, mark: str, decimals: int) -> str:
        shown = str(value)
        if isinstance(value, int | float):
            digits = decimals if isinstance(value, float) else 0
            shown = f"{value:,.{digits}f}".replace("-", "\u2212")
        word = str(value).partition(" ")[0].strip(":,") if isinstance(value, str) else ""
        mark = word if word in {"pass", "fail"} else mark
        return f'<td class="{mark}">{text(shown)}</td>' if mark else f"<td>{text(shown)}</td>"

    head = "".join(
        f'<th scope="col" class="{mark}">{text(name)}</th>'
        for name, mark in zip(table.columns, marks, strict=True)
    )
    body = "\n".join(
        "<tr>" + "".join(map(cell, row, marks, places)) + "</tr>" for row in table.rows
    )
    note = f'<p class="quiet note">{text(table.note)}</p>' if table.note else ""
    return (
        f'<section>\n<h2>{text(table.title)}</h2>\n<div class="wide"><table>'
        f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>{note}\n</section>"
    )


def _count_decimals(values: Sequence[object]) -> int:
    """Give the decimals, at most three, that a column's numbers need."""
    numbers = [value for value in values if isinstance(value, float)]
    return next((k for k in range(3) if all(round(v, k) == v for v in numbers)), 3)
