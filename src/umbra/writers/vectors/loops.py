"""Silhouette edges, assembled into loops that can be filled under the nonzero rule."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["trace_loops"]


def trace_loops(
    edges: NDArray[np.int32], multiplicity: NDArray[np.int64]
) -> list[NDArray[np.int32]]:
    """
    Walk along directed edges, each as often as its multiplicity says, in closed loops.

    At every vertex as many edges leave as arrive, counted with multiplicity: from any
    vertex a walk along unused edges can only end where it began. How the edges are
    shared out among loops does not matter: the winding number about a point is the
    sum over all edges, and stays that.

    Parameters
    ----------
    edges : (n, 2) int32
        Vertices, from and to.
    multiplicity : (n,) int64
        Above 0.

    Returns
    -------
    loops : list of (k,) int32
        Vertices; the first is not repeated.
    """
    if not len(edges):
        return []
    repeated = np.repeat(edges, multiplicity, axis=0)
    starts = np.unique(repeated[:, 0])
    by_start = repeated[np.argsort(repeated[:, 0], kind="stable")]
    first = np.searchsorted(by_start[:, 0], starts)
    ends = np.searchsorted(starts, by_start[:, 1])
    walk, breaks = _walk(np.append(first, len(by_start)), ends)
    return [starts[part] for part in np.split(walk, breaks) if len(part) > 2]


@njit(cache=True)
def _walk(first, ends):
    """
    Follow edges from vertex to vertex until all are used.

    Parameters
    ----------
    first : (n_vertices + 1,) int64
        Where each vertex's leaving edges begin.
    ends : (n_edges,) int64
        Vertex at which each edge arrives.

    Returns
    -------
    walk : (n_edges,) int64
        Vertices, loop after loop.
    breaks : (n_loops - 1,) int64
        Where loops after the first begin.
    """
    unused = first[:-1].copy()
    walk = np.zeros(ends.size, np.int64)
    breaks = np.zeros(ends.size, np.int64)
    n_walk = 0
    n_breaks = 0
    for start in range(first.size - 1):
        while unused[start] < first[start + 1]:
            if n_walk:
                breaks[n_breaks] = n_walk
                n_breaks += 1
            at = start
            while True:
                walk[n_walk] = at
                n_walk += 1
                edge = unused[at]
                unused[at] += 1
                at = ends[edge]
                if at == start:
                    break
    return walk, breaks[:n_breaks]
