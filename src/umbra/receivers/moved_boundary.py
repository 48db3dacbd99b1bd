"""
A plot's boundary, moved across the roads, water and railways beside it.

Japan's Building Standards Act (Order, article 135-12) counts a boundary on a road from half of the
road's width W, and on one wider than 10 m from 5 m inside its far side. The greater of W / 2 and
W - 5 m is the one up to 10 m, and the other beyond.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.receivers.area_search import find_areas
from umbra.scene import Scene
from umbra.scene.named_places import Area

__all__ = [
    "HALF_UP_TO", "find_roads", "join_roads", "move_areas", "move_boundary", "tell_frontages",
]  # fmt: skip

HALF_UP_TO = 10.0
"""Width up to which half of a road counts; beyond, all but half of this width [m]."""
_BESIDE = 0.5  # between the boundary and a road that it adjoins, as maps are drawn [m]
_SLIVER = 0.02  # between roads that are one [m]
_STEP = 1.0  # between the places where a road's width is measured [m]
_INSET = 1e-4  # of the outer ones from the ends of a frontage [m]
_JUNCTION = 1.5  # times the frontage's median width: there another road begins
_FARTHEST = 500.0  # widest road or water [m]
_STRAIGHT = 1e-9  # sine of the turn between two sides of one line
_MITRE = 3.0  # times the greater of two moves: the farthest corner between them

Points = NDArray[np.float64]


def find_roads(scene: Scene, asked: Any) -> Any:
    """
    Return the union of roads, water and railways that are asked for, in the model's coordinates.

    Parameters
    ----------
    scene : Scene
    asked : path, str, sequence of str, mapping, or GeoDataFrame
        As areas are asked for: a file of polygons, or parts and kinds of the model.

    Raises
    ------
    InputError
        If there are none, or one is no valid polygon.
    """
    if _are_placed(asked):
        return join_roads(asked)
    try:
        areas, _ = find_areas(scene, asked, "roads")
    except InputError as error:
        error.data["option"] = "roads"
        raise
    return join_roads(areas)


def _are_placed(asked: Any) -> bool:
    """Return whether roads are areas in the model's own coordinates already."""
    return isinstance(asked, (list, tuple)) and all(isinstance(one, Area) for one in asked)


def join_roads(areas: Sequence[Area]) -> Any:
    """Return the union of roads; those that touch are one."""
    shapely = need("shapely", "gis", "roads")
    wide = shapely.buffer(
        [area.polygon for area in areas], _SLIVER, join_style="mitre", cap_style="flat"
    )
    whole = shapely.union_all(wide)
    return shapely.buffer(whole, -_SLIVER, join_style="mitre")


def move_boundary(
    plot: Any, roads: Any, half_up_to: float = HALF_UP_TO
) -> tuple[Any, list[tuple[float, float, float]]]:
    """
    Move a plot's boundary outward where it adjoins a road.

    Parameters
    ----------
    plot : shapely polygon or multipolygon
    roads : shapely geometry
        Roads that touch are one, as wide as both.
    half_up_to : float
        Width up to which the boundary comes to the middle of a road; to all but half of this
        width beyond it [m].

    Returns
    -------
    moved : shapely geometry
        The plot with the strips in front of it. Strips of two sides meet at a corner, as lines
        parallel to the sides do.
    frontages : list of (length, width, move)
        Of each frontage: its length, and the median width and move [m].
    """
    shapely = need("shapely", "gis", "roads")
    open_roads = shapely.difference(roads, plot)
    strips, frontages = [plot], []
    for part in shapely.get_parts(plot):
        ring = shapely.get_exterior_ring(shapely.orient_polygons(part))
        corners = shapely.get_coordinates(ring)
        edges = [
            _Edge.of(a, b, open_roads, half_up_to)
            for a, b in pairwise(corners)
            if np.hypot(*(b - a)) > _INSET
        ]
        for edge in edges:
            for piece in edge.pieces:
                strips.append(piece.make_strip(shapely, edge.outward))
                frontages.append(piece.measures)
        for one, other in zip(edges, [*edges[1:], *edges[:1]], strict=True):
            corner = _make_corner(shapely, one, other)
            if corner is not None:
                strips.append(corner)
    return shapely.union_all([shapely.make_valid(strip) for strip in strips]), frontages


class _Piece:
    """
    A piece of a straight side that adjoins a road.

    Parameters
    ----------
    places : (n, 2) float64
        Along it.
    widths : (n,) float64
        Of the road in front of each [m].
    gaps : (n,) float64
        From each to the road [m].
    """

    def __init__(self, places: Points, widths: Points, gaps: Points, half_up_to: float) -> None:
        middle = float(np.median(widths))
        # Opposite a side street the ray runs on along it.
        widths = np.where(widths > _JUNCTION * middle, middle, widths)
        self.places = places
        self.moves = gaps + np.maximum(widths / 2, widths - half_up_to / 2)
        length = float(np.hypot(*(places[-1] - places[0])))
        self.measures = (length, float(np.median(widths)), float(np.median(self.moves)))

    def make_strip(self, shapely: Any, outward: Points) -> Any:
        """Return the strip in front of it."""
        far = self.places + outward * self.moves[:, None]
        return shapely.polygons(np.concatenate([self.places, far[::-1]]))


class _Edge:
    """A straight side of a plot, counter-clockwise, and its pieces that adjoin roads."""

    def __init__(self, start: Points, end: Points, pieces: Sequence[_Piece]) -> None:
        self.start, self.end, self.pieces = start, end, pieces
        along = (end - start) / np.hypot(*(end - start))
        self.along, self.outward = along, np.array([along[1], -along[0]])

    @classmethod
    def of(cls, start: Points, end: Points, roads: Any, half_up_to: float) -> "_Edge":
        """Find the pieces of a side in front of which roads lie."""
        shapely = need("shapely", "gis", "roads")
        edge = cls(start, end, ())
        beside = shapely.linestrings(np.array([start, end]) + edge.outward * _BESIDE)
        found = []
        for part in shapely.get_parts(shapely.intersection(beside, roads)):
            if shapely.get_type_id(part) != 1 or shapely.length(part) < 2 * _INSET:
                continue
            ends = np.sort((shapely.get_coordinates(part)[[0, -1]] - start) @ edge.along)
            count = max(2, math.ceil((ends[1] - ends[0]) / _STEP) + 1)
            t = np.linspace(ends[0], ends[1], count)
            places = start + t[:, None] * edge.along
            inset = start + np.clip(t, ends[0] + _INSET, ends[1] - _INSET)[:, None] * edge.along
            gaps, widths = _measure(shapely, inset, edge.outward, roads)
            if np.isfinite(widths).all():
                found.append(_Piece(places, widths, gaps, half_up_to))
        edge.pieces = found
        return edge


def _measure(shapely: Any, places: Points, outward: Points, roads: Any) -> tuple[Points, Points]:
    """Return the gap before the road and its width in front of places; NaN without one [m]."""
    rays = shapely.linestrings(np.stack([places, places + outward * _FARTHEST], axis=1))
    gaps, widths = np.full(len(places), np.nan), np.full(len(places), np.nan)
    for k, found in enumerate(shapely.intersection(rays, roads)):
        spans = sorted(
            tuple(np.sort((shapely.get_coordinates(part) - places[k]) @ outward)[[0, -1]])
            for part in shapely.get_parts(found)
            if shapely.get_type_id(part) == 1
        )
        if spans and spans[0][0] <= _BESIDE + _INSET:
            gaps[k], widths[k] = spans[0][0], spans[0][1] - spans[0][0]
    return gaps, widths


def _make_corner(shapely: Any, one: _Edge, other: _Edge) -> Any:
    """Return what lies between the strips of two sides at a convex corner; None without."""
    turn = one.along[0] * other.along[1] - one.along[1] * other.along[0]
    if turn <= _STRAIGHT or not one.pieces or not other.pieces:
        return None
    last, first, at = one.pieces[-1], other.pieces[0], one.end
    near = max(np.hypot(*(last.places[-1] - at)), np.hypot(*(first.places[0] - at)))
    if near > _BESIDE + _INSET:
        return None
    a = at + one.outward * last.moves[-1]
    b = at + other.outward * first.moves[0]
    ahead = ((b - a) @ other.outward) / (one.along @ other.outward)
    meet = a + one.along * ahead
    most = _MITRE * max(last.moves[-1], first.moves[0])
    shape = [at, a, meet, b] if ahead >= 0 and np.hypot(*(meet - at)) <= most else [at, a, b]
    return shapely.polygons(np.array(shape))


def tell_frontages(name: str, frontages: Sequence[tuple[float, float, float]]) -> str:
    """Say by how much a boundary moves, for the reader to check."""
    if not frontages:
        return f"{name}: no road or water within {_BESIDE:g} m of its boundary, which stays"
    moved = ", ".join(
        f"{move:.2f} m along {length:.1f} m (road of {width:.2f} m)"
        for length, width, move in frontages[:6]
    )
    more = f" and {len(frontages) - 6} more" if len(frontages) > 6 else ""
    return f"{name}: its boundary moves outward by {moved}{more}"


def move_areas(
    areas: Sequence[Area], roads: Any, half_up_to: float = HALF_UP_TO
) -> tuple[list[Any], list[str]]:
    """Return the polygons of areas with their boundaries moved, and how far each is."""
    moved, told = [], []
    for area in areas:
        polygon, frontages = move_boundary(area.polygon, roads, half_up_to)
        moved.append(polygon)
        told.append(tell_frontages(area.name, frontages))
    return moved, told
