"""Attribution of shadow to casters, and the sun lost to a proposal, in the same pass."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.casters.casting import select_replaced
from umbra.lights import Lights
from umbra.receivers.kind import Receivers, Tile, Variables
from umbra.scene import Scene
from umbra.study.accumulators.arrays import ResultArrays
from umbra.study.accumulators.before_and_after import Proposal
from umbra.study.accumulators.exact import find_time_behind_land
from umbra.study.accumulators.groups import Groups, PiecesOneByOne, ShareCount, find_members
from umbra.study.compare import SunLosses, is_newly_under, read_hours
from umbra.study.loop import Accumulator, TileRun
from umbra.study.options import StudyOptions
from umbra.volume.adjacency import Caster

__all__ = ["Attribution", "AttributionOptions", "ExactAttribution"]

_WORK = 256e6  # memory for the pieces' instants of a tile [byte]


@dataclass(frozen=True, eq=False)
class AttributionOptions:
    """
    Options of attribution.

    Parameters
    ----------
    groups : Groups, optional
        Groups to attribute hours to; the last is the whole proposal, if any.
    shown : int
        Number of requested groups.
    proposed : tuple of int, optional
        Parts of the proposed development; None if the sun lost to one is not asked for.
    under : float
        Limit of sun on a date [h].
    before : Groups, optional
        The casters before the proposal, where it replaces some: one group, of these.
    """

    groups: Groups | None = None
    shown: int = 0
    proposed: tuple[int, ...] | None = None
    under: float = 0.0
    before: Groups | None = None

    @classmethod
    def of(
        cls,
        scene: Scene,
        casters: Sequence[int],
        options: StudyOptions,
        canopy: Canopy | None = None,
    ) -> "AttributionOptions":
        """Read the options, see ``umbra.shadow_study``."""
        weak = () if canopy is None else sorted(canopy.weak)
        who, by, proposed = options.who, options.by, options.proposed
        names, member = find_members(scene, casters, who, by)
        shown = len(names)
        parts = before = None
        if proposed:
            parts = tuple(scene.select(proposed, option="proposed"))
            # Refuses parts that do not cast.
            _, new = find_members(scene, casters, proposed, None, "proposed")
            names, member = (*names, "proposed"), np.column_stack([member, new.any(1)])
            replaced = select_replaced(scene, options.cast, options.no_cast)
            rest = sorted(set(casters) - set(parts))
            before = cls.group_before(rest, replaced, len(scene.whole.parts), weak)
        groups = Groups.of(names, member, casters, weak) if names else None
        return cls(groups, shown, parts, cls.read_limit(options), before)

    @staticmethod
    def group_before(
        rest: Sequence[int], replaced: Sequence[int], count: int, weak: Sequence[int] = ()
    ) -> Groups | None:
        """Group the casters before a proposal, of ``count`` parts; None if it replaces none."""
        if not len(replaced):
            return None
        member = np.zeros((count, 1), np.bool_)
        member[list(replaced)] = True
        return Groups.of(("replaced",), member, [*rest, *replaced], weak)

    @staticmethod
    def read_limit(options: StudyOptions) -> float:
        """Return the limit of sun on a date [h]."""
        return read_hours("2h" if options.under is None else options.under)

    def bytes_kept(self, days: int) -> int:
        """Return the memory of each receiver, with results by day of some dates [byte]."""
        size = (8 + 8 * days) * len(self.groups.names) if self.groups else 0
        return size + (18 + 5 * days if self.proposed is not None else 0)

    @property
    def facts(self) -> dict[str, object]:
        """Attributes of the result."""
        return {"under_hours": self.under} if self.proposed is not None else {}

    def limit_tiles(self, side: int, days: int) -> int:
        """Return the longest tile side whose pieces and dates fit in memory."""
        if self.groups is None:
            return side
        size = len(self.groups.pieces) + 64 + 16 * (days - 1)
        return max(8, min(side, int(np.sqrt(_WORK / size))))


class Attribution(Accumulator):
    """
    Accumulator of the hours due to groups of casters, and of the sun lost to a proposal.

    What is lost is the sun before less the sun after: the hours in the shadow of the proposal
    alone, less those in the shadow of what it replaces alone.

    Parameters
    ----------
    attribution : AttributionOptions
        With groups.
    laid : Receivers
    arrays : ResultArrays
        Of the study; hold the hours of a day before ``end_day``.
    proposal : Proposal, optional
    """

    needs_masks = False
    of_any_date = frozenset({"caster", "neighbour", "neighbour_area"})

    def __init__(
        self, attribution: AttributionOptions, laid: Receivers, arrays: ResultArrays,
        proposal: Proposal | None = None,
    ) -> None:  # fmt: skip
        self.attribution, self.model, self.arrays = attribution, laid.casting, arrays
        self.proposal = proposal
        self.groups, shape = cast("Groups", attribution.groups), arrays.shape
        count, days = len(self.groups.names), len(arrays.period.days)
        n_days = days if arrays.results.by_day else 0
        self.cast = np.zeros((count, *shape), np.float32)
        self.sole = np.zeros((count, *shape), np.float32)
        self.cast_by_day = np.zeros((n_days, count, *shape), np.float32)
        self.sole_by_day = np.zeros((n_days, count, *shape), np.float32)
        of_proposal = shape if attribution.proposed is not None else (0,)
        self.owner = np.zeros(of_proposal, np.int32)
        self.absent = np.zeros(of_proposal, np.bool_)
        self.newly_days = np.zeros(of_proposal, np.int16)
        self.newly_by_day = np.zeros((n_days, *of_proposal), np.uint8)
        self._casters: dict[Groups, list[Caster]] = {}

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile: prepare each piece of casters, after and before the proposal."""
        self._run, self._lights = run, lights
        tile, before = run.tiles[0], self.attribution.before
        self._counts = [self._make_count(tile, self.groups)]
        if before is not None:
            casters = sorted(part for piece in before.pieces for part in piece)
            self._counts.append(self._make_count(tile, before, casters))

    def _make_count(
        self, tile: Tile, groups: Groups, casters: Sequence[int] | None = None
    ) -> ShareCount:
        """Prepare the pieces of some groups; of other casters, if they are given."""
        counter = tile.count_pieces(self.groups.pieces) if casters is None else None
        if casters is not None and not isinstance(self._counts[0].counter, PiecesOneByOne):
            counter = tile.with_casters(casters).count_pieces(groups.pieces)
        if counter is None:
            if groups not in self._casters:
                self._casters[groups] = self.model.make_casters(groups.pieces)
            finders = [partial(tile.find_cast, caster) for caster in self._casters[groups]]
            counter = PiecesOneByOne(finders, tile.places, tile.shape, self.model.threads)
        return ShareCount(counter, groups, tile.shape)

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Find the shadows of each piece of casters at some instants."""
        arrays = self.arrays
        hours = lights.weights[span, 0].astype(np.float32)
        hours[arrays.period.meets_land(lights.directions[span])] = 0  # no caster's shadow
        through = np.zeros(len(hours))
        if arrays.shares is not None:
            through = arrays.shares[arrays.period.day_of_step[lights.step[span]]]
        for count in self._counts:
            count.add(lights.directions[span], hours, through)

    def end_day(self, day: int) -> None:
        """Store the hours of a date."""
        shares, *before = [count.finish() for count in self._counts]
        for earlier in before:
            shares.sole[-1] -= earlier.sole[0]
        self._enter(day, shares.cast, shares.sole, self._run.where)
        for count in self._counts:
            count.clear()

    def end(self, progress: Callable[[int], object]) -> None:
        """End the tile."""
        self.skip(self._run)

    def skip(self, run: TileRun) -> None:
        """Keep the owners of receivers that no group's shadow can reach: their hours stay 0."""
        if self.attribution.proposed is not None:
            self.owner[run.where] = run.tiles[0].find_parts()
            if self.proposal is not None:
                self.absent[run.where] = self.proposal.find_absent(run.tiles[0])

    def _enter(
        self, day: int, due: NDArray[np.float32], sole: NDArray[np.float32], where: Any
    ) -> None:
        """Add a date of a tile to the sums, and judge it by its own hours."""
        inside = where if isinstance(where, tuple) else (where,)
        self.cast[:, *inside] += due
        self.sole[:, *inside] += sole
        if len(self.cast_by_day):
            self.cast_by_day[day, :, *inside] = due
            self.sole_by_day[day, :, *inside] = sole
        if self.attribution.proposed is None:
            return
        up = np.float32(self.arrays.up_hours_by_day[day])
        newly = is_newly_under(
            up - self.arrays.read_hours(day, where), sole[-1], self.attribution.under
        )
        self.newly_days[where] += newly
        if len(self.newly_by_day):
            self.newly_by_day[day, *inside] = newly

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        for hours in (self.cast, self.sole, self.cast_by_day, self.sole_by_day):
            hours[..., nothing] = np.nan
        if self.attribution.proposed is not None:
            self.absent |= nothing

    def variables(self, laid: Receivers) -> Variables:
        """Return the hours due to groups, and the sun lost to the proposal."""
        dims = laid.dims
        attribution, has_days = self.attribution, len(self.cast_by_day) > 0
        variables: Variables = {}
        if attribution.groups and attribution.shown:
            shown = slice(attribution.shown)
            variables["caster"] = (("caster",), np.array(attribution.groups.names[shown]))
            variables["cast_hours"] = (("caster", *dims), self.cast[shown])
            variables["sole_hours"] = (("caster", *dims), self.sole[shown])
            if has_days:
                axes = ("day", "caster", *dims)
                variables["cast_hours_by_day"] = (axes, self.cast_by_day[:, shown])
                variables["sole_hours_by_day"] = (axes, self.sole_by_day[:, shown])
        losses = self.find_losses(laid)
        if losses is not None:
            variables |= losses.variables(dims)
            if laid.kind.belongs_to_parts:
                variables |= losses.sum_up().variables()
        return variables

    def find_losses(self, laid: Receivers) -> SunLosses | None:
        """Return the sun that the proposal takes from its neighbours; None if it is not asked."""
        has_days = len(self.cast_by_day) > 0
        if self.attribution.proposed is None:
            return None
        return SunLosses(
            self.sole[-1],
            self.newly_days,
            self.absent,
            self.owner,
            self.model.scene.labels(),
            laid.area,
            len(self.arrays.period.days),
            self.sole_by_day[:, -1] if has_days else None,
            self.newly_by_day if has_days else None,
        )


class ExactAttribution(Attribution):
    """
    Accumulator of the hours of groups, as differences of exact studies.

    Parameters
    ----------
    attribution, laid, arrays, proposal
        As in ``Attribution``.
    solve : callable
        Returns a tile's hours in shadow of some casters by date, (n_days, ...) [h].
    """

    needs_masks = True  # no single casters are counted per light
    more_passes = 1  # in ``end``, group by group

    def __init__(
        self, attribution: AttributionOptions, laid: Receivers, arrays: ResultArrays,
        solve: Callable[[Tile, Sequence[int]], NDArray[np.float32]],
        proposal: Proposal | None = None,
    ) -> None:  # fmt: skip
        super().__init__(attribution, laid, arrays, proposal)
        self._solve = solve

    def begin(self, run: TileRun, lights: Lights) -> None:
        """Begin a tile."""
        self._run, self._lights = run, lights

    def add(self, lights: Lights, span: slice, masks: Sequence[NDArray[np.uint8]]) -> None:
        """Do nothing: ``end`` counts all, once the tile's hours are known."""

    def end_day(self, day: int) -> None:
        """Do nothing: ``end`` counts all."""

    def end(self, progress: Callable[[int], object]) -> None:
        """Count the tile with only some parts casting, group by group."""
        tile, where, groups = self._run.tiles[0], self._run.where, self.groups
        days, works = range(len(self.arrays.period.days)), len(self._lights)
        everything = sorted(part for piece in groups.pieces for part in piece)
        attached = self._solve(tile, [])
        period = self.arrays.period  # the land's hours are no caster's
        after = np.array(
            [
                self.arrays.read_hours(day, where)
                - np.float32(find_time_behind_land(period, day) / 3.6e9)
                for day in days
            ]
        )
        due = np.zeros((len(days), len(groups.names), *tile.shape), np.float32)
        sole = np.zeros_like(due)
        for k, row in enumerate(groups.member):
            parts = {p for piece, is_mine in zip(groups.pieces, row) if is_mine for p in piece}
            without = self._solve(tile, [part for part in everything if part not in parts])
            sole[:, k] = np.maximum(after - without, 0)
            if k < self.attribution.shown:
                due[:, k] = np.maximum(self._solve(tile, sorted(parts)) - attached, 0)
            progress(works * (k + 1) // len(groups.names) - works * k // len(groups.names))
        if (before := self.attribution.before) is not None:
            casters = sorted(part for piece in before.pieces for part in piece)
            sole[:, -1] = after - self._solve(tile, casters)
        for day in days:
            self._enter(day, due[day], sole[day], where)
        super().end(progress)
