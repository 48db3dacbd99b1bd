"""Things that float above a level ground: a city on a slope, studied on its lowest point."""

from dataclasses import dataclass

import numpy as np

from umbra.scene import Scene

__all__ = ["Floating", "find_floating"]

HIGH = 3.0
"""Above the ground by more than this a thing floats [m]."""
_CELL = 2.0  # things that share a cell may stand on one another [m]
_MOST = 1024  # cells along a side


@dataclass(frozen=True)
class Floating:
    """
    Things that stand on nothing.

    Parameters
    ----------
    count, of : int
        How many stand more than ``HIGH`` above the ground, of how many.
    middle : float
        The height at which half of them all stand, in the model's own coordinates [m].
    """

    count: int
    of: int
    middle: float


def find_floating(scene: Scene, ground: float) -> Floating | None:
    """
    Tell how many things stand high above a level ground, if that are most.

    A thing that has another below it may stand on that, as a roof on its walls: it is
    not counted. Things are parts of one name.

    Parameters
    ----------
    scene : Scene
    ground : float
        z of the ground, in the model's own coordinates [m].

    Returns
    -------
    floating : Floating or None
        None where at most half of the things float.
    """
    soup = scene.triangles()
    thing = np.repeat(scene.groups()[soup.part], 3)
    corners = soup.vertices[soup.faces.ravel()] + scene.origin
    count = int(thing.max(initial=-1)) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, thing, corners)
    np.maximum.at(high, thing, corners)
    there = np.isfinite(low[:, 0])
    low, high = low[there], high[there]
    start = low[:, :2].min(0)
    cell = max(_CELL, float(np.ptp(corners[:, :2], axis=0).max()) / _MOST)
    first = ((low[:, :2] - start) / cell).astype(np.intp)
    last = ((high[:, :2] - start) / cell).astype(np.intp) + 1
    lowest = np.full(tuple(last.max(0)), np.inf)
    windows = [(slice(a, c), slice(b, d)) for (a, b), (c, d) in zip(first, last)]
    for window, z in zip(windows, low[:, 2]):
        np.minimum(lowest[window], z, out=lowest[window])
    on_its_own = [lowest[window].min() > z - 1.0 for window, z in zip(windows, low[:, 2])]
    feet = low[on_its_own, 2]
    floating = int((feet > ground + HIGH).sum())
    if 2 * floating <= len(feet):
        return None
    return Floating(floating, len(feet), float(np.median(feet)))
