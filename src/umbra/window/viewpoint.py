"""Where one looks from: an orbit around a point, or a walk; each move gives another record."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.scene import Camera

__all__ = ["Viewpoint", "frame_bounds"]

STEEPEST = 89.9  # [degrees], so that up stays up
_MARGIN = 1.06
_NEAR_MOST, _NEAR_SHARE = 0.1, 1e-3
_LEAST = 1e-6  # [m]; a smaller model is seen as if it were of this size

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Viewpoint:
    """
    A place to look from.

    Parameters
    ----------
    target : (float, float, float)
        What the view turns around, in the model's own coordinates [m].
    heading : float
        In which direction one looks, clockwise from +y [degrees].
    tilt : float
        How far above the horizon one looks [degrees].
    distance : float
        From the eye to the target [m].
    fov : float
        Vertical field of view [degrees].
    near : float
        Distance of the near plane [m].
    walks : bool
        Whether turning moves the target around the eye rather than the eye around it.
    """

    target: Point
    heading: float = 20.0
    tilt: float = -28.0
    distance: float = 100.0
    fov: float = 45.0
    near: float = 0.1
    walks: bool = False

    def axes(self) -> NDArray[np.float64]:
        """Give the unit vectors right, up and forward, (3, 3) float64 by rows."""
        turn, lift = np.radians([self.heading, self.tilt])
        forward = np.array([np.sin(turn) * np.cos(lift), np.cos(turn) * np.cos(lift), np.sin(lift)])
        right = np.array([np.cos(turn), -np.sin(turn), 0.0])
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def eye(self) -> NDArray[np.float64]:
        """Where the eye is, (3,) float64."""
        return np.array(self.target) - self.distance * self.axes()[2]

    def camera(self, size: tuple[int, int]) -> Camera:
        """Give the camera that makes a picture of so many columns and rows."""
        return Camera(self.eye, np.array(self.target), size=size, fov=self.fov, near=self.near)

    def turn(self, right: float, up: float) -> "Viewpoint":
        """Turn the head in a walk, else the eye around the target [degrees in the picture]."""
        eye = self.eye
        turned = replace(
            self,
            heading=(self.heading + right) % 360.0,
            tilt=float(np.clip(self.tilt + up, -STEEPEST, STEEPEST)),
        )
        return turned.put_eye(eye) if self.walks else turned

    def put_eye(self, eye: ArrayLike) -> "Viewpoint":
        """Move the eye to a place, looking as before."""
        return replace(self, target=_point(np.asarray(eye, float) + self.distance * self.axes()[2]))

    def pan(self, cols: float, rows: float, height: int) -> "Viewpoint":
        """Shift the view so that what is as far as the target follows the mouse [pixels]."""
        right, up, _ = self.axes()
        pixel = 2 * self.distance * np.tan(np.radians(self.fov) / 2) / max(height, 1)
        return self.shift(pixel * (rows * up - cols * right))

    def dolly(self, steps: float) -> "Viewpoint":
        """Go so many steps nearer to the target: a tenth of the way each, or less than 0 away."""
        factor = 0.9**steps
        if self.walks:
            return self.shift(self.distance * (1 - factor) * self.axes()[2])
        return replace(self, distance=max(self.distance * factor, 2 * self.near))

    def walk(self, ahead: float, right: float, up: float) -> "Viewpoint":
        """Go on level ground: metres ahead, to the right and up."""
        turn = np.radians(self.heading)
        level = np.array([np.sin(turn), np.cos(turn), 0.0])
        return self.shift(ahead * level + right * self.axes()[0] + np.array([0.0, 0.0, up]))

    def shift(self, way: NDArray[np.float64]) -> "Viewpoint":
        """Move eye and target alike [m]."""
        return replace(self, target=_point(np.array(self.target) + way))


def frame_bounds(
    bounds: NDArray[np.float64],
    size: tuple[int, int],
    like: Viewpoint | None = None,
    fov: float | None = None,
) -> Viewpoint:
    """
    Find the viewpoint from which a box (2, 3) fills a picture of a size.

    It looks in the direction of ``like``, with its field of view unless ``fov`` is given.
    """
    middle = bounds.mean(0)
    diagonal = max(float(np.linalg.norm(np.ptp(bounds, axis=0))), _LEAST)
    near = min(_NEAR_SHARE * diagonal, _NEAR_MOST)
    start = like or Viewpoint(_point(middle))
    start = replace(start, target=_point(middle), near=near, fov=fov or start.fov)
    right, up, forward = start.axes()
    corners = np.stack(np.meshgrid(*bounds.T), -1).reshape(-1, 3) - middle
    across = np.tan(np.radians(start.fov) / 2) * np.array([size[0] / size[1], 1.0])
    needed = np.abs(corners @ np.stack([right, up]).T) / across - (corners @ forward)[:, None]
    # A model seen from the rim of the picture fits; nothing is nearer than half its size.
    return replace(start, distance=max(float(needed.max()) * _MARGIN, diagonal / 2))


def _point(values: NDArray[np.float64]) -> Point:
    x, y, z = values.tolist()
    return x, y, z
