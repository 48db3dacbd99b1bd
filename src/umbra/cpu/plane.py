"""
Shadow counts on a horizontal plane: crossings and a prefix sum, no fill.

Each silhouette edge projects along the light onto the plane as a segment. Going up a column of
cells, the count changes by the edge's multiplicity where the column crosses the segment; a sum over
the rows gives every cell its count. Vertices are projected once and rows are rounded up (half
open), so every closed chain of edges leaves the count beyond it unchanged.
"""

from dataclasses import replace

import numpy as np
from numba import get_thread_id, njit, prange
from numpy.typing import NDArray

from umbra.cpu.sweep import Sweep, bound_counts
from umbra.scene.derived import derive
from umbra.scene.grid import ASIDE, Grid
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import Silhouettes

__all__ = ["PlaneSweep", "clip_above"]

_WRAPPED = 255  # largest count for which a wrapped 8-bit sum is 0 only for 0


def clip_above(caster: Caster, height: float) -> Caster:
    """
    Clip a caster to the half space strictly above z = height.

    Every edge that crosses the plane is cut once, and every face that crosses it gets a new edge
    along the cut, with the multiplicity that the face adds, so chains of edges stay closed in any
    triangle soup. Faces keep their planes; faces wholly below stay, without edges. ``faces`` is
    unchanged.
    """
    z = caster.vertices[:, 2]
    above = z > height
    if above.all() or not len(caster.edges):
        return caster
    above_first, above_second = above[caster.edges].T
    kept = np.flatnonzero(above_first | above_second)
    crossed = np.flatnonzero(above_first != above_second)

    # One cut point for each pair of vertices, shared by all its edges.
    def key(a: NDArray, b: NDArray) -> NDArray[np.int64]:
        return (np.minimum(a, b).astype(np.int64) << 32) | np.maximum(a, b)

    cuts, place = np.unique(key(*caster.edges[crossed].T), return_inverse=True)
    a, b = (cuts >> 32).astype(np.int64), (cuts & 0xFFFFFFFF).astype(np.int64)
    low, high = np.where(above[a], b, a), np.where(above[a], a, b)
    along = (height - z[low]) / (z[high] - z[low])
    points = caster.vertices[low] + along[:, None] * (caster.vertices[high] - caster.vertices[low])
    points[:, 2] = height
    n = len(caster.vertices)

    edges = caster.edges.copy()
    edges[crossed, above_first[crossed].astype(np.intp)] = n + place

    # The new edge of a face runs from where its outline goes below to where it returns.
    cut, leaves, enters = _find_cut_faces(caster.faces, above)
    cut_edges = n + np.stack([np.searchsorted(cuts, key(*m)) for m in (leaves, enters)], 1)
    closed = caster.face_is_closed[cut]
    partner = np.where(closed, len(caster.faces), cut)  # the last plane is never lit
    return replace(
        caster,
        vertices=np.concatenate([caster.vertices, points]),
        edges=np.concatenate([edges[kept], cut_edges.astype(np.int32)]),
        edge_faces=np.concatenate(
            [caster.edge_faces[kept], np.stack([cut, partner], 1).astype(np.int32)]
        ),
        turn=np.concatenate([caster.turn[kept], ~closed]),
        weight=np.concatenate([caster.weight[kept], np.ones(len(cut), np.int8)]),
    )


@njit(cache=True, nogil=True)
def _find_cut_faces(faces, above):
    """Return faces with corners on both sides, and where their outlines go below and return."""
    cut = np.zeros(faces.shape[0], np.int64)
    count = 0
    for f in range(faces.shape[0]):
        a, b, c = above[faces[f, 0]], above[faces[f, 1]], above[faces[f, 2]]
        if a != b or b != c:
            cut[count] = f
            count += 1
    leaves = np.zeros((2, count), np.int32)
    enters = np.zeros((2, count), np.int32)
    for i in range(count):
        for k in range(3):
            tail, head = faces[cut[i], k], faces[cut[i], (k + 1) % 3]
            if above[tail] and not above[head]:
                leaves[0, i], leaves[1, i] = tail, head
            elif above[head] and not above[tail]:
                enters[0, i], enters[1, i] = tail, head
    return cut[:count], leaves, enters


class PlaneSweep(Sweep):
    """
    Count shadows on the plane z = height, one sun at a time.

    Parameters
    ----------
    caster : Caster
    grid : Grid
        In the caster's frame.
    height : float
        The plane's z [m].
    threads : int
    """

    narrow = np.int8

    def __init__(self, caster: Caster, grid: Grid, height: float, threads: int = 1) -> None:
        def cut() -> tuple[Caster, NDArray[np.float64]]:
            clipped = derive(caster, "clip", height, lambda: clip_above(caster, height))
            # Offset from cell centres, so that edges along the raster miss the sample points.
            placed = grid.to_cells(clipped.vertices, ASIDE)
            placed[:, 2] -= height
            opened = _open_where_negative(clipped, placed, grid)
            return opened, opened.ends(placed)

        opened, self.ends = derive(caster, "cut", (grid, height), cut)
        super().__init__(opened, grid, threads)

    def _run(
        self,
        found: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        out: NDArray,
        masks: NDArray,
        count_type: type,
    ) -> NDArray[np.bool_]:
        grid = self.grid
        diff = self._buffer("diff", (self.threads, grid.rows + 1, grid.cols), count_type)
        slope = suns[:, :2] / suns[:, 2:] / (grid.dx, grid.dy)
        too_deep = np.zeros(len(suns), np.bool_)
        _sweep(
            self.ends, self.caster.weight, found.codes, found.starts, slope, which,
            (grid.row, grid.col), diff, out, masks, too_deep,
        )  # fmt: skip
        return too_deep


def _open_where_negative(caster: Caster, placed: NDArray[np.float64], grid: Grid) -> Caster:
    """
    Open the components for which the closed rule could miss a shadow.

    ``placed`` holds the vertices as (column, row, height above the plane [m]).

    Lit minus unlit faces above a point is its winding number, and lit faces alone separate shadow
    from light only where it is not negative: not inside a house that is wound inward
    (docs/papers.md, S1). The plane cuts the closed components in a polygon of this winding number,
    so one count of it suffices.
    """
    n_faces = len(caster.faces)
    cut = np.flatnonzero(caster.edge_faces[:, 1] == n_faces)
    if not len(cut):
        return caster
    ends = placed.take(caster.edges.take(cut, axis=0), axis=0).reshape(-1, 6)
    starts = np.array([0, len(cut)])
    winding = np.zeros((1, grid.rows, grid.cols), np.int32)
    diff = np.zeros((1, grid.rows + 1, grid.cols), np.int32)
    codes = (np.arange(len(cut)) << 2 | 1).astype(np.int32)
    nothing = np.zeros((1, 1, 1), np.uint8)
    _sweep(
        ends, caster.weight[cut], codes, starts, np.zeros((1, 2)), np.zeros(1, np.int64),
        (grid.row, grid.col), diff, nothing, winding, np.zeros(1, np.bool_),
    )  # fmt: skip
    if winding.min() >= 0:
        return caster
    # If each component is wound consistently, only negative ones can be at fault.
    inward = caster.is_inward
    rest = caster.opened(inward)
    if inward.any() and (rest.is_closed != caster.is_closed).any():
        return _open_where_negative(_reclip(rest), placed, grid)
    return _reclip(caster.opened(np.ones_like(caster.is_closed)))


def _reclip(caster: Caster) -> Caster:
    """Apply the open rule to the cut edges of opened components."""
    n_faces = len(caster.faces)
    a, b = caster.edge_faces.T
    opened = (b == n_faces) & ~caster.face_is_closed[a]
    edge_faces = caster.edge_faces.copy()
    edge_faces[opened, 1] = a[opened]
    weight = caster.weight.copy()
    weight[opened] = 1
    return replace(caster, edge_faces=edge_faces, turn=caster.turn | opened, weight=weight)


@njit(cache=True, nogil=True, boundscheck=False)
def _scatter(ends, weight, codes, slope_x, slope_y, corner, diff, load):
    """
    Add each edge's multiplicity where it crosses columns.

    ``corner`` holds the row and column of the raster at which ``diff`` begins.
    Returns the first row that may hold a crossing, the end row, and a bound of all counts; -1 if a
    single crossing may overflow ``diff``.
    """
    row, col = corner
    end = col + diff.shape[1]
    low = np.float64(row)
    top = np.float64(row + diff.shape[0] - 1)
    deepest = 0
    half = np.int64(1) << (8 * diff.itemsize - 1)
    spill = np.int64(0)
    lowest, highest = top, low
    for q in range(codes.size):
        code = codes[q]
        e = code >> 2
        m = np.int64(weight[e]) >> ((code >> 1) & 1)
        if code & 1 == 0:
            m = -m
        x0 = ends[e, 0] - ends[e, 2] * slope_x
        y0 = ends[e, 1] - ends[e, 2] * slope_y
        x1 = ends[e, 3] - ends[e, 5] * slope_x
        y1 = ends[e, 4] - ends[e, 5] * slope_y
        if x0 > x1:
            x0, x1 = x1, x0
            y0, y1 = y1, y0
            m = -m
        c0 = np.int64(min(max(np.ceil(x0), np.float64(col)), np.float64(end)))
        c1 = np.int64(min(max(np.ceil(x1), np.float64(col)), np.float64(end)))
        if c0 >= c1:
            continue
        rise = (y1 - y0) / (x1 - x0)
        # Most edges lie within the raster and need no clamping of rows.
        if min(y0, y1) >= low and max(y0, y1) <= top - 1.0:
            for c in range(c0, c1):
                r = np.int64(np.ceil(y0 + (c - x0) * rise)) - row
                held = diff[r, c - col] + m
                diff[r, c - col] = held
                spill |= held + half
        else:
            for c in range(c0, c1):
                r = np.int64(np.ceil(min(max(y0 + (c - x0) * rise, low), top))) - row
                held = diff[r, c - col] + m
                diff[r, c - col] = held
                spill |= held + half
        lowest = min(lowest, y0, y1)
        highest = max(highest, y0, y1)
        load[c0 - col] += abs(m)
        load[c1 - col] -= abs(m)
        deepest += abs(m)
    # One row more on each side, for rounding.
    first = np.int64(max(lowest - 1.0, low)) - row
    last = np.int64(min(highest + 2.0, top)) - row
    # Crossings of a closed chain in a column sum to 0: half of them count up.
    depth = bound_counts(load, deepest, 2 * _WRAPPED) // 2
    return first, last, depth if 0 <= spill < 2 * half else -1


@njit(cache=True, nogil=True, boundscheck=False)
def _sum_steps(diff, first, last, level, out):
    """
    Sum columns over a range of rows; add 1 to every cell in shadow; reset ``diff`` to 0.

    Sums may wrap around: only 0 must differ from the rest.
    """
    for r in range(first, last):
        d = diff[r]
        o = out[r]
        for c in range(o.size):
            level[c] += d[c]
            d[c] = 0
            o[c] += level[c] != 0


@njit(cache=True, nogil=True, boundscheck=False)
def _sum_counts(diff, first, last, out):
    """Sum columns over a range of rows into ``out``, which is 0; reset ``diff`` to 0."""
    level = np.zeros(diff.shape[1], np.int32)
    for r in range(first, last):
        d = diff[r]
        o = out[r]
        for c in range(o.size):
            level[c] += d[c]
            d[c] = 0
            o[c] = level[c]


@njit(cache=True, nogil=True, parallel=True, boundscheck=False)
def _sweep(ends, weight, codes, starts, slope, which, corner, diff, out, counts, too_deep):
    """
    Count ``which`` suns, in each thread's buffers.

    Steps in shadow are added to ``out[thread]``; if there are as many ``counts`` as suns, counts
    are written there instead.
    """
    keep = counts.shape[0] == slope.shape[0]
    for q in prange(which.size):
        t = get_thread_id()
        s = which[q]
        mine = codes[starts[s] : starts[s + 1]]
        cols = diff.shape[2]
        load = np.zeros(cols + 1, np.int64)
        first, last, depth = _scatter(
            ends, weight, mine, slope[s, 0], slope[s, 1], corner, diff[t], load
        )
        if depth < 0:
            too_deep[s] = True
            diff[t, :, :] = 0
        elif keep:
            _sum_counts(diff[t], first, last, counts[s])
        elif depth <= _WRAPPED:
            _sum_steps(diff[t], first, last, np.zeros(cols, np.int8), out[t])
        else:
            _sum_steps(diff[t], first, last, np.zeros(cols, np.int32), out[t])
