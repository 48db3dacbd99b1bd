"""Before against after, whose sun is lost, and who casts the shadow, as tables."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.study import PointStudy, Study
from umbra.study.ledger import MASKS
from umbra.writers.report.counted import Counted, find_counted
from umbra.writers.report.table import Table

__all__ = ["find_comparisons"]

_MOST_ROWS = 40
_SLACK = 1e-3  # of hours in float32 [h]


def find_comparisons(study: Study | PointStudy) -> list[Table]:
    """
    Lay out what ``--proposed``, ``--by`` and ``--who`` have found.

    Parameters
    ----------
    study : Study or PointStudy

    Returns
    -------
    tables : list of Table
        None where nothing was asked.
    """
    # In-shadow masks are packed, and large: nothing here asks for them.
    arrays = {n: np.asarray(array) for n, (_, array) in study.more.items() if n not in MASKS}
    counted = find_counted(study)
    tables = []
    if "hours_lost" in arrays and counted is not None:
        tables.append(_compare(study, arrays["hours_lost"], counted))
    if arrays.get("neighbour", np.zeros(0)).size and study.receivers != "points":
        tables.append(_list_neighbours(study, arrays))
    if arrays.get("caster", np.zeros(0)).size and counted is not None:
        tables.append(_list_casters(arrays, counted))
    return tables


def _compare(study: Study | PointStudy, lost: NDArray[np.float32], counted: Counted) -> Table:
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
    for name, test in (
        (f"at least {under:g} h of sun [{unit}]", lambda sun: sun >= under - _SLACK),
        (f"less than {under:g} h of sun [{unit}]", lambda sun: sun < under - _SLACK),
        (f"no sun at all [{unit}]", lambda sun: sun <= _SLACK),
        (f"no shadow at all [{unit}]", lambda sun: sun >= study.up_hours - _SLACK),
    ):
        old, new = (round(both.add_up(test(sun))) for sun in (before, after))
        rows.append((name, old, new, new - old))
    touched = both.add_up(np.nan_to_num(lost) > _SLACK)
    return Table(
        "Before and after",
        (counted.what.partition(",")[0], "before", "after", "change"),
        rows,
        f"Of {both.whole:,.0f} {unit} that are there before and after; "
        f"{touched:,.0f} {unit} lose sun.",
    )


def _list_neighbours(study: Study | PointStudy, arrays: dict[str, NDArray]) -> Table:
    under = study.facts.get("under_hours", 2.0)
    names = arrays["neighbour"].tolist()
    where = "here" if isinstance(study, PointStudy) else "in this picture"
    columns = {
        "area [m²]": ("neighbour_area", 1),
        "loses sun [m²]": ("neighbour_area_touched", 1),
        f"newly under {under:g} h [m²]": ("neighbour_area_newly_under", 1),
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
        f"Those first who lose most hours over most of their area {where}.{more}",
    )


def _list_casters(arrays: dict[str, NDArray], counted: Counted) -> Table:
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
        f"Over {what}. Alone: hours that would be sun without this "
        "caster; hours that several cast count for each, but for none alone.",
    )
