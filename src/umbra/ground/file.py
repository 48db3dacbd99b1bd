"""The ground of a file beside the model: a terrain raster, or any mesh of the land."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene import Material, Mesh, Part, Scene
from umbra.scene.camera import GROUND_COLOR
from umbra.scene.mesh import GIVEN, find_standing

__all__ = ["add_file_ground"]


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
    sources = (*scene.sources, *(replace(one, is_companion=True) for one in land.sources))
    return replace(scene, parts=(*scene.parts, part), sources=sources), notes


def _tell_beyond(boxes: NDArray[np.float64], name: str, part: Part) -> list[str]:
    """Report buildings under whose middle there is none of the land."""
    from umbra.readers.terrain import find_terrain_height  # noqa: PLC0415 (it loads all formats)

    boxes = boxes[find_standing(boxes)]
    beyond = ~find_terrain_height([part], boxes[:, :, :2].mean(1))[1] if len(boxes) else np.zeros(0)
    if not beyond.any():
        return []
    count = f"{int(beyond.sum()):,} of {len(boxes):,}"
    told = (
        f"{count} buildings stand where '{name}' has no land, and no hours are counted there; "
        "give a terrain that holds the model and its shadows, or ground='feet'"
    )
    return [told]


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
