"""Weighted lights, which a study adds up."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Lights"]


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
        """
        count = len(vectors)
        whole = np.zeros((count, 4))
        whole[:, : vectors.shape[1]] = vectors
        given = np.ones(count) if weights is None else np.asarray(weights, np.float64)
        none = np.zeros(count, np.int64)
        return cls(
            whole, given if given.ndim > 1 else given[:, None], names, units, none, none,
            np.arange(count) if step is None else step,
            ((slice(0, count),),) if count else ((),),
        )  # fmt: skip

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
