"""
Another program's view and projection matrices, as umbra's own projection.

Any matrices of a pinhole or a parallel view: off-axis, of any handedness, mirrored, with pixels
that are not square, and depth in any of OpenGL's three conventions. The map from the world to the
clip space tells it all: W is 0 in the eye's plane, X and Y are 0 along the view axis, and Z says
where the near and far planes are.
"""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, UmbraError
from umbra.gl.projection import CameraProjection
from umbra.scene import Camera
from umbra.scene.numbers import read_array

__all__ = ["DEPTHS", "read_projection"]

DEPTHS = ("minus-one-to-one", "zero-to-one", "reversed")
"""How depth runs from the near to the far plane: -1 to 1, 0 to 1, or 1 to 0."""

_SKEW = 1e-5  # sine by which the axes of a picture and of depth may be off a right angle
_ENDLESS = 1e-9  # of 1, by which the product of two matrices may be off
_BEFORE = 1e-3  # of the depth of a parallel view: how far its eye stands before the near plane


class ClipDevice(Protocol):
    """What is asked of a device: whether its clip space may be from 0 to 1, and its name."""

    reverses_depth: bool
    renderer: str


def read_projection(
    device: ClipDevice,
    view: ArrayLike,
    projection: ArrayLike,
    size: tuple[int, int],
    origin: NDArray[np.float64],
    depth: str = "minus-one-to-one",
) -> CameraProjection:
    """
    Read matrices for column vectors: ``clip = projection @ view @ point``.

    Parameters
    ----------
    device : ClipDevice
    view, projection : (4, 4) float
    size : (int, int)
        Columns and rows of the viewport.
    origin : (3,) float64
        Of the scene [m].
    depth : str
        One of ``DEPTHS``.

    Returns
    -------
    projection : CameraProjection
        Whose clip matrix gives the same places and depths.

    Raises
    ------
    InputError
        If the matrices are no view, or a sheared one.
    UmbraError
        If the driver has no glClipControl, which depth from 0 needs.
    """
    if depth not in DEPTHS:
        msg = f"there is no depth={depth!r}; there are {', '.join(DEPTHS)}"
        raise InputError(msg, option="depth")
    if depth != "minus-one-to-one" and not device.reverses_depth:
        msg = (
            f"depth={depth!r} needs glClipControl (OpenGL 4.5), which {device.renderer} does not "
            "have; draw with depth='minus-one-to-one'"
        )
        raise UmbraError(msg, option="depth")
    if min(size) < 1:
        msg = f"a viewport of {size[0]}x{size[1]} pixels is empty; give at least 1x1"
        raise InputError(msg, option="viewport")
    matrix = _read_matrix("projection", projection) @ _read_matrix("view", view)
    if depth == "zero-to-one":
        matrix[2] = 2.0 * matrix[2] - matrix[3]
    elif depth == "reversed":
        matrix[2] = matrix[3] - 2.0 * matrix[2]
    is_perspective = bool(np.abs(matrix[3, :3]).max() > 1e-12 * np.abs(matrix[3]).max())
    matrix = matrix / (np.linalg.norm(matrix[3, :3]) if is_perspective else matrix[3, 3] or 1.0)
    camera, is_mirrored = _find_camera(matrix, size, is_perspective=is_perspective)
    if is_mirrored:
        matrix[0] = -matrix[0]
    matrix[:, 3] = matrix @ np.append(camera.eye, 1.0)  # now relative to the eye
    matrix[:, 3] *= (0.0, 0.0, 1.0, 0.0 if is_perspective else 1.0)
    return CameraProjection(
        matrix, camera.eye - origin, camera, camera, reverses_depth=depth == "reversed",
        is_zero_to_one=depth == "zero-to-one", is_mirrored=is_mirrored,
    )  # fmt: skip


def _read_matrix(option: str, matrix: ArrayLike) -> NDArray[np.float64]:
    values = read_array(f"{option}=", matrix)
    if values.shape != (4, 4) or not np.isfinite(values).all():
        msg = f"{option}= is a matrix of shape (4, 4), finite; got shape {values.shape}"
        raise InputError(msg, option=option)
    return values.astype(np.float64)


def _find_camera(
    matrix: NDArray[np.float64], size: tuple[int, int], *, is_perspective: bool
) -> tuple[Camera, bool]:
    """
    Find the camera of a matrix with depth -w to w, and whether its picture is mirrored.

    W is the distance along the view axis [m], or 1 in a parallel view.
    """
    across, upward, along, weight = matrix[:, :3]
    forward = weight if is_perspective else along / max(np.linalg.norm(along), 1e-300)
    # Off-axis views add a multiple of W to X and Y.
    aside = np.array([across @ forward, upward @ forward])
    right, up = across - aside[0] * forward, upward - aside[1] * forward
    scale = np.array([np.linalg.norm(right), np.linalg.norm(up)])
    deepness = float(along @ forward)
    skews = [along - deepness * forward]
    if not is_perspective:
        skews += [(across - right), (upward - up)]
    sizes = [max(abs(deepness), 1e-300), *scale]
    if not (scale > 0).all() or not (is_perspective or deepness > 0):
        msg = "projection @ view is not a view: a row of it is 0 or depends on another"
        raise InputError(msg, option="projection")
    right, up = right / scale[0], up / scale[1]
    is_skewed = abs(float(right @ up)) > _SKEW or any(
        np.linalg.norm(skew) > _SKEW * max(whole, float(is_perspective))
        for skew, whole in zip(skews, sizes, strict=False)
    )
    if is_skewed:
        msg = (
            "projection @ view shears the picture or its depth (an oblique near plane, a skewed "
            "or unevenly scaled view); give a projection of glFrustum's or glOrtho's kind"
        )
        raise InputError(msg, option="projection")
    is_mirrored = bool(np.cross(right, forward) @ up < 0)
    if is_mirrored:
        right, aside = -right, aside * (-1.0, 1.0)
    cols, rows = size
    stretch = float(scale[1] / scale[0]) * rows / cols
    if not is_perspective:
        # The eye stands where X and Y are 0, a little before the near plane.
        begin, depth = np.append(-matrix[:2, 3], -1.0 - matrix[2, 3]), 2.0 / deepness
        eye = np.linalg.solve(matrix[:3, :3], begin) - _BEFORE * depth * forward
        camera = Camera(
            eye, eye + forward * _away(eye), up, size, height=float(2.0 / scale[1]),
            near=_BEFORE * depth, far=(1.0 + _BEFORE) * depth, stretch=stretch,
        )  # fmt: skip
        return camera, is_mirrored
    used = np.array([0, 1, 3])
    eye = np.linalg.solve(matrix[used, :3], -matrix[used, 3]).astype(np.float64)
    near, far = _find_planes(deepness, float(matrix[2] @ np.append(eye, 1.0)))
    camera = Camera(
        eye, eye + forward * _away(eye), up, size, float(2.0 * np.degrees(np.arctan(1 / scale[1]))),
        near=near, far=far, shift=(aside[0] * cols / 2, -aside[1] * rows / 2), stretch=stretch,
    )  # fmt: skip
    return camera, is_mirrored


def _away(eye: NDArray[np.float64]) -> float:
    """Return a distance to the target that keeps the digits of the direction."""
    return max(1.0, float(np.abs(eye).max()))


def _find_planes(deepness: float, offset: float) -> tuple[float, float]:
    """Find the near and far plane of Z = deepness * distance + offset, from -w to w [m]."""
    near = -offset / (deepness + 1.0) if deepness > -1.0 else 0.0
    left = deepness - 1.0
    far = np.inf if abs(left) < _ENDLESS else -offset / left
    if not 0 < near < far:
        msg = (
            f"projection= has its near plane at {near:g} m and its far plane at {far:g} m; state "
            f"how depth runs: depth= is one of {', '.join(DEPTHS)}"
        )
        raise InputError(msg, option="depth")
    return float(near), float(far)
