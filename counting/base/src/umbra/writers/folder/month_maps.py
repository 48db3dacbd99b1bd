"""Hours of sun by month: a table, and twelve small maps on one scale."""

import calendar
from typing import Any

import numpy as np

from umbra.study import Study
from umbra.writers.csv_tables import write_table
from umbra.writers.folder import FolderJob
from umbra.writers.folder.loss_maps import fit_hours
from umbra.writers.picture_content import DayMap, Plan, name_hours

__all__ = ["BY_MONTH", "MONTHS", "draw_months", "list_months", "write_month_table"]

BY_MONTH = "shadow_hours_by_month"
"""Variable of the hours in shadow a day in each month."""
MONTHS = "months.csv"


def list_months(study: Study) -> list[dict[str, Any]]:
    """
    Return a row for each month: hours a day, means of its dates, over all that is counted.

    Parameters
    ----------
    study : Study

    Returns
    -------
    rows : list of dict
        None where months are not kept. ``share_of_possible`` is a fraction of the hours that an
        open place has.
    """
    counted = study.kind.find_counted(study)
    if BY_MONTH not in study.more or counted is None or not counted.which.any():
        return []
    month, dates, up = (
        study.more[name][1] for name in ("month", "dates_by_month", "up_hours_by_month")
    )
    rows: list[dict[str, Any]] = []
    for k, number in enumerate(month.tolist()):
        sun = np.float32(up[k]) - np.asarray(study.more[BY_MONTH][1][k])
        own, mean = sun[counted.which], counted.average(sun)
        rows.append({
            "month": number, "dates": int(dates[k]), "up_hours": float(up[k]),
            "mean_sun_hours": mean, "least_sun_hours": float(own.min()),
            "most_sun_hours": float(own.max()),
            "share_of_possible": mean / float(up[k]) if up[k] > 0 else float("nan"),
        })  # fmt: skip
    return rows


def write_month_table(job: FolderJob) -> list[str]:
    """Write a line for each month, if there are several; return the names of the files."""
    rows = list_months(job.study) if job.study.has_hours else []
    if not rows:
        return []
    told = [[_tell(value) for value in row.values()] for row in rows]
    write_table(job.folder / MONTHS, list(rows[0]), told)
    return [MONTHS]


def _tell(value: float) -> str:
    return "" if value != value else f"{value:.6g}"  # noqa: PLR0124  (NaN)


def draw_months(job: FolderJob, plan: Plan) -> list[str]:
    """Draw the hours a day of each month on one scale; return the names of the files."""
    more, show = job.study.more, job.show
    month, dates, up = (more[name][1] for name in ("month", "dates_by_month", "up_hours_by_month"))
    most = float(up.max())
    maps = []
    for k, number in enumerate(month.tolist()):
        own = float(up[k])
        lack = np.float32(most - own if show == "sun" else 0.0)
        days = f"mean of {dates[k]} date{'' if dates[k] == 1 else 's'}"
        maps.append(DayMap(
            fit_hours(more[BY_MONTH][1][k] + lack, plan.shape), calendar.month_name[number],
            f"{days} · {own:.3g} h with the sun up", is_night=own <= 0,
            dark_from=most if show == "sun" else own,
        ))  # fmt: skip
    what = f"{name_hours(show)} a day, means of the months"
    job.painter.draw_hours(job.folder / "months.png", plan, maps, most, what=what, show=show)
    return ["months.png"]
