"""
Silhouette edges of groups of suns, in square bins of light space.

All components follow the open rule, so the count at a point is the number of faces between it and
the sun. Multiplicities of edges with the same ends are summed.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.sun_groups import find_groups, unite_silhouettes
from umbra.kernels import inlined, kernel, run_shared, take_next
from umbra.rays.lanes import LANES
from umbra.volume.adjacency import Caster
from umbra.volume.half_edges import find_roots
from umbra.volume.silhouette import find_silhouettes

__all__ = ["EdgeBinner", "Edges", "SunBins", "clamp"]

_SLACK = 1e-6  # bins: an edge within this distance of another bin is in both
_EDGES = 16  # mean edges per bin: eight are tested at once
_MOST_BINS = 4096  # along a side
_SLOPE = 1e-6  # above rounding of a slope
_COARSE = 2.0**-9  # bins: above float32's rounding of a coordinate in bins


class Edges(NamedTuple):
    """
    Unique edges of a caster.

    A shell is a set of casting faces that share no edge with other faces: the number of its faces
    between a point and the sun changes only across its own silhouette edges.

    Parameters
    ----------
    ends : (n_edges, 6) float64
        Both end points [m].
    shell : (n_edges,) int32
        Shell of each edge.
    face_shell : (n_faces,) int32
        Shell of each face of the caster.
    """

    ends: NDArray[np.float64]
    shell: NDArray[np.int32]
    face_shell: NDArray[np.int32]


class SunBins(NamedTuple):
    """
    Silhouette edges of several suns, in bins for each group of neighbouring suns.

    Parameters
    ----------
    suns : (n_suns, 3) float64
        Unit directions toward the suns, group after group.
    first : (n_groups + 1,) int64
        First sun of each group.
    number : (n_suns,) int64
        Of each sun in its group, from 0 on.
    basis : (n_groups, 9) float64
        Two axes across the group's middle direction, and that direction.
    spread : (n_groups, 6) float64
        Least and greatest slopes of the suns along both axes from that direction, 0 or beyond;
        least sine of a sun's altitude; and depth of the casters along that direction [m].
    grid : (n_groups, 4) float64
        Lowest corner of the bins, least coordinate of the casters toward the middle [m], and bins
        per metre.
    shape : (n_groups, 5) int64
        Columns, rows, index of the group's first bin in ``starts``, its first edge, and its first
        multiplicity.
    starts : (n_bins,) int64
        First entry of each bin; the end follows a group's last bin.
    united : (n,) int64
        For each edge of a group a bit for each of its suns in whose silhouette it is.
    changes : (n_changes,) int16
        Its multiplicities under each of the group's suns, side by side.
    entries : (entries, 3) int32
        The edge, its index in the group, and its shell: side by side, as the processor waits for
        memory more than it computes.
    table : (entries + LANES, 5) float32
        Lowest and highest x [bins], lowest and highest y within the bin's row, and greatest
        coordinate toward the middle, above the least [m]; in Fortran order.
    most : int
        Greatest number of edges of a group.
    top : float
        Highest z of the casters [m].
    """

    suns: NDArray[np.float64]
    first: NDArray[np.int64]
    number: NDArray[np.int64]
    basis: NDArray[np.float64]
    spread: NDArray[np.float64]
    grid: NDArray[np.float64]
    shape: NDArray[np.int64]
    starts: NDArray[np.int64]
    united: NDArray[np.int64]
    changes: NDArray[np.int16]
    entries: NDArray[np.int32]
    table: NDArray[np.float32]
    most: int
    top: float

    @property
    def bytes(self) -> int:
        """Memory of the arrays."""
        return sum(array.nbytes for array in self[:-2])


class EdgeBinner:
    """
    Unique edges of a caster, sorted into bins for each sun.

    Parameters
    ----------
    caster : Caster
    room : int
        Memory for bins that are kept for the next counter under the same suns [byte].
    """

    def __init__(self, caster: Caster, room: int = 0) -> None:
        self._room, self._kept = room, dict[bytes, SunBins]()
        self.caster = caster.opened(np.ones(len(caster.is_closed), np.bool_))
        pairs = self.caster.edges.astype(np.int64)
        key = pairs[:, 0] << 32 | pairs[:, 1]
        _, first, group = np.unique(key, return_index=True, return_inverse=True)
        order = np.argsort(first)  # neighbours stay close in memory
        rank = np.zeros(len(order), np.int32)
        rank[order] = np.arange(len(order))
        self._group = rank[group.ravel()]
        # Components with an edge in common are connected by way of the edge.
        n = len(self.caster.is_closed)
        one, two = self.caster.component[self.caster.edge_faces.T]
        ways = n + self._group
        roots = find_roots(np.append(one, two), np.append(ways, ways), n + len(order))
        shell = roots[self.caster.component]
        self.edges = Edges(
            self.caster.ends()[first[order]],
            shell[self.caster.edge_faces[first[order], 0]],
            shell,
        )
        places = self.edges.ends.reshape(-1, 3)
        empty = np.zeros((1, 3))
        self._low = (places if len(places) else empty).min(0)
        self._high = (places if len(places) else empty).max(0)

    def bin(self, suns: NDArray[np.float64], first: NDArray[np.int64] | None = None) -> SunBins:
        """
        Sort the silhouettes of several suns into bins.

        Parameters
        ----------
        suns : (n, 3) float64
            Unit directions toward the sun.
        first : (n_groups + 1,) int64, optional
            First sun of each group of neighbours; without it suns that follow one another are
            grouped.
        """
        key = suns.tobytes()
        if key in self._kept:
            return self._kept[key]
        bins = self._bin(suns, find_groups(suns, in_order=True)[1] if first is None else first)
        # Pieces take the suns in the same order: what is kept first is of most use.
        if bins.bytes <= self._room - sum(kept.bytes for kept in self._kept.values()):
            self._kept[key] = bins
        return bins

    def forget(self) -> None:
        """Free the bins that are kept."""
        self._kept.clear()

    def _bin(self, suns: NDArray[np.float64], first: NDArray[np.int64]) -> SunBins:
        """Find the suns' silhouettes and sort those of each group into bins."""
        edge, change, begin = self._find(suns)
        n = len(first) - 1
        lengths, united = np.zeros(n, np.int64), np.zeros(len(edge), np.int32)
        of_suns, place = np.zeros(len(edge), np.int64), np.zeros(len(edge), np.int32)
        run_shared(
            n,
            unite_silhouettes,
            edge,
            begin,
            first,
            len(self.edges.ends),
            lengths,
            united,
            of_suns,
            place,
        )
        held = [np.arange(a, a + m) for a, m in zip(begin[first[:-1]], lengths, strict=True)]
        own = np.concatenate([np.zeros(0, np.intp), *held])
        united, of_suns = united[own], of_suns[own]
        size = np.diff(first)
        row = np.append(0, np.cumsum(lengths * size))
        changes = np.zeros(row[-1], np.int16)
        number = np.arange(len(suns)) - np.repeat(first[:-1], size)
        of_sun = np.repeat(np.arange(len(suns)), np.diff(begin))
        of_group = np.repeat(np.arange(n), size)[of_sun]
        changes[row[of_group] + place * size[of_group] + number[of_sun]] = change
        basis, spread = _find_bases(suns, first)
        bounds = np.stack([self._low, self._high])
        corners = np.array([[bounds[i >> k & 1, k] for k in range(3)] for i in range(8)])
        x, y, z = (corners @ basis[:, 3 * k : 3 * k + 3].T for k in range(3))
        wide, high = np.ptp(x, 0), np.ptp(y, 0)
        spread[:, 5] = np.ptp(z, 0)
        side = np.sqrt(np.maximum(wide * high, 1e-9) * _EDGES / np.maximum(lengths, 1))
        cols = np.clip(np.ceil(wide / side), 1, _MOST_BINS).astype(np.int64)
        rows = np.clip(np.ceil(high / side), 1, _MOST_BINS).astype(np.int64)
        side = np.maximum(np.maximum(wide / cols, high / rows) * (1 + 1e-9), 1e-9)
        grid = np.stack([x.min(0), y.min(0), z.min(0), 1 / side], 1)
        ends = np.append(0, np.cumsum(cols * rows + 1))
        shape = np.stack([cols, rows, ends[:-1], np.cumsum(lengths) - lengths, row[:-1]], 1)
        starts = np.zeros(ends[-1], np.int64)
        totals = np.zeros(n, np.int64)
        filled = _make_entries(0)
        given = (self.edges.ends, self.edges.shell, united, lengths, basis, grid, shape, starts)
        run_shared(n, _fill, *given, totals, *filled)
        base = np.append(0, np.cumsum(totals))
        filled = _make_entries(int(base[-1]))
        if base[-1]:
            run_shared(n, _fill, *given, base, *filled)
        return SunBins(
            suns, first, number, basis, spread, grid, shape, starts, of_suns, changes, *filled,
            int(lengths.max(initial=1)), float(self._high[2]),
        )  # fmt: skip

    def _find(
        self, suns: NDArray[np.float64]
    ) -> tuple[NDArray[np.int32], NDArray[np.int16], NDArray[np.int64]]:
        """Find the suns' silhouettes: edges, multiplicities, and first index of each sun."""
        lights = np.concatenate([suns, np.zeros((len(suns), 1))], 1)
        edges, changes, lengths = [], [], [np.zeros(1, np.int64)]
        for _, found in find_silhouettes(self.caster, lights):
            edge = np.zeros(len(found.codes), np.int32)
            change = np.zeros(len(found.codes), np.int16)
            kept = np.zeros(len(found.starts) - 1, np.int64)
            run_shared(
                len(kept), _merge, found.codes, found.starts, self.caster.weight, self._group,
                len(self.edges.ends), edge, change, kept,
            )  # fmt: skip
            for first, n in zip(found.starts[:-1], kept):
                edges.append(edge[first : first + n])
                changes.append(change[first : first + n])
            lengths.append(kept)
        nothing = np.zeros(0, np.int32)
        return (
            np.concatenate([nothing, *edges]),
            np.concatenate([nothing.astype(np.int16), *changes]),
            np.cumsum(np.concatenate(lengths)),
        )


def _find_bases(
    suns: NDArray[np.float64], first: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Find the axes of each group, and the spread of its suns; see ``SunBins``."""
    middle = np.add.reduceat(suns, first[:-1], axis=0) if len(suns) else suns
    middle = middle / np.maximum(np.linalg.norm(middle, axis=1), 1e-300)[:, None]
    flat = np.hypot(middle[:, 0], middle[:, 1])
    across = np.stack([-middle[:, 1], middle[:, 0], np.zeros(len(middle))], 1)
    across /= np.maximum(flat, 1e-300)[:, None]
    across[flat <= 1e-12] = (1.0, 0.0, 0.0)
    upward = np.cross(middle, across)
    spread = np.zeros((len(middle), 6))
    for g, (a, b) in enumerate(pairwise(first)):
        own = suns[a:b]
        for k, axis in enumerate((across[g], upward[g])):
            slope = (own @ axis) / (own @ middle[g])
            spread[g, 2 * k] = min(slope.min(), 0.0) - _SLOPE
            spread[g, 2 * k + 1] = max(slope.max(), 0.0) + _SLOPE
        spread[g, 4] = own[:, 2].min()
    return np.concatenate([across, upward, middle], 1), spread


def _make_entries(n: int) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Allocate entries and their table."""
    return np.zeros((n, 3), np.int32), np.zeros((n + LANES, 5), np.float32, order="F")


@kernel
def _merge(codes, starts, weight, group, n_groups, edge, change, kept, taken):
    """Sum the multiplicities of edges with the same ends; keep nonzero sums."""
    while True:
        s = take_next(taken)
        if s >= starts.size - 1:
            return
        sums = np.zeros(n_groups, np.int16)
        for q in range(starts[s], starts[s + 1]):
            m = np.int64(weight[codes[q] >> 2]) >> ((codes[q] >> 1) & 1)
            sums[group[codes[q] >> 2]] += m if codes[q] & 1 else -m
        n = starts[s]
        for q in range(starts[s], starts[s + 1]):
            g = group[codes[q] >> 2]
            if sums[g] != 0:
                edge[n] = g
                change[n] = sums[g]
                sums[g] = 0
                n += 1
        kept[s] = n - starts[s]


@inlined
def clamp(x, n):
    """Return the bin that contains x, or the nearest of n bins."""
    return np.int64(min(max(np.floor(x), 0.0), n - 1.0))


@kernel
def _fill(
    ends, shell, united, lengths, basis, grid, shape, starts, base, entries, table, taken
):  # fmt: skip
    """Count the entries of each bin into ``starts`` and ``base``, then write them."""
    write = entries.size > 0
    while True:
        s = take_next(taken)
        if s >= basis.shape[0]:
            return
        cols, rows, begin, first, _ = shape[s]
        gx, gy, gz, scale = grid[s]
        b0, b1, b2 = basis[s, 0], basis[s, 1], basis[s, 2]
        b3, b4, b5 = basis[s, 3], basis[s, 4], basis[s, 5]
        b6, b7, b8 = basis[s, 6], basis[s, 7], basis[s, 8]
        cursor = np.zeros(cols * rows if write else 0, np.int64)
        if write:
            for i in range(cols * rows + 1):
                starts[begin + i] += base[s]
                if i < cols * rows:
                    cursor[i] = starts[begin + i]
        for o in range(lengths[s]):
            e = united[first + o]
            x0 = (b0 * ends[e, 0] + b1 * ends[e, 1] + b2 * ends[e, 2] - gx) * scale
            y0 = (b3 * ends[e, 0] + b4 * ends[e, 1] + b5 * ends[e, 2] - gy) * scale
            x1 = (b0 * ends[e, 3] + b1 * ends[e, 4] + b2 * ends[e, 5] - gx) * scale
            y1 = (b3 * ends[e, 3] + b4 * ends[e, 4] + b5 * ends[e, 5] - gy) * scale
            near = max(
                b6 * ends[e, 0] + b7 * ends[e, 1] + b8 * ends[e, 2],
                b6 * ends[e, 3] + b7 * ends[e, 4] + b8 * ends[e, 5],
            )
            # Rounding of the height itself, and float32's of what is kept.
            margin = 1e-3 + 1e-6 * (abs(near) + abs(near - gz))
            near += margin - gz
            if y0 > y1:
                x0, y0, x1, y1 = x1, y1, x0, y0
            slope = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
            j0 = clamp(y0 - _SLACK, rows)
            j1 = clamp(y1 + _SLACK, rows)
            for j in range(j0, j1 + 1):
                a = x0 if j == j0 else x0 + (max(np.float64(j) - _SLACK, y0) - y0) * slope
                c = x1 if j == j1 else x0 + (min(np.float64(j + 1) + _SLACK, y1) - y0) * slope
                i0 = clamp(min(a, c) - _SLACK, cols)
                i1 = clamp(max(a, c) + _SLACK, cols)
                for i in range(i0, i1 + 1):
                    at = j * cols + i
                    if not write:
                        starts[begin + at + 1] += 1
                        continue
                    p = cursor[at]
                    cursor[at] = p + 1
                    entries[p, 0], entries[p, 1], entries[p, 2] = e, o, shell[e]
                    table[p, 0], table[p, 1] = min(a, c) - _COARSE, max(a, c) + _COARSE
                    table[p, 2], table[p, 3] = max(y0, j) - _COARSE, min(y1, j + 1) + _COARSE
                    table[p, 4] = near
        if not write:
            total = 0
            for i in range(cols * rows + 1):
                total += starts[begin + i]
                starts[begin + i] = total
            base[s] = total
