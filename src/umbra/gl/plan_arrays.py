"""
A light's plan as plain arrays: vertices doubled, triangles by pass, stencil operations.

For any graphics API, and without one: nothing here draws. A pass needs no more than
``clip = matrix @ vertices[index]``, its depth test and its stencil operations, which wrap.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from umbra.gl.geometry import PointTable
from umbra.gl.planner import Planner
from umbra.gl.projection import CameraProjection
from umbra.gl.selection import VolumeOptions
from umbra.gl.volume_plan import LIGHT_CAP, Z_PASS, Draw, VolumePlan
from umbra.scene import Light, Scene
from umbra.scene.mesh import transform_points

if TYPE_CHECKING:
    from umbra.gl.context import Device
    from umbra.gl.geometry import Geometry
    from umbra.gl.resources import Indices

__all__ = ["ArrayPlanner", "PlannedVolumes", "VolumePass", "list_arrays", "place_points"]


@dataclass
class ArrayDevice:
    """What a planner asks of a device, where there is none."""

    reverses_depth: bool = True
    renderer: str = "arrays"


class IndexArray:
    """Index list in memory, in place of ``Indices``."""

    def __init__(self, _device: object, n_vertices: int) -> None:
        self.dtype = np.dtype(np.uint32)
        self.first_nearby = n_vertices // 2
        self.numbers: NDArray[np.uint32] = np.zeros(0, np.uint32)
        self.nearby: NDArray[np.float64] = np.zeros((0, 2, 3))

    def widen(self, _n_nearby: int) -> np.dtype:
        """Return the type of vertex numbers."""
        return self.dtype

    def write(self, *lists: NDArray, nearby: NDArray[np.float64] | None = None) -> None:
        """Replace the list by others (n,), joined, and the points near lights (n, 2, 3)."""
        self.numbers = np.concatenate([np.zeros(0, np.uint32), *lists]).astype(np.uint32)
        self.nearby = np.zeros((0, 2, 3)) if nearby is None else nearby

    def release(self) -> None:
        """Free the lists."""
        self.write()


@dataclass(frozen=True, eq=False)
class VolumePass:
    """
    Triangles that are counted alike.

    Parameters
    ----------
    kind : {'z_pass', 'z_fail', 'light_cap'}
    first, count : int
        Range of `PlannedVolumes.indices`.
    depth_test : {'less', 'never'}
        With ``less`` for nearer, whichever way depth runs; depth is not written.
    front, back : (str, str)
        Stencil operation of a triangle wound counter-clockwise, and of another, where the depth
        test fails and where it passes: ``keep``, ``up`` or ``down``, which wrap.
    clamps_depth : bool
        Draw beyond the near and far planes, at their depths.
    """

    kind: str
    first: int
    count: int
    depth_test: str
    front: tuple[str, str]
    back: tuple[str, str]
    clamps_depth: bool


@dataclass(frozen=True, eq=False)
class PlannedVolumes:
    """
    One light's shadow volumes.

    Parameters
    ----------
    matrix : (4, 4) float32
        To the clip space, for column vectors.
    vertices : (n, 4) float32
        Homogeneous, relative to the eye: each point, then its far end; w = 0 at infinity.
    indices : (m,) uint32
        Three to a triangle, wound outward.
    passes : tuple of VolumePass
    start : int
        What the stencil is cleared to, modulo 256.
    near : (2,) float32
        Factors of z and w: ``near @ (z, w)`` is a clip distance that every pass needs.
    deepest : int
        Upper bound of the counts; beyond 255 count in floats.
    scissor : (int, int, int, int), optional
        Left, bottom, columns, rows [pixels] that the light's range and cone reach, row 0 lowest.
    depth_bounds : (float, float), optional
        Lowest and highest depth of that, from 0 to 1.
    """

    matrix: NDArray[np.float32]
    vertices: NDArray[np.float32]
    indices: NDArray[np.uint32]
    passes: tuple[VolumePass, ...]
    start: int
    near: NDArray[np.float32]
    deepest: int
    scissor: tuple[int, int, int, int] | None = None
    depth_bounds: tuple[float, float] | None = None


_KEEP = "keep"


def place_points(table: PointTable, eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """Place the points of a scene, (n_points, 3) relative to the eye; numbers in no use are 0."""
    places = np.zeros((table.n_points, 3))
    for group in table.groups:
        vertices = group.vertices
        if group.transform is not None:
            vertices = transform_points(table.placed[group.parts[0]], vertices)
        places[group.first : group.first + len(vertices)] = vertices - eye
    return places


def list_arrays(plan: VolumePlan, table: PointTable, listed: IndexArray) -> PlannedVolumes:
    """
    List a plan's arrays.

    Parameters
    ----------
    plan : VolumePlan
        One of the planner's last.
    table : PointTable
    listed : IndexArray
        The planner's.
    """
    eye = plan.projection.eye
    near = listed.nearby
    places = np.concatenate([place_points(table, eye), near[:, 0] - eye])
    away = plan.light[3] * places - plan.light[:3]
    away[len(places) - len(near) :] = near[:, 1]
    vertices: list[NDArray[np.float64]] = []
    copies: dict[tuple[bool, bool], int] = {}
    indices, passes, first = [listed.numbers[:0]], [], 0
    for draw in plan.draws:
        key = draw.is_cut, draw.is_low
        if key not in copies:  # ends differ: each kind has its own copy of the vertices
            copies[key] = sum(map(len, vertices))
            vertices.append(_double(places, away, plan, draw))
        numbers = listed.numbers[draw.first : draw.first + draw.count] + np.uint32(copies[key])
        indices.append(numbers)
        passes.append(_make_pass(draw, first, plan))
        first += draw.count
    uniforms = plan.projection.uniforms
    behind, constant = uniforms["near_plane"]  # type: ignore[misc]
    return PlannedVolumes(
        matrix=plan.projection.clip_matrix.astype(np.float32),
        vertices=np.concatenate([np.zeros((0, 4)), *vertices]).astype(np.float32),
        indices=np.concatenate(indices),
        passes=tuple(passes),
        start=plan.start & 0xFF,
        near=np.array([behind, constant + uniforms["before"]], np.float32),
        deepest=plan.statistics.deepest,
    )


class ArrayPlanner:
    """
    A planner whose plans are arrays.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int, optional
        Indices of the parts that cast; all by default.
    ground : float, optional
        z of a receiving plane, relative to the scene's origin [m].

    Attributes
    ----------
    planner : Planner
    table : PointTable
    """

    def __init__(
        self, scene: Scene, casters: Sequence[int] | None = None, ground: float | None = None
    ) -> None:
        self.device, self.table = ArrayDevice(), PointTable(scene)
        # Where nothing is drawn a planner asks for no more than these have.
        device, geometry = cast("Device", self.device), cast("Geometry", self.table)
        make_list = cast("Callable[[Device, int], Indices]", IndexArray)
        self.planner = Planner(device, scene, geometry, casters, ground, make_list=make_list)

    def plan(
        self,
        projection: CameraProjection,
        light: Light,
        method: str,
        choices: VolumeOptions,
        warn: Callable[[str], object] = lambda _: None,
    ) -> tuple[VolumePlan, PlannedVolumes]:
        """Plan one light, as `Planner.plan`."""
        (plan,) = self.planner.plan(projection, [light], method, choices=choices, warn=warn)
        listed = cast("IndexArray", self.planner.indices)
        return plan, list_arrays(plan, self.table, listed)


def _double(
    places: NDArray[np.float64], away: NDArray[np.float64], plan: VolumePlan, draw: Draw
) -> NDArray[np.float64]:
    """Return points and far ends in turn, (2 n, 4), as ``place.glsl`` places them."""
    vertices = np.zeros((len(places), 2, 4))
    vertices[:, 0] = np.append(places, np.ones((len(places), 1)), 1)
    if draw.is_low:
        vertices[:, 0] = _cut_at(plan.top, places, away)
    vertices[:, 1, :3] = away
    if draw.is_cut:
        vertices[:, 1] = _cut_at(plan.find_bottom(draw), places, away)
    return vertices.reshape(-1, 4)


def _cut_at(
    height: float, places: NDArray[np.float64], away: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Find where rays that go down are at a height."""
    down = -away[:, 2:]
    return np.append(down * places + (places[:, 2:] - height) * away, down, 1)


def _make_pass(draw: Draw, first: int, plan: VolumePlan) -> VolumePass:
    """Describe a draw: before the surface fronts count up, behind it down (docs/papers.md, M1)."""
    is_before = draw.kind == Z_PASS
    return VolumePass(
        draw.kind, first, draw.count,
        depth_test="never" if draw.kind == LIGHT_CAP else "less",
        front=(_KEEP, "up") if is_before else ("down", _KEEP),
        back=(_KEEP, "down") if is_before else ("up", _KEEP),
        clamps_depth=not is_before or plan.projection.camera.is_perspective,
    )  # fmt: skip
