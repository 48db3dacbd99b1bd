"""Interfaces of a device: counters of a study's tiles, counters of frames, method names."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, ClassVar

from umbra.errors import InputError
from umbra.methods import METHODS, Methods

if TYPE_CHECKING:
    from umbra.scene import Scene
    from umbra.soft.frames import FrameCounts

__all__ = ["CountingDevice", "TileCounters", "blame"]


def blame(name: str, error: Exception) -> InputError:
    """Return the error of a device that failed, in one line."""
    msg = (
        f"device '{name}' failed ({type(error).__name__}: {error}); update the package that brings "
        "it, or leave device= out"
    )
    return InputError(msg, option="device", device=name)


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
    ) -> "AbstractContextManager[FrameCounts]":
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
