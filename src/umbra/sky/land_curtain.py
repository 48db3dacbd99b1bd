"""The land far away as a caster of the exact sky: a curtain on a circle, up to the horizon."""

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Horizon
from umbra.scene import Mesh, Part, Scene
from umbra.scene.derived import derive

__all__ = ["LAND", "add_land", "find_bends"]

LAND = "land"
"""Name of the object that the land is."""
_AWAY = 1e7
"""Radius of the curtain [m]: 100 m are 0.0006 degrees, as for land at infinity."""
_DEEP = 1e5  # below the model [m]
_STEP = 0.5  # between meridians: great circles leave the horizon by 0.0003 degrees at most
_STRAIGHT = 1e-4  # by which a bend of the horizon is one [degrees]
_STEEPEST = 89.9  # of the land [degrees]


def add_land(scene: Scene, horizon: Horizon | None, true_north: float) -> tuple[Scene, list[int]]:
    """
    Return a scene with the land as its last part, made once, and the numbers of parts that are it.

    Without a horizon, or where it is level, it is the scene itself, and no part.

    Parameters
    ----------
    scene : Scene
    horizon : Horizon, optional
    true_north : float
        Azimuth of true north in the model's plan [degrees].
    """
    if horizon is None or horizon.highest <= 0:
        return scene, []
    land: Horizon = horizon

    def make() -> Scene:
        middle = scene.model_bounds().mean(0) - scene.origin
        mesh = Mesh(*_hang(*find_bends(land), true_north, middle))
        return Scene(
            (*scene.parts, Part(LAND, "Land", mesh, layer="horizon")), scene.origin
        ).with_facts(crs=scene.crs)

    with_land = derive(scene, "land", (land.sha256, true_north), make)
    return with_land, [len(scene.parts)]


def find_bends(land: Horizon) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the azimuths at which the horizon bends, from 0 to 360, and elevations [degrees]."""
    even = np.arange(round(360.0 / _STEP) + 1) * _STEP
    azimuth = np.union1d(even, land.azimuth)
    elevation = np.minimum(land.find_edge(azimuth), _STEEPEST)
    step = np.diff(azimuth)
    share = step[:-1] / (step[:-1] + step[1:])
    line = elevation[:-2] + share * (elevation[2:] - elevation[:-2])
    bends = np.abs(elevation[1:-1] - line) > _STRAIGHT
    is_bend = np.isin(azimuth, even)
    is_bend[1:-1] |= bends
    return azimuth[is_bend], elevation[is_bend]


def _hang(
    azimuth: NDArray[np.float64], elevation: NDArray[np.float64], true_north: float,
    middle: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:  # fmt: skip
    """Make the curtain where the land is above the horizon: vertices, and faces to the inside."""
    angle, count = np.radians(azimuth + true_north), len(azimuth)
    top = np.tan(np.radians(elevation))
    ring = np.column_stack([np.sin(angle), np.cos(angle), top]) * _AWAY
    ring[-1, :2] = ring[0, :2]
    foot = ring.copy()
    foot[:, 2] = -_DEEP
    k = np.flatnonzero((elevation[1:] > 0) | (elevation[:-1] > 0))
    faces = np.concatenate([
        np.column_stack([k, k + count + 1, k + count]), np.column_stack([k, k + 1, k + count + 1])
    ])  # fmt: skip
    return np.concatenate([ring, foot]) + middle, faces.astype(np.int32)
