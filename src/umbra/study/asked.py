"""Questions about casters that a study answers in the same pass: who casts, and what is lost."""

import datetime as dt
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.face_tree import FaceTree
from umbra.scene import Scene
from umbra.study.canopy import Canopy
from umbra.study.compare import find_losses, read_hours
from umbra.study.counting import Counter
from umbra.study.ledger import Ledger
from umbra.study.model import Casting
from umbra.study.receivers import Places
from umbra.study.who import Groups, count_shares, find_groups
from umbra.volume.adjacency import Caster

__all__ = ["Answer", "Asked", "Tile"]

_WORK = 256e6  # what the pieces' instants may take while a tile is counted [byte]


class Tile(Protocol):
    """Receivers that can be counted for any caster."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the receivers."""

    @property
    def places(self) -> Places:
        """The receivers as points."""

    @property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""

    def make_counter(self) -> Counter:
        """Count all that casts, and attached shadow."""

    def find_cast(self, caster: Caster, suns: NDArray[np.float64]) -> tuple[Any, NDArray[np.uint8]]:
        """Find the shadows of one caster alone: where they can be, and the masks there."""

    def with_casters(self, parts: Sequence[int] | None = None) -> "Tile":
        """Give the same receivers with other parts casting; all but canopies by default."""

    def find_parts(self) -> NDArray[np.intp]:
        """Give each receiver's part; -1 where it has none."""


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
        Hours of sun [h].
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
        who: Sequence[str],
        by: str | None,
        proposed: Sequence[str],
        under: str | float | dt.timedelta,
        canopy: Canopy | None = None,
    ) -> "Asked":
        """Read the options, see ``umbra.shadow_study``."""
        weak = () if canopy is None else canopy.casting
        groups = find_groups(scene, casters, who, by, weak) if who or by else None
        if not proposed:
            return cls(groups, len(groups.names) if groups else 0)
        parts = tuple(sorted(set().union(*(scene.select([pattern]) for pattern in proposed))))
        new = find_groups(scene, casters, proposed, None, weak)  # refuses those that do not cast
        whole = Groups(("proposed",), new.pieces, np.atleast_2d(new.member.any(0)), new.is_weak)
        shown = len(groups.names) if groups else 0
        return cls(_join(groups, whole), shown, parts, read_hours(under))

    @property
    def bytes_kept(self) -> int:
        """What is kept of each receiver [byte]."""
        kept = 8 * len(self.groups.names) if self.groups else 0
        return kept + (16 if self.proposed else 0)

    @property
    def facts(self) -> dict[str, object]:
        """What the attributes say."""
        return {"under_hours": self.under} if self.proposed else {}

    def limit_tiles(self, side: int) -> int:
        """Give how long a tile's side may be, so that the pieces fit in memory."""
        if self.groups is None:
            return side
        return max(8, min(side, int(np.sqrt(_WORK / (len(self.groups.pieces) + 64)))))


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
        groups = asked.groups
        count = len(groups.names) if groups else 0
        self.cast = np.zeros((count, *ledger.shape), np.float32)
        self.sole = np.zeros((count, *ledger.shape), np.float32)
        self.owner = np.zeros(ledger.shape if asked.proposed else (0,), np.int32)
        self.nothing = np.zeros(ledger.shape if asked.proposed else (0,), np.bool_)
        self._casters: list[Caster] = []

    def add(self, tile: Tile, where: Any, progress: Callable[[int], object]) -> None:
        """Count a tile."""
        groups = self.asked.groups
        if groups is None:
            return
        if not self._casters:
            self._casters = self.model.make_casters(groups.pieces)
        shares = count_shares(
            [partial(tile.find_cast, caster) for caster in self._casters],
            tile.places,
            groups,
            self.ledger.period,
            tile.shape,
            self.model.threads,
            progress,
            self.ledger.shares,
        )
        inside = where if isinstance(where, tuple) else (where,)
        self.cast[:, *inside], self.sole[:, *inside] = shares.cast, shares.sole
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
            Gives the hours in shadow of the tile if only some parts cast [h].
        progress : callable
        """
        groups = self.asked.groups
        if groups is None:
            return
        up = int(self.ledger.period.sun.is_up.sum())
        everything = sorted(part for piece in groups.pieces for part in piece)
        attached = solve([])
        inside = where if isinstance(where, tuple) else (where,)
        for k, row in enumerate(groups.member):
            mine = {p for piece, is_mine in zip(groups.pieces, row) if is_mine for p in piece}
            without = solve([part for part in everything if part not in mine])
            lost = self.ledger.shadow_hours[where] - without
            self.sole[k, *inside] = np.maximum(lost, 0)
            if k < self.asked.shown:
                self.cast[k, *inside] = np.maximum(solve(sorted(mine)) - attached, 0)
            progress(up * (k + 1) // len(groups.names) - up * k // len(groups.names))
        self._keep_owner(tile, where)

    def _keep_owner(self, tile: Tile, where: Any) -> None:
        if self.asked.proposed:
            self.owner[where] = tile.find_parts()

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Take away the answers of receivers that are not there."""
        self.cast[:, nothing] = np.nan
        self.sole[:, nothing] = np.nan
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
        asked = self.asked
        found: dict[str, tuple[tuple[str, ...], NDArray]] = {}
        if asked.groups and asked.shown:
            names = np.array(asked.groups.names[: asked.shown])
            found["caster"] = (("caster",), names)
            found["cast_hours"] = (("caster", *dims), self.cast[: asked.shown])
            found["sole_hours"] = (("caster", *dims), self.sole[: asked.shown])
        if asked.proposed:
            sun = np.float32(self.ledger.up_hours) - self.ledger.shadow_hours
            losses = find_losses(
                sun,
                self.sole[-1],
                np.isin(self.owner, asked.proposed) | self.nothing,
                self.owner,
                [part.name for part in self.model.scene.parts],
                area,
                asked.under,
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
