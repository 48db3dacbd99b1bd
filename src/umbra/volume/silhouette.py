"""
Silhouettes by brute force: every edge asked, for up to 64 lights in one pass.

The lit bits of both faces are read once per edge and serve all lights, so the
gather, which dominates the work for one light, is paid once for 64.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster
from umbra.volume.facing import LIGHTS_AT_ONCE, find_lit

__all__ = ["Silhouettes", "find_silhouette_edges", "find_silhouettes"]

_CODES_AT_ONCE = 24_000_000  # 96 MB of silhouette edges held at a time
_CHUNKS = 32  # independent stretches of edges: enough for any thread count, few enough to count


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """
    The silhouette edges of one caster for some lights.

    Parameters
    ----------
    codes : (n,) int32
        ``edge << 2 | half << 1 | lit``: the multiplicity is the edge's weight,
        halved if half, negated if not lit. (Half: only one face of the pair adds.)
    starts : (n_lights + 1,) int64
        Light k owns ``codes[starts[k]:starts[k + 1]]``.
    """

    codes: NDArray[np.int32]
    starts: NDArray[np.int64]


def find_silhouettes(
    caster: Caster, lights: NDArray[np.float64]
) -> Iterator[tuple[slice, Silhouettes]]:
    """
    Find the silhouette edges for many lights, some lights at a time.

    Parameters
    ----------
    caster : Caster
    lights : (n_lights, 4) float64
        Homogeneous, in the caster's frame.

    Yields
    ------
    which : slice
        Of ``lights``.
    silhouettes : Silhouettes
    """
    n_faces = caster.planes.shape[1]
    lit = np.zeros(n_faces, np.uint64)
    edge_on = np.zeros((n_faces + 511) // 512, np.uint64)
    n_edges = len(caster.edges)
    done = 0
    while done < len(lights):
        batch = np.ascontiguousarray(lights[done : done + LIGHTS_AT_ONCE])
        find_lit(caster.planes, batch, lit, edge_on)
        counts = np.zeros((len(batch), _CHUNKS), np.int64)
        _list_edges(caster.edge_faces, caster.turn, lit, counts, np.zeros(0, np.int32), len(batch))
        totals = np.cumsum(counts.sum(1))
        n = max(1, int(np.searchsorted(totals, _CODES_AT_ONCE, "right")))
        n = min(n, len(batch))
        # Where each light's list starts, and within it each stretch of edges.
        ends = np.cumsum(counts[:n].ravel())
        places = np.concatenate([[0], ends[:-1]]).reshape(n, _CHUNKS)
        starts = np.append(places[:, 0], ends[-1])
        codes = np.zeros(max(int(ends[-1]), 1), np.int32)
        if n_edges:
            _list_edges(caster.edge_faces, caster.turn, lit, places, codes, n)
        flat = int(np.bitwise_or.reduce(edge_on)) if len(edge_on) else 0
        codes, starts = _drop_edge_on(caster, batch[:n], flat, codes, starts)
        yield slice(done, done + n), Silhouettes(codes, starts)
        done += n


def find_silhouette_edges(
    caster: Caster, light: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """
    Find the silhouette of one light as edges with multiplicities.

    Parameters
    ----------
    caster : Caster
    light : (4,) float64
        Homogeneous, in the caster's frame.

    Returns
    -------
    edges : (n, 2) int32
        Vertices, each edge once, wound as in the lit faces for multiplicity > 0.
    multiplicity : (n,) int64
        Never 0. At every vertex those of edges that leave and enter sum to 0.
    """
    (_, found), *_ = find_silhouettes(caster, np.asarray(light, np.float64)[None])
    codes = found.codes[found.starts[0] : found.starts[1]]
    which = codes >> 2
    signed = np.where(codes & 1, 1, -1) * (
        caster.weight[which].astype(np.int64) >> (codes >> 1 & 1)
    )
    pairs, place = np.unique(caster.edges[which], axis=0, return_inverse=True)
    sums = np.zeros(len(pairs), np.int64)
    np.add.at(sums, place.ravel(), signed)
    kept = sums != 0
    edges, sums = pairs[kept], sums[kept]
    return np.where(sums[:, None] > 0, edges, edges[:, ::-1]).astype(np.int32), np.abs(sums)


@njit(cache=True, nogil=True)
def _lowest_bit(bits):
    """Give the place of the lowest set bit of a number that is not 0."""
    place = 0
    if bits & np.uint64(0xFFFFFFFF) == 0:
        place += 32
        bits >>= np.uint64(32)
    if bits & np.uint64(0xFFFF) == 0:
        place += 16
        bits >>= np.uint64(16)
    if bits & np.uint64(0xFF) == 0:
        place += 8
        bits >>= np.uint64(8)
    if bits & np.uint64(0xF) == 0:
        place += 4
        bits >>= np.uint64(4)
    if bits & np.uint64(0x3) == 0:
        place += 2
        bits >>= np.uint64(2)
    if bits & np.uint64(0x1) == 0:
        place += 1
    return place


@njit(cache=True, nogil=True, parallel=True)
def _list_edges(edge_faces, turn, lit, places, codes, n_lights):
    """
    Count silhouette edges per light and stretch, or list them.

    With empty ``codes`` the counts are written to ``places``; else the codes are
    written from ``places[light, stretch]`` on.
    """
    n = edge_faces.shape[0]
    chunks = places.shape[1]
    length = (n + chunks - 1) // chunks
    listing = codes.size > 0
    wanted = np.uint64(0xFFFFFFFFFFFFFFFF)
    if n_lights < 64:
        wanted = (np.uint64(1) << np.uint64(n_lights)) - np.uint64(1)
    for chunk in prange(chunks):
        cursor = np.zeros(64, np.int64)
        if listing:
            for k in range(n_lights):
                cursor[k] = places[k, chunk]
        for edge in range(chunk * length, min(n, chunk * length + length)):
            first = lit[edge_faces[edge, 0]]
            found = first ^ lit[edge_faces[edge, 1]]
            if turn[edge]:
                found = ~found
            found &= wanted
            while found:
                k = _lowest_bit(found)
                if listing:
                    codes[cursor[k]] = (edge << 2) | np.int64(
                        (first >> np.uint64(k)) & np.uint64(1)
                    )
                cursor[k] += 1
                found &= found - np.uint64(1)
        if not listing:
            for k in range(n_lights):
                places[k, chunk] = cursor[k]


def _drop_edge_on(
    caster: Caster,
    lights: NDArray[np.float64],
    flat: int,
    codes: NDArray[np.int32],
    starts: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """
    Let open faces that a light sees exactly edge-on add nothing.

    Their volumes are flat; but an unlit face of an open component adds -1, which
    rounding could show on pixels that lie on the flat volume. Rare, so done apart.
    """
    if not flat or caster.is_closed.all():
        return codes, starts
    is_open = np.append(~caster.face_is_closed, False)
    a, b = caster.edge_faces.T
    lists = []
    for k in range(len(lights)):
        mine = codes[starts[k] : starts[k + 1]]
        if flat >> k & 1:
            side = lights[k] @ caster.planes
            edge_on = (side == 0) & is_open
            one = np.flatnonzero(edge_on[a] ^ edge_on[b])
            mine = mine[~(edge_on[a] | edge_on[b])[mine >> 2]]
            # The face that still adds: a as it stands; b along the edge against a if
            # the pair is consistently wound, along it with a if not.
            lit = np.where(
                edge_on[b[one]], side[a[one]] > 0, (side[b[one]] > 0) == caster.turn[one]
            )
            mine = np.concatenate([mine, (one << 2 | 2 | lit).astype(np.int32)])
        lists.append(mine)
    ends = np.cumsum([len(mine) for mine in lists])
    return np.concatenate([*lists, np.zeros(1, np.int32)]), np.append(0, ends)
