"""Lights with weights: what a study adds up, one light after another."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["AnyLights", "Lights"]


@dataclass(frozen=True, eq=False)
class Lights:
    """
    Homogeneous lights, each with a weight in every column.

    Hours of a day are one column, hours by day a column for each day.

    Parameters
    ----------
    vectors : (n, 4) float64
        With w = 0 a unit direction toward the light in the model's axes, with w = 1 a lamp's
        place in the scene's local frame [m].
    weights : (n, k) float64
    names, units : tuple of str
        Of the k columns.
    starts, ends : (n,) int64
        Start and end of the time that each light stands for, UTC [us since 1970]; ascending.
    step : (n,) int64
        Index of each in its source, such as the steps of a study.
    days : tuple of tuple of slice
        For each day the runs of lights that follow one another; a day may have none.
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
        Make lights that have no place in time.

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
        """Whether each is a direction above the horizon, (n,): they are counted without rays."""
        return (self.vectors[:, 3] == 0) & (self.vectors[:, 2] > 0)

    @property
    def directions(self) -> NDArray[np.float64]:
        """Unit directions, (n, 3) float64, as counters of suns take them."""
        return np.ascontiguousarray(self.vectors[:, :3])

    def split(self) -> "tuple[Lights, AnyLights]":
        """Return the suns, and all other lights; without their places in time."""
        parts = [
            (self.vectors[which], self.weights[which], self.names, self.units, self.step[which])
            for which in (self.are_suns, ~self.are_suns)
        ]
        return Lights.of(*parts[0]), AnyLights.of(*parts[1])

    @property
    def lengths(self) -> NDArray[np.int64]:
        """How long each light stands for its weight [us]."""
        return self.ends - self.starts

    def weigh(self, weights: NDArray[np.float64], names: tuple[str, ...]) -> "Lights":
        """Return the same lights with other weights, (n, k)."""
        return replace(self, weights=weights, names=names, units=self.units[:1] * len(names))


class AnyLights(Lights):
    """Lights of any place, which rays count: lamps, and directions below the horizon."""

    @property
    def directions(self) -> NDArray[np.float64]:
        """Homogeneous lights, (n, 4) float64, as counters of any lights take them."""
        return self.vectors
