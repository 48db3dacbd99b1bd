"""Interfaces of a device: counters of a study's tiles, counters of frames, method names."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from umbra.errors import InputError
from umbra.methods import METHODS, Methods, Softness

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from umbra.rays import VisibleSurface
    from umbra.rays.depth import DepthBuffer
    from umbra.rays.transmission import Transmitters
    from umbra.scene import Camera, Light, Scene
    from umbra.soft import AreaLight

__all__ = ["CountingDevice", "FrameCounts", "TileCounters", "blame"]


def blame(name: str, error: Exception) -> InputError:
    """Return the error of a device that failed, in one line."""
    msg = (
        f"device '{name}' failed ({type(error).__name__}: {error}); update the package that brings "
        "it, or leave device= out"
    )
    return InputError(msg, option="device", device=name)


class FrameCounts(Protocol):
    """Counter of shadows in frames of a scene; ``transmitters`` are its transmitting triangles."""

    scene: "Scene"
    transmitters: "Transmitters | None"
    moved: float
    """How far casters of the counts so far are off at most, as coarser meshes [m]."""

    def see(self, camera: "Camera") -> "tuple[DepthBuffer, VisibleSurface]":
        """Find the visible surface; transmitting parts are drawn, except in their holes."""

    def look(self, camera: "Camera", before: "DepthBuffer | None" = None) -> "DepthBuffer":
        """
        Find the visible face and depth of each pixel: the first half of ``see``.

        ``before`` is the layer in front: only faces behind it are drawn.
        """

    def locate(self, view: "DepthBuffer", camera: "Camera") -> "VisibleSurface":
        """Find the visible points of a view of this camera: the second half."""

    def count(
        self, view: "DepthBuffer", camera: "Camera", light: "Light", method: str = "auto"
    ) -> "NDArray[np.signedinteger]":
        """Count the shadow volumes that hold each visible point, (rows, cols)."""

    def transmit(
        self, view: "DepthBuffer", camera: "Camera", light: "Light"
    ) -> "tuple[NDArray[np.float32], NDArray[np.int32]]":
        """Find the light that transmitting parts leave, and what hides it: `Sight.transmit`."""

    def find_visibility(
        self,
        view: "DepthBuffer",
        camera: "Camera",
        lights: "Sequence[AreaLight]",
        method: str,
        softness: Softness | None = None,
    ) -> "list[NDArray[np.float32]]":
        """Find the share of each area light that each visible point sees, (rows, cols) each."""


class TileCounters(ABC):
    """Factory of the counters of one study's tiles on one device."""

    def can_count(self, tile: Any) -> bool:
        """Return whether the device supports this kind of receiver."""
        return True

    def is_accelerated(self) -> bool:
        """Return whether the device may be faster than the CPU on this machine."""
        return False

    @abstractmethod
    def make(self, tile: Any) -> Any:
        """
        Make the counter of a tile; resources of the previous tile may be freed.

        Raises
        ------
        InputError
            If the device does not support such receivers.
        UmbraError
            If the device does not run on this machine.
        """

    def release(self) -> None:  # noqa: B027
        """Free resources on the device."""


class CountingDevice(ABC):
    """
    A device that counts shadows.

    ``umbra.devices.DEVICES`` holds one instance of each. Modules are imported at the first count.

    Attributes
    ----------
    name : str
        Name in options and results.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    """Name in panels."""
    is_window: ClassVar[bool] = False
    """Whether it draws into the viewer's window; pictures of other devices are copied there."""
    enlarges_masks: ClassVar[bool] = False
    """Whether hard shadows can be counted at a lower resolution than the picture."""
    has_levels: ClassVar[bool] = False
    """Whether casters may be coarser meshes."""

    @property
    def methods(self) -> Methods:
        """Methods of the device, by name."""
        return METHODS.get(self.name, Methods(self.title, ("auto",), soft=()))

    @abstractmethod
    def open_tiles(self, casters: list[int]) -> TileCounters:
        """Start a study with the casting parts of these indices."""

    @abstractmethod
    def open_frames(
        self,
        scene: "Scene",
        ground: float | None = None,
        *,
        casters: list[int] | None = None,
        threads: int = 1,
        warn: Callable[[str], object] = lambda _: None,
        transmits: bool = True,
        detail: float = 0.0,
    ) -> AbstractContextManager[FrameCounts]:
        """
        Make a counter of frames of a scene.

        Parameters
        ----------
        scene : Scene
        ground : float, optional
            z of a plane that receives shadows, in the model's own coordinates [m].
        casters : list of int, optional
            Indices of the casting parts; all by default.
        threads : int
        warn : callable
            Receives one line where a forced method is wrong for a view.
        transmits : bool
            Whether transmitting parts let light through; otherwise they are opaque, without holes,
            as in a study.
        detail : float
            By how many pixels hard shadows may be off, where the device ``has_levels``.
        """
