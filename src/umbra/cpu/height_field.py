"""
Shadow counts on a height field: the topmost surface of a plan.

A ray from the zenith starts in no shadow volume while the sun is up, so a point's count is the
signed number of volume sides above it: z-pass, without caps, right for every closed or open caster
(its winding number at a topmost point is that of the sky, 0). Each silhouette edge sweeps a side
away from the sun down to the lowest receiver; a row of cells crosses it in one span, along which
the side's height is affine.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.raster_sweep import Sweep, bound_counts
from umbra.cpu.simd_loops import FEW_LANES, add_below
from umbra.kernels import borrowing, copy_rows, inner, kernel, run_shared, take_next
from umbra.scene.derived import derive
from umbra.scene.grid import ASIDE, Grid
from umbra.volume.adjacency import Caster
from umbra.volume.facing import find_lit
from umbra.volume.silhouette import Silhouettes

__all__ = ["HeightFieldSweep", "Slopes"]

# Fixed lengths, so that loops become vectors.
_LANES = 32  # cells compared at once
_AHEAD = 16  # edges whose ends are read at once: waits for memory overlap
_MOST = 0.9  # share of edges in use from which all are kept: a copy takes memory
_BLOCK = 32  # rows and columns of cells whose least height is kept
_LONG = 48  # rows or columns from which a side's end is looked for
_ROWS = 8  # rows whose first and last cells are found at once
_SPANS = 256  # rows of sides whose cells are compared in one loop
_BELOW = 2.0**-10
"""
Depth below the lowest receiver along a side at which it ends [m]: far above rounding, so that the
end decides for no cell, and shadows do not depend on which other cells are counted with it.
"""


@dataclass(frozen=True, eq=False)
class Slopes:
    """
    Cells whose surface can face away from the sun: attached shadow.

    Parameters
    ----------
    cells : (n,) int64
        Flat indices, row * cols + column.
    face : (n,) int32
        Column of ``planes`` for each cell.
    planes : (4, n_faces) float64
        Upward normals; the last row is 0.
    """

    cells: NDArray[np.int64]
    face: NDArray[np.int32]
    planes: NDArray[np.float64]

    @classmethod
    def none(cls) -> "Slopes":
        """Return the slopes of a horizontal surface."""
        return cls(np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros((4, 0)))


class HeightFieldSweep(Sweep):
    """
    Count shadows on the topmost surface, one sun at a time.

    Parameters
    ----------
    caster : Caster
    grid : Grid
        In the caster's frame.
    heights : (rows, cols) float64
        z of the topmost surface, ``ASIDE`` from the centres [m]; no caster may lie above it.
    threads : int
    slopes : Slopes
        Cells in attached shadow count as in shadow in ``add_weights`` and ``masks``.
    """

    narrow = np.int16

    def __init__(
        self,
        caster: Caster,
        grid: Grid,
        heights: NDArray[np.float64],
        threads: int = 1,
        slopes: Slopes | None = None,
    ) -> None:
        floor = float(heights.min()) - _BELOW

        def choose() -> tuple[Caster, NDArray[np.float64]]:
            return _choose_edges(caster, grid.to_cells(caster.vertices, ASIDE), floor)

        used, self.ends = derive(caster, "sides", (grid, floor), choose)
        super().__init__(used, grid, threads)
        self.slopes = slopes or Slopes.none()
        self.floor = floor
        self.heights = np.ascontiguousarray(heights, np.float64)
        self.lowest = _find_lowest(self.heights)

    def _run(
        self,
        silhouettes: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        weights: NDArray,
        out: NDArray,
        counts: NDArray,
        count_type: type,
    ) -> NDArray[np.bool_]:
        grid = self.grid
        beyond = -(-_LANES // grid.cols)  # rows for lanes after the last cell, never counted
        shape = self.threads, grid.rows + beyond, grid.cols
        level = self._buffer("level", shape, count_type)
        away = np.ascontiguousarray(suns / (grid.dx, grid.dy, 1.0))
        too_deep = np.zeros(len(suns), np.bool_)
        run_shared(
            len(which), _sweep, self.ends, self.caster.weight, silhouettes.codes,
            silhouettes.starts, away, which, self.heights, self.lowest, self.floor,
            (grid.row, grid.col), self.slopes.cells, self.slopes.face,
            self._face_sun(suns), level, weights, out, counts, too_deep,
        )  # fmt: skip
        return too_deep

    def _attach(self, suns: NDArray[np.float64], masks: NDArray[np.uint8]) -> None:
        for mask, away in zip(masks, self.is_turned_away(suns), strict=True):
            mask.ravel()[self.slopes.cells[away]] = 1

    def is_turned_away(self, suns: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether sloping cells face away from each sun, (n_suns, n_slopes) bool."""
        bits = self._face_sun(suns)[self.slopes.face]
        return (bits >> np.arange(len(suns), dtype=np.uint64)[:, None] & np.uint64(1)) == 0

    def _face_sun(self, suns: NDArray[np.float64]) -> NDArray[np.uint64]:
        """Return a bit mask of the suns that light each sloping face."""
        lit = np.zeros(self.slopes.planes.shape[1], np.uint64)
        lights = np.append(suns, np.zeros((len(suns), 1)), 1)
        find_lit(self.slopes.planes, lights, lit, np.zeros(len(lit) // 512 + 1, np.uint64))
        return lit


def _find_lowest(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least height of each block of cells."""
    for axis in (0, 1):
        heights = np.minimum.reduceat(heights, np.arange(0, heights.shape[axis], _BLOCK), axis)
    return heights


def _choose_edges(
    caster: Caster, placed: NDArray[np.float64], floor: float
) -> tuple[Caster, NDArray[np.float64]]:
    """
    Return the ends of edges, with vertices placed in cells.

    Edges whose sides hold no cell under any sun are left out: upright, or below the floor.
    """
    (x0, x1), (y0, y1), (z0, z1) = (axis.take(caster.edges.T) for axis in placed.T)
    used = np.flatnonzero(((z0 > floor) | (z1 > floor)) & ((x0 != x1) | (y0 != y1)))
    if len(used) <= _MOST * len(caster.edges):
        names = "edges", "edge_faces", "turn", "weight"
        caster = replace(caster, **{n: getattr(caster, n).take(used, axis=0) for n in names})
    return caster, caster.ends(placed)


@partial(borrowing, boundscheck=False, fastmath={"nsz", "nnan"})
def _add_spans(listed, n, tops, held):
    """
    Add multiplicities to the cells below sides.

    Rows of ``listed`` (6, n): the first cell, as a place in memory; the number of cells; its
    column, the side's height where x is 0, its slope along x, and the multiplicity. Places are
    unsigned, so that their sign needs no test.
    """
    for i in range(n):
        cell, rest, m = np.uint64(listed[0, i]), np.int64(listed[1, i]), np.int64(listed[5, i])
        x, at, slope = listed[2, i], listed[3, i], listed[4, i]
        if rest <= 1:  # also rows without cells: cheaper than a mispredicted branch
            cell = cell if rest > 0 else np.uint64(0)
            is_below = tops[cell] < at + slope * x
            held[cell] += m if is_below & (rest > 0) else 0
        elif cell + np.uint64(rest + _LANES) > np.uint64(tops.size):
            for t in range(rest):  # lanes would read beyond the last cell
                is_below = tops[cell + np.uint64(t)] < at + slope * (x + t)
                held[cell + np.uint64(t)] += m if is_below else 0
        elif rest <= FEW_LANES:
            add_below(tops, held, cell, at, slope, x, rest, m)
        else:
            for _ in range(0, rest, _LANES):
                for t in range(_LANES):
                    is_below = tops[cell + np.uint64(t)] < at + slope * (x + t)
                    held[cell + np.uint64(t)] += m if is_below & (t < rest) else 0
                rest -= _LANES
                cell += np.uint64(_LANES)
                x += _LANES


@partial(borrowing, boundscheck=False, fastmath={"nsz", "nnan"})
def _find_end(edge, kx, ky, floor, lowest, box):
    """
    Return the height below which all cells along a side lie above it, so that it may end there.

    ``edge`` holds x, y, z of both ends; ``lowest`` (rows, cols) the least heights of blocks, and
    ``box`` west, south, east and north of them all. The side is followed up toward its edge from
    where it leaves the raster, a block at a time.
    """
    x0, y0, z0, x1, y1, z1 = edge
    top = max(z0, z1)
    west, south, east, north = box
    # The side is at x + kx * z, y + ky * z.
    x0, x1, y0, y1 = x0 - z0 * kx, x1 - z1 * kx, y0 - z0 * ky, y1 - z1 * ky
    least_x, most_x = min(x0, x1) - 1.0, max(x0, x1) + 1.0
    least_y, most_y = min(y0, y1) - 1.0, max(y0, y1) + 1.0
    z = floor
    if kx != 0.0:
        z = max(z, (west - most_x if kx > 0.0 else east - least_x) / kx)
    if ky != 0.0:
        z = max(z, (south - most_y if ky > 0.0 else north - least_y) / ky)
    step = _BLOCK / max(abs(kx), abs(ky))
    while z < top:
        up = min(z + step, top)
        r0 = np.int64(max(least_y + min(z * ky, up * ky) - south, 0.0)) // _BLOCK
        r1 = np.int64(min(most_y + max(z * ky, up * ky), north - 1.0) - south) // _BLOCK
        c0 = np.int64(max(least_x + min(z * kx, up * kx) - west, 0.0)) // _BLOCK
        c1 = np.int64(min(most_x + max(z * kx, up * kx), east - 1.0) - west) // _BLOCK
        least = np.inf
        for r in range(r0, r1 + 1):
            for c in range(c0, c1 + 1):
                least = min(least, lowest[r, c])
        if least - _BELOW < up:
            return max(z, least - _BELOW)
        z = up
    return z


@partial(kernel, inline="always")
def _lay_out(x0, y0, az, x1, y1, bz, kx, ky, end, box):
    """Return a side's far corners if it ends at a height, its first and end rows and columns."""
    west, south, east, north = box
    drop0 = max(az - end, 0.0)
    drop1 = max(bz - end, 0.0)
    x2 = x0 - drop0 * kx
    y2 = y0 - drop0 * ky
    x3 = x1 - drop1 * kx
    y3 = y1 - drop1 * ky
    low = min(min(y0, y1), min(y2, y3))
    high = max(max(y0, y1), max(y2, y3))
    r0 = np.int64(np.ceil(min(max(low, south), north)))
    r1 = np.int64(np.ceil(min(max(high, south), north)))
    # Lines that nearly coincide may cross anywhere: stay within the corners.
    least = max(np.floor(min(min(x0, x1), min(x2, x3))), west)
    most = min(np.ceil(max(max(x0, x1), max(x2, x3))), east)
    return x2, y2, x3, y3, r0, r1, least, most


@partial(inner, boundscheck=False, fastmath={"nsz", "nnan"})
def _fill(ends, weight, codes, sx, sy, sz, heights, lowest, floor, corner, level, load):
    """Add each side's multiplicity to the cells below it; True if counts could overflow."""
    row, col = corner
    rows, width = heights.shape
    south, north = np.float64(row), np.float64(row + rows)
    west, east = np.float64(col), np.float64(col + width)
    box = west, south, east, north
    kx = sx / sz
    ky = sy / sz
    touched = 0.0  # never NaN; it keeps the compiler from leaving the reading out
    tops, held = heights.reshape(-1), level.reshape(-1)
    # One array: the compiler makes no vectors of a loop over many that might overlap.
    listed = np.empty((6, _SPANS + _ROWS))
    n = 0
    for q in range(codes.size):
        if q % _AHEAD == 0:
            for near in codes[q : q + _AHEAD]:
                touched += ends[np.uint64(near >> 2), 0] + ends[np.uint64(near >> 2), 5]
        code = codes[q]
        e = np.uint64(code >> 2)
        az = ends[e, 2]
        bz = ends[e, 5]
        x0 = ends[e, 0]
        y0 = ends[e, 1]
        x1 = ends[e, 3]
        y1 = ends[e, 4]
        if (az <= floor) & (bz <= floor):
            continue
        ex = x1 - x0
        ey = y1 - y0
        up = ex * sy - ey * sx  # z of the side's normal, edge x sun
        if up == 0.0:
            continue  # seen edge-on
        m = np.int64(weight[e]) >> ((code >> 1) & 1)
        if (code & 1 == 0) != (up < 0.0):
            m = -m
        # The side's other end: the edge's shadow on the floor, or where all cells lie above it.
        x2, y2, x3, y3, r0, r1, least, most = _lay_out(x0, y0, az, x1, y1, bz, kx, ky, floor, box)
        if (r0 >= r1) | (least >= most):
            continue
        if max(np.float64(r1 - r0), most - least) > _LONG:
            end = _find_end((x0, y0, az, x1, y1, bz), kx, ky, floor, lowest, box)
            if end >= max(az, bz):
                continue
            x2, y2, x3, y3, r0, r1, least, most = _lay_out(x0, y0, az, x1, y1, bz, kx, ky, end, box)
        # Each bounding line is x = p + q * y, computed from a vertex and a direction that
        # neighbours share. Its direction decides whether it is a left or a right bound.
        p_l0 = p_l1 = p_l2 = least
        p_r0 = p_r1 = p_r2 = most
        q_l0 = q_l1 = q_l2 = q_r0 = q_r1 = q_r2 = 0.0
        if y0 != y1:
            k = ex / ey
            p = x0 - y0 * k
            is_left = (up > 0.0) == (ey > 0.0)
            p_l0, q_l0 = (p, k) if is_left else (least, 0.0)
            p_r0, q_r0 = (most, 0.0) if is_left else (p, k)
        if ky != 0.0:
            k = kx / ky
            at_first = x0 - y0 * k
            at_second = x1 - y1 * k
            is_left = (up > 0.0) == (sy > 0.0)
            p_l1 = at_first if is_left else at_second
            p_r1 = at_second if is_left else at_first
            q_l1 = q_r1 = k
        if y2 != y3:
            k = (x3 - x2) / (y3 - y2)
            p = x2 - y2 * k
            is_left = (up > 0.0) != (y3 > y2)
            p_l2, q_l2 = (p, k) if is_left else (least, 0.0)
            p_r2, q_r2 = (most, 0.0) if is_left else (p, k)
        # The side's height is z + gx * x + gy * y, from its normal.
        gx = (sz * ey - (bz - az) * sy) / -up
        gy = ((bz - az) * sx - sz * ex) / -up
        base = az - gx * x0 - gy * y0
        load[r0 - row] += abs(m)
        load[r1 - row] -= abs(m)
        for top in range(r0, r1, _ROWS):
            if n >= _SPANS:
                _add_spans(listed, n, tops, held)
                n = 0
            start = np.float64((top - row) * width - col)
            spans = listed[:, n : n + _ROWS]
            for i in range(_ROWS):
                y = np.float64(top + i)
                left = max(max(p_l0 + q_l0 * y, p_l1 + q_l1 * y), p_l2 + q_l2 * y)
                right = min(min(p_r0 + q_r0 * y, p_r1 + q_r1 * y), p_r2 + q_r2 * y)
                first = np.ceil(min(max(left, least), most))
                spans[0, i] = start + i * np.float64(width) + first
                spans[1, i] = np.ceil(min(max(right, least), most)) - first
                spans[2, i] = first
                spans[3, i] = base + gy * y
                spans[4, i] = gx
                spans[5, i] = m
            n += min(r1 - top, _ROWS)
    _add_spans(listed, n, tops, held)
    limit = 32_767 if level.itemsize == 2 else 2_147_483_647
    return bound_counts(load) > limit or touched == np.inf


@partial(borrowing, boundscheck=False)
def _add_up(level, weights, sums, cells, face, lit, sun):
    """Add a sun's ``weights`` (k,) to the ``sums`` (k, rows, cols) of every cell in shadow."""
    for q in range(cells.size):
        if (lit[face[q]] >> np.uint64(sun)) & np.uint64(1) == 0:
            level[cells[q] // sums.shape[2], cells[q] % sums.shape[2]] = 1  # attached
    nothing = weights[0] - weights[0]
    for r in range(sums.shape[1]):
        n = level[r]
        for k in range(1, weights.size):
            o, w = sums[k, r], weights[k]
            for c in range(o.size):
                o[c] += w if n[c] != 0 else nothing
        o, w = sums[0, r], weights[0]
        for c in range(o.size):
            o[c] += w if n[c] != 0 else nothing
            n[c] = 0


@partial(kernel, boundscheck=False)
def _sweep(
    ends, weight, codes, starts, away, which, heights, lowest, floor, corner, cells, face, lit,
    level, weights, out, counts, too_deep, taken,
):  # fmt: skip
    """Count ``which`` suns as the plane's sweep does, in this thread's buffers."""
    keep = counts.shape[0] == away.shape[0]
    t, q = take_next(taken[1:]), take_next(taken)
    while q < which.size:
        s = which[q]
        load = np.zeros(heights.shape[0] + 1, np.int64)
        too_deep[s] = _fill(
            ends, weight, codes[starts[s] : starts[s + 1]],
            away[s, 0], away[s, 1], away[s, 2], heights, lowest, floor, corner, level[t], load,
        )  # fmt: skip
        if keep and not too_deep[s]:
            copy_rows(level[t, : counts.shape[1]], counts[s])
        if keep or too_deep[s]:
            level[t, :, :] = 0
        else:
            _add_up(level[t], weights[s], out[t], cells, face, lit, s)
        q = take_next(taken)
