"""
Upsampling of reduced masks, over a picture on the device or a frame in float64.

Both use the weights of ``upsample.frag.glsl``.

`SmallMasks` counts hard shadows at reduced resolution and keeps the upsampled visibility of each
light on the device: the same result as `find_shares` of a frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.context import Device, release_all
from umbra.gl.functions import TEXTURE_2D
from umbra.gl.masks.counter import MaskCounters
from umbra.gl.masks.passes import Tally
from umbra.gl.planner import Planner
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection
from umbra.gl.soft import SoftLights
from umbra.gl.soft.visibility import Visibility
from umbra.gl.state import Pass, State
from umbra.gl.surface_renderer import SurfaceRenderer
from umbra.gl.target import LIGHT, PLACE, Target, find_surface_formats
from umbra.gl.volume_counter import Stack, VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, Light
from umbra.soft import AreaLight

if TYPE_CHECKING:
    from umbra.gl.frame_counter import GlFrameCounter

__all__ = ["FILTERS", "SmallMasks", "Upsampler", "find_shares", "shrink", "upsample"]

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
        projection: CameraProjection,
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
        (pair[0] * fewer / rows, pair[1] * fewer / rows) for pair in (camera.offset, camera.shift)
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


def _clip(index: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    return np.clip(index, 0, count - 1).astype(np.intp)


_LIT = (0.5, 1.0)


class SmallMasks(Visibility):
    """
    Visibility of each hard light at each pixel, from a mask of reduced resolution.

    Its lights are chosen by ``select``.

    Parameters
    ----------
    planner : Planner
    surfaces : SurfaceRenderer
    masks : MaskCounters
    find_surface : callable
        Returns the picture's own surface target.
    """

    def __init__(
        self,
        planner: Planner,
        surfaces: SurfaceRenderer,
        masks: MaskCounters,
        find_surface: Callable[[], Target],
    ) -> None:
        self._scene, self._surfaces, self._masks = planner, surfaces, masks
        self._find_surface = find_surface
        self._choice = ("auto", 1, "joint")
        self._plans: list[VolumePlan] = []
        self._projections: tuple[CameraProjection, CameraProjection] | None = None
        self._is_drawn = False
        self._held: _Held | None = None

    def select(
        self, lights: Sequence[Light], method: str, scale: int, kind: str = "joint"
    ) -> SoftLights:
        """Count all lights by a method, in ``scale`` times fewer columns and rows."""
        self._choice = method, scale, kind
        return SoftLights(self, {n: AreaLight(light, 0.0) for n, light in enumerate(lights)})

    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Plan the reduced picture; see `Visibility`."""
        method, scale, _ = self._choice
        held = self._held = self._held or _Held(self._scene)
        small = held.planner.project(shrink(projection.asked, scale))
        _, method = self._masks.choose(method, held.counter)
        self._plans = held.planner.plan(small, [light.light for light in lights], method)
        self._projections, self._is_drawn = (projection, small), False

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        assert self._held is not None
        assert self._projections is not None
        held, (projection, small) = self._held, self._projections
        surface = held.find_target(small.camera.size)
        if not self._is_drawn:
            surface.begin(state)
            for attachment in (LIGHT, PLACE):
                surface.clear_color(0.0, attachment=attachment)
            self._surfaces.draw(state, small, self._scene.ground)
            self._is_drawn = True
        method, _, kind = self._choice
        counter, _ = self._masks.choose(method, held.counter)
        mask = held.small.begin(state, surface, 1.0)
        counter.count(state, mask, self._plans[number])
        mask.use()
        held.small.add_shadow(state, 0.0, self._plans[number].scissor)
        shares = held.large.begin(state, target, 1.0)
        held.find_upsampler(kind).apply(
            state, projection, mask, self._find_surface(), Tally(), mask_places=surface,
            channel=0, lit=_LIT, dark=0.0, scale=target.size[1] / mask.size[1],
        )  # fmt: skip
        return shares

    def release(self) -> None:
        """Free the device objects; later use makes them again."""
        release_all(self._held)
        self._held = None


class _Held:
    """Device objects of small masks."""

    def __init__(self, planner: Planner) -> None:
        self._device = device = planner.device
        self.planner = planner.twin()
        self.counter = VolumeCounter(device, planner.geometry, self.planner.indices)
        self.small, self.large = Stack(device), Stack(device)
        self._upsamplers: dict[str, Upsampler] = {}
        self._target: Target | None = None

    def find_target(self, size: tuple[int, int]) -> Target:
        """Return the target of small surfaces."""
        if self._target is None or self._target.size != size:
            self.small.release()
            self.small = Stack(self._device)
            release_all(self._target)
            self._target = Target(self._device, size, find_surface_formats("rgba16f"))
        return self._target

    def find_upsampler(self, kind: str) -> Upsampler:
        """Return the upsampler of a filter."""
        if kind not in self._upsamplers:
            self._upsamplers[kind] = Upsampler(self._device, kind)
        return self._upsamplers[kind]

    def release(self) -> None:
        """Free the device objects."""
        release_all(*self._upsamplers.values(), self.small, self.large, self._target)
        release_all(self.counter, self.planner)
