"""The table of named areas: for each and each date the sun that it gets, before and after."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Period
from umbra.receivers.kind import Variables
from umbra.scene.named_places import Area
from umbra.sun.clock import Stamps

if TYPE_CHECKING:
    import pandas as pd

    from umbra.receivers.named import NamedReceivers
    from umbra.study.result import Study

__all__ = ["AreaTable", "compare_areas", "frame_areas", "name_share", "tabulate"]


def name_share(hours: float) -> str:
    """Return the name of the share of an area with at least a number of hours: ``share_2h``."""
    seconds = round(3600 * hours)
    unit, length = next(
        (unit, length) for unit, length in (("h", 3600), ("min", 60), ("s", 1))
        if seconds % length == 0
    )  # fmt: skip
    return f"share_{seconds // length}{unit}"


@dataclass(frozen=True, eq=False)
class AreaTable:
    """
    Figures of named areas by date.

    Parameters
    ----------
    areas : sequence of Area
        In the model's own coordinates; bands are areas of their own.
    period : Period
    columns : dict of str to array
        ``area_m2`` (n_areas,), all others (n_areas, n_dates): shares as fractions of 1, hours,
        first and last sun as UTC, and the means of other measures (n_areas,).
    least : float, optional
        Hours of sun that the share has at least [h]; None where hours are not asked for.
    notes : tuple of str
        What a user should know of the areas, one line each.
    """

    areas: Sequence[Area]
    period: Period
    columns: dict[str, NDArray[Any]]
    least: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the areas."""
        return [area.name for area in self.areas]

    @property
    def dates(self) -> tuple[dt.date, ...]:
        """The dates; none of a study without a date."""
        return self.period.days

    @property
    def zone(self) -> str:
        """Time zone of the clock times."""
        return "UTC" if self.period.site is None else self.period.site.zone

    @property
    def has_before(self) -> bool:
        """Whether figures of the place without a proposal are beside them."""
        return any(column.endswith("_before") for column in self.columns)

    def variables(self, taken: Variables) -> Variables:
        """
        Return the arrays of ``study.nc``; names that are taken by others follow ``area_``.

        Parameters
        ----------
        taken : Variables
            Of the study.
        """

        def free(name: str) -> str:
            dims = {dim for given, _ in taken.values() for dim in given}
            return f"area_{name}" if name in taken or name in dims else name

        name, date = free("name"), free("date")
        variables: Variables = {name: ((name,), np.array(self.names))}
        if self.dates:
            days = np.array(self.dates, "datetime64[D]").astype("datetime64[ns]")
            variables[date] = ((date,), days)
        for column, values in self.columns.items():
            variables[free(column)] = ((name, date)[: values.ndim], values)
        return variables

    def find_interval(self, day: int) -> tuple[np.datetime64, np.datetime64]:
        """Return the instants [UTC] between which the hours of a date count."""
        stamps = self.period.steps[day].stamps
        return stamps[0].astype("datetime64[us]"), stamps[-1].astype("datetime64[us]")

    def tell_interval(self, row: dict[str, Any]) -> str:
        """Return the local times between which a row's hours count: ``09:00 to 17:00``."""
        stamps = np.array([row["from"], row["to"]])
        start, end = Stamps(stamps=stamps, zone=self.zone).labels()
        return f"{start} to {'24:00' if end == '00:00' else end}"

    def list_rows(self) -> list[dict[str, Any]]:
        """
        Return a row for each area and date, in this order, with the contract's columns.

        ``from`` and ``to`` are the instants [UTC] between which its hours count.
        """
        rows = []
        for k, name in enumerate(self.names):
            for day, date in enumerate(self.dates or (None,)):
                row: dict[str, Any] = {"name": name, "date": date}
                for column, values in self.columns.items():
                    row[column] = values[k] if values.ndim == 1 else values[k, day]
                if date is not None and self.least is not None:
                    row["from"], row["to"] = self.find_interval(day)
                rows.append(row)
        return rows


def frame_areas(table: AreaTable | None) -> "pd.DataFrame":
    """Return named areas as a pandas frame, a row for each and each date; refuse none."""
    if table is None:
        msg = "the study has no areas; name a file of polygons, or parts, with areas="
        raise InputError(msg, option="areas")
    import pandas as pd  # noqa: PLC0415  (half a second)

    frame = pd.DataFrame(table.list_rows())
    frame["date"] = pd.to_datetime(frame["date"])
    return frame


def tabulate(study: "Study", before: "Study | None") -> AreaTable:
    """Make the table of a study of areas, beside one without the proposal."""
    laid, groups = cast("NamedReceivers", study.laid), study.groups
    return AreaTable(
        laid.records, study.period, compare_areas(study, before),
        None if groups is None else groups.least, laid.notes,
    )  # fmt: skip


def compare_areas(study: "Study", before: "Study | None") -> dict[str, NDArray[Any]]:
    """Return the columns of a study of areas, beside those of one without the proposal."""
    laid = cast("NamedReceivers", study.laid)
    columns: dict[str, NDArray[Any]] = {"area_m2": laid.group_areas, **_list_figures(study)}
    if before is None:
        return columns
    earlier = _list_figures(before)
    columns |= {f"{name}_before": values for name, values in earlier.items()}
    for name, values in earlier.items():
        if name.startswith(("share_", "mean_")):
            none = np.full(values.shape, np.nan)
            columns[f"{name}_ratio"] = np.divide(columns[name], values, out=none, where=values > 0)
    return columns


def _list_figures(study: "Study") -> dict[str, NDArray[Any]]:
    """Return the columns of the hours of sun, and means of other measures."""
    laid, groups = cast("NamedReceivers", study.laid), study.groups
    means: dict[str, NDArray[Any]] = {
        f"mean_{quantity.name}": laid.average(study.more[quantity.name][1])
        for quantity in study.quantities
        if not quantity.per
    }
    if groups is None:
        return means
    return {
        name_share(groups.least): groups.share,
        "mean_sun_hours": groups.mean,
        "least_sun_hours": groups.fewest,
        "most_sun_hours": groups.most,
        "first_sun": groups.first,
        "last_sun": groups.last,
        **means,
    }
