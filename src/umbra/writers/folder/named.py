"""The tables of named areas and of windows in a study's folder."""

from typing import TYPE_CHECKING, Any, cast

from numpy.typing import NDArray

from umbra.receivers.kind import DIMS
from umbra.study import Study
from umbra.study.window_table import GROUPS, list_groups, list_windows
from umbra.sun.clock import Stamps
from umbra.writers.folder import FolderJob
from umbra.writers.tables import find_columns, list_texts, write_table

if TYPE_CHECKING:
    from umbra.receivers.windows import WindowReceivers

__all__ = ["AREAS", "WINDOWS", "find_window_columns", "write_named_tables"]

AREAS, WINDOWS = "areas.csv", "windows.csv"


def write_named_tables(job: FolderJob) -> list[str]:
    """Write the tables of areas and windows, if there are any; return the names of the files."""
    return write_area_table(job) + write_window_tables(job)


def find_window_columns(study: Study) -> dict[str, NDArray[Any]]:
    """Return the columns of ``windows.csv``, a row for each window."""
    return list_windows(study, find_columns(study, DIMS, ("sun_hours", "shadow_hours")))


def write_window_tables(job: FolderJob) -> list[str]:
    """Write a line for each window, and for each storey, flat and room that is known."""
    study = job.study
    if study.kind.own_table != WINDOWS:
        return []
    for note in cast("WindowReceivers", study.laid).notes:
        job.say(f"note: {note}")
    table = find_window_columns(study)
    tables = {WINDOWS: table}
    for by in GROUPS:
        grouped = list_groups(table, by)
        if grouped is not None:
            tables[f"windows_by_{by}.csv"] = grouped
    for name, columns in tables.items():
        texts = [list_texts(values) for values in columns.values()]
        write_table(job.folder / name, list(columns), zip(*texts, strict=True))
    return list(tables)


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
    zone = "UTC" if job.study.site is None else job.study.site.zone

    def tell(value: Any) -> object:
        if value is None or value != value:  # noqa: PLR0124  (NaN and NaT)
            return ""
        if hasattr(value, "dtype") and value.dtype.kind == "M":
            (local,) = Stamps(stamps=value.astype("datetime64[us]").reshape(1), zone=zone).local()
            return local.isoformat(timespec="seconds")
        return f"{value:.6g}" if hasattr(value, "dtype") else str(value)

    found = table.list_rows()
    columns = list(dict.fromkeys(column for row in found for column in row))
    rows = [[tell(row[column]) for column in columns] for row in found]
    write_table(job.folder / AREAS, columns, rows)
    return [AREAS]
