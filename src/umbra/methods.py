"""How each device counts, and how finely: what commands offer and counters check, by name."""

import math
from dataclasses import dataclass
from typing import Literal

from umbra.errors import InputError

__all__ = ["MASK_FILTERS", "MASK_SCALES", "METHODS", "SOFT", "DeviceName", "Methods", "Softness"]

DeviceName = Literal["auto", "cpu", "gl"]
"""What callers may ask for, as signatures say it."""
SOFT = ("samples", "wedges", "complexity", "weng")
"""
Soft shadows: samples of the light (the reference), penumbra wedges, depth complexity over the
light (right where casters overlap, too), scaled layers.
"""
MASK_SCALES, MASK_FILTERS = (1, 2, 4), ("joint", "bilinear", "nearest")
"""By how much masks of hard shadows may be smaller than a picture, and how they are enlarged."""
_MOST_LAYERS = 1000  # more is a slip


@dataclass(frozen=True)
class Methods:
    """
    What one device can count by.

    Parameters
    ----------
    title : str
        The device as refusals call it.
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
        Refuse a method of hard shadows that the device does not have.

        Parameters
        ----------
        method : str
        masks : bool
            Whether it may be a mask.

        Raises
        ------
        InputError
            If it has none of this name; the error names those that it has.
        """
        names = self.hard if masks else self.volumes
        if method not in names:
            msg = f"the {self.title} has no method '{method}'; it has {', '.join(names)}"
            raise InputError(msg, method=method)

    def check_soft(self, method: str) -> None:
        """Refuse a method of soft shadows that the device does not have; raises as `check`."""
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
}
"""By the device's name."""


@dataclass(frozen=True, kw_only=True)
class Softness:
    """
    How finely soft methods work.

    Parameters
    ----------
    samples : int
        Points that stand for a light.
    spots : int
        Spots of a light at which ``complexity`` counts what hides them.
    length, gap : float
        How far the widest scaled layer goes, and from each to the next, in tenths of the
        silhouette's radius. Weng (2008) recommends 2 to 3, and 0.3 to 0.5.

    Raises
    ------
    InputError
        If length and gap make no layer, or more than 1,000.
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
            raise InputError(msg)

    @property
    def layers(self) -> int:
        """How many layers length and gap make."""
        return round(min(self.length / self.gap, 2 * _MOST_LAYERS))

    def select(self, method: str) -> dict[str, float]:
        """Return the parameters of a method of ``SOFT``, by name."""
        named = {"samples": ("samples",), "complexity": ("spots",), "weng": ("length", "gap")}
        return {name: getattr(self, name) for name in named.get(method, ())}
