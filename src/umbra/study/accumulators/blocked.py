"""The share of the open sky that each group of casters takes, as the nearest in its directions."""

from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Lights
from umbra.rays.nearest_hits import add_taken
from umbra.receivers.kind import Receivers, Tile, Variables
from umbra.sky.land_curtain import LAND, add_land
from umbra.study.accumulators.attribution import AttributionOptions
from umbra.study.accumulators.before_and_after import Proposal
from umbra.study.accumulators.groups import Groups
from umbra.study.accumulators.measure_sums import compare_measured, level_normals
from umbra.study.loop import Accumulator, TileRun
from umbra.study.measures import Asked, Measure

__all__ = ["BlockedSky"]

_AT_ONCE = 64
"""Receivers that are counted at a time: a second or so, in which an interrupt waits."""


class BlockedSky(Accumulator):
    """
    Accumulator of the shares of the open sky component that groups of casters take.

    Each direction is taken by its nearest caster, so that pieces of the casters, and what is free,
    add up to the whole. A group takes what its pieces do.

    Parameters
    ----------
    measure : Measure
        Whose quantities are the share of all casters, and that of each group.
    asked : Asked
    laid : Receivers
    attribution : AttributionOptions
        With the groups.
    casters : sequence of int
    proposal : Proposal, optional
    """

    is_streamed = False
    needs_masks = False

    def __init__(
        self,
        measure: Measure,
        asked: Asked,
        laid: Receivers,
        attribution: AttributionOptions,
        casters: Sequence[int],
        proposal: Proposal | None = None,
    ) -> None:
        self.measure, self.asked, self._casters = measure, asked, casters
        self._groups = cast("Groups", attribution.groups)
        member, names = self._groups.member[: attribution.shown], list(self._groups.names)
        self._member, self._names = member, names[: len(member)]
        self._has_land = asked.period.horizon is not None
        if self._has_land:  # a piece and a group of its own, the last
            self._member = np.pad(member, ((0, 1), (0, 1)))
            self._member[-1, -1] = True
            self._names.append(LAND)
        self._proposal = proposal
        self.lights: Lights = asked.make_lights(measure)
        times = 1 if proposal is None else 2
        self.own_lights = times * len(self.lights)
        count = 1 + len(self._names)
        self._after = np.zeros((count, *laid.shape))
        self._before = np.zeros((count, *laid.shape)) if proposal is not None else None
        ends = ("", "_before", "_lost", "_ratio") if proposal else ("",)
        names = [quantity.name + end for quantity in measure.quantities for end in ends]
        self.of_any_date = frozenset(["caster", *names])

    def add_sums(self, run: TileRun, lights: Lights, progress: Callable[[int], object]) -> None:
        """Find the shares on a tile, with and without the proposal."""
        where = run.where if isinstance(run.where, tuple) else (run.where,)
        tile = run.tiles[0]
        self._after[:, *where] = self._find_shares(tile, self._casters, progress)
        if self._before is None or self._proposal is None:
            return
        before = self._find_shares(tile, self._proposal.find_before(tile), progress)
        before[:, self._proposal.find_absent(tile)] = np.nan
        self._before[:, *where] = before

    def _find_shares(
        self, tile: Tile, parts: Sequence[int], progress: Callable[[int], object]
    ) -> NDArray[np.float64]:
        """Return the shares of all casters and of each group (1 + groups, ...) [%]."""
        casting = set(parts)
        pieces = [[part for part in piece if part in casting] for piece in self._groups.pieces]
        if replaced := sorted(casting.difference(*pieces)):  # by a proposal
            pieces.append(replaced)
        points, normals = tile.places.points, tile.places.normals
        facing = level_normals(normals)
        solve = self._make_exact if self.asked.options.exact else self._make_counter
        find = solve(tile, parts, pieces)
        taken = np.zeros((len(points), len(pieces) + self._has_land))
        done, works = 0, len(self.lights)
        for first in range(0, len(points), _AT_ONCE):
            batch = slice(first, first + _AT_ONCE)
            taken[batch] = find(points[batch], normals[batch], facing[batch])
            now = works * min(first + _AT_ONCE, len(points)) // len(points)
            progress(now - done)
            done = now
        of_groups = np.delete(taken, len(self._groups.pieces), 1) if replaced else taken
        shares = np.stack([taken.sum(1), *(of_groups[:, is_in].sum(1) for is_in in self._member)])
        return 100 * shares.reshape(-1, *tile.shape)

    def _make_exact(self, tile: Tile, parts: Sequence[int], pieces: Sequence[Sequence[int]]) -> Any:
        """Return a function of places that solves their shares (n, pieces) exactly."""
        from umbra.sky.casters import find_sky_casters  # noqa: PLC0415 - kernels
        from umbra.sky.view_factors import measure_sky  # noqa: PLC0415

        period, threads = self.asked.period, tile.casting.threads
        north = 0.0 if period.site is None else period.site.true_north
        scene, around = add_land(tile.casting.scene.whole, period.horizon, north)
        owner = np.zeros(len(scene.groups()), np.int32)
        for k, piece in enumerate((*pieces, around)):
            owner[list(piece)] = k
        casters, _ = find_sky_casters(scene, [*parts, *around], owner)
        count = len(pieces) + self._has_land

        def solve(points: NDArray, _: NDArray, facing: NDArray) -> NDArray[np.float64]:
            shares = measure_sky(casters, points, facing, threads, objects=count).blocked_by
            assert shares is not None
            return shares

        return solve

    def _make_counter(
        self, tile: Tile, parts: Sequence[int], pieces: Sequence[Sequence[int]]
    ) -> Any:
        """Return a function of places that adds their shares (n, pieces) up over directions."""
        casting = tile.casting
        if list(parts) != list(self._casters):
            casting = tile.with_casters(parts).casting
        tree = casting.tree
        owner = casting.find_pieces(pieces)[tree.source].astype(np.int32)
        toward = np.ascontiguousarray(self.lights.directions[:, :3])
        weights = self.lights.weights[:, 0]
        is_land = self.asked.period.meets_land(toward)

        def add(
            which: NDArray[np.bool_], points: NDArray, normals: NDArray, facing: NDArray
        ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            """Return what pieces take of some directions (n, pieces), and what there is (n,)."""
            taken = np.zeros((len(points), len(pieces)))
            chosen, weight = np.ascontiguousarray(toward[which]), weights[which]
            add_taken(tree, owner, points, normals, facing, chosen, weight, taken, casting.threads)
            return taken, np.maximum(facing @ chosen.T, 0.0) @ weight

        def count(points: NDArray, normals: NDArray, facing: NDArray) -> NDArray[np.float64]:
            taken, whole = add(~is_land, points, normals, facing)
            if self._has_land:  # it takes what nothing nearer does
                near, land = add(is_land, points, normals, facing)
                rest = np.maximum(land - near.sum(1), 0.0)
                taken, whole = np.column_stack([taken + near, rest]), whole + land
            return taken / np.where(whole > 0, whole, np.inf)[:, None]

        return count

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        for values in (self._after, self._before):
            if values is not None:
                values[:, nothing] = np.nan

    def variables(self, laid: Receivers) -> Variables:
        """Return the shares of all casters and of each group, with a proposal also before."""
        variables: Variables = {"caster": (("caster",), np.array(self._names))}
        whole, by_caster = self.measure.quantities
        for quantity, rows, dims in (
            (whole, 0, laid.dims), (by_caster, slice(1, None), ("caster", *laid.dims)),
        ):  # fmt: skip
            variables[quantity.name] = (dims, self._after[rows])
            if self._before is not None:
                variables |= compare_measured(quantity, self._before[rows], self._after[rows], dims)
        return variables
