"""
Frames of the gl device judged by rays, with float32 and the rasteriser allowed for.

A count may differ where the pixel's centre lies within ``PIXELS`` of an edge in the
picture, or where the depth buffer cannot tell the surface from the volume's face: moved
along the ray by ``STEPS`` of its steps and float32's rounding, the point would cross an
edge. Everything else that differs is wrong, as on the CPU.
"""

from functools import partial

import numpy as np

from support.judge import Seen, Verdicts, closed_faces, find_opened, judge
from support.raycaster import RayCaster
from umbra.gl.frame_counter import GlFrameCounter
from umbra.rays.depth import NOTHING
from umbra.scene import make_scene
from umbra.volume.adjacency import make_caster

PIXELS = 1 / 128
"""Vertices are snapped to 1/256 of a pixel; far ends of long edges may lie anywhere."""

STEPS = 3.0
"""Of the depth buffer."""

ROUNDING = 4e-7
"""Of float32 coordinates, relative to the largest."""

GRAZING = 1e-4
"""Sine of the angle between surface and light; flatter volumes meet the depth's steps."""


def find_weights(points, corners):
    """Give the barycentric coordinates of points in the planes of triangles (n, 3, 3)."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.einsum("ij,ij->i", normal, normal)
    v = np.einsum("ij,ij->i", np.cross(points - a, c - a), normal) / size
    w = np.einsum("ij,ij->i", np.cross(b - a, points - a), normal) / size
    return np.stack([1 - v - w, v, w], 1)


class Judge:
    """
    A scene on the gl device, and its rays.

    Parameters
    ----------
    device : Device
    mesh : (vertices, faces)
    ground : float or None
    make : callable
        Makes the counter, by default a ``GlFrameCounter`` on the device.
    **options
        Of the counter.
    """

    def __init__(self, device, mesh, ground=0.0, make=None, **options):
        self.scene = make_scene(*mesh)
        make = make or partial(GlFrameCounter, device=device)
        self.counter = make(self.scene, ground=ground, **options)
        soup = self.scene.triangles()
        self.caster = make_caster(soup.vertices, soup.faces)
        self.rays = RayCaster(soup.vertices, soup.faces, self.scene.origin)
        self.component = np.zeros(len(soup.faces), np.int64)
        self.component[self.caster.source] = self.caster.component
        self.is_closed = closed_faces(self.caster, len(soup.faces))

    def judge(self, camera, light, *methods, where=lambda _: True):
        """
        Judge every pixel, by each method; return the verdicts and the last counts.

        ``where`` tells which pixels of a view are judged.
        """
        view, frame = self.counter.see(camera)
        origin = self.scene.origin
        is_seen = (view.face != NOTHING) & where(view)
        is_seen &= (np.abs(frame.position - origin) < 1e5).all(-1)
        place, verdicts, counts = light.local(origin), Verdicts(), None
        eye = camera.apex(origin)
        opened = find_opened(self.rays, self.component, camera, eye, place, origin)
        points = self._pull_in(frame.position[is_seen] - origin, view.face[is_seen])
        seen = Seen(points, frame.normal[is_seen], view.face[is_seen], eye)
        edge = self._tolerance(seen, camera, place) if is_seen.any() else 0.0
        for method in methods or ("auto",):
            counts = self.counter.count(view, camera, light, method)
            assert not counts[view.face == NOTHING].any()
            if is_seen.any():
                closed = self.is_closed & ~opened[self.component]
                found = judge(self.rays, seen, place, closed, counts[is_seen], edge, GRAZING)
                found.wrong = [f"{method}: {line}" for line in found.wrong]
                verdicts += found
        return verdicts, counts

    def _pull_in(self, points, own):
        """Pull points that the rasteriser put beside their face, by a trifle, into it."""
        points = points.copy()
        mesh = own >= 0
        corners = self.rays.vertices[self.rays.faces[own[mesh]]]
        weights = find_weights(points[mesh], corners)
        beside = (weights < 1e-9).any(1)
        weights = np.maximum(weights, 1e-9)
        inside = np.einsum("ij,ijk->ik", weights / weights.sum(1, keepdims=True), corners)
        points[np.flatnonzero(mesh)[beside]] = inside[beside]
        return points

    def _tolerance(self, seen, camera, light):
        """Give how far each point may be from an edge in its own plane [m]."""
        projection = self.counter._seen[1]
        forward, eye = camera.axes()[2], camera.eye - self.scene.origin
        depth = (seen.points - eye) @ forward
        rows = camera.size[1]
        if camera.height is None:
            ray = seen.points - eye
            ray /= np.linalg.norm(ray, axis=1, keepdims=True)
            pixel = 2 * np.tan(np.radians(camera.fov) / 2) / rows * depth / (ray @ forward)
            step = depth**2 / (projection.camera.near * 2**24) / (ray @ forward)
        else:
            ray = np.broadcast_to(forward, seen.points.shape)
            pixel = np.full(len(depth), camera.height / rows)
            step = np.full(len(depth), 2 / np.linalg.norm(projection.matrix[2, :3]) / 2**24)
        size = max(np.abs(self.rays.vertices).max(), np.abs(eye).max(), np.abs(depth).max())
        step = STEPS * step + ROUNDING * size
        way = light[:3] - light[3] * seen.points
        way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
        slant = np.abs(np.einsum("ij,ij->i", ray, seen.normals))
        fall = np.maximum(np.abs(np.einsum("ij,ij->i", way, seen.normals)), 1e-9)
        return PIXELS * pixel / np.maximum(slant, 1e-3) + step * (1 + slant / fall)

    def release(self):
        self.counter.release()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.release()
