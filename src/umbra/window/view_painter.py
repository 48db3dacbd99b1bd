"""Draws a view on OpenGL, or counted and shaded on the CPU, coarser while moving."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.picture_layers import blend_layers, follow_lights, see_behind
from umbra.cpu.shade import encode_srgb, find_colors
from umbra.devices import DEVICES
from umbra.gl.context import Device, on_device, release_all
from umbra.gl.resources import Timers
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.gl.state import State
from umbra.gl.target import PictureTargets
from umbra.gl.volume_plan import Statistics
from umbra.methods import Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, DepthBuffer
from umbra.scene import Camera, Light, Scene
from umbra.scene.exposure import GROUND_COLOR, Sky, choose_sky
from umbra.scene.pale import PALENESS, PAPER, choose_pale_sky, expose_suns, make_pale
from umbra.soft import find_method
from umbra.window.daylight import Suns
from umbra.window.frame_profile import Relief, ShadowProfile, count_profile
from umbra.window.motion import Motion
from umbra.window.overlays import Overlays
from umbra.window.view_state import SUN, ViewState

__all__ = ["SAMPLES", "DrawnView", "ViewPainter"]


SAMPLES = 32
"""Points of each light in a window."""

_TEXTURE_2D, _RGBA8, _RGBA, _BYTE, _UNPACK = 0x0DE1, 0x8058, 0x1908, 0x1401, 0x0CF5


@dataclass(frozen=True)
class DrawnView:
    """
    Statistics of a drawn picture.

    Parameters
    ----------
    size : (int, int)
        Columns and rows.
    spent : float
        Total time [ms].
    passes : dict of float
        Time of each pass [ms], in order.
    statistics : dict of Statistics
        By light number; none for lights counted on the CPU.
    highest : int
        Highest count in the picture, if counts are shown.
    edges : int
        Number of silhouette edges, if shown.
    components : (int, int), optional
        Number of closed and open casting components, if shown.
    period : float
        Period of the shadow profile [h]; 0 if not shown.
    warnings : tuple of str
    """

    size: tuple[int, int]
    spent: float
    passes: dict[str, float] = field(default_factory=dict)
    statistics: dict[int, Statistics] = field(default_factory=dict)
    highest: int = 0
    edges: int = 0
    components: tuple[int, int] | None = None
    period: float = 0.0
    warnings: tuple[str, ...] = ()


class ViewPainter:
    """
    Draws views of one scene into ``renderer.targets.picture``.

    Parameters
    ----------
    device : Device
    scene : Scene
    ground : float, optional
        z of a drawn, receiving plane, in the model's own coordinates [m].
    threads : int
        For pictures on the CPU.
    is_pale : bool
        Whether views have the look of umbra's pictures (`umbra.scene.pale`), in place of the
        model's own colours.
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        ground: float | None = None,
        threads: int = 1,
        *,
        is_pale: bool = False,
    ) -> None:
        scene = make_pale(scene, PALENESS, PAPER) if is_pale else scene
        self.device, self.scene, self.ground, self.threads = device, scene, ground, threads
        self.is_pale = is_pale
        self._warnings: list[str] = []
        self._no_cast: frozenset[int] = frozenset()
        self._frames = ExitStack()
        self._begin()
        self.motion = Motion(self.scene)
        self.timers = Timers(device)

    def _begin(self) -> None:
        """Prepare the scene with the parts that cast."""
        warn: Callable[[str], object] = self._warnings.append
        self.renderer = SceneRenderer(
            self.scene, self.ground, casters=self._list_casters(), device=self.device,
            softness=Softness(samples=SAMPLES), warn=warn,
            ground_color=PAPER if self.is_pale else GROUND_COLOR,
        )  # fmt: skip
        self._counter: tuple[str, Any] | None = None
        self._decorate()

    def _decorate(self) -> None:
        """Prepare the overlays of the renderer's geometry."""
        self.overlays = Overlays(self.renderer)
        self.profile = ShadowProfile(self.renderer)
        self._relief: tuple[tuple, Relief | None] | None = None

    def _list_casters(self) -> list[int] | None:
        """List the parts that cast; None for all."""
        parts = range(len(self.scene.parts))
        return [n for n in parts if n not in self._no_cast] if self._no_cast else None

    @on_device
    def draw(
        self,
        view: ViewState,
        size: tuple[int, int],
        *,
        times: bool = True,
        shrink: float = 1.0,
        samples: int = 1,
    ) -> DrawnView:
        """
        Draw a view and wait for it.

        ``times`` measures each pass. Lines are thinner by ``shrink``, by which the picture will
        be enlarged. OpenGL antialiases by ``samples`` per pixel, but not below overlays, which
        show the pixels' centres.
        """
        start = time.perf_counter()
        self._warnings.clear()
        view = self._expose(view)
        self._move(self.motion.pose(view), view.no_cast)
        shining = view.shining()
        camera = view.viewpoint.camera(size)
        self.renderer.timers = self.timers if times else None
        is_apart = not DEVICES[view.device].is_window
        passes: dict[str, float] = {}
        if is_apart:
            # Overlays always need OpenGL's depth.
            self.renderer.draw(camera, [], shadows=False)
            self._put(self._shade(view, size, passes))
        else:
            lights = list(shining.values()) if view.soft == "none" else view.size_lights()
            self.renderer.soft.refine(view.soften(SAMPLES))
            # Shown counts and volumes are whole: of isolated casters, too.
            shorten = not view.overlays & {"counts", "volumes"}
            self.renderer.choices = VolumeOptions(detail=view.detail, shorten=shorten)
            self.renderer.draw(
                camera, lights, view.method, soft=view.soft,
                mask_scale=view.mask_scale, mask_filter=view.mask_filter,
                samples=1 if view.overlays else samples,
                sky=self._choose_sky(list(shining.values())),
            )  # fmt: skip
        statistics = {} if is_apart else dict(zip(shining, self.renderer.statistics, strict=True))
        suns = view.profile_suns() if view.overlays & {"profile", "relief"} else None
        if suns is not None and "profile" in view.overlays:
            with self.renderer.time_pass("profile"), State(self.device) as state:
                self.profile.draw_hours(state, suns)
        highest, shown = 0, view.overlays if view.chosen in shining else frozenset()
        if shown:
            with self.renderer.time_pass("overlays"):
                highest = self._draw_overlays(view, shrink)
        if suns is not None and "relief" in view.overlays:
            with self.renderer.time_pass("relief"):
                self._draw_relief(view, suns)
        self.device.gl.Finish()
        self.device.check("a view was drawn")
        measured = self.timers.collect() if times else {}
        return DrawnView(
            size=size,
            spent=1e3 * (time.perf_counter() - start),
            passes=passes or measured,
            statistics=statistics,
            highest=highest,
            edges=self.overlays.n_edges if "edges" in shown else 0,
            components=self.overlays.n_components if "components" in shown else None,
            period=0.0 if suns is None else suns.total,
            warnings=tuple(self._warnings),
        )

    @on_device
    def read(self) -> NDArray[np.uint8]:
        """Read the last picture, (rows, cols, 3) uint8, row 0 at the top."""
        return self.renderer.read()

    @on_device
    def release(self) -> None:
        """Free the device objects."""
        self._frames.close()
        release_all(self.timers, self.overlays, self.profile, self.renderer)

    def _expose(self, view: ViewState) -> ViewState:
        """Return the view with its suns as bright as pale pictures have them."""
        shining = view.shining()
        if not self.is_pale or not shining:
            return view
        for number, light in zip(shining, expose_suns(list(shining.values())), strict=True):
            if number == SUN:
                view = replace(view, sun=replace(view.sun, color=light.color, bend=light.bend))
            else:
                view = view.change_light(number, light)
        return view

    def _choose_sky(self, lights: list[Light]) -> Sky:
        return choose_pale_sky(lights) if self.is_pale else choose_sky(lights)

    def _move(self, scene: Scene, no_cast: frozenset[int]) -> None:
        """Update the pose and the casters; overlays are rebuilt where geometry is."""
        if no_cast != self._no_cast:
            self.scene, self._no_cast = scene, no_cast
            release_all(self.overlays, self.profile, self.renderer)
            self._begin()
        if scene is self.scene:
            return
        geometry, self.scene, self._counter = self.renderer.geometry, scene, None
        self.renderer.move(scene)
        self.profile.renew()
        self._relief = None
        if self.renderer.geometry is not geometry:
            self.overlays.release()
            self.overlays = Overlays(self.renderer)

    def _targets(self) -> PictureTargets:
        assert self.renderer.targets is not None
        return self.renderer.targets

    def _draw_overlays(self, view: ViewState, shrink: float) -> int:
        """Draw the overlays of the chosen light, by the picture's plan if it has one."""
        renderer, shining = self.renderer, view.shining()
        assert renderer.projection is not None
        number, plans = list(shining).index(view.chosen), renderer.plans
        if not DEVICES[view.device].is_window:
            lights = list(shining.values())
            plans = renderer.planner.plan(renderer.projection, lights, view.method)
        with State(self.device) as state:
            return self.overlays.draw(state, self._targets(), plans[number], view.overlays, shrink)

    def _draw_relief(self, view: ViewState, suns: Suns) -> None:
        """Draw the profile of the ground as a relief, recounted when it changes."""
        key = (view.sun.site, view.sun.date, view.period, view.sun.land)
        if self._relief is None or self._relief[0] != key:
            casters = self._list_casters()
            chosen = range(len(self.scene.parts)) if casters is None else casters
            low = float(self.scene.bounds()[0, 2]) if self.ground is None else self.ground
            self._relief = key, count_profile(self.scene, chosen, low, suns, self.threads)
        if self._relief[1] is not None:
            with State(self.device) as state:
                self.profile.draw_relief(state, self._relief[1], suns)

    def _find_counter(self, device: str) -> Any:
        """Return a device's frame counter, kept until the scene or the device changes."""
        if self._counter is None or self._counter[0] != device:
            self._frames.close()
            frames = DEVICES[device].open_frames(
                self.scene, self.ground, casters=self._list_casters(), threads=self.threads,
                warn=self._warnings.append,
            )  # fmt: skip
            self._counter = device, self._frames.enter_context(frames)
        return self._counter[1]

    def _shade(self, view: ViewState, size: tuple[int, int], passes: dict[str, float]) -> NDArray:
        """Count and shade a picture on a device other than the window's."""
        counter, camera = self._find_counter(view.device), view.viewpoint.camera(size)
        lights = list(view.shining().values())
        marks = [time.perf_counter()]
        first = counter.see(camera)
        marks.append(time.perf_counter())
        areas = [] if view.soft == "none" else view.size_lights()
        layers = [
            (seen, frame, self._light(counter, view, seen, frame, camera), opacity)
            for seen, frame, opacity in see_behind(counter, camera, *first)
        ]
        marks.append(time.perf_counter())
        colors = blend_layers(
            (
                self._paint_ground(
                    find_colors(
                        self.scene, frame, lights, lit, seen, counts, areas, camera, left,
                        sky=self._choose_sky(lights),
                    ), frame,
                ), opacity,
            )
            for seen, frame, (lit, counts, left), opacity in layers
        )  # fmt: skip
        picture = encode_srgb(colors)
        marks.append(time.perf_counter())
        spent = 1e3 * np.diff(marks)
        passes |= dict(zip(("see", "count", "shade"), spent.tolist(), strict=True))
        return picture

    def _paint_ground(self, linear: NDArray, frame: VisibleSurface) -> NDArray:
        """Return a picture in linear RGB whose plane has the colour of a table, if pale."""
        if self.is_pale:
            linear[frame.part == GROUND] *= np.array(PAPER) / GROUND_COLOR
        return linear

    def _light(
        self,
        counter: Any,
        view: ViewState,
        seen: DepthBuffer,
        frame: VisibleSurface,
        camera: Camera,
    ) -> tuple[list[NDArray], list[NDArray], list[NDArray[np.float32]] | None]:
        """Find the visibility and counts of each light, and its transmitted fraction."""
        lights = list(view.shining().values())
        counts = [counter.count(seen, camera, light, view.method) for light in lights]
        areas = [] if view.soft == "none" else view.size_lights()
        lit: list[NDArray]
        if not areas:
            lit = [frame.lit(n, light) for n, light in zip(counts, lights, strict=True)]
        else:
            find, none = find_method(view.soft), np.zeros(frame.part.shape, np.int32)
            more = view.soften(SAMPLES).select(view.soft)
            lit = [
                find(counter, seen, frame, camera, area, **more) * frame.lit(none, area.light)
                for area in areas
            ]
        if counter.transmitters is None:
            return lit, counts, None
        return lit, counts, follow_lights(counter, seen, camera, areas or lights)[0]

    def _put(self, rgb: NDArray[np.uint8]) -> None:
        """Replace the drawn picture by one from the CPU."""
        rows, cols, _ = rgb.shape
        flipped = np.full((rows, cols, 4), 255, np.uint8)
        flipped[..., :3] = rgb[::-1]
        gl = self.device.gl
        gl.BindTexture(_TEXTURE_2D, self._targets().picture.textures[0])
        gl.PixelStorei(_UNPACK, 4)
        gl.TexImage2D(_TEXTURE_2D, 0, _RGBA8, cols, rows, 0, _RGBA, _BYTE, flipped.ctypes.data)
        gl.BindTexture(_TEXTURE_2D, 0)
