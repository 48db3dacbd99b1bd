"""
Masks of fewer pixels for frames: counted in a small picture, laid over the large one.

The weights are those of ``upsample.frag.glsl``, from positions in float64.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.masks.upsample import FILTERS
from umbra.rays.depth import NOTHING
from umbra.rays.visible import VisibleSurface
from umbra.scene import Camera, Light

if TYPE_CHECKING:
    from umbra.gl.frame import GlFrameCounter

__all__ = ["find_shares", "shrink", "upsample"]

THICKNESS = 0.02
"""How far from a surface's plane, for its distance, a pixel of it may lie."""

FAINT = 1e-4
"""Weight of a pixel of another surface: it counts only where all four are such."""

_ALIKE = 0.9  # cosine between normals of one surface


def shrink(camera: Camera, scale: int) -> Camera:
    """
    Give the same view in fewer pixels.

    Parameters
    ----------
    camera : Camera
    scale : int
        Pixels to one, along each side; a picture that it does not divide is covered.
    """
    cols, rows = camera.size
    fewer = -(-rows // scale)
    return replace(camera, size=(-(-cols * fewer // rows), fewer))


def find_shares(
    counter: "GlFrameCounter",
    frame: VisibleSurface,
    camera: Camera,
    lights: Sequence[Light],
    method: str = "auto",
    *,
    scale: int,
    kind: str = "joint",
) -> list[NDArray[np.float32]]:
    """
    Find what share of each light casters leave to each visible point, by a small mask.

    Parameters
    ----------
    counter : GlFrameCounter
    frame : VisibleSurface
        Of this camera.
    camera : Camera
    lights : sequence of Light
    method : str
        Any that the counter has.
    scale : int
        Pixels of the frame to one of the mask, along each side.
    kind : {'nearest', 'bilinear', 'joint'}

    Returns
    -------
    shares : list of (rows, cols) float32
        1 where the light is whole, 0 in shadow.
    """
    small = shrink(camera, scale)
    view, seen = counter.see(small)
    masks = [counter.count(view, small, light, method) == 0 for light in lights]
    return [upsample(mask, seen, frame, camera, kind) for mask in masks]


def upsample(
    lit: NDArray[np.bool_],
    small: VisibleSurface,
    frame: VisibleSurface,
    camera: Camera,
    kind: str = "joint",
) -> NDArray[np.float32]:
    """
    Lay a small mask over a frame.

    Parameters
    ----------
    lit : (fewer_rows, fewer_cols) bool
    small : VisibleSurface
        Of the mask.
    frame : VisibleSurface
        Of ``camera``.
    camera : Camera
    kind : {'nearest', 'bilinear', 'joint'}
        ``joint`` is bilinear between pixels that lie in the plane of what is seen.

    Returns
    -------
    share : (rows, cols) float32

    Raises
    ------
    InputError
        If there is no such filter.
    """
    if kind not in FILTERS:
        msg = f"there is no filter '{kind}'; there are {', '.join(FILTERS)}"
        raise InputError(msg, filter=kind)
    (rows, cols), (fewer_rows, fewer_cols) = frame.part.shape, lit.shape
    # Both pictures are centred alike, and the rows of both span the view.
    scale = rows / fewer_rows
    x = (np.arange(cols) + 0.5 - cols / 2) / scale + fewer_cols / 2 - 0.5
    y = (np.arange(rows) + 0.5) / scale - 0.5
    if kind == "nearest":
        near_y, near_x = _clip(np.rint(y), fewer_rows), _clip(np.rint(x), fewer_cols)
        return lit[near_y[:, None], near_x[None]].astype(np.float32)
    depth = np.abs((frame.position - camera.eye) @ camera.axes()[2])
    total, weights = np.zeros((2, rows, cols))
    base_x, base_y = np.floor(x), np.floor(y)
    for dy in (0, 1):
        at_y = _clip(base_y + dy, fewer_rows)[:, None]
        weight_y = np.abs(1 - dy - (y - base_y))[:, None]
        for dx in (0, 1):
            at_x = _clip(base_x + dx, fewer_cols)[None]
            weight = weight_y * np.abs(1 - dx - (x - base_x))[None]
            if kind == "joint":
                apart = small.position[at_y, at_x] - frame.position
                alike = np.abs(np.einsum("ijk,ijk->ij", apart, frame.normal)) < THICKNESS * depth
                turned = np.einsum("ijk,ijk->ij", small.normal[at_y, at_x], frame.normal)
                alike &= (turned > _ALIKE) & (small.part[at_y, at_x] != NOTHING)
                weight = np.where(alike, weight, FAINT * weight)
            total += weight * lit[at_y, at_x]
            weights += weight
    return (total / weights).astype(np.float32)


def _clip(place: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    return np.clip(place, 0, count - 1).astype(np.intp)
