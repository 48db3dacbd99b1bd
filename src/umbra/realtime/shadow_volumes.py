"""Shadow volumes counted in a caller's own framebuffer, by the caller's own depth."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from umbra.errors import InputError
from umbra.gl.context import on_device, release_all
from umbra.gl.foreign import ForeignTarget
from umbra.gl.geometry import Geometry, find_posed
from umbra.gl.matrices import read_projection
from umbra.gl.planner import Planner
from umbra.gl.selection import VolumeOptions
from umbra.gl.state import Pass, State
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.rays.transmission import find_opaque
from umbra.realtime.light_reach import check_light, find_reach
from umbra.realtime.scene_user import SceneUser, read_target
from umbra.scene import Light, Scene

__all__ = ["ShadowCount", "ShadowVolumes"]

_INTO = ("stencil", "texture")


@dataclass(frozen=True)
class ShadowCount:
    """
    What was counted, and where the light can shine.

    Parameters
    ----------
    deepest : int
        Upper bound of the counts: above 255 the stencil holds them modulo 256.
    triangles : int
        Drawn triangles of volumes.
    scissor : (int, int, int, int)
        Left, bottom, columns, rows [pixels] of the framebuffer that hold all that the light's range
        and cone reach; 0 columns and rows where it reaches nothing.
    depth_bounds : (float, float)
        Lowest and highest window depth of that, as the caller's depth runs, for
        ``EXT_depth_bounds_test``; 0 to 1 without a range.
    """

    deepest: int
    triangles: int
    scissor: tuple[int, int, int, int]
    depth_bounds: tuple[float, float]


class ShadowVolumes(SceneUser):
    """
    Count a scene's shadows in another program's framebuffer.

    Parameters
    ----------
    scene : Scene
        The casters; those with transparency or holes in their texture cast nothing here.
    context : moderngl.Context, optional
        The caller's own, which is current now; one is made if None. Its state is as before after
        every call.
    ground : float, optional
        z below which nothing that the caller draws receives shadows, but for the scene itself, in
        its coordinates [m]: volumes end there. Without it they are endless.

    Raises
    ------
    UmbraError
        If OpenGL is missing or insufficient.
    """

    def __init__(self, scene: Scene, context: Any = None, ground: float | None = None) -> None:
        super().__init__(scene, context)
        self._ground = ground
        with self.device.current():
            self._build(scene)

    @on_device
    def count(
        self,
        framebuffer: Any,
        view: ArrayLike,
        projection: ArrayLike,
        light: Light,
        viewport: Sequence[int] | None = None,
        *,
        into: Any = "stencil",
        depth: str = "minus-one-to-one",
        method: str = "auto",
    ) -> Any:
        """
        Count the shadow volumes that hold what each pixel shows.

        Before: the framebuffer's depth holds what the caller drew with the same matrices, the
        scene's casters among it, with glDepthRange 0 to 1. After: the stencil within the viewport
        holds the counts, modulo 256: light where it is 0. Colour and depth are as before.

        Parameters
        ----------
        framebuffer : moderngl.Framebuffer
        view, projection : (4, 4) float
            For column vectors; world coordinates are the scene's.
        light : Light
        viewport : (int, int, int, int), optional
            Left, bottom, columns, rows [pixels]; the framebuffer's own by default.
        into : {'stencil', 'texture'} or moderngl.Texture
            A new texture, or one of an earlier call to fill again, takes the counts where there is
            no stencil.
        depth : {'minus-one-to-one', 'zero-to-one', 'reversed'}
            How the projection's depth runs from the near to the far plane.
        method : {'auto', 'mcguire', 'lengyel', 'z-fail', 'z-pass'}

        Returns
        -------
        count : ShadowCount
            Or, with ``into='texture'``, the moderngl.Texture: one float32 channel, of the
            framebuffer's size, 0 outside the viewport. It is the caller's to release.

        Raises
        ------
        InputError
            If the matrices are no view.
        UmbraError
            If the framebuffer has no stencil or no depth.
        """
        check_light(light)
        if isinstance(into, str) and into not in _INTO:
            msg = f"into={into!r} is neither {' nor '.join(_INTO)}"
            raise InputError(msg, option="into")
        target, size = read_target(self.device, framebuffer, viewport)
        seen = read_projection(self.device, view, projection, target.size, self.scene.origin, depth)
        choices = VolumeOptions(narrow=False, cut=self._ground is not None)
        (plan,) = self._planner.plan(seen, [light], method, choices=choices)
        plan = replace(plan, scissor=target.viewport)
        if into != "stencil":
            return self._count_in_texture(target, size, plan, None if into == "texture" else into)
        with State(self.device, seen.clip) as state:
            self._counter.count(state, target, plan, wraps=True)
        self.device.check("shadow volumes were counted")
        triangles = sum(draw.count for draw in plan.draws) // 3
        reach = find_reach(seen, self.scene, light, target.viewport)
        return ShadowCount(plan.statistics.deepest, triangles, *reach)

    def find_reach(
        self,
        framebuffer: Any,
        view: ArrayLike,
        projection: ArrayLike,
        light: Light,
        viewport: Sequence[int] | None = None,
        *,
        depth: str = "minus-one-to-one",
    ) -> tuple[tuple[int, int, int, int], tuple[float, float]]:
        """
        Find the ``scissor`` and ``depth_bounds`` of a `ShadowCount`, where a texture takes counts.

        Parameters and errors as in ``count``.
        """
        check_light(light)
        target, _ = read_target(self.device, framebuffer, viewport)
        seen = read_projection(self.device, view, projection, target.size, self.scene.origin, depth)
        return find_reach(seen, self.scene, light, target.viewport)

    def _count_in_texture(
        self, target: ForeignTarget, size: tuple[int, int], plan: VolumePlan, texture: Any
    ) -> Any:
        """Count in a float texture over the framebuffer's depth."""
        texture, framebuffer = target.make_counts(size, texture)
        try:
            with State(self.device, plan.projection.clip) as state:
                for value, scissor in ((0.0, None), (float(plan.start), target.viewport)):
                    state.use(Pass(color_write=True, scissor=scissor))
                    values = np.full(4, value, np.float32)
                    self.device.gl.ClearBufferfv(0x1800, 0, values.ctypes.data)
                self._counter.add_in_floats(state, plan)
            self.device.check("shadow volumes were counted")
        finally:
            self.device.delete("Framebuffer", framebuffer)
        return texture

    def _build(self, scene: Scene, before: Sequence[Any] = ()) -> None:
        ground = None if self._ground is None else float(self._ground - scene.origin[2])
        casters = find_opaque(scene, None)
        self._geometry = Geometry(self.device, scene)
        self._planner = Planner(self.device, scene, self._geometry, casters, ground, before)
        self._counter = VolumeCounter(self.device, self._geometry, self._planner.indices)

    def _show(self, before: Scene, scene: Scene) -> None:
        groups = find_posed(self._geometry.groups, before, scene)
        if groups is not None:
            self._planner.move(scene, groups)
            return
        bodies = self._planner.bodies if np.array_equal(before.groups(), scene.groups()) else ()
        release_all(*self._list_held())
        self._build(scene, bodies)

    def _list_held(self) -> Iterable[Any]:
        yield from (self._counter, self._planner, self._geometry)
