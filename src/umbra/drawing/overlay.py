"""
Unions, differences and intersections of polygons of the picture, by Clipper2.

Rings are (k, 2) arrays, outer ones counter-clockwise, holes clockwise; a list of rings is filled
by the nonzero rule. Corners lie on a lattice that is fine enough not to be seen, and coarse enough
that Clipper's products of coordinates are exact in float64.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel

__all__ = ["LATTICE", "Ring", "intersect", "subtract", "unite"]

LATTICE = 2.0**-14
"""Corners lie on multiples of this [pixels]."""
_THIN = 2.0**-9  # mean width of rings that may be rounding between neighbours [pixels]
_UNSEEN = 2.0**-7  # radius of the largest disc in a ring that is left out [pixels]

Ring = NDArray[np.float64]


def unite(subject: Sequence[Ring]) -> list[Ring]:
    """Return the union of rings."""
    return _overlay(subject, (), "Union")


def subtract(subject: Sequence[Ring], others: Sequence[Ring]) -> list[Ring]:
    """Return what others leave of the union of ``subject``."""
    return _overlay(subject, others, "Difference")


def intersect(subject: Sequence[Ring], others: Sequence[Ring]) -> list[Ring]:
    """Return what others hold of the union of ``subject``."""
    return _overlay(subject, others, "Intersection") if len(others) else []


def _overlay(subject: Sequence[Ring], others: Sequence[Ring], kind: str) -> list[Ring]:
    """Run Clipper2, and leave out rings too thin to be seen."""
    import pyclipr  # noqa: PLC0415  (an extra)

    if not len(subject):
        return []
    clipper = pyclipr.Clipper()
    clipper.scaleFactor = round(1 / LATTICE)
    clipper.preserveCollinear = False
    clipper.addPaths(list(subject), pyclipr.Subject, False)
    if len(others):
        clipper.addPaths(list(others), pyclipr.Clip, False)
    rings = clipper.execute(getattr(pyclipr, kind), pyclipr.FillRule.NonZero)
    return [ring for ring in rings if not (_is_thin(ring) and _is_unseen(ring))]


def _is_unseen(ring: Ring) -> bool:
    """Return whether no disc that could be seen has room: a needle's end may be wide enough."""
    import pyclipr  # noqa: PLC0415  (an extra)

    offset = pyclipr.ClipperOffset()
    offset.scaleFactor = round(1 / LATTICE)
    offset.addPath(ring, pyclipr.JoinType.Miter, pyclipr.EndType.Polygon)
    return not offset.execute(-_UNSEEN)


@kernel
def _is_thin(ring):
    """Return whether the mean width of a ring, twice its area by its length, is next to nothing."""
    area = length = 0.0
    n = ring.shape[0]
    for k in range(n):
        x, y = ring[k]
        dx, dy = ring[(k + 1) % n, 0] - x, ring[(k + 1) % n, 1] - y
        area += x * dy - y * dx
        length += np.hypot(dx, dy)
    return abs(area) < _THIN * length
