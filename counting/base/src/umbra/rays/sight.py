"""The visible surfaces of a scene, in layers where surfaces are transparent."""

import numpy as np
from numpy.typing import NDArray

from umbra.rays import VisibleSurface, locate
from umbra.rays.depth import NOTHING, DepthBuffer, add_ground, add_transmitting, rasterise_depth
from umbra.rays.transmission import Transmitters
from umbra.scene import Camera, Light, Scene
from umbra.scene.derived import derive
from umbra.scene.scene import Triangles

__all__ = ["Sight"]


class Sight:
    """
    Finds the visible surfaces of a scene, and the light that reaches them.

    Parameters
    ----------
    scene : Scene
    transmitters : Transmitters, optional
        Triangles that transmit light; by default all are opaque.
    ground : float, optional
        z of a visible ground plane, in the model's own coordinates [m].
    threads : int

    Attributes
    ----------
    triangles : Triangles
        Triangles of the scene, which views index.
    """

    triangles: Triangles

    def __init__(
        self,
        scene: Scene,
        transmitters: Transmitters | None = None,
        ground: float | None = None,
        threads: int = 1,
    ) -> None:
        self.scene, self.transmitters = scene, transmitters
        self.ground, self.threads = ground, threads
        self.triangles = derive(scene, "soup", None, scene.triangles)
        self._opaque: NDArray[np.intp] | None = None  # indices of the opaque faces
        if transmitters is not None:
            is_opaque = np.ones(len(self.triangles.faces), np.bool_)
            is_opaque[transmitters.faces] = False
            self._opaque = np.flatnonzero(is_opaque)
        self._last: tuple[Camera, DepthBuffer] | None = None  # of the opaque faces
        self._seen: tuple[DepthBuffer, VisibleSurface] | None = None

    def look(self, camera: Camera, before: DepthBuffer | None = None) -> DepthBuffer:
        """
        Find the visible face and depth of each pixel.

        Transmitting triangles are drawn, except in their holes. ``before`` is the layer in front:
        only faces behind it are drawn, and none where it is empty.
        """
        if self._last is None or self._last[0] is not camera:
            self._last = camera, self._see_opaque(camera)
        view = self._last[1]
        if self.transmitters is None:
            return view
        matrix, near = camera.matrix(self.scene.origin), camera.key_range()[1]
        return add_transmitting(view, self.transmitters, matrix, near, before, self.threads)

    def locate(self, view: DepthBuffer, camera: Camera) -> VisibleSurface:
        """Find the visible points of a view of this camera; cached for the last view."""
        if self._seen is None or self._seen[0] is not view:
            self._seen = view, locate(view, camera, self.triangles, self.ground)
        return self._seen[1]

    def transmit(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """
        Find the light that transmitting triangles leave at each visible point.

        Returns
        -------
        left : (rows, cols, 3) float32
            Transmitted share of each colour; 1 where nothing is seen.
        hidden : (rows, cols) int32
            Number of triangles that hide the light: opaque where the ray meets them.
        """
        left, hidden = np.ones((*view.face.shape, 3), np.float32), np.zeros_like(view.face)
        if self.transmitters is not None:
            seen = view.face != NOTHING
            points = self.locate(view, camera).position[seen]
            origin = self.scene.origin
            left[seen], hidden[seen] = self.transmitters.trace(points, light, origin, self.threads)
        return left, hidden

    def _see_opaque(self, camera: Camera) -> DepthBuffer:
        """Find the view of the opaque faces alone."""
        origin, soup = self.scene.origin, self.triangles
        matrix, limits = camera.matrix(origin), camera.key_range()
        faces = soup.faces if self._opaque is None else soup.faces[self._opaque]
        view = rasterise_depth(soup.vertices, faces, matrix, camera.size, limits, self.threads)
        if self._opaque is not None:
            on_mesh = view.face >= 0
            view.face[on_mesh] = self._opaque[view.face[on_mesh]]
        if self.ground is not None:
            add_ground(view, matrix, self.ground - origin[2], limits)
        return view
