"""
Casters whose shadow volumes hold the whole near rectangle: z-pass counts them, too.

z-fail is needed only where the near rectangle can clip a volume (Wallner 2008). Where no side of a
volume and no casting face meets the rectangle, the count there is one number, from which z-pass
may start: no caps are drawn, and only what is before the visible surface.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.gl.volumes import BodyVolumes
from umbra.kernels import copy_rows, kernel
from umbra.rays.eye_count import Anchor, find_anchor
from umbra.volume.placement import ask_faces

__all__ = ["NearCounts", "ask_shell"]

_PLACES = np.array([[1, 1, 1, 1], [5, 3, 2, 2], [2, 5, 4, 1], [1, 2, 6, 4], [3, 1, 2, 7]], float)
_PLACES /= _PLACES.sum(1, keepdims=True)
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
    """

    corners: NDArray[np.float64]
    _anchors: dict[tuple[int, int], Anchor | None] = field(default_factory=dict)

    def find(self, body_volumes: BodyVolumes, instance: int, shell: int) -> int | None:
        """
        Find the count that a shell's volume adds where it ``is_apart`` (`ask_shell`).

        None if no place is clean.
        """
        key = (id(body_volumes), instance)
        if key not in self._anchors:
            self._anchors[key] = self._find_anchor(body_volumes, instance)
        anchor = self._anchors[key]
        if anchor is None:
            return None
        adding = anchor.find_adding(body_volumes.is_closed[instance])
        return int(np.count_nonzero(body_volumes.body.component_shell[adding] == shell))

    def _find_anchor(self, body_volumes: BodyVolumes, instance: int) -> Anchor | None:
        """Find a body's faces between a place in the rectangle and the light, if any is clean."""
        body, caster, light = (
            body_volumes.body,
            body_volumes.caster_of(instance),
            body_volumes.lights[instance],
        )
        places = np.ones((len(_PLACES), 4))
        places[:, :3] = _PLACES @ self.corners
        for point in body.to_mesh(instance, places):
            anchor = find_anchor(caster, body.blocks, point, light)
            if anchor.is_clean:
                return anchor
        return None


@kernel
def ask_shell(caster, faces, edges, is_closed, light, pyramid, view, slack):
    """
    Ask a shell's triangles for its case.

    Parameters
    ----------
    caster : tuple of arrays
        Vertices, faces, planes, components, edges, faces of edges and turns of a caster.
    faces, edges : array, (int, int)
        Numbers of the shell's casting faces, first and end of its edges.
    is_closed : (n_components,) bool
    light, pyramid, view
        ``Regions`` in the caster's frame.
    slack : float
        By how much the pyramid is widened [m].

    Returns
    -------
    blocks, is_seen : bool
        Whether any casting face meets the pyramid, and the view.
    is_apart : bool
        Whether no side of the volume and no casting face meets the near rectangle, in the first
        plane of the pyramid.
    """
    vertices, corners, planes, component, ends, edge_faces, turn = caster
    blocks, is_seen = ask_faces(
        vertices, corners, faces, planes, component, is_closed, light, pyramid, view
    )
    if not blocks or _meets_sides(
        vertices, ends, edge_faces, turn, edges, planes, component, is_closed, light, pyramid
    ):
        return blocks, is_seen, False
    # The pyramid's first plane is the near one, moved outward.
    slab = np.zeros((pyramid.shape[0] + 1, 4))
    copy_rows(pyramid, slab)
    for k in range(4):
        slab[-1, k] = -pyramid[0, k]
    slab[-1, 3] += _THICK * slack
    touches, _ = ask_faces(
        vertices, corners, faces, planes, component, is_closed, light, slab, slab
    )
    return blocks, is_seen, not touches


@kernel
def _meets_sides(
    vertices, ends, edge_faces, turn, edges, planes, component, is_closed, light, pyramid
):
    """Return whether a silhouette edge may meet the pyramid, or an open face is seen edge-on."""
    for edge in range(edges[0], edges[1]):
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
                a += pyramid[k, axis] * vertices[ends[edge, 0], axis]
                b += pyramid[k, axis] * vertices[ends[edge, 1], axis]
            if a < 0.0 and b < 0.0:
                low = 2.0
            elif a < 0.0:
                low = max(low, a / (a - b))
            elif b < 0.0:
                high = min(high, a / (a - b))
        if low <= high:
            return True
    return False
