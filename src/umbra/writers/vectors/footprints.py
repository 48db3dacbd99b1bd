"""The outlines of buildings seen from straight above, as exact polygons, one thing at a time."""

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study
from umbra.study.terrain import TERRAIN
from umbra.writers.vectors.outlines import LATTICE, Polygon, gather

__all__ = ["find_footprints"]

_FLAT = 1e-9  # a triangle of less area seen from above is a wall [m2]


def find_footprints(study: Study) -> dict[str, list[Polygon]]:
    """
    Find what of the plan each thing that stands on the ground covers.

    Parts of one name in one layer, such as the roof and the walls of a house, are one thing.

    Parameters
    ----------
    study : Study
        Of a plan.

    Returns
    -------
    footprints : dict of str to list of list of (k, 2) float64
        Under ``BUILDINGS`` and, where there are canopies, ``CANOPIES``: of each polygon the outer
        ring, then its holes, in the model's own coordinates [m].
    """
    scene, grid = study.model.scene, study.grid
    soup = scene.triangles()  # canopies too, which receive nothing
    level = study.ground - float(scene.origin[2])
    corners = soup.vertices[soup.faces]
    lies = np.array([part.kind in TERRAIN for part in scene.parts])
    stands = ~lies[soup.part] & (corners[..., 2].max(1) > level + LATTICE)
    flat = corners[stands][..., :2]
    one, two = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    flat = np.where((area < 0)[:, None, None], flat[:, ::-1], flat)  # all counter-clockwise
    is_wall = np.abs(area) < _FLAT
    canopy = set(study.model.canopy.parts) if study.model.canopy is not None else set()
    is_canopy = np.isin(soup.part[stands], list(canopy))
    group = scene.groups()[soup.part[stands]]
    shift = np.array([study.x[0] - grid.x0, study.y[0] - grid.y0])
    found: dict[str, list[Polygon]] = {}
    for layer, chosen in (("BUILDINGS", ~is_canopy), ("CANOPIES", is_canopy)):
        which = np.flatnonzero(chosen & ~is_wall)
        order = which[np.argsort(group[which], kind="stable")]
        pieces = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
        polygons = [each for piece in pieces if len(piece) for each in _unite(flat[piece], shift)]
        if polygons:
            found[layer] = polygons
    return found


def _unite(triangles: NDArray[np.float64], shift: NDArray[np.float64]) -> list[Polygon]:
    """Unite triangles (n, 3, 2), all wound alike."""
    import pyclipr  # noqa: PLC0415  (an extra)

    corner = triangles.min((0, 1))
    clipper = pyclipr.Clipper()
    clipper.scaleFactor = round(1 / LATTICE)
    clipper.addPaths(list(triangles - corner), pyclipr.Subject, False)
    found: list[Polygon] = []
    gather(clipper.execute2(pyclipr.Union, pyclipr.FillRule.NonZero), found)
    return [[ring + corner + shift for ring in polygon] for polygon in found]
