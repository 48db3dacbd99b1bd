"""The counters of one scene by method, each made when first asked for."""

from collections.abc import Callable

from umbra.gl.context import Device
from umbra.gl.geometry import Geometry
from umbra.gl.masks.counter import MaskCounter
from umbra.gl.masks.method import Counts
from umbra.gl.masks.registry import NAMES, make

__all__ = ["MaskCounters"]


class MaskCounters:
    """
    Masks beside the stencil.

    Parameters
    ----------
    device : Device
    geometry : Geometry
    warn : callable
        Told, in a line, where a method may be wrong.
    """

    def __init__(
        self, device: Device, geometry: Geometry, warn: Callable[[str], object] = lambda _: None
    ) -> None:
        self._device, self._geometry, self._warn = device, geometry, warn
        self._made: dict[str, MaskCounter] = {}

    def choose(self, method: str, stencil: Counts) -> tuple[Counts, str]:
        """
        Find what counts by a method.

        Parameters
        ----------
        method : str
        stencil : Counts
            Counts by all others.

        Returns
        -------
        counter : Counts
        method : str
            To plan by.
        """
        if method not in NAMES:
            return stencil, method
        if method not in self._made:
            self._made[method] = make(method, self._device, self._geometry, self._warn)
        return self._made[method], "auto"

    def release(self) -> None:
        """Free them."""
        for counter in self._made.values():
            counter.release()
        self._made = {}
