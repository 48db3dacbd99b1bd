"""
Pictures on OpenGL: surfaces in ambient light, then shadow and illumination of each light.

The order is McGuire's (2003, section 8): the stencil counts a light's shadow volumes, its light is
added where the count is 0, and transparent surfaces come last. A single light needs no sums: it
is drawn lit and in shadow at once. An area light has a picture of its visibility (``soft/``).
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.batches import find_solid_faces
from umbra.gl.bodies import Body
from umbra.gl.context import Device, DeviceUser, on_device, release_all
from umbra.gl.geometry import Geometry, find_posed
from umbra.gl.lighting import LightPasses, ShownLights, TransparentLayers
from umbra.gl.masks import Counts
from umbra.gl.masks.counter import MaskCounters
from umbra.gl.masks.upsampling import SmallMasks
from umbra.gl.multisampling import Averaging, split_samples
from umbra.gl.planner import Planner
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Timers
from umbra.gl.selection import VolumeOptions
from umbra.gl.shading import Lamps, Shading
from umbra.gl.soft import SoftLights, SoftMethods
from umbra.gl.state import State
from umbra.gl.still import StillView
from umbra.gl.surface_renderer import SurfaceRenderer, decode_images
from umbra.gl.target import FACE, LIGHT, PLACE, PictureTargets, Target
from umbra.gl.transmitters import TransmitterTables
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import Statistics, VolumePlan
from umbra.methods import Softness
from umbra.rays.transmission import find_opaque
from umbra.scene import Camera, Light, Scene
from umbra.scene.exposure import DAY, GROUND_COLOR, Sky, find_exposure
from umbra.soft import AreaLight, find_middles

__all__ = ["SceneRenderer"]


class SceneRenderer(DeviceUser):
    """
    Draws pictures of one scene with shadows, hard or soft, from any number of lights.

    Parameters
    ----------
    scene : Scene
    ground : float, optional
        z of a drawn, receiving plane, in the model's own coordinates [m].
    casters : sequence of int, optional
        Indices of the parts that cast; all by default. Rays are traced through those with
        transparency or holes in their texture (`umbra.rays.transmission`).
    device : Device, optional
        A new one by default, released with the renderer.
    choices : VolumeOptions, optional
        Permitted simplifications.
    two_sided : bool
        As in ``VolumeCounter``.
    accumulate : {'rgba16f', 'rgba8'}
        Format of light sums; 8 bits show banding with many lights.
    softness : Softness, optional
        Resolution of soft shadows.
    ground_color : (float, float, float)
        Of the plane; linear RGB.
    warn : callable
        Called with one line where a forced method is wrong for a view.

    Raises
    ------
    InputError
        If a texture cannot be decoded.
    UmbraError
        If OpenGL is missing or insufficient.

    Attributes
    ----------
    statistics : list of Statistics
    plans : list of VolumePlan
        Of the last picture's lights; plans are valid until the next.
    projection : Projection, optional
    targets : PictureTargets
        Projection and framebuffers of the last picture.
    timers : Timers, optional
        Measures each pass, if set.
    """

    scene: Scene
    geometry: Geometry
    planner: Planner
    _tables: TransmitterTables | None

    def __init__(
        self,
        scene: Scene,
        ground: float | None = None,
        *,
        casters: Sequence[int] | None = None,
        device: Device | None = None,
        choices: VolumeOptions | None = None,
        two_sided: bool = True,
        accumulate: str = "rgba16f",
        softness: Softness | None = None,
        ground_color: tuple[float, float, float] = GROUND_COLOR,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        decode_images(scene)
        self._ground_color = ground_color
        self.choices, self.accumulate, self.warn = choices, accumulate, warn
        self._softness, self._two_sided, self._ground_z = softness, two_sided, ground
        self._casting = casters
        super().__init__(device)
        with self.device.current():
            self.lamps, self.averaging = Lamps(self.device), Averaging(self.device)
            self.layers = TransparentLayers(self.device)
            self._build(scene)
        self.targets: PictureTargets | None = None
        self.statistics: list[Statistics] = []
        self.plans: list[VolumePlan] = []
        self.projection: CameraProjection | None = None
        self.timers: Timers | None = None

    @on_device
    def move(self, scene: Scene) -> None:
        """
        Update to other parts, or the same at another time, from ``umbra.pose``.

        Where a part moves as a whole, only its transform and volumes change. Where a mesh
        bends, its points and normals are overwritten and its planes recomputed, so that the
        silhouette is that of the visible mesh. All geometry is rebuilt where coincident corners
        separate, or parts or materials are others.
        """
        self.still.forget()
        groups = find_posed(self.geometry.groups, self.scene, scene)
        if groups is None or (groups and not self.planner.can_bend(groups)):
            decode_images(scene)
            is_same = np.array_equal(self.scene.groups(), scene.groups())
            bodies = self.planner.bodies if is_same else ()
            release_all(*self._list_of_scene())
            self._build(scene, bodies)
            return
        inward = [body.is_inward for body in self.planner.bodies]
        self.scene = scene
        self.planner.move(scene, groups)
        release_all(self.soft, self.small, self._tables)
        self._tables = TransmitterTables.of(self.device, scene, self._casting)
        if groups:
            pairs = zip(self.planner.bodies, inward, strict=True)
            same = all(np.array_equal(body.is_inward, was) for body, was in pairs)
            self.surfaces.bend(scene, None if same else self._find_solid(scene))

    def render(
        self,
        camera: Camera,
        lights: Sequence[Light | AreaLight],
        method: str = "auto",
        *,
        shadows: bool = True,
        soft: str = "samples",
        samples: int = 1,
    ) -> NDArray[np.uint8]:
        """
        Draw a picture anew and read it back: the same for the same arguments.

        Parameters
        ----------
        camera : Camera
        lights : sequence of Light or AreaLight
            Area lights have soft shadows.
        method : str
            One of the device's ``Methods.hard``, for hard shadows.
        shadows : bool
            Draw shadows.
        soft : str
            One of ``umbra.methods.SOFT``, for soft shadows.
        samples : int
            Minimum number per pixel, for antialiasing.

        Returns
        -------
        rgb : (rows, cols, 3) uint8
            sRGB; row 0 is the top.
        """
        self.still.forget()
        self.draw(camera, lights, method, shadows=shadows, soft=soft, samples=samples)
        return self.read()

    @on_device
    def draw(
        self,
        camera: Camera,
        lights: Sequence[Light | AreaLight],
        method: str = "auto",
        *,
        shadows: bool = True,
        soft: str = "samples",
        mask_scale: int = 1,
        mask_filter: str = "joint",
        samples: int = 1,
        sky: Sky = DAY,
        keeps_light: bool = False,
    ) -> None:
        """
        Draw a picture into ``targets.picture``, its light into ``targets.light`` if that is kept.

        With one light, a still eye's view is kept (`StillView`) and may differ by 1 of 255 levels.

        Without area lights, hard shadows may be counted in ``mask_scale`` times fewer columns
        and rows, and enlarged by a filter of ``upsampling``.
        """
        self.device.sky = sky
        middles = find_middles(lights)
        self.soft.permit(self.choices)
        softened = behind = self.soft.select(lights if shadows else middles, soft)
        if mask_scale > 1 and shadows and not softened.areas:
            softened = self.small.select(middles, method, mask_scale, mask_filter)
        # A new counter measures the device, with its own state.
        counter, method = self.masks.choose(method, self.counter)
        in_one = counter is self.counter and not softened.areas and self._tables is None
        per_picture, offsets = split_samples(self.device, samples, in_one=in_one)
        held, self.targets = self.targets, None  # none, if the driver refuses the size
        given = (self.device, camera.size, self.accumulate, per_picture)
        targets = self.targets = PictureTargets.fit(held, *given)
        at_once = len(lights) <= 1 and not (keeps_light or softened.areas or self._tables)
        at_once = at_once and self.accumulate != "rgba8"
        with State(self.device) as state:
            taken = self.averaging.take(state, targets, camera, offsets, self.planner)
            for turn, projection in enumerate(taken):
                self.projection = projection
                self.soft.take_turn(turn, len(offsets))
                how = (counter, method, shadows)
                if at_once:
                    self._draw_at_once(state, targets, projection, middles, *how)
                else:
                    self._draw_in_turn(state, targets, projection, lights, *how, softened, behind)

    @on_device
    def read(self) -> NDArray[np.uint8]:
        """Read the last picture, (rows, cols, 3) uint8, row 0 at the top."""
        if self.targets is None:
            return np.zeros((0, 0, 3), np.uint8)
        return np.ascontiguousarray(self.targets.picture.read()[..., :3])

    def _build(self, scene: Scene, before: Sequence[Body] = ()) -> None:
        self.scene, self._casters = scene, find_opaque(scene, self._casting)
        self._tables = TransmitterTables.of(self.device, scene, self._casting)
        ground = self._ground_z
        self.ground = None if ground is None else float(ground - scene.origin[2])
        self.geometry = Geometry(self.device, scene)
        self.planner = Planner(
            self.device, scene, self.geometry, self._casters, self.ground, before
        )
        self.counter = VolumeCounter(
            self.device, self.geometry, self.planner.indices, two_sided=self._two_sided
        )
        self.masks = MaskCounters(self.device, self.geometry, self.warn)
        self.soft = SoftMethods(self.planner, self.counter, self._softness, self.choices)
        self.surfaces = SurfaceRenderer(
            self.device, scene, self.geometry, self._find_solid(scene), self._ground_color
        )
        of = self.surfaces
        self.shading = Shading(self.device, is_glossy=of.is_glossy, is_plain=of.is_plain)
        self.passes = LightPasses(self.shading, self.lamps, self.time_pass)
        self.still = StillView(self.shading)
        self.small = SmallMasks(self.planner, self.surfaces, self.masks, self._find_surface)

    def _find_surface(self) -> Target:
        assert self.targets is not None
        return self.targets.surface

    def _find_solid(self, scene: Scene) -> NDArray[np.bool_]:
        return find_solid_faces(scene, self.planner.bodies, self._casters)

    def _list_of_scene(self) -> Iterable[Any]:
        yield from (self.still, self.shading, self.surfaces, self.soft, self.small, self.masks)
        yield from (self._tables, self.counter, self.planner, self.geometry)

    def _draw_at_once(
        self,
        state: State,
        targets: PictureTargets,
        projection: CameraProjection,
        lights: Sequence[Light],
        counter: Counts,
        method: str,
        shadows: bool,
    ) -> None:
        """
        Draw surfaces in one light, or none, and in its shadow; then select by count.

        For an eye that stands still, copy the view in shadow and draw the light where none counts.
        """
        origin = self.scene.origin
        lamps = [self.lamps.make(light, projection, origin, find_exposure(1)) for light in lights]
        is_still = self.still.is_same(targets, projection) and bool(lamps)
        target = targets.both if lights and shadows and not is_still else targets.drawn
        with self.time_pass("surfaces"):
            if is_still:
                self.still.show(state, targets, self.draw_surface, self.surfaces.has_normals)
            else:
                self.still.is_stored = False  # its marks are cleared
                target.begin(state)
                lamp, cull = lamps[0] if lamps else None, projection.sees_all
                self.surfaces.draw_at_once(state, projection, self.ground, lamp, cull=cull)
                self.shading.draw_sky(state, target)
        self.device.gl.Flush()  # a software device draws while volumes are planned
        exact, scissor, spares = counter is not self.counter, None, False
        for plan in self._plan(projection, lights, method, exact=exact) if shadows else ():
            scissor, spares = plan.scissor, self._spares_turned(counter, plan)
            if scissor is not None and 0 in scissor[2:]:
                return
            with self.time_pass("shadows"):
                if is_still:
                    self.still.count(state, target, plan, counter, keeps=spares)
                    continue
                counter.count(state, target, plan, is_clear=True)
            with self.time_pass("light"):
                targets.drawn.use()
                self.shading.darken(state, targets.both, scissor, spares_turned=spares)
        if is_still:
            with self.time_pass("light"):
                self.still.show_light(state, targets, projection, lamps[0], scissor, spares)

    def _draw_in_turn(
        self,
        state: State,
        targets: PictureTargets,
        projection: CameraProjection,
        lights: Sequence[Light | AreaLight],
        counter: Counts,
        method: str,
        shadows: bool,
        softened: SoftLights,
        behind: SoftLights,
    ) -> None:
        """Draw surfaces, add each light, then transparent surfaces and the sky."""
        self.still.forget()
        with self.time_pass("surfaces"):
            self.draw_surface(state)
        self.device.gl.Flush()
        middles = find_middles(lights)
        exact = bool(softened.areas) or counter is not self.counter
        plans = (
            self._plan(projection, middles, method, exact=exact)
            if shadows
            else [None] * len(lights)
        )
        softened.begin(projection, plans)
        spares = counter is self.counter and self.surfaces.has_normals
        lit = ShownLights(lights, plans, counter, softened, self._tables, spares)
        targets.light.use()
        self.passes.add(state, targets, projection, lit, self.scene.origin)
        shown = targets.surface
        if self.surfaces.has_transparent:
            shown = self.layers.begin(targets)
            lit, seen = replace(lit, softened=behind), (projection, targets, self.ground)
            for layer in self.layers.blend(state, self.shading, self.surfaces, *seen):
                self.passes.add(state, layer, projection, lit, self.scene.origin)
        targets.drawn.use()
        with self.time_pass("finish"):
            self.shading.finish(state, shown, is_laid=shown is not targets.surface)

    @on_device
    def draw_surface(self, state: State) -> None:
        """Draw the visible surface of the last picture's camera into ``targets.surface``."""
        assert self.targets is not None and self.projection is not None  # noqa: PT018
        surface = self.targets.surface
        self.still.is_stored = False  # the marks of smooth surfaces are cleared
        surface.begin(state)
        for attachment in (LIGHT, PLACE, FACE):
            surface.clear_color(0.0, attachment=attachment)
        self.surfaces.draw(state, self.projection, self.ground, cull=self.projection.sees_all)

    def _spares_turned(self, counter: Counts, plan: VolumePlan) -> bool:
        """Return whether the stencil will hold counts and any part has smooth normals."""
        in_stencil = plan.statistics.counts_in != "float" and counter is self.counter
        return in_stencil and self.surfaces.has_normals

    def _plan(
        self, projection: CameraProjection, lights: Sequence[Light], method: str, *, exact: bool
    ) -> list[VolumePlan]:
        """Plan lights; ``exact`` where their volumes are not for the stencil alone."""
        choices = self.choices or VolumeOptions(shorten=True)
        choices = choices.keep_exact() if exact else choices
        self.plans = self.planner.plan(projection, lights, method, choices=choices, warn=self.warn)
        self.statistics = [plan.statistics for plan in self.plans]
        return self.plans

    def time_pass(self, name: str) -> AbstractContextManager[None]:
        """Measure a pass if timers are set."""
        return nullcontext() if self.timers is None else self.timers.measure(name)

    def _list_held(self) -> Iterable[Any]:
        yield from (self.targets, self.lamps, self.averaging, self.layers)
        yield from self._list_of_scene()
