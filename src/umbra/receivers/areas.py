"""
Named areas as receivers: gardens, plots and parks of a file, or parts of the model.

Each is sampled on a lattice of its own (`umbra.receivers.lattice`), whatever the cells of a plan,
so that none is too small to be seen.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.ground.choice import find_ground
from umbra.ground.level import TERRAIN
from umbra.options import is_area_file
from umbra.packages import need
from umbra.rays.nearest_hits import drop_plumb
from umbra.readers.area_file import AreaFile, check_polygon, load_areas, place_areas
from umbra.receivers.bands import make_bands, read_bands
from umbra.receivers.counted import Counted
from umbra.receivers.kind import DIMS, Request
from umbra.receivers.lattice import choose_side, cut_polygon
from umbra.receivers.named import NamedReceivers
from umbra.receivers.placed import PlacedKind, PlacedSamples
from umbra.scene import Scene
from umbra.scene.grid import Places
from umbra.scene.mesh import ADDED_GROUND
from umbra.scene.named_places import Area

__all__ = ["AreaKind", "AreaLevel", "check_areas", "find_areas"]

_LEVEL = re.compile(r"(ground|mean|top)\s*(?:\+\s*([\d.]+)\s*m?)?")
_GRID = 1e-6  # corners of parts that are nearer are one [m]
_COVERED = 0.01  # share under roofs from which it is told
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
        found = _LEVEL.fullmatch(text.strip()) if isinstance(text, str) else None
        try:
            assert found is not None
            level = cls(found[1], float(found[2] or 0.0))
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


def check_areas(asked: Any) -> Any:
    """Read a file of areas that is asked for; return all else as it is."""
    if is_area_file(asked):
        return load_areas(Path(asked))
    is_right = isinstance(asked, (str, Mapping, AreaFile)) or hasattr(asked, "geometry")
    if not is_right and isinstance(asked, Sequence):
        is_right = len(asked) > 0 and all(isinstance(one, (str, Area)) for one in asked)
    if not is_right:
        msg = (
            "areas is a file of polygons, a pattern of the model's parts or kinds, a GeoDataFrame, "
            f"or polygons by name; got {show_value(asked)}"
        )
        raise InputError(msg, option="areas")
    return asked


def find_areas(scene: Scene, asked: Any) -> tuple[list[Area], list[str]]:
    """
    Find areas in a model's own coordinates.

    Parameters
    ----------
    scene : Scene
    asked : path, str, sequence of str, AreaFile, mapping, sequence of Area, or GeoDataFrame
        A file; patterns of parts and kinds of the model; polygons by name.

    Returns
    -------
    areas : list of Area
    notes : list of str

    Raises
    ------
    InputError
        If there are none, one is no valid polygon, two have one name, or they lie elsewhere.
    """
    asked = check_areas(asked)
    if isinstance(asked, AreaFile):
        return place_areas(asked, scene)
    if isinstance(asked, str) or (
        isinstance(asked, Sequence) and all(isinstance(one, str) for one in asked)
    ):
        return _find_parts(scene, (asked,) if isinstance(asked, str) else asked), []
    shapely = need("shapely", "gis", "areas")
    if isinstance(asked, Mapping):
        given, crs = [Area(str(name), polygon) for name, polygon in asked.items()], None
    elif hasattr(asked, "geometry"):
        given, crs = _read_frame(asked), None if asked.crs is None else asked.crs.to_wkt()
    else:
        given, crs = list(asked), None
    names = set()
    for area in given:
        check_polygon(shapely, area.name, area.polygon)
        if area.name in names:
            msg = f"2 areas are called '{area.name}'; give each a name of its own"
            raise InputError(msg, option="areas", area=area.name, count=2)
        names.add(area.name)
    if not given:
        msg = "areas= holds no polygon; give one at least"
        raise InputError(msg, option="areas")
    areas, notes = place_areas(AreaFile(Path("areas="), tuple(given), crs, is_guess=False), scene)
    return areas, [note for note in notes if crs is not None]


def _read_frame(frame: Any) -> list[Area]:
    """Return the rows of a GeoDataFrame, named by their column ``name``, else by the index."""
    names = frame["name"] if "name" in frame.columns else frame.index
    return [Area(str(name), polygon) for name, polygon in zip(names, frame.geometry, strict=True)]


def _find_parts(scene: Scene, patterns: Sequence[str]) -> list[Area]:
    """Return the plans of parts of the model that patterns match, one area for each object."""
    shapely = need("shapely", "gis", "areas")
    parts, labels = scene.select(patterns, option="areas"), scene.labels()
    found = []
    for name in dict.fromkeys(labels[k] for k in parts):
        soup = scene.triangles([k for k in parts if labels[k] == name])
        corners = soup.vertices[soup.faces][..., :2]
        u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        lies = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > _GRID * _GRID
        whole = shapely.union_all(shapely.polygons(corners[lies]), grid_size=_GRID)
        kept = [one for one in shapely.get_parts(whole) if shapely.get_type_id(one) == 3]
        if kept:
            shape = kept[0] if len(kept) == 1 else shapely.multipolygons(kept)
            origin = scene.origin[:2]
            found.append(Area(name, shapely.transform(shape, lambda p, o=origin: p + o)))
    if not found:
        msg = f"areas='{', '.join(patterns)}' matches only upright parts, which have no plan"
        raise InputError(msg, option="areas")
    return found


class AreaKind(PlacedKind):
    """Named areas, each on a lattice of its own."""

    name = "areas"
    spot = "square"
    formats: ClassVar[tuple[str, ...]] = ()
    own_table = "areas.csv"

    def place(self, scene: Scene, options: Any) -> PlacedSamples:
        """Find the squares of areas on level ground at 0; `lay_out` puts them on the ground."""
        raise NotImplementedError

    def lay_out(self, request: Request) -> NamedReceivers:
        """Cut the areas, and put their samples on the ground."""
        scene, options = request.scene, request.options
        if options.areas is None:
            msg = "receivers='areas' needs areas='FILE'; give a file of polygons"
            raise InputError(msg, option="areas")
        areas, notes = find_areas(scene, options.areas)
        _refuse_outside(areas, options.extent)
        level, mean = AreaLevel.of(options.areas_on), None
        if bands := read_bands(options.band):
            plots = areas
            areas, of_plot = make_bands(plots, bands)
            if level.base == "mean":
                plan, owner, weights, _ = _cut(plots, None, scene)
                z, _, _ = _drop_to_ground(request, plots, plan, owner)
                mean = _average(z, owner, weights)[of_plot]
        plan, owner, weights, sides = _cut(areas, options.cell, scene)
        points, normals, covered = _stand(request, areas, plan, owner, weights, level, mean)
        notes += _tell_covered(areas, owner, weights, covered)
        told = _tell_lattice(sides, options.cell, level)
        return NamedReceivers(
            self, request.prepare(), (len(points),), DIMS, weights,
            {"areas_on": str(level), "areas_sampling": told},
            local=Places(points, normals), part=np.full(len(points), -1), areas=weights,
            records=areas, owner=owner, notes=(*notes, told),
        )  # fmt: skip

    def describe_receivers(self, study: Any) -> str:
        """Describe the areas."""
        count = len(study.laid.records)
        level = AreaLevel.of(str(study.facts["areas_on"])).tell()
        return f"{count:,} named area{'s' if count > 1 else ''}, judged {level}"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number of squares."""
        return "Squares", f"{len(study.shadow_hours):,}; {study.facts['areas_sampling']}"

    def find_counted(self, study: Any) -> Counted:
        """Weight each square by its area."""
        return Counted(np.isfinite(study.shadow_hours), study.laid.areas, "m²", "areas")


def _refuse_outside(areas: Sequence[Area], extent: Sequence[float] | None) -> None:
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
    mean: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """
    Return points and normals on what areas are judged on, and which lie under a roof.

    ``mean`` (n_areas,) is the height of a mean ground, by default that of each area [m].
    """
    z, normals, over = _drop_to_ground(request, areas, plan, owner)
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
    request: Request, areas: Sequence[Area], plan: NDArray[np.float64], owner: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[int]]:
    """Return heights and normals of the ground at places, and the parts that may lie over it."""
    scene, casting = request.scene, request.prepare()
    ground = find_ground(scene, request.options.ground)
    kinds = ADDED_GROUND if ground.is_added else TERRAIN
    land = [k for k, part in enumerate(scene.parts) if part.kind in kinds]
    canopies = () if request.canopy is None else request.canopy.parts
    over = [k for k in range(len(scene.parts)) if k not in {*land, *canopies}]
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


def _tell_covered(
    areas: Sequence[Area],
    owner: NDArray[np.intp],
    weights: NDArray[np.float64],
    covered: NDArray[np.bool_],
) -> list[str]:
    """Tell of areas that lie under roofs."""
    shares = np.bincount(owner, weights * covered, len(areas)) / np.bincount(owner, weights)
    under = np.flatnonzero(shares > _COVERED)
    if not len(under):
        return []
    most = int(under[np.argmax(shares[under])])
    count = "1 area lies" if len(under) == 1 else f"{len(under)} areas lie"
    told = (
        f"{count} in part under roofs, where it is in shadow (most: '{areas[most].name}', "
        f"{100 * shares[most]:.0f} %); draw areas without buildings, or judge what is topmost "
        "(areas_on='top')"
    )
    return [told]


def _tell_lattice(sides: Sequence[float], cell: float | None, level: AreaLevel) -> str:
    """Tell how areas are sampled."""
    low, high = min(sides), max(sides)
    size = f"{low:.3g} m" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g} m"
    finer = sum(side < cell for side in sides) if cell is not None else 0
    small = f"; {finer} too small for cells of {cell:g} m have finer ones" if finer else ""
    return (
        f"each area is judged {level.tell()} on a lattice of its own, squares of {size} "
        f"clipped by its edge and weighted by their area{small}"
    )
