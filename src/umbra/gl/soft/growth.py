"""
Enlarged casters: points by component, and the visible component at each pixel.

Components share no vertices, so that each grows about its own centre; instances are
stored separately in the scene's frame, since the light differs in each one's own.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.context import Device, release_all
from umbra.gl.geometry import FIRST_UNIT, Geometry
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Indices, TextureBuffer
from umbra.gl.state import Pass, State
from umbra.gl.target import SharedDepthTarget, Target
from umbra.scene import Scene
from umbra.scene.mesh import transform_points
from umbra.soft.weng import part_components

__all__ = ["GrownPoints", "Instance", "Shown", "part_bodies"]

_NOBODY = -1
# A surface passes at its own depth despite last-bit differences between programs.
_AGAIN = Pass(depth_test="lequal", color_write=True, polygon_offset=(0.0, -2.0))


@dataclass(frozen=True, eq=False)
class Instance:
    """
    One instance of a body, in the scene's frame.

    Parameters
    ----------
    body : Body
        Body whose components share no vertices.
    number : int
        Number of the instance in its body.
    vertices : (n, 3) float64
        Relative to the scene's origin [m].
    component : (n,) int64
        Component of each vertex, ascending.
    first_row : int
        Row of the first component among all instances'.
    """

    body: Body
    number: int
    vertices: NDArray[np.float64]
    component: NDArray[np.int64]
    first_row: int


def part_bodies(bodies: Sequence[Body]) -> tuple[list[Body], list[Instance]]:
    """
    Return bodies whose components share no vertices or numbers, and their instances.

    Points of their groups are renumbered, instance by instance.
    """
    parted, instances, first, row = [], [], 0, 0
    for body in bodies:
        caster, component = part_components(body.caster)
        other = copy(body)
        other.caster = caster
        count, rows = len(caster.vertices), len(caster.is_closed)
        starts = first + count * np.arange(len(body.groups))
        other.groups = [
            replace(group, vertices=caster.vertices, first=int(start))
            for group, start in zip(body.groups, starts, strict=True)
        ]
        other.first = starts.astype(np.int64)
        for number, transform in enumerate(body.transforms):
            vertices = transform_points(transform, caster.vertices)
            instances.append(Instance(other, number, vertices, component, row))
            row += rows
        first += count * len(body.groups)
        parted.append(other)
    return parted, instances


class GrownPoints:
    """
    Points of instances, and their growth under each light.

    Replaces ``Geometry`` for programs with ``GROWS`` defined.

    Attributes
    ----------
    n_points, n_rows : int
        Points and components of all instances.
    light : int
        Light whose growth is bound.
    growing : float
        Scale of the layer, less 1.
    shown : int
        Texture of the visible component at each pixel.
    """

    def __init__(self, device: Device, instances: Sequence[Instance]) -> None:
        self._device = device
        self.n_points = sum(len(instance.vertices) for instance in instances)
        self.n_rows = sum(len(instance.body.caster.is_closed) for instance in instances)
        points = np.zeros((max(self.n_points, 1), 4), np.float32)
        begin = 0
        for instance in instances:
            end = begin + len(instance.vertices)
            points[begin:end, :3] = instance.vertices
            points[begin:end, 3] = instance.first_row + instance.component
            begin = end
        self._points = TextureBuffer(device, points, "rgba32f")
        self._growth: TextureBuffer | None = None
        self.light, self.growing, self.shown = 0, 0.0, 0

    def write(self, growth: NDArray[np.float32]) -> None:
        """
        Set the growth of components, (n_lights, n_rows, 2, 4) float32.

        Centre and sinking depth of the component [m]; unit vector to the light and 0.
        """
        release_all(self._growth)
        self._growth = TextureBuffer(
            self._device, growth if growth.size else np.zeros(8, np.float32), "rgba32f"
        )

    def bind(self, program: Program) -> None:
        """Bind the enlarged points for a program that includes ``grow.glsl``."""
        assert self._growth is not None
        self._points.bind(FIRST_UNIT)
        self._growth.bind(FIRST_UNIT + 1)
        self._device.gl.bind_texture(FIRST_UNIT + 2, self.shown)
        program.set(
            points=FIRST_UNIT, growth=FIRST_UNIT + 1, shown=FIRST_UNIT + 2,
            growth_row=self.light * self.n_rows, growing=self.growing,
        )  # fmt: skip

    def release(self) -> None:
        """Free the buffers."""
        release_all(self._growth, self._points)
        self._growth = None


class Shown:
    """Draws the visible component of the casters at each pixel."""

    def __init__(
        self,
        device: Device,
        scene: Scene,
        geometry: Geometry,
        instances: Sequence[Instance],
        casters: Sequence[int] | None = None,
    ) -> None:
        self._device, self._geometry = device, geometry
        rows = _find_rows(scene, instances, casters)
        casts = np.flatnonzero(rows != _NOBODY)
        self._count = 3 * len(casts)
        self._indices = Indices(device, 2 * geometry.n_points)
        self._indices.write(geometry.faces[casts].ravel())
        listed = rows[casts] if len(casts) else np.zeros(1, np.int32)
        self._rows = TextureBuffer(device, listed, "r32i")
        self._program = Program(device, "surface.vert.glsl", "component.frag.glsl")
        self._picture = SharedDepthTarget(self._device, "r32i")

    def draw(self, state: State, target: Target, projection: CameraProjection) -> int:
        """
        Draw the visible components over a target's depth; return the texture.

        It holds numbers as in `Instance`, and -1 where there is no caster.
        """
        shown = self._picture.over(target)
        shown.fill(state, _NOBODY)
        state.use(_AGAIN)
        self._geometry.bind(self._program)
        self._rows.bind(0)
        self._program.set(**projection.uniforms, components=0)
        self._indices.draw(self._program, 0, self._count)
        return shown.textures[0]

    def release(self) -> None:
        """Free the program, buffers and picture."""
        self._picture.release()
        self._program.release()
        self._rows.release()
        self._indices.release()


def _find_rows(
    scene: Scene, instances: Sequence[Instance], casters: Sequence[int] | None
) -> NDArray[np.int32]:
    """Return the component row of each of a scene's triangles; -1 for none."""
    chosen = set(range(len(scene.parts)) if casters is None else casters)
    counts = np.array([part.triangles for part in scene.parts])
    starts = np.cumsum(counts) - counts
    rows = np.full(counts.sum(), _NOBODY, np.int32)
    for instance in instances:
        caster, group = instance.body.caster, instance.body.groups[instance.number]
        indices = [index for index in group.parts if index in chosen]
        faces = np.concatenate([starts[i] + np.arange(counts[i]) for i in indices])
        rows[faces[caster.source]] = instance.first_row + caster.component
    return rows
