"""
Shadow counts on a horizontal plane: crossings and a prefix sum, no fill.

Each silhouette edge projects along the light onto the plane as a segment. Going up a column of
cells, the count changes by the edge's multiplicity where the column crosses the segment; a sum over
the rows gives every cell its count. Vertices are projected once and rows are rounded up (half
open), so every closed chain of edges leaves the count beyond it unchanged.
"""

from bisect import bisect_left
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.crossings import sweep
from umbra.cpu.raster_sweep import Sweep
from umbra.kernels import kernel, run_shared
from umbra.scene.derived import derive
from umbra.scene.grid import ASIDE, Grid
from umbra.volume.adjacency import Caster, weld_vertices
from umbra.volume.silhouette import Silhouettes

__all__ = ["PlaneSweep", "clip_above"]


def clip_above(caster: Caster, height: float) -> Caster:
    """
    Clip a caster to the half space strictly above z = height.

    Every edge that crosses the plane is cut once, and every face that crosses it gets a new edge
    along the cut, with the multiplicity that the face adds, so chains of edges stay closed in any
    triangle soup. Faces keep their planes; faces wholly below stay, without edges. ``faces`` is
    unchanged.
    """
    above = caster.vertices[:, 2] > height
    if above.all() or not len(caster.edges):
        return caster
    above_first, above_second = above.take(caster.edges.T)
    in_part = np.flatnonzero(above_first | above_second)
    crossed = np.flatnonzero(above_first != above_second)

    first, second = caster.edges.T.take(crossed, axis=1)
    low, high = np.where(above_first[crossed], (second, first), (first, second))
    bottom, top = caster.vertices.take(low, axis=0), caster.vertices.take(high, axis=0)
    along = (height - bottom[:, 2:]) / (top[:, 2:] - bottom[:, 2:])
    points = bottom + along * (top - bottom)
    points[:, 2] = height
    n = len(caster.vertices)
    vertex = n + weld_vertices(points)  # edges of the same vertices share one

    edges = caster.edges.copy()
    edges[crossed, above_first[crossed].astype(np.intp)] = vertex

    # The new edge of a face runs from where its outline goes below to where it returns.
    cuts = np.full((len(caster.faces), 2), -1, np.int32)
    _find_cuts(caster.faces, above, caster.edges, caster.edge_faces, crossed, cuts)
    cut = np.flatnonzero(cuts[:, 0] >= 0)
    cut_edges = vertex.take(cuts.take(cut, axis=0))
    closed = caster.face_is_closed[cut]
    partner = np.where(closed, len(caster.faces), cut)  # the last plane is never lit
    return replace(
        caster,
        vertices=np.concatenate([caster.vertices, points]),
        edges=np.concatenate([edges.take(in_part, axis=0), cut_edges]),
        edge_faces=np.concatenate(
            [caster.edge_faces.take(in_part, axis=0), np.stack([cut, partner], 1).astype(np.int32)]
        ),
        turn=np.concatenate([caster.turn[in_part], ~closed]),
        weight=np.concatenate([caster.weight[in_part], np.ones(len(cut), np.int8)]),
    )


@kernel
def _find_cuts(faces, above, edges, edge_faces, crossed, cuts):
    """Write for each face which of the crossed edges its outline goes below on, and returns on."""
    for i in range(crossed.size):
        tail = edges[crossed[i], 0]
        for f in edge_faces[crossed[i]]:
            k = 0
            while faces[f, k] != tail:
                k += 1
            is_forward = faces[f, (k + 1) % 3] == edges[crossed[i], 1]
            cuts[f, 0 if above[tail] == is_forward else 1] = i


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
        def cut() -> tuple[Caster, Caster, NDArray[np.float64], tuple[Any, ...]]:
            clipped = derive(caster, "clip", height, lambda: clip_above(caster, height))
            # Offset from cell centres, so that edges along the raster miss the sample points.
            placed = grid.to_cells(clipped.vertices, ASIDE)
            placed[:, 2] -= height
            opened = _open_where_negative(clipped, placed, grid)
            return opened, *_part_rims(opened, opened.ends(placed), grid)

        opened, sides, self.ends, self.rims = derive(caster, "cut", (grid, height), cut)
        super().__init__(opened, grid, threads)
        self.asked = sides

    def _run(
        self,
        silhouettes: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        weights: NDArray,
        out: NDArray,
        masks: NDArray,
        count_type: type,
    ) -> NDArray[np.bool_]:
        grid, threads = self.grid, self.threads
        shape, n = (threads, grid.rows + 1, grid.cols), len(self.rims[0])
        slope = suns[:, :2] / suns[:, 2:] / (grid.dx, grid.dy)
        too_deep = np.zeros(len(suns), np.bool_)
        buffers = (
            self._buffer("diff", shape, count_type),
            self._buffer("base", shape, count_type),
            self._buffer("below", (threads, grid.cols + 1), np.int64, count_type),
            self._buffer("states", (threads, 2, n), np.int8, count_type),
            self._buffer("turned", (threads, n), np.int32),
            self._buffer("wrapped", (threads,), np.bool_, count_type),
        )
        run_shared(
            len(which), sweep, (self.ends, self.asked.weight), silhouettes.codes,
            silhouettes.starts, np.append(suns, slope, 1), which, self.rims, (grid.row, grid.col),
            buffers, weights, out, masks, too_deep,
        )  # fmt: skip
        return too_deep


def _part_rims(
    caster: Caster, ends: NDArray[np.float64], grid: Grid
) -> tuple[Caster, NDArray[np.float64], tuple[Any, ...]]:
    """
    Part the edges in the plane, which cast no side, from the others.

    Returns the caster without them; its ends; and ``rims`` of ``crossings.sweep``.
    """
    # Clipping leaves no edges in the plane but those that it made, the last ones.
    n = bisect_left(range(len(ends)), 1, key=lambda e: not ends[e, [2, 5]].any())
    sides = caster
    if n < len(ends):
        names = ("edges", "edge_faces", "turn", "weight")
        sides = replace(caster, **{name: getattr(caster, name)[:n] for name in names})
    begin, stop = np.clip(np.ceil(ends[n:, [0, 3]].T) - grid.col, 0, grid.cols).astype(np.int64)
    used = np.flatnonzero(begin != stop)
    begins, stops = (
        np.bincount(end(begin[used], stop[used]), minlength=grid.cols + 1)
        for end in (np.minimum, np.maximum)
    )
    rims = ends[n:][used]
    faces = caster.edge_faces[n:, 0][used]
    # One row more on each side, for rounding.
    rows = np.clip(np.ceil(rims[:, [1, 4]]) - grid.row, 0, grid.rows)
    return sides, ends[:n], (
        rims, np.full(len(rims), 2, np.int8), np.ascontiguousarray(caster.planes[:3, faces]),
        caster.turn[n:][used], begins - stops,
        int(max(rows.min(initial=grid.rows) - 1, 0)),
        int(min(rows.max(initial=-1) + 1, grid.rows)),
    )  # fmt: skip


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
    if _count_winding(ends, caster.weight[cut], grid).min() >= 0:
        return caster
    # If each component is wound consistently, only negative ones can be at fault.
    inward = caster.is_inward
    rest = caster.opened(inward)
    if inward.any() and (rest.is_closed != caster.is_closed).any():
        return _open_where_negative(_reclip(rest), placed, grid)
    return _reclip(caster.opened(np.ones_like(caster.is_closed)))


def _count_winding(
    ends: NDArray[np.float64], weight: NDArray[np.int8], grid: Grid
) -> NDArray[np.int32]:
    """Count how often edges in the plane go around each cell: the shadow of a sun in the zenith."""
    winding = np.zeros((1, grid.rows, grid.cols), np.int32)
    starts = np.array([0, len(ends)])
    codes = np.arange(len(ends), dtype=np.int32) << 2 | 1
    zenith = np.array([[0.0, 0.0, 1.0, 0.0, 0.0]])
    no_rims = (
        np.zeros((0, 6)), np.zeros(0, np.int8), np.zeros((3, 0)), np.zeros(0, np.bool_),
        np.zeros(grid.cols + 1, np.int64), grid.rows, 0,
    )  # fmt: skip
    nothing = np.zeros((1, 1), np.uint8), np.zeros((1, 1, 1, 1), np.uint8)
    for count_type in (np.int8, np.int32):
        too_deep = np.zeros(1, np.bool_)
        shape = (1, grid.rows + 1, grid.cols)
        buffers = (
            np.zeros(shape, count_type), np.zeros(shape, count_type),
            np.zeros((1, grid.cols + 1), np.int64), np.zeros((1, 2, 0), np.int8),
            np.zeros((1, 0), np.int32), np.zeros(1, np.bool_),
        )  # fmt: skip
        run_shared(
            1, sweep, (ends, weight), codes, starts, zenith, np.zeros(1, np.int64), no_rims,
            (grid.row, grid.col), buffers, *nothing, winding, too_deep,
        )  # fmt: skip
        if not too_deep[0]:
            break
    return winding[0]


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
