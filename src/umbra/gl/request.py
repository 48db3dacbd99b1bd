"""
What the plans of a frame read, as one record, and the key by which equal records are told.

Plans are reused while nothing that they read has changed. So they are made of a `FrameRequest`
alone (``umbra.gl.light_plans`` holds no scene), and the key contains every field of it: what a
plan will read tomorrow has to become a field, and is in the key.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casting_scene import CastingScene
from umbra.gl.projection import CameraProjection
from umbra.gl.selection import VolumeOptions
from umbra.scene import Camera, Light
from umbra.scene.lights import find_local

__all__ = ["FrameRequest", "LightShape", "find_request_key"]


@dataclass(frozen=True, eq=False)
class LightShape:
    """What a plan reads of a `Light`: neither its colour nor how it fades; fields as there."""

    position: NDArray[np.float64]
    axis: NDArray[np.float64] | None
    half_angle: float
    range: float

    @classmethod
    def of(cls, light: Light) -> "LightShape":
        """Return the shape of a light."""
        return cls(light.position, light.axis, light.half_angle, light.range)

    def local(self, origin: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the homogeneous position (4,) relative to an origin (3,) [m]."""
        return find_local(self.position, origin)


@dataclass(frozen=True, eq=False)
class FrameRequest:
    """
    All that the plans of a frame read.

    Parameters
    ----------
    casting : CastingScene
        Compared by identity: each pose has its own.
    projection : Projection
    lights : tuple of LightShape
    method : str
    choices : VolumeOptions
    """

    casting: CastingScene
    projection: CameraProjection
    lights: tuple[LightShape, ...]
    method: str
    choices: VolumeOptions

    @cached_property
    def key(self) -> tuple:
        """Equal for requests whose plans are the same."""
        return tuple(find_request_key(getattr(self, field.name)) for field in fields(self))


_RECORDS: dict[type, Callable[[object], tuple]] = {
    kind: attrgetter(*(field.name for field in fields(kind)))
    for kind in (CameraProjection, Camera, LightShape, VolumeOptions)
}
_NUMBERS = (float, int, str, bytes, np.generic, type(None))


class _Same:
    """An object as a key: equal to itself alone, which it keeps alive."""

    def __init__(self, value: object) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def find_request_key(value: object) -> Any:
    """
    Return a key of a value: that of arrays and of a request's records is of all they hold.

    Anything else than these, numbers, words and their sequences is equal to itself alone.
    """
    if isinstance(value, _NUMBERS):
        return value
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, tuple | list):
        return tuple(map(find_request_key, value))
    list_fields = _RECORDS.get(type(value))
    if list_fields is not None:
        return type(value), tuple(map(find_request_key, list_fields(value)))
    return _Same(value)
