"""
Outlines of shadows on the ground as exact polygons.

The silhouette of each sun is projected along the light onto the ground plane and cut to
the plan; what its loops wind around is in shadow (count != 0, the nonzero rule). The
edges and multiplicities are those by which cells are counted, so a polygon holds just
the centres of the cells in shadow. Clipper2 resolves the loops on a lattice of a
millionth of a metre.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.plane import PlaneSweep
from umbra.errors import InputError
from umbra.kernels import kernel
from umbra.receivers.layout import TILE
from umbra.study import Study
from umbra.study.preview import Moment, find_moments
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import find_silhouette_edges

__all__ = [
    "EVERY",
    "LATTICE",
    "MOST",
    "Polygon",
    "ShadowOutline",
    "find_outlines",
    "gather",
    "resolve_shadow",
    "trace_loops",
]

LATTICE = 1e-6
"""Corners lie on multiples of this, from the local origin [m]."""
EVERY = 60
"""Interval of the clock times that are outlined by default [min]."""
MOST = 2000
"""Most outlines; if there were more, each date has fewer."""

Ring = NDArray[np.float64]
Polygon = list[Ring]


@dataclass(frozen=True, eq=False)
class ShadowOutline(Moment):
    """The shadow on the ground at one instant."""

    # rings of each, in the model's own coordinates [m]: the outer one, counter-clockwise, then its
    # holes, clockwise; no corner is repeated
    polygons: list[Polygon]


def find_outlines(study: Study, moments: Sequence[Moment] | None = None) -> Iterator[ShadowOutline]:
    """
    Outline the shadow on the ground at some moments, whole hours by default.

    Raises InputError if the receivers are not the ground.
    """
    if not study.kind.is_level:
        msg = (
            f"outlines are drawn on the level ground, and this study has "
            f"receivers={study.receivers!r}; leave it out, or choose other files than outlines"
        )
        raise InputError(msg, option="receivers")
    grid, ground = study.grid, float(study.model.ground or 0.0)
    # Components wound inward are found on a raster; a large one may be coarser.
    sweep = PlaneSweep(study.model.caster, grid.coarser(TILE), ground)
    low = np.array([grid.x0 - grid.dx / 2, grid.y0 - grid.dy / 2])
    high = low + (grid.dx * grid.cols, grid.dy * grid.rows)
    shift = np.array([study.x[0] - grid.x0, study.y[0] - grid.y0])
    if moments is None:
        moments = find_moments(study, every=EVERY, most=MOST)
    for moment in moments:
        polygons = resolve_shadow(sweep.caster, moment.direction, ground, (low, high))
        shifted = [[ring + shift for ring in polygon] for polygon in polygons]
        yield ShadowOutline(**vars(moment), polygons=shifted)


def resolve_shadow(
    caster: Caster,
    sun: NDArray[np.float64],
    height: float,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> list[Polygon]:
    """
    Return the polygons, outer ring and holes, that a caster shades of a plane at which it is cut.

    The plane's z is ``height``, the unit sun (3,) is above the horizon, and polygons are cut to
    the box (low, high); all in the caster's frame [m].
    """
    import pyclipr  # noqa: PLC0415  (an extra)

    edges, multiplicity = find_silhouette_edges(caster, np.append(sun, 0.0))
    along = (caster.vertices[:, 2] - height) / sun[2]
    shadow = caster.vertices[:, :2] - along[:, None] * sun[:2]
    # Whole lattice steps from a corner of the box, so that large numbers stay small.
    (left, bottom), (right, top) = np.zeros(2), box[1] - box[0]
    clipper = pyclipr.Clipper()
    clipper.scaleFactor = round(1 / LATTICE)
    loops = [shadow[loop] - box[0] for loop in trace_loops(edges, multiplicity)]
    if not loops:
        return []
    clipper.addPaths(loops, pyclipr.Subject, False)
    frame = np.array([(left, bottom), (right, bottom), (right, top), (left, top)])
    clipper.addPath(frame, pyclipr.Clip, False)
    tree = clipper.execute2(pyclipr.Intersection, pyclipr.FillRule.NonZero)
    polygons: list[Polygon] = []
    gather(tree, polygons)
    return [[ring + box[0] for ring in polygon] for polygon in polygons]


def gather(node: object, polygons: list[Polygon]) -> None:
    """Convert a tree of nested rings to polygons with holes."""
    for outer in node.children:  # type: ignore[attr-defined]
        holes = [_orient(hole.polygon, -1) for hole in outer.children]
        polygons.append([_orient(outer.polygon, 1), *holes])
        for hole in outer.children:
            gather(hole, polygons)


def _orient(ring: NDArray[np.float64], sign: int) -> Ring:
    ring = np.asarray(ring, np.float64)
    x, y = ring.T
    area = np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))
    return ring if area * sign > 0 else ring[::-1]


def trace_loops(
    edges: NDArray[np.int32], multiplicity: NDArray[np.int64]
) -> list[NDArray[np.int32]]:
    """
    Trace closed loops of directed edges (n, 2), each used by its multiplicity (n,) > 0.

    At every vertex as many edges leave as arrive, counted with multiplicity, so a walk along
    unused edges can only end where it began. Any division into loops will do: the winding number
    about a point is a sum over all edges.
    The first vertex of a loop is not repeated.
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


@kernel
def _walk(first, ends):
    """
    Follow edges from vertex to vertex until all are used; as ``trace_loops`` prepares them.

    ``first`` says where each vertex's leaving edges begin, ``ends`` at which vertex each arrives.
    Returns the vertices of all loops, and where loops after the first begin.
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
