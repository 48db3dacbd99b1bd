"""Things that float above a level ground: a city on a slope, studied on its lowest point."""

from dataclasses import dataclass

import numpy as np

from umbra.scene import Scene
from umbra.scene.standing import find_standing

__all__ = ["Floating", "find_floating"]

HIGH = 3.0
"""Above the ground by more than this a thing floats [m]."""


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
    feet = low[find_standing(np.stack([low, high], 1)), 2]
    floating = int((feet > ground + HIGH).sum())
    if 2 * floating <= len(feet):
        return None
    return Floating(floating, len(feet), float(np.median(feet)))
