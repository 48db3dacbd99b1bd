"""
Shadow counts on a horizontal plane: crossings and a prefix sum, no fill.

Each silhouette edge projects along the light onto the plane as a segment. Going up a column of
cells, the count changes by the edge's multiplicity where the column crosses the segment; a sum over
the rows gives every cell its count. Vertices are projected once and rows are rounded up (half
open), so every closed chain of edges leaves the count beyond it unchanged.
"""

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.cpu.crossings import count_winding, sweep
from umbra.cpu.sweep import Sweep
from umbra.scene.derived import derive
from umbra.scene.grid import ASIDE, Grid
from umbra.volume.adjacency import Caster
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
        # Clipping leaves no edges in the plane but those that it made, the last ones.
        in_plane = (self.ends[:, 2] == 0) & (self.ends[:, 5] == 0)
        fixed = len(in_plane) - int(in_plane.sum())
        rows = self.ends[fixed:, [1, 4]]
        self.level = fixed, float(rows.min(initial=np.inf)), float(rows.max(initial=-np.inf))

    def _run(
        self,
        found: Silhouettes,
        suns: NDArray[np.float64],
        which: NDArray[np.int64],
        out: NDArray,
        masks: NDArray,
        count_type: type,
    ) -> NDArray[np.bool_]:
        grid, threads = self.grid, self.threads
        shape = threads, grid.rows + 1, grid.cols
        slope = suns[:, :2] / suns[:, 2:] / (grid.dx, grid.dy)
        too_deep = np.zeros(len(suns), np.bool_)
        # Counts are wanted of few suns: each has all crossings anew.
        fixed = len(self.ends) if len(masks) else self.level[0]
        n = len(self.ends) - fixed
        kept = (
            self._buffer("base", shape if n else (threads, 1, 1), count_type),
            self._buffer("loads", (threads, grid.cols + 1), np.int64, count_type),
            self._buffer("states", (threads, 2, n), np.int8, count_type),
            self._buffer("wrapped", (threads,), np.bool_, count_type),
        )
        sweep(
            self.ends, self.caster.weight, found.codes, found.starts, slope, which,
            (fixed, *self.level[1:]), (grid.row, grid.col),
            self._buffer("diff", shape, count_type), kept, out, masks, too_deep,
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
    winding = np.zeros((grid.rows, grid.cols), np.int32)
    diff = np.zeros((grid.rows + 1, grid.cols), np.int32)
    count_winding(ends, caster.weight[cut], (grid.row, grid.col), diff, winding)
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
