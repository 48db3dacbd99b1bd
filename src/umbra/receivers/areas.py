"""
Named areas as receivers: gardens, plots and parks of a file, or parts of the model.

Each is sampled on a lattice of its own (`umbra.receivers.lattice`), whatever the cells of a plan,
so that none is too small to be seen.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count, show_value
from umbra.ground.choice import find_ground
from umbra.ground.level import TERRAIN
from umbra.packages import need
from umbra.rays.nearest_hits import drop_plumb
from umbra.receivers.area_search import find_areas
from umbra.receivers.bands import make_bands, read_bands
from umbra.receivers.counted import Counted
from umbra.receivers.kind import DIMS, Request
from umbra.receivers.lattice import choose_side, cut_polygon
from umbra.receivers.moved_boundary import find_roads, move_areas
from umbra.receivers.named import NamedReceivers
from umbra.receivers.placed import PlacedKind, PlacedSamples
from umbra.scene import Scene
from umbra.scene.grid import Places
from umbra.scene.mesh import ADDED_GROUND
from umbra.scene.named_places import Area

__all__ = [
    "AreaGround", "AreaKind", "AreaLevel", "AreaReceivers", "lay_out_areas", "refuse_outside",
    "tell_sampling",
]  # fmt: skip

_LEVEL = re.compile(r"(ground|mean|top)\s*(?:\+\s*([\d.]+)\s*m?)?")
_COVERED = 0.01  # least share under roofs that is reported
_ABOVE = 0.01  # height above the ground from which something is a roof over it [m]
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class AreaLevel:
    """
    On what areas are judged.

    Parameters
    ----------
    base : {'ground', 'mean', 'top'}
        The ground, the mean height of an area's ground, or the topmost surface.
    above : float
        Height over it [m].
    """

    base: str = "ground"
    above: float = 0.0

    @classmethod
    def of(cls, text: str) -> "AreaLevel":
        """
        Read ``ground``, ``ground+1.5``, ``mean+4`` or ``top``.

        Raises
        ------
        InputError
            If it is none of these.
        """
        match = _LEVEL.fullmatch(text.strip()) if isinstance(text, str) else None
        try:
            assert match is not None
            level = cls(match[1], float(match[2] or 0.0))
        except (AssertionError, ValueError):
            msg = (
                f"areas_on is ground, top, or a plane above either or above the mean ground of "
                f"each area, such as ground+1.5 or mean+4 [m]; got {show_value(text)}"
            )
            raise InputError(msg, option="areas_on") from None
        return level

    def __str__(self) -> str:
        return self.base + (f"+{self.above:g}" if self.above else "")

    def tell(self) -> str:
        """Describe it: ``on the ground``."""
        words = {"ground": "the ground", "mean": "its mean ground", "top": "what is topmost"}
        base = words[self.base]
        return f"{self.above:g} m above {base}" if self.above else f"on {base}"


class AreaKind(PlacedKind):
    """Named areas, each on a lattice of its own."""

    name = noun = "areas"
    spot = "square"
    formats: ClassVar[tuple[str, ...]] = ()
    own_table = "areas.csv"

    def place(self, scene: Scene, options: Any) -> PlacedSamples:
        """Find the squares of areas on level ground at 0; `lay_out` puts them on the ground."""
        raise NotImplementedError

    def lay_out(self, request: Request) -> "AreaReceivers":
        """Cut the areas, and put their samples on the ground."""
        scene, options = request.scene, request.options
        if options.areas is None:
            msg = "receivers='areas' needs areas='FILE'; give a file of polygons"
            raise InputError(msg, option="areas")
        areas, notes = find_areas(scene, options.areas)
        refuse_outside(areas, options.extent)
        model_ground = find_ground(scene, options.ground)
        ground = AreaGround(
            model_ground.level, is_plane=model_ground.is_plane, is_added=model_ground.is_added
        )
        laid = lay_out_areas(self, request, areas, ground)
        level = AreaLevel.of(options.areas_on)
        remarks = tell_sampling(laid.group_names, laid.covered, laid.sides, options.cell, level)
        laid.notes = (*notes, *laid.notes, *remarks)
        laid.facts["areas_sampling"] = laid.notes[-1]
        return laid

    def tell_count(self, study: Any) -> str:
        """Describe the number of squares."""
        return f"{len(study.shadow_hours):,} squares of areas"

    def describe_receivers(self, study: Any) -> str:
        """Describe the areas."""
        count = len(study.laid.records)
        level = AreaLevel.of(str(study.facts["areas_on"])).tell()
        return f"{show_count(count, 'named area')}, judged {level}"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number of squares."""
        return "Squares", f"{len(study.shadow_hours):,}; {study.facts['areas_sampling']}"

    def find_counted(self, study: Any) -> Counted:
        """Weight each square by its area."""
        return Counted(np.isfinite(study.shadow_hours), study.laid.areas, "m²", "areas")


@dataclass(frozen=True)
class AreaGround:
    """
    The ground that areas lie on.

    Parameters
    ----------
    level : float
        Height of the plane, in the model's own coordinates [m].
    is_plane : bool
        Whether it is the plane; else a surface.
    is_added : bool
        Whether the surface is one that was added to the model.
    """

    level: float
    is_plane: bool
    is_added: bool

    @property
    def kinds(self) -> Collection[str]:
        """Kinds of the parts that are ground."""
        return ADDED_GROUND if self.is_added else TERRAIN


@dataclass(eq=False, kw_only=True)
class AreaReceivers(NamedReceivers):
    """
    Areas on lattices of their own.

    Parameters
    ----------
    sides : (n_areas,) float64
        Of the squares [m].
    covered : (n_areas,) float64
        Share under roofs.
    """

    sides: NDArray[np.float64]
    covered: NDArray[np.float64]


def lay_out_areas(
    kind: AreaKind, request: Request, areas: Sequence[Area], ground: AreaGround
) -> AreaReceivers:
    """
    Cut areas, or their bands, and put their samples on the ground.

    Parameters
    ----------
    kind : AreaKind
    request : Request
        Options of areas are read.
    areas : sequence of Area
        In the model's own coordinates.
    ground : AreaGround
    """
    scene, options = request.scene, request.options
    level, mean = AreaLevel.of(options.areas_on), None
    notes: list[str] = []
    if bands := read_bands(options.band):
        plots, within = areas, list[Any]()
        if options.roads is not None:
            within, notes = move_areas(plots, find_roads(scene, options.roads))
        areas, of_plot = make_bands(plots, bands, within)
        if level.base == "mean":
            plan, owner, weights, _ = _cut(plots, None, scene)
            z, _, _ = _drop_to_ground(request, plots, plan, owner, ground)
            mean = _average(z, owner, weights)[of_plot]
    plan, owner, weights, sides = _cut(areas, options.cell, scene)
    points, normals, covered = _stand(request, areas, plan, owner, weights, level, ground, mean)
    shares = np.bincount(owner, weights * covered, len(areas)) / np.bincount(owner, weights)
    return AreaReceivers(
        kind, request.prepare(), (len(points),), DIMS, weights, {"areas_on": str(level)},
        local=Places(points, normals), part=np.full(len(points), -1), areas=weights,
        records=areas, owner=owner, sides=np.array(sides), covered=shares, notes=tuple(notes),
    )  # fmt: skip


def refuse_outside(areas: Sequence[Area], extent: Sequence[float] | None) -> None:
    """Refuse areas that lie outside a stated extent."""
    if extent is None:
        return
    shapely = need("shapely", "gis", "areas")
    frame = shapely.box(*extent)
    out = [area.name for area in areas if not shapely.intersects(frame, area.polygon)]
    if out:
        which = f"the area '{out[0]}' lies" if len(out) == 1 else (
            f"{len(out)} areas lie (first: '{out[0]}')"
        )  # fmt: skip
        msg = f"{which} outside extent=; make it larger, or leave the area out"
        raise InputError(msg, option="areas", area=out[0])


def _cut(
    areas: Sequence[Area], cell: float | None, scene: Scene
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.float64], list[float]]:
    """Return places in local plan, the area of each, their weights, and the squares' sides."""
    sides = [choose_side(area.area_m2, cell) for area in areas]
    pieces = [cut_polygon(area.polygon, side) for area, side in zip(areas, sides, strict=True)]
    owner = np.repeat(np.arange(len(areas)), [len(own) for _, own in pieces])
    weights = np.concatenate([own for _, own in pieces])
    plan = np.concatenate([points for points, _ in pieces]) - scene.origin[:2]
    return plan, owner, weights, sides


def _average(
    z: NDArray[np.float64], owner: NDArray[np.intp], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the mean height of each area."""
    mean: NDArray[np.float64] = np.bincount(owner, weights * z) / np.bincount(owner, weights)
    return mean


def _stand(
    request: Request,
    areas: Sequence[Area],
    plan: NDArray[np.float64],
    owner: NDArray[np.intp],
    weights: NDArray[np.float64],
    level: AreaLevel,
    ground: AreaGround,
    mean: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """
    Return points and normals on what areas are judged on, and which lie under a roof.

    ``mean`` (n_areas,) is the height of a mean ground, by default that of each area [m].
    """
    z, normals, over = _drop_to_ground(request, areas, plan, owner, ground)
    casting = request.prepare()
    floor = float(request.scene.bounds()[0, 2] - request.scene.origin[2]) - 1.0
    covered = np.zeros(len(plan), np.bool_)
    if over:
        tree = casting.with_casters(over).tree
        roof, slope, _ = drop_plumb(tree, plan, floor, request.threads)
        is_above = roof > z + _ABOVE
        if level.base == "top":
            z, normals = np.where(is_above, roof, z), np.where(is_above[:, None], slope, normals)
        else:
            covered = is_above & (roof > z + level.above + _ABOVE)
    if level.base == "mean":
        z = (_average(z, owner, weights) if mean is None else mean)[owner]
    if level.base == "mean" or level.above:
        z, normals = z + level.above, np.tile(_UP, (len(plan), 1))
    return np.column_stack([plan, z]), normals, covered


def _drop_to_ground(
    request: Request,
    areas: Sequence[Area],
    plan: NDArray[np.float64],
    owner: NDArray[np.intp],
    ground: AreaGround,
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[int]]:
    """Return heights and normals of the ground at places, and the parts that may lie over it."""
    scene, casting = request.scene, request.prepare()
    land = [k for k, part in enumerate(scene.parts) if part.kind in ground.kinds]
    canopies = () if request.canopy is None else request.canopy.parts
    apart = {*land, *canopies, *request.gone}
    over = [k for k in range(len(scene.parts)) if k not in apart]
    floor = float(scene.bounds()[0, 2] - scene.origin[2]) - 1.0
    z = np.full(len(plan), ground.level - scene.origin[2])
    normals = np.tile(_UP, (len(plan), 1))
    if not ground.is_plane:
        tree = casting.with_casters(land).tree
        z, normals, _ = drop_plumb(tree, plan, floor, request.threads)
        _fill(areas, plan, owner, z, normals)
    return z, normals, over


def _fill(
    areas: Sequence[Area],
    plan: NDArray[np.float64],
    owner: NDArray[np.intp],
    z: NDArray[np.float64],
    normals: NDArray[np.float64],
) -> None:
    """Give places beside the ground the height of the nearest in their area that is on it."""
    from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

    lacking = np.isnan(z)
    for group in np.unique(owner[lacking]).tolist():
        own = np.flatnonzero(owner == group)
        there, none = own[~lacking[own]], own[lacking[own]]
        if not len(there):
            msg = (
                f"the area '{areas[group].name}' lies where the model has no ground; give ground= "
                "a height [m] or a terrain file that holds it"
            )
            raise InputError(msg, option="areas", area=areas[group].name)
        z[none] = z[there][cKDTree(plan[there]).query(plan[none])[1]]
        normals[none] = _UP


def tell_sampling(
    names: Sequence[str],
    covered: NDArray[np.float64],
    sides: NDArray[np.float64],
    cell: float | None,
    level: AreaLevel,
) -> list[str]:
    """
    Tell of areas that lie under roofs, and last how areas are sampled.

    Parameters
    ----------
    names : sequence of str
    covered : (n_areas,) float64
        Share under roofs.
    sides : (n_areas,) float64
        Of the squares [m].
    cell : float, optional
        Side that was asked for [m].
    level : AreaLevel
    """
    return [*_tell_covered(names, covered), _tell_lattice(sides, cell, level)]


def _tell_covered(names: Sequence[str], shares: NDArray[np.float64]) -> list[str]:
    """Tell of areas of which shares lie under roofs."""
    under = np.flatnonzero(shares > _COVERED)
    if not len(under):
        return []
    most = int(under[np.argmax(shares[under])])
    count = show_count(len(under), "area lies", "areas lie")
    note = (
        f"{count} in part under roofs, where it is in shadow (most: '{names[most]}', "
        f"{100 * shares[most]:.0f} %); draw areas without buildings, or judge what is topmost "
        "(areas_on='top')"
    )
    return [note]


def _tell_lattice(sides: NDArray[np.float64], cell: float | None, level: AreaLevel) -> str:
    """Tell how areas are sampled."""
    low, high = sides.min(), sides.max()
    size = f"{low:.3g} m" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g} m"
    finer = int((sides < cell).sum()) if cell is not None else 0
    small = f"; {finer} too small for cells of {cell:g} m have finer ones" if finer else ""
    return (
        f"each area is judged {level.tell()} on a lattice of its own, squares of {size} "
        f"clipped by its edge and weighted by their area{small}"
    )
