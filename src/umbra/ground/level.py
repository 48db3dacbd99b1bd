"""Ground of a model, and the assumed height of level ground: the base of its buildings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.ground.feet import Feet, find_base_faces
from umbra.kernels import kernel
from umbra.scene import Scene
from umbra.scene.mesh import ADDED_GROUND, find_standing

__all__ = [
    "EARTH", "GAP", "TERRAIN", "Bases", "Level", "Terrain", "check_stated",
    "has_terrain", "measure_bases", "measure_terrain", "settle_level",
]  # fmt: skip

TERRAIN = {
    "Raster", "TINRelief", "LandUse", "Road", "Railway", "TransportSquare", "WaterBody",
    "PlantCover", "IfcSite", "IfcGeographicElement",
    *ADDED_GROUND,
}  # fmt: skip
"""Kinds of parts that are ground, or lie on it."""
_AFLOAT = TERRAIN | {
    "Bridge", "BridgePart", "BridgeConstructiveElement", "BridgeInstallation", "Tunnel",
    "TunnelPart", "SolitaryVegetationObject", "Canopy", "Waterway",
}  # fmt: skip
"""Kinds of parts that show nothing of the ground's height."""
RELIEF = {"Raster", "TINRelief", *ADDED_GROUND}
"""Kinds that are terrain at any coverage."""
EARTH = RELIEF | {"LandUse", "IfcSite", "IfcGeographicElement"}
"""Kinds with earth below them, whatever they hold; a road may lie on a bridge."""
COVERED = 0.2
"""Least share of the model's plan rectangle that ground of other kinds covers."""
GROUND_SURFACE = "GroundSurface"
STRAY = 0.02
"""Share of an object's area, and of all objects' plans, that may be stray and far too low."""
_LEAST = 2.0  # height of what has a foot: decks, slabs and paving are lower [m]
GAP = 3.0
"""Least distance of strays below the rest, and least difference of bases to report [m]."""


@dataclass(frozen=True)
class Level:
    """
    Assumed height of the ground.

    Parameters
    ----------
    middle : float
        Median base of the model's objects, weighted by plan area; or median of its ground
        surfaces. In the model's own coordinates [m].
    low, high : float
        Lowest and highest base of objects, without strays far below [m].
    things : int
        Number of objects that stand on no other.
    is_read : bool
        Whether ground surfaces of the file state the middle.
    """

    middle: float
    low: float
    high: float
    things: int
    is_read: bool

    def describe(self, level: float) -> dict[str, object]:
        """Return attributes of the objects' bases, if they are not level, nor known, nor 0."""
        is_plain = self.is_read or level == 0
        if self.high - self.low <= GAP:
            note = (
                f"the ground is assumed level at z = {level:.6g} m, the base of the model with any "
                "foundations and cellars (ground= sets it)"
            )
            return {} if is_plain else {"assumption": note}
        note = (
            f"the ground is assumed level at z = {level:.6g} m; {self.things:,} objects stand at "
            f"{self.low:.6g} to {self.high:.6g} m, so one level suits few of them (ground= sets "
            "another: 'feet', a height or a terrain file)"
        )
        return {"assumption": note}


@dataclass(frozen=True, eq=False)
class Bases:
    """
    Bases of a model's objects.

    Parameters
    ----------
    boxes : (n, 2, 3) float64
        Bounds of each object's plan, both at the height of its base; own coordinates [m].
    floors : (m, 2) float64
        Mean height [m] and twice the plan area [m2] of each face of ground surfaces.
    feet : Feet
        Their base faces; owners are indices of ``boxes``.
    objects : (n,) int64
        Index of each box among the model's objects.
    floor_objects : (m,) int64
        Index of the object of each face of ground surfaces.
    """

    boxes: NDArray[np.float64]
    floors: NDArray[np.float64]
    feet: Feet
    objects: NDArray[np.int64]
    floor_objects: NDArray[np.int64]

    def without(self, objects: NDArray[np.integer]) -> "Bases":
        """Return the bases of the other objects."""
        is_left = ~np.isin(self.objects, objects)
        owner, own = np.cumsum(is_left) - 1, is_left[self.feet.owner]
        feet = Feet(self.feet.corners[own], owner[self.feet.owner[own]])
        floors = ~np.isin(self.floor_objects, objects)
        return Bases(
            self.boxes[is_left], self.floors[floors], feet, self.objects[is_left],
            self.floor_objects[floors],
        )  # fmt: skip


@dataclass(frozen=True)
class Terrain:
    """Ground that models bring: whether it is relief, and its area in plan [m2]."""

    is_relief: bool
    area: float

    def holds(self, bounds: NDArray[np.float64]) -> bool:
        """Return whether it is more than a street or a pond in a model's bounds (2, 3)."""
        return self.is_relief or (
            self.area > 0 and self.area >= COVERED * float(np.prod(np.ptp(bounds, axis=0)[:2]))
        )


def check_stated(scene: Scene, level: float) -> dict[str, object]:
    """Return an attribute that tells of a stated ground above the model or far below it."""
    if not scene.parts:  # of a city in tiles, which is never in memory as a whole
        return {}
    low, high = scene.bounds()[:, 2]
    if low - GAP <= level < high:
        return {}
    where = "above the whole model" if level >= high else f"{low - level:.6g} m below the model"
    note = (
        f"the ground at z = {level:.6g} m lies {where}, which reaches from z = {low:.6g} to "
        f"{high:.6g} m; ground= is a height in the model's own coordinates"
    )
    return {"assumption": note}


def measure_bases(scene: Scene) -> Bases:
    """
    Measure the bases of a model's objects.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    bases : Bases
    """
    soup = scene.triangles()
    group = scene.groups()[soup.part]
    count = int(group.max(initial=-1)) + 1
    faces, low, high = _measure(soup.vertices + scene.origin, soup.faces, group, count)
    lowest, area, flat, middle_z = faces
    foot = _find_feet(lowest, area, group, low[:, 2])
    has_foot = np.isfinite(foot)
    with np.errstate(invalid="ignore"):
        stands_on = np.where(high[:, 2] - foot >= _LEAST, foot, np.inf)
    low[:, 2] = high[:, 2] = foot
    is_floor = np.array([part.kind == GROUND_SURFACE for part in scene.parts])[soup.part]
    floors = np.stack([middle_z[is_floor], flat[is_floor]], axis=1)
    stands = np.array([part.kind not in _AFLOAT for part in scene.parts])[soup.part]
    corners = (soup.vertices + scene.origin)[soup.faces[stands]]
    feet = find_base_faces(corners, group[stands], is_floor[stands], stands_on)
    feet = Feet(feet.corners, (np.cumsum(has_foot) - 1)[feet.owner])
    boxes, objects = np.stack([low, high], axis=1)[has_foot], np.flatnonzero(has_foot)
    return Bases(boxes, floors, feet, objects, group[is_floor].astype(np.int64))


def settle_level(bases: Bases) -> Level:
    """Find the base of objects, without stray polygons far below."""
    boxes = bases.boxes[find_standing(bases.boxes)]
    size = np.prod(np.maximum(boxes[:, 1] - boxes[:, 0], 1e-6)[:, :2], axis=1)
    feet = boxes[:, 0, 2]
    order = np.argsort(feet, kind="stable")
    feet, size = feet[order], size[order]
    feet, size = _drop_strays(feet, size)
    # A building's ground surface is more reliable than its walls' lowest corner.
    is_read = len(bases.floors) > 0
    middle = _find_middle(*(bases.floors.T if is_read else (feet, size)))
    return Level(middle, float(feet[0]), float(feet[-1]), len(feet), is_read)


@kernel
def _measure(vertices, faces, group, count):
    """
    Measure the faces, and bound the objects that they belong to.

    Returns (4, n_faces): lowest z, twice the area, twice the plan area, and mean z of the
    corners; and the objects' bounds, (count, 3) twice.
    """
    measures = np.zeros((4, faces.shape[0]))
    low = np.full((count, 3), np.inf)
    high = np.full((count, 3), -np.inf)
    for f in range(faces.shape[0]):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        measures[0, f] = min(a[2], b[2], c[2])
        measures[1, f] = np.sqrt(nx * nx + ny * ny + nz * nz)
        measures[2, f] = abs(nz)
        measures[3, f] = (a[2] + b[2] + c[2]) / 3.0
        for axis in range(3):
            low[group[f], axis] = min(low[group[f], axis], a[axis], b[axis], c[axis])
            high[group[f], axis] = max(high[group[f], axis], a[axis], b[axis], c[axis])
    return measures, low, high


def _find_feet(
    lowest: NDArray[np.float64],
    area: NDArray[np.float64],
    group: NDArray[np.integer],
    foot: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the lowest point of each object, without strays; inf without faces."""
    foot, count = foot.copy(), len(foot)
    whole = np.bincount(group, area, count)
    near = np.bincount(group, area * (lowest <= foot[group] + GAP), count)
    for index in np.flatnonzero((near < STRAY * whole) & np.isfinite(foot)):
        own = np.flatnonzero(group == index)
        z, share = lowest[own], area[own]
        order = np.argsort(z, kind="stable")
        foot[index] = _drop_strays(z[order], share[order])[0][0]
    return foot


def _drop_strays(
    heights: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Drop the lowest of sorted heights that are few and lie far below the rest."""
    few = np.cumsum(weights)[:-1] < STRAY * weights.sum()
    gaps = np.flatnonzero((np.diff(heights) > GAP) & few)
    first = int(gaps[-1]) + 1 if len(gaps) else 0
    return heights[first:], weights[first:]


def _find_middle(heights: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    order = np.argsort(heights, kind="stable")
    total = np.cumsum(weights[order])
    return float(heights[order][np.searchsorted(total, total[-1] / 2)])


def has_terrain(scene: Scene) -> bool:
    """
    Return whether a model has its own ground, more than a street or a pond.

    Parameters
    ----------
    scene : Scene
    """
    terrain = measure_terrain(scene)
    return terrain.is_relief or (terrain.area > 0 and terrain.holds(scene.bounds()))


def measure_terrain(scene: Scene) -> Terrain:
    """Measure the ground that a model brings."""
    kinds = np.array([part.kind in TERRAIN for part in scene.parts])
    if not kinds.any():
        return Terrain(is_relief=False, area=0.0)
    is_relief = any(part.kind in RELIEF for part in scene.parts)
    soup = scene.triangles(np.flatnonzero(kinds).tolist())
    a, b, c = (soup.vertices[soup.faces[:, k], :2] for k in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    return Terrain(is_relief, float(np.abs(x1 * y2 - x2 * y1).sum()) / 2)
