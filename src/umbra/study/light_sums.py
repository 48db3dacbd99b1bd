"""Sums of the weights of lights that receivers do not see, of all lights and of parts of them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.receivers.kind import Counter
from umbra.study.counters import split_lights

__all__ = ["NO_PARTS", "LightParts", "add_up", "find_unit", "round_weights"]

_FEW = 4  # mean number of lights per weight from which integers are summed


def _ignore(_: int) -> None:
    """Ignore progress."""


@dataclass(frozen=True, eq=False)
class LightParts:
    """
    Sums of parts of some lights, such as those of each month, besides the sum of all.

    Parameters
    ----------
    part : (n,) int
        Part of each light; not read where there are none.
    sums : (n_parts, ...) float32
        Of the first column of weights.
    """

    part: NDArray[np.intp]
    sums: NDArray[np.float32]

    @classmethod
    def of(cls, part: NDArray[np.intp], count: int, shape: tuple[int, ...]) -> Self:
        """Make a number of parts with sums of 0."""
        return cls(part, np.zeros((count, *shape), np.float32))

    def pick(self, chosen: NDArray[np.bool_]) -> Self:
        """Return the parts of some of the lights, with sums of 0."""
        if not len(self.sums):
            return self
        return replace(self, part=self.part[chosen], sums=np.zeros_like(self.sums))

    def add(self, sums: NDArray[np.float32]) -> None:
        """Add to the sums."""
        self.sums[...] += sums

    def count(
        self, count: Callable[[Counter, NDArray[np.bool_], NDArray[np.int32]], object],
        runs: Iterable[tuple[NDArray[np.bool_], Counter]], chosen: NDArray[np.bool_],
        total: NDArray[np.int32], unit: float,
    ) -> None:  # fmt: skip
        """
        Count some lights into a total of all columns (k, ...), part by part.

        ``count`` is called with a counter, a selection of the lights and an array to add to.
        ``runs`` are selections of all lights, each with its counter; ``unit`` is that of the first
        column.
        """
        own = np.zeros((len(self.sums), *total.shape), np.int32)
        for run, counter in runs:
            for which, counts in enumerate(own):
                is_own = chosen & run & (self.part == which)
                if is_own.any():
                    count(counter, is_own, counts)
        for sums, counts in zip(self.sums, own, strict=True):
            total += counts
            np.add(sums, np.multiply(counts[0], np.float32(unit), dtype=np.float32), out=sums)


NO_PARTS = LightParts(np.zeros(0, np.intp), np.zeros(0, np.float32))


def add_up(
    counter: Counter,
    shape: tuple[int, ...],
    lights: Lights,
    progress: Callable[[int], object] = _ignore,
    parts: LightParts = NO_PARTS,
) -> NDArray[np.float32]:
    """
    Add the weights of the lights that each receiver does not see.

    Lights of equal weight are counted; distinct weights are added in fixed point, as multiples of
    a number that is at most 2^-30 of a column's whole. Either way sums are of integers: they do not
    depend on the order of the lights, on tiles or threads.

    Parameters
    ----------
    counter : Counter
    shape : tuple of int
        Shape of the receivers.
    lights : Lights
    progress : callable
    parts : LightParts
        Of the lights, whose sums are added up, too.

    Returns
    -------
    sums : (k, ...) float32
        Sum of each column.
    """
    sums = np.zeros((lights.weights.shape[1], *shape), np.float32)
    rows, group = np.unique(lights.weights, axis=0, return_inverse=True)
    group, directions = group.ravel(), lights.directions
    if _FEW * len(rows) > len(lights) > _FEW * lights.weights.shape[1]:
        unit = find_unit(lights.weights)
        weights = np.rint(lights.weights / unit).astype(np.int32)
        whole = np.zeros(sums.shape, np.int32)

        def add(by: Counter, chosen: NDArray[np.bool_], into: NDArray[np.int32]) -> None:
            by.add_weights(directions[chosen], weights[chosen], into, progress)

        every = np.ones(len(lights), np.bool_)
        if len(parts.sums):
            parts.count(add, split_lights(counter, directions), every, whole, unit[0])
        else:
            add(counter, every, whole)
        for total, summed, step in zip(sums, whole, unit, strict=True):
            np.multiply(summed, step, out=total, casting="same_kind")
        return sums

    def count(by: Counter, chosen: NDArray[np.bool_], into: NDArray[np.int32]) -> None:
        own = directions[chosen]
        by.add_weights(own, np.ones((len(own), 1), np.int32), into, progress)

    for k, row in enumerate(rows):
        counts = np.zeros(shape, np.int32)
        if len(parts.sums):
            parts.count(count, split_lights(counter, directions), group == k, counts[None], row[0])
        else:
            count(counter, group == k, counts[None])
        for column in np.flatnonzero(row):
            total, weight = np.atleast_2d(sums[column]), np.float32(row[column])
            for i, values in enumerate(np.atleast_2d(counts)):  # row by row: saves a full copy
                total[i] += np.multiply(values, weight, dtype=np.float32)
    return sums


def find_unit(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Find the unit of each column in which its rounded weights (n, k) fit an int32 sum, (k,) float64.

    Each of n roundings is off by half a unit: together by at most n / 2^32 of the column's sum.
    """
    whole = np.abs(weights).sum(0)
    return np.where(whole > 0, whole, 1.0) / (2.0**31 - 1 - len(weights))


def round_weights(
    weights: NDArray[np.float64],
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """
    Round weights (n, k) to whole numbers (n, k), and return the unit of each column (k,).

    Equal weights of a column, zeros aside, are their own unit, so that their sums are exact.
    """
    unit = find_unit(weights)
    if len(weights):
        most = np.take_along_axis(weights, np.abs(weights).argmax(0)[None], 0)
        is_equal = ((weights == most) | (weights == 0)).all(0) & (most[0] != 0)
        unit = np.where(is_equal, most[0], unit)
    return np.rint(weights / unit).astype(np.int32), unit
