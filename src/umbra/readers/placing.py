"""
Layers in their place among others: where a caller puts them, or where their site lies.

A model's own origin comes to a place of the other layers' plan, and its y axis is turned clockwise
from the plan's north. Then it is turned about its middle and moved, and last it is lifted. Without
a height the ground that its file states, such as that of a storey at grade, lies on the ground of
the others below where it was moved, with cellars below; else its lowest point does.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, find_similar, show_value
from umbra.option_fields import read_length, read_texts
from umbra.readers.georeference import find_on_plan, show_crs
from umbra.readers.terrain import find_terrain_height, find_terrain_parts, measure_boxes
from umbra.scene import Light, Part, Scene
from umbra.scene.making import move_parts
from umbra.scene.mesh import find_standing, multiply_rows, transform_points
from umbra.scene.numbers import OUTSIDE

__all__ = [
    "Placed", "Placing", "check_placings", "move_light", "move_parts_by", "place_parts",
    "read_placings",
]  # fmt: skip

_GROUND = "ground"
_DEEP = 0.05  # depth below the ground from which it is reported [m]
_AFLOAT = ("Bridge", "Tunnel", "Canopy")  # kinds that begin so show nothing of the ground's height
_FORMS = {
    "place": "LAYER=X,Y[,Z][,AZIMUTH], such as 'new=2500,340500' or 'new=48.2029,16.3658,,90'",
    "lift": "LAYER=M or LAYER=ground, such as 'new=0.5'",
    "move": "LAYER=DX,DY[,DZ][,TURN], such as 'new=10,-2.5' or 'new=10,-2.5,,30'",
}


@dataclass(frozen=True)
class Placing:
    """
    Where a layer is wanted.

    Parameters
    ----------
    layer : str
    at : tuple of float, optional
        Of its own origin: x, y or latitude, longitude; and z, if it is known [m or degrees].
    azimuth : float
        Of its y axis, clockwise from the plan's [degrees].
    move : tuple of float
        Along x, y, z, afterwards [m].
    turn : float
        Clockwise about the middle of its plan, before the move [degrees].
    lift : float or str
        After the move [m]; or ``'ground'``: its lowest point comes there, whatever its height was.
    reason : str
        What states the place, if it is not the caller.
    """

    layer: str
    at: tuple[float, ...] | None = None
    azimuth: float = 0.0
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0
    lift: float | str = 0.0
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Placed:
    """Parts in their place; how they came there, (4, 4); and a line that says so."""

    parts: tuple[Part, ...]
    matrix: NDArray[np.float64]
    note: str


def read_placings(
    place: Sequence[str] | str, lift: Sequence[str] | str, move: Sequence[str] | str
) -> tuple[Placing, ...]:
    """Read the options of places, each ``LAYER=...``; raise an InputError about a wrong one."""
    placings: dict[str, Placing] = {}
    for option, given in (("place", place), ("lift", lift), ("move", move)):
        seen: set[str] = set()
        for text in read_texts(option, given):
            layer, _, value = text.rpartition("=")
            layer = layer.strip()
            if not layer:
                raise _refuse(text, option)
            if layer in seen:
                msg = f"{option}= is given twice for layer {show_value(layer)}; give it once"
                raise InputError(msg, option=option, layer=layer)
            seen.add(layer)
            placing = placings.get(layer, Placing(layer))
            placings[layer] = _READ[option](placing, text, value.split(","))
    return tuple(placings.values())


def _read_place(placing: Placing, text: str, words: Sequence[str]) -> Placing:
    """Read ``X,Y[,Z][,AZIMUTH]``; Z may be empty."""
    if not 2 <= len(words) <= 4:
        raise _refuse(text, "place")
    has_height = len(words) > 2 and bool(words[2].strip())
    at = _read_numbers("place", text, words[: 3 if has_height else 2])
    (azimuth,) = _read_numbers("place", text, words[3:]) or (0.0,)
    return replace(placing, at=at, azimuth=azimuth)


def _read_move(placing: Placing, text: str, words: Sequence[str]) -> Placing:
    if not 2 <= len(words) <= 4:
        raise _refuse(text, "move")
    has_height = len(words) > 2 and bool(words[2].strip())
    dx, dy, dz = (*_read_numbers("move", text, words[: 3 if has_height else 2]), 0.0)[:3]
    (turn,) = _read_numbers("move", text, words[3:]) or (0.0,)
    return replace(placing, move=(dx, dy, dz), turn=turn)


def _read_lift(placing: Placing, text: str, words: Sequence[str]) -> Placing:
    if [word.strip() for word in words] == [_GROUND]:
        return replace(placing, lift=_GROUND)
    if len(words) != 1:
        raise _refuse(text, "lift")
    return replace(placing, lift=_read_numbers("lift", text, words)[0])


_READ = {"place": _read_place, "lift": _read_lift, "move": _read_move}


def _read_numbers(option: str, text: str, words: Sequence[str]) -> tuple[float, ...]:
    try:
        numbers = tuple(read_length(word) for word in words)
    except ValueError:
        raise _refuse(text, option) from None
    if not all(abs(number) <= OUTSIDE for number in numbers):  # nor NaN
        raise _refuse(text, option)
    return numbers


def _refuse(text: str, option: str) -> InputError:
    msg = f"{option}= is {_FORMS[option]}; got {show_value(text)}"
    return InputError(msg, option=option)


def check_placings(placings: Sequence[Placing], layers: Sequence[str]) -> None:
    """Raise an InputError for a layer that there is not, or that there is none beside."""
    names = list(dict.fromkeys(layers))
    for placing in placings:
        option = _name_option(placing)
        if placing.layer not in names:
            near = find_similar(placing.layer, names)
            shown = ", ".join(f"'{name}'" for name in names[:6] if name)
            there = f"there are {shown}" if shown else "a file alone makes none"
            advice = f"did you mean '{near[0]}'?" if near else f"{there}; name one as NAME=FILE"
            msg = f"{option}= is for a layer, and none is called '{placing.layer}'; {advice}"
            raise InputError(msg, option=option, layer=placing.layer)
        if len(names) == 1:
            msg = (
                f"{option}= brings a layer to its place among others, and '{placing.layer}' is "
                f"alone; name the files around it, too: around=FILE {placing.layer}=FILE"
            )
            raise InputError(msg, option=option, layer=placing.layer)


def _name_option(placing: Placing) -> str:
    if placing.at is not None:
        return "place"
    return "move" if any(placing.move) or placing.turn else "lift"


def place_parts(
    parts: Sequence[Part],
    others: Sequence[Part],
    crs: str | None,
    placing: Placing,
    frame: NDArray[np.float64] | None = None,
    *,
    is_afloat: bool = False,
    own_ground: float | None = None,
    beside: Sequence[Part] = (),
) -> Placed:
    """
    Bring the parts of a layer to their place.

    Parameters
    ----------
    parts : sequence of Part
    others : sequence of Part
        Of the other layers, in the plan of all.
    crs : str, optional
        Of that plan, in metres.
    placing : Placing
    frame : (4, 4) float64, optional
        From the layer's own coordinates to those of ``parts``; by default they are the same.
    is_afloat : bool
        Whether the parts are set on the ground one by one afterwards.
    own_ground : float, optional
        Height of its ground that the layer's file states, in the coordinates of ``parts`` [m].
    beside : sequence of Part
        Other files' parts of the layer, with which it turns.

    Returns
    -------
    placed : Placed

    Raises
    ------
    InputError
        If the place is in degrees and outside the CRS, or there is no ground to stand on.
    """
    matrix = np.eye(4)
    steps: list[str] = []
    own = np.zeros(3) if frame is None else frame[:3, 3]  # the layer's origin, as parts lie
    if placing.at is not None:
        x, y, how = _find_plan(placing, crs)
        matrix[:2, :2] = _turn_plan(placing.azimuth)
        matrix[:3, 3] = x, y, (*placing.at, 0.0)[2]
        if frame is not None:
            matrix = matrix @ np.linalg.inv(frame)
        steps.append(how)
    shift = np.eye(4)
    shift[:3, 3] = placing.move
    if placing.turn:
        corners = Scene((*parts, *beside), np.zeros(3)).triangles().find_corners()
        plan = transform_points(matrix, corners)[:, :2]
        middle = (plan.min(0) + plan.max(0)) / 2 if len(plan) else np.zeros(2)
        shift[:2, :2] = _turn_plan(placing.turn)
        shift[:2, 3] += middle - shift[:2, :2] @ middle
        steps.append(f"turned by {placing.turn:.2f}° clockwise about the middle of its plan")
    matrix = shift @ matrix
    if any(placing.move):
        steps.append("moved by {:.2f}, {:.2f}, {:.2f} m".format(*placing.move))
    rise, standing = _find_rise(
        parts, others, placing, matrix, is_afloat=is_afloat, own_ground=own_ground
    )
    matrix[2, 3] += rise
    if placing.lift and placing.lift != _GROUND:
        steps.append(f"lifted by {float(placing.lift):.2f} m")
    steps.append(standing)
    moved = move_parts_by(parts, matrix)
    steps.append(_tell_end(moved, placing, transform_points(matrix, own[None])[0], is_afloat))
    return Placed(moved, matrix, _tell(placing, steps))


def _tell_end(
    moved: Sequence[Part], placing: Placing, origin: NDArray[np.float64], is_afloat: bool
) -> str:
    """Return where a layer is after all; heights are found later where its parts are afloat."""
    x, y, z = origin
    if placing.at is None:
        corners = Scene(tuple(moved), np.zeros(3)).triangles().find_corners()
        corners = corners[np.isfinite(corners).all(1)]
        if not len(corners):
            return ""
        (x, y, low), (_, _, high) = corners.min(0), corners.max(0)
        height = "" if is_afloat else f", from z {low:.2f} to {high:.2f} m"
        return f"now its west end at x {x:.2f}, its south end at y {y:.2f}{height}"
    height = "" if is_afloat else f", z {z:.2f} m"
    turn = (placing.azimuth + placing.turn) % 360
    return (
        f"now its origin at x {x:.2f}, y {y:.2f}{height}, its y axis {turn:.2f}° clockwise from "
        "the plan's north"
    )


def _turn_plan(azimuth: float) -> NDArray[np.float64]:
    """Return the matrix (2, 2) that turns a plan clockwise [degrees]."""
    turn = math.radians(azimuth)
    cos, sin = round(math.cos(turn), 15), round(math.sin(turn), 15)
    return np.array([[cos, sin], [-sin, cos]])


def _tell(placing: Placing, steps: Sequence[str]) -> str:
    name = " ".join(placing.layer.split())
    options = [f"place='{name}=X,Y,Z,AZIMUTH'", f"lift='{name}=M|ground'", f"move='{name}=DX,DY'"]
    said = ", ".join(step for step in steps if step)
    return f"layer '{name}': {said} (other: {', '.join(options)})"


def _find_plan(placing: Placing, crs: str | None) -> tuple[float, float, str]:
    """Return where the origin comes in plan, and what says so."""
    assert placing.at is not None
    a, b = placing.at[:2]
    point = find_on_plan(crs, a, b) if crs and abs(a) <= 90 and abs(b) <= 180 else None
    x, y = (a, b) if point is None else point.tolist()
    of = f" in {show_crs(crs)}" if crs else ""
    given = "" if point is None else f" (latitude {a:.6f}°, longitude {b:.6f}°)"
    by = f" by {placing.reason}" if placing.reason else ""
    return x, y, f"placed{by}{of}{given}"


def _find_rise(
    parts: Sequence[Part], others: Sequence[Part], placing: Placing, matrix: NDArray[np.float64],
    *, is_afloat: bool, own_ground: float | None,
) -> tuple[float, str]:  # fmt: skip
    """Return by how much the parts rise after their move [m], and what they stand on then."""
    to_ground = placing.lift == _GROUND
    lift = 0.0 if to_ground else float(placing.lift)
    if placing.at is not None and len(placing.at) > 2 and not to_ground:
        return lift, ""
    if is_afloat or (placing.at is None and not to_ground):
        return lift, ""
    corners = transform_points(matrix, Scene(tuple(parts), np.zeros(3)).triangles().find_corners())
    corners = corners[np.isfinite(corners).all(1)]  # others are reported with their part
    surface = _find_ground(corners[:, :2], others) if len(corners) else None
    if surface is None and to_ground:
        msg = (
            f"there is no ground below layer '{placing.layer}': the other layers have neither "
            f"terrain nor buildings that stand; give its height, lift='{placing.layer}=M'"
        )
        raise InputError(msg, option="lift", layer=placing.layer)
    if surface is None:
        return lift, "its height else as it is, for there is no ground below it"
    ground, what = surface
    low, high = float(corners[:, 2].min()), float(corners[:, 2].max())
    if to_ground:
        rise = ground - low
        return rise, f"its lowest point on {what}, z {ground:.2f} m, raised by {rise:.2f} m"
    # Without a height it is set on the ground; from there the move and the lift raise it.
    high_by = placing.move[2] + lift
    on = f"{abs(high_by):.2f} m {'below' if high_by < 0 else 'above'}" if high_by else "on"
    there = f"{on} {what}, z {ground:.2f} m"
    if own_ground is not None:
        level = own_ground + float(matrix[2, 3])  # it stays upright
        if level <= high:
            deep = abs(level - low)
            side = "of it below" if low < level else "up to its lowest point"
            below = f", with {deep:.2f} m {side}" if deep > _DEEP else ""
            said = f"its own ground (z {own_ground:.2f} m of its file) {there}{below}"
            return ground + high_by - level, said
    unsaid = "" if own_ground is not None else ", as its file states no ground of its own"
    return ground + high_by - low, f"its lowest point {there}{unsaid}"


def _find_ground(plan: NDArray[np.float64], others: Sequence[Part]) -> tuple[float, str] | None:
    """Return the lowest ground below places (n, 2) [m], and what it is; None without one."""
    terrain = find_terrain_parts(others)
    if terrain:
        heights, inside = find_terrain_height(terrain, plan)
        if inside.any():
            return float(heights[inside].min()), "the terrain there"
    layers: dict[str, list[Part]] = {}
    for part in others:
        if not part.kind.startswith(_AFLOAT) and part not in terrain:
            layers.setdefault(part.layer, []).append(part)
    measured = [measure_boxes(parts) for parts in layers.values()]
    names = [name for layer_names, _ in measured for name in layer_names]
    if not names:
        return None
    boxes = np.concatenate([layer_boxes for _, layer_boxes in measured])
    standing = np.flatnonzero(find_standing(boxes))
    low, high = boxes[standing, 0, :2], boxes[standing, 1, :2]
    gaps = np.hypot(*np.maximum(np.maximum(low - plan.max(0), plan.min(0) - high), 0.0).T)
    nearest = standing[np.argmin(gaps)]
    return float(boxes[nearest, 0, 2]), f"the foot of the nearest building, '{names[nearest]}'"


def move_parts_by(parts: Sequence[Part], matrix: NDArray[np.float64]) -> tuple[Part, ...]:
    """Move parts, their normals and what an animation hangs them on by a rigid motion (4, 4)."""

    def place(part: Part) -> Part:
        binding = part.binding
        if binding is not None:
            binding = replace(binding, base=matrix @ binding.base)
        return replace(part, transform=matrix @ np.asarray(part.transform), binding=binding)

    def turn(rows: NDArray[np.floating]) -> NDArray[np.floating]:
        turned = multiply_rows(rows.astype(np.float64), matrix[:3, :3].T)
        return turned.astype(rows.dtype, copy=False)

    is_turned = not np.array_equal(matrix[:3, :3], np.eye(3))
    move = partial(transform_points, matrix)
    return move_parts(parts, move, place, turn if is_turned else None)


def move_light(light: Light, matrix: NDArray[np.float64]) -> Light:
    """Move a light of a layer with it; it is not animated then."""
    turn = matrix[:3, :3]
    axis = None if light.axis is None else turn @ light.axis
    position = matrix @ light.position
    return replace(light, position=position, axis=axis, up=turn @ light.up, binding=None)
