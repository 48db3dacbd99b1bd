"""A study's result, and what its files and pictures are made from."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Period, Refraction
from umbra.machine import find_memory, name_memory
from umbra.rays.depth import GROUND
from umbra.receivers.kind import ReceiverKind, Receivers, Variables
from umbra.receivers.on_demand import OnDemand
from umbra.study.accumulators.arrays import find_shaded_share
from umbra.study.accumulators.step_masks import Masks
from umbra.study.attributes import find_attributes
from umbra.study.measures import Quantity
from umbra.sun import Site, Steps, SunPath, name_date

if TYPE_CHECKING:
    import xarray as xr

    from umbra.scene.named_places import Area
    from umbra.study.accumulators.named_hours import GroupDays
    from umbra.study.area_table import AreaTable

__all__ = ["Study", "Variables", "name_dates", "split_dates", "tell_dates"]

_SMALL = 1_000_000  # values that a dataset holds at once, to show them
_LAID_OUT = ("x", "y", "grid", "heights", "ground", "places", "samples")


@dataclass(frozen=True, eq=False)
class Study:
    """
    A study's result, and what its files and pictures are made from.

    Parameters
    ----------
    laid : Receivers
        A raster's ``x``, ``y``, ``grid``, ``heights`` and ``ground`` and single points'
        ``places`` and ``samples`` are attributes of the study, too.
    period : Period
        The time axis: one day, or several.
    shadow_hours : (...) float32
        In the whole period.
    up_hours : float
        Time with the sun above the horizon [h].
    masks : (n_steps, ...) Masks, optional
        1 where in shadow at a midpoint, 0 at night; reads like a uint8 array.
    facts : dict
        Attributes of the result.
    more : dict
        Further arrays of ``study.nc``: dimensions and values by name.
    totals : frozenset of str
        Names of those that are of the whole period, and of no single date.
    has_hours : bool
        Whether hours were asked for. If not, ``shadow_hours`` is 0 where something receives.
    quantities : tuple of Quantity
        Variables of the measures besides hours.
    groups : GroupDays, optional
        Of named receivers: the hours of sun of each area or window by date.
    areas : AreaTable, optional
        Figures of the named areas that were asked for.
    """

    laid: Receivers
    period: Period
    shadow_hours: NDArray[np.float32]
    up_hours: float
    masks: Masks | None
    facts: dict[str, object]
    more: Variables = field(default_factory=dict)
    totals: frozenset[str] = frozenset()
    has_hours: bool = True
    quantities: tuple[Quantity, ...] = ()
    groups: "GroupDays | None" = None
    areas: "AreaTable | None" = None

    def __getattr__(self, name: str) -> Any:
        if name in _LAID_OUT:
            return getattr(self.laid, name)
        raise AttributeError(name)

    @property
    def kind(self) -> ReceiverKind:
        """Kind of receivers: how they are described, drawn and written."""
        return self.laid.kind

    @property
    def receivers(self) -> str:
        """Name of the kind of receivers."""
        return self.kind.name

    @property
    def is_plan(self) -> bool:
        """Whether the study is seen from above."""
        return self.kind.is_plan

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the receivers' axes."""
        return self.laid.dims

    @property
    def model(self) -> Any:
        """The casters; a raster's also make its tiles."""
        return self.laid.casting

    @property
    def site(self) -> Site:
        """The place of the study; None where it is not known and no measure needs it."""
        return self.period.site

    @property
    def named_areas(self) -> "Sequence[Area]":
        """The named areas that were asked for."""
        return () if self.areas is None else self.areas.areas

    @property
    def true_north(self) -> float:
        """Azimuth of true north in the model's plan; 0 where the site is not known [degrees]."""
        return 0.0 if self.site is None else self.site.true_north

    @property
    def steps(self) -> Steps:
        """Steps of the first day."""
        return self.period.steps[0]

    @property
    def sun(self) -> SunPath:
        """The sun at the midpoints of all days' steps."""
        return self.period.sun

    @property
    def refraction(self) -> Refraction:
        """Refraction of the sun's position: 'standard' or 'none'."""
        return self.period.refraction

    @property
    def is_of_model(self) -> NDArray[np.bool_]:
        """Receivers on the model rather than on assumed ground; all on a plane."""
        if "part" in self.more and self.kind.is_raster:
            return self.more["part"][1] != GROUND
        if "assumed_ground_share" in self.facts:
            return self.heights > self.ground
        return np.ones(self.shadow_hours.shape, np.bool_)

    @property
    def sun_hours(self) -> NDArray[np.float32]:
        """Hours in the sun, float32."""
        return np.asarray(SunHours(self.up_hours, self.shadow_hours))

    def variables(self) -> Variables:
        """
        Return the arrays of ``study.nc`` by name, each with its dimensions.

        ``in_shadow`` is packed and ``sun_hours`` computed on access: both read like an array.
        """
        in_sun: Any = SunHours(self.up_hours, self.shadow_hours)
        hours: Variables = {
            "shadow_hours": (self.dims, self.shadow_hours), "sun_hours": (self.dims, in_sun),
        }  # fmt: skip
        variables: Variables = {
            **self.laid.coordinates(),
            **time_variables(self.period),
            **(hours if self.has_hours else {}),
            **self.laid.variables(),
            **self.more,
        }
        return variables if self.areas is None else variables | self.areas.variables(variables)

    def to_dataset(self) -> "xr.Dataset":
        """Return the result as a dataset, as ``study.nc`` reads back."""
        return make_dataset(self.variables(), self.facts, self.quantities)


class SunHours:
    """
    Hours in the sun, computed on access to take no memory.

    Parameters
    ----------
    up_hours : float
        Time with the sun above the horizon [h].
    shadow_hours : (...) float32
    """

    dtype = np.dtype(np.float32)

    def __init__(self, up_hours: float, shadow_hours: NDArray[np.float32]) -> None:
        self._up, self._shadow = np.float32(up_hours), shadow_hours
        self.shape, self.ndim, self.size = shadow_hours.shape, shadow_hours.ndim, shadow_hours.size

    def __getitem__(self, key: Any) -> NDArray[np.float32]:
        return self._up - self._shadow[key]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        hours = self._up - self._shadow
        return hours if dtype is None else hours.astype(dtype)


def time_variables(period: Period) -> Variables:
    """Return the time axis and the sun along it; without dates the names of the axes alone."""
    if not period.days:
        return {"xyz": (("xyz",), np.array(["x", "y", "z"]))}
    return {
        "time": (("time",), period.instants.astype("datetime64[ns]")),
        "xyz": (("xyz",), np.array(["x", "y", "z"])),
        "sun_altitude": (("time",), period.sun.altitude),
        "sun_azimuth": (("time",), period.sun.azimuth),
        "sun_direction": (("time", "xyz"), period.sun.direction),
    }


def make_dataset(
    variables: Variables, facts: dict[str, object], quantities: Sequence[Quantity] = ()
) -> "xr.Dataset":
    """
    Make an xarray.Dataset of arrays and attributes; unpack packed masks.

    ``quantities`` are the variables of the study's measures.

    Raises
    ------
    InputError
        If unpacked masks do not fit in memory.
    """
    import xarray as xr  # noqa: PLC0415  (half a second, saved by scripts that only count)

    from umbra.study.lazy_arrays import wrap_lazily  # noqa: PLC0415  (imports xarray, too)

    packed = sum(array.size for _, array in variables.values() if isinstance(array, Masks))
    if packed > find_memory():
        msg = (
            f"in_shadow takes {packed / 1e9:.0f} GB as an array and "
            f"{name_memory(find_memory())}; read it from umbra.study.run_study(...).masks, which "
            "stays packed, or have umbra study with masks=True write it"
        )
        raise InputError(msg, option="masks", bytes=packed)

    arrays, dates = {}, int(str(facts.get("days", 1)))
    for name, (dims, packed_array) in variables.items():
        if isinstance(packed_array, OnDemand) and packed_array.size > _SMALL:
            wrapped = wrap_lazily(packed_array)
            arrays[name] = (dims, wrapped, find_attributes(name, dates, quantities))
            continue
        array = np.asarray(packed_array)
        if not array.flags.writeable:
            array = array.copy()
        if array.dtype.kind == "M":
            array = array.astype("datetime64[ns]")
        arrays[name] = (dims, array, find_attributes(name, dates, quantities))
    return xr.Dataset(arrays, attrs=facts)


AnyStudy = TypeVar("AnyStudy", bound="Study")
_BY_DAY = "_by_day"
_OF_ALL = {"day"}
_DATES = {"days", "first_date", "last_date"}


def split_dates(study: AnyStudy) -> list[AnyStudy]:
    """
    Return a study for each date alone.

    Parameters
    ----------
    study : Study

    Returns
    -------
    studies : list of the same
        Without masks, and without results of the whole period that no date has. The study
        itself, if it has one date or keeps only sums.
    """
    if "shadow_hours_by_day" not in study.more:
        return [study]
    facts = {name: fact for name, fact in study.facts.items() if name not in _DATES}
    hours = study.more["shadow_hours_by_day"][1]
    return [
        replace(
            study,
            period=study.period.pick(day),
            shadow_hours=hours[day],
            up_hours=float(study.more["up_hours_by_day"][1][day]),
            masks=None,
            facts=facts,
            more=_pick(study, day),
            totals=frozenset(),
        )
        for day in range(len(study.period.days))
    ]


def name_dates(study: "Study") -> str:
    """Name the date of the hours in words, or the number of dates summed; nothing without dates."""
    days = study.period.days
    return name_date(days[0]) if len(days) == 1 else tell_dates(study)


def tell_dates(study: "Study") -> str:
    """Tell the date of the hours as 2026-03-21, or the number of dates summed, if there are any."""
    days = study.period.days
    if not days:
        return ""
    return str(days[0]) if len(days) == 1 else f"sum of {len(days)} dates"


def _pick(study: "Study", day: int) -> Variables:
    """Return the further arrays of one date, named as in a study of this date alone."""
    more = study.more
    own: Variables = {
        name.removesuffix(_BY_DAY): (dims[1:], array[day])
        for name, (dims, array) in more.items()
        if name.endswith(_BY_DAY)
    }
    left_out = _OF_ALL | study.totals
    arrays = {
        name: value
        for name, value in more.items()
        if not (name.endswith(_BY_DAY) or name in left_out or "time" in value[0])
    }
    if "shaded_share" in more:
        hours, up = (own[name][1] for name in ("shadow_hours", "up_hours"))
        own["shaded_share"] = (study.dims, find_shaded_share(hours, float(up)))
    for name in ("up_hours", "shadow_hours", "sun_hours"):
        own.pop(name, None)
    return arrays | own
