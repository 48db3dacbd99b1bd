"""What a proposal replaces: it stands before the proposal, and is gone after."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count
from umbra.ground.level import TERRAIN
from umbra.packages import need
from umbra.scene import Scene
from umbra.scene.derived import derive

__all__ = [
    "CutObject", "find_on_plot", "find_replaced", "judge_shares", "leave_replaced",
    "measure_inside", "read_outline", "read_polygons", "tell_replaced",
]  # fmt: skip

_WKT = re.compile(r"\s*(MULTI)?(POINT|LINESTRING|POLYGON)\b", re.IGNORECASE)
_MOST = 0.5  # share of an object's plan from which it stands on the plot
_LEAST = 0.01  # share from which it reaches over the plot
_WHOLE = 0.99  # share from which a boundary is not said to cut it
_ROUNDING = 1e-9  # of a share: a boundary through the middle is in the plot
_NAMED = 3


@dataclass(frozen=True)
class CutObject:
    """An object that a boundary cuts: its name, the share of its plan inside, whether it goes."""

    name: str
    share: float
    goes: bool


def leave_replaced(
    scene: Scene, proposed: Sequence[str], patterns: Sequence[str] = (), outline: Any = None
) -> tuple[Scene, list[str]]:
    """
    Leave out of a scene what its proposal replaces, and keep it as ``Scene.replaced``.

    Parameters
    ----------
    scene : Scene
    proposed : sequence of str
        Patterns of the proposal's parts, which stay.
    patterns : sequence of str
        Of the parts that it replaces. Ground and terrain stay.
    outline : path or shapely geometry, optional
        A file of polygons, or polygons in the model's own coordinates: objects are replaced that
        lie in them with half of their plan at least.

    Returns
    -------
    left : Scene
        The scene itself where nothing is asked for, or it was left out before.
    notes : list of str
        What is left out, and what the outline cuts.

    Raises
    ------
    InputError
        If a pattern matches no part, or only ground or the proposal; the outline is wrong; or
        there is no proposal.
    """
    if scene.replaced or not (patterns or outline is not None):
        return scene, []
    if not proposed:
        option = "replace" if patterns else "replace_in"
        msg = f"{option}= is what a proposal replaces; name the proposal's parts with proposed="
        raise InputError(msg, option=option)
    notes: list[str] = []
    where = None
    if outline is not None:
        where, notes = read_outline(outline, scene)
    key = (tuple(proposed), tuple(patterns), None if where is None else where.wkb)

    def make() -> tuple[Scene, list[str]]:
        return _leave(scene, proposed, patterns, where)

    left, remarks = derive(scene, "left", key, make)
    return left, [*notes, *remarks]


def _leave(
    scene: Scene, proposed: Sequence[str], patterns: Sequence[str], where: Any
) -> tuple[Scene, list[str]]:
    new = scene.select(proposed, option="proposed")
    gone, cut = find_replaced(scene, new, patterns, where)
    labels, faces = scene.labels(), sum(scene.parts[k].triangles for k in gone)
    names = list(dict.fromkeys(labels[k] for k in gone))
    notes = tell_replaced(names, faces, cut, has_outline=where is not None)
    if not gone:
        return scene, notes
    parts = tuple(part for k, part in enumerate(scene.parts) if k not in {*gone})
    left = replace(scene, parts=parts, replaced=tuple(scene.parts[k] for k in gone))
    return left, notes


def find_replaced(
    scene: Scene, proposed: Sequence[int], patterns: Sequence[str], outline: Any = None
) -> tuple[list[int], list[CutObject]]:
    """
    Find what a proposal replaces.

    Parameters
    ----------
    scene : Scene
    proposed : sequence of int
        Parts of the proposal.
    patterns : sequence of str
    outline : shapely geometry, optional
        In the model's own coordinates [m].

    Returns
    -------
    parts : list of int
        Ascending; neither ground nor parts of the proposal.
    cut : list of CutObject
        What the outline cuts.

    Raises
    ------
    InputError
        If a pattern matches no part, or only others.
    """
    new = set(proposed)
    stays = {k for k, part in enumerate(scene.parts) if part.kind in TERRAIN}
    gone: set[int] = set()
    for pattern in patterns:
        matched = set(scene.select([pattern], option="replace"))
        if not matched - stays - new:
            what = "parts of the proposal" if matched <= new else "ground, which is not replaced"
            msg = f"replace='{pattern}' matches only {what}; name what stands there"
            raise InputError(msg, option="replace", pattern=pattern)
        gone |= matched - stays - new
    cut: list[CutObject] = []
    if outline is not None:
        old = [k for k in range(len(scene.parts)) if k not in new]
        on_plot, cut = find_on_plot(scene, outline, old)
        gone |= set(on_plot)
    return sorted(gone), cut


def tell_replaced(
    names: Sequence[str], faces: int, cut: Sequence[CutObject], *, has_outline: bool
) -> list[str]:
    """Report the objects that are replaced, with the number of their faces, and those cut."""
    notes = []
    if names:
        objects = show_count(len(names), "object")
        text = (
            f"the proposal replaces {_list_names(names)} ({objects}, {faces:,} triangles): there "
        )
        notes.append(f"{text}before, gone after; ground stays (replace= and replace_in= choose)")
    elif has_outline:
        notes.append("nothing stands in replace_in= with half of its plan, so nothing is replaced")
    for goes, word in ((False, "stay"), (True, "are replaced")):
        listed = [
            f"{item.name} ({100 * item.share:.3g} % inside)" for item in cut if item.goes == goes
        ]
        if listed:
            notes.append(
                f"the boundary of replace_in= cuts {_list_names(listed)}; with "
                f"{'half or more' if goes else 'less than half'} of their plan inside they {word}"
            )
    return notes


def _list_names(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED:,} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def read_outline(outline: Any, scene: Scene, option: str = "replace_in") -> tuple[Any, list[str]]:
    """Read polygons as ``read_polygons`` does, and join them."""
    polygons, notes = read_polygons(outline, scene, option)
    return need("shapely", "gis", option).union_all(polygons), notes


def read_polygons(outline: Any, scene: Scene, option: str) -> tuple[list[Any], list[str]]:
    """
    Read polygons of a file, or check given ones.

    Parameters
    ----------
    outline : path, shapely geometry, or a sequence of them
        GeoJSON, GeoPackage, Shapefile or DXF; or polygons, or their WKT, in the model's own
        coordinates.
    scene : Scene
    option : str
        That they come from, for errors.

    Returns
    -------
    polygons : list of shapely geometries
        In the model's own coordinates [m].
    notes : list of str

    Raises
    ------
    InputError
        If it is no file of polygons, a polygon is not valid, or it lies elsewhere.
    """
    shapely = need("shapely", "gis", option)
    if isinstance(outline, str) and _WKT.match(outline):
        try:
            outline = shapely.from_wkt(outline)
        except shapely.errors.GEOSException as error:
            msg = f"{option}= is not WKT ({error}); write POLYGON((X Y, X Y, X Y, X Y))"
            raise InputError(msg, option=option) from error
    if isinstance(outline, (str, Path)):
        from umbra.readers.area_file import read_areas  # noqa: PLC0415

        try:
            areas, notes = read_areas(outline, scene)
        except InputError as error:
            error.data["option"] = option
            raise
        return [area.polygon for area in areas], list(notes)
    given = list(outline) if isinstance(outline, Sequence) else [outline]
    if not given or not all(isinstance(polygon, shapely.Geometry) for polygon in given):
        msg = f"{option}= is a file, or shapely's polygons in the model's own coordinates"
        raise InputError(msg, option=option)
    for polygon in given:
        is_flat = polygon.geom_type in {"Polygon", "MultiPolygon"}
        if not is_flat or not polygon.is_valid:
            why = shapely.is_valid_reason(polygon) if is_flat else polygon.geom_type
            msg = f"{option}= is not a valid polygon ({why}); correct it"
            raise InputError(msg, option=option)
    return given, []


def find_on_plot(
    scene: Scene, outline: Any, parts: Sequence[int] | None = None
) -> tuple[list[int], list[CutObject]]:
    """
    Find the parts of objects that stand on a plot.

    Parameters
    ----------
    scene : Scene
    outline : shapely geometry
        The plot, in the model's own coordinates [m].
    parts : sequence of int, optional
        Indices of the parts that are looked at; all by default. Ground and terrain are not.

    Returns
    -------
    parts : list of int
        Indices of parts of objects that lie on it with half of their plan at least.
    cut : list of CutObject
        Objects that its boundary cuts.
    """
    shapely = need("shapely", "gis", "areas")
    chosen = range(len(scene.parts)) if parts is None else parts
    standing = [k for k in chosen if scene.parts[k].kind not in TERRAIN]
    low, high = np.array(shapely.bounds(outline)).reshape(2, 2) - scene.origin[:2]
    near = [k for k in standing if _overlaps(scene.parts[k].bounds, low, high)]
    if not near:
        return [], []
    groups = scene.groups()
    near = [k for k in standing if groups[k] in {groups[n] for n in near}]
    soup = scene.triangles(near)
    corners = soup.vertices[soup.faces][..., :2] + scene.origin[:2]
    shares = measure_inside(shapely, corners, groups[soup.part], int(groups.max()) + 1, outline)
    labels = scene.labels()
    goes, is_cut = judge_shares(shares)
    cut = {
        labels[k]: CutObject(labels[k], float(shares[groups[k]]), bool(goes[groups[k]]))
        for k in near
        if is_cut[groups[k]]
    }
    return [k for k in near if goes[groups[k]]], list(cut.values())


def judge_shares(shares: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which objects stand on a plot by their shares in it, and which its boundary cuts."""
    return shares >= _MOST - _ROUNDING, (shares >= _LEAST) & (shares < _WHOLE)


def measure_inside(
    shapely: Any, corners: NDArray[np.float64], owner: NDArray[np.integer], count: int, outline: Any
) -> NDArray[np.float64]:
    """
    Measure the share of the plan of objects that lies in an outline.

    Parameters
    ----------
    shapely : module
    corners : (n, 3, 2) float64
        Of triangles in plan, in the outline's coordinates [m].
    owner : (n,) int
        Object of each triangle, below ``count``.
    count : int
    outline : shapely geometry

    Returns
    -------
    shares : (count,) float64
        By the areas of triangles seen from above; 0 of an object without any.
    """
    (x1, y1), (x2, y2) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    area = np.abs(x1 * y2 - x2 * y1)
    triangles = shapely.polygons(corners)
    shapely.prepare(outline)
    inside = np.zeros(len(triangles))
    whole = shapely.covers(outline, triangles)
    is_cut = ~whole & shapely.intersects(outline, triangles) & (area > 0)
    inside[whole] = area[whole]
    inside[is_cut] = 2 * shapely.area(shapely.intersection(triangles[is_cut], outline))
    total = np.bincount(owner, area, count)
    return np.bincount(owner, inside, count) / np.where(total > 0, total, 1.0)


def _overlaps(
    box: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> bool:
    return bool((box[0, :2] <= high).all() and (box[1, :2] >= low).all())
