"""Lights as homogeneous points: w = 1 a place, w = 0 a direction toward the light."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError

__all__ = ["Light", "directional_light", "point_light", "spot_light"]

WHITE = (1.0, 1.0, 1.0)


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
        Linear RGB intensity.
    axis : (3,) float64, optional
        Unit direction in which a spot light shines.
    half_angle : float
        Between a spot light's axis and its rim [degrees]; 180 lights everything.
    """

    position: NDArray[np.float64]
    color: tuple[float, float, float] = WHITE
    axis: NDArray[np.float64] | None = None
    half_angle: float = 180.0

    def __post_init__(self) -> None:
        position = np.array(self.position, np.float64).reshape(-1)
        if position.shape != (4,) or not np.isfinite(position).all():
            msg = f"a light needs four finite numbers x, y, z, w; got {self.position}"
            raise InputError(msg)
        if position[3] < 0:
            msg = f"a light's w must be 0 (direction) or positive; got {position[3]:g}"
            raise InputError(msg)
        if position[3] == 0 and not position[:3].any():
            msg = "a directional light of 0,0,0 points nowhere; give a direction toward it"
            raise InputError(msg)
        if position[3] > 0:
            position = position / position[3]
        object.__setattr__(self, "position", position)

    @property
    def is_point(self) -> bool:
        """Whether the light is at a place rather than infinitely far."""
        return bool(self.position[3] > 0)

    def local(self, origin: ArrayLike) -> NDArray[np.float64]:
        """
        Give the homogeneous position relative to an origin.

        Parameters
        ----------
        origin : (3,) float64
            In the model's own coordinates [m].

        Returns
        -------
        position : (4,) float64
        """
        shifted = self.position.copy()
        if not self.is_point:
            # Near length 1, by a power of 2: exact, and no product of it can underflow.
            return np.ldexp(shifted, -np.frexp(np.abs(shifted).max())[1])
        shifted[:3] -= np.asarray(origin, np.float64)
        return shifted


def point_light(position: ArrayLike, color: tuple[float, float, float] = WHITE) -> Light:
    """Make a point light at a place (3,) [m]."""
    return Light(np.append(np.asarray(position, np.float64), 1.0), color)


def directional_light(toward: ArrayLike, color: tuple[float, float, float] = WHITE) -> Light:
    """Make a light infinitely far in the direction (3,) toward it."""
    return Light(np.append(np.asarray(toward, np.float64), 0.0), color)


def spot_light(
    position: ArrayLike,
    target: ArrayLike,
    half_angle: float,
    color: tuple[float, float, float] = WHITE,
) -> Light:
    """
    Make a point light that shines in a cone.

    Parameters
    ----------
    position, target : (3,) float64
        Where it stands and what it looks at [m].
    half_angle : float
        From the axis to the rim [degrees], above 0 and at most 180.

    Raises
    ------
    InputError
        If position and target coincide, or the angle is out of range.
    """
    position = np.asarray(position, np.float64)
    axis = np.asarray(target, np.float64) - position
    length = float(np.linalg.norm(axis))
    if length == 0 or not 0 < half_angle <= 180:
        msg = "a spot light needs a target away from it and a half angle in (0, 180]"
        raise InputError(msg, half_angle=half_angle)
    return Light(np.append(position, 1.0), color, axis / length, float(half_angle))
