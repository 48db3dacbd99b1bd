"""
The shadow profile of a period in 3D: hours of shadow on visible surfaces, or as a relief.

Wallner (2008, figures 5 to 7) superimposes the shadows of a period's steps in a perspective
view. Here each step is counted by shadow volumes at every pixel, so the hours on walls and
roofs are as exact as on the ground. The relief shows the profile of the ground as a separate
surface, with height proportional to shadow hours and a contour at each step.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import prepare_casting
from umbra.cpu.plane import PlaneSweep
from umbra.gl.context import release_all
from umbra.gl.planner import Planner
from umbra.gl.programs import Program
from umbra.gl.resources import TextureBuffer
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.target import PLACE, SharedDepthTarget
from umbra.gl.volume_counter import VolumeCounter
from umbra.scene import Scene, directional_light
from umbra.scene.grid import Grid
from umbra.window.daylight import Suns
from umbra.window.overlays import ASIDE, PALETTE
from umbra.writers.pixels import shade_ramp

__all__ = ["HOURS", "Relief", "ShadowProfile", "count_profile"]

HOURS = shade_ramp(len(PALETTE))
"""sRGB from no hours of shadow to the whole period, (9, 3): the pictures' ramp."""
_FAINT = 0.03  # of hours: walls stay within half of one of eight steps of their own colour
_AT_ONCE = 16  # suns whose volumes are in memory together
_CELLS = 240  # along a relief's longer side
_HIGHEST = 1 / 3  # of the model's height above ground
_FARTHEST = 2.0  # of the model's diagonal: the relief cuts longer shadows
_SUNLIT = Pass(color_write=True, blend="add", stencil=Stencil(test="equal", reference=0))
_WHOLE = Pass(color_write=True)
_DEPTH = Pass(depth_test="less", depth_write=True)
_SURFACE = Pass(depth_test="lequal", color_write=True, blend="over")
_OPACITY = 0.72
_COVERED = -1.0
_ZENITH = np.array([[0.0, 0.0, 1.0]])


@dataclass(frozen=True, eq=False)
class Relief:
    """
    Hours of shadow on the ground.

    Parameters
    ----------
    grid : Grid
        In the scene's frame.
    height : float
        z of the ground in that frame [m].
    hours : (rows, cols) float32
        -1 under any part.
    lift : float
        Height of an hour [m].
    """

    grid: Grid
    height: float
    hours: NDArray[np.float32]
    lift: float


def count_profile(
    scene: Scene, casters: Sequence[int], ground: float, suns: Suns, threads: int = 1
) -> Relief | None:
    """
    Count the hours of shadow on the ground around the casters; None without casters.

    A point always in shadow is a third as high as the model. ``ground`` is in the model's
    own coordinates [m].
    """
    caster = prepare_casting(scene, casters, threads).caster if len(casters) else None
    height = ground - scene.origin[2]
    if caster is None or not len(suns.hours) or caster.vertices[:, 2].max() <= height:
        return None
    low, high = caster.vertices.min(0), caster.vertices.max(0)
    ways = -suns.directions[:, :2] / suns.directions[:, 2:] * (high[2] - height)
    most = _FARTHEST * float(np.linalg.norm(high - low))
    ways = np.clip(np.vstack([ways, [[0.0, 0.0]]]), -most, most)
    low2, high2 = low[:2] + ways.min(0), high[:2] + ways.max(0)
    cell = float((high2 - low2).max()) / _CELLS
    cols, rows = (np.ceil((high2 - low2) / cell).astype(int) + 2).tolist()
    grid = Grid(float(low2[0]) - cell / 2, float(low2[1]) - cell / 2, cell, cell, cols, rows)
    sweep = PlaneSweep(caster, grid, height, threads)
    hours = np.full((rows, cols), suns.behind_land, np.float32)
    for first in range(0, len(suns.hours), _AT_ONCE):
        batch = slice(first, first + _AT_ONCE)
        hours += np.tensordot(suns.hours[batch], sweep.masks(suns.directions[batch]), 1)
    hours[sweep.masks(_ZENITH)[0] != 0] = _COVERED
    return Relief(grid, height, hours, _HIGHEST * float(high[2] - height) / suns.total)


class ShadowProfile:
    """Draws the profile of a period over a renderer's picture."""

    def __init__(self, renderer: SceneRenderer) -> None:
        self._renderer, self._device = renderer, renderer.device
        device = renderer.device
        self._counts: tuple[Planner, VolumeCounter] | None = None
        self._hours = SharedDepthTarget(device, "r32f")
        self._sunlit = Program(device, "picture.vert.glsl", "sunlit.frag.glsl")
        self._heat = Program(device, "picture.vert.glsl", "heat.frag.glsl")
        self._relief = Program(device, "relief.vert.glsl", "relief.frag.glsl")
        self._raster: TextureBuffer | None = None
        self._raster_of: Relief | None = None

    def renew(self) -> None:
        """Drop the volumes after the renderer's scene moved."""
        if self._counts is not None:
            release_all(*reversed(self._counts))
        self._counts = None

    def _prepare(self) -> "tuple[Planner, VolumeCounter]":
        """Return a planner and a counter, separate from the picture's."""
        if self._counts is None:
            planner = self._renderer.planner.twin()
            counter = VolumeCounter(self._device, self._renderer.geometry, planner.indices)
            self._counts = planner, counter
        return self._counts

    def draw_hours(self, state: State, suns: Suns) -> None:
        """
        Replace the picture by the hours of shadow on visible surfaces.

        Before: the renderer has drawn a picture. After: ``targets.picture`` is in use, and shows
        the hours in the colours of ``HOURS``, the whole period in the last.
        """
        renderer, targets = self._renderer, self._renderer.targets
        assert targets is not None
        assert renderer.projection is not None
        planner, counter = self._prepare()
        renderer.draw_surface(state)
        hours = self._hours.over(targets.light)
        hours.fill(state, suns.total)
        lights = [directional_light(way) for way in suns.directions]
        for first in range(0, len(lights), _AT_ONCE):
            batch = lights[first : first + _AT_ONCE]
            plans = planner.plan(renderer.projection, batch)
            for number, plan in enumerate(plans, first):
                counter.count(state, hours, plan)
                hours.use()
                state.use(_SUNLIT)
                targets.surface.bind(0, PLACE)
                sun, spent = suns.directions[number], -float(suns.hours[number])
                self._sunlit.set(places=0, sun=sun, hours=spent)
                self._sunlit.draw(3)
        targets.picture.use()
        state.use(_WHOLE)
        hours.bind(0)
        targets.surface.bind(1, PLACE)
        self._heat.set(
            counts=0,
            places=1,
            top=suns.total,
            palette=HOURS,
            aside=ASIDE,
            soft=_FAINT,
        )
        self._heat.draw(3)

    def draw_relief(self, state: State, relief: Relief, suns: Suns) -> None:
        """Draw a relief, translucent, into ``targets.picture``, tested against its depth."""
        targets, projection = self._renderer.targets, self._renderer.projection
        assert targets is not None
        assert projection is not None
        if self._raster is None or self._raster_of is not relief:
            release_all(self._raster)
            values = np.zeros((relief.hours.size, 2), np.float32)
            values[:, 0] = relief.hours.ravel()
            self._raster, self._raster_of = TextureBuffer(self._device, values, "rg32f"), relief
        grid, corner = relief.grid, -projection.eye
        corner = corner + np.array([grid.x0, grid.y0, relief.height])
        targets.picture.use()
        self._raster.bind(0)
        self._relief.set(
            raster=0, cols=grid.cols, corner=corner,
            cell=np.array([grid.dx, grid.dy]), lift=relief.lift, palette=HOURS,
            top=suns.total, step_hours=suns.step, opacity=_OPACITY, aside=ASIDE,
            projection=projection.clip_matrix,
        )  # fmt: skip
        self._renderer.still.forget()  # the relief is drawn into its depth
        for settings in (_DEPTH, _SURFACE):
            state.use(settings)
            self._relief.draw(6 * (grid.cols - 1) * (grid.rows - 1))

    def release(self) -> None:
        """Free the device objects."""
        release_all(self._sunlit, self._heat, self._relief, self._raster, self._hours)
        self.renew()
        self._raster = self._raster_of = None
