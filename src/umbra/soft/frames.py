"""What counts the shadows in frames of a scene, as soft methods, layers and devices need it."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from umbra.methods import Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import DepthBuffer
from umbra.rays.transmission import Transmitters
from umbra.scene import Camera, Light, Scene, Triangles
from umbra.soft import AreaLight
from umbra.volume.adjacency import Caster

__all__ = ["FrameCounts", "OneByOne", "VolumeCounts"]


class FrameCounts(Protocol):
    """Counter of shadows in frames of a scene; ``transmitters`` are its transmitting triangles."""

    scene: Scene
    transmitters: Transmitters | None
    moved: float
    """How far casters of the counts so far are off at most, as coarser meshes [m]."""

    def see(self, camera: Camera) -> tuple[DepthBuffer, VisibleSurface]:
        """Find the visible surface; transmitting parts are drawn, except in their holes."""

    def look(self, camera: Camera, before: DepthBuffer | None = None) -> DepthBuffer:
        """
        Find the visible face and depth of each pixel: the first half of ``see``.

        ``before`` is the layer in front: only faces behind it are drawn.
        """

    def locate(self, view: DepthBuffer, camera: Camera) -> VisibleSurface:
        """Find the visible points of a view of this camera: the second half."""

    def count(
        self, view: DepthBuffer, camera: Camera, light: Light, method: str = "auto"
    ) -> NDArray[np.signedinteger]:
        """Count the shadow volumes that hold each visible point, (rows, cols)."""

    def count_all(
        self, view: DepthBuffer, camera: Camera, lights: Sequence[Light]
    ) -> Iterable[NDArray[np.signedinteger]]:
        """Count the shadow volumes of several lights, as ``count`` does of each."""

    def transmit(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> "tuple[NDArray[np.float32], NDArray[np.int32]]":
        """Find the light that transmitting parts leave, and what hides it: `Sight.transmit`."""

    def find_visibility(
        self,
        view: DepthBuffer,
        camera: Camera,
        lights: Sequence[AreaLight],
        method: str,
        softness: Softness | None = None,
    ) -> "list[NDArray[np.float32]]":
        """Find the share of each area light that each visible point sees, (rows, cols) each."""


class OneByOne:
    """Base of counters that count several lights one after another."""

    count: Callable[..., NDArray[np.signedinteger]]

    def count_all(
        self, view: DepthBuffer, camera: Camera, lights: Sequence[Light]
    ) -> Iterator[NDArray[np.signedinteger]]:
        """Count the shadow volumes of each light, when its turn comes."""
        return (self.count(view, camera, light) for light in lights)


class VolumeCounts(FrameCounts, Protocol):
    """Counter whose casters soft methods choose from, and change."""

    caster: Caster
    casters: list[int] | None
    triangles: Triangles
    threads: int

    def with_caster(self, caster: Caster) -> Self:
        """Return a counter of the same scene with another caster."""

    def count_undrawn(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> NDArray[np.signedinteger]:
        """Count where casters need not be drawn, caps included."""

    def find_casting(self, light: NDArray[np.float64]) -> Caster:
        """Return the caster without the faces that hold a light, (4,) in its frame."""
