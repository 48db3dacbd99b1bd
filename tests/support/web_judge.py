"""
Counts of the renderer in the browser, judged by rays where they are not umbra's.

A count may differ where the pixel's centre lies within ``PIXELS`` of an edge in the picture, be it
where the near plane cuts a face, or where float32 cannot tell the surface from the volume's face.
Everything else is wrong.
"""

import numpy as np

from support.gl_judge import find_weights
from support.judge import Seen, Verdicts, closed_faces, judge
from support.raycaster import RayCaster
from support.web import describe_camera, describe_light
from umbra.cpu.frame import FrameCounter
from umbra.rays.depth import NOTHING
from umbra.rays.eye_count import find_cut_open, find_eye_count, find_faces_before
from umbra.web.pack import quantise

PIXELS = 1 / 64
ROUNDING = 4e-7
"""Of float32 coordinates and depth, relative to the largest."""

OTHER_GRIDS = (11, 13)
"""
Times as large pictures as that in which doubtful pixels are counted again.

SwiftShader cuts faces at the near plane and far beside the picture, and rounds the cuts of two
neighbours differently: a crack of a step of its grid, through which a pixel's middle may fall.
"""

GRAZING = 1e-4
"""Sine of the angle between surface and light; flatter volumes meet the depth's steps."""


class WebJudge:
    """
    A scene in the browser, on the CPU, and its rays.

    Parameters
    ----------
    picture : Picture
    scene : Scene
    size : (int, int)
        Of all pictures.
    ground : float or None

    Attributes
    ----------
    cracks : int
        Counts that are wrong in one grid of the rasteriser and right in another.
    """

    def __init__(self, picture, scene, size, ground=0.0):
        self.picture, self.scene = picture, quantise(scene)
        self.cracks = 0
        self.counter = FrameCounter(self.scene, ground=ground, transmits=False)  # glass is a wall
        soup = self.scene.triangles()
        self.rays = RayCaster(soup.vertices, soup.faces, self.scene.origin)
        caster = self.counter.caster
        self.component = np.zeros(len(soup.faces), np.int64)
        self.component[caster.source] = caster.component
        self.is_closed = closed_faces(caster, len(soup.faces))
        picture.load(scene, size)
        picture.set("ground", None if ground is None else float(ground - self.scene.origin[2]))

    def judge(self, camera, light):
        """Compare all pixels with the CPU, and judge those that differ; return both."""
        self.picture.set("camera", describe_camera(camera, self.scene))
        self.picture.set("lights", [describe_light(light, self.scene)])
        counts = self.picture.count()
        view, frame = self.counter.see(camera)
        expected = self.counter.count(view, camera, light)
        origin = self.scene.origin
        is_seen = (view.face != NOTHING) & (np.abs(frame.position - origin) < 1e5).all(-1)
        differs = is_seen & (counts != expected)
        verdicts = Verdicts(right=int((is_seen & ~differs).sum()), deepest=int(expected.max()))
        if not differs.any():
            return verdicts, counts
        place, eye = light.local(origin), camera.apex(origin)
        opened = self._find_opened(camera, place)
        own = view.face[differs]
        points = self._pull_in(frame.position[differs] - origin, own)
        seen = Seen(points, frame.normal[differs], own, eye)
        closed = self.is_closed & ~opened[self.component]
        edge = self._tolerance(seen, camera, place)
        found = judge(self.rays, seen, place, closed, counts[differs], edge, GRAZING)
        if found.wrong:
            self._find_cuts(found, np.flatnonzero(differs), camera)
        if found.wrong:
            self._find_cracks(found, np.flatnonzero(differs), expected.ravel())
        return verdicts + found, counts

    def _find_cuts(self, verdicts, places, camera):
        """Move the pixels on lines where the near plane cuts a face from the wrong to the rims."""
        right, up, forward = camera.axes()
        corners = (self.rays.vertices - (camera.eye - self.scene.origin))[self.rays.faces]
        depth = corners @ forward - camera.near
        # One corner lies on one side of the plane, and two on the other.
        side = depth > 0
        which = np.flatnonzero(side.any(1) & ~side.all(1))
        lone = np.where(side[which].sum(1) == 1, side[which].argmax(1), side[which].argmin(1))
        first, above = corners[which, lone], depth[which, lone]
        ends = []
        for k in (lone + 1) % 3, (lone + 2) % 3:
            share = above / (above - depth[which, k])
            ends.append(first + share[:, None] * (corners[which, k] - first))
        cols, rows = camera.size
        tall = camera.height or 2 * camera.near * np.tan(np.radians(camera.fov) / 2)
        begin, end = (np.stack([e @ right, e @ up], -1) * rows / tall for e in ends)
        still = []
        for line in verdicts.wrong:
            row, col = divmod(places[int(line.split()[1])], cols)
            aside = begin - [col + 0.5 - cols / 2, rows / 2 - row - 0.5]
            along = end - begin
            share = -np.einsum("ij,ij->i", aside, along) / np.maximum((along**2).sum(1), 1e-300)
            aside += np.clip(share, 0, 1)[:, None] * along
            if (np.linalg.norm(aside, axis=1) <= PIXELS).any():
                verdicts.rim += 1
            else:
                still.append(line)
        verdicts.wrong = still

    def _find_cracks(self, verdicts, places, expected):
        """Move what another grid of the rasteriser counts right from the wrong to the cracks."""
        for times in OTHER_GRIDS:
            counts, still = self.picture.count(times=times).ravel(), []
            for line in verdicts.wrong:
                pixel = places[int(line.split()[1])]
                if counts[pixel] == expected[pixel]:
                    self.cracks += 1
                else:
                    still.append(line)
            verdicts.wrong = still
            if not still:
                return

    def _find_opened(self, camera, light):
        """Find the components that umbra opens; rays of tests/oracle judge that it is right."""
        origin, blocks = self.scene.origin, self.counter.blocks
        casting = self.counter.find_casting(light)
        eye = find_eye_count(casting, blocks, camera, origin, light)
        before = find_faces_before(casting, blocks, camera, origin)
        return eye.start.enclosed | find_cut_open(casting, blocks, before, light)

    def _pull_in(self, points, own):
        """Pull points that lie beside their face by a rounding error into it."""
        points, mesh = points.copy(), own >= 0
        corners = self.rays.vertices[self.rays.faces[own[mesh]]]
        weights = np.maximum(find_weights(points[mesh], corners), 1e-9)
        points[mesh] = np.einsum("ij,ijk->ik", weights / weights.sum(1, keepdims=True), corners)
        return points

    def _tolerance(self, seen, camera, light):
        """
        Give how far each point may be from an edge in its own plane [m].

        Surfaces and volumes may be moved in the picture; a moved volume cuts a surface that the
        light grazes as much farther away.
        """
        forward, eye = camera.axes()[2], camera.eye - self.scene.origin
        ray = seen.points - eye
        depth = ray @ forward
        rows = camera.size[1]
        if camera.height is None:
            ray /= np.linalg.norm(ray, axis=1, keepdims=True)
            pixel = 2 * np.tan(np.radians(camera.fov) / 2) / rows * depth / (ray @ forward)
        else:
            ray = np.broadcast_to(forward, seen.points.shape)
            pixel = np.full(len(depth), camera.height / rows)
        size = max(np.abs(self.rays.vertices).max(), np.abs(eye).max(), np.abs(depth).max())
        way = light[:3] - light[3] * seen.points
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
        slant = np.abs(np.einsum("ij,ij->i", ray, seen.normals))
        fall = np.maximum(np.abs(np.einsum("ij,ij->i", way, seen.normals)), 1e-9)
        aside = PIXELS * pixel / np.maximum(np.minimum(slant, fall), GRAZING)
        return aside + ROUNDING * size * (1 + slant / fall)
