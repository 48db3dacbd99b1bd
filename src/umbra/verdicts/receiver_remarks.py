"""What a user should know of receivers whose verdicts may not be meant: far off, buried, or off."""

import numpy as np
from numpy.typing import NDArray

from umbra.errors import show_count
from umbra.packages import need
from umbra.verdicts.subjects import Subjects

__all__ = ["tell_buried", "tell_far", "tell_off_plot"]

_REACH = 10.0  # times the model's height: its shadow when the sun is 5.7 degrees high
_NEAR = 50.0  # of the model, within which nothing is told [m]
_BURIED = 0.1  # below the ground, from which a window is told of [m]
_EAVES = 1.0  # by which a proposal may reach over its plot untold [m]


def tell_far(subjects: Subjects, low: NDArray[np.float64], high: NDArray[np.float64]) -> list[str]:
    """Tell of receivers that no shadow of a model between two corners reaches."""
    plan = subjects.points[:, :2]
    apart = np.hypot(*np.maximum(np.maximum(low[:2] - plan, plan - high[:2]), 0.0).T)
    gap = subjects.find_worst(apart, is_least=True)
    far = np.flatnonzero(gap > max(_REACH * float(high[2] - low[2]), _NEAR))
    if not len(far):
        return []
    first = int(far[0])
    count = f"{len(far):,} of {len(subjects):,} {subjects.kind}"
    note = (
        f"{count} lie farther from the model than its shadows reach, where a verdict says nothing "
        f"(first: '{subjects.names[first]}', {gap[first]:,.0f} m); check their coordinates"
    )
    return [note]


def tell_buried(subjects: Subjects, ground: NDArray[np.float64]) -> list[str]:
    """Tell of windows that lie below the ground (k,) at their places, which casts no shadow."""
    top = np.array([
        window.center[2] + window.height / 2 * window.axes[1][2] for window in subjects.records
    ])  # fmt: skip
    under = np.flatnonzero(top < ground - _BURIED)
    if not len(under):
        return []
    first = int(under[0])
    count = show_count(len(under), "window lies", "windows lie")
    note = (
        f"{count} below the ground, which hides no sun from them (first: "
        f"'{subjects.names[first]}', by {ground[first] - top[first]:.2f} m); check z in windows= "
        "and ground="
    )
    return [note]


def tell_off_plot(plot: object, corners: NDArray[np.float64]) -> list[str]:
    """Tell of a proposal, given its corners (n, 3), that reaches beyond its plot."""
    shapely = need("shapely", "gis", "plot")
    beyond = float(shapely.distance(plot, shapely.points(corners[:, :2])).max(initial=0.0))
    if beyond <= _EAVES:
        return []
    return [f"the proposal reaches {beyond:,.1f} m beyond the plot; check proposed= and plot="]
