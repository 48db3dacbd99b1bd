"""
A plain ray caster in float64: brute force over all triangles, no offset, no tree.

It shares nothing with umbra but the counting rule. A triangle is pierced where the
point and the light lie strictly on opposite sides of its plane and the way between
them passes inside its three edges. Each edge is asked in one direction only, from
the lower of its welded vertices to the higher, so two triangles that share an edge
never both miss a way, nor both take it.

A point is meant as the limit from the viewer's side: a face that the point lies on
(its own, or one within ``TOUCH``) is between point and light exactly if the viewer
and the light are on opposite sides of it.

A face that holds the light, no farther from it than ``HOLDS`` of the largest coordinate,
is between no point and that light.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

TOUCH = 1e-6
"""Within this distance of a plane [m] a point lies on it."""

HOLDS = 2.0**-44
"""Within so much of the largest coordinate a light lies on a face."""

ASIDE = np.array([0.61e-9, 0.57e-9, 0.0])
"""How far a point steps aside when its way to the light passes through a vertex [m]."""


@dataclass(frozen=True, eq=False)
class Pierced:
    """
    What lies between points and a light.

    Parameters
    ----------
    count : (n,) int64
        Pierced triangles that add to the shadow count: lit ones of closed
        components, all of open ones.
    any : (n,) bool
        Whether any triangle at all is pierced.
    touching : (n,) int64
        Triangles on which the point lies, its own one left out.
    """

    count: np.ndarray
    any: np.ndarray
    touching: np.ndarray


class RayCaster:
    """
    All triangles of a soup.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
    faces : (n_faces, 3) int
    origin : (3,) float64
        Of their frame: coordinates are as coarse as they are in the model's own.
    """

    def __init__(self, vertices, faces, origin=(0.0, 0.0, 0.0)):
        vertices = np.asarray(vertices, np.float64) + 0.0
        self.origin = np.abs(origin).max()
        self.vertices, place = np.unique(vertices, axis=0, return_inverse=True)
        self.faces = place.ravel()[np.asarray(faces)].astype(np.int64).reshape(-1, 3)

    def count(self, points, own, eye, light, is_closed, touch=TOUCH):
        """
        Count the triangles between points and a light.

        Parameters
        ----------
        points : (n, 3) float64
        own : (n,) int
            The face that each point lies on; negative for none.
        eye, light : (4,) float64
            Homogeneous.
        is_closed : (n_faces,) bool
            Whether only its lit side lets a face count.
        touch : float
            Within this distance of a plane a point lies on it [m].
        """
        points = np.array(points, np.float64)
        own = np.asarray(own, np.int64)
        pierced = Pierced(*(np.zeros(len(points), kind) for kind in (np.int64, bool, np.int64)))
        which = np.arange(len(points))
        for _ in range(4):
            count, found, touching, corner = (np.zeros(len(which), np.int64) for _ in range(4))
            _pierce(
                points[which],
                own[which],
                np.asarray(eye, np.float64),
                np.asarray(light, np.float64),
                self.vertices,
                self.faces,
                np.asarray(is_closed, bool),
                self.holds(np.asarray(light, np.float64)),
                touch,
                count,
                found,
                touching,
                corner,
            )
            pierced.count[which], pierced.any[which], pierced.touching[which] = (
                count,
                found > 0,
                touching,
            )
            # Some ways lead exactly through a vertex, where faces cannot agree: step aside.
            which = which[corner > 0]
            if not len(which):
                break
            points[which] += ASIDE
        return pierced

    def holds(self, light):
        """Tell which faces hold a light, (n_faces,) bool: in the digits of a long double."""
        if light[3] == 0.0:
            return np.zeros(len(self.faces), bool)
        place = light[:3].astype(np.longdouble) / light[3]
        corners = self.vertices[self.faces].astype(np.longdouble)
        size = np.maximum(np.abs(corners).max((1, 2)), np.abs(place).max()) + self.origin
        a, b, c = (corners[:, k] - place for k in range(3))
        normal = np.cross(b - a, c - a)
        square = np.einsum("ij,ij->i", normal, normal)
        apart = np.full(len(a), np.inf, np.longdouble)
        is_over = square > 0
        for p, q in ((a, b), (b, c), (c, a)):
            along = q - p
            length = np.einsum("ij,ij->i", along, along)
            t = -np.einsum("ij,ij->i", p, along) / np.where(length > 0, length, 1)
            nearest = p + np.clip(t, 0, 1)[:, None] * along
            apart = np.minimum(apart, np.sqrt(np.einsum("ij,ij->i", nearest, nearest)))
            is_over &= np.einsum("ij,ij->i", normal, np.cross(p, q)) >= 0
        height = np.abs(np.einsum("ij,ij->i", normal, a)) / np.sqrt(np.where(is_over, square, 1))
        return np.asarray(np.where(is_over, np.minimum(height, apart), apart) <= HOLDS * size)

    def winding_excess(self, eye, light, component):
        """
        Give each component's winding number at the eye less that at the light.

        It is the number of lit faces less that of unlit faces on the way between.
        """
        # From the light, which may be as near to faces as float64 can tell.
        start, end = (light, eye) if light[3] else (eye, light)
        excess = np.zeros(int(component.max(initial=-1)) + 1, np.int64)
        if start[3] == 0:
            return excess
        point = (start[:3] / start[3])[None]
        turn = 1 if start is eye else -1
        for part in range(len(excess)):
            mine = RayCaster(self.vertices, self.faces[component == part])
            mine.origin = self.origin
            lit, both = (
                mine.count(point, [-1], end, end, np.full(len(mine.faces), rule), 0.0).count[0]
                for rule in (True, False)
            )
            excess[part] = turn * (2 * lit - both)
        return excess

    def silhouette(self, light, is_closed):
        """Find the edges across which the count can change, (n, 2) vertex indices."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        side = normal @ light[:3] - light[3] * np.einsum("ij,ij->i", normal, a)
        adds = np.where(side > 0, 1, np.where((side < 0) & ~is_closed, -1, 0))
        adds[self.holds(light)] = 0
        tail, head = self.faces.ravel(), np.roll(self.faces, -1, 1).ravel()
        along = np.repeat(adds, 3) * np.where(tail < head, 1, -1)
        pairs = np.stack([np.minimum(tail, head), np.maximum(tail, head)], 1)
        edges, place = np.unique(pairs, axis=0, return_inverse=True)
        sums = np.bincount(place.ravel(), along, len(edges))
        return edges[sums != 0]

    def distance_to_shadow_edges(self, points, normals, own, light, is_closed):
        """
        Give how far each point is from the nearest place where its count changes.

        Measured in the point's own plane: to the shadows of silhouette edges, and
        to the lines along which triangles cut the plane.

        Returns
        -------
        distance : (n,) float64
        """
        distance = np.full(len(points), np.inf)
        _measure(
            np.ascontiguousarray(points, np.float64),
            np.ascontiguousarray(normals, np.float64),
            np.asarray(own, np.int64),
            np.asarray(light, np.float64),
            self.vertices,
            self.faces,
            self.silhouette(light, np.asarray(is_closed, bool)),
            distance,
        )
        return distance


# Tuples: numba takes seconds to compile arithmetic of whole arrays.
@njit(cache=True, nogil=True)
def _row(rows, i):
    return rows[i, 0], rows[i, 1], rows[i, 2]


@njit(cache=True, nogil=True)
def _go(p, far, way):
    """Give p + far * way."""
    return p[0] + far * way[0], p[1] + far * way[1], p[2] + far * way[2]


@njit(cache=True, nogil=True)
def _triple(d, p, q):
    """Give d . (p x q)."""
    return (
        d[0] * (p[1] * q[2] - p[2] * q[1])
        + d[1] * (p[2] * q[0] - p[0] * q[2])
        + d[2] * (p[0] * q[1] - p[1] * q[0])
    )


@njit(cache=True, nogil=True)
def _dot(p, q):
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@njit(cache=True, nogil=True)
def _is_inside(way, corners, face):
    """
    Whether the way from 0 passes inside a triangle, and whether through a corner of it.

    Each edge is asked in one direction.
    """
    ahead = 0
    through = 0
    for k in range(3):
        n = (k + 1) % 3
        i, j = (k, n) if face[k] < face[n] else (n, k)
        side = _triple(way, corners[i], corners[j])
        ahead += (side >= 0.0) == (i == k)
        square = _dot(way, way) * _dot(corners[i], corners[i]) * _dot(corners[j], corners[j])
        through += side * side <= 1e-28 * square
    return ahead in (0, 3), through > 1


@njit(cache=True, nogil=True)
def _pierce(
    points, own, eye, light, vertices, faces, is_closed, held, touch, count, found, touching, corner
):
    way = np.empty(3)
    corners = np.empty((3, 3))
    lamp, watcher = (light[0], light[1], light[2]), (eye[0], eye[1], eye[2])
    for f in range(faces.shape[0]):
        a, b, c = (
            _row(vertices, faces[f, 0]),
            _row(vertices, faces[f, 1]),
            _row(vertices, faces[f, 2]),
        )
        u, v = _go(b, -1.0, a), _go(c, -1.0, a)
        normal = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        length = np.sqrt(_dot(normal, normal))
        if length == 0.0:
            continue
        normal = normal[0] / length, normal[1] / length, normal[2] / length
        at_light = _dot(normal, _go(lamp, -light[3], a))
        at_eye = _dot(normal, _go(watcher, -eye[3], a))
        if at_light == 0.0 or held[f]:
            continue
        casts = at_light > 0.0 or not is_closed[f]
        for i in range(points.shape[0]):
            height = 0.0
            for k in range(3):
                height += normal[k] * (points[i, k] - a[k])
            if own[i] == f:
                if at_eye * at_light < 0.0:
                    count[i] += casts
                    found[i] += 1
                continue
            on_it = abs(height) <= touch
            if not on_it and not height * at_light < 0.0:
                continue
            for k in range(3):
                way[k] = light[k] - light[3] * points[i, k]
                corners[0, k] = a[k] - points[i, k]
                corners[1, k] = b[k] - points[i, k]
                corners[2, k] = c[k] - points[i, k]
            inside, through = _is_inside(way, corners, faces[f])
            corner[i] += through
            if not inside:
                continue
            touching[i] += on_it
            if not on_it or at_eye * at_light < 0.0:
                count[i] += casts
                found[i] += 1


@njit(cache=True, nogil=True)
def _to_segment(p, q):
    """Give the distance from 0 to the segment between two points."""
    along = _go(q, -1.0, p)
    square = _dot(along, along)
    t = 0.0 if square == 0.0 else min(1.0, max(0.0, -_dot(p, along) / square))
    nearest = _go(p, t, along)
    return np.sqrt(_dot(nearest, nearest))


@njit(cache=True, nogil=True)
def _measure(points, normals, own, light, vertices, faces, edges, distance):
    cut = np.empty((3, 3))
    lamp = light[0], light[1], light[2]
    for i in range(points.shape[0]):
        point, normal = _row(points, i), _row(normals, i)
        way = _go(lamp, -light[3], point)
        rise = _dot(normal, way)
        if rise < 0.0:  # look at the plane from the side that the light is on
            normal = -normal[0], -normal[1], -normal[2]
            rise = -rise
        # Lines along which triangles cut the plane.
        for f in range(faces.shape[0]):
            if f == own[i]:
                continue
            n = 0
            for k in range(3):
                p = _go(_row(vertices, faces[f, k]), -1.0, point)
                q = _go(_row(vertices, faces[f, (k + 1) % 3]), -1.0, point)
                hp, hq = _dot(normal, p), _dot(normal, q)
                if (hp > 0.0) != (hq > 0.0):
                    cut[n, 0], cut[n, 1], cut[n, 2] = _go(p, hp / (hp - hq), _go(q, -1.0, p))
                    n += 1
            if n == 2:
                distance[i] = min(distance[i], _to_segment(_row(cut, 0), _row(cut, 1)))
        # Shadows of silhouette edges, of the part between the plane and the light.
        for e in range(edges.shape[0]):
            start = _go(_row(vertices, edges[e, 0]), -1.0, point)
            end = _go(_row(vertices, edges[e, 1]), -1.0, point)
            low, high = 0.0, 1.0
            h0, h1 = _dot(normal, start), _dot(normal, end)
            top = rise * (1.0 - 1e-12) if light[3] > 0.0 else np.inf
            for bound, sign in ((-TOUCH, 1.0), (top, -1.0)):
                g0, g1 = sign * (h0 - bound), sign * (h1 - bound)
                if bound == np.inf:
                    continue
                if g0 < 0.0 and g1 < 0.0:
                    high = -1.0
                elif g0 < 0.0:
                    low = max(low, g0 / (g0 - g1))
                elif g1 < 0.0:
                    high = min(high, g0 / (g0 - g1))
            if low > high:
                continue
            along = _go(end, -1.0, start)
            p, q = _go(start, low, along), _go(start, high, along)
            down_p, down_q = _go(way, -light[3], p), _go(way, -light[3], q)
            fall_p, fall_q = _dot(normal, down_p), _dot(normal, down_q)
            if fall_p <= 0.0 or fall_q <= 0.0:
                continue
            p = _go(p, -max(0.0, _dot(normal, p)) / fall_p, down_p)
            q = _go(q, -max(0.0, _dot(normal, q)) / fall_q, down_q)
            distance[i] = min(distance[i], _to_segment(p, q))
