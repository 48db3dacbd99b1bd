"""What a camera sees of a scene, layer behind layer where surfaces can be seen through."""

import numpy as np
from numpy.typing import NDArray

from umbra.rays import VisibleSurface, locate
from umbra.rays.depth import NOTHING, DepthBuffer, add_ground, add_transmitting, rasterise_depth
from umbra.rays.transmission import Transmitters
from umbra.scene import Camera, Light, Scene
from umbra.scene.scene import Triangles

__all__ = ["Sight"]


class Sight:
    """
    Looks at a scene, and from what it sees to lights.

    Parameters
    ----------
    scene : Scene
    transmitters : Transmitters, optional
        Triangles of the scene that light passes through; all are opaque by default.
    ground : float, optional
        z of a plane that is seen, in the model's own coordinates [m].
    threads : int

    Attributes
    ----------
    triangles : Triangles
        The scene's, whose numbers views name.
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
        self.triangles = scene.triangles()
        self._opaque: NDArray[np.intp] | None = None  # numbers of the faces that transmit nothing
        if transmitters is not None:
            is_opaque = np.ones(len(self.triangles.faces), np.bool_)
            is_opaque[transmitters.faces] = False
            self._opaque = np.flatnonzero(is_opaque)
        self._last: tuple[Camera, DepthBuffer] | None = None  # without what transmits light
        self._seen: tuple[DepthBuffer, VisibleSurface] | None = None

    def look(self, camera: Camera, before: DepthBuffer | None = None) -> DepthBuffer:
        """
        Find which face each pixel sees, and how near.

        What can be seen through hides the rest, but for its holes. ``before`` is what was seen in
        front: only what is behind it is looked at, and nothing where it sees nothing.
        """
        if self._last is None or self._last[0] is not camera:
            self._last = camera, self._see_opaque(camera)
        view = self._last[1]
        if self.transmitters is None:
            return view
        matrix, near = camera.matrix(self.scene.origin), camera.key_range()[1]
        return add_transmitting(view, self.transmitters, matrix, near, before, self.threads)

    def locate(self, view: DepthBuffer, camera: Camera) -> VisibleSurface:
        """Find the places of what a view of this camera shows; kept for the last view."""
        if self._seen is None or self._seen[0] is not view:
            self._seen = view, locate(view, camera, self.triangles, self.ground)
        return self._seen[1]

    def transmit(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """
        Find what the transmitting triangles leave of a light at each visible point.

        Returns
        -------
        left : (rows, cols, 3) float32
            Share of the light, of each colour; 1 where nothing is seen.
        hidden : (rows, cols) int32
            Triangles that hide it, where they are no holes and not transparent.
        """
        left, hidden = np.ones((*view.face.shape, 3), np.float32), np.zeros_like(view.face)
        if self.transmitters is not None:
            seen = view.face != NOTHING
            points = self.locate(view, camera).position[seen]
            origin = self.scene.origin
            left[seen], hidden[seen] = self.transmitters.trace(points, light, origin, self.threads)
        return left, hidden

    def _see_opaque(self, camera: Camera) -> DepthBuffer:
        """Find what a camera would see without what transmits light."""
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
