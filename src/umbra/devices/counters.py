"""The counters of a study's tiles, on the device that was asked for or on the faster one."""

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.devices import DEFAULT, DEVICES
from umbra.devices.device import TileCounters

__all__ = ["StudyCounters"]

ENOUGH = 200_000_000
"""Receivers times suns from which an accelerator is worth being looked for."""
_TRIED = 3  # suns, on both devices


class StudyCounters:
    """
    Makes the counters of a study's tiles, on one device.

    ``auto`` is the CPU, unless the work is large, there is an accelerator (a real GPU), and
    the first tile was counted faster on it.

    Parameters
    ----------
    device : str
        Of ``umbra.devices.CHOICES``.
    casters : list of int
        Indices of the parts that cast.
    suns : (n, 3) float64
        All there are, above the horizon.
    cells : int
        Receivers of the whole study.

    Attributes
    ----------
    device : str
        What counts.
    """

    def __init__(self, device: str, casters: list[int], suns: NDArray, cells: int) -> None:
        self.device, self._casters, self._suns = device, casters, suns
        self._opened: dict[str, TileCounters] = {}
        self._rival = ""
        if device == "auto":
            self._rival = self._find_accelerator() if cells * len(suns) >= ENOUGH else ""
            self.device = "auto" if self._rival else DEFAULT

    def make(self, tile: Any) -> Any:
        """Make ready to count on a tile; raises as ``TileCounters.make``."""
        if self.device == "auto":
            can = self._open(self._rival).can_count(tile)
            self.device = self._find_faster(tile) if can else DEFAULT
        return self._open(self.device).make(tile)

    def release(self) -> None:
        """Free what is held on all devices."""
        for opened in self._opened.values():
            opened.release()
        self._opened = {}

    def __enter__(self) -> "StudyCounters":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _open(self, name: str) -> TileCounters:
        if name not in self._opened:
            self._opened[name] = DEVICES[name].open_tiles(self._casters)
        return self._opened[name]

    def _find_accelerator(self) -> str:
        return next((name for name in DEVICES if self._open(name).is_accelerated()), "")

    def _find_faster(self, tile: Any) -> str:
        """Count a few suns on both devices, the first apart: it compiles and loads."""
        some = self._suns[:_TRIED]
        seconds = {}
        for name in (DEFAULT, self._rival):
            counter = self._open(name).make(tile)
            counter.add_steps(some[:1], np.zeros(tile.shape, np.int32))
            begun = time.perf_counter()
            counter.add_steps(some, np.zeros(tile.shape, np.int32))
            seconds[name] = time.perf_counter() - begun
        return min(seconds, key=lambda name: seconds[name])
