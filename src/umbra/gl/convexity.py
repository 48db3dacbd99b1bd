"""
Which closed components are convex: no ray meets two of their lit faces.

A connected surface of genus 0 is convex if it is so everywhere in the small (van Heijenoort 1952):
each edge, and each vertex, whose fan of faces is then the boundary of a convex cone. Edges alone do
not tell: around the tips of a {5/2} star bipyramid the faces wind twice. All is relative to the
faces at hand, not to the scene: a finely tessellated bowl is flat at the scale of a city.

Geometry of a posed caster, recomputed for each pose of a bending mesh.

Planes, boxes and volumes in one pass over the faces, so that a mesh can bend at every frame.
Adjacency is kept.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import dot, kernel
from umbra.rays.eye_count import BLOCK
from umbra.volume.adjacency import Caster, make_planes

__all__ = ["Balls", "PosedShape", "find_balls", "find_convex", "find_welds", "measure_shape"]

_DENT = 1e-6
"""Sine of the angle by which edges may be concave: float32 files dent flat surfaces."""


@dataclass(frozen=True, eq=False)
class Balls:
    """
    Closed components of genus 0, and their faces.

    Parameters
    ----------
    components : (n,) int
    faces : (n_faces,) int
        Of these components, one after another.
    starts : (n + 1,) int
        The k-th owns ``faces[starts[k]:starts[k + 1]]``.
    """

    components: NDArray[np.intp]
    faces: NDArray[np.intp]
    starts: NDArray[np.intp]

    @classmethod
    def of(cls, caster: Caster, is_ball: NDArray[np.bool_]) -> "Balls":
        """List the faces of a caster's components (n_components,) that are balls."""
        components = np.flatnonzero(is_ball)
        faces = np.flatnonzero(is_ball[caster.component])
        faces = faces[np.argsort(caster.component[faces], kind="stable")]
        starts = np.searchsorted(caster.component[faces], components)
        return cls(components, faces, np.append(starts, len(faces)))


def find_balls(caster: Caster) -> NDArray[np.bool_]:
    """Find the closed components of genus 0."""
    n = len(caster.is_closed)
    a, b = caster.edge_faces.T
    corner = caster.component[:, None] * np.int64(len(caster.vertices)) + caster.faces
    vertices = np.bincount(np.unique(corner) // len(caster.vertices), minlength=n)
    edges = np.bincount(caster.component[a], minlength=n)
    faces = np.bincount(caster.component, minlength=n)
    # An edge of four faces is listed twice: solids that touch along it pass as one.
    ends = np.sort(caster.edges, axis=1).astype(np.int64)
    _, same, times = np.unique(
        ends[:, 0] * len(caster.vertices) + ends[:, 1], return_inverse=True, return_counts=True
    )
    shared = (times > 1)[same.ravel()] | (caster.component[a] != caster.component[b])
    bad = np.bincount(caster.component[a], shared, n)
    return np.asarray(caster.is_closed & (vertices - edges + faces == 2) & (bad == 0))


def find_convex(
    caster: Caster,
    vertices: NDArray[np.float64],
    planes: NDArray[np.float64],
    volumes: NDArray[np.float64],
    balls: Balls,
) -> NDArray[np.bool_]:
    """
    Find the components that are convex, (n_components,) bool.

    Parameters
    ----------
    caster : Caster
    vertices : (n_vertices, 3) float64
        In this pose [m].
    planes : (4, n_faces + 1) float64
        Of the faces, as in ``Caster``.
    volumes : (n_components,) float64
        Six times each component's signed volume [m³].
    balls : Balls
        The components that may be convex.
    """
    is_convex = np.zeros(len(volumes), np.bool_)
    is_convex[balls.components] = volumes[balls.components] > 0.0
    if is_convex.any():
        _check_edges(vertices, caster.faces, caster.component, caster.edges, caster.edge_faces,
                     planes, is_convex)  # fmt: skip
        _check_fans(vertices, caster.faces, planes, balls.components, balls.faces, balls.starts,
                    np.zeros((len(vertices), 7)), is_convex)  # fmt: skip
    return is_convex


@kernel
def _check_edges(vertices, faces, component, edges, edge_faces, planes, is_convex):
    """Drop components where a neighbour rises above a face, or a face has no area."""
    for edge in range(edges.shape[0]):
        a, b = edge_faces[edge, 0], edge_faces[edge, 1]
        if not is_convex[component[a]]:
            continue
        i, j = edges[edge, 0], edges[edge, 1]
        corner = faces[b, 0] + faces[b, 1] + faces[b, 2] - i - j
        # Twice the neighbour's area is its corner's distance from the edge times the edge.
        height, square, other, length = 0.0, 0.0, 0.0, 0.0
        for axis in range(3):
            height += planes[axis, a] * (vertices[corner, axis] - vertices[i, axis])
            square += planes[axis, a] ** 2
            other += planes[axis, b] ** 2
            length += (vertices[j, axis] - vertices[i, axis]) ** 2
        limit = _DENT * np.sqrt(square) * np.sqrt(other / max(length, 1e-300))
        if square == 0.0 or other == 0.0 or height > limit:
            is_convex[component[a]] = False


@kernel
def _check_fans(vertices, faces, planes, components, order, starts, sums, is_convex):
    """
    Drop components where the faces around a vertex do not wind once around a line.

    Each face must look to the same side of the line. ``sums`` (n_vertices, 7) is room: a direction
    each of normals and edges, and how often the fan winds.
    """
    for k in range(components.size):
        if is_convex[components[k]]:
            around = order[starts[k] : starts[k + 1]]
            _find_lines(vertices, faces, planes, around, sums)
            is_convex[components[k]] = _winds_once(vertices, faces, planes, around, sums)


@kernel
def _find_lines(vertices, faces, planes, around, sums):
    """Find a line through each corner of some faces, to whose side these look."""
    for face in around:
        for corner in faces[face]:
            sums[corner] = 0.0
    for face in around:
        for n in range(3):
            i, j = faces[face, n], faces[face, (n + 1) % 3]
            length = 0.0
            for axis in range(3):
                length += (vertices[j, axis] - vertices[i, axis]) ** 2
            length = np.sqrt(length)
            for axis in range(3):  # the normals', and out of all edges
                along = (vertices[j, axis] - vertices[i, axis]) / length
                sums[i, axis] += _find_normal(planes, face, axis)
                sums[i, 3 + axis] -= along
                sums[j, 3 + axis] += along
    for face in around:
        for i in faces[face]:
            if _look(planes, face, sums[i, :3]) <= 0.0:
                sums[i, 6] = np.nan  # a sharp tip: its edges tell its inside
    for face in around:
        for i in faces[face]:
            if np.isnan(sums[i, 6]):
                sums[i, 0], sums[i, 1], sums[i, 2] = sums[i, 3], sums[i, 4], sums[i, 5]
                sums[i, 6] = 0.0


@kernel
def _winds_once(vertices, faces, planes, around, sums):
    """Return whether some faces look along their corners' lines and wind once around each."""
    for face in around:
        for n in range(3):
            i = faces[face, n]
            line = sums[i, :3]
            if _look(planes, face, line) < -_DENT * np.sqrt(dot(line, line)):
                return False
            j, k = faces[face, (n + 1) % 3], faces[face, (n + 2) % 3]
            sums[i, 6] += _cross(line, vertices[i], vertices[j], vertices[k])
    for face in around:
        for corner in faces[face]:
            if sums[corner, 6] != 1.0:
                return False
    return True


@kernel
def _find_normal(planes, face, axis):
    """Return a coordinate of a face's unit normal."""
    x, y, z = planes[0, face], planes[1, face], planes[2, face]
    return planes[axis, face] / np.sqrt(x * x + y * y + z * z)


@kernel
def _look(planes, face, way):
    """Return the length along a face's normal of a vector."""
    length = 0.0
    for axis in range(3):
        length += _find_normal(planes, face, axis) * way[axis]
    return length


@kernel
def _cross(line, corner, first, second):
    """Return how often, 1, 0 or -1, the way between two points crosses a half-plane at a line."""
    x, y, z = line
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        across = 0.0, z, -y
    elif abs(y) <= abs(z):
        across = -z, 0.0, x
    else:
        across = y, -x, 0.0
    up = (
        y * across[2] - z * across[1],
        z * across[0] - x * across[2],
        x * across[1] - y * across[0],
    )
    u, v, height_a, height_b = 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        a, b = first[axis] - corner[axis], second[axis] - corner[axis]
        u += a * across[axis]
        v += b * across[axis]
        height_a += a * up[axis]
        height_b += b * up[axis]
    if (height_a >= 0.0) == (height_b >= 0.0):
        return 0.0
    if height_b >= 0.0:
        return 1.0 if u * height_b - v * height_a > 0.0 else 0.0
    return -1.0 if u * height_b - v * height_a < 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class PosedShape:
    """
    Geometry of a posed caster.

    Parameters
    ----------
    planes : (4, n_faces + 1) float64
        As in ``Caster``.
    bounds : (n_components, 2, 3) float64
        Bounds of each component [m].
    blocks : (n_blocks, 6) float64
        As in ``FaceBlocks`` [m].
    volumes : (n_components,) float64
        Six times each component's signed volume [m³].
    is_convex : (n_components,) bool
        Of the balls that were asked about.
    """

    planes: NDArray[np.float64]
    bounds: NDArray[np.float64]
    blocks: NDArray[np.float64]
    volumes: NDArray[np.float64]
    is_convex: NDArray[np.bool_]


def measure_shape(caster: Caster, vertices: NDArray[np.float64], balls: Balls) -> PosedShape:
    """Measure a caster with vertices (n_vertices, 3) float64 in its own frame [m]."""
    n_faces, n_components = len(caster.faces), len(caster.is_closed)
    planes = make_planes(vertices, caster.faces)
    bounds = np.zeros((n_components, 2, 3))
    bounds[:, 0], bounds[:, 1] = np.inf, -np.inf
    blocks = np.zeros((-(-n_faces // BLOCK), 6))
    volumes = np.zeros(n_components)
    _measure_faces(vertices, caster.faces, caster.component, planes, bounds, blocks, volumes)
    is_convex = find_convex(caster, vertices, planes, volumes, balls)
    return PosedShape(planes, bounds, blocks, volumes, is_convex)


@kernel
def _measure_faces(vertices, faces, component, planes, bounds, blocks, volumes):
    """Write boxes and volumes in one pass over faces."""
    for face in range(faces.shape[0]):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        owner, block = component[face], face // BLOCK
        is_first = face % BLOCK == 0
        for axis in range(3):
            p, q, r = vertices[i, axis], vertices[j, axis], vertices[k, axis]
            low, high = min(p, q, r), max(p, q, r)
            bounds[owner, 0, axis] = min(bounds[owner, 0, axis], low)
            bounds[owner, 1, axis] = max(bounds[owner, 1, axis], high)
            blocks[block, axis] = low if is_first else min(blocks[block, axis], low)
            blocks[block, 3 + axis] = high if is_first else max(blocks[block, 3 + axis], high)
        volumes[owner] -= planes[3, face]


def find_welds(caster: Caster, soup: NDArray[np.int32]) -> NDArray[np.int64]:
    """
    Find the pairs of vertices (n, 2) that must coincide for the adjacency to hold.

    ``soup`` (n, 3) are the source faces of the caster, before vertices were welded.
    """
    given = soup[caster.source]
    apart = given != caster.faces
    return np.unique(np.stack([given[apart], caster.faces[apart]], 1), axis=0).astype(np.int64)
