"""
The paper's renderer: its passes and rectangles, and masks of full or reduced resolution.

    alpha   scene -> volumes in alpha -> 3 rectangles -> scene x alpha -> + ambient
    screen  depth -> volumes in colour -> 3 rectangles -> x scene -> + ambient
    scaled  small depth -> volumes -> rectangles -> scene -> x texture -> + ambient

The picture of one light is the paper's. A mask multiplies the whole picture, so each of several
lights has a picture without ambient light, and one rectangle adds it to the sum. ``tally``
counts passes and rectangles, as in Table 1.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.context import Device, DeviceUser, on_device, release_all
from umbra.gl.geometry import Geometry
from umbra.gl.masks import MASKS, MaskStep, Method
from umbra.gl.masks.counter import MaskCounter
from umbra.gl.masks.passes import Forward, Look, Tally
from umbra.gl.masks.upsampling import FILTERS, Upsampler
from umbra.gl.planner import Planner
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection, make_projection
from umbra.gl.selection import VolumeOptions
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.target import Target
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.scene import Camera, Light, Scene

__all__ = ["MaskPicture"]

_ONE = MaskStep("multiply", 0.0)


class MaskPicture(DeviceUser):
    """
    Draws a scene in any number of lights, with shadows by masks.

    Parameters
    ----------
    scene : Scene
    method : Method or str
        One of ``umbra.gl.masks.MASKS``, or ``stencil``.
    casters : sequence of int, optional
        Indices of the parts that cast; all by default.
    scale : int
        Pixels of the picture per pixel of the mask, along each side.
    filter : {'nearest', 'bilinear', 'joint'}
        Upsampling filter of a reduced mask.
    device : Device, optional
        A new one by default, released with this object.
    warn : callable
        Called with one line where the method may be wrong.

    Raises
    ------
    InputError
        If scale or filter is invalid.

    Attributes
    ----------
    tally : Tally
        Tally of the last picture.
    """

    def __init__(
        self,
        scene: Scene,
        method: Method | str,
        *,
        casters: Sequence[int] | None = None,
        scale: int = 1,
        filter: str = "bilinear",  # noqa: A002  (the usual term)
        device: Device | None = None,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        if filter not in FILTERS or scale < 1:
            msg = f"no filter '{filter}' at scale {scale}; there are {', '.join(FILTERS)}, from 1"
            raise InputError(msg)
        self.scene, self.scale = scene, scale
        super().__init__(device)
        with self.device.current():
            self.geometry = Geometry(self.device, scene)
            self.planner = Planner(self.device, scene, self.geometry, casters)
            by_name = {"stencil": None, **MASKS}  # the stencil is not a mask method
            self.method = by_name[method] if isinstance(method, str) else method
            self._stencil = VolumeCounter(self.device, self.geometry, self.planner.indices)
            # A reduced mask of the stencil is converted to colours like the others.
            colors = self.method or MASKS["alpha"]
            self._colors = MaskCounter(self.device, self.geometry, colors, warn=warn)
            # A mask that is not 8-bit alpha is applied as a texture, even at full size.
            is_plain = colors.format == "rgba8"
            self._upsampler = (
                Upsampler(self.device, filter if scale > 1 else "nearest", is_plain=is_plain)
                if scale > 1 or not is_plain
                else None
            )
            self._is_joint = scale > 1 and filter == "joint"
            self._forward = Forward(self.device, scene, self.geometry)
            self._copy = Program(self.device, "picture.vert.glsl", "share.frag.glsl")
        self._targets: list[Target] = []
        self._sum: Target | None = None
        self._shown: Target | None = None

    @property
    def tally(self) -> Tally:
        """Passes and rectangles of the last picture."""
        return self._colors.painter.tally

    @on_device
    def draw(
        self,
        camera: Camera,
        lights: Light | Sequence[Light],
        shadows: str | None = "ambient",
        *,
        remains: float = 0.5,
        white: bool = False,
    ) -> None:
        """
        Draw a picture.

        Parameters
        ----------
        camera : Camera
        lights : Light or sequence of Light
            If empty, everything is in shadow.
        shadows : {'black', 'ambient', 'attenuated'}, optional
            Shadows are black, lit by ambient light alone, or less bright; None draws none.
        remains : float
            Share of its brightness that remains to what is attenuated, from 0 to 1.
        white : bool
            Draw all surfaces white, to show the mask alone, or the mean of the lights' masks.
        """
        lamps = [lights] if isinstance(lights, Light) else list(lights)
        dark = remains if shadows == "attenuated" else 0.0
        picture, _, _ = self._find_targets(camera.size)
        projection = make_projection(
            camera,
            self.scene.origin,
            self._bounds(),
            reverses_depth=self.device.reverses_depth,
        )
        plans: Sequence[VolumePlan | None] = [None] * len(lamps)
        if shadows is not None:
            choices = VolumeOptions(narrow=False)
            plans = self.planner.plan(projection, lamps, "mcguire", choices=choices)
        self.tally.clear()
        with State(self.device) as state:
            total = self._begin_sum(state, picture) if len(lamps) != 1 else None
            # Surfaces must have the same tilt of parallel rays: they are drawn for each light.
            shown, look = projection, Look(np.array([0.0, 0.0, 1.0, 0.0]), is_white=white)
            for light, plan in zip(lamps, plans, strict=True):
                shown = plan.projection if plan is not None else projection
                source = light.local(self.scene.origin)
                source[:3] -= source[3] * projection.eye
                look = Look(source, light.color, 1.0 / len(lamps), is_white=white)
                self._draw_light(state, shown, plan, look, shadows, dark)
                if total is not None:
                    self._add(state, picture, total, 1.0 / len(lamps) if white else 1.0)
            if total is not None and not lamps:
                self._clear(state, picture)
                self._forward.draw_depth(state, shown, self.tally)
                total.use()
            if shadows == "ambient" or (not lamps and shadows != "black"):
                everywhere = replace(look, share=1.0)
                self._forward.draw_scene(
                    state, shown, everywhere, self.tally, lights="ambient", blend="add"
                )
        self._shown = total or picture

    @on_device
    def read(self) -> NDArray[np.uint8]:
        """Read the last picture, (rows, cols, 3) uint8, linear; row 0 at the top."""
        assert self._shown is not None
        values = self._shown.read()[..., :3]
        if values.dtype != np.uint8:
            values = np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
        return np.ascontiguousarray(values)

    def _draw_light(
        self,
        state: State,
        shown: CameraProjection,
        plan: VolumePlan | None,
        look: Look,
        shadows: str | None,
        dark: float,
    ) -> None:
        """Draw the picture of one light, without ambient light that is not shadowed."""
        picture, color, mask = self._find_targets(shown.camera.size)
        tally = self.tally
        by_texture = self._upsampler is not None and plan is not None
        if by_texture and plan is not None:
            self._draw_mask(state, shown, plan, mask, look)
        is_screen = self.method is not None and self.method.write == "rgb" and not by_texture
        lights = "direct" if shadows in ("black", "ambient") else "both"
        if is_screen and plan is not None and shadows is not None:
            self._clear(state, color, self.method.start if self.method else 1.0)
            self._forward.draw_depth(state, shown, tally)
            self._draw_volumes(state, plan, dark)
            self._forward.draw_scene(state, shown, look, tally, lights=lights, blend="multiply")
            return
        alpha = self.method.start if self.method else 1.0
        self._clear(state, picture, 1.0, 1.0, 1.0, alpha)
        self._forward.draw_scene(
            state, shown, replace(look, alpha=alpha), tally, lights=lights,
            with_place=self._is_joint,
        )  # fmt: skip
        color.use()
        if by_texture:
            self._apply(state, shown, mask, picture, dark)
        elif plan is not None and shadows is not None:
            self._draw_full(state, plan, color, dark)

    def _begin_sum(self, state: State, picture: Target) -> Target:
        """Clear the target that sums the lights' pictures."""
        if self._sum is None or self._sum.depth_of is not picture:
            release_all(self._sum)
            self._sum = Target(self.device, picture.size, ("rgba16f",), depth_of=picture)
        self._sum.fill(state, 0.0)
        return self._sum

    def _add(self, state: State, picture: Target, total: Target, share: float) -> None:
        """Add a light's picture to the sum in use, by one rectangle."""
        total.use()
        state.use(Pass(color_write=True, blend="add"))
        picture.bind(0)
        self._copy.set(picture=0, share=share)
        self._copy.draw(3)
        self.tally.rectangles.append("add")

    def _draw_full(self, state: State, plan: VolumePlan, color: Target, dark: float) -> None:
        """Count in the picture's own alpha or stencil, and multiply the picture by the mask."""
        painter = self._colors.painter
        if self.method is not None:
            self._draw_volumes(state, plan, dark)
            painter.draw_rectangle(state, MaskStep("by alpha", 1.0), "rgb", "apply")
            return
        self._stencil.count(state, color, plan)
        where = Stencil(test="notequal", reference=0)
        step = MaskStep("multiply", dark)
        painter.draw_rectangle(state, step, "rgb", "apply", stencil=where)

    def _draw_volumes(self, state: State, plan: VolumePlan, dark: float) -> None:
        """Count in the target in use, and normalise to 1 and what remains in shadow."""
        assert self.method is not None
        painter = self._colors.painter
        painter.draw_volumes(state, self.method, plan, self._colors.find_pieces(plan))
        for step in self.method.attenuate(dark):
            painter.draw_rectangle(state, step, self.method.write)

    def _draw_mask(
        self, state: State, shown: CameraProjection, plan: VolumePlan, mask: Target, look: Look
    ) -> None:
        """Draw a separate mask: depth at its resolution, volumes, rectangles."""
        start = self.method.start if self.method else 1.0
        self._clear(state, mask, start)
        if self._is_joint:
            self._forward.draw_scene(
                state, shown, replace(look, alpha=start), self.tally, lights="direct",
                with_place=True,
            )  # fmt: skip
            mask.fill(state, start)
        else:
            self._forward.draw_depth(state, shown, self.tally)
        counted = self._targets[-1]
        counted.use()
        if self.method is not None:
            self._draw_volumes(state, plan, 0.0)
            return
        self._stencil.count(state, counted, plan)
        where = Stencil(test="notequal", reference=0)
        self._colors.painter.draw_rectangle(state, _ONE, True, "copy", stencil=where)

    def _apply(
        self, state: State, shown: CameraProjection, mask: Target, picture: Target, dark: float
    ) -> None:
        assert self._upsampler is not None
        low, high = self.method.lit if self.method else (0.75, 1.0)
        self._upsampler.apply(
            state, shown, mask, picture, self.tally, lit=(low, high), dark=dark,
            channel=self.method.channel if self.method else 0,
        )  # fmt: skip

    def _clear(self, state: State, target: Target, *values: float) -> None:
        """Use a target; clear depth, stencil and colours, the first attachment to ``values``."""
        target.begin(state, *values)
        if len(target.colors) > 1:
            target.clear_color(0.0, attachment=1)

    def _bounds(self) -> NDArray[np.float64]:
        whole = self.scene.bounds()[None] - self.scene.origin
        return np.concatenate([self.planner.casting.bounds, whole])

    def _find_targets(self, size: tuple[int, int]) -> tuple[Target, Target, Target]:
        """Return the picture, its colours alone, and the mask in which volumes are counted."""
        if not self._targets or self._targets[0].size != tuple(size):
            self._release_targets()
            extra = ("rgba32f",) if self._is_joint else ()
            picture = Target(self.device, size, ("rgba8", *extra))
            color = Target(self.device, size, depth_of=picture, shows=(picture, 0))
            self._targets = [picture, color]
            if self._upsampler is not None:
                small = (-(-size[0] // self.scale), -(-size[1] // self.scale))
                form = self.method.format if self.method else "rgba8"
                mask = Target(self.device, small, (form, *extra))
                self._targets.append(mask)
                self._targets.append(Target(self.device, small, depth_of=mask, shows=(mask, 0)))
        picture, color, mask = (*self._targets, *self._targets[:1])[:3]
        return picture, color, mask

    def _release_targets(self) -> None:
        release_all(self._sum, *reversed(self._targets))
        self._targets, self._sum, self._shown = [], None, None

    def _list_held(self) -> Iterable[Any]:
        yield from (self._sum, *reversed(self._targets))
        yield from (self._copy, self._upsampler, self._forward, self._colors, self._stencil)
        yield from (self.planner, self.geometry)
