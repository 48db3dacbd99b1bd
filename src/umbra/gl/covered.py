"""
Casters whose shadow volumes hold the whole near rectangle: z-pass counts them, too.

z-fail is needed only where the near rectangle can clip a volume (Wallner 2008). Where no side of a
volume and no casting face meets the rectangle, the count there is one number, from which z-pass
may start: no caps are drawn, and only what is before the visible surface.
"""

from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.volumes import BodyVolumes
from umbra.rays.eye_count import Anchor, find_anchor
from umbra.volume.placement import ask_faces
from umbra.volume.regions import Regions

__all__ = ["NearCounts"]

_PLACES = np.array([[1, 1, 1, 1], [5, 3, 2, 2], [2, 5, 4, 1], [1, 2, 6, 4], [3, 1, 2, 7]]).T
"""Weights of the near rectangle's corners at places within it, from which a ray may start."""

_THICK = 3.0  # of the pyramid's margin: how far before the near rectangle faces still meet it


@dataclass(eq=False)
class NearCounts:
    """
    Counts at the near rectangle of one light.

    Parameters
    ----------
    corners : (4, 3) float64
        Of the rectangle, relative to the scene's origin.
    slack : float
        By how much the pyramid is widened [m].
    """

    corners: NDArray[np.float64]
    slack: float
    _anchors: dict[tuple[int, int], Anchor | None] = field(default_factory=dict)

    def find(self, each: BodyVolumes, instance: int, shell: int, regions: Regions) -> int | None:
        """
        Find the count that a shell's volume adds all over the rectangle; None if it may vary.

        ``regions`` are in the instance's frame.
        """
        body, light = each.body, each.lights[instance]
        caster, is_closed = each.caster_of(instance), each.is_closed[instance]
        edges = slice(body.edge_starts[shell], body.edge_starts[shell + 1])
        if _meets_sides(
            caster.vertices, caster.edges[edges], caster.edge_faces[edges], caster.turn[edges],
            caster.planes, caster.component, is_closed, light, regions.pyramid,
        ):  # fmt: skip
            return None
        # The pyramid's first plane is the near one, moved outward.
        before = -regions.pyramid[:1]
        before[0, 3] += _THICK * self.slack
        slab = np.concatenate([regions.pyramid, before])
        faces = body.faces[body.face_starts[shell] : body.face_starts[shell + 1]]
        touches, _ = ask_faces(
            caster.vertices, caster.faces, faces, caster.planes, caster.component, is_closed,
            light, slab, slab,
        )  # fmt: skip
        anchor = None if touches else self._find_anchor(each, instance)
        if anchor is None:
            return None
        adds = anchor.lit + anchor.unlit * ~is_closed
        return int(adds[body.component_shell == shell].sum())

    def _find_anchor(self, each: BodyVolumes, instance: int) -> Anchor | None:
        """Count a body's faces between a place in the rectangle and the light, if any is clean."""
        key = (id(each), instance)
        if key not in self._anchors:
            body = each.body
            caster, light = each.caster_of(instance), each.lights[instance]
            places = (_PLACES / _PLACES.sum(0)).T @ self.corners
            self._anchors[key] = None
            for place in np.linalg.solve(
                body.transforms[instance], np.column_stack([places, np.ones(len(places))]).T
            ).T:
                found = find_anchor(caster, body.blocks, place, light)
                if found.is_clean:
                    self._anchors[key] = found
                    break
        return self._anchors[key]


@njit(cache=True, nogil=True)
def _meets_sides(vertices, edges, edge_faces, turn, planes, component, is_closed, light, pyramid):
    """Return whether a silhouette edge may meet the pyramid, or an open face is seen edge-on."""
    for edge in range(edges.shape[0]):
        code = turn[edge]
        for k in range(2):
            face = edge_faces[edge, k]
            side = planes[0, face] * light[0] + planes[1, face] * light[1]
            side += planes[2, face] * light[2]
            side += planes[3, face] * light[3]
            if side == 0.0 and not is_closed[component[face]]:
                return True
            code ^= side > 0.0
        if not code:
            continue
        low, high = 0.0, 1.0
        for k in range(pyramid.shape[0]):
            a = b = pyramid[k, 3]
            for axis in range(3):
                a += pyramid[k, axis] * vertices[edges[edge, 0], axis]
                b += pyramid[k, axis] * vertices[edges[edge, 1], axis]
            if a < 0.0 and b < 0.0:
                low = 2.0
            elif a < 0.0:
                low = max(low, a / (a - b))
            elif b < 0.0:
                high = min(high, a / (a - b))
        if low <= high:
            return True
    return False
