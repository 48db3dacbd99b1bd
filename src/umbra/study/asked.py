"""Questions about casters that a study answers in the same pass: who casts, and what is lost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters.canopy import Canopy
from umbra.casters.casting import Casting
from umbra.receivers.kind import Tile
from umbra.scene import Scene
from umbra.study.compare import read_hours
from umbra.study.ledger import Ledger
from umbra.study.losses import Losses, is_newly_under
from umbra.study.options import StudyOptions
from umbra.study.who import Groups, count_shares, find_groups
from umbra.volume.adjacency import Caster

__all__ = ["Answer", "Asked"]

_WORK = 256e6  # what the pieces' instants may take while a tile is counted [byte]


@dataclass(frozen=True, eq=False)
class Asked:
    """
    What is asked of the casters.

    Parameters
    ----------
    groups : Groups, optional
        Those whose hours are asked, and last, if there is a proposal, all of it.
    shown : int
        How many of the groups were asked for themselves.
    proposed : tuple of int
        Parts that are not there yet.
    under : float
        Hours of sun on a date [h].
    """

    groups: Groups | None = None
    shown: int = 0
    proposed: tuple[int, ...] = ()
    under: float = 0.0

    @classmethod
    def of(
        cls,
        scene: Scene,
        casters: Sequence[int],
        options: StudyOptions,
        canopy: Canopy | None = None,
    ) -> "Asked":
        """Read the options, see ``umbra.shadow_study``."""
        weak = () if canopy is None else canopy.casting
        who, by, proposed = options.who, options.by, options.proposed
        groups = find_groups(scene, casters, who, by, weak) if who or by else None
        if not proposed:
            return cls(groups, len(groups.names) if groups else 0)
        parts = tuple(sorted(set().union(*(scene.select([pattern]) for pattern in proposed))))
        new = find_groups(scene, casters, proposed, None, weak)  # refuses those that do not cast
        whole = Groups(("proposed",), new.pieces, np.atleast_2d(new.member.any(0)), new.is_weak)
        shown = len(groups.names) if groups else 0
        under = read_hours("2h" if options.under is None else options.under)
        return cls(_join(groups, whole), shown, parts, under)

    def bytes_kept(self, days: int) -> int:
        """Give what is kept of each receiver, and of each of so many dates besides [byte]."""
        kept = (8 + 8 * days) * len(self.groups.names) if self.groups else 0
        return kept + (18 + 5 * days if self.proposed else 0)

    @property
    def facts(self) -> dict[str, object]:
        """What the attributes say."""
        return {"under_hours": self.under} if self.proposed else {}

    def limit_tiles(self, side: int, days: int) -> int:
        """Give how long a tile's side may be, so that the pieces and dates fit in memory."""
        if self.groups is None:
            return side
        each = len(self.groups.pieces) + 64 + 16 * (days - 1)
        return max(8, min(side, int(np.sqrt(_WORK / each))))


class Answer:
    """
    Hours due to groups of casters, filled in tile by tile.

    Parameters
    ----------
    asked : Asked
    model : Casting
    ledger : Ledger
        Of the study: its receivers' shape, its period, and its hours when all is done.
    """

    def __init__(self, asked: Asked, model: Casting, ledger: Ledger) -> None:
        self.asked, self.model, self.ledger = asked, model, ledger
        groups, shape = asked.groups, ledger.shape
        count, days = len(groups.names) if groups else 0, len(ledger.period.days)
        kept = days if ledger.wanted.by_day else 0
        self.cast = np.zeros((count, *shape), np.float32)
        self.sole = np.zeros((count, *shape), np.float32)
        self.cast_by_day = np.zeros((kept, count, *shape), np.float32)
        self.sole_by_day = np.zeros((kept, count, *shape), np.float32)
        of_proposal = shape if asked.proposed else (0,)
        self.owner = np.zeros(of_proposal, np.int32)
        self.nothing = np.zeros(of_proposal, np.bool_)
        self.newly_days = np.zeros(of_proposal, np.int16)
        self.newly_by_day = np.zeros((kept, *of_proposal), np.uint8)
        self._casters: list[Caster] = []

    def add(self, tile: Tile, where: Any, progress: Callable[[int], object]) -> None:
        """Count a tile, one date after another."""
        groups = self.asked.groups
        if groups is None:
            return
        if not self._casters:
            self._casters = self.model.make_casters(groups.pieces)
        period = self.ledger.period
        up = np.flatnonzero(period.sun.is_up)
        for day in range(len(period.days)):
            shares = count_shares(
                [partial(tile.find_cast, caster) for caster in self._casters],
                tile.places,
                groups,
                period,
                tile.shape,
                self.model.threads,
                progress,
                self.ledger.shares,
                up[period.day_of_step[up] == day],
            )
            self._enter(day, shares.cast, shares.sole, where)
        self._keep_owner(tile, where)

    def add_exactly(
        self,
        tile: Tile,
        where: Any,
        solve: Callable[[Sequence[int]], NDArray[np.float32]],
        progress: Callable[[int], object],
    ) -> None:
        """
        Solve a tile: whatever a group casts is the difference of two exact studies.

        Parameters
        ----------
        tile : Tile
        where : index
            Where the tile's receivers lie among all.
        solve : callable
            Gives the tile's hours in shadow by date if only some parts cast, (n_days, ...) [h].
        progress : callable
        """
        groups = self.asked.groups
        if groups is None:
            return
        days = range(len(self.ledger.period.days))
        up = int(self.ledger.period.sun.is_up.sum())
        everything = sorted(part for piece in groups.pieces for part in piece)
        attached = solve([])
        after = np.array([self.ledger.read_hours(day, where) for day in days])
        cast = np.zeros((len(days), len(groups.names), *tile.shape), np.float32)
        sole = np.zeros_like(cast)
        for k, row in enumerate(groups.member):
            mine = {p for piece, is_mine in zip(groups.pieces, row) if is_mine for p in piece}
            without = solve([part for part in everything if part not in mine])
            sole[:, k] = np.maximum(after - without, 0)
            if k < self.asked.shown:
                cast[:, k] = np.maximum(solve(sorted(mine)) - attached, 0)
            progress(up * (k + 1) // len(groups.names) - up * k // len(groups.names))
        for day in days:
            self._enter(day, cast[day], sole[day], where)
        self._keep_owner(tile, where)

    def _enter(
        self, day: int, cast: NDArray[np.float32], sole: NDArray[np.float32], where: Any
    ) -> None:
        """Add a date of a tile to the whole, and judge it by its own hours."""
        inside = where if isinstance(where, tuple) else (where,)
        self.cast[:, *inside] += cast
        self.sole[:, *inside] += sole
        if len(self.cast_by_day):
            self.cast_by_day[day, :, *inside] = cast
            self.sole_by_day[day, :, *inside] = sole
        if not self.asked.proposed:
            return
        up = np.float32(self.ledger.up_hours_by_day[day])
        newly = is_newly_under(up - self.ledger.read_hours(day, where), sole[-1], self.asked.under)
        self.newly_days[where] += newly
        if len(self.newly_by_day):
            self.newly_by_day[day, *inside] = newly

    def _keep_owner(self, tile: Tile, where: Any) -> None:
        if self.asked.proposed:
            self.owner[where] = tile.find_parts()

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Take away the answers of receivers that are not there."""
        for hours in (self.cast, self.sole, self.cast_by_day, self.sole_by_day):
            hours[..., nothing] = np.nan
        if self.asked.proposed:
            self.nothing |= nothing

    def variables(
        self, dims: tuple[str, ...], area: NDArray[np.float64] | float
    ) -> dict[str, tuple[tuple[str, ...], NDArray]]:
        """
        Give the answers when all tiles are counted.

        Parameters
        ----------
        dims : tuple of str
            The receivers' dimensions.
        area : (...) float64 or float
            Of each receiver [m2].
        """
        asked, has_days = self.asked, len(self.cast_by_day) > 0
        found: dict[str, tuple[tuple[str, ...], NDArray]] = {}
        if asked.groups and asked.shown:
            some = slice(asked.shown)
            found["caster"] = (("caster",), np.array(asked.groups.names[some]))
            found["cast_hours"] = (("caster", *dims), self.cast[some])
            found["sole_hours"] = (("caster", *dims), self.sole[some])
            if has_days:
                axes = ("day", "caster", *dims)
                found["cast_hours_by_day"] = (axes, self.cast_by_day[:, some])
                found["sole_hours_by_day"] = (axes, self.sole_by_day[:, some])
        if asked.proposed:
            losses = Losses(
                self.sole[-1],
                self.newly_days,
                np.isin(self.owner, asked.proposed) | self.nothing,
                self.owner,
                self.model.scene.labels(),
                area,
                len(self.ledger.period.days),
                self.sole_by_day[:, -1] if has_days else None,
                self.newly_by_day if has_days else None,
            )
            found |= losses.variables(dims)
        return found


def _join(some: Groups | None, more: Groups) -> Groups:
    """Give the groups of both, made of pieces that are whole in both."""
    if some is None:
        return more
    first = {part: k for k, piece in enumerate(some.pieces) for part in piece}
    second = {part: k for k, piece in enumerate(more.pieces) for part in piece}
    pieces: dict[tuple[int, int], list[int]] = {}
    for part, piece in first.items():
        pieces.setdefault((piece, second[part]), []).append(part)
    keys = np.array(list(pieces))
    member = np.concatenate([some.member[:, keys[:, 0]], more.member[:, keys[:, 1]]])
    listed = tuple(tuple(parts) for parts in pieces.values())
    is_weak = some.is_weak[keys[:, 0]]
    return Groups(some.names + more.names, listed, np.ascontiguousarray(member), is_weak)
