"""Hours of sun by month: a table, and twelve small maps on one scale."""

import calendar
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import show_count
from umbra.study import Study
from umbra.writers.csv_tables import write_table
from umbra.writers.folder import FolderJob
from umbra.writers.folder.loss_maps import fit_hours
from umbra.writers.folder.shown_window import crop_dates
from umbra.writers.picture_content import DayMap, Plan, Show, name_hours

__all__ = [
    "BY_MONTH", "MONTHS", "MONTHS_MAP", "draw_months", "lay_out_months", "list_months",
    "make_month_row", "write_month_rows", "write_month_table",
]  # fmt: skip

BY_MONTH = "shadow_hours_by_month"
"""Variable of the hours in shadow a day in each month."""
MONTHS, MONTHS_MAP = "months.csv", "months.png"


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
        own = sun[counted.which]
        figures = counted.average(sun), float(own.min()), float(own.max())
        rows.append(make_month_row(number, int(dates[k]), float(up[k]), figures))
    return rows


def make_month_row(
    number: int, dates: int, up_hours: float, figures: tuple[float, float, float]
) -> dict[str, Any]:
    """Return the row of a month, of the mean, the least and the most hours of sun a day."""
    mean, least, most = figures
    return {
        "month": number, "dates": dates, "up_hours": up_hours, "mean_sun_hours": mean,
        "least_sun_hours": least, "most_sun_hours": most,
        "share_of_possible": mean / up_hours if up_hours > 0 else float("nan"),
    }  # fmt: skip


def write_month_table(job: FolderJob) -> list[str]:
    """Write a line for each month, if there are several; return the names of the files."""
    rows = list_months(job.study) if job.study.has_hours else []
    return write_month_rows(job.folder, rows)


def write_month_rows(folder: Path, rows: Sequence[dict[str, Any]]) -> list[str]:
    """Write a line for each month, if there are any; return the names of the files."""
    if not rows:
        return []
    told = [[_tell(value) for value in row.values()] for row in rows]
    write_table(folder / MONTHS, list(rows[0]), told)
    return [MONTHS]


def _tell(value: float) -> str:
    return "" if value != value else f"{value:.6g}"  # noqa: PLR0124  (NaN)


def draw_months(job: FolderJob, plan: Plan) -> list[str]:
    """Draw the hours a day of each month on one scale; return the names of the files."""
    more, show = job.study.more, job.show
    month, dates, up = (more[name][1] for name in ("month", "dates_by_month", "up_hours_by_month"))
    every = [fit_hours(hours, plan.shape) for hours in more[BY_MONTH][1]]
    plan, every = crop_dates(job, plan, every, every)

    def read(k: int, lack: np.float32) -> NDArray[np.float32]:
        return every[k] + lack

    maps, most, what = lay_out_months(month, dates, up, read, show)
    job.painter.draw_hours(job.folder / MONTHS_MAP, plan, maps, most, what=what, show=show)
    return [MONTHS_MAP]


def lay_out_months(
    month: NDArray[np.int32], dates: NDArray[np.int32], up: NDArray[np.float64],
    read: Callable[[int, np.float32], NDArray[np.float32]], show: Show,
) -> tuple[list[DayMap], float, str]:  # fmt: skip
    """
    Return a map of each month, the end of their scale, and its name.

    ``read`` returns the hours in shadow of the k-th month, raised by a constant.
    """
    most = float(up.max())
    maps = []
    for k, number in enumerate(month.tolist()):
        own = float(up[k])
        lack = np.float32(most - own if show == "sun" else 0.0)
        days = f"mean of {show_count(dates[k], 'date')}"
        maps.append(DayMap(
            read(k, lack), calendar.month_name[number], f"{days} · {own:.3g} h with the sun up",
            is_night=own <= 0, dark_from=most if show == "sun" else own,
        ))  # fmt: skip
    return maps, most, f"{name_hours(show)} a day, means of the months"
