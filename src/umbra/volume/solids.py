"""
Shadow volumes as closed meshes, cut at level ground.

The volume of some casting faces is what lies between them and their projection onto the ground
along the light. Faces that meet in an edge, one on either side, share it; at every other edge a
side goes down. Corners are numbered by what they hold together, so that each edge has two faces
even where volumes touch in a line or a point.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster
from umbra.volume.half_edges import find_roots, renumber

__all__ = ["Solid", "make_shadow_solid"]


class Solid(NamedTuple):
    """
    A closed mesh, wound outward.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int32
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    @property
    def volume(self) -> float:
        """Signed volume [m3]; where parts of it overlap, they count as often."""
        if not len(self.faces):
            return 0.0
        a, b, c = (self.vertices[self.faces[:, k]] - self.vertices[0] for k in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def make_shadow_solid(caster: Caster, toward: NDArray[np.float64], ground: float) -> Solid:
    """
    Make the shadow volume of a caster below a directional light, down to level ground.

    A closed component casts by its lit faces, so that its own inside is of the volume; of an open
    one all faces cast.

    Parameters
    ----------
    caster : Caster
    toward : (3,) float64
        Unit direction toward the light, above the horizon.
    ground : float
        Height of the ground [m]; what lies below it casts nothing.
    """
    facing = toward @ caster.planes[:3, :-1]
    flip = caster.is_inward[caster.component] & caster.face_is_closed
    facing = np.where(flip, -facing, facing)
    is_cast = np.where(caster.face_is_closed, facing > 0, facing != 0)
    faces = caster.faces[is_cast]
    turned = flip[is_cast] ^ (facing[is_cast] < 0)
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    vertices, faces = _cut(caster.vertices, faces, ground)
    return _close(vertices, faces, toward, ground)


def _cut(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], ground: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Cut faces to what lies above a height; both faces of an edge share the vertex on it."""
    above = vertices[:, 2] >= ground
    faces = faces[(vertices[faces][:, :, 2] > ground).any(1)]
    count = above[faces].sum(1)
    pieces = [faces[count == 3]]
    crossing = faces[(count == 1) | (count == 2)]
    if not len(crossing):
        return vertices, pieces[0]
    # Turn each so that its first corner is alone on its side of the ground.
    alone = above[crossing] == (above[crossing].sum(1) == 1)[:, None]
    first = alone.argmax(1)
    a, b, c = (np.take_along_axis(crossing, (first[:, None] + k) % 3, 1)[:, 0] for k in range(3))
    pairs = np.sort(np.concatenate([np.stack([a, b], 1), np.stack([a, c], 1)]), axis=1)
    unique, number = np.unique(pairs, axis=0, return_inverse=True)
    p, q = vertices[unique[:, 0]], vertices[unique[:, 1]]
    share = (ground - p[:, 2]) / (q[:, 2] - p[:, 2])
    made = p + share[:, None] * (q - p)
    made[:, 2] = ground
    ab, ac = (len(vertices) + number.ravel()).astype(np.int32).reshape(2, -1)
    single = above[a]
    pieces.append(np.stack([a, ab, ac], 1)[single])
    pieces.append(np.stack([ab, b, c], 1)[~single])
    pieces.append(np.stack([ab, c, ac], 1)[~single])
    joined = np.concatenate(pieces).astype(np.int32)
    all_vertices = np.concatenate([vertices, made])
    return all_vertices, joined[(all_vertices[joined][:, :, 2] > ground).any(1)]


def _close(
    vertices: NDArray[np.float64], top: NDArray[np.int32], toward: NDArray[np.float64],
    ground: float,
) -> Solid:  # fmt: skip
    """Return the solid between faces and the ground, each wound upward to the light."""
    n = len(top)
    if not n:
        return Solid(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    used, faces = np.unique(top, return_inverse=True)
    faces, points = faces.reshape(-1, 3), vertices[used]
    foot = points - (points[:, 2:] - ground) / toward[2] * toward
    foot[:, 2] = ground
    rests = points[:, 2] <= ground
    count = len(points)
    below = np.where(rests, np.arange(count), np.arange(count) + count)
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    open_ = np.flatnonzero(_find_open(tail, head, count))
    a, b = tail[open_], head[open_]
    falls = ~(rests[a] & rests[b])
    a, b = a[falls], b[falls]
    sides = np.concatenate([np.stack([b, a, below[a]], 1), np.stack([b, below[a], below[b]], 1)])
    whole = np.concatenate([faces, below[faces[:, ::-1]], sides])
    corner = whole[:, [1, 2, 0]]
    whole = whole[((whole != corner) & (whole != corner[:, [1, 2, 0]])).all(1)]
    return _split(np.concatenate([points, foot]), whole)


def _find_open(tail: NDArray, head: NDArray, count: int) -> NDArray[np.bool_]:
    """Return the half-edges that no reverse one is left for."""
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    keys, edge = np.unique(low.astype(np.int64) * count + high, return_inverse=True)
    forward = tail < head
    number = np.zeros((2, len(keys)), np.int64)  # of half-edges against and along each edge
    np.add.at(number, (forward.astype(np.intp), edge), 1)
    rank = _rank(2 * edge + forward)
    return rank >= number[(~forward).astype(np.intp), edge]


def _rank(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of each key among its equals, from 0 on."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    first = np.flatnonzero(np.diff(ordered, prepend=-1))
    starts = np.repeat(first, np.diff(np.append(first, len(keys))))
    rank = np.zeros(len(keys), np.int64)
    rank[order] = np.arange(len(keys)) - starts
    return rank


def _split(points: NDArray[np.float64], faces: NDArray[np.intp]) -> Solid:
    """Give each corner's fan of faces, joined by pairs of half-edges, a vertex of its own."""
    n = len(faces)
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    corner = np.arange(3 * n).reshape(n, 3)
    at_tail, at_head = corner.ravel(), corner[:, [1, 2, 0]].ravel()
    key = tail.astype(np.int64) * len(points) + head
    back = head.astype(np.int64) * len(points) + tail
    first = np.lexsort((_rank(key), key))
    two = np.lexsort((_rank(back), back))
    # Sorted alike, the k-th half-edge of a direction meets the k-th of the reverse one.
    joined_one = np.concatenate([at_tail[first], at_head[first]])
    joined_two = np.concatenate([at_head[two], at_tail[two]])
    label = renumber(find_roots(joined_one.astype(np.int32), joined_two.astype(np.int32), 3 * n))
    vertices = np.zeros((int(label.max()) + 1, 3))
    vertices[label] = points[faces.ravel()]
    return Solid(vertices, label.reshape(n, 3).astype(np.int32))
