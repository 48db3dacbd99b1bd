"""
The faces of shadow volumes as homogeneous polygons: sides, light caps, dark caps.

A volume is closed: light cap (the casting faces), dark cap (their counterparts at
infinity) and sides wound outward. For a directional light everything meets in one
point at infinity: no dark cap, and sides are triangles (McGuire et al. 2003,
section 6.3). Points at infinity have w = 0.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.volume.adjacency import Caster
from umbra.volume.facing import find_sides
from umbra.volume.silhouette import find_silhouette_edges

__all__ = ["VolumePolygons", "make_dark_cap", "make_light_cap", "make_sides"]


@dataclass(frozen=True, eq=False)
class VolumePolygons:
    """
    Equal polygons with multiplicities.

    ``corners`` (n, 3 or 4, 4) are homogeneous, wound counter-clockwise seen from outside the
    volume; ``multiplicity`` (n,) says how many times each one counts, above 0.
    """

    corners: NDArray[np.float64]
    multiplicity: NDArray[np.int64]


def make_light_cap(
    caster: Caster, light: NDArray[np.float64], among: NDArray[np.intp] | None = None
) -> VolumePolygons:
    """
    Return the faces that cast, turned to face the light: triangles with w = 1.

    Lit faces of closed components; all faces of open ones but those seen edge-on. Only faces
    ``among`` some, if they are given.
    """
    some = np.arange(len(caster.faces)) if among is None else among
    side = find_sides(caster.planes[:, some], light)
    turned = (side < 0) & ~caster.is_closed[caster.component[some]]
    faces = np.concatenate([caster.faces[some[side > 0]], caster.faces[some[turned]][:, ::-1]])
    corners = np.ones((len(faces), 3, 4))
    corners[..., :3] = caster.vertices[faces]
    return VolumePolygons(corners, np.ones(len(faces), np.int64))


def make_sides(caster: Caster, light: NDArray[np.float64]) -> VolumePolygons:
    """Sweep the silhouette to infinity: quads for a point light, triangles for a direction."""
    edges, multiplicity = find_silhouette_edges(caster, light)
    corners = np.ones((len(edges), 4 if light[3] else 3, 4))
    ends = caster.vertices[edges]
    # A lit face lies left of its edge: the side goes back along it, then away.
    corners[:, 0, :3] = ends[:, 1]
    corners[:, 1, :3] = ends[:, 0]
    if light[3]:
        corners[:, 2] = _extrude(ends[:, 0], light)
        corners[:, 3] = _extrude(ends[:, 1], light)
    else:
        corners[:, 2] = _extrude(ends[:, 0], light)
    return VolumePolygons(corners, multiplicity)


def make_dark_cap(caster: Caster, light: NDArray[np.float64]) -> VolumePolygons:
    """
    Close the volume at infinity: triangles with w = 0; none for a directional light.

    A fan over the extruded silhouette (McGuire et al. 2003) is enough, and cheap,
    where the light is outside the caster's bounds; a fan around an enclosed light
    closes the wrong way and shifts every z-fail count, so there the light cap's
    faces are extruded instead (docs/papers.md, M3).
    """
    if light[3] == 0:
        return VolumePolygons(np.zeros((0, 3, 4)), np.zeros(0, np.int64))
    used = caster.vertices[caster.faces.ravel()]
    low, high = used.min(0), used.max(0)
    margin = 1e-6 * (high - low).max()  # a light in a wall sees the silhouette all around it
    if ((light[:3] > low - margin) & (light[:3] < high + margin)).all():
        cap = make_light_cap(caster, light)
        return VolumePolygons(
            _extrude(cap.corners[:, ::-1, :3].reshape(-1, 3), light).reshape(-1, 3, 4),
            cap.multiplicity,
        )
    edges, multiplicity = find_silhouette_edges(caster, light)
    if not len(edges):
        return VolumePolygons(np.zeros((0, 3, 4)), multiplicity)
    ends = caster.vertices[edges]
    hub = np.broadcast_to(ends[0, 0], (len(edges), 3))
    fan = np.stack([hub, ends[:, 1], ends[:, 0]], 1)  # the dark cap shows its back to the light
    return VolumePolygons(_extrude(fan.reshape(-1, 3), light).reshape(-1, 3, 4), multiplicity)


def _extrude(points: NDArray[np.float64], light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points at infinity in whose direction the light throws points, (n, 4)."""
    away = np.zeros((len(points), 4))
    away[:, :3] = light[3] * points - light[:3]
    return away
