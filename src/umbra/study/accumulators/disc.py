"""Hours weighed by the share of the sun's disc that each receiver sees, and its contacts."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights, Period
from umbra.rays.disc_contacts import SEEN, DiscTrack, find_contacts
from umbra.rays.disc_marks import find_touching, mark_cut_discs
from umbra.rays.disc_sides import NO_LAND, LandEdge, make_land_edge
from umbra.rays.sun_disc import KnownDiscs, find_free_disc
from umbra.receivers.kind import Receivers, Tile, Variables
from umbra.scene.grid import Places
from umbra.sky.land_curtain import find_bends
from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.accumulators.step_masks import HourSums
from umbra.study.light_sums import NO_PARTS, LightParts
from umbra.study.loop import TileRun
from umbra.sun import find_sun

__all__ = ["RADIUS", "DiscHours"]

RADIUS = 0.2666
"""Of the sun's disc, its mean through the year [degrees]."""
_AT_ONCE = 8
_SECOND = 1_000_000  # [us]
_CLOSE = _SECOND  # to which contacts are solved
_LOW = 0.02  # sine of the altitude above which the sun's place is smooth in time
_BITS = 12  # of a coordinate in an order by place
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
        self._land = _find_land(arrays.period)
        self._contacts = np.full((2, *arrays.shape), _NEVER)

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add up the hours, and solve the contacts."""
        places = run.tiles[0].places
        self._order = _order_by_place(places.points)
        self._places = places.pick(self._order)
        self._middles = _Middles(run.tiles[0], self._places, self._order, self._land)
        self._known, self._looked = (np.zeros(0, np.int64) for _ in range(2))
        self._first, self._last = (np.full((2, len(places)), _NEVER) for _ in range(2))
        super().add_sums(run, lights, progress)
        where = run.where if isinstance(run.where, tuple) else (run.where,)
        dark, lit = np.concatenate([self._first, self._last], axis=1)
        solved = np.zeros((2, len(places)), np.int64)
        solved[:, self._order] = self._solve(run.tiles[0], dark, lit).reshape(2, -1)
        self._contacts[:, *where] = solved.reshape(2, *run.shape)

    def _add_groups(
        self, run: TileRun, lights: Lights, group: NDArray[np.intp], shares: NDArray[np.float64],
        progress: Callable[[int], object], parts: LightParts = NO_PARTS,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:  # fmt: skip
        """Return the hours of hidden parts of the disc; canopies have none."""
        tile, places = run.tiles[0], self._places
        hours = np.zeros(len(places.points))
        monthly = np.zeros((len(parts.sums), len(hours)))
        directions = np.ascontiguousarray(lights.directions[:, :3])
        middles, before, after = self._find_times(lights.step)
        self._known = np.union1d(self._known, middles)
        self._looked = np.unique(np.concatenate([self._looked, before, middles, after]))
        begins, ends = (np.full(len(hours), -1) for _ in range(2))
        for first in range(0, len(lights), _AT_ONCE):
            batch = slice(first, first + _AT_ONCE)
            free = find_free_disc(
                tile.tree, places.points, places.normals, directions[batch], RADIUS,
                tile.casting.threads, self._land, self._middles.judge(directions[batch]),
            )  # fmt: skip
            hours += lights.weights[batch, 0] @ (1 - free)
            for k, hidden in enumerate(1 - free if len(monthly) else (), first):
                monthly[parts.part[k]] += lights.weights[k, 0] * hidden
            for k, seen in enumerate(free > SEEN, first):
                np.putmask(begins, seen & (begins < 0), k)
                np.putmask(ends, seen, k)
            progress(len(free))
        new = (begins >= 0) & (self._first[1] == _NEVER)
        self._first[:, new] = np.stack([before, middles])[:, begins[new]]
        seen = ends >= 0
        self._last[:, seen] = np.stack([after, middles])[:, ends[seen]]
        summed = np.zeros(len(places), np.float32)
        summed[self._order] = hours
        of_parts = np.zeros(monthly.shape, np.float32)
        of_parts[:, self._order] = monthly
        parts.add(of_parts.reshape(parts.sums.shape))
        return summed.reshape(run.shape), np.zeros(run.shape, np.float32)

    def _find_times(
        self, step: NDArray[np.intp]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """
        Return the middles of steps, and times before and after between which contacts lie [us].

        They are the neighbours' middles, and beyond the first and the last sun of a day those of
        the asked hours: the rim rises before the middle, and sets after it.
        """
        period = self.arrays.period
        starts, ends = period.starts, period.ends
        breaks = np.flatnonzero(starts[1:] != ends[:-1]) + 1
        firsts, lasts = np.append(0, breaks), np.append(breaks, len(starts)) - 1
        block = np.searchsorted(firsts, step, "right") - 1
        middles = (starts[step] + ends[step]) // 2
        joined = np.append(starts[step[1:]] == ends[step[:-1]], False)
        after = np.where(joined, np.append(middles[1:], 0), ends[lasts[block]])
        before = np.where(np.roll(joined, 1), np.roll(middles, 1), starts[firsts[block]])
        return middles, before, after

    def _solve(
        self, tile: Tile, dark: NDArray[np.int64], lit: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """
        Return when the disc appears and goes between two times of each receiver, (2 n,) [us].

        A part of it is seen at ``lit``; what is seen at ``dark``, too, has its contact there: the
        middles of steps are known.
        """
        times, has_sun = lit.copy(), lit != _NEVER
        for end in np.setdiff1d(self._looked, self._known):  # of a day, or of its hours
            which = np.flatnonzero((dark == end) & has_sun)
            if len(which):
                times[which[self._see(tile, which % len(self._places), end)]] = end
        changed = np.flatnonzero(has_sun & (times != dark))
        if not len(changed):
            return times
        between = np.stack([dark[changed], lit[changed]])
        at = np.searchsorted(self._looked, between)
        codes = at.min(0) * len(self._looked) + at.max(0)
        ways, which = np.unique(codes, return_inverse=True)
        of = changed % len(self._places)
        track = self._follow(self._looked[np.stack(np.divmod(ways, len(self._looked)))])
        times[changed] = find_contacts(
            tile.tree, self._places.points[of], self._places.normals[of], track, which, between,
            RADIUS, _CLOSE, tile.casting.threads, self._land,
        )  # fmt: skip
        return times

    def _see(self, tile: Tile, which: NDArray[np.intp], time: np.int64) -> NDArray[np.bool_]:
        """Return which of some receivers see a part of the disc at a time [us]."""
        sun, places = self._find_sun(np.array([time])), self._places.pick(which)
        cut, hidden = self._middles.judge(sun)
        known = KnownDiscs(cut[:, which], hidden[:, which])
        free = find_free_disc(
            tile.tree, places.points, places.normals, sun, RADIUS, tile.casting.threads,
            self._land, known,
        )  # fmt: skip
        return free[0] > SEEN

    def _follow(self, ways: NDArray[np.int64]) -> DiscTrack:
        """
        Return the sun's ways from some times to others, (2, n) [us].

        It is straight within a quarter of a minute, to 2e-7, which the sun moves in 3 ms. Near the
        horizon, where refraction begins at once, it has a direction each second.
        """
        starts, ends = ways
        low = np.minimum(*(self._find_sun(times)[:, 2] for times in ways)) < _LOW
        steps = np.where(low, _SECOND, 15 * _SECOND)
        counts = np.maximum(-(-(ends - starts) // steps), 1) + 1
        first = np.append(0, np.cumsum(counts))
        at = np.arange(first[-1]) - np.repeat(first[:-1], counts)
        times = np.repeat(starts, counts) + at * np.repeat(steps, counts)
        return DiscTrack(starts, steps, first, self._find_sun(times))

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


class _Middles:
    """
    Discs that their middles tell to be free or hidden, of the places of a tile.

    Parameters
    ----------
    tile : Tile
    places : Places
        Its receivers in an order.
    order : (n,) int
    land : LandEdge
    """

    def __init__(self, tile: Tile, places: Places, order: NDArray[np.intp], land: LandEdge) -> None:
        self._tile, self._places, self._order = tile, places, order
        self._counter = tile.make_counter()
        self._highest = max(float(land.slopes.max(initial=0.0)), 0.0)
        self._touching = find_touching(
            tile.tree, places.points, places.normals, tile.casting.threads
        )

    def judge(self, suns: NDArray[np.float64]) -> KnownDiscs:
        """Return what is known of the discs of suns (m, 3)."""
        # Twice the radius clear of the horizon, and of the land's highest.
        wide = 2 * math.tan(math.radians(RADIUS))
        level = np.hypot(suns[:, 0], suns[:, 1])
        is_clear = suns[:, 2] - wide > self._highest * (level + wide)
        cut = np.ones((len(suns), len(self._places)), np.bool_)
        hidden = np.zeros(cut.shape, np.uint8)
        if is_clear.any():
            above, tile = np.ascontiguousarray(suns[is_clear]), self._tile
            masks = self._counter.masks(above).reshape(len(above), -1)
            hidden[is_clear] = masks[:, self._order]
            cut[is_clear] = mark_cut_discs(
                tile.tree, tile.casting.edges, self._places.points, self._places.normals,
                self._touching, above, RADIUS, tile.casting.threads,
            )  # fmt: skip
        return KnownDiscs(cut, hidden)


def _find_land(period: Period) -> LandEdge:
    """Return the edge of the land behind which the sun goes."""
    if period.horizon is None or period.horizon.highest <= 0:
        return NO_LAND
    north = 0.0 if period.site is None else period.site.true_north
    return make_land_edge(*find_bends(period.horizon), north)


def _order_by_place(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return an order in which points (n, 3) that follow each other lie together (Morton 1966)."""
    low, high = points.min(0, initial=np.inf), points.max(0, initial=-np.inf)
    scale = (2**_BITS - 1) / max(float((high - low).max()), 1e-9) if len(points) else 1.0
    cells = ((points - low) * scale).astype(np.int64)
    keys = np.zeros(len(points), np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            keys |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(keys, kind="stable")
