"""Methods of each device and their parameters, by name, for commands and counters."""

import math
from dataclasses import dataclass
from typing import Literal

from umbra.errors import InputError, show_value

__all__ = ["MASK_FILTERS", "MASK_SCALES", "METHODS", "SOFT", "DeviceName", "Methods", "Softness"]

DeviceName = Literal["auto", "cpu", "gl", "wgpu"]
"""Names of devices that callers may pass."""
SOFT = ("samples", "wedges", "complexity", "weng")
"""
Soft shadows: samples of the light (the reference), penumbra wedges, depth complexity over the
light (right where casters overlap, too), scaled layers.
"""
MASK_SCALES, MASK_FILTERS = (1, 2, 4), ("joint", "bilinear", "nearest")
"""Factors by which masks of hard shadows may be smaller than the picture; upsampling filters."""
_MOST_LAYERS = 1000  # more are a mistake


@dataclass(frozen=True)
class Methods:
    """
    Methods of one device.

    Parameters
    ----------
    title : str
        The device's name in error messages.
    volumes : tuple of str
        Hard shadows by counting volumes; the first is the default.
    masks : tuple of str
        Hard shadows by masks without a stencil.
    soft : tuple of str
    """

    title: str
    volumes: tuple[str, ...]
    masks: tuple[str, ...] = ()
    soft: tuple[str, ...] = SOFT

    @property
    def hard(self) -> tuple[str, ...]:
        """All methods of hard shadows."""
        return (*self.volumes, *self.masks)

    def check(self, method: str, *, masks: bool = True) -> None:
        """
        Check that the device has a method of hard shadows.

        Parameters
        ----------
        method : str
        masks : bool
            Whether mask methods are allowed.

        Raises
        ------
        InputError
            If the device has no such method; the error lists its methods.
        """
        names = self.hard if masks else self.volumes
        if not isinstance(method, str) or method not in names:
            msg = f"the {self.title} has no method {show_value(method)}; it has {', '.join(names)}"
            raise InputError(msg, method=method)

    def check_soft(self, method: str) -> None:
        """Check that the device has a method of soft shadows; raises as `check`."""
        if method not in self.soft:
            has = f"it has {', '.join(self.soft)}" if self.soft else "it has none"
            msg = f"the {self.title} has no soft shadows by '{method}'; {has}"
            raise InputError(msg, method=method)


METHODS = {
    "cpu": Methods("cpu", ("auto", "z-pass", "z-fail")),
    "gl": Methods(
        "gl device",
        ("auto", "z-pass", "z-fail", "lengyel", "mcguire"),
        ("alpha", "screen", "max", "half"),
    ),
    "wgpu": Methods(
        "wgpu device", ("auto", "z-pass", "z-fail", "lengyel", "mcguire"), soft=SOFT[:1]
    ),
}
"""Methods by device name."""


@dataclass(frozen=True, kw_only=True)
class Softness:
    """
    Resolution of soft methods.

    Parameters
    ----------
    samples : int
        Number of sample points of a light.
    spots : int
        Number of spots of a light at which ``complexity`` counts casters.
    length, gap : float
        Extent of the widest scaled layer and step between layers, in tenths of the silhouette's
        radius. Weng (2008) recommends 2 to 3, and 0.3 to 0.5.

    Raises
    ------
    InputError
        If length and gap yield no layer, or more than 1,000.
    """

    samples: int = 256
    spots: int = 64
    length: float = 2.5
    gap: float = 0.4

    def __post_init__(self) -> None:
        length, gap = self.length, self.gap
        if not (0 < gap < math.inf and 0 < length < math.inf and 1 <= self.layers <= _MOST_LAYERS):
            usual = Softness()
            msg = (
                f"layer_length={length:g} and layer_gap={gap:g} do not make 1 to {_MOST_LAYERS} "
                f"layers; {usual.length:g} and {usual.gap:g} make {usual.layers}"
            )
            raise InputError(msg, option="layer_length")

    @property
    def layers(self) -> int:
        """Number of scaled layers."""
        return round(min(self.length / self.gap, 2 * _MOST_LAYERS))

    def select(self, method: str) -> dict[str, float]:
        """Return the parameters of a method of ``SOFT``, by name."""
        named = {"samples": ("samples",), "complexity": ("spots",), "weng": ("length", "gap")}
        return {name: getattr(self, name) for name in named.get(method, ())}
