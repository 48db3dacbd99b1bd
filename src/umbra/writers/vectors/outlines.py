"""
The outlines of shadows on the ground as exact polygons.

The silhouette of each sun is projected along the light onto the ground plane and cut to
the plan; what its loops wind around is in shadow (count != 0, the nonzero rule). The
edges and multiplicities are those by which cells are counted, so a polygon holds just
the centres of the cells in shadow. Clipper2 resolves the loops on a lattice of a
millionth of a metre.
"""

import datetime as dt
import zoneinfo
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.plane import PlaneSweep
from umbra.errors import InputError
from umbra.study import Study
from umbra.study.layout import TILE
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import find_silhouette_edges
from umbra.writers.vectors.loops import trace_loops

__all__ = ["LATTICE", "MOST", "Outline", "find_outlines", "resolve_shadow"]

LATTICE = 1e-6
"""Corners lie on multiples of this, from the local origin [m]."""
MOST = 2000
"""Instants that are outlined; of more, every n-th."""

Ring = NDArray[np.float64]
Polygon = list[Ring]


@dataclass(frozen=True, eq=False)
class Outline:
    """
    The shadow on the ground at one instant.

    Parameters
    ----------
    instant : datetime
        UTC.
    local : datetime
        By the site's clock.
    altitude, azimuth : float
        Of the sun [degrees].
    polygons : list of list of (k, 2) float64
        Of each the outer ring, counter-clockwise, then its holes, clockwise, in the
        model's own coordinates [m]; rings are not closed by a repeated corner.
    """

    instant: dt.datetime
    local: dt.datetime
    altitude: float
    azimuth: float
    polygons: list[Polygon]


def find_outlines(study: Study) -> Iterator[Outline]:
    """
    Outline the shadow on the ground at each step's midpoint while the sun is up.

    Parameters
    ----------
    study : Study
        With the ground as receiver.

    Yields
    ------
    outline : Outline

    Raises
    ------
    InputError
        If the receiver is not the ground.
    """
    if study.receivers != "ground":
        msg = (
            f"outlines are drawn on the level ground, and this study has --receivers "
            f"{study.receivers}; leave it out, or choose other files than outlines"
        )
        raise InputError(msg)
    grid, ground = study.grid, float(study.model.ground or 0.0)
    # Where a house is wound inward is looked for on a raster; a large one need not be whole.
    sweep = PlaneSweep(study.model.caster, grid.coarser(TILE), ground)
    low = np.array([grid.x0 - grid.dx / 2, grid.y0 - grid.dy / 2])
    high = low + (grid.dx * grid.cols, grid.dy * grid.rows)
    shift = np.array([study.x[0] - grid.x0, study.y[0] - grid.y0])
    zone = zoneinfo.ZoneInfo(study.site.zone)
    instants = study.period.instants.astype("datetime64[us]").tolist()
    up = np.flatnonzero(study.sun.is_up)
    for k in up[:: max(1, -(-len(up) // MOST))]:
        instant = instants[k].replace(tzinfo=dt.UTC)
        polygons = resolve_shadow(sweep.caster, study.sun.direction[k], ground, (low, high))
        yield Outline(
            instant,
            instant.astimezone(zone),
            float(study.sun.altitude[k]),
            float(study.sun.azimuth[k]),
            [[ring + shift for ring in polygon] for polygon in polygons],
        )


def resolve_shadow(
    caster: Caster,
    sun: NDArray[np.float64],
    height: float,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> list[Polygon]:
    """
    Find what a caster that ends at a plane shades of it.

    Parameters
    ----------
    caster : Caster
        Cut at the plane, as ``PlaneSweep`` keeps it.
    sun : (3,) float64
        Direction toward the sun, above the horizon.
    height : float
        The plane's z, in the caster's frame [m].
    box : (low, high), each (2,) float64
        Polygons are cut to it [m].

    Returns
    -------
    polygons : list of list of (k, 2) float64
        Outer ring, then holes.
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
    found: list[Polygon] = []
    _gather(tree, found)
    return [[ring + box[0] for ring in polygon] for polygon in found]


def _gather(node: object, found: list[Polygon]) -> None:
    """Turn a tree of rings in rings into polygons with holes."""
    for outer in node.children:  # type: ignore[attr-defined]
        holes = [_orient(hole.polygon, -1) for hole in outer.children]
        found.append([_orient(outer.polygon, 1), *holes])
        for hole in outer.children:
            _gather(hole, found)


def _orient(ring: NDArray[np.float64], sign: int) -> Ring:
    ring = np.asarray(ring, np.float64)
    x, y = ring.T
    area = np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))
    return ring if area * sign > 0 else ring[::-1]
