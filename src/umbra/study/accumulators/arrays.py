"""Arrays of a result: hours, and variables chosen by options."""

import datetime as dt
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.errors import InputError
from umbra.lights import Period
from umbra.receivers.kind import Receivers, Variables
from umbra.study.accumulators.intervals import SunIntervalTable, to_hours
from umbra.study.options import StudyOptions
from umbra.sun.clock import parse_duration

__all__ = ["FEW_DAYS", "ResultArrays", "ResultOptions", "find_shaded_share"]

FEW_DAYS = 12
"""Most dates whose results are kept by day by default."""
LEAST_TOLERANCE, MOST_TOLERANCE = 1e-3, 60
"""Limits of the tolerance of solved instants [s]."""
_MICROSECOND = dt.timedelta(microseconds=1)
_INTERVALS = {
    "first_sun": np.dtype("datetime64[us]"),
    "last_sun": np.dtype("datetime64[us]"),
    "sun_spells": np.dtype(np.int32),
    "longest_sun_hours": np.dtype(np.float32),
}


@dataclass(frozen=True)
class ResultOptions:
    """
    Options of results besides the hours in shadow.

    Parameters
    ----------
    by_day : bool
        Whether results are also kept for each date.
    spells : bool
        Whether to keep first and last sun, number of sun intervals, longest, shaded share.
    min_spell : int
        Least length of intervals whose hours are added up [us]; 0: none.
    masks : bool
        Whether to keep every instant.
    tolerance : float
        Tolerance of solved interval ends [s]; 0: intervals begin and end with steps.
    by_month : bool
        Whether hours are also kept for each month.
    """

    by_day: bool = False
    spells: bool = False
    min_spell: int = 0
    masks: bool = False
    tolerance: float = 0.0
    by_month: bool = False

    @classmethod
    def of(cls, period: Period, options: StudyOptions) -> "ResultOptions":
        """Read them: ``min_spell`` implies ``spells``, few dates ``by_day``, more ``by_month``."""
        tolerance = float(options.exact)  # True means 1 s
        if not (tolerance == 0 or LEAST_TOLERANCE <= tolerance <= MOST_TOLERANCE):
            msg = f"exact instants are solved to 0.001 to 60 s; got {options.exact}"
            raise InputError(msg, exact=options.exact)
        least = 0
        if options.min_spell is not None:
            least = parse_duration(options.min_spell, "least spell", "min_spell") // _MICROSECOND
        by_day = options.by_day
        if by_day is None:
            by_day = 1 < len(period.days) <= FEW_DAYS
        is_long = options.by_day is None and not by_day
        by_month = is_long and len(period.months) > 1 and options.asks_hours
        spells = options.spells or least > 0
        return cls(by_day, spells, least, options.masks, tolerance, by_month)

    @property
    def is_streamed(self) -> bool:
        """Whether instants must come in time order."""
        return self.spells or self.masks or self.tolerance > 0

    def bytes_kept(self, days: int) -> int:
        """Return the memory of each receiver besides hours and masks [byte]."""
        size = sum(dtype.itemsize for dtype in self._interval_types().values())
        return size + ((4 + size) * days if self.by_day else 48 * self.by_month)

    def _interval_types(self) -> dict[str, np.dtype]:
        types = dict(_INTERVALS) if self.spells else {}
        if self.spells and self.min_spell:
            types["sun_hours_in_spells"] = np.dtype(np.float32)
        return types


def find_shaded_share(shadow_hours: NDArray[np.float32], up_hours: float) -> NDArray[np.float32]:
    """Return the share of the time with the sun up in shadow; NaN if it is never up."""
    return shadow_hours / np.float32(up_hours or np.nan)


class ResultArrays:
    """
    Results of all receivers, filled tile by tile.

    Parameters
    ----------
    period : Period
    shape : tuple of int
        Of the receivers.
    results : ResultOptions
    canopy : Canopy, optional
    reads_days : bool
        Whether an accumulator reads the hours of each date of the current tile.

    Attributes
    ----------
    shares : (n_days,) float64, optional
        Share of light that canopies transmit.
    month_of_day : (n_days,) int
    months : int
        Number of months of which hours are kept.
    """

    def __init__(
        self,
        period: Period,
        shape: tuple[int, ...],
        results: ResultOptions,
        canopy: Canopy | None = None,
        *,
        reads_days: bool = False,
    ) -> None:
        self.period, self.shape, self.results = period, shape, results
        self.shadow_hours = np.zeros(shape, np.float32)
        self.shares = None if canopy is None else canopy.find_shares(period.days)
        self.up_hours_by_day = period.up_hours_by_day
        days = len(period.days)
        self._whole = {name: np.zeros(shape, t) for name, t in results._interval_types().items()}
        self._by_day: dict[str, NDArray] = {}
        self._of_tile: list[NDArray] = [np.zeros(0)] * days if reads_days else []
        types = {"shadow_hours": np.dtype(np.float32), **results._interval_types()}
        if canopy is not None:
            self._whole["canopy_hours"] = np.zeros(shape, np.float32)
            types["canopy_hours"] = np.dtype(np.float32)
        self.month_of_day = period.month_of_day
        self.months = len(period.months) if results.by_month else 0
        self._by_month = np.zeros((self.months, *shape), np.float32)
        if results.by_day:
            self._by_day = {name: np.zeros((days, *shape), t) for name, t in types.items()}

    @property
    def up_hours(self) -> float:
        """Time with the sun up in the whole period [h]."""
        return float(self.up_hours_by_day.sum())

    @property
    def has_days(self) -> bool:
        """Whether the hours of each date are kept."""
        return self.results.by_day or bool(self._of_tile)

    def read_hours(self, day: int, where: Any = ...) -> NDArray:
        """Return a date's hours in shadow of the current tile."""
        return self._by_day["shadow_hours"][day][where] if self._by_day else self._of_tile[day]

    def is_fully_transmissive(self, day: int) -> bool:
        """Return whether canopies transmit all light on a day."""
        return self.shares is not None and self.shares[day] >= 1

    def keep_hours(self, hours: NDArray, where: Any = ..., day: int | None = None) -> None:
        """Store hours in shadow of a tile: of the whole period, or of one day."""
        if day is None:
            self.shadow_hours[where] = hours
            return
        if self._by_day:
            self._by_day["shadow_hours"][day][where] = hours
        elif self._of_tile:
            self._of_tile[day] = hours
        if self.months:
            self._by_month[self.month_of_day[day]][where] += hours

    def keep_months(self, hours: NDArray[np.float32], where: Any = ...) -> None:
        """Store the hours in shadow of a tile in each month, (n_months, ...)."""
        for month, own in zip(self._by_month, hours, strict=True):
            month[where] = own

    def keep_behind(self, hours: NDArray, where: Any = ..., day: int | None = None) -> None:
        """Store the hours behind canopies alone: of the whole period, or of one day."""
        if self.shares is None:
            return
        if day is None:
            self._whole["canopy_hours"][where] = hours
        elif self._by_day:
            self._by_day["canopy_hours"][day][where] = hours

    def keep_intervals(
        self, intervals: SunIntervalTable, where: Any = ..., day: int | None = None
    ) -> None:
        """Store the sun intervals of a tile: of the whole period, or of one day."""
        if day is not None and not self._by_day:
            return
        arrays = self._whole if day is None else {n: a[day] for n, a in self._by_day.items()}
        values = {
            "first_sun": intervals.first,
            "last_sun": intervals.last,
            "sun_spells": intervals.count,
            "longest_sun_hours": to_hours(intervals.longest),
            "sun_hours_in_spells": to_hours(intervals.counted),
        }
        for name, array in arrays.items():
            if name in values:
                array[where] = values[name]

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the values where nothing receives."""
        self.shadow_hours[nothing] = np.nan
        for array in (*self._whole.values(), *self._by_day.values(), self._by_month):
            missing = {"f": np.nan, "M": np.datetime64("NaT")}.get(array.dtype.kind, 0)
            array[..., nothing] = missing

    def enter_day(self, intervals: SunIntervalTable, up: int, where: Any, day: int | None) -> None:
        """Store the sun intervals of one day, or of all (None), and the time with sun up [us]."""
        light = intervals.sun if intervals.light is None else intervals.light
        self.keep_hours(to_hours(up - light), where, day)
        self.keep_intervals(intervals, where, day)
        if intervals.behind is not None:
            self.keep_behind(to_hours(intervals.behind), where, day)

    def variables(self, laid: Receivers) -> Variables:
        """Return all arrays besides the hours of the whole period."""
        dims = laid.dims
        variables: Variables = {}
        variables |= {name: (dims, array) for name, array in self._whole.items()}
        if self.results.spells:
            variables["shaded_share"] = (dims, find_shaded_share(self.shadow_hours, self.up_hours))
        if self._by_day:
            days = np.array(self.period.days, "datetime64[D]").astype("datetime64[ns]")
            variables["day"] = (("day",), days)
            variables["up_hours_by_day"] = (("day",), self.up_hours_by_day)
            up = self.up_hours_by_day.astype(np.float32).reshape(-1, *[1] * len(dims))
            by_day = dict(self._by_day)
            hours = by_day.pop("shadow_hours")
            variables["shadow_hours_by_day"] = (("day", *dims), hours)
            variables["sun_hours_by_day"] = (("day", *dims), up - hours)
            variables |= {
                f"{name}_by_day": (("day", *dims), array) for name, array in by_day.items()
            }
        if self.months:
            variables |= self._list_months(dims)
        if self.shares is not None:
            variables["canopy_transmissivity"] = (("time",), self.shares[self.period.day_of_step])
        return variables

    def _list_months(self, dims: tuple[str, ...]) -> Variables:
        """Return the hours a day in each month, means of its dates."""
        dates = np.bincount(self.month_of_day)
        up = np.bincount(self.month_of_day, self.up_hours_by_day) / dates
        shape = (-1, *[1] * len(dims))
        shadow = self._by_month / dates.astype(np.float32).reshape(shape)
        return {
            "month": (("month",), np.array(self.period.months, np.int32)),
            "dates_by_month": (("month",), dates.astype(np.int32)),
            "up_hours_by_month": (("month",), up),
            "shadow_hours_by_month": (("month", *dims), shadow),
            "sun_hours_by_month": (("month", *dims), up.astype(np.float32).reshape(shape) - shadow),
        }
