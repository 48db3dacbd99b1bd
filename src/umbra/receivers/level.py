"""What ground a model brings, and the height of a level one: where its buildings stand."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.receivers.kind import ReceiverKind
from umbra.scene import Scene
from umbra.scene.derived import derive
from umbra.scene.mesh import find_standing

__all__ = ["GAP", "TERRAIN", "Level", "assume_level", "find_level", "has_terrain"]

TERRAIN = {
    "Raster", "TINRelief", "LandUse", "Road", "Railway", "TransportSquare", "WaterBody",
    "PlantCover", "IfcSite", "IfcGeographicElement",
}  # fmt: skip
"""Kinds of parts that lie on the ground, or are it."""
RELIEF = {"Raster", "TINRelief"}
"""Of these, what is a terrain however little it covers."""
COVERED = 0.2
"""Share of the model's plan, a rectangle, that ground of other kinds covers at least."""
GROUND_SURFACE = "GroundSurface"
STRAY = 0.02
"""Share of a thing's area, and of all things' plans, that may lie far too low by mistake."""
GAP = 3.0
"""So far below all else it then lies, and by so much feet differ that it is told [m]."""


@dataclass(frozen=True)
class Level:
    """
    A height that is taken for the ground's.

    Parameters
    ----------
    middle : float
        Where the middle one of the model's things stands, each by its plan's area; or the middle
        of its ground surfaces. In the model's own coordinates [m].
    low, high : float
        From where to where things stand, one far below all others left out [m].
    things : int
        How many stand on no other.
    """

    middle: float
    low: float
    high: float
    things: int

    def describe(self, level: float) -> dict[str, object]:
        """Tell in attributes where things stand that do not stand on one level."""
        if self.high - self.low <= GAP:
            return {}
        told = (
            f"the ground is assumed level at z = {level:.6g} m; the model's {self.things} things "
            f"that stand on no other do so from {self.low:.6g} to {self.high:.6g} m (ground= "
            "sets it, receivers='top' shows the roofs, a terrain beside the model the land)"
        )
        return {"assumption": told}


def find_level(
    scene: Scene, kind: ReceiverKind, ground: float | None
) -> tuple[float, Level | None]:
    """
    Find the height of the ground.

    Parameters
    ----------
    scene : Scene
    kind : ReceiverKind
        Of the receivers.
    ground : float or None
        As it was asked for.

    Returns
    -------
    level : float
        In the model's own coordinates [m].
    assumed : Level or None
        From what it was taken; None where the caller or the file says it.

    Raises
    ------
    InputError
        If it is not finite.
    """
    known = scene.ground if ground is None else float(ground)
    if known is None:
        assumed = derive(scene, "level", None, lambda: assume_level(scene))
        return kind.choose_level(assumed), assumed
    if not np.isfinite(known):
        msg = f"the ground's height must be a finite number; got {known:g}"
        raise InputError(msg, ground=ground)
    return known, None


def assume_level(scene: Scene) -> Level:
    """
    Find where things stand; one bad polygon far below does not count.

    A thing that has another below it may stand on that, as a roof on its walls. Things are
    parts of one name.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    level : Level
    """
    soup = scene.triangles()
    thing = scene.groups()[soup.part]
    corners = soup.vertices[soup.faces] + scene.origin
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    foot = _find_feet(corners[..., 2].min(1), area, thing)
    kept = np.flatnonzero(np.isfinite(foot))
    low, high = _find_plans(corners, thing, len(foot))
    boxes = np.stack([np.column_stack([low, foot]), np.column_stack([high, foot])], axis=1)
    stands = kept[find_standing(boxes[kept])]
    size = np.prod(np.maximum(high - low, 1e-6), axis=1)[stands]
    feet = foot[stands]
    order = np.argsort(feet, kind="stable")
    feet, size = feet[order], size[order]
    feet, size = _drop_strays(feet, size)
    is_floor = np.array([part.kind == GROUND_SURFACE for part in scene.parts])[soup.part]
    if is_floor.any():
        # A building's own ground surface tells better than the lowest corner of its walls.
        z, weight = corners[is_floor, :, 2].mean(1), np.abs(across[is_floor, 2])
        middle = _find_middle(z, weight)
    else:
        middle = _find_middle(feet, size)
    return Level(middle, float(feet[0]), float(feet[-1]), len(feet))


def _find_feet(
    lowest: NDArray[np.float64], area: NDArray[np.float64], thing: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Return the lowest point of each object, without strays; inf without faces."""
    count = int(thing.max(initial=-1)) + 1
    foot = np.full(count, np.inf)
    np.minimum.at(foot, thing, lowest)
    whole = np.bincount(thing, area, count)
    near = np.bincount(thing, area * (lowest <= foot[thing] + GAP), count)
    for one in np.flatnonzero((near < STRAY * whole) & np.isfinite(foot)):
        mine = np.flatnonzero(thing == one)
        z, share = lowest[mine], area[mine]
        order = np.argsort(z, kind="stable")
        foot[one] = _drop_strays(z[order], share[order])[0][0]
    return foot


def _drop_strays(
    heights: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Leave out the lowest of some sorted heights that are few and lie far below the rest."""
    few = np.cumsum(weights)[:-1] < STRAY * weights.sum()
    gaps = np.flatnonzero((np.diff(heights) > GAP) & few)
    first = int(gaps[-1]) + 1 if len(gaps) else 0
    return heights[first:], weights[first:]


def _find_middle(heights: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    order = np.argsort(heights, kind="stable")
    total = np.cumsum(weights[order])
    return float(heights[order][np.searchsorted(total, total[-1] / 2)])


def _find_plans(
    corners: NDArray[np.float64], thing: NDArray[np.integer], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the bounds of each thing's plan, (count, 2) each."""
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, thing, corners[..., :2].min(1))
    np.maximum.at(high, thing, corners[..., :2].max(1))
    return low, high


def has_terrain(scene: Scene) -> bool:
    """
    Tell whether a model brings ground of its own, and not only a street or a pond.

    Parameters
    ----------
    scene : Scene
    """
    kinds = np.array([part.kind in TERRAIN for part in scene.parts])
    if not kinds.any():
        return False
    if any(part.kind in RELIEF for part in scene.parts):
        return True
    soup = scene.triangles(np.flatnonzero(kinds).tolist())
    a, b, c = (soup.vertices[soup.faces[:, k], :2] for k in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    covered = float(np.abs(x1 * y2 - x2 * y1).sum()) / 2
    return covered >= COVERED * float(np.prod(np.ptp(scene.bounds(), axis=0)[:2]))
