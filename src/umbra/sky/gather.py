"""
The casting faces as a point sees them: those above its horizon and before its plane, cut to both.

Coordinates are relative to the point. A face whose plane holds the point covers nothing. An edge
with a face on either side of it, as seen from the point, cannot bound the free sky; the others may,
and are the silhouette. Which faces there are, and how they are wound, does not matter.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, copy_numbers, copy_rows, kernel
from umbra.sky.occluders import is_face_hidden, raise_cover
from umbra.sky.skyline import (
    BOXES,
    FACES,
    find_layer,
    find_near_boxes,
    find_outline,
    is_box_hidden,
    is_box_out,
    is_covered,
)

__all__ = ["CORNERS", "HORIZON", "PLANE", "SeenFaces", "gather_faces", "keep_above"]

CORNERS = 6
"""
Most corners of a face that is cut to the horizon and to the receiver's plane.

They are five, but for a needle within rounding of the plane: of its four above the horizon every
second may lie before the plane, so that two stay and each of four sides is cut.
"""
HORIZON, PLANE = -1, -2
"""Edges that are not of the face: on the horizon, on the receiver's plane."""


class SeenFaces(NamedTuple):
    """
    Faces cut to the upper half and to what lies before the receiver's plane.

    Parameters
    ----------
    corners : (n, CORNERS, 3) float64
        Relative to the point, so ordered that lower edges go counter-clockwise around the zenith
        [m].
    size : (n,) int32
        Corners of each.
    edge : (n, CORNERS) int32
        Edge from corner k to k + 1: its number, ``HORIZON`` or ``PLANE``.
    face : (n,) int32
    bounds : (n, 4) float64
        Tangents that no altitude is below, and above, and places in the turn, see ``find_outline``.
    sides : (n_edges,) uint8
        Bits 1 and 2: whether an edge has faces on its one and its other side.
    """

    corners: NDArray[np.float64]
    size: NDArray[np.int32]
    edge: NDArray[np.int32]
    face: NDArray[np.int32]
    bounds: NDArray[np.float64]
    sides: NDArray[np.uint8]


@borrowing
def _find_distance(corners):
    """Return a horizontal distance below which nothing of a triangle lies: that of its box."""
    square = 0.0
    for j in range(2):
        low = min(corners[0, j], corners[1, j], corners[2, j])
        high = max(corners[0, j], corners[1, j], corners[2, j])
        square += max(low, -high, 0.0) ** 2
    return math.sqrt(square)


@kernel
def gather_faces(casters, p, normal, covers, reaches, raises):
    """
    Find the faces that can cover sky before a plane.

    ``casters`` is a ``SkyCasters``, ``p`` the point and ``normal`` its plane's unit normal, (3,).
    Faces within one of the ``covers`` (k, BINS, 6) are left out if they are farther away than its
    ``reaches`` (k,) [m], rising. If this ``raises`` it, the faces add what they cover to the first
    and only cover.
    """
    vertices, faces, edges, planes = casters.vertices, casters.faces, casters.edges, casters.planes
    boxes = casters.boxes
    is_group_hidden = False
    room = 512
    corners = np.empty((room, CORNERS, 3))
    size = np.empty(room, np.int32)
    edge = np.empty((room, CORNERS), np.int32)
    face, bounds = np.empty(room, np.int32), np.empty((room, 4))
    sides = np.zeros(casters.n_edges, np.uint8)
    polygon, clipped = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    keys, other = np.empty(CORNERS, np.int32), np.empty(CORNERS, np.int32)
    arcs = np.empty((CORNERS, 4))
    level = np.array([0.0, 0.0, 1.0])
    n = 0
    groups = find_near_boxes(casters.box_boxes, p, normal)
    for which in range(groups.size * BOXES):
        group, member = groups[which // BOXES], which % BOXES
        block = group * BOXES + member
        if member == 0:
            is_group_hidden = is_box_hidden(covers, reaches, casters.box_boxes[group], p)
        if is_group_hidden or block >= boxes.shape[0]:
            continue
        if is_box_out(boxes[block], p, normal) or is_box_hidden(covers, reaches, boxes[block], p):
            continue
        if n + FACES > room:
            room *= 2
            corners, size, edge, face, bounds = _grow(corners, size, edge, face, bounds, n)
        for f in range(block * FACES, min(faces.shape[0], (block + 1) * FACES)):
            highest = nearest = -np.inf
            lowest = farthest = np.inf
            first = faces[f, 0]
            height = 0.0
            for j in range(3):
                height += planes[f, j] * (vertices[first, j] - p[j])
            if abs(height) <= planes[f, 3]:
                continue
            # In the order in which lower edges go counter-clockwise around the zenith.
            for k in range(3):
                c = k if height > 0.0 else 2 - k
                ahead = 0.0
                for j in range(3):
                    polygon[k, j] = vertices[faces[f, c], j] - p[j]
                    ahead += normal[j] * polygon[k, j]
                highest, lowest = max(highest, polygon[k, 2]), min(lowest, polygon[k, 2])
                nearest, farthest = max(nearest, ahead), min(farthest, ahead)
                keys[k] = edges[f, c if height > 0.0 else (c + 2) % 3] >> 1
            if highest <= 0.0 or nearest <= 0.0:
                continue
            low, high, start, end = find_outline(polygon, 3)
            layer = 0 if raises else find_layer(reaches, _find_distance(polygon))
            if layer >= 0 and is_covered(covers[layer], start, end, low, high):
                continue
            m = 3
            if lowest <= 0.0 or farthest <= 0.0:
                m = _cut(polygon, keys, 3, level, HORIZON, clipped, other)
                m = _cut(clipped, other, m, normal, PLANE, polygon, keys)
                if m < 3:
                    continue
                low, high, start, end = find_outline(polygon, m)
            for k in range(3):
                is_left = (height > 0.0) != (edges[f, k] & 1 == 1)
                sides[edges[f, k] >> 1] |= 1 if is_left else 2
            for k in range(m):
                edge[n, k] = keys[k]
                for j in range(3):
                    corners[n, k, j] = polygon[k, j]
            size[n], face[n] = m, f
            bounds[n, 0], bounds[n, 1], bounds[n, 2], bounds[n, 3] = low, high, start, end
            n += 1
            if raises:
                raise_cover(polygon, m, start, end, high, arcs, covers[0])
    return SeenFaces(corners[:n], size[:n], edge[:n], face[:n], bounds[:n], sides)


@kernel
def _grow(corners, size, edge, face, bounds, n):
    """Double the room of faces."""
    room = 2 * size.size
    more, keys = np.empty((room, CORNERS, 3)), np.empty((room, CORNERS), np.int32)
    sizes, numbers = np.empty(room, np.int32), np.empty(room, np.int32)
    outlines = np.empty((room, 4))
    for i in range(n):
        copy_rows(corners[i], more[i])
        copy_numbers(edge[i], keys[i])
        copy_numbers(bounds[i], outlines[i])
        sizes[i], numbers[i] = size[i], face[i]
    return more, sizes, keys, numbers, outlines


@kernel
def keep_above(seen, cover):
    """Return the faces of a ``SeenFaces`` that a cover (BINS, 6) does not hide."""
    above = np.empty(seen.size.size, np.int32)
    arcs = np.empty((CORNERS, 4))
    n = 0
    for i in range(seen.size.size):
        if not is_face_hidden(cover, seen.corners[i], seen.size[i], seen.bounds[i], arcs):
            above[n] = i
            n += 1
    above = above[:n]
    return SeenFaces(
        seen.corners[above], seen.size[above], seen.edge[above], seen.face[above],
        seen.bounds[above], seen.sides,
    )  # fmt: skip


@borrowing
def _cut(points, keys, n, normal, key, clipped, names):
    """
    Cut a convex polygon to the half space before a plane through the origin; return its corners.

    A cut point is computed from the corner outside, so that all faces of an edge share it.
    """
    m = 0
    for k in range(n):
        after = k + 1 if k + 1 < n else 0
        here = there = 0.0
        for j in range(3):
            here += normal[j] * points[k, j]
            there += normal[j] * points[after, j]
        if here > 0.0:
            for j in range(3):
                clipped[m, j] = points[k, j]
            names[m] = keys[k]
            m += 1
        if (here > 0.0) != (there > 0.0):
            if here > 0.0:
                start, end, share = after, k, there / (there - here)
            else:
                start, end, share = k, after, here / (here - there)
            for j in range(3):
                clipped[m, j] = points[start, j] + share * (points[end, j] - points[start, j])
            if normal[2] == 1.0:
                clipped[m, 2] = 0.0
            names[m] = key if here > 0.0 else keys[k]
            m += 1
    return m
