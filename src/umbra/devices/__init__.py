"""
Devices that count shadows: the CPU, OpenGL and WebGPU.

    device.py    interfaces               CountingDevice, TileCounters, FrameCounts
    built_in.py  the devices of umbra     CpuDevice, GlDevice, WgpuDevice
    by_points.py devices of packages      PointDevice

``StudyCounters`` counts a study's tiles on the requested device, or on the faster one. Importing
this package loads no kernels and no OpenGL: a device does so when it first counts.
"""

import time
from numbers import Integral
from typing import TYPE_CHECKING, Any, get_args

from umbra.devices.built_in import CpuDevice, GlDevice, WgpuDevice
from umbra.devices.device import CountingDevice, TileCounters, blame
from umbra.errors import InputError, UmbraError, show_value
from umbra.machine import choose_threads
from umbra.methods import DeviceName
from umbra.registry import Registry

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "CHOICES", "DEFAULT", "DEVICES", "REGISTRY", "StudyCounters", "check_device", "find_device",
]  # fmt: skip

DEVICES: dict[str, CountingDevice] = {
    device.name: device for device in (CpuDevice(), GlDevice(), WgpuDevice())
}
"""All devices by their name in options and results."""
DEFAULT = "cpu"
CHOICES = get_args(DeviceName)
"""Values of the option ``device``, without those of packages."""


REGISTRY: Registry[CountingDevice] = Registry(
    "device", "device", {}, CountingDevice, "PointDevice", ("name", "title")
)
"""Devices that packages beside umbra bring."""
ENOUGH = 200_000_000
"""Receivers times suns from which the search for an accelerator pays."""
_TRIED = 3  # suns counted on both devices for comparison


def find_device(name: str) -> CountingDevice:
    """
    Return a device by its name; the default for ``auto``.

    Raises
    ------
    InputError
        If no device has this name, or the package that brings it cannot be used.
    """
    if isinstance(name, str) and (name == "auto" or name in DEVICES):
        return DEVICES[DEFAULT if name == "auto" else name]
    if not isinstance(name, str) or name not in REGISTRY:
        msg = f"device {show_value(name)} is not one of {', '.join((*CHOICES, *REGISTRY.names))}"
        raise InputError(msg, option="device", device=name)
    return REGISTRY.find(name)


def check_device(name: str, threads: int | None) -> int:
    """
    Check that a device exists; return the number of threads.

    Parameters
    ----------
    name : str
        One of ``CHOICES``.
    threads : int, optional
        All cores by default.

    Raises
    ------
    InputError
        If the device is unknown, or there is less than one thread.
    """
    find_device(name)
    if threads is None:
        return choose_threads(None)
    if not isinstance(threads, Integral) or isinstance(threads, bool) or threads < 1:
        msg = f"threads must be at least 1, a whole number; got {show_value(threads)}"
        raise InputError(msg, threads=threads)
    return choose_threads(int(threads))


class StudyCounters:
    """
    Factory of the counters of a study's tiles, on one device.

    ``auto`` is the CPU, unless the work is large, an accelerator (a real GPU) exists, and it counts
    the first tile faster.

    Parameters
    ----------
    device : str
        One of ``umbra.devices.CHOICES``.
    casters : list of int
        Indices of the casting parts.
    suns : (n, 3) float64
        Directions toward all suns above the horizon.
    cells : int
        Number of receivers in the whole study.

    Attributes
    ----------
    device : str
        Name of the device in use.
    note : str
        What another device counts than the one that was chosen; empty if nothing.
    """

    def __init__(self, device: str, casters: list[int], suns: "NDArray", cells: int) -> None:
        self.device, self._casters, self._suns = device, casters, suns
        self.note = ""
        self._opened: dict[str, TileCounters] = {}
        self._rival = ""
        if device == "auto":
            self._rival = self._find_accelerator() if cells * len(suns) >= ENOUGH else ""
            self.device = "auto" if self._rival else DEFAULT

    def make(self, tile: Any) -> Any:
        """Make the counter of a tile; raises as ``TileCounters.make``."""
        if self.device == "auto":
            can = self._open(self._rival).can_count(tile)
            self.device = self._find_faster(tile) if can else DEFAULT
        opened = self._open(self.device)
        if not opened.can_count(tile):
            self.note = (
                f"device='{self.device}' does not count such receivers, so the {DEFAULT} device "
                "counts them; leave device= out"
            )
            self.device = DEFAULT
            opened = self._open(DEFAULT)
        try:
            return opened.make(tile)
        except UmbraError:
            raise
        except Exception as error:
            raise blame(self.device, error) from error

    def release(self) -> None:
        """Free the resources of all devices."""
        for opened in self._opened.values():
            opened.release()
        self._opened = {}

    def __enter__(self) -> "StudyCounters":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _open(self, name: str) -> TileCounters:
        if name not in self._opened:
            self._opened[name] = find_device(name).open_tiles(self._casters)
        return self._opened[name]

    def _find_accelerator(self) -> str:
        return next((name for name in DEVICES if self._open(name).is_accelerated()), "")

    def _find_faster(self, tile: Any) -> str:
        """Time a few suns on both devices, after a first run that compiles; return the faster."""
        import numpy as np  # noqa: PLC0415 - the command's help needs no NumPy

        trial = self._suns[:_TRIED]
        once, sums = np.ones((len(trial), 1), np.int32), np.zeros((1, *tile.shape), np.int32)
        seconds = {}
        for name in (DEFAULT, self._rival):
            counter = self._open(name).make(tile)
            counter.add_weights(trial[:2], once[:2], sums)
            begun = time.perf_counter()
            counter.add_weights(trial, once, sums)
            seconds[name] = time.perf_counter() - begun
        return min(seconds, key=lambda name: seconds[name])
