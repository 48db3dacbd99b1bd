"""Sums of a measure's lights at each receiver, before and after a proposal."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.lights import Lights
from umbra.receivers.kind import Counter, Receivers, Tile, Variables
from umbra.scene.grid import Places
from umbra.sky.land_curtain import add_land
from umbra.study.accumulators.before_and_after import Proposal
from umbra.study.counters import GroundLightCounter, LightCounter, find_ground_lights
from umbra.study.light_sums import round_weights
from umbra.study.loop import Accumulator, TileRun
from umbra.study.measures import Asked, Measure, Quantity, guard

__all__ = ["MeasureSums", "compare_measured", "level_normals"]

_MOST_BLOCKS = 16
_AT_ONCE = 256
"""Places that are solved at a time: a second or so, in which an interrupt waits."""


class MeasureSums(Accumulator):
    """
    Accumulator of a measure: the weights of its lights that reach each receiver.

    What reaches a receiver is the sum of all lights less that of the hidden ones, those behind its
    surface among them. Times the cosine at its normal n it is n . (sum of w d over the free
    directions d): three columns, or one on level ground, serve every normal.

    Parameters
    ----------
    measure : Measure
    asked : Asked
    laid : Receivers
    canopy : Canopy, optional
    proposal : Proposal, optional
        Where the measure is also asked before it.
    """

    is_streamed = False
    needs_masks = False

    def __init__(
        self,
        measure: Measure,
        asked: Asked,
        laid: Receivers,
        canopy: Canopy | None = None,
        proposal: Proposal | None = None,
        casters: Sequence[int] = (),
    ) -> None:
        self.measure, self.asked, self._casters = measure, asked, casters
        self._is_level, self._canopy = laid.kind.is_level, canopy
        self.lights = self._find_lights()
        self.own_lights = len(self.lights)
        self._proposal = proposal
        self.of_any_date = frozenset(self._name_all())
        count = len(measure.quantities)
        self._after = np.zeros((count, *laid.shape))
        self._before = np.zeros((count, *laid.shape)) if proposal is not None else None
        weights = self._spread()
        self._weights, self._unit = round_weights(weights)
        self._blocks = self._find_blocks()
        if canopy is not None:
            # What canopies alone hide, they transmit by their share on the light's day.
            self._kept, self._kept_unit = round_weights(weights * self._find_shares()[:, None])

    def _find_lights(self) -> Lights:
        """Return its lights but those behind land, or behind level ground where all are level."""
        lights: Lights = guard(self.measure, self.asked.make_lights, self.measure)
        is_free = ~self.asked.period.meets_land(lights.vectors)
        if self._is_level and self.measure.follows_normal:
            is_free &= ~find_ground_lights(lights.vectors)
        if is_free.all():
            return lights
        free = lights.pick(is_free)
        return replace(free, starts=lights.starts[is_free], ends=lights.ends[is_free])

    def _find_blocks(self) -> list[tuple[NDArray[np.bool_], NDArray[np.intp]]]:
        """
        Return lights that weigh in the same columns, and these: not all columns are of all lights.

        Lights of many kinds are one block of all columns.
        """
        given, wide = self.lights.weights, self._weights.shape[1]
        kinds, kind = np.unique(given != 0, axis=0, return_inverse=True)
        if len(kinds) > _MOST_BLOCKS:
            return [(np.ones(len(given), np.bool_), np.arange(wide))]
        axes = np.arange(wide).reshape(given.shape[1], -1)
        columns = enumerate(kinds)
        return [(kind.ravel() == k, axes[has].ravel()) for k, has in columns if has.any()]

    def _spread(self) -> NDArray[np.float64]:
        """Return the columns that are added up: with cosines, a column for each axis."""
        weights = self.lights.weights
        if not self.measure.follows_normal:
            return weights
        toward = self.lights.directions[:, :3]
        axes = toward[:, 2:] if self._is_level else toward
        return (weights[:, :, None] * axes[:, None, :]).reshape(len(weights), -1)

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Add up the measure's lights on a tile, with and without the proposal."""
        where = run.where if isinstance(run.where, tuple) else (run.where,)
        tile = run.tiles[0]
        if self.asked.options.exact and self.measure.has_exact:
            self._solve(tile, where, progress)
            return
        sums = [_Sums(self, tile.shape)]
        if self._proposal is not None:
            sums.append(_Sums(self, tile.shape))
        for indices, wide, counter in run.find_tiles(self.lights):
            sums[0].add(
                indices, wide, counter, wide.with_casters if self._canopy else None, progress
            )
            if self._proposal is not None:
                before, canopy = self._proposal.find_before(wide), wide.casting.canopy
                solid = sorted({*before} - canopy.weak) if canopy else []
                sums[1].add(
                    indices, wide.with_casters(before), None, partial(wide.with_casters, solid)
                )  # fmt: skip
        self._after[:, *where] = self._derive(sums[0].free, tile)
        if self._before is not None and self._proposal is not None:
            values = self._derive(sums[1].free, tile)
            values[:, self._proposal.find_absent(tile)] = np.nan
            self._before[:, *where] = values

    def _solve(self, tile: Tile, where: tuple[Any, ...], progress: Callable[[int], object]) -> None:
        """Find the exact values of a tile, with and without the proposal, some at a time."""
        period, threads = self.asked.period, tile.casting.threads
        north = 0.0 if period.site is None else period.site.true_north
        scene, around = add_land(tile.casting.scene.whole, period.horizon, north)
        points, normals = tile.places.points, level_normals(tile.places.normals)
        rest = self._proposal.find_before(tile) if self._proposal is not None else ()
        pairs = [(self._after, [*self._casters, *around]), (self._before, [*rest, *around])]
        wanted = [(values, parts) for values, parts in pairs if values is not None]
        done, total, reported = 0, len(wanted) * len(points), 0
        for values, parts in wanted:
            solved = np.zeros((len(values), len(points)))
            for first in range(0, len(points), _AT_ONCE):
                batch = slice(first, first + _AT_ONCE)
                places = Places(points[batch], normals[batch])
                solve = self.measure.solve
                solved[:, batch] = guard(self.measure, solve, scene, parts, places, threads)
                done += len(places)
                now = len(self.lights) * done // total
                progress(now - reported)
                reported = now
            values[:, *where] = solved.reshape(-1, *tile.shape)
        if self._before is not None and self._proposal is not None:
            self._before[:, *where][:, self._proposal.find_absent(tile)] = np.nan

    def _derive(self, free: NDArray[np.float64], tile: Tile) -> NDArray[np.float64]:
        """Return the variables of a tile (quantities, ...) from what reaches its receivers."""
        if self.measure.follows_normal:
            free = self._face(free, tile)
        return guard(self.measure, self._read, np.maximum(free, 0.0), tile.shape)

    def _read(self, free: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
        """Return what the measure makes of its sums, one array of a tile for each quantity."""
        derived = self.measure.derive(free, self.asked)
        values = np.stack([np.asarray(array, np.float64) for array in derived])
        wanted = (len(self.measure.quantities), *shape)
        if values.shape != wanted:
            msg = f"derive returned an array of shape {values.shape}, not {wanted}"
            raise ValueError(msg)
        return values

    def _find_shares(self) -> NDArray[np.float64]:
        """Return the share of each light that canopies transmit; with leaves if it has no date."""
        assert self._canopy is not None
        season, starts = self._canopy.season, self.lights.starts
        days = starts.view("datetime64[us]").astype("datetime64[D]")
        unique, index = np.unique(days, return_inverse=True)
        shares = np.array([season.find_share(day) for day in unique.tolist()])[index.ravel()]
        return np.where(self.lights.ends > starts, shares, season.with_leaves)

    def _face(self, free: NDArray[np.float64], tile: Tile) -> NDArray[np.float64]:
        """Return the sums times the cosine at each receiver's normal, from those of each axis."""
        if self._is_level:
            return free
        normals = level_normals(tile.places.normals)
        axes = free.reshape(-1, 3, *tile.shape)
        return np.einsum("kc...,c...->k...", axes, normals.T.reshape(3, *tile.shape))

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        for values in (self._after, self._before):
            if values is not None:
                values[:, nothing] = np.nan

    def _name_all(self) -> list[str]:
        names = [quantity.name for quantity in self.measure.quantities]
        ends = ("", "_before", "_lost", "_ratio") if self._proposal else ("",)
        return [name + end for name in names for end in ends]

    def variables(self, laid: Receivers) -> Variables:
        """Return the variables, with a proposal also before, lost, and their ratio."""
        variables: Variables = {}
        for k, quantity in enumerate(self.measure.quantities):
            after = self._after[k]
            variables[quantity.name] = (laid.dims, after)
            if self._before is not None:
                variables |= compare_measured(quantity, self._before[k], after, laid.dims)
        return variables


def level_normals(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit normals (n, 3), upward where there are none; slopes of plans have any length."""
    missing = np.isnan(normals[:, 0])
    known = np.where(missing[:, None], (0.0, 0.0, 1.0), normals) if missing.any() else normals
    return known / np.linalg.norm(known, axis=1, keepdims=True)


class _Sums:
    """Whole numbers that add up on a tile, the same in any order and groups of the lights."""

    def __init__(self, of: MeasureSums, shape: tuple[int, ...]) -> None:
        self.of = of
        columns = of._weights.shape[1]
        self.hidden = np.zeros((columns, *shape), np.int32)
        self.shade = np.zeros((2, columns, *shape), np.int32) if of._canopy is not None else None

    def add(
        self, indices: NDArray[np.intp], tile: Tile, counter: Any,
        find_solid: Callable[[], Tile] | None,
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:  # fmt: skip
        """Add some lights, with all casters that can hide them, and with all but canopies."""
        lights = self.of.lights
        is_below = find_ground_lights(lights.vectors[indices])
        below, indices = indices[is_below], indices[~is_below]
        if len(indices):
            many = tile.count_many(len(lights))
            every = LightCounter(tile, counter if many is None else many)
            solid = None if find_solid is None else LightCounter(find_solid())
            self._add(indices, every, solid, progress)
        if len(below):
            hollow = None if find_solid is None else GroundLightCounter(find_solid())
            self._add(below, GroundLightCounter(tile), hollow, progress)

    def _add(
        self, indices: NDArray[np.intp], every: Counter, solid: Counter | None,
        progress: Callable[[int], object],
    ) -> None:  # fmt: skip
        of = self.of
        for is_one, columns in of._blocks:
            rows = indices[is_one[indices]]
            if not len(rows):
                continue
            lights, which = of.lights.pick(rows).directions, np.ix_(rows, columns)
            block = self.hidden[columns]
            every.add_weights(lights, of._weights[which], block, progress)
            self.hidden[columns] = block
            if self.shade is not None and solid is not None:
                for k, counter in enumerate((every, solid)):
                    counter.add_weights(lights, of._kept[which], block := self.shade[k, columns])
                    self.shade[k, columns] = block

    @property
    def free(self) -> NDArray[np.float64]:
        """Sums of the lights that reach each receiver, (columns, ...)."""
        of, ones = self.of, [1] * (self.hidden.ndim - 1)
        whole = of._weights.sum(0, np.int64).reshape(-1, *ones)
        free = (whole - self.hidden) * of._unit.reshape(-1, *ones)
        if self.shade is not None:
            through = self.shade[0].astype(np.int64) - self.shade[1]
            free += through * of._kept_unit.reshape(-1, *ones)
        return free


def compare_measured(
    quantity: Quantity, before: NDArray, after: NDArray, dims: tuple[str, ...]
) -> Variables:
    """Return a quantity before a proposal, what it takes, and the ratio."""
    ratio = np.divide(after, before, out=np.full_like(after, np.nan), where=before > 0)
    return {
        f"{quantity.name}_before": (dims, before),
        f"{quantity.name}_lost": (dims, before - after),
        f"{quantity.name}_ratio": (dims, ratio),
    }
