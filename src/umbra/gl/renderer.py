"""
Pictures on OpenGL: surfaces in ambient light, then shadows and light for each light in turn.

The order is McGuire's (2003, section 8): the stencil counts a light's shadow volumes, its
light is added where the count is 0, and what is transparent comes last, over the lit
picture. Nothing is read back until ``read``.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import find_solid_faces
from umbra.gl.context import Device, open_device
from umbra.gl.count import Counter
from umbra.gl.geometry import Geometry, Group, is_flat, is_mirrored
from umbra.gl.masks.counters import MaskCounters
from umbra.gl.masks.method import Counts
from umbra.gl.plan import Choices, Plan, Planner, Statistics
from umbra.gl.projection import Projection, make_projection
from umbra.gl.shading import Shading
from umbra.gl.state import Pass, State
from umbra.gl.surfaces import LIGHT, PLACE, Surfaces, find_surface_formats
from umbra.gl.target import Target
from umbra.gl.timers import Timers
from umbra.scene import Camera, Light, Scene
from umbra.scene.look import find_exposure
from umbra.volume.scissor import find_sphere_scissors

__all__ = ["Renderer", "Targets"]

_DRAW_ALL = Pass(depth_write=True, color_write=True)
Scissor = tuple[int, int, int, int]


@dataclass(eq=False)
class Targets:
    """
    The framebuffers of one size of picture; depth and stencil are shared by all.

    Parameters
    ----------
    device : Device
    size : (int, int)
        Columns and rows.
    accumulate : {'rgba16f', 'rgba8'}
        How light is summed up.

    Attributes
    ----------
    surface, light, picture : Target
    """

    device: Device
    size: tuple[int, int]
    accumulate: str = "rgba16f"
    surface: Target = field(init=False)
    light: Target = field(init=False)
    picture: Target = field(init=False)

    def __post_init__(self) -> None:
        self.surface = Target(self.device, self.size, find_surface_formats(self.accumulate))
        self.light = Target(
            self.device, self.size, depth_of=self.surface, shows=(self.surface, LIGHT)
        )
        self.picture = Target(self.device, self.size, ("rgba8",), depth_of=self.surface)

    def release(self) -> None:
        """Free them."""
        for target in (self.picture, self.light, self.surface):
            target.release()


class Renderer:
    """
    Draws pictures of one scene with hard shadows from any number of lights.

    Parameters
    ----------
    scene : Scene
    ground : float, optional
        z of a plane that is drawn and receives shadows, in the model's own coordinates [m].
    casters : sequence of int, optional
        Indices of the parts that cast; all by default. Parts with transparency or holes in
        their texture never do here, unlike on the CPU.
    device : Device, optional
        One of its own by default, released with the renderer.
    choices : Choices, optional
        What may be left out.
    two_sided : bool
        As in ``Counter``.
    accumulate : {'rgba16f', 'rgba8'}
        How light is summed up; 8 bits band where lights are many.
    warn : callable
        Told, in a line, where a forced method is wrong for a view.

    Raises
    ------
    InputError
        If a texture cannot be decoded (which).
    UmbraError
        If there is no OpenGL, or not enough of it.

    Attributes
    ----------
    statistics : list of Statistics
        Of the last picture's lights.
    plans : list of Plan
        Of the last picture's lights, valid until the next.
    projection : Projection, optional
        Of the last picture.
    targets : Targets
        With the last picture.
    timers : Timers, optional
        Measure each pass, if given.
    """

    scene: Scene
    geometry: Geometry
    planner: Planner

    def __init__(
        self,
        scene: Scene,
        ground: float | None = None,
        *,
        casters: Sequence[int] | None = None,
        device: Device | None = None,
        choices: Choices | None = None,
        two_sided: bool = True,
        accumulate: str = "rgba16f",
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        for part in scene.parts:
            _ = part.material.texture  # what cannot be decoded is told before anything is made
        self.choices, self.accumulate, self.warn = choices, accumulate, warn
        # What is seen through is not in the depth buffer that counts rely on: it casts nothing.
        seen_through = [
            part.material.is_transparent or part.material.alpha_mode == "mask"
            for part in scene.parts
        ]
        if any(seen_through):
            some = range(len(scene.parts)) if casters is None else casters
            casters = [index for index in some if not seen_through[index]]
        self._casters, self._two_sided = casters, two_sided
        self.device = device or open_device()
        self._owns_device = device is None
        self._ground_z = ground
        self._build(scene)
        self.shading = Shading(self.device)
        self.targets: Targets | None = None
        self.statistics: list[Statistics] = []
        self.plans: list[Plan] = []
        self.projection: Projection | None = None
        self.timers: Timers | None = None

    def move(self, scene: Scene) -> None:
        """
        Take the same parts as they stand at another time, as ``umbra.pose`` gives them.

        Parts that move as a whole only get another transform, and only their volumes are
        made anew. Where a mesh bends, the geometry of the scene is made anew from the very
        vertices that are then drawn: the silhouette is that of the mesh in the picture.

        Parameters
        ----------
        scene : Scene
        """
        if _moves_as_wholes(self.scene, scene, self.geometry.groups):
            self.scene = scene
            self.planner.move(scene)
        else:
            self._release_scene()
            self._build(scene)

    def render(
        self, camera: Camera, lights: Sequence[Light], method: str = "auto", *, shadows: bool = True
    ) -> NDArray[np.uint8]:
        """
        Draw a picture and read it back.

        Parameters
        ----------
        camera : Camera
        lights : sequence of Light
        method : str
            Of ``umbra.gl.plan.METHODS`` or of ``umbra.gl.masks.NAMES``.
        shadows : bool
            Count them at all.

        Returns
        -------
        rgb : (rows, cols, 3) uint8
            sRGB; row 0 is the top.
        """
        self.draw(camera, lights, method, shadows=shadows)
        return self.read()

    def draw(
        self, camera: Camera, lights: Sequence[Light], method: str = "auto", *, shadows: bool = True
    ) -> None:
        """Draw a picture into ``targets.picture``; parameters as in ``render``."""
        targets = self._find_targets(camera.size)
        projection = self.projection = self._project(camera)
        with State(self.device) as state:
            with self._timed("surfaces"):
                targets.surface.use()
                state.use(_DRAW_ALL)
                state.clear(depth=1.0, stencil=0)
                for place in (LIGHT, PLACE):
                    targets.surface.clear_color(0.0, place=place)
                # Where nothing reaches before the near plane, nothing is cut open.
                cull = projection.camera.near > camera.near
                self.surfaces.draw(state, projection, self.ground, cull=cull)
            counter, method = self.masks.choose(method, self.counter)
            plans = self._plan(projection, lights, method) if shadows else [None] * len(lights)
            targets.light.use()
            self._add_lights(state, targets, projection, lights, plans, counter)
            if self.surfaces.has_transparent:
                with self._timed("transparent"):
                    self.surfaces.draw_transparent(state, projection)
            targets.picture.use()
            with self._timed("finish"):
                self.shading.finish(state, targets.light)

    def read(self) -> NDArray[np.uint8]:
        """Read the last picture, (rows, cols, 3) uint8, row 0 at the top."""
        if self.targets is None:
            return np.zeros((0, 0, 3), np.uint8)
        return np.ascontiguousarray(self.targets.picture.read()[..., :3])

    def _build(self, scene: Scene) -> None:
        self.scene = scene
        ground = self._ground_z
        self.ground = None if ground is None else float(ground - scene.origin[2])
        self.geometry = Geometry(self.device, scene)
        self.planner = Planner(self.device, scene, self.geometry, self._casters, self.ground)
        self.counter = Counter(
            self.device, self.geometry, self.planner.indices, two_sided=self._two_sided
        )
        self.masks = MaskCounters(self.device, self.geometry, self.warn)
        solid = find_solid_faces(scene, self.planner.bodies, self._casters)
        self.surfaces = Surfaces(self.device, scene, self.geometry, solid)

    def _release_scene(self) -> None:
        for held in (self.surfaces, self.masks, self.counter, self.planner, self.geometry):
            held.release()

    def _add_lights(
        self,
        state: State,
        targets: Targets,
        projection: Projection,
        lights: Sequence[Light],
        plans: Sequence[Plan | None],
        counter: Counts,
    ) -> None:
        exposure = find_exposure(len(lights))
        for light, plan in zip(lights, plans, strict=True):
            scissor = self._find_scissor(light, projection.camera)
            if scissor is not None and 0 in scissor[2:]:
                continue
            with self._timed("shadows"):
                if plan is not None:
                    counter.count(state, targets.light, plan)
                else:
                    state.clear(stencil=0)
            with self._timed("light"):
                targets.light.use()
                self.shading.add_light(
                    state, targets.surface, projection, light, self.scene.origin, exposure, scissor
                )

    def _find_scissor(self, light: Light, camera: Camera) -> Scissor | None:
        """Give the rectangle that a light's range reaches, in OpenGL's rows; None: all."""
        if np.isinf(light.range):
            return None
        origin = self.scene.origin
        place = light.local(origin)[None, :3]
        left, top, right, bottom = find_sphere_scissors(camera, place, [light.range], origin)[
            0
        ].tolist()
        return left, camera.size[1] - bottom, right - left, bottom - top

    def _plan(self, projection: Projection, lights: Sequence[Light], method: str) -> list[Plan]:
        plans = self.planner.plan(projection, lights, method, choices=self.choices, warn=self.warn)
        self.statistics = [plan.statistics for plan in plans]
        self.plans = plans
        return plans

    def _project(self, camera: Camera) -> Projection:
        origin = self.scene.origin
        bounds = np.concatenate([self.planner.bounds, self.scene.bounds()[None] - origin])
        if len(self.planner.bounds) and self.planner.casters is None:
            bounds = bounds[:-1]
        return make_projection(camera, origin, bounds, self.ground)

    def _find_targets(self, size: tuple[int, int]) -> Targets:
        if self.targets is None or self.targets.size != tuple(size):
            if self.targets is not None:
                self.targets.release()
            self.targets = Targets(self.device, (int(size[0]), int(size[1])), self.accumulate)
        return self.targets

    def _timed(self, name: str) -> AbstractContextManager[None]:
        """Measure a pass where someone asks for it."""
        return nullcontext() if self.timers is None else self.timers.measure(name)

    def release(self) -> None:
        """Free all that the renderer holds on the device."""
        if self.targets is not None:
            self.targets.release()
        self.shading.release()
        self._release_scene()
        if self._owns_device:
            self.device.release()

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _moves_as_wholes(before: Scene, after: Scene, groups: Sequence[Group]) -> bool:
    """Tell whether a scene differs from another by the transforms of whole groups alone."""
    if (before.origin != after.origin).any() or any(
        a.mesh is not b.mesh
        or a.material is not b.material
        or is_mirrored(a.transform) != is_mirrored(b.transform)
        for a, b in zip(before.parts, after.parts, strict=True)
    ):
        return False
    for group in groups:
        found = [after.parts[index].transform for index in group.parts]
        if any((transform is None) != (group.transform is None) for transform in found):
            return False
        if is_flat(found[0]):
            return False
        if group.transform is not None and any((t != found[0]).any() for t in found):  # type: ignore[union-attr]
            return False
    return True
