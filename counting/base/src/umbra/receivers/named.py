"""
Receivers with a name and a shape: areas and windows, as groups of samples.

Whatever is counted on samples is told of their groups: by the share of a group's area, by its mean,
least and most.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.receivers.kind import DIMS, Variables
from umbra.receivers.placed import PlacedReceivers
from umbra.receivers.single import PointTile, SharedEdges
from umbra.receivers.surface_samples import Samples

__all__ = ["NamedReceivers"]


@dataclass(eq=False, kw_only=True)
class NamedReceivers(PlacedReceivers):
    """
    Samples in groups with names.

    Parameters
    ----------
    records : sequence of Area or Window
        One for each group, in order.
    owner : (n,) int
        Group of each sample, ascending; each group has a sample at least.
    notes : tuple of str
        What a user should know of how they were laid out, one line each.
    """

    areas: NDArray[np.float64]
    records: Sequence[Any]
    owner: NDArray[np.intp]
    notes: tuple[str, ...] = field(default=())

    @property
    def group_names(self) -> list[str]:
        """Names of the groups."""
        return [record.name for record in self.records]

    @cached_property
    def group_areas(self) -> NDArray[np.float64]:
        """Area of each group, (n_groups,) [m2]."""
        return np.asarray(np.bincount(self.owner, self.areas, len(self.records)), np.float64)

    @cached_property
    def _first(self) -> NDArray[np.intp]:
        """First sample of each group."""
        return np.searchsorted(self.owner, np.arange(len(self.records)))

    def average(self, values: ArrayLike) -> NDArray[np.float64]:
        """
        Return means by group, weighted by area.

        Parameters
        ----------
        values : (..., n) array_like

        Returns
        -------
        means : (..., n_groups) float64
        """
        weighted = np.asarray(values, np.float64) * self.areas
        return np.add.reduceat(weighted, self._first, axis=-1) / self.group_areas

    def share(self, test: ArrayLike) -> NDArray[np.float64]:
        """Return the share of each group's area that passes a test (..., n), (..., n_groups)."""
        return self.average(np.asarray(test, np.bool_))

    def least(self, values: ArrayLike) -> NDArray[Any]:
        """Return the least value (..., n) of each group, (..., n_groups)."""
        return np.minimum.reduceat(np.asarray(values), self._first, axis=-1)

    def most(self, values: ArrayLike) -> NDArray[Any]:
        """Return the greatest value (..., n) of each group, (..., n_groups)."""
        return np.maximum.reduceat(np.asarray(values), self._first, axis=-1)

    def _cut(
        self, chunk: int, samples: Samples | None
    ) -> list[tuple[slice, Callable[[], PointTile]]]:
        """Cut them into chunks so that the sums of a group do not depend on what else there is."""
        starts, shared = [0], SharedEdges()
        ends = [*self._first[1:].tolist(), len(self.owner)]
        for begin, end in zip(self._first.tolist(), ends, strict=True):
            if end - starts[-1] > chunk:
                starts += range(begin, end, chunk)
        edges = [*dict.fromkeys(starts), len(self.owner)]
        return [
            (slice(a, b), partial(self._make_tile, samples, slice(a, b), shared))
            for a, b in pairwise(edges)
        ]

    def sum_up(self, study: Any) -> Variables:
        """Return the area and the group of each sample."""
        return {
            "area": (DIMS, self.areas),
            "group_of_sample": (DIMS, self.owner.astype(np.int32)),
        }
