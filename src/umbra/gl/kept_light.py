"""Data of a light that a planner keeps between frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.nearby import Nearby, find_nearby
from umbra.gl.overlap import KnownBound, bound_nearby
from umbra.gl.volumes import BodyVolumes

__all__ = ["KeptLight"]

_STEPS = 8  # of a lamp's motion that a bound covers


@dataclass(eq=False)
class KeptLight:
    """Data of one light kept between frames."""

    source: NDArray[np.float64]
    volumes: list[BodyVolumes]
    moves: int
    near: list[NDArray[np.intp]]
    nearby: Nearby | None = None
    touched: NDArray[np.bool_] | None = None
    bounded: KnownBound | None = None
    step: float = 0.0

    def follow(self, old: "KeptLight", source: NDArray[np.float64]) -> None:
        """Take over the bound of a nearby light, and the distance moved since."""
        self.bounded = old.bounded
        self.step = float(np.abs(source - old.source).sum())

    def touch(self, source: NDArray[np.float64], drawn: NDArray[np.bool_]) -> Nearby | None:
        """Find the points near the light of the shells drawn now or before."""
        if not any(map(len, self.near)):
            return None
        if self.touched is None or (drawn & ~self.touched).any():
            self.touched = drawn if self.touched is None else drawn | self.touched
            wanted, offset = [], 0
            for each, near in zip(self.volumes, self.near, strict=True):
                numbers = offset + near @ (each.body.n_shells, 1)
                offset += each.body.n_shells * len(each.body.groups)
                wanted.append(near[self.touched[numbers]])
            self.nearby = find_nearby(self.volumes, source, wanted)
        return self.nearby

    def bound(
        self, source: NDArray[np.float64], bounds: NDArray[np.float64], drawn: NDArray[np.bool_]
    ) -> int:
        """Bound the count of the drawn shells (n,); boxes are of all shells (n, 2, 3)."""
        self.bounded = bound_nearby(
            self.volumes, bounds, source, drawn, self.bounded, _STEPS * self.step
        )
        return self.bounded.most
