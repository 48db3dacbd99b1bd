"""Which device counts a study, and its counter."""

import time
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, UmbraError
from umbra.study.counting import Counter
from umbra.study.model import PlanTile

if TYPE_CHECKING:
    from umbra.gl.context import Device

__all__ = ["DEVICES", "Counters"]

DEVICES = ("auto", "cpu", "gl")
ENOUGH = 200_000_000
"""Cells times suns from which a GPU is worth being looked for."""
_TRIED = 3  # suns, on both devices


class Counters:
    """
    Makes the counters of a study's tiles, on one device.

    ``auto`` is the CPU, unless the work is large, there is a real GPU, and the first tile
    was counted faster on it.

    Parameters
    ----------
    device : {'auto', 'cpu', 'gl'}
    casters : list of int
        Indices of the parts that cast.
    suns : (n, 3) float64
        All there are, above the horizon.
    cells : int
        Receivers of the whole study.

    Attributes
    ----------
    device : str
        What counts: ``cpu`` or ``gl``.
    """

    def __init__(self, device: str, casters: list[int], suns: NDArray, cells: int) -> None:
        self.device, self._casters, self._suns = device, casters, suns
        self._gl: Device | None = None
        self._made: list[Any] = []
        if device == "auto" and not self._find_gpu(cells * len(suns)):
            self.device = "cpu"

    def make(self, tile: Any) -> Counter:
        """
        Make ready to count on a tile.

        Raises
        ------
        InputError
            If the device cannot count on such receivers.
        UmbraError
            If there is no OpenGL, or not enough of it.
        """
        if self.device == "cpu":
            return tile.make_counter()
        if not isinstance(tile, PlanTile):
            if self.device == "gl":
                msg = "the gl device counts plans (--receivers ground, top); leave --device out"
                raise InputError(msg)
            self.device = "cpu"
            return tile.make_counter()
        if self.device == "auto":
            self.device = self._find_faster(tile)
            return self.make(tile)
        return self._make_sweep(tile)

    def release(self) -> None:
        """Free what is held on the device."""
        for sweep in self._made:
            sweep.release()
        self._made = []
        if self._gl is not None:
            self._gl.release()
        self._gl = None

    def __enter__(self) -> "Counters":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _make_sweep(self, tile: PlanTile) -> Counter:
        from umbra.gl.context import open_device  # noqa: PLC0415  (an extra)
        from umbra.gl.sweep import GlSweep  # noqa: PLC0415

        self._gl = self._gl or open_device()
        while self._made:
            self._made.pop().release()  # the tile before
        model = tile.model
        sweep = GlSweep(
            model.scene, self._casters, tile.grid, model.ground, model.receivers, self._gl
        )
        self._made.append(sweep)
        return tile.with_rays(sweep)

    def _find_gpu(self, work: int) -> bool:
        """Tell whether there is a GPU, if that may matter."""
        if work < ENOUGH or find_spec("moderngl") is None:
            return False
        from umbra.gl.context import open_device  # noqa: PLC0415

        try:
            self._gl = open_device()
        except UmbraError:
            return False
        return not self._gl.is_software

    def _find_faster(self, tile: PlanTile) -> str:
        """Count a few suns on both devices, the first apart: it compiles and loads."""
        some = self._suns[:_TRIED]
        seconds = {}
        for name, counter in (("cpu", tile.make_counter()), ("gl", self._make_sweep(tile))):
            counter.add_steps(some[:1], np.zeros(tile.shape, np.int32))
            begun = time.perf_counter()
            counter.add_steps(some, np.zeros(tile.shape, np.int32))
            seconds[name] = time.perf_counter() - begun
        return min(seconds, key=lambda name: seconds[name])
