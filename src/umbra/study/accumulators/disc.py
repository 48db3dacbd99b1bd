"""Hours weighed by the share of the sun's disc that each receiver sees, and its contacts."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.rays.sun_disc import find_free_disc
from umbra.receivers.kind import Receivers, Tile, Variables
from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.accumulators.step_masks import HourSums
from umbra.study.loop import TileRun
from umbra.sun import find_sun

__all__ = ["RADIUS", "DiscHours"]

RADIUS = 0.2666
"""Of the sun's disc, its mean through the year [degrees]."""
_AT_ONCE = 8
_CLOSE = 1_000_000  # to which contacts are solved [us]
_SEEN = 1e-9  # least share that is seen: above the rounding of areas, 1e-4 s after contact
_MINUTE = 60_000_000  # [us]
_LOW = 0.02  # sine of the altitude above which the sun's place is smooth in time
_SOME = 65_536  # receivers whose contacts are solved at a time
_NEVER = np.iinfo(np.int64).min


class DiscHours(HourSums):
    """
    Accumulator of hours in shadow, each step by the share of the disc that is hidden.

    And of the first and the last contact: when a part of the disc first appears, and when the last
    of it goes, of all dates together. Between two steps without any sun none is found.

    Parameters
    ----------
    arrays : ResultArrays
        Written to.
    """

    def __init__(self, arrays: ResultArrays) -> None:
        super().__init__(arrays)
        self._contacts = np.full((2, *arrays.shape), _NEVER)
        self._minutes, self._suns = np.zeros(0, np.int64), np.zeros((0, 3))

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add up the hours, and solve the contacts."""
        count = len(run.tiles[0].places.points)
        self._first, self._last = (np.full((2, count), _NEVER) for _ in range(2))
        super().add_sums(run, lights, progress)
        where = run.where if isinstance(run.where, tuple) else (run.where,)
        for k, found in enumerate((self._first, self._last)):
            solved = self._solve(run.tiles[0], *found)
            self._contacts[k, *where] = solved.reshape(run.shape)

    def _add_groups(
        self, run: TileRun, lights: Lights, group: NDArray[np.intp], shares: NDArray[np.float64],
        progress: Callable[[int], object],
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:  # fmt: skip
        """Return the hours of hidden parts of the disc; canopies have none."""
        places, casting = run.tiles[0].places, run.tiles[0].casting
        hours = np.zeros(len(places.points))
        directions = np.ascontiguousarray(lights.directions[:, :3])
        middles = (lights.starts + lights.ends) // 2
        before, after = self._find_dark(lights, middles)
        for first in range(0, len(lights), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            free = find_free_disc(
                run.tiles[0].tree, places.points, places.normals, directions[some][:, None],
                RADIUS, casting.threads,
            )  # fmt: skip
            hours += lights.weights[some, 0] @ (1 - free)
            for k, seen in enumerate(free > _SEEN, first):
                begins = seen & (self._first[1] == _NEVER)
                self._first[:, begins] = np.array([[before[k]], [middles[k]]])
                self._last[:, seen] = np.array([[after[k]], [middles[k]]])
            progress(len(free))
        return hours.reshape(run.shape).astype(np.float32), np.zeros(run.shape, np.float32)

    def _find_dark(
        self, lights: Lights, middles: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """
        Return times before and after each light between which its contacts lie, (n,) [us].

        They are the neighbours' middles, and beyond the first and the last sun of a day those of
        the asked hours: the rim rises before the middle, and sets after it.
        """
        period = self.arrays.period
        starts, ends = period.starts, period.ends
        breaks = np.flatnonzero(starts[1:] != ends[:-1]) + 1
        firsts, lasts = np.append(0, breaks), np.append(breaks, len(starts)) - 1
        block = np.searchsorted(firsts, lights.step, "right") - 1
        joined = np.append(lights.starts[1:] == lights.ends[:-1], False)
        after = np.where(joined, np.append(middles[1:], 0), ends[lasts[block]])
        before = np.where(np.roll(joined, 1), np.roll(middles, 1), starts[firsts[block]])
        return before, after

    def _solve(
        self, tile: Tile, dark: NDArray[np.int64], lit: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """
        Return when the disc appears or goes between two times of each receiver, (n,) [us].

        A part of it is seen at ``lit``; what is seen at ``dark``, too, has its contact there.
        """
        found = lit.copy()
        which = np.flatnonzero(lit != _NEVER)
        for first in range(0, len(which), _SOME):
            some = which[first : first + _SOME]
            low, high = dark[some], lit[some]
            high = np.where(self._is_seen(tile, some, low), low, high)
            left = np.flatnonzero(np.abs(high - low) > _CLOSE)
            while len(left):
                middle = (low[left] + high[left]) // 2
                is_lit = self._is_seen(tile, some[left], middle)
                high[left[is_lit]] = middle[is_lit]
                low[left[~is_lit]] = middle[~is_lit]
                left = left[np.abs(high[left] - low[left]) > _CLOSE]
            found[some] = high
        return found

    def _is_seen(
        self, tile: Tile, some: NDArray[np.intp], times: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Return whether receivers see a part of the disc, each at its time."""
        share = find_free_disc(
            tile.tree, tile.places.points[some], tile.places.normals[some],
            self._find_suns(times)[None], RADIUS, tile.casting.threads,
        )  # fmt: skip
        return np.asarray(share[0] > _SEEN)

    def _find_suns(self, times: NDArray[np.int64]) -> NDArray[np.float64]:
        """
        Return directions of the sun, (n, 3), by cubics through those of whole minutes.

        They are within 1e-7 of the sun's own, which moves as far in 2 ms. Near the horizon, where
        refraction begins, each is found by itself.
        """
        nodes, which = np.unique(
            (times // _MINUTE)[:, None] + np.arange(-1, 3), return_inverse=True
        )
        new = np.setdiff1d(nodes, self._minutes)
        if len(new):
            every = np.concatenate([self._minutes, new])
            suns = np.concatenate([self._suns, self._find_sun(new * _MINUTE)])
            order = np.argsort(every)
            self._minutes, self._suns = every[order], suns[order]
        each = self._suns[np.searchsorted(self._minutes, nodes)][which.reshape(-1, 4)]
        t = times % _MINUTE / _MINUTE
        weights = np.stack([
            -t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2,
            -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6,
        ], 1)  # fmt: skip
        found = np.einsum("nk,nkj->nj", weights, each)
        found /= np.linalg.norm(found, axis=1, keepdims=True)
        low = np.flatnonzero(each[:, :, 2].min(1) < _LOW)
        found[low] = self._find_sun(times[low])
        return found

    def _find_sun(self, times: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return directions of the sun, (n, 3)."""
        period, stamps = self.arrays.period, times.view("datetime64[us]")
        return find_sun(period.site, stamps, refraction=period.refraction).direction

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the contacts where nothing receives."""
        self._contacts[:, nothing] = _NEVER

    def variables(self, laid: Receivers) -> Variables:
        """Return the contacts."""
        times: Any = self._contacts.view("datetime64[us]")
        return {
            "first_contact": (laid.dims, times[0]),
            "last_contact": (laid.dims, times[1]),
        }
