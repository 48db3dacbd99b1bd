"""
Upsampling of reduced masks, over a picture on the device or a frame in float64.

Both use the weights of ``upsample.frag.glsl``.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.context import Device
from umbra.gl.functions import TEXTURE_2D
from umbra.gl.masks.passes import Tally
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State
from umbra.gl.target import Target
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, Light

__all__ = ["FILTERS", "Upsampler", "find_shares", "shrink", "upsample"]

FILTERS = ("nearest", "bilinear", "joint")
"""``joint`` is bilinear between pixels that lie in the plane of what is seen."""

_LINEAR = 0x2601


class Upsampler:
    """Multiplies a picture by a mask; an ``is_plain`` mask holds 0 and 1 in eight bits."""

    def __init__(self, device: Device, kind: str, *, is_plain: bool = False) -> None:
        self._device, self.kind = device, kind
        self._is_linear = is_plain and kind == "bilinear"
        needs = {"IS_JOINT": kind == "joint", "IS_LINEAR": self._is_linear}
        defines = {name: 1 for name, needed in needs.items() if needed}
        self._program = Program(device, "picture.vert.glsl", "upsample.frag.glsl", defines)

    def apply(
        self,
        state: State,
        projection: Projection,
        mask: Target,
        picture: Target,
        tally: Tally,
        *,
        channel: int,
        lit: tuple[float, float],
        dark: float,
        scale: float | None = None,
        mask_places: Target | None = None,
    ) -> None:
        """
        Multiply the target in use by attachment 0 of a mask, by one rectangle.

        Attachments 1 of mask (or ``mask_places``) and picture hold normals and keys where the
        filter needs them. Lit values of the mask's channel are within ``lit``; all others are
        multiplied by ``dark``. The mask fills the picture, unless ``scale`` is the number of
        picture pixels per mask pixel, both square and centred alike.
        """
        state.use(Pass(color_write="rgb", blend="multiply"))
        if self.kind == "joint":
            picture.bind(1, 1)
            (mask_places or mask).bind(2, 1)
        mask.bind(0)
        if self._is_linear:
            for parameter in (0x2800, 0x2801):
                self._device.gl.TexParameteri(TEXTURE_2D, parameter, _LINEAR)
        mask_size = np.array(mask.size, float)
        self._program.set(
            scale=np.array(picture.size) / mask_size if scale is None else np.full(2, scale),
            mask_size=mask_size, middle=np.array(picture.size) / 2,
            mask=0, places=1, low_places=2, channel=channel, low=lit[0], high=lit[1], dark=dark,
            is_smooth=int(self.kind != "nearest"), **projection.rays,
        )  # fmt: skip
        self._program.draw(3)
        tally.rectangles.append("apply")

    def release(self) -> None:
        """Free the program."""
        self._program.release()


if TYPE_CHECKING:
    from umbra.gl.frame import GlFrameCounter


THICKNESS = 0.02
"""How far from a surface's plane, for its distance, a pixel of it may lie."""

FAINT = 1e-4
"""Weight of a pixel of another surface: it counts only where all four are such."""

_ALIKE = 0.9  # cosine between normals of one surface


def shrink(camera: Camera, scale: int) -> Camera:
    """Return the view in ``scale`` times fewer columns and rows, rounded up."""
    cols, rows = camera.size
    fewer = -(-rows // scale)
    (across, down), (right, below) = (
        (each[0] * fewer / rows, each[1] * fewer / rows) for each in (camera.offset, camera.shift)
    )
    size = -(-cols * fewer // rows), fewer
    return replace(camera, size=size, offset=(across, down), shift=(right, below))


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
    Find the visibility of each light at each visible point, from a reduced mask.

    Parameters
    ----------
    counter : GlFrameCounter
    frame : Frame
        Frame of this camera.
    camera : Camera
    lights : sequence of Light
    method : str
        Any method of the counter.
    scale : int
        Pixels of the frame per pixel of the mask, along each side.
    kind : {'nearest', 'bilinear', 'joint'}

    Returns
    -------
    shares : list of (rows, cols) float32
        1 fully lit, 0 in shadow.
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
    Upsample a mask ``lit`` of the frame ``small`` to a frame; kind as in ``find_shares``.

    Raises `InputError` if there is no such filter.
    """
    if kind not in FILTERS:
        msg = f"there is no filter '{kind}'; there are {', '.join(FILTERS)}"
        raise InputError(msg, filter=kind)
    (rows, cols), (fewer_rows, fewer_cols) = frame.part.shape, lit.shape
    # Both pictures have the same centre, and the rows of both span the view.
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
