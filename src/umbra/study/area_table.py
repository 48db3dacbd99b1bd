"""The table of named areas: for each and each date the sun that it gets, before and after."""

import datetime as dt
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Variables
from umbra.sun.clock import Stamps

if TYPE_CHECKING:
    import pandas as pd

    from umbra.receivers.named import NamedReceivers
    from umbra.study.result import Study

__all__ = ["AreaTable", "name_share", "tabulate"]


def name_share(hours: float) -> str:
    """Return the name of the share of an area with at least so many hours: ``share_2h``."""
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
    study : Study
        Of the areas' samples: ``study.laid`` is `NamedReceivers`.
    before : Study, optional
        The same without the proposal.
    dates : tuple of datetime.date
        None of a study without a date.
    columns : dict of str to array
        ``area_m2`` (n_areas,), all others (n_areas, n_dates): shares as fractions of 1, hours,
        first and last sun as UTC, and the means of other measures (n_areas,).
    """

    study: "Study"
    before: "Study | None"
    dates: tuple[dt.date, ...]
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def laid(self) -> "NamedReceivers":
        """The areas and their samples."""
        return cast("NamedReceivers", self.study.laid)

    @property
    def names(self) -> list[str]:
        """Names of the areas."""
        return self.laid.group_names

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the areas, one line each."""
        return self.laid.notes

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
        found: Variables = {name: ((name,), np.array(self.names))}
        if self.dates:
            days = np.array(self.dates, "datetime64[D]").astype("datetime64[ns]")
            found[date] = ((date,), days)
        for column, values in self.columns.items():
            found[free(column)] = ((name, date)[: values.ndim], values)
        return found

    def find_interval(self, day: int) -> tuple[np.datetime64, np.datetime64]:
        """Return the instants [UTC] between which the hours of a date count."""
        stamps = self.study.period.steps[day].stamps
        return stamps[0].astype("datetime64[us]"), stamps[-1].astype("datetime64[us]")

    def tell_interval(self, row: dict[str, Any]) -> str:
        """Return the local times between which a row's hours count: ``09:00 to 17:00``."""
        site = self.study.site
        stamps = np.array([row["from"], row["to"]])
        start, end = Stamps(stamps=stamps, zone="UTC" if site is None else site.zone).labels()
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
                if date is not None and self.study.groups is not None:
                    row["from"], row["to"] = self.find_interval(day)
                rows.append(row)
        return rows

    def to_frame(self) -> "pd.DataFrame":
        """Return the table as a pandas frame, a row for each area and date."""
        import pandas as pd  # noqa: PLC0415  (half a second)

        frame = pd.DataFrame(self.list_rows())
        frame["date"] = pd.to_datetime(frame["date"])
        return frame


def tabulate(study: "Study", before: "Study | None") -> AreaTable:
    """Make the table of a study of areas, beside one without the proposal."""
    laid = cast("NamedReceivers", study.laid)
    columns: dict[str, NDArray[Any]] = {"area_m2": laid.group_areas, **_list_figures(study)}
    if before is not None:
        earlier = _list_figures(before)
        columns |= {f"{name}_before": values for name, values in earlier.items()}
        for name, values in earlier.items():
            if name.startswith(("share_", "mean_")):
                none = np.full(values.shape, np.nan)
                columns[f"{name}_ratio"] = np.divide(
                    columns[name], values, out=none, where=values > 0
                )
    return AreaTable(study, before, study.period.days, columns)


def _list_figures(study: "Study") -> dict[str, NDArray[Any]]:
    """Return the columns of the hours of sun, and means of other measures."""
    laid, groups = cast("NamedReceivers", study.laid), study.groups
    means: dict[str, NDArray[Any]] = {
        f"mean_{one.name}": laid.average(study.more[one.name][1])
        for one in study.quantities
        if not one.per
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
