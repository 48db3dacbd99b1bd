"""Lights as homogeneous points: w = 1 a position, w = 0 a direction toward the light."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, check_type, show_value
from umbra.scene.material import Image, sample
from umbra.scene.numbers import OUTSIDE, check_reach, read_array, read_number, read_vector

if TYPE_CHECKING:
    from umbra.scene.rig import RigBinding

__all__ = [
    "Light",
    "SomeLights",
    "directional_light",
    "find_local",
    "make_lights",
    "point_light",
    "spot_light",
]

WHITE = (1.0, 1.0, 1.0)
_GRAZING = 1e-9  # cosine below which nothing is brighter by a bend
_ALONG = 1e-9  # sine of the angle below which two directions are equal


def find_local(position: NDArray[np.float64], origin: ArrayLike) -> NDArray[np.float64]:
    """Return a light's homogeneous position (4,) relative to an origin (3,) [m]."""
    shifted = position.copy()
    if not position[3] > 0:
        # Near length 1, by a power of 2: exact, and no product of it can underflow.
        return np.ldexp(shifted, -np.frexp(np.abs(shifted).max())[1])
    shifted[:3] -= np.asarray(origin, np.float64)
    return shifted


@dataclass(frozen=True, eq=False)
class Light:
    """
    A light without size.

    Parameters
    ----------
    position : (4,) float64
        Homogeneous, in the model's own coordinates [m]; for w = 0 the direction
        *toward* the light, of any length.
    color : (3,) float
        Linear RGB intensity, at least 0.
    axis : (3,) float64, optional
        Direction in which a spot light shines; made a unit vector.
    half_angle : float
        Angle between a spot light's axis and its rim [degrees]; 180 lights everything.
    inner_angle : float, optional
        Up to it a spot is fully bright, from there to the rim it fades [degrees];
        the half angle by default: a sharp rim.
    range : float
        Largest lit distance [m]; infinite by default. Near it a light fades as in glTF, by
        1 - (distance / range)^4.
    attenuation : (3,) float
        Constant, linear [1/m] and quadratic [1/m²]: brightness is divided by
        c + l d + q d² at the distance d.
    image : Image, optional
        A picture that a spot light projects, filling the square about its rim.
    up : (3,) float, optional
        Upward in the picture; z by default.
    binding : RigBinding, optional
        How it moves in time, see `umbra.scene.making`.
    bend : float
        Power of the cosine by which a directional light brightens surfaces, above 0 and at most 1:
        1 is Lambert's law; below it those that the light meets at a slant are brighter.

    Raises
    ------
    InputError
        If a number is missing, not finite or out of range.
    """

    position: NDArray[np.float64]
    color: tuple[float, float, float] = WHITE
    axis: NDArray[np.float64] | None = None
    half_angle: float = 180.0
    inner_angle: float | None = None
    range: float = np.inf
    attenuation: tuple[float, float, float] = (1.0, 0.0, 0.0)
    image: Image | None = None
    up: NDArray[np.float64] = (0.0, 0.0, 1.0)  # type: ignore[assignment]
    binding: RigBinding | None = None
    bend: float = 1.0

    def __post_init__(self) -> None:
        position = read_vector("a light", self.position, 4)
        if position[3] < 0:
            msg = f"a light's w must be 0 (direction) or positive; got {position[3]:g}"
            raise InputError(msg)
        if position[3] == 0 and not position[:3].any():
            msg = "a directional light of 0,0,0 points nowhere; give a direction toward it"
            raise InputError(msg)
        if position[3] > 0:
            with np.errstate(over="ignore"):  # to infinity, which is out of reach
                position = position / position[3]
            check_reach(
                "a lamp's coordinates", position, "give a direction toward it, W=0", OUTSIDE
            )
        object.__setattr__(self, "position", position)
        for name in ("color", "attenuation"):
            value = tuple(read_array(f"a light's {name}", getattr(self, name)).ravel().tolist())
            if len(value) != 3 or not all(0 <= v < np.inf for v in value):
                msg = f"a light's {name} is three finite numbers of at least 0; got {value}"
                raise InputError(msg)
            object.__setattr__(self, name, value)
        if not any(self.attenuation):
            msg = "an attenuation of 0,0,0 would be infinitely bright; 1,0,0 is none"
            raise InputError(msg)
        for name in ("range", "half_angle", "inner_angle", "bend"):
            if name != "inner_angle" or self.inner_angle is not None:
                number = read_number(f"a light's {name}", getattr(self, name))
                object.__setattr__(self, name, number)
        if self.image is not None:
            check_type("image", self.image, Image)
        if not self.range > 0:
            msg = f"a light's range must be above 0 m; got {self.range:g}"
            raise InputError(msg)
        if position[3] == 0 and (self.range < np.inf or self.axis is not None):
            msg = "a directional light is infinitely far: it has neither range nor cone"
            raise InputError(msg)
        if not 0 < self.bend <= 1 or (position[3] > 0 and self.bend < 1):
            msg = f"a light's bend is above 0 and at most 1, and a lamp's is 1; got {self.bend:g}"
            raise InputError(msg)
        self._check_cone()

    def _check_cone(self) -> None:
        for name in ("axis", "up"):
            value = getattr(self, name)
            if value is None:
                continue
            vector = read_vector(f"a spot light's {name}", value)
            if not vector.any():
                msg = f"a spot light's {name} needs three finite numbers, not all 0; got {value}"
                raise InputError(msg)
            # Near length 1, by a power of 2: exact, and its square can neither overflow nor vanish.
            vector = np.ldexp(vector, -np.frexp(np.abs(vector).max())[1])
            length = float(np.linalg.norm(vector))
            object.__setattr__(self, name, vector if length == 1 else vector / length)
        inner = self.half_angle if self.inner_angle is None else self.inner_angle
        if not 0 < self.half_angle <= 180 or not 0 <= inner <= self.half_angle:
            msg = (
                "a spot light needs a half angle in (0, 180] and an inner angle from 0 to it; "
                f"got {self.half_angle:g} and {inner:g}"
            )
            raise InputError(msg, half_angle=self.half_angle)
        if self.image is not None and (self.axis is None or self.half_angle >= 90):
            msg = (
                f"'{self.image.name}' is projected by a spot light with a half angle below 90; "
                f"this one has {'no axis' if self.axis is None else f'{self.half_angle:g}'}"
            )
            raise InputError(msg, half_angle=self.half_angle)

    @property
    def is_point(self) -> bool:
        """Whether the light is at a finite distance."""
        return bool(self.position[3] > 0)

    def local(self, origin: ArrayLike) -> NDArray[np.float64]:
        """Return the homogeneous position (4,) relative to an origin (3,) [m]."""
        return find_local(self.position, origin)

    def find_bend(self, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
        """Find how much brighter surfaces are than by the cosine (n,) of the light on them."""
        return np.maximum(cosine, _GRAZING) ** (self.bend - 1.0)

    def is_within(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """
        Return which points (..., 3) of the model's own frame are in the light's range and cone.

        The rim is within, the range is not. A directional light reaches all.
        """
        if not self.is_point:
            return np.ones(points.shape[:-1], np.bool_)
        way = points - self.position[:3]
        distance = np.linalg.norm(way, axis=-1)
        within = np.asarray(distance < self.range)
        if self.axis is not None:
            within &= way @ self.axis >= np.cos(np.radians(self.half_angle)) * distance
        return within

    def find_intensity(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """
        Find the unshadowed light (..., 3) at points (..., 3) [m].

        It is linear RGB on a surface that faces the light: the light's colour, times the projected
        picture, divided by the attenuation, faded toward the range and, in the cone, from the
        inner angle i to the half angle o, as glTF does: the square of (cos a - cos o) / (cos i -
        cos o).
        """
        full = np.broadcast_to(np.array(self.color), points.shape)
        constant, linear, quadratic = self.attenuation
        if not self.is_point or (
            not (linear or quadratic) and self.axis is None and self.range == np.inf
        ):
            return full / constant if self.is_point else full.copy()
        way = points - self.position[:3]
        distance = np.linalg.norm(way, axis=-1)
        weakened = constant + distance * (linear + distance * quadratic)
        # Closer surfaces get the brightness at a micrometre.
        amount = np.where(self.is_within(points), 1 / np.maximum(weakened, 1e-12), 0.0)
        if self.range < np.inf:
            amount *= np.maximum(1 - (distance / self.range) ** 4, 0.0)
        if self.axis is not None and self.inner_angle not in {None, self.half_angle}:
            inner, outer = np.cos(np.radians([self.inner_angle, self.half_angle]))
            cosine = (way @ self.axis) / np.maximum(distance, np.finfo(np.float64).tiny)
            amount *= np.clip((cosine - outer) / (inner - outer), 0.0, 1.0) ** 2
        intensity = amount[..., None] * full
        if self.image is not None:
            intensity *= self._project(way, self.image)
        return intensity

    def axes(self) -> NDArray[np.float64]:
        """
        Return the axes (3, 3) of a spot light's picture: rows right, up, forward; orthonormal.

        The picture's half width and half height at the distance d along the axis are d tan(half
        angle).
        """
        if self.axis is None:
            msg = "only a spot light has axes"
            raise InputError(msg)
        for up in (self.up, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)):
            right = np.cross(self.axis, up)
            if np.linalg.norm(right) >= _ALONG:  # else it shines along its up: let another be up
                break
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, self.axis), self.axis])

    def _project(self, way: NDArray[np.float64], image: Image) -> NDArray[np.float64]:
        """Return the picture's linear RGB in the directions ``way`` from the light."""
        across, upward, ahead = np.moveaxis(way @ self.axes().T, -1, 0)
        reach = np.maximum(ahead, np.finfo(np.float64).tiny) * np.tan(np.radians(self.half_angle))
        with np.errstate(over="ignore"):
            uv = np.stack([0.5 + 0.5 * across / reach, 0.5 - 0.5 * upward / reach], axis=-1)
        return sample(image, np.clip(uv, 0.0, 1.0), wrap=("clamp", "clamp"))[..., :3]


def point_light(
    position: ArrayLike, color: tuple[float, float, float] = WHITE, **more: Any
) -> Light:
    """
    Make a point light.

    Parameters
    ----------
    position : (3,) float64
        In the model's own coordinates [m].
    color : (3,) float
        Light on a surface that faces it, linear RGB.
    **more
        ``range`` and ``attenuation`` of `Light`.

    Returns
    -------
    light : Light

    Raises
    ------
    InputError
        If the place is not three finite numbers.

    Examples
    --------
    >>> umbra.point_light((4, -3, 8), color=(1, 0.9, 0.7), range=30)
    """
    return Light(np.append(read_vector("a lamp's position", position), 1.0), color, **more)


def directional_light(toward: ArrayLike, color: tuple[float, float, float] = WHITE) -> Light:
    """
    Make a light that is infinitely far, such as the sun.

    Parameters
    ----------
    toward : (3,) float64
        Direction toward the light in the model's axes, of any length.
    color : (3,) float
        Light on a surface that faces it, linear RGB.

    Returns
    -------
    light : Light

    Raises
    ------
    InputError
        If the direction is not three finite numbers, or is 0.

    Examples
    --------
    >>> sun = umbra.find_sun(site, "2026-03-21T12:00")
    >>> umbra.directional_light(sun.direction[0])
    """
    return Light(np.append(read_vector("a direction toward a light", toward), 0.0), color)


def spot_light(
    position: ArrayLike,
    target: ArrayLike,
    half_angle: float,
    color: tuple[float, float, float] = WHITE,
    **more: Any,
) -> Light:
    """
    Make a point light that shines in a cone.

    Parameters
    ----------
    position, target : (3,) float64
        Its position and the point that it faces [m].
    half_angle : float
        From the axis to the rim [degrees], above 0 and at most 180.
    color : (3,) float
    **more
        ``inner_angle``, ``range``, ``attenuation``, ``image`` and ``up`` of `Light`.

    Raises
    ------
    InputError
        If position and target coincide, or the angle is out of range.
    """
    position = read_vector("a spot light's position", position)
    target = read_vector("a spot light's target", target)
    for point in (position, target):
        check_reach("a spot light's coordinates", point, "place it near the model", OUTSIDE)
    axis = target - position
    half_angle = read_number("a spot light's half angle", half_angle)
    length = float(np.linalg.norm(axis))
    if length == 0 or not 0 < half_angle <= 180:
        msg = "a spot light needs a target away from it and a half angle in (0, 180]"
        raise InputError(msg, half_angle=half_angle)
    return Light(np.append(position, 1.0), color, axis / length, float(half_angle), **more)


SomeLights = Light | ArrayLike | Iterable[Light | ArrayLike]
"""One light or several, as records or as homogeneous vectors."""


def make_lights(lights: SomeLights) -> list[Light]:
    """
    Return one or several lights, records or homogeneous vectors, as a list.

    Raises
    ------
    InputError
        If one is neither, or its w is not 0 or 1.
    """
    is_one = isinstance(lights, (Light, str)) or not isinstance(lights, Iterable)
    try:
        given: list[Any] = [lights] if is_one else list(lights)  # type: ignore[arg-type]
    except TypeError:  # an array without axes
        given = [lights]
    if given and all(isinstance(number, Real) for number in given):
        given = [given]
    return [light if isinstance(light, Light) else _make_light(light) for light in given]


def _make_light(numbers: ArrayLike) -> Light:
    try:
        vector = read_array("lights", numbers)
    except InputError:
        vector = np.zeros(0)
    if vector.shape == (3,):
        vector = np.append(vector, 1.0)
    if vector.shape != (4,):
        msg = f"a light is a Light or (x, y, z, w); got {show_value(numbers)}"
        raise InputError(msg, option="lights")
    if vector[3] not in {0.0, 1.0}:
        shown = ", ".join(f"{v:g}" for v in vector)
        msg = (
            f"lights=({shown}) has a W of {vector[3]:g}; it is 1 (a point) or 0 (a direction "
            "toward it)"
        )
        raise InputError(msg, option="lights", light=numbers)
    return Light(vector)
