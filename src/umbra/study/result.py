"""A study's result, and what its files and pictures are made from."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.rays.depth import GROUND
from umbra.receivers import KINDS, ReceiverKind
from umbra.scene.grid import Grid
from umbra.study.attributes import find_attributes
from umbra.study.masks import Masks
from umbra.study.model import Model
from umbra.study.period import Period, Refraction
from umbra.sun import Site, Steps, SunPath

if TYPE_CHECKING:
    import xarray as xr

    from umbra.study.views import ViewModel

__all__ = ["Study"]

Variables = dict[str, tuple[tuple[str, ...], NDArray]]


@dataclass(frozen=True, eq=False)
class Study:
    """
    A study's result and what its pictures are drawn from.

    Parameters
    ----------
    x : (cols,) float64
    y : (rows,) float64
        Cell centres in the model's own coordinates, ascending [m]; of an elevation along
        the view and z; of a camera's picture pixels, upward.
    period : Period
        The time axis: one day, or several.
    shadow_hours : (rows, cols) float32
        In the whole period.
    up_hours : float
        How long the sun was above the horizon [h].
    heights : (rows, cols) float64
        z of the topmost surface or the ground, in the model's own coordinates [m].
    ground : float
        z of the ground [m].
    masks : (n_steps, rows, cols) Masks, optional
        1 where in shadow at a midpoint; 0 at night. Reads like a uint8 array.
    facts : dict
        What the result's attributes say.
    model : Model or ViewModel
    grid : Grid
        In the frame in which ``model`` makes its tiles.
    more : dict
        Further arrays of ``study.nc``, by name, each with its dimensions.
    dims : (str, str)
        Names of the rows' and the columns' axes.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    period: Period
    shadow_hours: NDArray[np.float32]
    up_hours: float
    heights: NDArray[np.float64]
    ground: float
    masks: Masks | None
    facts: dict[str, object]
    model: "Model | ViewModel"
    grid: Grid
    more: Variables = field(default_factory=dict)
    dims: tuple[str, str] = ("y", "x")

    @property
    def site(self) -> Site:
        """Where it is."""
        return self.period.site

    @property
    def steps(self) -> Steps:
        """Steps of the first day."""
        return self.period.steps[0]

    @property
    def sun(self) -> SunPath:
        """The sun at the midpoints of all days' steps."""
        return self.period.sun

    @property
    def receivers(self) -> str:
        """What received the shadows: 'ground', 'top', 'elevation' or 'camera'."""
        return str(self.facts["receivers"])

    @property
    def is_plan(self) -> bool:
        """Whether it is seen from above."""
        return self.dims == ("y", "x")

    @property
    def is_of_model(self) -> NDArray[np.bool_]:
        """Where the model is seen, not a ground assumed below it; everywhere on a plane."""
        if "part" in self.more:
            return self.more["part"][1] != GROUND
        if "assumed_ground_share" in self.facts:
            return self.heights > self.ground
        return np.ones(self.shadow_hours.shape, np.bool_)

    @property
    def kind(self) -> ReceiverKind:
        """How such receivers are told, drawn and written."""
        return KINDS[self.receivers]

    @property
    def refraction(self) -> Refraction:
        """Where the sun was taken to stand: 'standard' or 'none'."""
        return self.period.refraction

    @property
    def sun_hours(self) -> NDArray[np.float32]:
        """Hours in the sun, (rows, cols) float32."""
        return np.float32(self.up_hours) - self.shadow_hours

    def variables(self) -> Variables:
        """
        Give the arrays of ``study.nc`` by name, each with its dimensions.

        ``in_shadow`` is packed: it reads like an array, one instant after another.
        """
        rows, cols = self.dims
        own: Variables = {}
        if self.is_plan:
            level = np.full(self.heights.shape, self.ground)
            own["receiver_z"] = (self.dims, self.heights if self.receivers == "top" else level)
        return {
            cols: ((cols,), self.x),
            rows: ((rows,), self.y),
            **time_variables(self.period),
            "shadow_hours": (self.dims, self.shadow_hours),
            "sun_hours": (self.dims, self.sun_hours),
            **own,
            **self.more,
        }

    def to_dataset(self) -> "xr.Dataset":
        """
        Give the result as a dataset, as ``study.nc`` reads back.

        Returns
        -------
        dataset : xarray.Dataset
        """
        return make_dataset(self.variables(), self.facts)


def time_variables(period: Period) -> Variables:
    """Give the time axis and the sun along it."""
    return {
        "time": (("time",), period.instants.astype("datetime64[ns]")),
        "xyz": (("xyz",), np.array(["x", "y", "z"])),
        "sun_altitude": (("time",), period.sun.altitude),
        "sun_azimuth": (("time",), period.sun.azimuth),
        "sun_direction": (("time", "xyz"), period.sun.direction),
    }


def make_dataset(variables: Variables, facts: dict[str, object]) -> "xr.Dataset":
    """
    Make an xarray.Dataset of arrays and attributes; what is packed is unpacked.

    Raises
    ------
    InputError
        If it does not fit in memory unpacked.
    """
    import xarray as xr  # noqa: PLC0415  (half a second; scripts that only count do without)

    packed = sum(array.size for _, array in variables.values() if not isinstance(array, np.ndarray))
    if packed > find_memory():
        msg = (
            f"in_shadow takes {packed / 1e9:.0f} GB as an array and "
            f"{name_memory(find_memory())}; read it from umbra.study.run_study(...).masks, which "
            "stays packed, or have umbra study with masks=True write it"
        )
        raise InputError(msg, bytes=packed)

    arrays, dates = {}, int(str(facts.get("days", 1)))
    for name, (dims, packed_array) in variables.items():
        array = np.asarray(packed_array)
        if array.dtype.kind == "M":
            array = array.astype("datetime64[ns]")
        arrays[name] = (dims, array, find_attributes(name, dates))
    return xr.Dataset(arrays, attrs=facts)
