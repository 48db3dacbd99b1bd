"""
Bounding volume hierarchy over dual segments, 16 children each, cut by a light's plane.

The segments are sorted by their midpoints along a four-dimensional Morton curve and split into
blocks of 16; each block has a box, 16 boxes form a block of boxes, and so on up. All 16 are tested
at once. Unlike in the paper's hextree, boxes always fit tightly, and no segment stays near the root
because it crosses a cell boundary.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared, take_next
from umbra.volume.adjacency import Caster
from umbra.volume.duals import (
    STRETCH,
    WIDTH,
    Duals,
    Plane,
    Segments,
    Tree,
    find_key,
    make_duals,
    make_segments,
    sift_block,
)

__all__ = ["DualTree", "make_dual_tree", "prefetch"]


@intrinsic
def prefetch(_typing, array, index):
    """
    Prefetch the cache line of one entry of a contiguous array, without waiting.

    ``index`` is a flat index. Only a hint: without support it does nothing.
    """

    def generate(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        byte = ir.IntType(8).as_pointer()
        number = ir.IntType(32)
        hint = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        call = cgutils.get_or_insert_function(builder.module, hint, "llvm.prefetch.p0i8")
        address = builder.bitcast(builder.gep(data, [arguments[1]]), byte)
        read, keep, is_data = (ir.Constant(number, value) for value in (0, 3, 1))
        builder.call(call, [address, read, keep, is_data])
        return context.get_dummy_value()

    return types.void(array, index), generate


_AT_ONCE = STRETCH // WIDTH  # blocks per work item of a thread
_AHEAD = 4  # blocks prefetched ahead: the hardware cannot predict their addresses


@dataclass(frozen=True, eq=False)
class DualTree(Tree):
    """
    Hierarchy of boxes in dual space, level by level.

    A block of boxes is 8 rows of 16 float32: four of centres, four of half extents. Box i of block
    b on one level bounds block ``16 * b + i`` of the next level; boxes of the last level bound
    blocks of segments.
    """

    segments: Segments
    boxes: NDArray[np.float32]  # (n_boxes / 16, 8, 16)
    starts: NDArray[np.int64]  # (n_levels + 1,) first block of each level in ``boxes``

    def sift(
        self, plane: Plane, numbers: NDArray[np.int32] | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
        """Find the segments that a light's plane cuts; see ``Tree.sift``."""
        return _sift(
            self.boxes,
            self.starts,
            self.segments.blocks,
            self.segments.numbers if numbers is None else numbers,
            plane.normal,
            plane.margin,
        )


def make_dual_tree(caster: Caster) -> DualTree:
    """Build the tree of a caster."""
    duals = make_duals(caster)
    order = _sort_along_curve(caster, duals)
    numbers = np.full(((len(order) + WIDTH - 1) // WIDTH, WIDTH), -1, np.int32)
    numbers.ravel()[: len(order)] = order
    segments = make_segments(caster, duals, numbers)
    levels = [segments.blocks]
    while len(levels[0]) > 1:
        blocks = (len(levels[0]) + WIDTH - 1) // WIDTH
        boxes = np.full((blocks, 8, WIDTH), np.nan, np.float32)
        run_shared(-(-len(boxes) // _AT_ONCE), _put_boxes, levels[0], boxes)
        levels.insert(0, boxes)
    starts = np.cumsum([0] + [len(boxes) for boxes in levels[:-1]])
    above = np.concatenate([np.zeros((0, 8, WIDTH), np.float32), *levels[:-1]])
    return DualTree(segments, above, starts)


def _sort_along_curve(caster: Caster, duals: Duals) -> NDArray[np.int32]:
    """Sort segments by their midpoints along a Morton curve through the cube."""
    keys = np.zeros(len(duals.edges), np.uint64)
    given = duals.points, duals.edges, caster.edge_faces, caster.turn, keys
    run_shared(-(-len(duals.edges) // STRETCH), _make_keys, *given)
    return duals.edges[np.argsort(keys)]


@partial(kernel, boundscheck=False)
def _make_keys(points, edges, edge_faces, turn, keys, taken):
    while True:
        stretch = take_next(taken)
        if stretch >= (edges.size + STRETCH - 1) // STRETCH:
            return
        for i in range(stretch * STRETCH, min(edges.size, (stretch + 1) * STRETCH)):
            a = points[edge_faces[edges[i], 0]]
            b = points[edge_faces[edges[i], 1]]
            sign = -1.0 if turn[edges[i]] else 1.0
            keys[i] = find_key(
                0.5 * (a[0] + sign * b[0]),
                0.5 * (a[1] + sign * b[1]),
                0.5 * (a[2] + sign * b[2]),
                0.5 * (a[3] + sign * b[3]),
            )


@partial(kernel, boundscheck=False)
def _put_boxes(children, boxes, taken):
    """Bound each block of boxes or segments by a box, rounded outward."""
    while True:
        stretch = take_next(taken)
        if stretch >= (boxes.shape[0] + _AT_ONCE - 1) // _AT_ONCE:
            return
        for block in range(stretch * _AT_ONCE, min(boxes.shape[0], (stretch + 1) * _AT_ONCE)):
            for i in range(min(WIDTH, children.shape[0] - block * WIDTH)):
                child = children[block * WIDTH + i]
                for axis in range(4):
                    low, high = np.inf, -np.inf
                    for j in range(WIDTH):
                        middle = np.float64(child[axis, j])
                        half = abs(np.float64(child[4 + axis, j]))
                        if not np.isnan(middle):
                            low = min(low, middle - half)
                            high = max(high, middle + half)
                    rounded = np.float32(0.5 * (low + high))
                    half = max(high - np.float64(rounded), np.float64(rounded) - low)
                    boxes[block, axis, i] = rounded
                    boxes[block, 4 + axis, i] = np.float32(half * (1.0 + 2.0**-22))


@partial(kernel, boundscheck=False)
def _sift(boxes, starts, segments, numbers, normal, margin):
    """Descend through the boxes that the plane cuts, down to segments."""
    x, y, z, w = normal[0], normal[1], normal[2], normal[3]
    ax, ay, az, aw = abs(x), abs(y), abs(z), abs(w)
    front = np.empty(segments.shape[0] + WIDTH, np.int32)
    back = np.empty(segments.shape[0] + WIDTH, np.int32)
    cut = np.empty(WIDTH, np.bool_)
    front[0] = 0
    n = min(1, segments.shape[0])
    for level in range(starts.size - 1):
        m = 0
        for q in range(n):
            if q + _AHEAD < n:
                for row in range(8):
                    prefetch(boxes, ((starts[level] + front[q + _AHEAD]) * 8 + row) * WIDTH)
            number = front[q]
            box = boxes[starts[level] + number]
            for i in range(WIDTH):
                middle = box[0, i] * x + box[1, i] * y + box[2, i] * z + box[3, i] * w
                half = box[4, i] * ax + box[5, i] * ay + box[6, i] * az + box[7, i] * aw
                cut[i] = abs(middle) <= half + margin
            for i in range(WIDTH):
                back[m] = number * WIDTH + i
                m += cut[i]
        n = m
        front, back = back, front
    inside, lit = np.empty(WIDTH, np.float32), np.empty(WIDTH, np.int32)
    codes = np.empty((n + 1) * WIDTH, np.int32)
    unsure = np.empty((n + 1) * WIDTH, np.int32)
    m, k = 0, 0
    for q in range(n):
        block = front[q]
        if q + _AHEAD < n:
            for row in range(8):
                prefetch(segments, (np.int64(front[q + _AHEAD]) * 8 + row) * WIDTH)
            prefetch(numbers, np.int64(front[q + _AHEAD]) * WIDTH)
        m, k = sift_block(
            segments[block], numbers[block], 0, WIDTH,
            normal, margin, inside, lit, codes, m, unsure, k,
        )  # fmt: skip
    return codes[:m], unsure[:k], n * WIDTH
