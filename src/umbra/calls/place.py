"""A layer of a scene in its place among the others."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, check_type
from umbra.option_fields import read_text
from umbra.readers.placing import Placing, check_placings, move_parts_by, place_parts
from umbra.scene import Scene, make_scene
from umbra.scene.numbers import OUTSIDE, read_number

__all__ = ["place"]


def place(scene: Scene, layer: str, at: Sequence[float], azimuth: float = 0) -> Scene:
    """
    Bring a layer of a scene to its place among the others.

    Parameters
    ----------
    scene : Scene
        As read; a layer that was placed before is placed anew.
    layer : str
    at : (2,) or (3,) float
        Where the layer's own origin comes: x, y, z [m] in the scene's coordinates, or latitude,
        longitude [degrees] if the scene has a CRS and the first two numbers can be. Without z the
        ground that the layer's file states (IFC: a storey's or the site's), else its lowest point,
        comes to the ground of the others there; if they have none, it keeps its height.
    azimuth : float
        Of the layer's y axis, clockwise from the plan's north [degrees].

    Returns
    -------
    scene : Scene
        Whose last note says with numbers what was done. Lights keep their places.

    Raises
    ------
    InputError
        If there is no such layer, or no other one; or ``at`` is no place.
    """
    check_type("scene", scene, Scene)
    name = read_text("layer", layer) or ""
    check_placings([Placing(name, (0.0, 0.0))], [part.layer for part in scene.parts])
    try:
        numbers = tuple(read_number("at", value) for value in at)
    except TypeError:
        numbers = ()
    if not 2 <= len(numbers) <= 3 or not all(abs(value) <= OUTSIDE for value in numbers):
        msg = f"at= is x, y and z [m], or latitude and longitude; got {at!r}"
        raise InputError(msg, option="at")
    turn = read_number("azimuth", azimuth)
    if not abs(turn) <= OUTSIDE:
        msg = f"azimuth= is a finite angle [degrees]; got {azimuth!r}"
        raise InputError(msg, option="azimuth")
    shift = np.eye(4)
    shift[:3, 3] = scene.origin
    parts = move_parts_by(scene.parts, shift)
    chosen = [k for k, part in enumerate(parts) if part.layer == name]
    others = [part for part in parts if part.layer != name]
    files = [source for source in scene.sources if source.layer == name]
    frame = next((np.reshape(source.frame, (4, 4)) for source in files if source.frame), np.eye(4))
    own_ground = next((source.ground for source in files if source.ground is not None), None)
    placed = place_parts(
        [parts[k] for k in chosen], others, scene.crs, Placing(name, numbers, turn), frame,
        own_ground=None if own_ground is None else own_ground + float(frame[2, 3]),
    )  # fmt: skip
    moved = list(parts)
    for k, part in zip(chosen, placed.parts, strict=True):
        moved[k] = part
    sources = [
        replace(source, frame=_move_frame(source.frame, placed.matrix))
        if source.layer == name
        else source
        for source in scene.sources
    ]
    made = make_scene(moved)
    return replace(
        scene, parts=made.parts, origin=made.origin, sources=tuple(sources),
        notes=(*scene.notes, placed.note),
    )  # fmt: skip


def _move_frame(frame: tuple[float, ...], matrix: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the frame of a file, row by row, after its parts were moved."""
    before = np.reshape(frame, (4, 4)) if frame else np.eye(4)
    return tuple((matrix @ before).ravel().tolist())
