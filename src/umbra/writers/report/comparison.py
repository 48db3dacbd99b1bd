"""Before against after, whose sun is lost, and who casts the shadow, as tables."""

from dataclasses import replace

import numpy as np

from umbra.study import Study
from umbra.writers.report.markup import Table
from umbra.writers.report.tables import join_dates

__all__ = ["find_comparisons"]

_MOST_ROWS = 40
_SLACK = 1e-3  # of hours in float32 [h]


def find_comparisons(study: Study) -> list[Table]:
    """Lay out what proposed=, by= and who= have found; nothing where nothing was asked."""
    tables = (join_dates(study, make) for make in (_compare, _list_neighbours, _list_casters))
    return [table for table in tables if table is not None]


def _compare(study: Study) -> Table | None:
    counted = study.kind.find_counted(study)
    if "hours_lost" not in study.more or counted is None:
        return None
    lost = np.asarray(study.more["hours_lost"][1])
    both = replace(counted, which=counted.which & np.isfinite(lost))
    after = study.sun_hours.astype(np.float64)
    before = after + np.nan_to_num(lost)
    unit = counted.unit
    under = float(study.facts.get("under_hours", 2.0))  # type: ignore[arg-type]
    rows: list[tuple[object, ...]] = []

    if both.which.any():
        means = both.average(before), both.average(after)
        change = means[1] - means[0]
        rows.append(("mean sun [h]", *(round(v, 2) + 0.0 for v in (*means, change))))
    is_one_date = len(study.period.days) == 1
    limits = (
        (f"at least {under:g} h of sun [{unit}]", lambda sun: sun >= under - _SLACK),
        (f"less than {under:g} h of sun [{unit}]", lambda sun: sun < under - _SLACK),
    )
    for name, test in (
        *(limits if is_one_date else ()),  # a limit holds for a date, never for a sum
        (f"no sun at all [{unit}]", lambda sun: sun <= _SLACK),
        (f"no shadow at all [{unit}]", lambda sun: sun >= study.up_hours - _SLACK),
    ):
        old, new = (round(both.add_up(test(sun))) for sun in (before, after))
        rows.append((name, old, new, new - old))
    touched = round(both.add_up(np.nan_to_num(lost) > _SLACK))
    rows.append((f"loses sun [{unit}]", 0, touched, touched))
    if not is_one_date:
        newly = round(both.add_up(np.asarray(study.more["newly_under"][1]) > 0))
        rows.append((f"newly under {under:g} h on at least one date [{unit}]", 0, newly, newly))
    return Table(
        "Before and after",
        (counted.what.partition(",")[0], "before", "after", "change"),
        rows,
        f"Of the {both.whole:,.0f} {unit} that exist before and after.",
    )


def _list_neighbours(study: Study) -> Table | None:
    if "neighbour" not in study.more or not study.kind.belongs_to_parts:
        return None
    arrays = {n: np.asarray(array) for n, (_, array) in study.more.items() if "neighbour" in n}
    touched = np.flatnonzero(arrays["neighbour_area_touched"] > 0)  # on this date
    arrays = {name: array[touched] for name, array in arrays.items()}
    names = arrays["neighbour"].tolist()
    if not names:
        return None
    under = f"newly under {study.facts.get('under_hours', 2.0):g} h"
    if len(study.period.days) > 1:
        under += " on at least one date"
    where = "in this picture" if study.kind.is_raster else "here"
    columns = {
        "area [m²]": ("neighbour_area", 1),
        "loses sun [m²]": ("neighbour_area_touched", 1),
        f"{under} [m²]": ("neighbour_area_newly_under", 1),
        "most lost [h]": ("neighbour_most_hours_lost", 2),
        "mean lost [h]": ("neighbour_mean_hours_lost", 2),
    }
    rows = [
        (name, *(round(float(arrays[key][k]), digits) for key, digits in columns.values()))
        for k, name in enumerate(names[:_MOST_ROWS])
    ]
    more = f" {len(names) - _MOST_ROWS} more are in study.nc." if len(names) > _MOST_ROWS else ""
    return Table(
        "Who loses sun",
        ("neighbour", *columns),
        rows,
        f"Parts that lose the most hours over most of their area {where} come first.{more}",
    )


def _list_casters(study: Study) -> Table | None:
    counted = study.kind.find_counted(study)
    if "caster" not in study.more or counted is None:
        return None
    arrays = {n: np.asarray(study.more[n][1]) for n in ("caster", "cast_hours", "sole_hours")}
    rows = []
    what = "all points" if counted.unit == "points" else counted.what.partition(",")[0]
    for k, name in enumerate(arrays["caster"].tolist()[:_MOST_ROWS]):
        cast, sole = arrays["cast_hours"][k], arrays["sole_hours"][k]
        figures = (counted.average(cast), counted.average(sole), cast[counted.which].max())
        rows.append((name, *(round(float(v), 2) for v in figures)))
    return Table(
        "Who casts the shadow",
        ("caster", "mean cast [h]", "mean of it alone [h]", "most cast [h]"),
        rows,
        f"Over {what}. Alone: hours that would be in the sun without this caster. An hour in the "
        "shadow of several casters counts for each of them, but for none alone.",
    )
