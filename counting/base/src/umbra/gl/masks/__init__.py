"""
Shadow masks without a stencil (Roettger, Irion, Ertl 2002), and the stencil as one of them.

    Plan -> pieces -> painter -> a method's target -> three rectangles -> lit or not
            convex,   doubles
            at_once   and halves

A ``Method`` defines the target, the initial value, the operations of front and back faces,
and the rectangles that map the result to 0 and 1. To add one, define its record here and
list it in ``MASKS``.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.gl.volume_plan import VolumePlan

__all__ = ["DOUBLE", "HALVE", "MASKS", "PRINTED", "Counts", "MaskStep", "Method"]


class Counts(Protocol):
    """Counter for frames and pictures: ``VolumeCounter`` in the stencil, or a mask."""

    def count(
        self, state: State, target: Target, plan: VolumePlan, *, is_clear: bool = False
    ) -> None:
        """Count in a target whose depth holds the scene; afterwards stencil 0 means lit."""

    def read(self, target: Target, plan: VolumePlan) -> NDArray[np.int32]:
        """Read the counts, (rows, cols), row 0 at the top."""

    def release(self) -> None:
        """Free the device objects."""


@dataclass(frozen=True)
class MaskStep:
    """
    Blend operation of a face or a rectangle.

    Parameters
    ----------
    blend : str
        Blend mode, as in ``Pass``.
    brightness : float
        Value of all channels.
    """

    blend: str
    brightness: float


DOUBLE, HALVE = MaskStep("double", 1.0), MaskStep("multiply", 0.5)


@dataclass(frozen=True, kw_only=True)
class Method:
    """
    A method of counting shadow volumes in colours.

    Parameters
    ----------
    name : str
    format : str
        Format of the mask's target, see ``FORMATS``.
    write : {'alpha', 'rgb'} or True
        Channels of the mask.
    start : float
        Value of lit pixels.
    up, down : Step
        Operations where a volume begins and ends in front of the visible surface.
    first : {'up', 'down'}
        First operation within a batch of volumes.
    at_once : int
        Domain: the most fronts, and backs, of one batch on any line. The device's
        rounding may lower it (``find_limit``).
    lit : (float, float)
        Range of lit values after the ``black`` rectangles.
    black : tuple of Step
        Rectangles that map lit to 1 and shadow to 0.
    attenuated : tuple of Step
        Rectangles that map lit to 1 and shadow to 1/2.
    counts : bool
        Values determine the count, not only whether it is 0.
    """

    name: str
    format: str
    write: str | bool
    start: float
    up: MaskStep
    down: MaskStep
    first: str
    at_once: int
    lit: tuple[float, float]
    black: tuple[MaskStep, ...] = ()
    attenuated: tuple[MaskStep, ...] = ()
    counts: bool = False

    def attenuate(self, remains: float) -> tuple[MaskStep, ...]:
        """
        Return the rectangles that map lit to 1 and shadow to the share of brightness that remains.

        The paper's third rectangle adds 1/2 and so attenuates by that alone; any other share takes
        a fourth, which lifts the 0 of shadow (docs/papers.md, R5).
        """
        if remains == _HALF_BRIGHT and self.attenuated:
            return self.attenuated
        return (*self.black, MaskStep("lift", remains)) if remains > 0 else self.black

    @property
    def channel(self) -> int:
        """The channel to read."""
        return 3 if self.write == "alpha" else 0


_INVERT, _HALF_BRIGHT = MaskStep("invert", 1.0), 0.5
_START = 2.0**-8

_ALPHA = Method(
    name="alpha",
    format="rgba8",
    write="alpha",
    start=0.25,
    up=DOUBLE,
    down=HALVE,
    first="down",
    at_once=6,
    lit=(0.75, 1.0),
    # Clamped to 1/4 -> 1/2 and 1, then 1/2 and 0; the last "/2" of the paper's figure must double.
    black=(DOUBLE, _INVERT, DOUBLE),
    attenuated=(DOUBLE, _INVERT, MaskStep("add", _HALF_BRIGHT)),
)
_MAXIMUM = Method(
    name="max",
    format="rgba8",
    write="alpha",
    start=1.0,
    up=HALVE,
    down=DOUBLE,
    first="up",
    at_once=7,
    lit=(0.75, 1.0),
    # Shadow is at most 1/2: inverted and doubled it is 1, and light stays 0.
    black=(_INVERT, DOUBLE, _INVERT),
    attenuated=(MaskStep("max", _HALF_BRIGHT),),
)
_HALF = Method(
    name="half",
    format="rgba16f",
    write=True,
    start=_START,
    up=DOUBLE,
    down=HALVE,
    first="up",
    at_once=23,
    lit=(_START, _START),
    counts=True,
)

MASKS = {
    method.name: method
    for method in (_ALPHA, replace(_ALPHA, name="screen", write="rgb"), _MAXIMUM, _HALF)
}
"""The methods by name."""

PRINTED = replace(_ALPHA, name="alpha, fronts first", first="up", at_once=1)
"""The order of the paper: one convex volume at a time."""
