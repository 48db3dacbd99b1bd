"""
Drawings as vectors: what a camera sees of a model, and its shadows, as exact polygons.

::

    planar_regions  triangles of a part that lie in one plane
    -> covers  what lies between a region and the eye or a light, in the picture
    -> overlay  unions and differences of polygons
    -> shaded_surfaces  visible part of each region, and the shadows on it
    -> visible_lines  visible part of each edge
    -> see_model  all that a drawing of a view shows, in pixels
    -> drawn_page  the drawing ready to be written
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.drawing.overlay import Ring, intersect, subtract
from umbra.drawing.planar_regions import PlanarRegions, find_regions
from umbra.drawing.shaded_surfaces import SurfaceFinder, VisibleRegion
from umbra.drawing.visible_lines import VisibleLines
from umbra.scene import Camera, Light, Scene
from umbra.scene.scene import Triangles

__all__ = ["SeenModel", "see_model"]

Shadows = list[tuple[tuple[bool, ...], list[Ring]]]


@dataclass(frozen=True, eq=False)
class SeenModel:
    """
    What a camera sees of a model.

    Parameters
    ----------
    regions : PlanarRegions
        In coordinates about ``origin``.
    origin : (3,) float64
    surfaces : list of VisibleRegion
        Opaque ones, the ground last; then transparent ones, from back to front.
    lines : VisibleLines
    """

    regions: PlanarRegions
    origin: NDArray[np.float64]
    surfaces: list[VisibleRegion]
    lines: VisibleLines


def see_model(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    casters: Sequence[int],
    ground: float | None = None,
    advance: Callable[[int, int, str, str], object] = lambda *_told: None,
) -> SeenModel:
    """
    Find the visible surfaces of a view, the shadows on them, and the visible lines.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    lights : sequence of Light
        Directions and points.
    casters : sequence of int
        Indices of the parts that cast.
    ground : float, optional
        z of a plane that is drawn [m].
    advance : callable
        Called with what is done, of how much, a name for it, and its unit.
    """
    soup = scene.triangles()
    middle = scene.bounds().mean(0) - scene.origin
    origin = scene.origin + middle
    regions = find_regions(Triangles(soup.vertices - middle, soup.faces, soup.part))
    is_clear = np.array([part.transmits for part in scene.parts], np.bool_)[regions.part]
    height = None if ground is None else ground - float(origin[2])
    finder = SurfaceFinder(regions, camera, origin, height, is_clear)
    seen = finder.find_visible(
        lambda done, every: advance(done, every, "finding what is seen", "surfaces")
    )
    casts = np.zeros(len(scene.parts), np.bool_)
    casts[list(casters)] = True
    covers = finder.make_casters((casts[regions.part] & ~is_clear)[regions.owner])
    places = [light.local(origin) for light in lights]
    surfaces = []
    for number, region in enumerate(seen):
        dark = [finder.find_shadow(region, light, covers) for light in places]
        surfaces.append(replace(region, shadows=_combine(dark)))
        if number % 64 == 0:
            advance(number, len(seen), "finding shadows", "surfaces")
    advance(0, 1, "finding lines", "views")
    lines = finder.find_lines(seen)
    return SeenModel(regions, origin, _sort(surfaces, regions, is_clear, camera), lines)


def _combine(dark: Sequence[list[Ring]]) -> Shadows:
    """Divide the shadows of several lights into parts that the same lights reach."""
    shadows: Shadows = []
    for number, rings in enumerate(dark):
        if not rings:
            continue
        mask = tuple(k != number for k in range(len(dark)))
        new: Shadows = []
        rest = rings
        for other, held in shadows:
            both = tuple(a and b for a, b in zip(mask, other, strict=True))
            shared = intersect(held, rings)
            new += [(both, shared), (other, subtract(held, rings) if shared else held)]
            rest = subtract(rest, held) if shared else rest
        shadows = [(bits, held) for bits, held in [*new, (mask, rest)] if held]
    return shadows


def _sort(
    surfaces: list[VisibleRegion],
    regions: PlanarRegions,
    is_clear: NDArray[np.bool_],
    camera: Camera,
) -> list[VisibleRegion]:
    """Put transparent surfaces last, the farthest first."""
    clear = np.append(is_clear, False)
    forward = camera.axes()[2]

    def find_depth(region: VisibleRegion) -> float:
        corners = regions.corners[regions.starts[region.region] : regions.starts[region.region + 1]]
        return float(corners.reshape(-1, 3).mean(0) @ forward)

    through = sorted(
        (surface for surface in surfaces if clear[surface.region]), key=find_depth, reverse=True
    )
    return [surface for surface in surfaces if not clear[surface.region]] + through
