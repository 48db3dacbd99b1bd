"""
Rasteriser of volume sides for any camera: homogeneous quads, filled row by row.

A side is the silhouette edge swept away from the light, to infinity or to the lowest receiver. In
the picture it is an intersection of half planes, even if part of it lies behind the eye, and its
depth key is affine. Where it is nearer than the visible surface it adds its multiplicity: + if it
faces the eye, - if not.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.nearer import add_where_nearer
from umbra.cpu.raster_sweep import bound_counts
from umbra.kernels import borrowing, cross, dot, inlined, kernel, run_shared, take_next
from umbra.rays.depth import NOTHING, STRIPE, DepthBuffer

__all__ = ["SurfaceKeys", "count_sides"]

LANES = 32
TILE = 32
_NOWHERE = 1e300  # a surface nearer than everything: nothing is counted before it
FARTHEST = 1e8
"""Greatest length of a side down to the floor, in distances to the light (for the sun, in m)."""
_COLUMNS = 21  # (p, q) of 4 left and 4 right bounds, the key's 3 factors, first and end column
_BATCH = 32  # sides of a stripe whose rows are found before any is filled


@dataclass(frozen=True, eq=False)
class SurfaceKeys:
    """
    Depth keys of the visible surface, ready for counting.

    ``keys`` (rows, cols + LANES) are nearer than everything where nothing is counted; ``tiles`` are
    the lowest keys, i.e. the farthest surface, in 32 x 32 pixels each: a side with no greater key
    adds nothing there.
    """

    keys: NDArray[np.float64]
    tiles: NDArray[np.float64]

    @classmethod
    def of(cls, view: DepthBuffer) -> "SurfaceKeys":
        """Prepare a view for counting."""
        rows, cols = view.key.shape
        keys = _make_rows(rows, cols + LANES, np.zeros(0))
        tiles = np.full((-(-rows // TILE), -(-cols // TILE)), _NOWHERE)
        run_shared(len(tiles), _prepare, view.key, view.face, keys, tiles)
        return cls(keys, tiles)


@kernel
def _make_rows(rows, cols, kind):
    """Return an array of the type of ``kind`` that a kernel fills."""
    return np.empty((rows, cols), kind.dtype)


@partial(kernel, boundscheck=False)
def _prepare(key, face, keys, tiles, taken):
    """Write a surface's keys and tiles, one row of tiles after another."""
    rows, cols = key.shape
    while True:
        t = take_next(taken)
        if t >= tiles.shape[0]:
            return
        farthest = np.full(cols, _NOWHERE)
        for r in range(t * TILE, min(rows, t * TILE + TILE)):
            for c in range(cols):
                keys[r, c] = key[r, c] if face[r, c] != NOTHING else _NOWHERE
                farthest[c] = min(farthest[c], keys[r, c])
            keys[r, cols:] = _NOWHERE
        for c in range(cols):
            tiles[t, c // TILE] = min(tiles[t, c // TILE], farthest[c])


def count_sides(
    surface: SurfaceKeys,
    ends: NDArray[np.float64],
    codes: NDArray[np.int32],
    weight: NDArray[np.int8],
    matrix: NDArray[np.float64],
    light: NDArray[np.float64],
    floor: float,
    threads: int,
) -> NDArray[np.signedinteger]:
    """
    Sum the multiplicities of the sides in front of the visible surface, in int16 if they fit.

    ``ends`` are (n_edges, 6), ``codes`` a silhouette as in ``Silhouettes``; neither receivers nor
    the eye lie below ``floor``: -inf leaves sides infinite.
    """
    keys = surface.keys
    chunks = max(1, min(threads * 4, len(codes) // 512))
    rows, cols = len(keys), keys.shape[1] - LANES
    quads = _make_rows(len(codes), _COLUMNS, np.zeros(0))
    spans = _make_rows(len(codes), 3, np.zeros(0, np.int64))
    filled = np.zeros(chunks, np.int64)
    given = ends, codes, weight, matrix, light, floor, surface.tiles, (rows, cols)
    run_shared(chunks, _set_up, *given, quads, spans, filled)
    places, listed, deepest = _list_sides(spans, filled, rows)
    kind = np.zeros(0, np.int16 if deepest < 1 << 15 else np.int32)
    counts = _make_rows(rows, keys.shape[1], kind)
    run_shared(len(places) - 1, _fill, quads, spans, places, listed, keys, counts)
    return counts[:, :cols]


@partial(kernel, boundscheck=False)
def _list_sides(spans, filled, rows):
    """Return the sides of each stripe, and a bound on counts."""
    # Offsets in the list of stripes, and the largest sum of multiplicities that share a row.
    chunks = filled.size
    length = (spans.shape[0] + chunks - 1) // chunks
    places = np.zeros((rows + STRIPE - 1) // STRIPE + 1, np.int64)
    load = np.zeros(rows + 1, np.int64)
    for chunk in range(chunks):
        for i in range(chunk * length, chunk * length + filled[chunk]):
            load[spans[i, 0]] += abs(spans[i, 2])
            load[spans[i, 1]] -= abs(spans[i, 2])
            for stripe in range(spans[i, 0] // STRIPE, (spans[i, 1] - 1) // STRIPE + 1):
                places[stripe + 1] += 1
    cursor = np.zeros(places.size, np.int64)
    for stripe in range(1, places.size):
        places[stripe] += places[stripe - 1]
        cursor[stripe] = places[stripe]
    listed = np.empty(places[-1], np.int32)
    for chunk in range(chunks):
        for i in range(chunk * length, chunk * length + filled[chunk]):
            for stripe in range(spans[i, 0] // STRIPE, (spans[i, 1] - 1) // STRIPE + 1):
                listed[cursor[stripe]] = i
                cursor[stripe] += 1
    return places, listed, bound_counts(load)


@inlined
def _project(matrix, x, y, z, first):
    """Transform a point, with ``first`` the matrix's last column, or a direction, with zeros."""
    return (
        first[0] + matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z,
        first[1] + matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z,
        first[2] + matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z,
        first[3] + matrix[3, 0] * x + matrix[3, 1] * y + matrix[3, 2] * z,
    )


@inlined
def _go(p, way, far):
    """Return the point p + far * way, in homogeneous coordinates."""
    return p[0] + far * way[0], p[1] + far * way[1], p[2] + far * way[2], p[3] + far * way[3]


@inlined
def _widen(bounds, p, onward):
    """Widen bounds in the picture, and the nearest key, by a corner and the line to the next."""
    low_x, low_y, high_x, high_y, nearest = bounds
    if p[2] > 0.0:
        inverse = 1.0 / p[2]
        x = p[0] * inverse
        y = p[1] * inverse
        low_x = min(low_x, x)
        high_x = max(high_x, x)
        low_y = min(low_y, y)
        high_y = max(high_y, y)
        nearest = max(nearest, p[3] * inverse)
    if (p[2] > 0.0) != (onward[2] > 0.0):
        # The side leaves the half space in front of the eye in this direction.
        share = p[2] / (p[2] - onward[2])
        x = p[0] + share * (onward[0] - p[0])
        y = p[1] + share * (onward[1] - p[1])
        nearest = np.inf
        if x >= 0.0:
            high_x = np.inf
        if x <= 0.0:
            low_x = -np.inf
        if y >= 0.0:
            high_y = np.inf
        if y <= 0.0:
            low_y = -np.inf
    return low_x, low_y, high_x, high_y, nearest


@inlined
def _bound(quads, out, t, line, side, span):
    """
    Bound a quad's rows of pixels by the half plane side * line >= 0.

    Writes x >= p + q y as the t-th left bound, or x < p + q y as the right one; returns the span
    of rows, narrowed if the line is horizontal.
    """
    first_row, end_row = span
    a, b, c = line
    quads[out, 2 * t] = quads[out, 19]
    quads[out, 2 * t + 1] = 0.0
    quads[out, 8 + 2 * t] = quads[out, 20]
    quads[out, 9 + 2 * t] = 0.0
    if a != 0.0:
        k = 2 * t if a * side > 0.0 else 8 + 2 * t
        quads[out, k] = -c / a
        quads[out, k + 1] = -b / a
    elif b * side > 0.0:
        first_row = max(first_row, np.ceil(-c / b))
    elif b != 0.0:
        end_row = min(end_row, np.ceil(-c / b))
    elif c * side < 0.0:
        end_row = first_row
    return first_row, end_row


@partial(kernel, boundscheck=False)
def _set_up(ends, codes, weight, matrix, light, floor, tiles, size, quads, spans, filled, taken):
    """Turn edges into bounds and key planes; drop sides that cannot change a count."""
    rows, cols = size
    chunks = filled.size
    length = (codes.size + chunks - 1) // chunks
    origin = (matrix[0, 3], matrix[1, 3], matrix[2, 3], matrix[3, 3])
    nowhere = (0.0, 0.0, 0.0, 0.0)
    while True:
        chunk = take_next(taken)
        if chunk >= chunks:
            return
        out = chunk * length
        for q in range(chunk * length, min(codes.size, chunk * length + length)):
            code = codes[q]
            e = code >> 2
            x0, y0, z0 = ends[e, 0], ends[e, 1], ends[e, 2]
            x1, y1, z1 = ends[e, 3], ends[e, 4], ends[e, 5]
            down0 = z0 * light[3] - light[2]
            down1 = z1 * light[3] - light[2]
            goes_down = down0 < 0.0 and down1 < 0.0
            if goes_down and z0 <= floor and z1 <= floor:
                continue
            # The edge's ends, and the directions away from the light there.
            p0 = _project(matrix, x0, y0, z0, origin)
            p1 = _project(matrix, x1, y1, z1, origin)
            away0 = _project(
                matrix, x0 * light[3] - light[0], y0 * light[3] - light[1], down0, nowhere
            )
            away1 = _project(
                matrix, x1 * light[3] - light[0], y1 * light[3] - light[1], down1, nowhere
            )
            line0 = cross(p0, p1)
            line1 = cross(p0, away0)
            line2 = cross(p1, away1)
            line3 = (0.0, 0.0, 0.0)
            det = dot(line0, away0)
            if det == 0.0:
                continue  # seen edge-on
            side = 1.0 if det > 0.0 else -1.0
            p2, p3 = away0, away1
            if goes_down and floor > -np.inf:
                far0 = max(0.0, (z0 - floor) / -down0)
                far1 = max(0.0, (z1 - floor) / -down1)
                # For an almost horizontal light both ends are lost in rounding: no cut there.
                if min(far0, far1) < FARTHEST:
                    p2 = _go(p0, away0, far0)
                    p3 = _go(p1, away1, far1)
                    line3 = cross(p2, p3)
            # Bounds in the picture, and the nearest key.
            bounds = (np.inf, np.inf, -np.inf, -np.inf, -np.inf)
            bounds = _widen(bounds, p0, p1)
            bounds = _widen(bounds, p1, p3)
            bounds = _widen(bounds, p3, p2)
            low_x, low_y, high_x, high_y, nearest = _widen(bounds, p2, p0)
            if not (high_y >= 0.0 and low_y <= rows - 1 and high_x >= 0.0 and low_x <= cols - 1):
                continue
            first_row = np.floor(max(low_y, 0.0))
            end_row = min(np.ceil(min(high_y, np.float64(rows))) + 1.0, np.float64(rows))
            # Is it wholly behind the farthest surface of every tile that it touches?
            tx0 = np.int64(max(low_x - 1.0, 0.0)) // TILE
            tx1 = np.int64(min(high_x + 1.0, cols - 1.0)) // TILE
            ty0 = np.int64(first_row) // TILE
            ty1 = (np.int64(end_row) - 1) // TILE
            hidden = nearest < np.inf
            limit = nearest + 1e-9 * abs(nearest)
            ty = ty0
            while hidden and ty <= ty1:
                for tx in range(tx0, tx1 + 1):
                    if tiles[ty, tx] < limit:
                        hidden = False
                ty += 1
            if hidden:
                continue
            # Lines that nearly coincide may cross anywhere: stay within the corners.
            quads[out, 19] = np.floor(max(low_x, 0.0))
            quads[out, 20] = np.ceil(min(high_x, np.float64(cols - 1))) + 1.0
            span = (first_row, end_row)
            span = _bound(quads, out, 0, line0, side, span)
            span = _bound(quads, out, 1, line1, -side, span)
            span = _bound(quads, out, 2, line2, side, span)
            first_row, end_row = _bound(quads, out, 3, line3, -side, span)
            if first_row >= end_row:
                continue
            # The key on the side's plane, from differences: the side passes close to receivers.
            edge = _go(p1, p0, -1.0)  # their difference
            part0 = cross(edge, away0)
            part1 = cross(away0, p0)
            part2 = cross(p0, edge)
            for k in range(3):
                key = p0[3] * part0[k] + edge[3] * part1[k] + away0[3] * part2[k]
                quads[out, 16 + k] = key / det
            m = np.int64(weight[e]) >> ((code >> 1) & 1)
            if (code & 1 == 0) != (side < 0.0):
                m = -m
            spans[out, 0] = np.int64(first_row)
            spans[out, 1] = np.int64(end_row)
            spans[out, 2] = m
            out += 1
        filled[chunk] = out - chunk * length


@partial(kernel, boundscheck=False)
def _fill(quads, spans, places, listed, keys, counts, taken):
    """
    Write the sums of all sides into ``counts`` (rows, cols + LANES).

    All sides are filled one stripe at a time, so that the stripe's surface stays in the cache.
    """
    while True:
        stripe = take_next(taken)
        if stripe >= places.size - 1:
            return
        top = stripe * STRIPE
        counts[top : top + STRIPE] = 0
        sides = listed[places[stripe] : places[stripe + 1]]
        first = np.empty((_BATCH, STRIPE), np.int32)
        wide, near = np.empty_like(first), np.empty((_BATCH, STRIPE))
        members = np.empty((4, _BATCH), np.int64)
        start, width = np.uint64(top * keys.shape[1]), np.uint64(keys.shape[1])
        surface, sums = keys.reshape(-1), counts.reshape(-1)
        _fill_stripe(
            quads, spans, sides, top, first, wide, near, members, start, width, surface, sums
        )


@partial(borrowing, boundscheck=False, fastmath={"nsz", "nnan"})
def _fill_stripe(quads, spans, sides, top, first, wide, near, members, start, width, surface, sums):
    """Add the sides of a stripe in batches: rows of known width mispredict few branches."""
    for begin in range(0, sides.size, _BATCH):
        few = few_more = several = many = 0
        for p in range(min(sides.size - begin, _BATCH)):
            i = np.uint64(sides[begin + p])
            widest = np.int32(0)
            # First column, width and first key of each row of the stripe, all at once.
            for j in range(STRIPE):
                y = np.float64(top + j)
                left = max(
                    max(quads[i, 0] + quads[i, 1] * y, quads[i, 2] + quads[i, 3] * y),
                    max(quads[i, 4] + quads[i, 5] * y, quads[i, 6] + quads[i, 7] * y),
                )
                right = min(
                    min(quads[i, 8] + quads[i, 9] * y, quads[i, 10] + quads[i, 11] * y),
                    min(quads[i, 12] + quads[i, 13] * y, quads[i, 14] + quads[i, 15] * y),
                )
                column = np.ceil(min(max(left, quads[i, 19]), quads[i, 20]))
                first[p, j] = np.int32(column)
                pixels = np.int32(max(np.ceil(min(right, quads[i, 20])) - column, 0.0))
                wide[p, j] = pixels
                widest = max(widest, pixels)
                near[p, j] = quads[i, 17] * y + quads[i, 18] + quads[i, 16] * column
            members[0, few] = members[1, few_more] = members[2, several] = members[3, many] = p
            few += 0 < widest <= 8
            few_more += 8 < widest <= 16
            several += 16 < widest <= LANES
            many += widest > LANES
        batch = sides, np.uint64(begin), members
        runs = first, wide, near
        picture = start, width, surface, sums
        _add_rows(8, 0, few, batch, quads, spans, top, runs, picture)
        _add_rows(16, 1, few_more, batch, quads, spans, top, runs, picture)
        _add_rows(LANES, 2, several, batch, quads, spans, top, runs, picture)
        _add_rows(LANES, 3, many, batch, quads, spans, top, runs, picture)


@partial(kernel, boundscheck=False, inline="always")
def _add_rows(lanes, kind, n, batch, quads, spans, top, runs, picture):
    """Add the n sides of a batch that are of one kind by width, ``lanes`` pixels at once."""
    sides, begin, members = batch
    first, wide, near = runs
    start, width, surface, sums = picture
    for k in range(n):
        p = np.uint64(members[kind, k])
        i = np.uint64(sides[begin + p])
        slope = quads[i, 16]
        m = sums.dtype.type(spans[i, 2])
        end = np.uint64(min(spans[i, 1] - top, STRIPE))
        # Rows without pixels are compared, too: cheaper than a mispredicted branch.
        for j in range(np.uint64(max(spans[i, 0] - top, 0)), end):
            at = start + j * width + np.uint64(first[p, j])
            add_where_nearer(lanes, surface, sums, at, near[p, j], slope, wide[p, j], m)
            base = quads[i, 17] * np.float64(np.uint64(top) + j) + quads[i, 18]
            for done in range(lanes, wide[p, j] if kind == 3 else 0, lanes):
                side = base + slope * (first[p, j] + done)
                ahead = at + np.uint64(done)
                rest = wide[p, j] - np.int32(done)
                add_where_nearer(lanes, surface, sums, ahead, side, slope, rest, m)
