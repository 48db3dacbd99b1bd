"""
What a device would gain by skinning meshes and finding silhouettes itself.

umbra poses skins, finds planes and silhouettes on the processor, in float64, and uploads points
and index lists. Here a device does the same by transform feedback, and nothing is uploaded but the
joints' matrices: three passes over vertices, faces and edges, whose sides stay on the device. What
neither side of the comparison includes is drawing. A device whose row is faster than the
processor's could pose its casters itself; one in software is not.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device
from umbra.gl.convexity import Balls, find_balls, measure_shape
from umbra.gl.resources import TextureBuffer
from umbra.scene.mesh import Mesh
from umbra.scene.rig import Shape, Skin, make_matrices
from umbra.volume.adjacency import Caster, make_caster
from umbra.volume.silhouette import find_silhouettes
from umbra_benchmarks.measure import Timing
from umbra_benchmarks.scenes import make_boulder

__all__ = ["SkinRow", "bench_skin"]

_JOINTS, _INFLUENCES = 24, 4
_LIGHT = np.array([0.5, 0.3, 1.2, 0.0])
_POINTS = 0


@dataclass(frozen=True)
class SkinRow:
    """
    One skinned mesh in another pose.

    Parameters
    ----------
    triangles : int
    processor : Timing
        Pose, planes and silhouette on the processor, processor time [s].
    upload : Timing
        Points, normals and sides, by the clock [s].
    device : Timing
        The same work by transform feedback, by the clock, until it is finished [s].
    sides : int
        Of the shadow volume.
    differ : int
        Sides that only one of both finds: of faces that the light sees edge-on within float32.
    """

    triangles: int
    processor: Timing
    upload: Timing
    device: Timing
    sides: int
    differ: int

    def to_dict(self) -> dict[str, Any]:
        """Return numbers for programs; times in ms."""
        found: dict[str, Any] = {
            "triangles": self.triangles, "sides": self.sides, "differ": self.differ,
        }  # fmt: skip
        for name in ("processor", "upload", "device"):
            found |= getattr(self, name).to_ms(f"{name}_")
        return found


def bench_skin(device: Device, splits: int, repeat: int) -> SkinRow:
    """Pose a boulder of 20 * 4**splits triangles on both sides, and compare what they find."""
    shape, caster = _make_figure(splits)
    processor, other = _ProcessorPoser(shape, caster), _DevicePoser(device, shape, caster)
    places = [_bend(number) for number in range(2 + repeat)]
    for poser in (processor, other):
        for each in places[:2]:
            poser.pose(each)
    spent = _time(time.process_time, [partial(processor.pose, each) for each in places[2:]])
    uploads = _time(time.perf_counter, [partial(other.upload, processor)] * repeat)
    drawn = _time(time.perf_counter, [partial(other.pose, each) for each in places[2:]])
    ours, theirs = processor.sides, other.read_sides()
    other.release()
    both = np.unique(np.concatenate([_order(ours), _order(theirs)]), axis=0, return_counts=True)[1]
    differ = int((both == 1).sum())
    return SkinRow(len(caster.faces), spent, uploads, drawn, len(ours), differ)


def _time(clock: Callable[[], float], calls: Sequence[Callable[[], object]]) -> Timing:
    spent = []
    for call in calls:
        begun = clock()
        call()
        spent.append(clock() - begun)
    return Timing.of(spent)


def _order(sides: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return the near ends (n, 2) of sides (n, 6), which name them."""
    return np.asarray(sides, np.int64)[:, :2]


def _make_figure(splits: int) -> tuple[Shape, Caster]:
    """Make a boulder that hangs on joints along its height, and its adjacency."""
    model = make_boulder(splits, side=10.0)
    vertices = model.vertices - model.vertices.mean(0)
    normals = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    heights = np.linspace(vertices[:, 2].min(), vertices[:, 2].max(), _JOINTS)
    away = np.abs(vertices[:, 2, None] - heights)
    joints = np.argsort(away, axis=1, kind="stable")[:, :_INFLUENCES]
    pull = 1.0 / (0.05 + np.take_along_axis(away, joints, 1))
    bind = np.tile(np.eye(4), (_JOINTS, 1, 1))
    bind[:, 2, 3] = -heights
    shape = Shape(
        Mesh(vertices, model.faces, normals.astype(np.float32)),
        np.zeros(0),
        skin=Skin(np.arange(_JOINTS), bind),
        joints=joints,
        influences=pull / pull.sum(1, keepdims=True),
    )
    return shape, make_caster(shape.rest.vertices, shape.rest.faces)


def _bend(number: int) -> NDArray[np.float64]:
    """Return the places of the joints (n, 4, 4): each leans a little more than the one below."""
    step = 0.004 * np.sin(0.3 * number)
    lean = step * np.arange(_JOINTS)
    rotation = np.zeros((_JOINTS, 4))
    rotation[:, 0], rotation[:, 3] = np.sin(lean), np.cos(lean)
    height = np.linspace(-1.4, 1.4, _JOINTS)
    places = np.stack([lean, np.zeros(_JOINTS), height], 1)
    return make_matrices(places, rotation, np.ones((_JOINTS, 3)))


class _ProcessorPoser:
    """Poses as umbra does: skin, planes, silhouette."""

    def __init__(self, shape: Shape, caster: Caster) -> None:
        self._shape, self._caster = shape, caster
        self._balls = Balls.of(caster, find_balls(caster))

    def pose(self, places: NDArray[np.float64]) -> None:
        """Find the points, normals and sides of a pose."""
        self.mesh = self._shape.pose(places)
        planes = measure_shape(self._caster, self.mesh.vertices, self._balls).planes
        posed = replace(self._caster, vertices=self.mesh.vertices, planes=planes)
        ((_, found),) = find_silhouettes(posed, _LIGHT[None])
        which = found.codes >> 2
        is_forward = (found.codes & 1 == 1) == (posed.weight[which] > 0)
        edges = posed.edges[which].astype(np.uint32)
        a = 2 * np.where(is_forward, edges[:, 0], edges[:, 1])
        b = 2 * np.where(is_forward, edges[:, 1], edges[:, 0])
        self.sides = np.stack([b, a, a + 1, b, a + 1, b + 1], 1)


class _DevicePoser:
    """Poses by transform feedback."""

    def __init__(self, device: Device, shape: Shape, caster: Caster) -> None:
        context, rest, skin = device.context, shape.rest, shape.skin
        assert skin is not None
        assert rest.normals is not None
        self._device, self._skin = device, skin
        self._n = len(rest.vertices), len(caster.faces), len(caster.edges)
        points = np.zeros((2 * len(rest.vertices), 4), np.float32)
        points[::2, :3], points[1::2, :3] = rest.vertices, rest.normals
        edges = np.concatenate([caster.edges, caster.edge_faces], 1).astype(np.int32)
        self._tables = {
            "rest": TextureBuffer(device, points, "rgba32f"),
            "joints": TextureBuffer(device, np.asarray(shape.joints, np.int32), "rgba32i"),
            "influences": TextureBuffer(
                device, np.asarray(shape.influences, np.float32), "rgba32f"
            ),
            "pulls": TextureBuffer(device, np.zeros((3 * _JOINTS, 4), np.float32), "rgba32f"),
            "places": TextureBuffer(device, points, "rgba32f"),
            "faces": TextureBuffer(device, caster.faces.astype(np.int32), "r32i"),
            "lit": TextureBuffer(device, np.zeros(self._n[1], np.float32), "r32f"),
            "edges": TextureBuffer(device, edges, "rgba32i"),
            "weights": TextureBuffer(device, caster.weight.astype(np.int32), "r32i"),
        }
        self._numbers = context.buffer(reserve=4 * 24 * self._n[2])
        self._asked = context.query(primitives=True)
        self._target = context.simple_framebuffer((1, 1))  # some is needed, though nothing is drawn
        self._passes = [
            self._make(name, varyings)
            for name, varyings in (("skin", ["place", "normal"]), ("lit", ["is_lit"]),
                                   ("sides", ["number"]))
        ]  # fmt: skip
        self._arrays = [context.vertex_array(program, []) for program in self._passes]

    def _make(self, name: str, varyings: list[str]) -> Any:
        folder = resources.files("umbra_benchmarks") / "shaders"
        texts = {"vertex_shader": (folder / f"{name}.vert.glsl").read_text("utf-8")}
        if name == "sides":
            texts["geometry_shader"] = (folder / f"{name}.geom.glsl").read_text("utf-8")
        return self._device.context.program(**texts, varyings=varyings)

    def pose(self, places: NDArray[np.float64]) -> None:
        """Find the points, normals and sides of a pose, and wait for them."""
        device, tables = self._device, self._tables
        pulls = (places[self._skin.joints] @ self._skin.inverse_bind)[:, :3]
        self._target.use()
        tables["pulls"].write(pulls.reshape(-1, 4).astype(np.float32))
        into = (tables["places"]._buffer, tables["lit"]._buffer, self._numbers)
        for program, array, buffer, count in zip(
            self._passes, self._arrays, into, self._n, strict=True
        ):
            device.gl.UseProgram(program.glo)
            for unit, name in enumerate(name for name in tables if name in program):
                tables[name].bind(unit)
                device.gl.Uniform1i(program[name].location, unit)
            if "light" in program:
                program["light"] = tuple(_LIGHT)
            with self._asked:
                array.transform(buffer, mode=_POINTS, vertices=count)
        device.gl.Finish()

    def upload(self, posed: _ProcessorPoser) -> None:
        """Upload what the processor found, and wait for it."""
        mesh = posed.mesh
        assert mesh.normals is not None
        points = np.zeros((2 * len(mesh.vertices), 4), np.float32)
        points[::2, :3], points[1::2, :3] = mesh.vertices, mesh.normals
        self._tables["places"].write(points)
        self._numbers.write(posed.sides)
        self._device.gl.Finish()

    def read_sides(self) -> NDArray[np.uint32]:
        """Return the sides of the last pose, (n, 6)."""
        size = 4 * self._asked.primitives
        return np.frombuffer(self._numbers.read(size), np.uint32).reshape(-1, 6)

    def release(self) -> None:
        """Free all."""
        for table in self._tables.values():
            table.release()
        for one in (*self._arrays, *self._passes, self._numbers, self._target):
            one.release()
