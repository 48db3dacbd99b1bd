"""Cutting casters at a horizontal plane: only geometry above it can shade it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster

__all__ = ["clip_above"]


def clip_above(caster: Caster, height: float) -> Caster:
    """
    Keep what lies strictly above z = height.

    Every edge that crosses the plane is cut once, and every face that crosses it
    gets a new edge along the cut, with the multiplicity that the face adds: the
    chain of edges stays closed on any soup. Faces keep their planes; those wholly
    below are kept too, without edges. ``faces`` is as before, uncut.

    Parameters
    ----------
    caster : Caster
    height : float
        In the caster's frame [m].

    Returns
    -------
    caster : Caster
        With other ``vertices`` and edges.
    """
    z = caster.vertices[:, 2]
    above = z > height
    if above.all() or not len(caster.edges):
        return caster
    first, second = caster.edges.T
    above_first, above_second = above[first], above[second]
    kept = above_first | above_second
    crossed = above_first != above_second

    # One cut point for each pair of vertices, shared by all that meet there.
    def key(a: NDArray, b: NDArray) -> NDArray[np.int64]:
        return (np.minimum(a, b).astype(np.int64) << 32) | np.maximum(a, b)

    cuts = np.unique(key(first[crossed], second[crossed]))
    a, b = (cuts >> 32).astype(np.int64), (cuts & 0xFFFFFFFF).astype(np.int64)
    low, high = np.where(above[a], b, a), np.where(above[a], a, b)
    along = (height - z[low]) / (z[high] - z[low])
    points = caster.vertices[low] + along[:, None] * (caster.vertices[high] - caster.vertices[low])
    points[:, 2] = height
    n = len(caster.vertices)

    place = n + np.searchsorted(cuts, key(first, second))
    edges = np.stack(
        [
            np.where(crossed & ~above_first, place, first),
            np.where(crossed & ~above_second, place, second),
        ],
        1,
    )[kept]

    # A face that crosses leaves the upper side once and comes back once: the new
    # edge runs from where it leaves to where it comes back.
    up = above[caster.faces]
    cut = np.flatnonzero(up.any(1) & ~up.all(1))
    corner, ahead = caster.faces[cut], np.roll(caster.faces[cut], -1, 1)
    leaves = up[cut] & ~np.roll(up[cut], -1, 1)
    enters = ~up[cut] & np.roll(up[cut], -1, 1)
    cut_edges = n + np.stack(
        [np.searchsorted(cuts, key(corner[m], ahead[m])) for m in (leaves, enters)], 1
    )
    closed = caster.face_is_closed[cut]
    partner = np.where(closed, len(caster.faces), cut)  # the last plane is never lit
    return replace(
        caster,
        vertices=np.concatenate([caster.vertices, points]),
        edges=np.concatenate([edges, cut_edges]).astype(np.int32),
        edge_faces=np.concatenate(
            [caster.edge_faces[kept], np.stack([cut, partner], 1).astype(np.int32)]
        ),
        turn=np.concatenate([caster.turn[kept], ~closed]),
        weight=np.concatenate([caster.weight[kept], np.ones(len(cut), np.int8)]),
    )
