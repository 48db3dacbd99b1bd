"""
The ground of a model.

It is what a caller or the file states; else terrain that the file brings; else, where the feet of
buildings differ by more than a storey, a surface through them; else the plane at their median.

The ground of a file beside the model: a terrain raster, or any mesh of the land.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count
from umbra.ground.feet import find_cellars
from umbra.ground.level import (
    GAP,
    Bases,
    Level,
    has_terrain,
    measure_bases,
    settle_level,
)
from umbra.ground.surface import AWAY, FeetSurface, make_surface
from umbra.ground_option import FEET, LEVEL, Asked, check_ground, is_file
from umbra.scene import Material, Mesh, Part, Scene
from umbra.scene.derived import derive
from umbra.scene.exposure import GROUND_COLOR
from umbra.scene.mesh import ADDED_GROUND, ASSUMED, ASSUMED_UNDER, GIVEN, find_standing

__all__ = [
    "Ground",
    "add_file_ground",
    "choose_feet",
    "describe_surface",
    "find_ground",
    "keep_ground",
    "make_ground_parts",
    "tell_feet",
]


def add_file_ground(
    scene: Scene, name: str, bounds: NDArray[np.float64], boxes: NDArray[np.float64]
) -> tuple[Scene, list[str]]:
    """
    Add the land of a file to a model.

    Parameters
    ----------
    scene : Scene
    name : str
        Of the file, in the model's coordinate reference system or one that says which it is.
    bounds : (2, 3) float64
        Of the model [m].
    boxes : (n, 2, 3) float64
        Bounds of the plan of each object, both at the height of its base [m].

    Returns
    -------
    scene : Scene
        With the land as its last part.
    notes : list of str
        What reading the file assumed; whether the model floats over the land, is sunk in it, or
        stands beyond it.

    Raises
    ------
    InputError
        If the file cannot be read, or lies elsewhere.
    """
    from umbra.readers import read  # noqa: PLC0415 (it loads all formats)
    from umbra.readers.georeference import bring_to, is_same_plan  # noqa: PLC0415
    from umbra.readers.terrain import find_gaps  # noqa: PLC0415

    if not Path(name).exists():
        msg = (
            f"ground is 'feet', 'level', a height [m] or a terrain file; no file is named '{name}'"
        )
        raise InputError(msg, option="ground")
    land = read(name)
    soup = land.triangles()
    part = Part("ground", GIVEN, Mesh(soup.vertices + land.origin, soup.faces))
    if land.crs and scene.crs and not is_same_plan(land.crs, scene.crs):
        (part,) = bring_to((part,), land.crs, scene.crs, is_high_in_metres=True)
    _check_place(bounds, part, name)
    short = Path(name).name
    notes = [*land.notes, *find_gaps("model", boxes, short, [part])]
    notes += _tell_beyond(boxes, short, part)
    vertices = part.mesh.vertices - scene.origin
    part = replace(
        part, mesh=Mesh(vertices, part.mesh.faces), material=Material(color=GROUND_COLOR)
    )
    sources = (*scene.sources, *(replace(source, is_companion=True) for source in land.sources))
    return replace(scene, parts=(*scene.parts, part), sources=sources), notes


def _tell_beyond(boxes: NDArray[np.float64], name: str, part: Part) -> list[str]:
    """Report buildings whose middle lies outside the land."""
    from umbra.readers.terrain import find_terrain_height  # noqa: PLC0415 (it loads all formats)

    boxes = boxes[find_standing(boxes)]
    beyond = ~find_terrain_height([part], boxes[:, :, :2].mean(1))[1] if len(boxes) else np.zeros(0)
    if not beyond.any():
        return []
    count = f"{int(beyond.sum()):,} of {len(boxes):,}"
    note = (
        f"{count} objects stand where '{name}' has no land, and no hours are counted there; "
        "give a terrain that holds the model and its shadows, or ground='feet'"
    )
    return [note]


def _check_place(bounds: NDArray[np.float64], part: Part, name: str) -> None:
    """Refuse land that no part of the model stands on."""
    (low, high), box = bounds[:, :2], part.bounds[:, :2]
    gap = np.maximum(np.maximum(box[0] - high, low - box[1]), 0.0)
    if not gap.any():
        return
    away = math.hypot(*gap.tolist())
    where = ", ".join(f"{a:.6g} to {b:.6g}" for a, b in zip(*box.tolist(), strict=True))
    msg = (
        f"ground= '{name}' lies {away:,.0f} m from the model, at {where}; give a terrain of the "
        "place, in the coordinates of the model"
    )
    raise InputError(msg, option="ground", distance=away)


_NAMES = "assumed ground", "assumed ground under buildings"


@dataclass(frozen=True, eq=False)
class Ground:
    """
    The ground of a model.

    Parameters
    ----------
    scene : Scene
        The model, with the surface of its ground where umbra adds one.
    level : float
        Height of the ground's plane; where the ground is no plane, of the lowest foot. In the
        model's own coordinates [m].
    is_plane : bool
        Whether the ground is the plane.
    assumed : Level, optional
        Basis of the height; None if the caller or the file states it.
    surface : FeetSurface, optional
        The surface that umbra assumes.
    file : str
        Name of the file whose land it is.
    notes : tuple of str
        What does not fit about that file.
    """

    scene: Scene
    level: float
    is_plane: bool
    assumed: Level | None = None
    surface: FeetSurface | None = None
    file: str = ""
    notes: tuple[str, ...] = ()

    @property
    def is_added(self) -> bool:
        """Whether the scene holds a surface that umbra added."""
        return any(part.kind in ADDED_GROUND for part in self.scene.parts)

    @property
    def lowest(self) -> float:
        """Its lowest height: land of a file may lie below every foot [m]."""
        scene = self.scene
        added = (part.bounds[0, 2] for part in scene.parts if part.kind in ADDED_GROUND)
        return min([self.level, *(float(z + scene.origin[2]) for z in added)])

    @property
    def name(self) -> str:
        """What the ground is, for the foot of a picture: ``ground at z = 36.2 m``."""
        if self.surface is not None:
            return f"ground assumed, {tell_feet(self.surface)}"
        if self.file:
            return f"ground of {self.file}"
        if not self.is_plane:
            return "ground of the model"
        how = "" if self.assumed is None else " assumed, level"
        return f"ground{how} at z = {self.level:.6g} m"

    def describe(self) -> dict[str, object]:
        """Return attributes of a result on the surface that umbra assumes; none on another."""
        if self.surface is not None:
            return describe_surface(self.surface)
        return {"assumption": "; ".join(self.notes)} if self.notes else {}


def tell_feet(surface: FeetSurface) -> str:
    """Return what an assumed surface goes through."""
    return f"through the feet of {show_count(surface.buildings, 'building')}"


def describe_surface(surface: FeetSurface) -> dict[str, object]:
    """Return the attributes of an assumed surface, and how much rests on the assumption."""
    note = (
        f"the ground is assumed, {tell_feet(surface)}, as the file brings no terrain; "
        f"{100 * surface.far_share:.2g} % of the area around the buildings lies more than "
        f"{AWAY:g} m from a foot, and 1 % of the ground between them is steeper than "
        f"{100 * surface.steepest:.2g} % (ground= takes a terrain file, 'level' or a height)"
    )
    return {
        "assumption": note, "ground_feet": surface.buildings,
        "ground_far_share": surface.far_share, "ground_steepest_slope": surface.steepest,
    }  # fmt: skip


def find_ground(scene: Scene, ground: Asked = None, hanging: Sequence[int] = ()) -> Ground:
    """
    Find the ground of a model.

    Parameters
    ----------
    scene : Scene
        With or without a surface that this function added.
    ground : float or str, optional
        As asked for, see `umbra.ground_option.check_ground`; None chooses.
    hanging : sequence of int, optional
        Indices of parts that stand on no ground, such as crowns of trees: they tell nothing of
        its height. The scene that is returned keeps the ground that was found without them.

    Returns
    -------
    ground : Ground

    Raises
    ------
    InputError
        If it is not finite, its file is wrong, or no building has a foot.
    """
    choice = check_ground("ground", ground)
    is_known = isinstance(scene.ground if choice is None else choice, float | int)
    afloat = () if is_known else tuple(hanging)

    def find() -> Ground:
        model_ground = _find(scene, choice, afloat)
        for known in {(), afloat}:
            derive(model_ground.scene, "ground", (choice, known), lambda: model_ground)
        return model_ground

    return derive(scene, "ground", (choice, afloat), find)


def keep_ground(
    ground: Ground, scene: Scene, choice: Asked = None, hanging: Sequence[int] = ()
) -> Ground:
    """
    Return a ground under fewer parts, for which it is found again without a search.

    Parameters
    ----------
    ground : Ground
    scene : Scene
        With the parts that are left.
    choice : float or str, optional
    hanging : sequence of int, optional
        As of ``find_ground``; indices in this scene.
    """
    reduced = replace(ground, scene=scene)
    for known in {(), tuple(hanging)}:
        derive(scene, "ground", (check_ground("ground", choice), known), lambda: reduced)
    return reduced


def _find(scene: Scene, choice: Asked, hanging: tuple[int, ...]) -> Ground:
    own = [k for k, part in enumerate(scene.parts) if part.kind not in ADDED_GROUND]
    standing = [scene.parts[k] for k in own if k not in set(hanging)]
    if len(own) < len(scene.parts) or hanging:  # another scene, to keep another ground
        scene = replace(scene, parts=tuple(scene.parts[k] for k in own))
    known = scene.ground if choice is None else choice
    if isinstance(known, float | int):
        return Ground(scene, float(known), is_plane=True)
    grounded = scene if len(standing) in {0, len(own)} else replace(scene, parts=tuple(standing))
    bases = measure_bases(grounded)
    level = settle_level(bases)
    if is_file(choice):
        with_land, notes = add_file_ground(scene, str(choice), scene.bounds(), bases.boxes)
        return Ground(
            with_land, level.low, is_plane=False, assumed=level, file=Path(str(choice)).name,
            notes=tuple(notes),
        )  # fmt: skip
    if choice is None and has_terrain(scene):
        return Ground(scene, level.low, is_plane=False, assumed=level)
    surface = choose_feet(bases, level, scene.bounds(), choice)
    if surface is None:
        return Ground(scene, level.middle, is_plane=True, assumed=level)
    settled = replace(scene, parts=(*scene.parts, *make_ground_parts(surface, scene.origin)))
    return Ground(settled, level.low, is_plane=False, assumed=level, surface=surface)


def choose_feet(bases: Bases, level: Level, bounds: Any, choice: Asked) -> FeetSurface | None:
    """
    Make the surface through the feet where they are asked for, or differ by more than a storey.

    Parameters
    ----------
    bases : Bases
    level : Level
        Of these.
    bounds : (2, 3) float64
        Of the whole model [m].
    choice : float or str, optional

    Returns
    -------
    surface : FeetSurface or None

    Raises
    ------
    InputError
        If no building has a foot, and they are asked for.
    """
    if choice == LEVEL:
        return None
    standing, feet = find_standing(bases.boxes), bases.feet.above(level.low)
    feet = feet.without(find_cellars(feet))
    if choice is None:
        own = np.unique(feet.owner)
        heights = bases.boxes[own[standing[own]], 0, 2]
        if not len(heights) or np.ptp(heights) <= GAP:
            return None
    surface = make_surface(feet, bounds, standing)
    if surface is None and choice == FEET:
        msg = "no building of the model has a foot; give ground= a height [m] or a terrain file"
        raise InputError(msg, option="ground")
    return surface


def make_ground_parts(surface: FeetSurface, origin: Any) -> tuple[Part, Part]:
    """Make the parts of a surface in a scene with an origin (3,) [m]: between and under houses."""
    vertices = surface.vertices - origin
    material = Material(color=GROUND_COLOR)
    between, under = (
        Part(name, kind, Mesh(vertices, surface.faces[which]), material=material)
        for name, kind, which in (
            (_NAMES[0], ASSUMED, ~surface.is_under), (_NAMES[1], ASSUMED_UNDER, surface.is_under),
        )
    )  # fmt: skip
    return between, under
