"""The report's table of named areas."""

from collections.abc import Sequence
from typing import Any

from umbra.study import Study
from umbra.study.area_table import AreaTable, name_share
from umbra.sun.clock import Stamps
from umbra.verdicts.outcome import FAIL, PASS, UNKNOWN
from umbra.writers.report.markup import Table

__all__ = ["find_worst_verdicts", "lay_out_area_table", "list_areas"]

_MOST_ROWS = 200
_FROM_BEST = (PASS, UNKNOWN, FAIL)


def find_worst_verdicts(tables: Sequence[Table]) -> dict[str, str]:
    """Return the worst verdict on each name in tables that have names and verdicts."""
    worst: dict[str, str] = {}
    for table in tables:
        if not {"name", "verdict"} <= {*table.columns}:
            continue
        name, verdict = (table.columns.index(column) for column in ("name", "verdict"))
        for row in table.rows:
            known = worst.get(str(row[name]), PASS)
            if row[verdict] in _FROM_BEST:
                worst[str(row[name])] = max(known, str(row[verdict]), key=_FROM_BEST.index)
    return worst


def list_areas(study: Study) -> Table | None:
    """Lay out each named area on each date, before and after a proposal; None without areas."""
    return lay_out_area_table(study.areas, is_on_map=study.is_plan)


def lay_out_area_table(areas: AreaTable | None, *, is_on_map: bool) -> Table | None:
    """Lay out the figures of named areas, whose rows show them on a map; None without areas."""
    if areas is None or areas.least is None:
        return None
    least = areas.least
    figures = {
        name_share(least): f"at least {least:g} h of sun [%]",
        "mean_sun_hours": "mean sun [h]",
        "least_sun_hours": "least [h]",
        "most_sun_hours": "most [h]",
        "first_sun": "first sun",
        "last_sun": "last sun",
    }
    columns = {
        f"{key}{ending}": f"{title}{words}"
        for key, title in figures.items()
        for ending, words in (("_before", ", before"), ("", ", after"))
    }
    if not areas.has_before:
        columns = figures
    rows, zone = areas.list_rows(), areas.zone
    laid_out = [
        (row["name"], str(row["date"]), areas.tell_interval(row), round(float(row["area_m2"]), 1),
         *(_show(key, row[key], zone) for key in columns))
        for row in rows[:_MOST_ROWS]
    ]  # fmt: skip
    more = (
        f" {len(rows) - _MOST_ROWS} more rows are in areas.csv." if len(rows) > _MOST_ROWS else ""
    )
    return Table(
        "Named areas",
        ("area", "date", "counted", "size [m²]", *columns.values()),
        laid_out,
        f"First and last sun are when it reaches any of an area, by the clock of {zone}.{more}",
        # Shown on the map, where there is one.
        kind="area" if is_on_map else "",
        index=[k // max(len(areas.dates), 1) for k in range(len(laid_out))],
    )


def _show(key: str, value: Any, zone: str) -> object:
    """Return a figure of the table: a percentage, hours, or a time of the local clock."""
    if value != value:  # noqa: PLR0124  (NaN and NaT)
        return "-"
    if value.dtype.kind == "M":
        (label,) = Stamps(stamps=value.astype("datetime64[us]").reshape(1), zone=zone).labels()
        return label
    return round(100 * float(value), 1) if key.startswith("share_") else round(float(value), 2)
