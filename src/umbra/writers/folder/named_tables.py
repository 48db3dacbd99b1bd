"""The tables of named areas and of windows in a study's folder."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from numpy.typing import NDArray

from umbra.receivers.kind import DIMS
from umbra.study import Study
from umbra.study.area_table import AreaTable
from umbra.study.window_table import GROUPS, list_groups, list_windows
from umbra.sun.clock import Stamps
from umbra.writers.csv_tables import find_columns, list_texts, write_table
from umbra.writers.folder import FolderJob

if TYPE_CHECKING:
    from umbra.receivers.windows import WindowReceivers

__all__ = ["AREAS", "WINDOWS", "find_window_columns", "write_area_table", "write_named_tables"]

AREAS, WINDOWS = "areas.csv", "windows.csv"


def write_named_tables(job: FolderJob) -> list[str]:
    """Write the tables of areas and windows, if there are any; return the names of the files."""
    areas = job.study.areas
    for note in () if areas is None else areas.notes:
        job.say(f"note: {note}")
    return write_area_table(job.folder, areas) + write_window_tables(job)


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


def write_area_table(folder: Path, table: AreaTable | None) -> list[str]:
    """
    Write a line for each named area and date, if there are areas; return the names of the files.

    Shares are fractions of 1; instants are of the local clock, with their offset.
    """
    if table is None:
        return []

    def tell(value: Any) -> object:
        if value is None or value != value:  # noqa: PLR0124  (NaN and NaT)
            return ""
        if hasattr(value, "dtype") and value.dtype.kind == "M":
            stamps = value.astype("datetime64[us]").reshape(1)
            (local,) = Stamps(stamps=stamps, zone=table.zone).local()
            return local.isoformat(timespec="seconds")
        return f"{value:.6g}" if hasattr(value, "dtype") else str(value)

    entries = table.list_rows()
    columns = list(dict.fromkeys(column for row in entries for column in row))
    rows = [[tell(row[column]) for column in columns] for row in entries]
    write_table(folder / AREAS, columns, rows)
    return [AREAS]
