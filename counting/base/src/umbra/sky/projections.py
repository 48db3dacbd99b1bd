"""Projections of the upper sky: round ones, and the Waldram diagram."""

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, find_similar

__all__ = ["PROJECTIONS", "Projection", "find_projection"]

PROJECTIONS = ("stereographic", "equidistant", "orthographic", "waldram")


_STEEP = 0.5**0.5  # sine of a tilt from which a Waldram diagram is of a vertical plane


class Projection:
    """
    Maps directions to a picture whose round ones lie in the unit circle.

    Parameters
    ----------
    name : str
        One of ``PROJECTIONS``.
    facing : float or None
        Azimuth of the plane's normal in the model's axes, clockwise from +y [radians]; None within
        45 degrees of level: its Waldram diagram is of a level plane and shows the whole turn.
    north : float
        Azimuth of true north in the model's axes [radians].
    """

    def __init__(self, name: str, facing: float | None, north: float) -> None:
        self.name, self.facing, self.north = name, facing, north
        self.is_round = name != "waldram"

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Lowest and highest x and y."""
        return (-1.0, 1.0, -1.0, 1.0) if self.is_round else (-1.0, 1.0, 0.0, 1.0)

    def project(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places (..., 2) of unit vectors (..., 3); NaN beside a Waldram diagram."""
        x, y, z = np.moveaxis(np.asarray(directions, np.float64), -1, 0)
        azimuth = np.arctan2(x, y)
        altitude = np.arctan2(z, np.hypot(x, y))
        return self.place(azimuth, altitude)

    def place(
        self, azimuth: NDArray[np.float64], altitude: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the places of azimuths in the model's axes and altitudes [radians]."""
        if self.is_round:
            turn = azimuth - self.north
            apart = np.pi / 2 - altitude
            radius = {
                "stereographic": np.tan(apart / 2),
                "equidistant": apart / (np.pi / 2),
                "orthographic": np.sin(apart),
            }[self.name]
            return np.stack([radius * np.sin(turn), radius * np.cos(turn)], -1)
        rise = np.clip(altitude, 0.0, np.pi / 2)
        if self.facing is None:  # light on a level plane: L sin cos
            turn = (azimuth - self.north) % (2 * np.pi)
            up = np.sin(rise) ** 2 / 2 + 2 / 3 * np.sin(rise) ** 3
            return np.stack([turn / np.pi - 1.0, up / (7 / 6)], -1)
        turn = (azimuth - self.facing + np.pi) % (2 * np.pi) - np.pi
        up = rise / 2 + np.sin(2 * rise) / 4 + 2 / 3 * (1 - np.cos(rise) ** 3)
        across = np.where(np.abs(turn) <= np.pi / 2 + 1e-9, np.sin(turn), np.nan)
        return np.stack([across, up / (np.pi / 4 + 2 / 3)], -1)


def find_projection(name: str, normal: NDArray[np.float64], north: float) -> Projection:
    """
    Return a projection for a plane with a normal (3,) in the model's axes.

    ``north`` is the azimuth of true north there [degrees]. Raises InputError for unknown names.
    """
    if name not in PROJECTIONS:
        near = find_similar(str(name), PROJECTIONS)
        advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(PROJECTIONS)}"
        msg = f"there is no projection '{name}'; {advice}"
        raise InputError(msg, projection=name)
    is_steep = np.hypot(normal[0], normal[1]) >= _STEEP * np.linalg.norm(normal)
    facing = float(np.arctan2(normal[0], normal[1])) if is_steep else None
    return Projection(name, facing, float(np.radians(north)))
