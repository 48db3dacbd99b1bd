"""Comparison of two studies: hours of sun lost, and where too few are left."""

import datetime as dt
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.sun.clock import parse_duration

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["LEAST", "SunLosses", "compare", "is_newly_under", "read_hours"]


def read_hours(under: str | float | dt.timedelta) -> float:
    """Read hours: a number, or a duration such as ``2h30min``."""
    if isinstance(under, (int, float)):
        return float(under)
    return parse_duration(under, "least sun", "under").total_seconds() / 3600


def compare(
    before: "xr.Dataset", after: "xr.Dataset", under: str | float | dt.timedelta | None = "2h"
) -> "xr.Dataset":
    """
    Compare two studies of the same receivers and time.

    Parameters
    ----------
    before, after : ShadowStudy or xarray.Dataset
        As ``umbra.shadow_study`` returns them.
    under : str or float, optional
        Limit for ``newly_under``: hours of sun on a date. None leaves it out.

    Returns
    -------
    dataset : xarray.Dataset
        ``hours_lost``: sun before less sun after, NaN where the receiver itself moved
        (something was built there, or removed); ``sun_hours_before`` and
        ``sun_hours_after``; ``newly_under``: 1 where the sun fell below ``under``.
        Attributes ``under_hours``, and for plans ``area_touched`` and
        ``area_newly_under`` [m2]. For several dates hours are sums, ``newly_under`` is 1
        if true on at least one date, and ``hours_lost_by_day``, ``newly_under_by_day``
        and, instead of the attributes of plans, ``area_touched_by_day`` and
        ``area_newly_under_by_day`` are added.

    Raises
    ------
    InputError
        If the studies differ in receivers or instants, or keep only the sums of several
        dates while ``under`` is given.
    """
    import xarray as xr  # noqa: PLC0415

    before, after = (getattr(one, "dataset", one) for one in (before, after))
    dims = before.sun_hours.dims
    _check_same(before, after)
    has_days = "sun_hours_by_day" in before and "sun_hours_by_day" in after
    dates = int(before.attrs.get("days", 1))
    if under is not None and dates > 1 and not has_days:
        msg = (
            f"'under' is a limit of one date, and these studies keep only the sums of {dates} "
            "dates; run both with by_day=True, or give under=None for the hours lost alone"
        )
        raise InputError(msg, days=dates)
    is_same = xr.ones_like(before.sun_hours, bool)
    for name in ("receiver_z", "position"):
        if name in before and name in after:
            apart = abs(before[name] - after[name])
            is_same &= (apart.max("xyz") if name == "position" else apart) < 1e-6
    sums = f", sum of {dates} dates" if dates > 1 else ""
    lost = (before.sun_hours - after.sun_hours).where(is_same)
    found = {
        "hours_lost": lost.assign_attrs(long_name=f"hours of sun lost{sums}", units="h"),
        "sun_hours_before": before.sun_hours,
        "sun_hours_after": after.sun_hours,
    }
    attributes: dict[str, float] = {}
    cell = None
    if dims == ("y", "x") and min(before.sizes["x"], before.sizes["y"]) > 1:
        cell = float(np.ptp(before.x.values[:2]) * np.ptp(before.y.values[:2]))
    if has_days:
        lost = (before.sun_hours_by_day - after.sun_hours_by_day).where(is_same)
        found["hours_lost_by_day"] = lost.assign_attrs(
            long_name="hours of sun lost, on the day", units="h"
        )
    touched = (lost > LEAST).sum(dims)
    if under is not None:
        attributes["under_hours"] = least = read_hours(under)
        sun = after.sun_hours_by_day if has_days else after.sun_hours
        newly: Any = is_newly_under(sun, lost, least)
        if has_days:
            found["newly_under_by_day"] = newly.astype(np.uint8)
        found["newly_under"] = (newly.any("day") if has_days else newly).astype(np.uint8)
    if cell is not None and has_days:
        found["area_touched_by_day"] = touched * cell
        if under is not None:
            found["area_newly_under_by_day"] = newly.sum(dims) * cell
    elif cell is not None:
        attributes["area_touched"] = float(touched) * cell
        if under is not None:
            attributes["area_newly_under"] = float(newly.sum()) * cell
    return xr.Dataset(found, attrs=attributes)


def _check_same(before: "xr.Dataset", after: "xr.Dataset") -> None:
    """Refuse studies that differ in receivers or instants."""
    for name in (*before.sun_hours.dims, "time"):
        if name not in after.dims or not (
            after.sizes[name] == before.sizes[name]
            and np.array_equal(after[name].values, before[name].values)
        ):
            msg = (
                f"the two studies differ in '{name}'; run both with the same extent=, cell=, "
                "date=, start=, end= and every="
            )
            raise InputError(msg, dimension=name)


GROUND = "ground"
"""Name of the neighbour for receivers on the ground."""
LEAST = 1e-4
"""Smallest loss that is not rounding [h]."""

Variables = dict[str, tuple[tuple[str, ...], NDArray]]


def is_newly_under(
    sun_hours: NDArray[np.float32], lost: NDArray[np.float32], under: float
) -> NDArray[np.bool_]:
    """
    Find where a limit was reached before and no longer is, on one date.

    Parameters
    ----------
    sun_hours : (...) float32
        After, on the date [h].
    lost : (...) float32
        Before less after [h].
    under : float
        Limit [h].
    """
    return (sun_hours < under - LEAST) & (sun_hours + lost >= under - LEAST)


@dataclass(frozen=True, eq=False)
class SunLosses:
    """
    Sun that a proposal takes from its neighbours.

    Parameters
    ----------
    lost : (...) float32
        Sun lost, sum of all dates [h].
    newly_days : (...) int16
        Number of dates on which a limit was reached before and no longer is.
    is_new : (...) bool
        Receivers that did not exist before.
    owner : (...) int
        Index of each receiver's neighbour in ``names``; negative for the ground.
    names : list of str
        Equal names are one neighbour.
    area : (...) float64 or float
        Of each receiver [m2].
    days : int
        Number of dates.
    lost_by_day : (n_days, ...) float32, optional
    newly_by_day : (n_days, ...) uint8, optional
        By date, if kept.
    """

    lost: NDArray[np.float32]
    newly_days: NDArray[np.int16]
    is_new: NDArray[np.bool_]
    owner: NDArray[np.signedinteger]
    names: list[str] = field(repr=False)
    area: NDArray[np.float64] | float
    days: int = 1
    lost_by_day: NDArray[np.float32] | None = None
    newly_by_day: NDArray[np.uint8] | None = None

    def variables(self, dims: tuple[str, ...]) -> Variables:
        """
        Return the arrays of ``study.nc``; only neighbours that lose sun.

        Sorted by hours lost times area, largest first.
        """
        nan, left = np.float32(np.nan), ~self.is_new
        newly = left & (self.newly_days > 0)
        labels, mine = self._gather()
        areas = np.broadcast_to(self.area, self.owner.shape)[left]
        whole = np.bincount(mine, areas, len(labels))
        sums = np.bincount(mine, areas * self.lost[left], len(labels))
        order = np.argsort(-sums, kind="stable")
        touched = np.bincount(mine, areas * (self.lost[left] > LEAST), len(labels))
        kept = order[touched[order] > 0]

        def sum_up(lost: NDArray[np.float32], is_newly: NDArray) -> dict[str, NDArray]:
            loss = lost[left]
            most = np.zeros(len(labels))
            np.maximum.at(most, mine, loss)
            figures = {
                "area_touched": np.bincount(mine, areas * (loss > LEAST), len(labels)),
                "area_newly_under": np.bincount(mine, areas * is_newly[left], len(labels)),
                "most_hours_lost": most,
                "mean_hours_lost": np.bincount(mine, areas * loss, len(labels))
                / np.maximum(whole, 1e-300),
            }
            return {f"neighbour_{name}": figure[kept] for name, figure in figures.items()}

        one = ("neighbour",)
        found: Variables = {
            "hours_lost": (dims, np.where(left, self.lost, nan)),
            "newly_under": (dims, newly.astype(np.uint8)),
            "neighbour": (one, labels[kept]),
            "neighbour_area": (one, whole[kept]),
        }
        found |= {name: (one, figure) for name, figure in sum_up(self.lost, newly).items()}
        if self.days > 1:
            found["newly_under_days"] = (dims, np.where(left, self.newly_days, np.int16(0)))
        if self.lost_by_day is not None and self.newly_by_day is not None:
            by_day = [sum_up(*both) for both in zip(self.lost_by_day, self.newly_by_day)]
            found["hours_lost_by_day"] = (("day", *dims), np.where(left, self.lost_by_day, nan))
            found["newly_under_by_day"] = (("day", *dims), left * self.newly_by_day)
            found |= {
                f"{name}_by_day": (("day", *one), np.array([day[name] for day in by_day]))
                for name in by_day[0]
            }
        return found

    def _gather(self) -> tuple[NDArray[np.str_], NDArray[np.intp]]:
        """Return the neighbours' names, and the neighbour of each receiver that is not new."""
        labels, place = np.unique(np.array([*self.names, GROUND]), return_inverse=True)
        owner = np.where(self.owner < 0, len(self.names), self.owner)
        return labels, place.ravel()[owner][~self.is_new]
