"""What rules judge: named areas, windows, bands and places, as samples with owners."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.openings import Openings

__all__ = ["Subjects", "of_points"]

_NEAR = 4  # neighbours of a sample


@dataclass(frozen=True, eq=False, kw_only=True)
class Subjects:
    """
    Named receivers of a rule, sampled.

    Parameters
    ----------
    kind : {'areas', 'windows', 'band', 'places'}
    names : (k,) tuple of str
    owner : (n,) intp
        Index of each sample's receiver; ascending.
    points : (n, 3) float64
        In the model's own coordinates [m].
    normals : (n, 3) float64
        NaN for samples that receive from all sides.
    areas : (n,) float64
        That each sample stands for [m2].
    azimuths : (k,) float64
        Where windows face, clockwise from true north; NaN for others [degrees].
    flats, rooms, storeys : (k,) tuple of str
        Empty where unknown.
    records : tuple
        ``Area`` or ``Window`` of each, if any.
    openings : Openings, optional
        Of the samples of windows, which see the sun through them alone.
    """

    kind: str
    names: tuple[str, ...]
    owner: NDArray[np.intp]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    areas: NDArray[np.float64]
    azimuths: NDArray[np.float64]
    flats: tuple[str, ...]
    rooms: tuple[str, ...]
    storeys: tuple[str, ...]
    records: tuple[Any, ...] = ()
    openings: Openings | None = None

    def __len__(self) -> int:
        return len(self.names)

    @property
    def totals(self) -> NDArray[np.float64]:
        """Area of each receiver, (k,) [m2]."""
        return np.bincount(self.owner, self.areas, len(self.names)).astype(np.float64)

    def name_group(self, of_each: str, k: int) -> str:
        """Name the flat, room or storey of a receiver, a room with its flat; empty if unknown."""
        labels = {"flat": self.flats, "room": self.rooms, "storey": self.storeys}
        label = labels[of_each][k] if of_each else ""
        flat = self.flats[k] if of_each == "room" else ""
        return f"{flat}, {label}" if flat and label else label

    def find_away(self, suns: NDArray[np.float64]) -> NDArray[np.bool_]:
        """
        Find which samples no sun reaches by themselves, whatever stands around, (s, n).

        Their plane faces away from it, or the frame of their opening is in the way.

        Parameters
        ----------
        suns : (s, 3) float64
        """
        with np.errstate(invalid="ignore"):  # samples without a plane receive from all sides
            away = suns @ self.normals.T <= 0
        return away | self.find_framed(suns)

    def find_framed(self, suns: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Find which samples see the frame of their opening, not the sun, (s, n)."""
        if self.openings is None or not self.openings.are_deep:
            return np.zeros((len(suns), len(self.owner)), np.bool_)
        return self.openings.find_framed(suns[:, None])

    def average(self, values: NDArray) -> NDArray[np.float64]:
        """Return means (..., k) of values of samples (..., n), weighted by area."""
        sums = self.add(np.asarray(values, np.float64) * self.areas)
        return sums / self.totals

    def add(self, values: NDArray) -> NDArray[np.float64]:
        """Return sums (..., k) of values of samples (..., n)."""
        rows = np.asarray(values, np.float64).reshape(-1, len(self.owner))
        starts = np.searchsorted(self.owner, np.arange(len(self.names)))
        return np.add.reduceat(rows, starts, axis=1).reshape(*np.shape(values)[:-1], len(self))

    def find_worst(self, values: NDArray, *, is_least: bool) -> NDArray[np.float64]:
        """Return the least, or the most, of values (n,) of each receiver, (k,)."""
        starts = np.searchsorted(self.owner, np.arange(len(self.names)))
        pick = np.minimum if is_least else np.maximum
        return np.asarray(pick.reduceat(np.asarray(values, np.float64), starts))

    @cached_property
    def near(self) -> NDArray[np.intp]:
        """Indices of the nearest samples of the same receiver, (n, 4); itself where it has few."""
        from scipy.spatial import cKDTree  # noqa: PLC0415 - comes with pvlib; 0.2 s

        near = np.repeat(np.arange(len(self.owner))[:, None], _NEAR, 1)
        for k in range(len(self)):
            own = np.flatnonzero(self.owner == k)
            if len(own) > _NEAR:
                plan = self.points[own, :2]
                near[own] = own[cKDTree(plan).query(plan, _NEAR + 1)[1][:, 1:]]
        return near

    def pick(self, which: Sequence[int]) -> "Subjects":
        """Return some of them, by ascending indices."""
        is_picked = np.isin(self.owner, which)
        order = np.full(len(self), -1, np.intp)
        order[list(which)] = np.arange(len(which))

        def choose(words: tuple[Any, ...]) -> tuple[Any, ...]:
            return tuple(words[k] for k in which) if words else ()

        return Subjects(
            kind=self.kind, names=choose(self.names), owner=order[self.owner[is_picked]],
            points=self.points[is_picked], normals=self.normals[is_picked],
            areas=self.areas[is_picked], azimuths=self.azimuths[list(which)],
            flats=choose(self.flats), rooms=choose(self.rooms), storeys=choose(self.storeys),
            records=choose(self.records),
            openings=None if self.openings is None else self.openings.pick(is_picked),
        )  # fmt: skip


def of_points(
    kind: str, names: Sequence[str], points: Any, normals: Any = None, **more: Any
) -> Subjects:
    """Return receivers of one sample each."""
    places = np.atleast_2d(np.asarray(points, np.float64))
    count = len(names)
    toward = np.full((count, 3), np.nan) if normals is None else np.asarray(normals, np.float64)
    none = ("",) * count
    return Subjects(**{
        "kind": kind, "names": tuple(names), "owner": np.arange(count), "points": places,
        "normals": toward, "areas": np.ones(count), "azimuths": np.full(count, np.nan),
        "flats": none, "rooms": none, "storeys": none, **more,
    })  # fmt: skip
