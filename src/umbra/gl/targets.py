"""The framebuffers of one size of picture."""

from dataclasses import dataclass, field
from functools import cached_property

from umbra.gl.context import Device
from umbra.gl.surfaces import LIGHT, LIT, find_surface_formats
from umbra.gl.target import Target

__all__ = ["Targets"]


@dataclass(eq=False)
class Targets:
    """
    The framebuffers of one size of picture; depth and stencil are shared by all.

    Parameters
    ----------
    device : Device
    size : (int, int)
        Columns and rows.
    accumulate : {'rgba16f', 'rgba8'}
        How light is summed up.

    Attributes
    ----------
    both : Target
        The picture as where its only light reaches, and as in shadow.
    picture : Target
        The first of these alone, which is what is shown in the end.
    surface, light : Target
        What is seen, and the light on it so far; made when first asked for.
    """

    device: Device
    size: tuple[int, int]
    accumulate: str = "rgba16f"
    both: Target = field(init=False)
    picture: Target = field(init=False)

    def __post_init__(self) -> None:
        self.both = Target(self.device, self.size, ("rgba8", "rgba8"))
        self.picture = Target(self.device, self.size, depth_of=self.both, shows=(self.both, LIT))

    @cached_property
    def surface(self) -> Target:
        """Normals, depth keys, reflectance, and light so far."""
        formats = find_surface_formats(self.accumulate)
        return Target(self.device, self.size, formats, depth_of=self.both)

    @cached_property
    def light(self) -> Target:
        """The light so far alone."""
        shown = self.surface, LIGHT
        return Target(self.device, self.size, depth_of=self.both, shows=shown)

    def release(self) -> None:
        """Free them."""
        for name in ("light", "surface", "picture", "both"):
            target = self.__dict__.get(name)
            if target is not None:
                target.release()
