"""What a way of counting without a stencil is: values, and what is done to them."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.gl.plan import Plan
from umbra.gl.state import State
from umbra.gl.target import Target

__all__ = ["DOUBLE", "HALVE", "Counts", "Method", "Step"]


class Counts(Protocol):
    """What frames and pictures ask of whatever counts: the stencil's ``Counter``, or a mask's."""

    def count(self, state: State, target: Target, plan: Plan, *, is_clear: bool = False) -> None:
        """Count in a target whose depth holds the scene; after, stencil 0 means lit."""

    def read(self, target: Target, plan: Plan) -> NDArray[np.int32]:
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
        What the device in use rounds otherwise lowers it (``limits.py``).
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
