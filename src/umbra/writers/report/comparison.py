"""Before against after, whose sun is lost, and who casts the shadow, as tables."""

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study
from umbra.writers.report.table import Table

__all__ = ["find_comparisons"]

_MOST_ROWS = 40
_SLACK = 1e-3  # of hours in float32 [h]


def find_comparisons(study: Study) -> list[Table]:
    """
    Lay out what ``--proposed``, ``--by`` and ``--who`` have found.

    Parameters
    ----------
    study : Study
        A plan.

    Returns
    -------
    tables : list of Table
        None where nothing was asked.
    """
    if not study.is_plan:
        return []
    arrays = {name: np.asarray(array) for name, (_, array) in study.more.items()}
    tables = []
    if "hours_lost" in arrays:
        tables.append(_compare(study, arrays["hours_lost"]))
    if arrays.get("neighbour", np.zeros(0)).size:
        tables.append(_list_neighbours(study, arrays))
    if arrays.get("caster", np.zeros(0)).size:
        tables.append(_list_casters(study, arrays))
    return tables


def _find_counted(study: Study) -> tuple[NDArray[np.bool_], str]:
    """Choose the cells whose hours mean something: not the ground under buildings."""
    counted = np.isfinite(study.shadow_hours)
    if study.receivers != "ground":
        return counted, "all that is seen from above"
    return counted & (study.heights <= study.ground + 1e-6), "open ground"


def _compare(study: Study, lost: NDArray[np.float32]) -> Table:
    counted, what = _find_counted(study)
    counted &= np.isfinite(lost)
    after = study.sun_hours[counted].astype(np.float64)
    before = after + lost[counted]
    area = study.grid.dx * study.grid.dy
    under = float(study.facts.get("under_hours", 2.0))  # type: ignore[arg-type]
    rows: list[tuple[object, ...]] = []

    if after.size:
        means = float(before.mean()), float(after.mean())
        change = means[1] - means[0]
        rows.append(("mean sun [h]", *(round(v, 2) + 0.0 for v in (*means, change))))
    for name, test in (
        (f"at least {under:g} h of sun [m²]", lambda sun: sun >= under - _SLACK),
        (f"less than {under:g} h of sun [m²]", lambda sun: sun < under - _SLACK),
        ("no sun at all [m²]", lambda sun: sun <= _SLACK),
        ("no shadow at all [m²]", lambda sun: sun >= study.up_hours - _SLACK),
    ):
        old, new = (round(np.count_nonzero(test(sun)) * area) for sun in (before, after))
        rows.append((name, old, new, new - old))
    return Table(
        "Before and after",
        (what, "before", "after", "change"),
        rows,
        f"Of {after.size * area:,.0f} m² that are there before and after; "
        f"{float(np.count_nonzero(lost[counted] > _SLACK) * area):,.0f} m² lose sun.",
    )


def _list_neighbours(study: Study, arrays: dict[str, NDArray]) -> Table:
    under = study.facts.get("under_hours", 2.0)
    names = arrays["neighbour"].tolist()
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
        f"Those first who lose most hours over most of their area in this plan.{more}",
    )


def _list_casters(study: Study, arrays: dict[str, NDArray]) -> Table:
    counted, what = _find_counted(study)
    rows = []
    for k, name in enumerate(arrays["caster"].tolist()[:_MOST_ROWS]):
        cast, sole = (arrays[key][k][counted] for key in ("cast_hours", "sole_hours"))
        if cast.size:
            figures = (cast.mean(), sole.mean(), cast.max())
            rows.append((name, *(round(float(v), 2) for v in figures)))
    return Table(
        "Who casts the shadow",
        ("caster", "mean cast [h]", "mean of it alone [h]", "most cast [h]"),
        rows,
        f"Over the {what}. Alone: hours that would be sun without this caster; hours that "
        "several cast count for each, but for none alone.",
    )
