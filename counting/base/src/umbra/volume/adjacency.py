"""
Adjacency of faces at edges, for any triangle soup.

A face *adds* to the shadow count in one of two ways. In a **closed** component (every edge's signed
incidences sum to 0) only lit faces add, by +1. In an **open** component every face adds, turned to
face the light: +1 if lit, -1 along its own winding if not. Both are linear, so the multiplicity of
an edge is the sum over its incident faces of (direction along the edge) x (what the face adds), and
edges of any degree can be split into *pairs* of incidences. A pair of faces (a, b) with a weight w
and a turn bit t then has the multiplicity

    0 if lit(a) ^ lit(b) ^ t == 0, else w if lit(a), else -w

in every case: closed (t = 0, |w| = 1), open and consistently wound (t = 0, |w| = 2), open and
inconsistently wound (t = 1, |w| = 2), a border (b = a, t = 1, |w| = 1). The silhouette kernels
apply this rule alone.

Sources: McGuire et al. 2003, section 6; Kim, Kim, Turk 2008 for multiplicities.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.scene import Scene
from umbra.scene.derived import derive
from umbra.volume.half_edges import HalfEdges, renumber, sort

__all__ = [
    "Caster",
    "find_caster",
    "find_components",
    "find_whole",
    "make_caster",
    "make_planes",
    "sort_along_curve",
    "weld_vertices",
]


@kernel
def _first_at_place(bits, table, first):
    """Fill ``first`` with the lowest index of equal 192 bits (open addressing)."""
    mask = np.uint64(table.size - 1)
    for i in range(bits.shape[0]):
        h = bits[i, 0] * np.uint64(0x9E3779B97F4A7C15)
        h = (h ^ (h >> np.uint64(29)) ^ bits[i, 1]) * np.uint64(0xBF58476D1CE4E5B9)
        h = (h ^ (h >> np.uint64(32)) ^ bits[i, 2]) * np.uint64(0x94D049BB133111EB)
        slot = (h ^ (h >> np.uint64(31))) & mask
        while True:
            j = table[slot]
            if j < 0:
                table[slot] = i
                first[i] = i
                break
            if bits[j, 0] == bits[i, 0] and bits[j, 1] == bits[i, 1] and bits[j, 2] == bits[i, 2]:
                first[i] = j
                break
            slot = (slot + np.uint64(1)) & mask


def weld_vertices(vertices: NDArray[np.float64]) -> NDArray[np.int32]:
    """
    Find for each vertex (n, 3), finite, the first vertex of equal coordinates, (n,).

    Only equal coordinates are welded (-0 equals 0): a tolerance would move walls, and the open rule
    keeps shadows exact across cracks anyway.
    """
    count = len(vertices)
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64).reshape(count, 3)
    table = np.full(1 << max(4, int(2 * count).bit_length()), -1, np.int32)
    first = np.zeros(count, np.int32)
    _first_at_place(bits, table, first)
    return first


@kernel
def _double(edge_faces, component, change, weight):
    """Double the weights of the edges of some components."""
    for edge in range(weight.size):
        if change[component[edge_faces[edge, 0]]]:
            weight[edge] *= 2


@dataclass(frozen=True, eq=False)
class Caster:
    """Triangle mesh prepared to cast shadows, in a local frame [m]."""

    # (n_vertices, 3); vertices of equal coordinates share one index in faces and edges
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]  # (n_faces, 3), sorted so that neighbours are close in memory
    source: NDArray[np.int32]  # (n_faces,) indices in the triangle soup
    # (4, n_faces + 1) normal of twice the face's area, outward, and offset: a face is lit when
    # ``planes[:, f] @ light > 0``; the last column is NaN: never lit, never edge-on
    planes: NDArray[np.float64]
    component: NDArray[np.int32]  # (n_faces,) faces connected by edges share a component
    # (n_components,) whether only a component's lit faces add to the count
    is_closed: NDArray[np.bool_]
    edges: NDArray[np.int32]  # (n_edges, 2) vertices of each pair of faces
    edge_faces: NDArray[np.int32]  # (n_edges, 2) the faces (a, b) of the pair
    turn: NDArray[np.bool_]  # (n_edges,)
    weight: NDArray[np.int8]  # (n_edges,)
    whole: NDArray[np.float64] | None = None  # planes of all faces, if ``without`` left some out

    @property
    def whole_planes(self) -> NDArray[np.float64]:
        """Planes of all faces, whether they cast or not, (4, n_faces + 1) float64."""
        return self.planes if self.whole is None else self.whole

    @cached_property
    def most(self) -> int:
        """The largest multiplicity of an edge."""
        return int(np.abs(self.weight).max(initial=1))

    @property
    def face_is_closed(self) -> NDArray[np.bool_]:
        """Whether each face follows the closed rule, (n_faces,) bool."""
        return self.is_closed[self.component]

    @property
    def is_inward(self) -> NDArray[np.bool_]:
        """Whether each component is wound inward: its signed volume is below 0, (n_components,)."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return np.bincount(self.component, np.einsum("ij,ij->i", a, np.cross(b, c))) < 0

    def ends(self, vertices: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Return both end points of every edge, (n_edges, 6), optionally of moved ``vertices``."""
        points = self.vertices if vertices is None else vertices
        return points.take(self.edges, axis=0).reshape(-1, 6)  # five times as fast as an index

    def opened(self, components: NDArray[np.bool_]) -> "Caster":
        """
        Return the caster with some components under the open rule instead of the closed one.

        In a closed component every pair is consistently wound with weight 1, so counting unlit
        faces as -1 doubles each multiplicity.
        """
        change = components & self.is_closed
        if not change.any():
            return self
        weight = self.weight.copy()
        _double(self.edge_faces, self.component, change, weight)
        return replace(self, is_closed=self.is_closed & ~change, weight=weight)

    def without(self, faces: NDArray[np.intp]) -> "Caster":
        """
        Return the caster without the shadows of some faces, which hold a light.

        They count as edge-on for every light, and their components follow the open rule: the light
        is neither inside nor outside them.
        """
        if not len(faces):
            return self
        planes = self.planes.copy()
        planes[:, faces] = 0.0
        touched = np.zeros(len(self.is_closed), np.bool_)
        touched[self.component[faces]] = True
        return replace(self.opened(touched), planes=planes, whole=self.whole_planes)


def make_caster(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    group: NDArray[np.int32] | None = None,
    *,
    is_welded: bool = False,
) -> Caster:
    """
    Make a caster of a triangle soup: weld vertices, find components, pair faces at edges.

    Closed faces are counter-clockwise seen from outside. Triangles with two equal corners are left
    out: they cast nothing. ``group`` (n_faces,) is the object of each face: an object that is
    closed on its own stays closed even if it touches an open one. ``is_welded`` says that only
    equal indices are one vertex.
    """
    welded = faces if is_welded else weld_vertices(vertices).take(faces)
    source = find_whole(welded)
    source = source[sort_along_curve(vertices.take(welded[source, 0], axis=0))]
    welded = welded.take(source, axis=0)
    half = HalfEdges.of(welded)
    objects = np.zeros(len(source), np.int32) if group is None else group[source]
    component, is_closed = find_components(half, objects)
    edges, edge_faces, turn, weight = half.pair(is_closed[component])
    return Caster(
        vertices=vertices,
        faces=welded,
        source=source,
        planes=make_planes(vertices, welded),
        component=component,
        is_closed=is_closed,
        edges=edges,
        edge_faces=edge_faces,
        turn=turn,
        weight=weight,
    )


def find_whole(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces (n, 3) of three different vertices."""
    a, b, c = faces.T
    return np.flatnonzero((a != b) & (b != c) & (c != a)).astype(np.int32)


def find_components(
    half: HalfEdges, objects: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """
    Find the component of each face, of the object ``objects`` (n_faces,), and which are closed.

    A closed house must not become open because a fence touches it: open components are split by
    object.
    """
    component = half.join(len(objects))
    is_closed = half.find_closed(component)
    loose = ~is_closed[component]
    if loose.any() and objects.any():
        again = half.within(loose, objects).join(len(objects)) + np.int32(len(is_closed))
        component = renumber(np.where(loose, again, component))
        is_closed = half.within(np.ones_like(loose), component).find_closed(component)
    return component, is_closed


def find_caster(scene: Scene, parts: Sequence[int]) -> Caster:
    """Return the caster of some parts, given as indices; made once."""

    def make() -> Caster:
        is_whole = tuple(parts) == tuple(range(len(scene.parts)))
        soup = derive(scene, "soup", None, scene.triangles) if is_whole else scene.triangles(parts)
        return make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])

    return derive(scene, "caster", tuple(parts), make)


def make_planes(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the faces' planes in a caster's layout, (4, n_faces + 1) float64."""
    planes = np.full((4, len(faces) + 1), np.nan)
    _fill_planes(vertices, faces, planes)
    return planes


@kernel
def _fill_planes(vertices, faces, planes):
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        ax, ay, az = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
        bx, by, bz = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        planes[0, f], planes[1, f], planes[2, f] = nx, ny, nz
        planes[3, f] = -(nx * x + ny * y + nz * z)


def sort_along_curve(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Order points (n, 3) along a Morton curve, so that neighbours are close in memory."""
    if len(points) < 2:
        return np.arange(len(points))
    corner = np.ascontiguousarray(points.T)
    low = corner.min(1, keepdims=True)
    cell = max(float((corner.max(1, keepdims=True) - low).max()), 1e-300) / 1023.0
    grid = ((corner - low) / cell).astype(np.uint32)
    code = np.zeros(len(points), np.uint32)
    for axis in range(3):
        code |= _spread_bits(grid[axis]) << np.uint32(2 - axis)
    code = code.view(np.int32)
    order = sort(code & 0x7FFF, np.arange(len(points), dtype=np.int32))
    return sort(code >> 15, order).astype(np.intp)


def _spread_bits(value: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Put two empty bits between each of the lower ten."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        value = (value | (value << np.uint32(shift))) & np.uint32(mask)
    return value
