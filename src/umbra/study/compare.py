"""Before against after: hours of sun lost, where too few are left, and whose they were."""

import datetime as dt
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.sun.clock import parse_duration

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Losses", "compare", "find_losses"]

GROUND = "ground"
"""The neighbour's name where no part but the ground lost sun."""
_LEAST = 1e-4  # of an hour: less is rounding


@dataclass(frozen=True, eq=False)
class Losses:
    """
    What a proposal takes from its neighbours.

    Parameters
    ----------
    hours_lost : (...) float32
        Hours of sun less than before; NaN where it is built over [h].
    newly_under : (...) uint8
        1 where ``under`` hours were reached before and no longer are.
    under : float
        [h]
    names : (n,) str
        Of the neighbours, those first who lose most hours over most of their area.
    area : (n,) float64
        Of each one's receivers [m2].
    touched : (n,) float64
        Area that loses sun [m2].
    newly : (n,) float64
        Area newly under ``under`` [m2].
    most : (n,) float64
        Most hours lost at any one place [h].
    mean : (n,) float64
        Hours lost, averaged over the area [h].
    """

    hours_lost: NDArray[np.float32]
    newly_under: NDArray[np.uint8]
    under: float
    names: NDArray[np.str_]
    area: NDArray[np.float64]
    touched: NDArray[np.float64]
    newly: NDArray[np.float64]
    most: NDArray[np.float64]
    mean: NDArray[np.float64]

    def variables(self, dims: tuple[str, ...]) -> dict[str, tuple[tuple[str, ...], NDArray]]:
        """Give the arrays of ``study.nc``; only neighbours that are touched."""
        kept = self.touched > 0
        one = ("neighbour",)
        return {
            "hours_lost": (dims, self.hours_lost),
            "newly_under": (dims, self.newly_under),
            "neighbour": (one, self.names[kept]),
            "neighbour_area": (one, self.area[kept]),
            "neighbour_area_touched": (one, self.touched[kept]),
            "neighbour_area_newly_under": (one, self.newly[kept]),
            "neighbour_most_hours_lost": (one, self.most[kept]),
            "neighbour_mean_hours_lost": (one, self.mean[kept]),
        }


def read_hours(under: str | float | dt.timedelta) -> float:
    """Read hours: a number of them, or a duration such as ``2h30min``."""
    if isinstance(under, (int, float)):
        return float(under)
    return parse_duration(under, "least sun").total_seconds() / 3600


def find_losses(
    sun_hours: NDArray[np.float32],
    lost: NDArray[np.float32],
    is_new: NDArray[np.bool_],
    owner: NDArray[np.signedinteger],
    names: list[str],
    area: NDArray[np.float64] | float,
    under: float,
) -> Losses:
    """
    Say what is lost, and by whom.

    Parameters
    ----------
    sun_hours : (...) float32
        After [h].
    lost : (...) float32
        Less than before [h].
    is_new : (...) bool
        Receivers that were not there before.
    owner : (...) int
        Whose each receiver is, in ``names``; negative for the ground.
    names : list of str
        Names may repeat: they are one neighbour.
    area : (...) float64 or float
        Of each receiver [m2].
    under : float
        [h]
    """
    hours_lost = np.where(is_new, np.float32(np.nan), lost)
    newly = ~is_new & (sun_hours < under - _LEAST) & (sun_hours + lost >= under - _LEAST)
    labels, place = np.unique(np.array([*names, GROUND]), return_inverse=True)
    mine = place.ravel()[np.where(owner < 0, len(names), owner)][~is_new]
    areas = np.broadcast_to(area, owner.shape)[~is_new]
    loss = lost[~is_new]

    def add(weights: NDArray) -> NDArray[np.float64]:
        return np.bincount(mine, weights, len(labels)).astype(np.float64)

    total = add(areas)
    touched = add(areas * (loss > _LEAST))
    most = np.zeros(len(labels))
    np.maximum.at(most, mine, loss)
    sums = add(areas * loss)
    order = np.argsort(-sums, kind="stable")
    order = order[total[order] > 0]
    return Losses(
        hours_lost,
        newly.astype(np.uint8),
        under,
        labels[order],
        total[order],
        touched[order],
        add(areas * newly[~is_new])[order],
        most[order],
        (sums[order] / total[order]),
    )


def compare(
    before: "xr.Dataset", after: "xr.Dataset", under: str | float | dt.timedelta = "2h"
) -> "xr.Dataset":
    """
    Compare two studies of the same receivers and time.

    Parameters
    ----------
    before, after : xarray.Dataset
        As ``umbra.shadow_study`` gives them.
    under : str or float
        Where fewer hours of sun are left than this, but were not before: ``"2h"``.

    Returns
    -------
    dataset : xarray.Dataset
        ``hours_lost``: sun before less sun after, NaN where the receiver itself is
        another (something was built there, or removed); ``sun_hours_before`` and
        ``sun_hours_after``; ``newly_under``: 1 where fewer than ``under`` are left but
        were not before. Attributes ``under_hours``, and for plans ``area_touched`` and
        ``area_newly_under`` [m2].

    Raises
    ------
    InputError
        If the studies are not of the same receivers or instants.
    """
    import xarray as xr  # noqa: PLC0415

    least = read_hours(under)
    dims = before.sun_hours.dims
    for name in (*dims, "time"):
        if name not in after.dims or not (
            after.sizes[name] == before.sizes[name]
            and np.array_equal(after[name].values, before[name].values)
        ):
            msg = (
                f"the two studies differ in '{name}'; run both with the same --extent, --cell, "
                "--date, --from, --to and --every"
            )
            raise InputError(msg, dimension=name)
    lost = before.sun_hours - after.sun_hours
    for name in ("receiver_z", "position"):
        if name in before and name in after:
            apart = abs(before[name] - after[name])
            lost = lost.where((apart.max("xyz") if name == "position" else apart) < 1e-6)
    newly = (
        lost.notnull() & (after.sun_hours < least - _LEAST) & (before.sun_hours >= least - _LEAST)
    )
    attributes: dict[str, float] = {"under_hours": least}
    if dims == ("y", "x") and min(before.sizes["x"], before.sizes["y"]) > 1:
        cell = float(np.ptp(before.x.values[:2]) * np.ptp(before.y.values[:2]))
        attributes["area_touched"] = float((lost > _LEAST).sum()) * cell
        attributes["area_newly_under"] = float(newly.sum()) * cell
    return xr.Dataset(
        {
            "hours_lost": lost.assign_attrs(long_name="hours of sun lost", units="h"),
            "sun_hours_before": before.sun_hours,
            "sun_hours_after": after.sun_hours,
            "newly_under": newly.astype(np.uint8),
        },
        attrs=attributes,
    )
