"""
Every instant of a study, eight to a byte.

A year at 15 minutes has about 17,500 instants with the sun up; of a million cells they
take 2.2 GB. At night nothing is in shadow, so nothing is kept.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Receivers, Variables
from umbra.study.lights import Lights
from umbra.study.loop import Accumulator, TileRun
from umbra.study.period import Period

__all__ = ["MASKS", "InstantMasks", "Masks"]

MASKS = ("in_shadow", "under_canopy")
"""Variables of every instant, which are kept packed."""


class Masks:
    """
    Which receivers are in shadow at each instant: reads like an (n, ...) uint8 array.

    ``masks[i]`` unpacks one instant, iteration one after another, ``numpy.asarray`` all.

    Parameters
    ----------
    is_up : (n,) bool
        Instants with the sun up; the others read as 0.
    shape : tuple of int
        Of the receivers.
    """

    dtype = np.dtype(np.uint8)

    def __init__(self, is_up: NDArray[np.bool_], shape: tuple[int, ...]) -> None:
        self.place = np.where(is_up, np.cumsum(is_up) - 1, -1)
        self.bits = np.zeros(((int(is_up.sum()) + 7) // 8, *shape), np.uint8)

    @property
    def shape(self) -> tuple[int, ...]:
        """Instants, then the receivers' own shape."""
        return (len(self.place), *self.bits.shape[1:])

    @property
    def ndim(self) -> int:
        """Number of dimensions."""
        return self.bits.ndim

    @property
    def size(self) -> int:
        """Number of values."""
        return int(np.prod(self.shape, dtype=np.int64))

    @property
    def nbytes(self) -> int:
        """Memory that they take [byte]."""
        return self.bits.nbytes

    def keep(self, instants: NDArray[np.intp], masks: NDArray[np.uint8], where: Any = ...) -> None:
        """
        Store some instants, once each.

        Parameters
        ----------
        instants : (k,) int
            With the sun up.
        masks : (k, ...) uint8
            0 or 1.
        where : index of the receivers
            Rows and columns of a tile; all by default.
        """
        for instant, mask in zip(instants, masks, strict=True):
            place = self.place[instant]
            self.bits[place // 8][where] |= mask << np.uint8(place % 8)

    def __len__(self) -> int:
        return len(self.place)

    def __getitem__(self, key: Any) -> NDArray[np.uint8]:
        if isinstance(key, (int, np.integer)):
            place = self.place[key]
            if place < 0:
                return np.zeros(self.bits.shape[1:], np.uint8)
            return self.bits[place // 8] >> np.uint8(place % 8) & np.uint8(1)
        if isinstance(key, slice):
            return self._unpack(range(len(self))[key])
        return np.asarray(self)[key]

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        return self._unpack(range(len(self))).astype(dtype or np.uint8, copy=False)

    def _unpack(self, which: range) -> NDArray[np.uint8]:
        masks = np.zeros((len(which), *self.bits.shape[1:]), np.uint8)
        for mask, i in zip(masks, which, strict=True):
            mask[...] = self[i]
        return masks


class InstantMasks(Accumulator):
    """
    Keeps the shadow of every instant, and the receivers behind canopies alone.

    Parameters
    ----------
    period : Period
        Lights with a negative ``step`` are none of its midpoints.
    shape : tuple of int
        Of all receivers.
    has_canopy : bool
    """

    def __init__(self, period: Period, shape: tuple[int, ...], *, has_canopy: bool) -> None:
        self.masks = Masks(period.sun.is_up, shape)
        self.behind = Masks(period.sun.is_up, shape) if has_canopy else None

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin with a tile."""
        self._where = run.where

    def add(self, lights: Lights, some: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Store these instants."""
        steps = lights.step[some]
        is_kept = steps >= 0
        dark = masks[-1][is_kept]
        self.masks.keep(steps[is_kept], dark, self._where)
        if self.behind is not None:
            self.behind.keep(steps[is_kept], masks[0][is_kept] & ~dark, self._where)

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        for masks in (self.masks, self.behind):
            if masks is not None:
                masks.bits[:, nothing] = 0

    def variables(self, laid: Receivers) -> Variables:
        """Return the masks, packed."""
        dims = ("time", *laid.dims)
        found: dict[str, Any] = {"in_shadow": (dims, self.masks)}
        if self.behind is not None:
            found["under_canopy"] = (dims, self.behind)
        return found
