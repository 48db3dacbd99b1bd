"""Frames of a scene whose shadows another device finds, point by point."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.frame import FrameCounter
from umbra.methods import Methods
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.scene import Camera, Light, Scene

__all__ = ["PointFrames"]


class PointFrames(FrameCounter):
    """Counter of frames: the visible surface as on the CPU, shadows as a device finds them."""

    def __init__(
        self,
        find_hidden: Callable[..., NDArray[np.uint8]],
        methods: Methods,
        scene: Scene,
        casters: Sequence[int] | None,
        ground: float | None,
        threads: int,
        warn: Callable[[str], object],
        transmits: bool,
    ) -> None:
        super().__init__(
            scene, None if casters is None else list(casters), ground, threads, warn, transmits
        )
        self._find_hidden, self._methods = find_hidden, methods

    def count(
        self, view: DepthBuffer, camera: Camera, light: Light, method: str = "auto"
    ) -> NDArray[np.signedinteger[Any]]:
        """
        Return 1 where something hides the light from a visible point, else 0, (rows, cols).

        Samples off the pixels' centres, which smooth edges alone, the CPU counts.
        """
        self._methods.check(method)
        if any(camera.offset):  # finer steps at edges, of each of a pixel's samples
            return super().count(view, camera, light)
        (counts,) = self.count_all(view, camera, [light])
        return counts

    def count_all(
        self, view: DepthBuffer, camera: Camera, lights: Sequence[Light]
    ) -> Iterator[NDArray[np.signedinteger[Any]]]:
        """Ask the device once for all lights at the pixels' centres."""
        frame = self.locate(view, camera)
        is_seen = view.face != NOTHING
        points = frame.position[is_seen] - self.scene.origin
        origin = self.scene.origin
        homogeneous = np.array([light.local(origin) for light in lights], np.float64)
        triangles = self.caster.vertices[self.caster.faces]
        hidden = self._find_hidden(triangles, points, frame.normal[is_seen], homogeneous)
        for mask in hidden:
            counts = np.zeros(is_seen.shape, np.int32)
            counts[is_seen] = mask
            yield counts
