"""
Lit faces for up to 64 lights at once, and silhouettes by brute force.

Brute force tests every edge. The lit bits of both faces are read once per edge for all lights, so
the gather, which dominates the cost for one light, is paid once for 64. Edges in no silhouette are
dropped; each light then tests the rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import find_lowest, kernel, run_shared, take_next
from umbra.scene.derived import derive
from umbra.volume.adjacency import Caster

__all__ = ["LIGHTS_AT_ONCE", "Silhouettes", "ask_every_edge", "find_lit", "find_sides"]

LIGHTS_AT_ONCE = 64
_BLOCK = 512  # faces whose planes stay in the L1 cache for all lights
_GROUP = 64  # faces whose normals are bounded together: neighbours, alike in smooth meshes
_MANY_FACES = 20_000  # from which groups are tested first
_FLAT = 1e-250  # square of a normal's length, so small that it may have lost its direction
_ROUNDING = 1e-9  # far above the rounding of a unit normal's product with a light


def find_lit(
    planes: NDArray[np.float64],
    lights: NDArray[np.float64],
    lit: NDArray[np.unsignedinteger],
    edge_on: NDArray[np.uint64],
) -> None:
    """
    Find the faces lit by each light; a face whose plane contains the light is unlit.

    Planes (4, n_faces) are outward normals and offsets, lights (n_lights, 4) homogeneous, at most
    64. Writes ``lit`` (n_faces,), bit k set where light k lights the face, and ``edge_on``
    (n_blocks,), bit k set where light k sees some face of the block of 512 exactly edge-on.
    """
    run_shared(len(edge_on), _find_lit, planes, lights, lit, edge_on)


@kernel
def _find_lit(planes, lights, lit, edge_on, taken):
    """Find the lit faces of one block after another."""
    n = planes.shape[1]
    none = lit.dtype.type(0)
    while True:
        block = take_next(taken)
        if block >= edge_on.size:
            return
        low = block * _BLOCK
        high = min(n, low + _BLOCK)
        x = planes[0, low:high]
        y = planes[1, low:high]
        z = planes[2, low:high]
        w = planes[3, low:high]
        bits = lit[low:high]
        for i in range(high - low):
            bits[i] = 0
        flat = np.uint64(0)
        for k in range(lights.shape[0]):
            l0, l1, l2, l3 = lights[k, 0], lights[k, 1], lights[k, 2], lights[k, 3]
            bit = np.uint64(1) << np.uint64(k)
            mark = lit.dtype.type(bit)
            zeros = 0
            for i in range(high - low):
                side = x[i] * l0 + y[i] * l1 + z[i] * l2 + w[i] * l3
                bits[i] |= mark if side > 0.0 else none
                zeros += 1 if side == 0.0 else 0
            if zeros > 0:
                flat |= bit
        edge_on[block] = flat


@kernel
def _bound_normals(planes, low, high):
    """Bound the unit normals of each group of faces; without limit where one has no direction."""
    n = planes.shape[1]
    for group in range(low.shape[0]):
        low[group, :] = np.inf
        high[group, :] = -np.inf
        for i in range(group * _GROUP, min(n, group * _GROUP + _GROUP)):
            x, y, z = planes[0, i], planes[1, i], planes[2, i]
            square = x * x + y * y + z * z
            if not (square > _FLAT and square < np.inf):
                low[group, :] = -np.inf
                high[group, :] = np.inf
                break
            scale = 1.0 / np.sqrt(square)
            for k, part in enumerate((x * scale, y * scale, z * scale)):
                low[group, k] = min(low[group, k], part)
                high[group, k] = max(high[group, k], part)


@partial(kernel, boundscheck=False)
def _find_lit_in_groups(planes, low, high, suns, lit, edge_on, taken):
    """
    Find what ``find_lit`` does, for suns (n, 3).

    A group of faces whose normals all face a sun, or all face away from it, is not tested.
    """
    n = planes.shape[1]
    none = np.uint64(0)
    while True:
        block = take_next(taken)
        if block >= edge_on.size:
            return
        flat = np.uint64(0)
        for group in range(
            block * (_BLOCK // _GROUP), min(low.shape[0], (block + 1) * (_BLOCK // _GROUP))
        ):
            first, end = group * _GROUP, min(n, (group + 1) * _GROUP)
            x, y, z = planes[0, first:end], planes[1, first:end], planes[2, first:end]
            bits = lit[first:end]
            facing, open_ = none, none
            for k in range(suns.shape[0]):
                least = most = margin = 0.0
                for j in range(3):
                    at_low, at_high = low[group, j] * suns[k, j], high[group, j] * suns[k, j]
                    least += min(at_low, at_high)
                    most += max(at_low, at_high)
                    margin += _ROUNDING * abs(suns[k, j])
                bit = np.uint64(1) << np.uint64(k)
                facing |= bit if least > margin else none
                open_ |= none if least > margin or most < -margin else bit
            for i in range(end - first):
                bits[i] = facing
            for k in range(suns.shape[0]):
                bit = np.uint64(1) << np.uint64(k)
                if open_ & bit == 0:
                    continue
                zeros = 0
                for i in range(end - first):
                    side = x[i] * suns[k, 0] + y[i] * suns[k, 1] + z[i] * suns[k, 2]
                    bits[i] |= bit if side > 0.0 else none
                    zeros += 1 if side == 0.0 else 0
                if zeros > 0:
                    flat |= bit
        edge_on[block] = flat


def find_sides(planes: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return the side of faces on which a light is: above 0 they are lit, at 0 edge-on.

    Summed as in ``find_lit``, bit for bit. A matrix product would round differently, and caps would
    not match the silhouette for a light almost in a face's plane. ``planes`` are (4, ...), the
    light (4,) or (4, ...).
    """
    sides = planes[0] * light[0]
    for k in (1, 2, 3):
        sides += planes[k] * light[k]
    return sides


_CODES_AT_ONCE = 24_000_000  # at most 96 MB of silhouette edges at a time
_STRETCH = 4096  # edges per work item of a thread
_FEW_ACTIVE = 4  # stretches with so small a share of active edges are listed edge by edge


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """Silhouette edges of a caster for several lights."""

    # (n,) ``edge << 2 | half << 1 | lit``: the multiplicity is the edge's weight, halved if half
    # (only one face of the pair adds), negated if not lit
    codes: NDArray[np.int32]
    starts: NDArray[np.int64]  # (n_lights + 1,) light k owns ``codes[starts[k]:starts[k + 1]]``


def ask_every_edge(
    caster: Caster, lights: NDArray[np.float64]
) -> Iterator[tuple[slice, Silhouettes]]:
    """Find the silhouette edges for (n, 4) lights in the caster's frame, up to 64 at a time."""
    if len(lights) == 1:
        yield slice(0, 1), _ask_for_one(caster, lights)
        return
    n_faces, n_edges = caster.planes.shape[1], len(caster.edges)
    lit = np.zeros(n_faces, np.uint64)
    edge_on = np.zeros((n_faces + 511) // 512, np.uint64)
    edges = np.zeros(n_edges, np.int32)
    masks, first = np.zeros((2, n_edges), np.uint64)
    active = np.zeros((n_edges + _STRETCH - 1) // _STRETCH, np.int64)
    done = 0
    while done < len(lights):
        batch = np.ascontiguousarray(lights[done : done + LIGHTS_AT_ONCE])
        _find_lit_of(caster, batch, lit, edge_on)
        counts = np.zeros((len(batch), len(active)), np.int64)
        run_shared(
            len(active), _find_active, caster.edge_faces, caster.turn, lit, len(batch), edges,
            masks, first, active, counts,
        )  # fmt: skip
        totals = np.cumsum(counts.sum(1))
        n = max(1, int(np.searchsorted(totals, _CODES_AT_ONCE, "right")))
        n = min(n, len(batch))
        # Start of each light's list, and within it of each stretch of edges.
        starts = np.append(0, totals[:n])
        places = np.cumsum(counts[:n], axis=1) - counts[:n] + starts[:-1, None]
        codes = np.zeros(max(int(starts[-1]), 1), np.int32)
        run_shared(len(active), _list_codes, edges, masks, first, active, places, codes)
        flat = int(np.bitwise_or.reduce(edge_on)) if len(edge_on) else 0
        codes, starts = _drop_edge_on(caster, batch[:n], flat, codes, starts)
        yield slice(done, done + n), Silhouettes(codes, starts)
        done += n


def _find_lit_of(
    caster: Caster, lights: NDArray[np.float64], lit: NDArray, edge_on: NDArray[np.uint64]
) -> None:
    """Find the lit faces of a caster, those of a large one under suns in groups."""
    n_faces = len(caster.faces)
    if n_faces < _MANY_FACES or lights[:, 3].any():
        find_lit(caster.planes, lights, lit, edge_on)
        return

    def bound() -> NDArray[np.float64]:
        bounds = np.zeros((2, (n_faces + _GROUP) // _GROUP, 3))
        _bound_normals(caster.planes, *bounds)
        return bounds

    low, high = derive(caster, "normals", None, bound)
    given = caster.planes, low, high, lights[:, :3].copy(), lit, edge_on
    run_shared(len(edge_on), _find_lit_in_groups, *given)


def _ask_for_one(caster: Caster, light: NDArray[np.float64]) -> Silhouettes:
    """Find the silhouette of a single light, (1, 4), without the work shared between lights."""
    n_faces, n_edges = caster.planes.shape[1], len(caster.edges)
    lit = np.zeros(n_faces, np.uint8)
    edge_on = np.zeros((n_faces + 511) // 512, np.uint64)
    find_lit(caster.planes, np.ascontiguousarray(light), lit, edge_on)
    codes = np.zeros(n_edges + 1, np.int32)
    active = np.zeros((n_edges + _STRETCH - 1) // _STRETCH, np.int64)
    run_shared(len(active), _list_for_one, caster.edge_faces, caster.turn, lit, codes, active)
    n = _join_stretches(codes, active)
    flat = int(np.bitwise_or.reduce(edge_on)) if len(edge_on) else 0
    starts = np.array([0, n])
    return Silhouettes(*_drop_edge_on(caster, light, flat, codes[: max(n, 1)].copy(), starts))


@partial(kernel, boundscheck=False)
def _list_for_one(edge_faces, turn, lit, codes, active, taken):
    """List the codes of one light, every stretch's from its own start on."""
    while True:
        stretch = take_next(taken)
        if stretch >= active.size:
            return
        start = stretch * _STRETCH
        n = start
        for edge in range(start, min(edge_faces.shape[0], start + _STRETCH)):
            lit_a = lit[edge_faces[edge, 0]]
            lit_b = lit[edge_faces[edge, 1]]
            codes[n] = np.int32(edge) << 2 | lit_a
            n += lit_a ^ lit_b ^ turn[edge]
        active[stretch] = n - start


@partial(kernel, boundscheck=False)
def _join_stretches(codes, active):
    """Close the gaps between the codes of stretches; return the number of codes."""
    n = 0
    for stretch in range(active.size):
        start = stretch * _STRETCH
        for i in range(start, start + active[stretch]):
            codes[n] = codes[i]
            n += 1
    return n


@partial(kernel, boundscheck=False)
def _find_active(edge_faces, turn, lit, n_lights, edges, masks, first, active, counts, taken):
    """
    Find the edges that are in some light's silhouette, in stretches of edges.

    Stretch j writes its ``active[j]`` edges from index j * _STRETCH on: the edge, the lights in
    whose silhouette it is, and the lights that light its first face. The numbers of edges go to
    ``counts[light, stretch]``. Candidates are always written and the index advances by 0 or 1: no
    mispredicted branches.
    """
    wanted = np.uint64(0xFFFFFFFFFFFFFFFF)
    if n_lights < 64:
        wanted = (np.uint64(1) << np.uint64(n_lights)) - np.uint64(1)
    while True:
        stretch = take_next(taken)
        if stretch >= active.size:
            return
        start = stretch * _STRETCH
        n = np.uint64(start)  # unsigned indices need no test of their sign
        for edge in range(start, min(edge_faces.shape[0], start + _STRETCH)):
            lit_a = lit[np.uint64(edge_faces[edge, 0])]
            lit_b = lit[np.uint64(edge_faces[edge, 1])]
            turned = np.uint64(0) - np.uint64(turn[edge])  # all bits where turned
            bits = (lit_a ^ lit_b ^ turned) & wanted
            edges[n] = edge
            masks[n] = bits
            first[n] = lit_a
            n += np.uint64(bits != 0)
        active[stretch] = np.int64(n) - start
        if active[stretch] * _FEW_ACTIVE < _STRETCH:
            for i in range(start, np.int64(n)):
                bits = masks[i]
                while bits:
                    counts[find_lowest(np.int64(bits)), stretch] += 1
                    bits &= bits - np.uint64(1)
            continue
        for k in range(n_lights):
            m = np.uint64(0)
            for i in range(start, np.int64(n)):
                m += (masks[i] >> np.uint64(k)) & np.uint64(1)
            counts[k, stretch] = m


@partial(kernel, boundscheck=False)
def _list_codes(edges, masks, first, active, places, codes, taken):
    """Write each light's codes, every stretch from ``places[light, stretch]`` on."""
    while True:
        stretch = take_next(taken)
        if stretch >= active.size:
            return
        start = stretch * _STRETCH
        if active[stretch] * _FEW_ACTIVE < _STRETCH:
            cursor = places[:, stretch].copy()
            for i in range(start, start + active[stretch]):
                bits = masks[i]
                while bits:
                    k = find_lowest(np.int64(bits))
                    bits &= bits - np.uint64(1)
                    # Of the last lights there may be no room for the codes.
                    if k < cursor.size:
                        is_lit = np.int32((first[i] >> np.uint64(k)) & np.uint64(1))
                        codes[cursor[k]] = (edges[i] << 2) | is_lit
                        cursor[k] += 1
            continue
        picked = np.zeros(active[stretch], np.int32)
        for k in range(places.shape[0]):
            light = np.uint64(k)
            m = 0
            for i in range(start, start + active[stretch]):
                is_lit = np.int32((first[i] >> light) & np.uint64(1))
                picked[m] = (edges[i] << 2) | is_lit
                m += np.int64((masks[i] >> light) & np.uint64(1))
            offset = places[k, stretch]
            for i in range(m):
                codes[offset + i] = picked[i]


def _drop_edge_on(
    caster: Caster,
    lights: NDArray[np.float64],
    flat: int,
    codes: NDArray[np.int32],
    starts: NDArray[np.int64],
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """
    Remove the contribution of open faces that a light sees exactly edge-on.

    Their volumes are flat, but an unlit face of an open component adds -1, which rounding could
    show at pixels on the flat volume. Rare, so done separately.
    """
    if not flat or caster.is_closed.all():
        return codes, starts
    is_open = np.append(~caster.face_is_closed, False)
    a, b = caster.edge_faces.T
    lists = []
    for k in range(len(lights)):
        own = codes[starts[k] : starts[k + 1]]
        if flat >> k & 1:
            light = lights[k]
            side = find_sides(caster.planes, light)
            edge_on = (side == 0) & is_open
            single = np.flatnonzero(edge_on[a] ^ edge_on[b])
            own = own[~(edge_on[a] | edge_on[b])[own >> 2]]
            # The face that still adds: a in its own direction; b opposite to a along the edge if
            # the pair is consistently wound, else the same.
            lit = np.where(
                edge_on[b[single]],
                side[a[single]] > 0,
                (side[b[single]] > 0) == caster.turn[single],
            )
            own = np.concatenate([own, (single << 2 | 2 | lit).astype(np.int32)])
        lists.append(own)
    ends = np.cumsum([len(part) for part in lists])
    return np.concatenate([*lists, np.zeros(1, np.int32)]), np.append(0, ends)
