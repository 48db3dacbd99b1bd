"""
Shadow masks without a stencil (Roettger, Irion, Ertl 2002), and the stencil as one of them.

    Plan -> pieces -> painter -> a method's target -> three rectangles -> lit or not
            convex,   doubles
            at_once   and halves

A method is one ``Method``: where it counts, from which value, what a front and a back do to
it, and which rectangles leave 0 and 1. To add one, write its record and list it in ``MASKS``,
both here.
"""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.gl.plan import VolumePlan
from umbra.gl.state import State
from umbra.gl.target import Target

__all__ = ["DOUBLE", "HALVE", "MASKS", "PRINTED", "Counts", "Method", "Step"]


class Counts(Protocol):
    """What counts for frames and pictures: ``VolumeCounter`` in the stencil, or a mask."""

    def count(
        self, state: State, target: Target, plan: VolumePlan, *, is_clear: bool = False
    ) -> None:
        """Count in a target whose depth holds the scene; after, stencil 0 means lit."""

    def read(self, target: Target, plan: VolumePlan) -> NDArray[np.int32]:
        """Read what was counted, (rows, cols), row 0 at the top."""

    def release(self) -> None:
        """Free what is held on the device."""


@dataclass(frozen=True)
class Step:
    """
    What a face or a rectangle does to the values that it covers.

    Parameters
    ----------
    blend : str
        Of ``Pass``.
    brightness : float
        Of all its channels.
    """

    blend: str
    brightness: float


DOUBLE, HALVE = Step("double", 1.0), Step("multiply", 0.5)


@dataclass(frozen=True, kw_only=True)
class Method:
    """
    A way of counting shadow volumes in colours.

    Parameters
    ----------
    name : str
    format : str
        Of the target that holds the mask, see ``FORMATS``.
    write : {'alpha', 'rgb'} or True
        The channels that hold it.
    start : float
        The value of what is lit.
    up, down : Step
        For each volume that begins before the visible surface, and each that ends there.
    first : {'up', 'down'}
        What comes first within a batch of volumes.
    at_once : int
        The domain: no line may meet more than so many fronts, nor backs, of one batch.
        What the device in use rounds otherwise lowers it (``find_limit``).
    lit : (float, float)
        Between which the value of what is lit lies, after the ``black`` rectangles.
    black : tuple of Step
        Rectangles after which what is lit is 1 and what is not is 0.
    attenuated : tuple of Step
        Rectangles after which it is 1 and 1/2.
    counts : bool
        The values tell counts, not only whether there is any.
    """

    name: str
    format: str
    write: str | bool
    start: float
    up: Step
    down: Step
    first: str
    at_once: int
    lit: tuple[float, float]
    black: tuple[Step, ...] = ()
    attenuated: tuple[Step, ...] = ()
    counts: bool = False

    @property
    def channel(self) -> int:
        """The channel to look at."""
        return 3 if self.write == "alpha" else 0


_INVERT = Step("invert", 1.0)
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
    # Clamped to 1/4 -> 1/2 and 1, then 1/2 and 0; the figure's last "/2" must double.
    black=(DOUBLE, _INVERT, DOUBLE),
    attenuated=(DOUBLE, _INVERT, Step("add", 0.5)),
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
    # Shadow is 1/2 at most: inverted and doubled it is 1, and light still 0.
    black=(_INVERT, DOUBLE, _INVERT),
    attenuated=(Step("max", 0.5),),
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
