"""Placement of a file: its up axis, and the site that files and CRS agree on."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.readers.georeference import show_crs
from umbra.readers.model import FilePlace
from umbra.scene import Part, Scene
from umbra.scene.making import move_parts

__all__ = ["APART", "settle", "turn_up", "turning"]

APART = 0.05
"""Places farther apart than this [degrees] are not one; the sun moves as much."""
LEVEL = 0.01  # heights that differ by less [m] are one
TURNED = 1.0  # True norths that differ by more [degrees] are said


def settle(scene: Scene, places: Mapping[str, FilePlace]) -> Scene:
    """Fill in the site from what files say, after the CRS; none, with a note, if two disagree."""
    notes = list(scene.notes)
    said = {
        name: (place.latitude, place.longitude)
        for name, place in places.items()
        if place.latitude is not None and place.longitude is not None
    }
    latitude, longitude, north = scene.latitude, scene.longitude, scene.true_north
    if latitude is not None and longitude is not None:
        shown = show_crs(scene.crs or "")
        for name, (a, b) in said.items():
            if not _is_near((latitude, longitude), (a, b)):
                notes.append(
                    f"{name}: its site says {a:.4f}°, {b:.4f}°, but {shown} says "
                    f"{latitude:.4f}°, {longitude:.4f}°, which is used"
                )
    elif said:
        (first, here), *others = said.items()
        wrong = [name for name, there in others if not _is_near(here, there)]
        if wrong:
            listed = "; ".join(f"{name} at {a:.4f}°, {b:.4f}°" for name, (a, b) in said.items())
            notes.append(
                f"the files' sites disagree ({listed}), so the site is not known; "
                "give latitude= and longitude="
            )
        else:
            latitude, longitude = here
    norths = {n: p.true_north for n, p in places.items() if p.true_north is not None}
    if north is None and norths:
        (first, north), *turned = norths.items()
        for name, other in turned:
            if abs((other - north + 180) % 360 - 180) > TURNED:
                notes.append(
                    f"true north is at {north:.2f}° in {first} and at {other:.2f}° in {name}; "
                    "the first is used (true_north=)"
                )
    heights = [place.elevation for place in places.values() if place.elevation is not None]
    ground = _find_ground(places, notes)
    return replace(
        scene, latitude=latitude, longitude=longitude, true_north=north, notes=tuple(notes),
        elevation=heights[0] if heights else scene.elevation, ground=ground,
    )  # fmt: skip


def _find_ground(places: Mapping[str, FilePlace], notes: list[str]) -> float | None:
    """Return the level ground that the files state; None unless every file states it."""
    levels = {name: place.ground for name, place in places.items() if place.ground is not None}
    if not levels or len(places) > len(levels):
        return None
    (name, ground), *others = levels.items()
    if all(abs(other - ground) < LEVEL for _, other in others):
        notes.append(
            f"{name}: the ground is taken at z = {ground:g} m, the top of its site (ground=)"
        )
        return ground
    return None


def _is_near(one: tuple[float | None, float | None], other: tuple[float, float]) -> bool:
    return all(a is not None and abs(a - b) <= APART for a, b in zip(one, other, strict=True))


# Rotations, not reflections, and whole numbers: windings and digits stay.
TURNS = {
    "x": np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
    "y": np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    "z": np.eye(4),
}


def turning(up: str) -> NDArray[np.float64]:
    """Return the rotation (4, 4) that brings the axis ``up`` to z: y gives (x, -z, y)."""
    return TURNS[up]


def turn_up(parts: tuple[Part, ...], up: str | None) -> tuple[Part, ...]:
    """Turn parts so that their axis ``up`` (z if None) is z; shared meshes stay shared."""
    if up is None or up == "z":
        return parts
    matrix = TURNS[up]
    turn = partial(_turn, matrix=matrix)
    return move_parts(
        parts, turn, lambda part: replace(part, transform=matrix @ part.transform), turn
    )


def _turn(array: NDArray[Any], matrix: NDArray[np.float64]) -> NDArray[Any]:
    # By columns, not by a product: 0 times infinity would spread NaN.
    axes, signs = np.abs(matrix[:3, :3]).argmax(1), matrix[:3, :3].sum(1)
    return np.ascontiguousarray(array[:, axes] * signs)
