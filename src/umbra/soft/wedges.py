"""
Penumbra wedges: soft shadows from the hard count and the silhouette edges alone.

Akenine-Möller and Assarsson 2002 and 2003. The silhouette is taken from the light's centre. The
coverage is exact for receivers for which all of the light has this silhouette and no part of it is
hidden twice; where casters overlap, their coverages are summed and clamped.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import run_shared
from umbra.machine import use_threads
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera
from umbra.soft import AreaLight, make_axes
from umbra.soft.coverage import BLOCK, add_wedges, count_tiles, make_coverage_planes
from umbra.volume.silhouette import find_silhouette_edges

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = ["ASIDE", "find_coverage", "map_to_unit_light", "visibility"]

ASIDE = 1e-3 * np.array([0.61, 0.49, 0.37])
"""Offset of the light where an edge passes its centre [radii]."""


def visibility(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
) -> NDArray[np.float32]:
    """Find the share of an area light that each visible point sees, see `umbra.soft`."""
    coverage = find_coverage(counter, view, frame, camera, light)
    return (1.0 - np.clip(coverage, 0.0, 1.0)).astype(np.float32)


def find_coverage(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
) -> NDArray[np.float64]:
    """
    Find the coverage of the light at each visible point, before clamping, float64.

    It is hard count - sum of s Q multiplicity / area: above 1 where casters overlap.
    """
    seen = view.face != NOTHING
    coverage, unsure = _cover(counter, view, frame, camera, light, seen)
    if unsure.any():
        # Rounding could put the hard count and the edge on different sides: use a light offset by a
        # thousandth of its radius, an error of at most 0.001.
        aside, _ = _cover(counter, view, frame, camera, light.moved(ASIDE), unsure)
        coverage[unsure] = aside[unsure]
    return coverage


def _cover(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    where: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the coverage, and where it may be on the wrong side of an edge."""
    caster, origin = counter.caster, counter.scene.origin
    place = light.light.local(origin)
    edges, multiplicity = find_silhouette_edges(caster, place)
    ends = caster.vertices[edges].reshape(-1, 6)
    if not light.light.is_point:
        place[:3] /= np.linalg.norm(place[:3])
    use_threads(counter.threads)
    planes = np.zeros((len(ends), 4, 4))
    make_coverage_planes(ends, place, light.radius, planes)
    coverage = np.zeros(where.shape)
    unsure = np.zeros(where.shape, np.bool_)
    lamp = place, light.radius, light.edges is not None, map_to_unit_light(light, place)
    run_shared(
        count_tiles(where.shape[0], where.shape[1], BLOCK), add_wedges,
        frame.position, origin, where, ends, multiplicity, planes, lamp, coverage, unsure,
    )  # fmt: skip
    hard = counter.count(view, camera, light.light)
    return np.where(where, hard - coverage, 0.0), unsure


def map_to_unit_light(light: AreaLight, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Find the map of a light's plane to the unit light, (3, 3).

    Rows u and v map to the unit square or disc, the third is the plane's normal; all 0 for a ball,
    whose plane faces each receiver. ``place`` (4,) is the light's centre, or a unit direction.
    """
    if light.edges is not None:
        half_u, half_v = light.edges / 2
        normal = np.cross(half_u, half_v)
        area = np.linalg.norm(normal)
        normal /= area
        return np.stack([np.cross(half_v, normal) / area, np.cross(normal, half_u) / area, normal])
    if light.light.is_point:
        return np.zeros((3, 3))
    return np.stack([*(axis / light.radius for axis in make_axes(place[:3])), place[:3]])
