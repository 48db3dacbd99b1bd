"""
Attribution of shadow: hours due to chosen casters.

Casters are cut into *pieces* such that each group consists of whole pieces. Each piece is counted
as if it stood alone, which gives two numbers per group and receiver: the hours in its shadow,
whatever else casts there, and its *sole* hours, which would be sun without it. Neither counts while
the surface faces away from the sun. Canopies count by the share of light that they absorb.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.shares import Membership, add_group_shares, make_share_work
from umbra.errors import InputError
from umbra.kernels import kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.receivers.kind import PieceShares
from umbra.scene import Scene
from umbra.scene.grid import Places

__all__ = [
    "BY", "Groups", "PiecesOneByOne", "ShareCount", "Shares", "check_count", "find_members",
]  # fmt: skip

Finder = Callable[[NDArray[np.float64]], tuple[Any, NDArray[np.uint8]]]
"""Takes suns (n, 3); returns an index of receivers, and their masks (n, ...)."""

BY = ("part", "kind", "layer")
_MOST_GROUPS = 4096
_BLOCK = 4096  # receivers per block of a thread


@dataclass(frozen=True, eq=False)
class Groups:
    """
    Groups of casters, which may overlap, and their pieces.

    Parameters
    ----------
    names : tuple of str
        Of the groups.
    pieces : tuple of tuple of int
        Parts of each piece; every casting part is in one.
    member : (n_groups, n_pieces) bool
        Pieces of each group.
    is_weak : (n_pieces,) bool
        Pieces that are canopies.
    """

    names: tuple[str, ...]
    pieces: tuple[tuple[int, ...], ...]
    member: NDArray[np.bool_]
    is_weak: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        member: NDArray[np.bool_],
        casters: Sequence[int],
        weak: Sequence[int] = (),
    ) -> "Groups":
        """
        Cut casters into pieces.

        Parameters
        ----------
        names : sequence of str
            Of the groups.
        member : (n_parts, n_groups) bool
        casters : sequence of int
            Indices of the parts that cast.
        weak : sequence of int
            Indices of the canopies among them.
        """
        listed = np.array(sorted(casters), np.intp)
        rows = np.column_stack([member[listed], np.isin(listed, weak)])  # pieces are not mixed
        kinds, piece = np.unique(rows, axis=0, return_inverse=True)
        pieces = tuple(tuple(listed[piece.ravel() == k].tolist()) for k in range(len(kinds)))
        return cls(tuple(names), pieces, np.ascontiguousarray(kinds.T[:-1]), kinds[:, -1])


@dataclass(frozen=True, eq=False)
class Shares:
    """
    Hours due to each group.

    Parameters
    ----------
    cast : (n_groups, ...) float32
        In its shadow [h].
    sole : (n_groups, ...) float32
        In its shadow alone, and facing the sun [h].
    """

    cast: NDArray[np.float32]
    sole: NDArray[np.float32]


def find_members(
    scene: Scene,
    casters: Sequence[int],
    who: Sequence[str] = (),
    by: str | None = None,
    option: str = "who",
) -> tuple[tuple[str, ...], NDArray[np.bool_]]:
    """
    Group casting parts by patterns, name, kind or layer.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int
        Indices of the parts that cast.
    who : sequence of str
        Shell patterns of names, kinds, layers or tags; without ``by`` one group each.
    by : {'part', 'kind', 'layer'}, optional
        One group per name, kind or layer, of all casters or those that match ``who``.
    option : str
        Option that ``who`` comes from, for errors.

    Returns
    -------
    names : tuple of str
        Of the groups.
    member : (n_parts, n_groups) bool

    Raises
    ------
    InputError
        If a pattern matches no casting part, or there are too many groups.
    """
    if by is not None and by not in BY:
        msg = f"hours cannot be told by '{by}'; choose part, kind or layer"
        raise InputError(msg, by=by)
    casting = set(casters)
    chosen: dict[str, list[int]] = {}
    for pattern in who:
        chosen[pattern] = sorted(casting.intersection(scene.select([pattern], option=option)))
        if not chosen[pattern]:
            msg = (
                f"{option}='{pattern}' matches only parts that do not cast; "
                "remove a no_cast= pattern"
            )
            raise InputError(msg, option=option, pattern=pattern)
    if by is not None:
        members = sorted(set().union(*chosen.values())) if who else sorted(casting)
        chosen = {}
        words = scene.labels() if by == "part" else [getattr(part, by) for part in scene.parts]
        for part in members:
            chosen.setdefault(words[part] or f"no {by}", []).append(part)
    check_count(len(chosen), by)
    member = np.zeros((len(scene.parts), len(chosen)), np.bool_)
    for group, parts in enumerate(chosen.values()):
        member[parts, group] = True
    return tuple(chosen), member


def check_count(count: int, by: str | None) -> None:
    """Refuse more groups than are counted."""
    if count > _MOST_GROUPS:
        msg = f"there are {count} {by}s that cast; choose at most {_MOST_GROUPS} of them with who="
        raise InputError(msg, option="who", count=count)


class PiecesOneByOne:
    """
    Counter of pieces, each found by itself.

    Parameters
    ----------
    finders : sequence of Finder
        Finder of each piece's shadows on these receivers.
    places : Places
        The receivers, flat.
    shape : tuple of int
        Of the receivers.
    threads : int
    """

    def __init__(
        self, finders: Sequence[Finder], places: Places, shape: tuple[int, ...], threads: int = 1
    ) -> None:
        self._finders, self._places, self._threads = finders, places, threads
        self._bits = np.zeros((len(finders), *shape), np.uint8)

    def add_shares(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.float64],
        membership: Membership,
        cast: NDArray[np.float32],
        sole: NDArray[np.float32],
    ) -> None:
        """Add at most eight suns, see ``umbra.cpu.shares.add_group_shares``."""
        self._bits[:] = 0
        for find, bits in zip(self._finders, self._bits, strict=True):
            window, masks = find(suns)
            packed = np.zeros(masks.shape[1:], np.uint8)
            for k, mask in enumerate(masks):
                packed |= mask << np.uint8(k)
            bits[window] = packed
        use_threads(self._threads)
        flat = self._bits.reshape(len(self._bits), -1)
        given = flat, self._places.normals, suns, weights, membership, cast, sole
        run_shared(-(-flat.shape[1] // _BLOCK), _share, *given)


class ShareCount:
    """
    Sums of the hours due to each group on some receivers.

    Parameters
    ----------
    counter : PieceShares
        Of the groups' pieces on these receivers.
    groups : Groups
    shape : tuple of int
        Of the receivers.
    """

    def __init__(self, counter: PieceShares, groups: Groups, shape: tuple[int, ...]) -> None:
        self.counter, self.shape = counter, shape
        self._membership = Membership.of(groups.member, groups.is_weak)
        cells = int(np.prod(shape, dtype=np.int64))
        self._cast = np.zeros((len(groups.names), cells), np.float32)
        self._sole = np.zeros_like(self._cast)

    def clear(self) -> None:
        """Begin again."""
        self._cast[:] = self._sole[:] = 0

    def add(
        self,
        suns: NDArray[np.float64],
        hours: NDArray[np.float32],
        through: NDArray[np.float64],
    ) -> None:
        """
        Add at most eight instants.

        Parameters
        ----------
        suns : (n, 3) float64
        hours : (n,) float32
            Duration of each [h].
        through : (n,) float64
            Share of light that canopies transmit.
        """
        weights = np.stack([hours.astype(np.float64), through])
        self.counter.add_shares(suns, weights, self._membership, self._cast, self._sole)

    def finish(self) -> Shares:
        """Return the hours since the last ``clear``."""
        shape = (-1, *self.shape)
        return Shares(self._cast.reshape(shape), self._sole.reshape(shape))


@kernel
def _share(bits, normals, suns, weights, membership, cast, sole, taken):
    """Add at most eight instants, one bit each, to the hours of every group."""
    cells = bits.shape[1]
    pieces, where = np.arange(bits.shape[0]).astype(np.int32), np.arange(cells)
    while True:
        block = take_next(taken)
        if block >= (cells + _BLOCK - 1) // _BLOCK:
            return
        low, high = block * _BLOCK, min(cells, (block + 1) * _BLOCK)
        work = make_share_work(membership)
        add_group_shares(
            bits, pieces, low, high, where, normals, suns, weights, membership, work, cast, sole
        )
