"""
Shadow sums of many suns over one plan on OpenGL: stencil counts, summed on the device.

Seen from the zenith, z-pass is always right while the sun is up: no caps. On the bare
ground, where casters are not drawn, the light caps above count as well. The picture of
each sun stays on the device; only the sum is read back.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body, make_bodies
from umbra.gl.context import Device, DeviceUser, on_device
from umbra.gl.geometry import Geometry
from umbra.gl.overlap import bound_count, find_most
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Indices, TextureBuffer
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.target import Target
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import Draw, Statistics, VolumePlan
from umbra.gl.volumes import make_volumes
from umbra.rays.masks import add_masks
from umbra.scene import Camera, Scene
from umbra.scene.grid import ASIDE, Grid

__all__ = ["GlSweep"]

_SURFACE = Pass(depth_test="less", depth_write=True, color_write=True)
_SHADED = Pass(color_write=True, blend="add", stencil=Stencil(test="notequal"))
_LIT = Pass(color_write=True, blend="add", stencil=Stencil(test="equal"))
_NOTHING = -1
_ASIDE = 2.0**-12
"""
How far to the east a cell is judged [cells], so that edges which run through its centre fall
to the side to which they fall on the CPU; less than that is lost in float32.
"""
_MARGIN = 0.01  # of the model's height: above and below the drawn surfaces


class GlSweep(DeviceUser):
    """
    Count the shadows of many suns on one raster; results as ``umbra.cpu.raster_sweep.Sweep``.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int, optional
        Indices of the parts that cast; all by default.
    grid : Grid
        In the scene's local frame.
    ground : float
        z of the ground plane, local frame [m].
    on_plane : bool
        Receiver: the ground plane alone, or the topmost surface of it and all parts.
    device : Device, optional
        A new one by default, released with the sweep.
    """

    def __init__(
        self,
        scene: Scene,
        casters: Sequence[int] | None,
        grid: Grid,
        ground: float,
        on_plane: bool,
        device: Device | None = None,
    ) -> None:
        super().__init__(device)
        self.grid, self.ground, self.on_plane = grid, ground, on_plane
        with self.device.current():
            self.geometry = Geometry(self.device, scene)
            self.bodies = make_bodies(scene, self.geometry, casters)
            self.indices = Indices(self.device, 2 * self.geometry.n_points)
            self._counter = VolumeCounter(self.device, self.geometry, self.indices)
            size = (grid.cols, grid.rows)
            self._target = Target(self.device, size, ("r32i",))
            self._steps = Target(self.device, size, ("r32f",), depth_of=self._target)
            self._one = Program(self.device, "picture.vert.glsl", "one.frag.glsl")
            self._turned = Program(self.device, "picture.vert.glsl", "turned.frag.glsl")
            self._normals = self._upload_normals(scene)
            self._projection = self._look_down(scene)
            self._draw_surface()

    @on_device
    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """
        Add to each cell the weights of the suns that leave it in shadow.

        Suns of equal weight are counted on the device; else each mask is read.

        Parameters
        ----------
        suns : (n, 3) float64
            Directions toward the sun, above the horizon.
        weights : (n, k) int32
        sums : (k, rows, cols) int32
            Added to.
        progress : callable
            Called occasionally with the number of suns done.
        """
        if not len(suns):
            return
        if (weights != weights[0]).any():
            add_masks(self.masks, suns, weights, sums, progress)
            return
        with State(self.device) as state:
            self._steps.fill(state, 0.0)
            for plan in self._plan(suns):
                self._counter.count(state, self._target, plan)
                self._add_shadow(state, plan)
                progress(1)
        steps = np.rint(self._steps.read()[::-1]).astype(np.int32)
        sums += weights[0][:, None, None] * steps

    @on_device
    def masks(
        self, suns: NDArray[np.float64], progress: Callable[[int], object] = lambda _: None
    ) -> NDArray[np.uint8]:
        """Find the cells in shadow for each sun, cast or attached: (n, rows, cols) uint8."""
        masks = np.zeros((len(suns), self.grid.rows, self.grid.cols), np.uint8)
        with State(self.device) as state:
            for mask, plan in zip(masks, self._plan(suns), strict=True):
                self._steps.fill(state, 0.0)
                self._counter.count(state, self._target, plan)
                self._add_shadow(state, plan)
                mask[:] = self._steps.read()[::-1] > 0
                progress(1)
        return masks

    @on_device
    def counts(self, suns: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the shadow count of every cell for every sun, (n, rows, cols) int32."""
        counts = np.zeros((len(suns), self.grid.rows, self.grid.cols), np.int32)
        with State(self.device) as state:
            for count, plan in zip(counts, self._plan(suns), strict=True):
                self._counter.count(state, self._target, plan)
                count[:] = self._counter.read(self._target, plan)[::-1]
        return counts

    def _list_held(self) -> Iterable[Any]:
        yield from (self._steps, self._target, self._one, self._turned, self._normals)
        yield from (self._counter, self.indices, self.geometry)

    def _plan(self, suns: NDArray[np.float64]) -> Iterator[VolumePlan]:
        """Plan each sun in turn: sides and, on the ground, light caps."""
        eye = self._projection.eye
        for sun in suns:
            light = np.append(sun, 0.0)
            lists, most, thrown = [], [], []
            for body in self.bodies:
                opened = self._find_opened(body)
                volumes = make_volumes(body, light, opened)
                lists.append(volumes.list_sides()[0].ravel())
                if self.on_plane:
                    everything = np.ones(body.n_shells * len(body.groups), np.bool_)
                    lists.append(volumes.find_cap(everything)[0].ravel())
                most.append(find_most(body, opened))
                thrown.append(volumes)
            numbers = np.concatenate(lists) if lists else np.zeros(0, np.uint32)
            self.indices.write(numbers)
            yield VolumePlan(
                projection=self._projection,
                light=light,
                bottom=float(self._low - eye[2]),
                draws=(Draw("z_pass", True, 0, len(numbers)),) if len(numbers) else (),
                start=0,
                case=np.ones(0, np.int8),
                statistics=Statistics(
                    sides=len(numbers) // 3,
                    sides_z_pass=len(numbers) // 3,
                    index_bytes=self.indices.n_bytes,
                    deepest=bound_count(thrown, most, light),
                ),
            )

    def _find_opened(self, body: Body) -> NDArray[np.bool_]:
        """Open nothing for topmost surfaces; ground may lie inside inward-wound components."""
        opened = np.zeros((len(body.groups), len(body.caster.is_closed)), np.bool_)
        if self.on_plane:
            opened[:] = body.is_inward
        return opened

    def _add_shadow(self, state: State, plan: VolumePlan) -> None:
        """Add 1 where the stencil is not 0 or the surface faces away from the sun."""
        self._steps.use()
        state.use(_SHADED)
        self._one.draw(3)
        if self.on_plane:
            return
        state.use(_LIT)
        self._target.bind(0)
        self._normals.bind(1)
        self._turned.set(faces=0, planes=1, sun=plan.light[:3])
        self._turned.draw(3)

    def _upload_normals(self, scene: Scene) -> TextureBuffer:
        soup = scene.triangles()
        a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        length = np.linalg.norm(across, axis=1, keepdims=True)
        normals = np.zeros((len(across), 4), np.float32)
        np.divide(across, length, out=normals[:, :3], where=length > 0, casting="same_kind")
        return TextureBuffer(self.device, normals, "rgba32f")

    def _look_down(self, scene: Scene) -> CameraProjection:
        """Project the grid's cells to pixels, from above the model to below the ground."""
        grid = self.grid
        whole = scene.bounds() - scene.origin
        room = _MARGIN * max(float(whole[1, 2] - min(whole[0, 2], self.ground)), 1.0)
        self._low = self.ground - room
        top, bottom = max(float(whole[1, 2]), self.ground) + room, self._low - room
        width, height = grid.cols * grid.dx, grid.rows * grid.dy
        west, south = grid.x0 - grid.dx / 2, grid.y0 - grid.dy / 2
        aside = _ASIDE * np.array(ASIDE) / ASIDE[0] * (grid.dx, grid.dy)
        eye = np.array([*(np.array([west + width / 2, south + height / 2]) + aside), top])
        matrix = np.diag([2 / width, 2 / height, -2 / (top - bottom), 1.0])
        matrix[2, 3] = -1.0
        size = (grid.cols, grid.rows)
        camera = Camera(eye, eye - (0, 0, 1), np.array([0.0, 1.0, 0.0]), size, height=height)
        return CameraProjection(matrix, eye, camera, camera, self.device.reverses_depth)

    def _draw_surface(self) -> None:
        """Draw the receivers' face numbers and depth, the ground's elsewhere."""
        depth = self._projection.matrix[2, 2] * (self.ground - self._projection.eye[2]) - 1.0
        with State(self.device) as state:
            self._target.begin(state, _NOTHING, depth=(depth + 1) / 2)
            state.use(_SURFACE)
            if self.on_plane:
                return
            surface = Program(self.device, "surface.vert.glsl", "face.frag.glsl")
            faces = Indices(self.device, 2 * self.geometry.n_points)
            faces.write(self.geometry.faces.ravel())
            self.geometry.bind(surface)
            surface.set(**self._projection.uniforms, first=0, step=1)
            faces.draw(surface, 0, self.geometry.faces.size)
            faces.release()
            surface.release()
