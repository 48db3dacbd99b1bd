"""Weighted lights, which a study adds up."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.scene.numbers import read_array

__all__ = ["Lights"]

_AXES = 2
_UNIT = 1e-5
"""Most by which the length of a direction differs from 1, as of one in float32."""
_SHOWN = 4
"""Numbers of a light that an error shows."""


@dataclass(frozen=True, eq=False)
class Lights:
    """
    Homogeneous lights with a weight in every column.

    One day's hours are one column; hours by day are one column per day.

    Parameters
    ----------
    vectors : (n, 4) float64
        w = 0: unit direction toward the light in the model's axes; w = 1: lamp's position in
        the scene's local frame [m].
    weights : (n, k) float64
    names, units : tuple of str
        Weight in each column.
    starts, ends : (n,) int64
        Start and end of each light's time, UTC [us since 1970]; ascending.
    step : (n,) int64
        Index of each in its source, such as the steps of a study.
    days : tuple of tuple of slice
        Runs of consecutive lights of each day; a day may have none.
    """

    vectors: NDArray[np.float64]
    weights: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    step: NDArray[np.int64]
    days: tuple[tuple[slice, ...], ...]

    @classmethod
    def of(
        cls,
        vectors: NDArray[np.float64],
        weights: ArrayLike | None = None,
        names: tuple[str, ...] = ("lights",),
        units: tuple[str, ...] = ("1",),
        step: NDArray[np.int64] | None = None,
    ) -> Self:
        """
        Make lights without times.

        Parameters
        ----------
        vectors : (n, 3) or (n, 4) float64
        weights : (n,) or (n, k) float, optional
            1 each by default.
        names, units : tuple of str
        step : (n,) int64, optional
            Index of each in its source.

        Raises
        ------
        InputError
            If an array has another shape, or holds a number that is not finite.
        """
        toward = read_array("vectors of lights", vectors)
        if toward.ndim != _AXES or toward.shape[1] not in {3, 4}:
            msg = f"vectors of lights have the shape {toward.shape}; make it (n, 3) or (n, 4)"
            raise InputError(msg)
        count = len(toward)
        whole = np.zeros((count, 4))
        whole[:, : toward.shape[1]] = toward
        given = np.ones(count) if weights is None else read_array("weights of lights", weights)
        if given.ndim not in {1, _AXES} or len(given) != count:
            msg = f"weights of {count} lights have the shape {given.shape}; make it ({count},) or "
            raise InputError(msg + f"({count}, k)")
        for what, numbers in (
            ("vectors", whole),
            ("weights", given.reshape(count, math.prod(given.shape[1:]))),
        ):
            _refuse(what, np.asarray(~np.isfinite(numbers).all(1)), numbers, "not finite")
        none = np.zeros(count, np.int64)
        return cls(
            whole, given if given.ndim > 1 else given[:, None], names, units, none, none,
            np.arange(count) if step is None else step,
            ((slice(0, count),),) if count else ((),),
        )  # fmt: skip

    def check(self) -> None:
        """
        Refuse lights that a measure cannot add up.

        Raises
        ------
        InputError
            If a direction is not of unit length, or a weight is negative.
        """
        w, length = self.vectors[:, 3], np.linalg.norm(self.vectors[:, :3], axis=1)
        wrong = (w != 0) & (w != 1)
        _refuse("vectors", wrong, self.vectors, "of w other than 0 (a direction) and 1 (a lamp)")
        wrong = (w == 0) & (np.abs(length - 1) > _UNIT)
        _refuse("directions", wrong, self.vectors[:, :3], "not of unit length", "divide by it")
        wrong = np.asarray((self.weights < 0).any(1))
        remedy = "subtract one column from another in derive"
        _refuse("weights", wrong, self.weights, "negative", remedy)

    def __len__(self) -> int:
        return len(self.vectors)

    @property
    def are_suns(self) -> NDArray[np.bool_]:
        """Directions above the horizon, which need no rays, (n,) bool."""
        return (self.vectors[:, 3] == 0) & (self.vectors[:, 2] > 0)

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit directions of suns, (n, 3); homogeneous lights (n, 4) if others are among them."""
        has_others = (self.vectors[:, 3] != 0) | (self.vectors[:, 2] < 0)
        columns = 4 if has_others.any() else 3
        return np.ascontiguousarray(self.vectors[:, :columns])

    def pick(self, which: NDArray[np.bool_] | NDArray[np.integer]) -> Self:
        """Return some of the lights, without their times."""
        return type(self).of(
            self.vectors[which], self.weights[which], self.names, self.units, self.step[which]
        )

    def split(self) -> tuple[Self, Self]:
        """Return the suns, and all other lights; without their times."""
        return self.pick(self.are_suns), self.pick(~self.are_suns)

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Duration of each light [us]."""
        return self.ends - self.starts


def _refuse(
    what: str, wrong: NDArray[np.bool_], numbers: NDArray[np.float64], how: str, remedy: str = ""
) -> None:
    """Refuse lights where ``wrong`` (n,), and tell the first."""
    if not wrong.any():
        return
    first, advice = int(wrong.argmax()), remedy or "leave such lights out"
    told = ", ".join(f"{x:g}" for x in numbers[first][:_SHOWN])
    msg = f"{what} of {np.count_nonzero(wrong)} of {len(wrong)} lights are {how} (first: light "
    raise InputError(msg + f"{first}, {told}); {advice}")
