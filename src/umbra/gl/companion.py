"""A picture beside another: colours of its own over another target's depth and stencil."""

from umbra.gl.context import Device
from umbra.gl.target import Target

__all__ = ["Companion"]


class Companion:
    """
    A target that goes with another, made when it is asked for and anew when that is another.

    Parameters
    ----------
    device : Device
    color : str
        Of ``umbra.gl.target.FORMATS``.

    Attributes
    ----------
    target : Target, optional
        The one that was asked for last.
    """

    def __init__(self, device: Device, color: str) -> None:
        self._device, self._color = device, color
        self.target: Target | None = None

    def over(self, target: Target) -> Target:
        """Give the companion that shares this target's depth and stencil."""
        if self.target is None or self.target.depth_of is not target:
            self.release()
            self.target = Target(self._device, target.size, (self._color,), depth_of=target)
        return self.target

    def release(self) -> None:
        """Free the picture."""
        if self.target is not None:
            self.target.release()
        self.target = None
