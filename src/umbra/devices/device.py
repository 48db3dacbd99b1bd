"""What a device gives: counters of a study's tiles, counters of frames, methods by name."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from umbra.methods import METHODS, Methods, Softness

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from umbra.rays import VisibleSurface
    from umbra.rays.depth import DepthBuffer
    from umbra.rays.transmission import Transmitters
    from umbra.scene import Camera, Light, Scene
    from umbra.soft import AreaLight

__all__ = ["CountingDevice", "FrameCounts", "TileCounters"]


class FrameCounts(Protocol):
    """Counts shadows in frames of one scene; ``transmitters`` are its parts that transmit light."""

    scene: "Scene"
    transmitters: "Transmitters | None"

    def see(self, camera: "Camera") -> "tuple[DepthBuffer, VisibleSurface]":
        """Find what a camera sees; what can be seen through hides the rest, but for its holes."""

    def look(self, camera: "Camera", before: "DepthBuffer | None" = None) -> "DepthBuffer":
        """
        Find which face each pixel sees, and how near: the first half of ``see``.

        ``before`` is what is seen in front: only what is behind it is looked at.
        """

    def locate(self, view: "DepthBuffer", camera: "Camera") -> "VisibleSurface":
        """Find the places of what a view of this camera shows: the second half."""

    def count(
        self, view: "DepthBuffer", camera: "Camera", light: "Light", method: str = "auto"
    ) -> "NDArray[np.signedinteger]":
        """Count the shadow volumes that hold each visible point, (rows, cols)."""

    def transmit(
        self, view: "DepthBuffer", camera: "Camera", light: "Light"
    ) -> "tuple[NDArray[np.float32], NDArray[np.int32]]":
        """Find what transmitting parts leave of a light, and what hides it: `Sight.transmit`."""

    def find_visibility(
        self,
        view: "DepthBuffer",
        camera: "Camera",
        lights: "Sequence[AreaLight]",
        method: str,
        softness: Softness | None = None,
    ) -> "list[NDArray[np.float32]]":
        """Find what share of lights with a size each visible point sees, (rows, cols) each."""


class TileCounters(ABC):
    """Makes the counters of one study's tiles on one device."""

    def can_count(self, tile: Any) -> bool:
        """Tell whether the device counts on receivers of this kind."""
        return True

    def is_accelerated(self) -> bool:
        """Tell whether the device may be faster than the CPU here."""
        return False

    @abstractmethod
    def make(self, tile: Any) -> Any:
        """
        Make ready to count on a tile; what the tile before held may be freed.

        Raises
        ------
        InputError
            If the device cannot count on such receivers.
        UmbraError
            If the device does not run here.
        """

    def release(self) -> None:  # noqa: B027
        """Free what is held on the device."""


class CountingDevice(ABC):
    """
    A place to count.

    One object of each stands in ``umbra.devices.DEVICES``. It imports what it needs when it
    first counts.

    Attributes
    ----------
    name : str
        As options and results say it.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    """As panels show it."""
    is_window: ClassVar[bool] = False
    """Whether the viewer's window draws its pictures; those of others are put into the window."""
    enlarges_masks: ClassVar[bool] = False
    """Whether hard shadows can be counted in fewer pixels than the picture has."""
    weakens_light: ClassVar[bool] = True
    """Whether canopies can let a share of the light through."""

    @property
    def methods(self) -> Methods:
        """The names of its methods."""
        return METHODS[self.name]

    @abstractmethod
    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Begin a study in which the parts with these indices cast."""

    @abstractmethod
    def open_frames(
        self,
        scene: "Scene",
        ground: float | None = None,
        *,
        casters: list[int] | None = None,
        threads: int = 1,
        warn: Callable[[str], object] = lambda _: None,
    ) -> AbstractContextManager[FrameCounts]:
        """
        Begin counting in frames of a scene.

        Parameters
        ----------
        scene : Scene
        ground : float, optional
            z of a plane that receives shadows, in the model's own coordinates [m].
        casters : list of int, optional
            Indices of the parts that cast; all by default.
        threads : int
        warn : callable
            Told, in a line, where a forced method is wrong for a view.
        """
