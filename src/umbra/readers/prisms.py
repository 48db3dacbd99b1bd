"""Polygons of a plan, extruded: roof, walls and floor make one closed surface."""

import numpy as np
from numpy.typing import NDArray

from umbra.readers.polygons import Polygons, triangulate
from umbra.readers.table import Rings

__all__ = ["make_prisms"]

CROSSED = (
    "footprints whose rings cross themselves, so that triangles overlap "
    "(pip install 'umbra-shadows[gis]' repairs them)"
)


def make_prisms(
    rings: Rings, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int64], list[str]]:
    """
    Extrude polygons.

    Parameters
    ----------
    rings : Rings
        In any winding.
    low, high : (n_features,) float64
        Of each feature [m].

    Returns
    -------
    vertices : (2 n_points, 3) float64
        The floors' corners, then the roofs'.
    faces : (n_faces, 3) int32
        Wound counter-clockwise seen from outside.
    feature : (n_faces,) int64
    notes : list of str
    """
    rings = _wind(rings)
    n = len(rings.points)
    ring = np.repeat(np.arange(len(rings.lengths)), rings.lengths)
    feature = rings.feature[rings.polygon[ring]]
    floor = np.column_stack([rings.points, low[feature]])
    roof = np.column_stack([rings.points, high[feature]])
    vertices = np.concatenate([floor, roof])

    cut = triangulate(
        roof,
        Polygons(
            np.arange(n), rings.lengths, np.bincount(rings.polygon, minlength=len(rings.feature))
        ),
    )
    # A wall for each edge of the plan, from a corner to the next of its ring.
    starts = np.cumsum(rings.lengths) - rings.lengths
    here = np.arange(n)
    there = here + 1
    there[starts + rings.lengths - 1] = starts
    # What left no roof has no walls either: a prism is whole or not there.
    covered = np.zeros(len(rings.feature), np.bool_)
    covered[cut.polygon] = True
    walled = covered[rings.polygon[ring]]
    here, there = here[walled], there[walled]
    faces = np.concatenate(
        [
            cut.faces + n,
            cut.faces[:, ::-1],
            np.column_stack([here, there, there + n]),
            np.column_stack([here, there + n, here + n]),
        ]
    ).astype(np.int32)
    roofs = rings.feature[cut.polygon]
    walls = feature[walled]
    notes = [
        f"{what}: {number}"
        for what, number in (
            ("footprints with fewer than three distinct corners left out", cut.degenerate),
            (
                CROSSED,
                cut.crossed,
            ),
        )
        if number
    ]
    return vertices, faces, np.concatenate([roofs, roofs, walls, walls]), notes


def _wind(rings: Rings) -> Rings:
    """Wind outer rings counter-clockwise and holes clockwise."""
    starts = np.cumsum(rings.lengths) - rings.lengths
    ring = np.repeat(np.arange(len(starts)), rings.lengths)
    place = np.arange(len(rings.points)) - starts[ring]
    following = starts[ring] + (place + 1) % rings.lengths[ring]
    # About each ring's first corner, so that a far origin costs no digits.
    a = rings.points - rings.points[starts[ring]]
    b = rings.points[following] - rings.points[starts[ring]]
    area = np.bincount(ring, a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], minlength=len(starts))
    outer = np.ones(len(starts), np.bool_)
    outer[1:] = rings.polygon[1:] != rings.polygon[:-1]
    turn = (area < 0) == outer
    order = np.where(
        turn[ring], starts[ring] + rings.lengths[ring] - 1 - place, starts[ring] + place
    )
    return Rings(rings.points[order], rings.lengths, rings.polygon, rings.feature)
