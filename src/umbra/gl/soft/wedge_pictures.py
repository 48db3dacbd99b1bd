"""
Penumbra wedges on OpenGL: the hard count, corrected by silhouette edges at each pixel.

Akenine-Möller and Assarsson 2002; Assarsson and Akenine-Möller 2003. As `umbra.soft.wedges`:
each edge's wedge is drawn as a polyhedron, whose pixels compute in closed form the part of
the light that the edge covers; sums and counts are floats. Distances come from depth keys,
a depth buffer that shaders can read.
"""

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.geometry import RINGS, draw_ground
from umbra.gl.planner import Planner
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import CameraProjection, find_light_source
from umbra.gl.resources import Indices, TextureBuffer
from umbra.gl.soft.visibility import Visibility
from umbra.gl.state import Pass, State
from umbra.gl.target import SharedDepthTarget, Target
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.gl.volumes import BodyVolumes
from umbra.scene.mesh import transform_points
from umbra.soft import AreaLight
from umbra.soft.light_edges import list_light_edges, map_to_unit_light

__all__ = ["Keys", "WedgePainter", "Wedges"]

# Only surfaces in the depth buffer, which transparent ones are not.
_AGAIN = Pass(depth_test="equal", color_write=True)


class Keys:
    """Draws the depth keys of a planner's scene, with normals."""

    def __init__(self, planner: Planner) -> None:
        self._device, self._geometry = planner.device, planner.geometry
        self._planner = planner
        self._indices = Indices(planner.device, 2 * planner.geometry.n_points)
        self._indices.write(planner.geometry.faces.ravel())
        self._faces, self._ground = (
            Program(planner.device, f"{what}.vert.glsl", "key.frag.glsl", needs)
            for what, needs in (("surface", {}), ("ground", {"IS_GROUND": 1, "RINGS": RINGS}))
        )
        self._picture = SharedDepthTarget(self._device, "rgba32f")

    def draw(self, state: State, target: Target, projection: CameraProjection) -> int:
        """
        Draw the keys of the surfaces in a target's depth; return the texture.

        Keys are 1 / depth in perspective and -depth in a parallel view; 0 in the background.
        """
        shown = self._picture.over(target)
        shown.fill(state, 0.0)
        state.use(_AGAIN)
        self._geometry.bind(self._faces)
        self._faces.set(**projection.uniforms, **projection.rays, depths=_find_depths(projection))
        self._indices.draw(self._faces, 0, self._geometry.faces.size)
        if self._planner.ground is not None:
            rays = projection.rays
            draw_ground(state, self._ground, projection, self._planner.ground, rays, _AGAIN)
        return shown.textures[0]

    def release(self) -> None:
        """Free the programs, triangles and picture."""
        release_all(self._picture, self._indices, self._faces, self._ground)


def _find_depths(projection: CameraProjection) -> np.ndarray:
    """Return the nearest depth of a parallel view, and its depth range [m]."""
    if projection.camera.is_perspective:
        return np.zeros(2)
    # Window depth is linear: 2 (depth - near) / (far - near) - 1 before it is halved.
    far_less_near = 2.0 / np.linalg.norm(projection.matrix[2, :3])
    near = -0.5 * far_less_near * (projection.matrix[2, 3] + 1.0)
    if projection.reverses_depth:
        return np.array([near + far_less_near, -far_less_near])
    return np.array([near, far_less_near])


VERTICES = 24
"""Of the polyhedron of an edge's wedge."""
_REACH = 100.0  # extent of wedges in parallel views, in sizes of the scene

_TEXELS = 8  # per edge, see wedge_row.glsl


@dataclass(frozen=True, eq=False)
class LightEdges:
    """A light's silhouette edges on the device, and their volumes."""

    light: AreaLight
    volumes: Sequence[BodyVolumes]
    table: TextureBuffer
    count: int

    def is_of(self, light: AreaLight, plan: VolumePlan) -> bool:
        """Return whether these edges belong to a light's current hard volumes."""
        own, other = self.light, light
        return (
            len(self.volumes) == len(plan.volumes)
            and all(map(operator.is_, self.volumes, plan.volumes))
            and np.array_equal(own.light.position, other.light.position)
            and own.radius == other.radius
            and (own.edges is None) == (other.edges is None)
            and (own.edges is None or np.array_equal(own.edges, other.edges))  # type: ignore[arg-type]
        )


class WedgePainter:
    """Draws the penumbra wedges of a picture's lights by a given program."""

    def __init__(self, planner: Planner) -> None:
        self._device: Device = planner.device
        self._planner = planner
        self._keys = Keys(planner)
        self._programs = Programs(self._device, "wedge.vert.glsl", "wedge.frag.glsl")
        self._edges: list[LightEdges] = []
        self._projection: CameraProjection | None = None
        self._key = 0

    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Prepare a picture; see `Visibility`."""
        self._projection, self._key = projection, 0
        origin = self._planner.scene.origin
        old, self._edges = self._edges, []
        for light, plan in zip(lights, plans, strict=True):
            edges = next((previous for previous in old if previous.is_of(light, plan)), None)
            if edges is None:
                rows = _list_edges(light, plan.volumes, origin)
                table = rows if len(rows) else np.zeros((1, *rows.shape[1:]), np.float32)
                buffer = TextureBuffer(self._device, table, "rgba32f")
                edges = LightEdges(light, plan.volumes, buffer, len(rows))
            self._edges.append(edges)
        for previous in old:
            if previous not in self._edges:
                previous.table.release()

    def draw_keys(self, state: State, target: Target) -> None:
        """Draw depth keys, once per picture. Before: the target's depth holds the scene."""
        if not self._key:
            assert self._projection is not None
            self._key = self._keys.draw(state, target, self._projection)

    def bind_keys(self, unit: int) -> None:
        """Bind the keys to a texture unit."""
        self._device.gl.bind_texture(unit, self._key)

    def draw(
        self,
        state: State,
        number: int,
        plan: VolumePlan,
        *needs: str,
        uniforms: Mapping[str, object] | None = None,
        **values: object,
    ) -> None:
        """
        Add the contributions of a light's edges to the target in use.

        Before: keys are drawn. ``needs`` and ``values`` are defines, and uniforms are set, for
        ``wedge.frag.glsl``.
        """
        edges = self._edges[number]
        if not edges.count:
            return
        state.use(
            Pass(
                depth_test="gequal", color_write=True, blend="add", cull="front",
                depth_clamp=True, scissor=plan.scissor,
            )
        )  # fmt: skip
        program = self._prepare(edges, plan, needs, values)
        program.set(**(uniforms or {}))
        program.draw(VERTICES * edges.count)

    def _prepare(
        self,
        edges: LightEdges,
        plan: VolumePlan,
        needs: tuple[str, ...],
        values: Mapping[str, object],
    ) -> Program:
        """Choose the program for a light, and set its inputs."""
        light, projection = edges.light, plan.projection
        kind = {"IS_POINT": light.light.is_point, "IS_SQUARE": light.edges is not None}
        needs = (*(name for name, needed in kind.items() if needed), *needs)
        program = self._programs.find(*needs, **values)
        source = find_light_source(light.light, self._planner.scene.origin)
        axes = map_to_unit_light(light, source)
        self.bind_keys(0)
        edges.table.bind(1)
        program.set(
            keys=0, edges=1, light=plan.light, radius=light.radius, axis_u=axes[0],
            axis_v=axes[1], axis_n=axes[2], reach=self._find_reach(projection),
            bottom=float(self._planner.casting.floor - projection.eye[2]),
            **projection.uniforms, **projection.rays,
        )  # fmt: skip
        return program

    def _find_reach(self, projection: CameraProjection) -> float:
        """Return the extent of wedges; 0 means infinity, which is out of parallel views."""
        if projection.camera.is_perspective:
            return 0.0
        whole = self._planner.scene.bounds() - self._planner.scene.origin
        apart = np.abs(whole - projection.eye).max()
        return _REACH * float(apart + projection.camera.height)

    def release(self) -> None:
        """Free the device objects."""
        release_all(*(edges.table for edges in self._edges), self._keys, self._programs)
        self._edges = []


class Wedges(Visibility):
    """Corrects the hard counts of a planner's plans along silhouettes."""

    def __init__(self, planner: Planner, counter: VolumeCounter) -> None:
        self._counter = counter
        self._painter = WedgePainter(planner)
        self._uncover = Program(planner.device, "picture.vert.glsl", "uncover.frag.glsl")
        self._plans: Sequence[VolumePlan] = ()
        self._parts, self._shares = (
            SharedDepthTarget(planner.device, name) for name in ("rgba32f", "r32f")
        )

    def begin(
        self, projection: CameraProjection, lights: Sequence[AreaLight], plans: Sequence[VolumePlan]
    ) -> None:
        """Prepare a picture; see `Visibility`."""
        self._plans = plans
        self._painter.begin(projection, lights, plans)

    def draw(self, state: State, target: Target, number: int) -> Target:
        """Draw a light's visibility; see `Visibility`."""
        parts, shares = self._parts.over(target), self._shares.over(target)
        self._painter.draw_keys(state, target)
        counts = self._counter.count_in_floats(state, target, self._plans[number])
        parts.fill(state, 0.0)
        self._painter.draw(state, number, self._plans[number])
        shares.use()
        state.use(Pass(color_write=True))
        counts.bind(0)
        parts.bind(1)
        self._uncover.set(counts=0, parts=1)
        self._uncover.draw(3)
        return shares

    def release(self) -> None:
        """Free the device objects."""
        release_all(self._parts, self._shares, self._painter, self._uncover)


def _list_edges(
    light: AreaLight, volumes: Sequence[BodyVolumes], origin: NDArray[np.float64]
) -> NDArray[np.float32]:
    """List the possible silhouette edges in the layout of ``wedge_row.glsl``: (n, 8, 4) float32."""
    source = find_light_source(light.light, origin)
    lists = [np.zeros((0, _TEXELS, 4), np.float32)]
    for body_volumes in volumes:
        for instance, transform in enumerate(body_volumes.body.transforms):
            caster = body_volumes.caster_of(instance).opened(body_volumes.opened[instance])
            vertices = transform_points(transform, caster.vertices)
            edges = list_light_edges(caster, vertices, source, light.radius)
            rows = np.zeros((len(edges.ends), _TEXELS, 4), np.float32)
            rows[:, :2, :3] = edges.ends.reshape(-1, 2, 3)
            rows[:, 0, 3], rows[:, 1, 3] = edges.weight, edges.turn
            rows[:, 2:6, :3] = edges.wedges[..., :3]
            rows[:, 6:, :3] = edges.faces[..., :3]
            lists.append(rows)
    return np.concatenate(lists)
