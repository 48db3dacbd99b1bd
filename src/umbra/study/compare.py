"""Comparison of two studies: hours of sun lost, and where too few are left."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.sun.clock import parse_duration

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["LEAST", "NeighbourSums", "SunLosses", "compare", "is_newly_under", "read_hours"]


def read_hours(under: str | float | dt.timedelta, option: str = "under") -> float:
    """Read hours of an option: a number, or a duration such as ``2h30min``."""
    if isinstance(under, (int, float)):
        return float(under)
    return parse_duration(under, "least sun", option).total_seconds() / 3600


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

    before, after = (
        _find_dataset(name, study) for name, study in (("before", before), ("after", after))
    )
    dims = before.sun_hours.dims
    _check_same(before, after)
    has_days = "sun_hours_by_day" in before and "sun_hours_by_day" in after
    dates = int(before.attrs.get("days", 1))
    if under is not None and dates > 1 and not has_days:
        msg = (
            f"'under' is a limit of one date, and these studies keep only the sums of {dates} "
            "dates; run both with by_day=True, or give under=None for the hours lost alone"
        )
        raise InputError(msg, option="by_day", days=dates)
    is_same = xr.ones_like(before.sun_hours, bool)
    for name in ("receiver_z", "position"):
        if name in before and name in after:
            apart = abs(before[name] - after[name])
            is_same &= (apart.max("xyz") if name == "position" else apart) < 1e-6
    sums = f", sum of {dates} dates" if dates > 1 else ""
    lost = (before.sun_hours - after.sun_hours).where(is_same)
    variables = {
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
        variables["hours_lost_by_day"] = lost.assign_attrs(
            long_name="hours of sun lost, on the day", units="h"
        )
    touched = (lost > LEAST).sum(dims)
    if under is not None:
        attributes["under_hours"] = least = read_hours(under)
        sun = after.sun_hours_by_day if has_days else after.sun_hours
        newly: Any = is_newly_under(sun, lost, least)
        if has_days:
            variables["newly_under_by_day"] = newly.astype(np.uint8)
        variables["newly_under"] = (newly.any("day") if has_days else newly).astype(np.uint8)
    if cell is not None and has_days:
        variables["area_touched_by_day"] = touched * cell
        if under is not None:
            variables["area_newly_under_by_day"] = newly.sum(dims) * cell
    elif cell is not None:
        attributes["area_touched"] = float(touched) * cell
        if under is not None:
            attributes["area_newly_under"] = float(newly.sum()) * cell
    return xr.Dataset(variables, attrs=attributes)


def _find_dataset(name: str, study: Any) -> "xr.Dataset":
    """Return the dataset of a study; refuse all that is none."""
    dataset = getattr(study, "dataset", study)
    if "sun_hours" not in getattr(dataset, "data_vars", ()):
        msg = f"{name} is {show_value(study)}, not a study; give what umbra.shadow_study returns"
        raise InputError(msg, option=name)
    return dataset


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
            raise InputError(msg, option="extent", dimension=name)


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
        """Return the arrays of ``study.nc`` that have a value for each receiver."""
        nan, left = np.float32(np.nan), ~self.is_new
        newly = left & (self.newly_days > 0)
        variables: Variables = {
            "hours_lost": (dims, np.where(left, self.lost, nan)),
            "newly_under": (dims, newly.astype(np.uint8)),
        }
        if self.days > 1:
            variables["newly_under_days"] = (dims, np.where(left, self.newly_days, np.int16(0)))
        if self.lost_by_day is not None and self.newly_by_day is not None:
            variables["hours_lost_by_day"] = (("day", *dims), np.where(left, self.lost_by_day, nan))
            variables["newly_under_by_day"] = (("day", *dims), left * self.newly_by_day)
        return variables

    def sum_up(self) -> "NeighbourSums":
        """Return the figures of each neighbour."""
        left = ~self.is_new
        names, index = np.unique(np.array([*self.names, GROUND]), return_inverse=True)
        owner = np.where(self.owner < 0, len(self.names), self.owner)
        neighbour = index.ravel()[owner][left]
        # A kind of receivers whose places have no area may say so by 0 or NaN.
        areas = np.nan_to_num(np.broadcast_to(self.area, self.owner.shape)[left], posinf=0.0)
        whole = _add_up(neighbour, areas, len(names))
        pairs = [(self.lost, self.newly_days > 0)]
        if self.lost_by_day is not None and self.newly_by_day is not None:
            pairs += zip(self.lost_by_day, self.newly_by_day > 0)
        sums, most = (
            np.zeros((len(pairs), 3, len(names)), np.int64),
            np.zeros((len(pairs), len(names))),
        )
        for k, (lost, is_newly) in enumerate(pairs):
            loss = lost[left]
            np.maximum.at(most[k], neighbour, loss)
            for j, part in enumerate(
                (areas * loss, areas * (loss > LEAST), areas * is_newly[left])
            ):
                sums[k, j] = _add_up(neighbour, part, len(names))
        there = np.flatnonzero(np.bincount(neighbour, minlength=len(names)))
        return NeighbourSums(names[there], whole[there], sums[..., there], most[:, there])


_FINE = 2.0**20
"""Parts of a square metre, or of one times an hour, in which sums are kept."""
_MOST = 2.0**62
"""Largest sum, half of what int64 holds."""


def _add_up(owner: NDArray[np.intp], values: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Add up values by owner in whole numbers: the sum does not depend on their order."""
    sums = np.zeros(count, np.int64)
    if float(values.sum()) * _FINE >= _MOST:
        msg = (
            f"the receivers add up to {values.sum():.3g} m² or m² h, more than figures of "
            "neighbours hold; is the model in millimetres? export it in metres"
        )
        raise InputError(msg)
    np.add.at(sums, owner, np.rint(values * _FINE).astype(np.int64))
    return sums


@dataclass(frozen=True, eq=False)
class NeighbourSums:
    """
    Figures of neighbours, which can be joined with those of other receivers.

    Parameters
    ----------
    names : (n,) str
        Ascending, each once.
    area : (n,) int64
        Of all their receivers [2^-20 m2].
    sums : (1 + n_days, 3, n) int64
        Of the whole period and each date kept: hours lost times area, area that loses sun, and area
        newly under the limit [2^-20 m2 h, 2^-20 m2].
    most : (1 + n_days, n) float64
        Most hours lost [h].
    """

    names: NDArray[np.str_]
    area: NDArray[np.int64]
    sums: NDArray[np.int64]
    most: NDArray[np.float64]

    def join(self, others: Sequence["NeighbourSums"]) -> "NeighbourSums":
        """Return the figures of these receivers and others."""
        tables = [self, *others]
        names, own = np.unique(
            np.concatenate([table.names for table in tables]), return_inverse=True
        )
        own = own.ravel()
        every: Any = (..., own)
        area = np.zeros(len(names), np.int64)
        sums = np.zeros((*self.sums.shape[:2], len(names)), np.int64)
        most = np.zeros((len(self.most), len(names)))
        np.add.at(area, own, np.concatenate([table.area for table in tables]))
        np.add.at(sums, every, np.concatenate([table.sums for table in tables], -1))
        np.maximum.at(most, every, np.concatenate([table.most for table in tables], -1))
        return NeighbourSums(names, area, sums, most)

    def rename(self, names: NDArray[np.str_]) -> "NeighbourSums":
        """Return the same under other names (n,), of which equal ones are one neighbour."""
        return replace(self, names=names).join([])

    def variables(self) -> Variables:
        """Return the arrays of ``study.nc``: neighbours that lose sun, by hours times area."""
        order = np.argsort(-self.sums[0, 0], kind="stable")
        shown = order[self.most[0, order] > LEAST]
        dims = ("neighbour",)
        area = self.area[shown] / _FINE
        figures = {
            "area_touched": self.sums[:, 1, shown] / _FINE,
            "area_newly_under": self.sums[:, 2, shown] / _FINE,
            "most_hours_lost": self.most[:, shown],
            # Without an area there is no mean.
            "mean_hours_lost": self.sums[:, 0, shown] / _FINE / np.where(area > 0, area, np.nan),
        }
        variables: Variables = {
            "neighbour": (dims, self.names[shown]),
            "neighbour_area": (dims, area),
        }
        variables |= {f"neighbour_{name}": (dims, rows[0]) for name, rows in figures.items()}
        if len(self.most) > 1:
            variables |= {
                f"neighbour_{name}_by_day": (("day", *dims), rows[1:])
                for name, rows in figures.items()
            }
        return variables
