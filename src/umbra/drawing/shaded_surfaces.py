"""
Visible surfaces and their shadows as exact polygons of the picture.

What hides a planar region from the eye is found as what hides it from a light: the triangles
between the two cover polygons of its plane (``covers.py``), and Clipper2 subtracts them. The part
that is left is visible, and what the casters toward a light cover of it is in shadow.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.drawing.covers import Covers, CoverTriangles, cut_triangles, find_limits
from umbra.drawing.overlay import Ring, intersect, subtract, unite
from umbra.drawing.planar_regions import PlanarRegions
from umbra.drawing.visible_lines import VisibleLines, find_edges, find_lines
from umbra.rays.depth import rasterise_depth
from umbra.scene import Camera

__all__ = ["SurfaceFinder", "VisibleRegion"]

_LEVEL = 1e-12  # sine below which a direction lies in a plane
_LARGEST = 16  # covers that are subtracted first: they may hide all
_MOST = 192  # covers at once: Clipper takes longer by the square
_OFTEN = 64  # regions between two reports of progress
_SMALLEST = 2.0  # of a frame that is not halved further [pixels]


@dataclass(frozen=True, eq=False)
class VisibleRegion:
    """
    A planar region that is seen, in the picture.

    Parameters
    ----------
    region : int
        Its number; that of the ground is the number of regions.
    plane : (4,) float64
        Unit normal of the visible side, and offset.
    rings : list of (k, 2) float64
        Its visible part, in pixels; (0, 0) is the centre of the first pixel.
    shadows : list of (tuple of bool, list of (k, 2) float64)
        Parts of it that some lights do not reach, without overlaps: which lights do, and the rings.
    """

    region: int
    plane: NDArray[np.float64]
    rings: list[Ring]
    shadows: list[tuple[tuple[bool, ...], list[Ring]]]


class SurfaceFinder:
    """
    Finder of the visible surfaces of a view.

    Parameters
    ----------
    regions : PlanarRegions
        Of all opaque triangles.
    camera : Camera
    origin : (3,) float64
        Of the regions' coordinates [m].
    ground : float, optional
        z of a plane that is drawn, in these coordinates [m].
    is_clear : (n_regions,) bool, optional
        Regions that hide nothing.
    """

    def __init__(
        self,
        regions: PlanarRegions,
        camera: Camera,
        origin: NDArray[np.float64],
        ground: float | None = None,
        is_clear: NDArray[np.bool_] | None = None,
    ) -> None:
        self.regions, self.camera, self.ground = regions, camera, ground
        self._is_clear = np.zeros(len(regions), np.bool_) if is_clear is None else is_clear
        self._matrix, self._apex = camera.matrix(origin), camera.apex(origin)
        cols, rows = camera.size
        self._frame = (-0.5, -0.5, cols - 0.5, rows - 0.5)
        forward = camera.axes()[2]
        depth = np.append(forward, -forward @ (camera.eye - origin))
        walls = [depth - (0, 0, 0, camera.near)]
        if np.isfinite(camera.far):
            walls.append((0, 0, 0, camera.far) - depth)
        sheet = np.append(regions.sheet, len(regions))
        if ground is not None:
            above = self._find_side()
            walls.append(above + (0, 0, 0, regions.tolerance))
            heights = np.abs(regions.corners @ above[:3] + above[3]).max(1)
            lowest = np.maximum.reduceat(heights, regions.starts[:-1])
            sheet[:-1][lowest <= regions.tolerance] = len(regions)
        self._walls = np.array(walls)
        self._sheet = sheet
        self._every = CoverTriangles.of(regions.corners, regions.owner)
        self._seen = Covers(self._every, sheet)
        self._seen.is_there[:-1] = ~self._is_clear

    def _find_side(self) -> NDArray[np.float64]:
        """Return the ground's plane (4,), its normal toward the eye."""
        plane = np.array([0.0, 0.0, 1.0, -float(self.ground or 0.0)])
        return plane if plane @ self._apex > 0 else -plane

    def find_visible(self, advance: Callable[[int, int], object]) -> list[VisibleRegion]:
        """
        Find what is seen of every region, in their order; the ground comes last.

        ``advance`` is called with how many regions are done, and of how many.
        """
        r, visible = self.regions, {}
        count = len(r)
        limits = np.concatenate([self._walls, find_limits(self._matrix[:3], self._frame)])
        for number, region in enumerate(self._order()):
            plane = r.planes[region]
            height = plane @ self._apex
            if abs(height) <= (r.tolerance if self._apex[3] else _LEVEL):
                continue
            plane = plane if height > 0 else -plane
            corners = r.corners[r.starts[region] : r.starts[region + 1]]
            subject = cut_triangles(corners, self._matrix[:3], limits)
            rings = self._find_rest(subject, plane, region)
            if rings:
                visible[region] = VisibleRegion(region, plane, rings, [])
            else:  # a hidden region hides nothing more
                self._seen.is_there[region] = False
            if number % _OFTEN == 0:
                advance(number, count)
        ground = self._find_ground() if self.ground is not None else []
        return [visible[region] for region in sorted(visible)] + ground

    def _order(self) -> list[int]:
        """Return the regions to draw; first those that no pixel's centre sees."""
        r = self.regions
        faces = np.arange(3 * len(r.corners), dtype=np.int32).reshape(-1, 3)
        faces = faces[~self._is_clear[r.owner]]
        view = rasterise_depth(
            r.corners.reshape(-1, 3), faces, self._matrix, self.camera.size,
            self.camera.key_range(),
        )  # fmt: skip
        is_seen = np.zeros(len(r), np.bool_)
        is_seen[r.owner[faces[np.unique(view.face[view.face >= 0]), 0] // 3]] = True
        return np.argsort(is_seen | self._is_clear, kind="stable").tolist()

    def _find_rest(
        self, subject: list[Ring], plane: NDArray[np.float64], region: int
    ) -> list[Ring]:
        """Return what is seen of a region."""
        across = _Crossing(self._seen, self._matrix[:3], np.vstack([plane, self._walls]), region)
        return self._divide(subject, across, hides_below=True) if subject else []

    def _find_ground(self) -> list[VisibleRegion]:
        """Return what is seen of the ground."""
        plane, height = self._find_side(), float(self.ground or 0.0)
        if abs(plane @ self._apex) <= (self.regions.tolerance if self._apex[3] else _LEVEL):
            return []
        points = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, height, 1]]) @ self._matrix.T
        slope = np.linalg.solve(points[:, :3], points[:, 3])  # the key is affine in the picture
        far, near = self.camera.key_range()
        left, top, right, bottom = self._frame
        frame = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
        for limit in (slope - (0, 0, far), (0, 0, near) - slope):
            frame = _cut_ring(frame, limit) if np.isfinite(limit[2]) else frame
        if len(frame) < 3:
            return []
        rings = self._find_rest([frame], plane, len(self.regions))
        return [VisibleRegion(len(self.regions), plane, rings, [])] if rings else []

    def find_shadow(
        self, region: VisibleRegion, light: NDArray[np.float64], casters: Covers
    ) -> list[Ring]:
        """Return the part of a visible region that a light (4,) does not reach."""
        height = region.plane @ light
        if height <= (self.regions.tolerance if light[3] else 0.0):
            return region.rings
        shadow = height * np.eye(4) - np.outer(light, region.plane)
        above = shadow[3:] if light[3] else np.zeros((0, 4))
        walls = np.vstack([region.plane, above])
        across = _Crossing(casters, self._matrix[:3] @ shadow, walls, region.region)
        return self._divide(region.rings, across, hides_below=False)

    def find_lines(self, visible: Sequence[VisibleRegion]) -> VisibleLines:
        """Find the visible outlines and creases of visible regions."""
        is_visible = np.zeros(len(self.regions) + 1, np.bool_)
        is_visible[[region.region for region in visible]] = True
        edges = find_edges(self.regions, self._apex, is_visible[:-1])
        return find_lines(
            edges, self._every, self._sheet, self._seen.is_there, self._matrix, self._apex,
            self._walls, find_limits(self._matrix[:3], self._frame), self.regions.tolerance,
        )  # fmt: skip

    def make_casters(self, faces: NDArray[np.bool_]) -> Covers:
        """Return the faces that cast toward a light, as a mask over the regions' faces."""
        r = self.regions
        return Covers(CoverTriangles.of(r.corners[faces], r.owner[faces]), self._sheet)

    def _divide(self, subject: list[Ring], across: "_Crossing", *, hides_below: bool) -> list[Ring]:
        """
        Return what the eye sees of a subject, or the part of it in a shadow.

        The subject is halved as long as much lies between.
        """
        points = np.concatenate(subject)
        covers, areas, is_whole = across.covers.find(
            points, across.matrix, across.walls, across.region, self.regions.tolerance,
            hides_below=hides_below,
        )  # fmt: skip
        if is_whole:
            return [] if hides_below else subject
        low, high = points.min(0), points.max(0)
        axis = int(np.argmax(high - low))
        if len(covers) <= _MOST or high[axis] - low[axis] < _SMALLEST:
            return _leave(subject, covers, areas) if hides_below else intersect(subject, covers)
        middle = np.round((low[axis] + high[axis]) / 2)
        rings: list[Ring] = []
        for side in (0, 1):
            box = np.array([low - 1, high + 1])
            box[1 - side, axis] = middle
            (left, top), (right, bottom) = box
            half = np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
            part = intersect(subject, [half])
            if part:
                rings += self._divide(part, across, hides_below=hides_below)
        return unite(rings)


@dataclass(frozen=True, eq=False)
class _Crossing:
    """The way from a source of rays to a region: what may cross it, and the projection along it."""

    covers: Covers
    matrix: NDArray[np.float64]
    walls: NDArray[np.float64]
    region: int


def _leave(subject: list[Ring], covers: list[Ring], areas: NDArray[np.float64]) -> list[Ring]:
    """Return what covers leave of a subject; the largest may leave nothing."""
    if not covers:
        return unite(subject)
    if len(covers) <= _LARGEST:
        return subtract(subject, covers)
    order = np.argsort(-areas, kind="stable").tolist()
    rest = subtract(subject, [covers[k] for k in order[:_LARGEST]])
    return subtract(rest, [covers[k] for k in order[_LARGEST:]])


def _cut_ring(ring: Ring, limit: NDArray[np.floating]) -> Ring:
    """Cut a ring to the half plane limit . (x, y, 1) >= 0."""
    values = ring @ limit[:2] + limit[2]
    corners = []
    for k in range(len(ring)):
        a, b = values[k - 1], values[k]
        if (a < 0) != (b < 0):
            corners.append(ring[k - 1] + a / (a - b) * (ring[k] - ring[k - 1]))
        if b >= 0:
            corners.append(ring[k])
    return np.array(corners).reshape(-1, 2)
