"""Cameras: rays of pixels, and the matrix from world to pixels."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, show_value
from umbra.scene.numbers import OUTSIDE, check_reach, read_array, read_number, read_vector

__all__ = [
    "Camera",
    "find_offsets",
    "fit_camera",
]

_GOLDEN = (5**0.5 - 1) / 2
_HALVINGS = 24  # of the place of a camera: less than a pixel
_LEAST_UP = 1e-60
_FARTHEST = 0.5  # most offset of a ray from its pixel's centre [pixels]


def _is_whole(number: object) -> bool:
    return isinstance(number, Integral) and not isinstance(number, bool)


@dataclass(frozen=True, eq=False)
class Camera:
    """
    A perspective or orthographic camera.

    Parameters
    ----------
    eye, target : (3,) float64
        In the model's own coordinates [m].
    up : (3,) float64
        Appears upward in the picture.
    size : (int, int)
        Columns and rows of pixels; row 0 is the top.
    fov : float, optional
        Vertical field of view [degrees] of a perspective camera.
    height : float, optional
        Height of the picture [m] of an orthographic camera.
    near, far : float
        Distances along the view axis [m]; far may be infinite.
    offset : (float, float)
        Offset of rays to the right of and below pixel centres, up to half [pixels].
    shift : (float, float)
        How far the view axis meets the picture to the right of and below its middle [pixels]: an
        off-axis view.
    stretch : float
        Width of a pixel, in its heights.

    Raises
    ------
    InputError
        If the view is degenerate.
    """

    eye: NDArray[np.float64]
    target: NDArray[np.float64]
    up: NDArray[np.float64] = (0.0, 0.0, 1.0)  # type: ignore[assignment]
    size: tuple[int, int] = (1024, 768)
    fov: float = 50.0
    height: float | None = None
    near: float = 0.1
    far: float = np.inf
    offset: tuple[float, float] = (0.0, 0.0)
    shift: tuple[float, float] = (0.0, 0.0)
    stretch: float = 1.0

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            value = read_vector(f"the camera's {name}", getattr(self, name))
            if name != "up":
                what = f"the coordinates of the camera's {name}"
                check_reach(what, value, "place it near the model", OUTSIDE)
            elif not _LEAST_UP < np.abs(value).max() < 1 / _LEAST_UP:  # its square would overflow
                value = np.ldexp(value, -np.frexp(np.abs(value).max())[1])
            object.__setattr__(self, name, value)
        size = self.size
        if not (isinstance(size, (tuple, list)) and len(size) == 2 and all(map(_is_whole, size))):
            msg = f"a picture's size is two whole numbers of pixels; got {show_value(size)}"
            raise InputError(msg)
        cols, rows = size
        for name in ("fov", "height", "near", "far"):
            if name != "height" or self.height is not None:
                number = read_number(f"the camera's {name}", getattr(self, name))
                object.__setattr__(self, name, number)
        if cols < 1 or rows < 1:
            msg = f"a picture of {cols}x{rows} pixels is empty; give at least 1x1"
            raise InputError(msg)
        if not 0 < self.near < self.far:
            msg = f"near= must lie between 0 and far; got near {self.near:g}, far {self.far:g}"
            raise InputError(msg, option="near")
        if self.height is None and not 0 < self.fov < 180:
            msg = f"the field of view, fov=, must lie between 0 and 180 degrees; got {self.fov:g}"
            raise InputError(msg, option="fov")
        if self.height is not None and not 0 < self.height < np.inf:
            msg = f"an orthographic picture needs a height= above 0 m; got {self.height:g}"
            raise InputError(msg, option="height")
        offset = read_array("a camera's offset", self.offset)
        if offset.shape != (2,) or not (np.abs(offset) <= _FARTHEST).all():
            msg = f"pixels look at most half a pixel off their centres; got {self.offset}"
            raise InputError(msg)
        self._check_lens()
        forward = self.target - self.eye
        if not np.linalg.norm(np.cross(forward, self.up)) > 1e-12 * np.linalg.norm(
            forward
        ) * np.linalg.norm(self.up):
            msg = (
                "the camera looks along its up vector or at its own eye; "
                "move the target or give another up="
            )
            raise InputError(msg, option="up")

    def _check_lens(self) -> None:
        """Raise `InputError` if the shift or the stretch is out of range."""
        shift = read_array("a camera's shift", self.shift)
        stretch = read_number("a camera's stretch", self.stretch)
        if shift.shape != (2,) or not np.isfinite(shift).all() or not 0 < stretch < np.inf:
            msg = (
                "a camera's shift= is two numbers of pixels, and its stretch= is above 0; "
                f"got {self.shift} and {self.stretch}"
            )
            raise InputError(msg)

    @property
    def is_perspective(self) -> bool:
        """Whether rays meet in the eye."""
        return self.height is None

    def axes(self) -> NDArray[np.float64]:
        """Return the axes (3, 3), read only: rows right, up, forward; orthonormal, world frame."""
        return self._axes

    @cached_property
    def _axes(self) -> NDArray[np.float64]:
        forward = self.target - self.eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(right, forward), forward])
        axes.setflags(write=False)
        return axes

    def begin_at(self, near: float) -> Camera:
        """Return the same view with another near plane [m], of which nothing is checked again."""
        other = copy(self)
        object.__setattr__(other, "near", near)
        return other

    @property
    def center(self) -> tuple[float, float]:
        """Principal point of the picture, as a pixel (column, row)."""
        cols, rows = self.size
        across, down = self.aside
        return (cols - 1) / 2 - across, (rows - 1) / 2 - down

    @property
    def aside(self) -> tuple[float, float]:
        """How far the picture's middle is to the right of and below the view axis [pixels]."""
        return self.offset[0] - self.shift[0], self.offset[1] - self.shift[1]

    def slant(self) -> tuple[float, float]:
        """How far right and up of its direction the picture's middle lies, per distance ahead."""
        if not self.is_perspective:
            return 0.0, 0.0
        length = self.size[1] / (2 * np.tan(np.radians(self.fov) / 2))  # focal [pixels]
        return -self.shift[0] * self.stretch / length, self.shift[1] / length

    @property
    def pixel_axes(self) -> NDArray[np.float64]:
        """Axes (3, 3) as ``axes``, of which right is as long as a pixel is wide, in its heights."""
        return self.axes() * np.array([[self.stretch], [1.0], [1.0]])

    def matrix(self, origin: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
        """
        Return the homogeneous map from the world to pixels.

        A point p maps to (X, Y, W, K): its pixel is (X/W, Y/W), where pixel
        centres are whole numbers, columns run right and rows run down; its depth
        key K/W is larger the nearer it is (1/distance along the view axis in
        perspective, minus that distance in an orthographic view) and affine in
        the picture across a plane. A point is in front of the eye where W > 0.

        Parameters
        ----------
        origin : (3,) float64
            Subtracted from the eye: points are given relative to it [m].

        Returns
        -------
        matrix : (4, 4) float64
        """
        _, rows = self.size
        eye = self.eye - np.asarray(origin, np.float64)
        right, up, depth = (_join(axis, -axis @ eye) for axis in self.axes())
        centre = self.center
        constant = np.array([0.0, 0.0, 0.0, 1.0])
        if self.height is None:
            scale = rows / 2 / np.tan(np.radians(self.fov) / 2)
            weight, key = depth, constant
        else:
            scale = rows / self.height
            weight, key = constant, -depth
        across = scale / self.stretch * right
        return np.array(
            [across + centre[0] * weight, -scale * up + centre[1] * weight, weight, key]
        )

    def key_range(self) -> tuple[float, float]:
        """Return the depth keys (far, near): a visible point's key lies between them."""
        if self.height is None:
            return 1.0 / self.far, 1.0 / self.near
        return -self.far, -self.near

    def apex(self, origin: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
        """
        Return the homogeneous origin of all rays (4,), relative to an origin [m].

        It is the eye with w = 1, or the direction back along the rays with w = 0.
        """
        if self.height is None:
            return _join(self.eye - np.asarray(origin, np.float64), 1.0)
        return _join(-self.axes()[2], 0.0)


def _join(vector: NDArray[np.float64], last: float) -> NDArray[np.float64]:
    """Return a homogeneous vector, (4,); five times as fast as ``np.append``."""
    joined = np.empty(4)
    joined[:3], joined[3] = vector, last
    return joined


def fit_camera(camera: Camera, points: NDArray[np.float64], margin: float = 0.06) -> Camera:
    """
    Move a camera, without turning it, so that points (n, 3) fill its picture but for a margin.

    In perspective each side of the picture is a plane through the eye that touches the points: two
    opposite planes give the nearest eye that sees all between them; the farther of both pairs
    decides. An orthographic camera is only centred. ``margin`` is a share of the picture on every
    side. A shift of a perspective camera is kept: it shears what is seen.
    """
    axes, (cols, rows) = camera.axes(), camera.size
    x, y, z = (points @ axes.T).T
    right, up = camera.slant()
    x, y = x - right * z, y - up * z
    if camera.height is not None:
        middle = [float(along.min() + along.max()) / 2 for along in (x, y)]
        depth = float(z.min()) - max(float(np.ptp(z)), 1.0)
    else:
        half = np.tan(np.radians(camera.fov) / 2) * (1.0 - 2.0 * margin)
        depth = float(z.min()) - 2 * camera.near
        for along, slope in ((x, half * cols / rows), (y, half)):
            sides = float((along - slope * z).max()), float((-along - slope * z).max())
            depth = min(depth, -sum(sides) / (2 * slope))
        middle = [_find_middle(along, z - depth) for along in (x, y)]
    eye = np.array([middle[0] + right * depth, middle[1] + up * depth, depth]) @ axes
    away = max(float(np.median(z)) - depth, camera.near)
    return replace(camera, eye=eye, target=eye + away * axes[2])


def _find_middle(along: NDArray[np.float64], away: NDArray[np.float64]) -> float:
    """Find the place across from which points appear as far to one side as to the other."""
    low, high = float(along.min()), float(along.max())
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        seen = (along - middle) / away
        if seen.max() + seen.min() > 0:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def find_offsets(samples: int) -> NDArray[np.float64]:
    """
    Find sample positions in a pixel for antialiasing, (samples, 2), for ``Camera.offset``.

    No two share a row or column, so vertical and horizontal edges have as many levels; the
    golden ratio spreads the rows, so that other edges have nearly as many. A single sample is
    the centre.
    """
    number = np.arange(samples)
    rank = ((number + 1) * _GOLDEN % 1.0).argsort().argsort()
    return (np.stack([number, rank], 1) + 0.5) / samples - 0.5
