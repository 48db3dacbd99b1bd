"""
Who casts the shadow: the hours that are due to chosen parts.

Casters are cut into *pieces*, such that each group is made of whole pieces; every piece
is counted by itself, and what each instant's pieces do at a receiver tells two numbers
for each group: the hours in its shadow, whatever else casts there too, and its *sole*
hours, which would be sun if it were gone. Neither counts while the surface is turned
from the sun, which is no one's doing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from umbra.cpu.threads import use_threads
from umbra.errors import InputError
from umbra.scene import Scene
from umbra.study.period import Period
from umbra.study.receivers import Places

__all__ = ["BY", "Groups", "Shares", "count_shares", "find_groups"]

Finder = Callable[[NDArray[np.float64]], tuple[Any, NDArray[np.uint8]]]
"""Takes suns (n, 3); gives where among the receivers, and the masks (n, ...) there."""

BY = ("part", "kind", "layer")
_ATTRIBUTES = {"part": "name", "kind": "kind", "layer": "layer"}
_MOST_GROUPS = 4096
_BLOCK = 256


@dataclass(frozen=True, eq=False)
class Groups:
    """
    Chosen casters, which may overlap, and the pieces that they are made of.

    Parameters
    ----------
    names : tuple of str
        Of the groups.
    pieces : tuple of tuple of int
        Parts of each piece; all casting parts are in one.
    member : (n_groups, n_pieces) bool
        Which pieces make up each group.
    """

    names: tuple[str, ...]
    pieces: tuple[tuple[int, ...], ...]
    member: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Shares:
    """
    Hours due to each group.

    Parameters
    ----------
    cast : (n_groups, ...) float32
        In its shadow [h].
    sole : (n_groups, ...) float32
        In its shadow and in no other, nor turned from the sun [h].
    """

    cast: NDArray[np.float32]
    sole: NDArray[np.float32]


def find_groups(
    scene: Scene, casters: Sequence[int], who: Sequence[str] = (), by: str | None = None
) -> Groups:
    """
    Group casting parts by patterns, or by what they are.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int
        Indices of the parts that cast.
    who : sequence of str
        Shell patterns of names, kinds, layers or tags. Without ``by`` each is a group.
    by : {'part', 'kind', 'layer'}, optional
        One group for each name, kind or layer, of all casters or of those that ``who``
        matches.

    Raises
    ------
    InputError
        If a pattern matches no part or none that casts, or there are too many groups.
    """
    if by is not None and by not in BY:
        msg = f"hours cannot be told by '{by}'; choose part, kind or layer"
        raise InputError(msg, by=by)
    casting = set(casters)
    chosen: dict[str, list[int]] = {}
    for pattern in who:
        chosen[pattern] = sorted(casting.intersection(scene.select([pattern])))
        if not chosen[pattern]:
            msg = f"'{pattern}' matches only parts that do not cast; take a --no-cast pattern away"
            raise InputError(msg, pattern=pattern)
    if by is not None:
        some = sorted(set().union(*chosen.values())) if who else sorted(casting)
        chosen = {}
        for part in some:
            name = getattr(scene.parts[part], _ATTRIBUTES[by])
            chosen.setdefault(name or f"no {by}", []).append(part)
    if len(chosen) > _MOST_GROUPS:
        msg = (
            f"there are {len(chosen)} {by}s that cast; choose at most {_MOST_GROUPS} of them "
            "with --who"
        )
        raise InputError(msg, count=len(chosen))
    member = np.zeros((len(scene.parts), len(chosen)), np.bool_)
    for group, parts in enumerate(chosen.values()):
        member[parts, group] = True
    listed = np.array(sorted(casting))
    kinds, piece = np.unique(member[listed], axis=0, return_inverse=True)
    pieces = tuple(tuple(listed[piece.ravel() == k].tolist()) for k in range(len(kinds)))
    return Groups(tuple(chosen), pieces, np.ascontiguousarray(kinds.T))


def count_shares(
    finders: Sequence[Finder],
    places: Places,
    groups: Groups,
    period: Period,
    shape: tuple[int, ...],
    threads: int = 1,
    progress: Callable[[int], object] = lambda _: None,
) -> Shares:
    """
    Find the hours due to each group on some receivers.

    Parameters
    ----------
    finders : sequence of Finder
        Of each piece's shadows on these receivers, without attached shadow.
    places : Places
        The receivers, flat.
    groups : Groups
    period : Period
    shape : tuple of int
        Of the receivers.
    threads : int
    progress : callable
        Told how many instants were done, now and then.
    """
    cells = int(np.prod(shape, dtype=np.int64))
    cast = np.zeros((len(groups.names), cells), np.float32)
    sole = np.zeros_like(cast)
    up = np.flatnonzero(period.sun.is_up)
    bits = np.zeros((len(finders), cells), np.uint8)
    first = np.cumsum([0, *groups.member.sum(1)])
    listed = np.nonzero(groups.member)[1]
    hours = period.hours
    for start in range(0, len(up), 8):
        some = up[start : start + 8]
        suns = period.sun.direction[some]
        bits[:] = 0
        for find, row in zip(finders, bits, strict=True):
            window, masks = find(suns)
            packed = np.zeros(masks.shape[1:], np.uint8)
            for k, mask in enumerate(masks):
                packed |= mask << np.uint8(k)
            row.reshape(shape)[window] = packed
        use_threads(threads)
        lengths = hours[some].astype(np.float32)
        _share(bits, suns, places.normals, lengths, first, listed, cast, sole)
        progress(len(some))
    return Shares(cast.reshape(-1, *shape), sole.reshape(-1, *shape))


@njit(cache=True, nogil=True, parallel=True, boundscheck=False)
def _share(bits, suns, normals, lengths, first, listed, cast, sole):
    """Add up to eight instants, one bit each, to the hours of every group."""
    cells = bits.shape[1]
    n = lengths.size
    for block in prange((cells + _BLOCK - 1) // _BLOCK):
        total = np.empty(8, np.int64)
        for c in range(block * _BLOCK, min(cells, (block + 1) * _BLOCK)):
            total[:] = 0
            some = np.uint8(0)
            for a in range(bits.shape[0]):
                b = bits[a, c]
                some |= b
                if b:
                    for k in range(n):
                        total[k] += (b >> k) & 1
            if some == 0:
                continue
            for k in range(n):
                facing = 0.0
                for j in range(3):
                    facing += normals[c, j] * suns[k, j]
                if facing <= 0.0:
                    total[k] = -1  # turned away: no one else's fault
            for g in range(first.size - 1):
                mine = np.uint8(0)
                for q in range(first[g], first[g + 1]):
                    mine |= bits[listed[q], c]
                if mine == 0:
                    continue
                for k in range(n):
                    if (mine >> k) & 1 == 0 or total[k] < 0:
                        continue
                    cast[g, c] += lengths[k]
                    own = 0
                    for q in range(first[g], first[g + 1]):
                        own += (bits[listed[q], c] >> k) & 1
                    if own == total[k]:
                        sole[g, c] += lengths[k]
