"""The table of named areas in a study's folder."""

from typing import Any

from umbra.sun.clock import Stamps
from umbra.writers.folder import FolderJob
from umbra.writers.tables import write_table

__all__ = ["AREAS", "write_area_table"]

AREAS = "areas.csv"


def write_area_table(job: FolderJob) -> list[str]:
    """
    Write a line for each named area and date, if there are areas; return the names of the files.

    Shares are fractions of 1; instants are of the local clock, with their offset.
    """
    table = job.study.areas
    if table is None:
        return []
    for note in table.notes:
        job.say(f"note: {note}")
    columns = ["name", "date", *table.columns]
    zone = "UTC" if job.study.site is None else job.study.site.zone

    def tell(value: Any) -> object:
        if value is None or value != value:  # noqa: PLR0124  (NaN and NaT)
            return ""
        if hasattr(value, "dtype") and value.dtype.kind == "M":
            (local,) = Stamps(stamps=value.astype("datetime64[us]").reshape(1), zone=zone).local()
            return local.isoformat(timespec="seconds")
        return f"{value:.6g}" if hasattr(value, "dtype") else str(value)

    rows = [[tell(row[column]) for column in columns] for row in table.list_rows()]
    write_table(job.folder / AREAS, columns, rows)
    return [AREAS]
