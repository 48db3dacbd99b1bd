"""
Hours due to groups of casters, added up receiver by receiver.

Casters are cut into *pieces*, of which groups consist. For up to eight lights, a bit each, it is
known which pieces hide which receivers.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import inlined, inner, kernel

__all__ = ["Membership", "ShareWork", "add_group_shares", "make_share_work"]

_SEGMENT = 256  # receivers of which pieces are listed at a time


class Membership(NamedTuple):
    """
    Pieces of each group, and groups of each piece.

    Parameters
    ----------
    member : (n_groups, n_pieces) bool
    first : (n_pieces + 1,) int64
        First entry of each piece in ``groups``.
    groups : (entries,) int64
    is_weak : (n_pieces,) bool
        Pieces that are canopies.
    """

    member: NDArray[np.bool_]
    first: NDArray[np.int64]
    groups: NDArray[np.int64]
    is_weak: NDArray[np.bool_]

    @classmethod
    def of(cls, member: NDArray[np.bool_], is_weak: NDArray[np.bool_]) -> "Membership":
        """List the groups of each piece."""
        first = np.append(0, np.cumsum(member.sum(0))).astype(np.int64)
        return cls(
            member, first, np.nonzero(member.T)[1].astype(np.int64), np.ascontiguousarray(is_weak)
        )


class ShareWork(NamedTuple):
    """
    Work arrays of a thread.

    Parameters
    ----------
    rows : (n_pieces,) int32
        Rows with a hidden receiver in a segment.
    slot : (n_groups,) int32
        Place of each group in ``listed``; -1 for none.
    listed : (n_groups,) int32
        Groups with such a row.
    begin : (n_groups + 1,) int64
    of_group : (entries,) int32
        Rows of each listed group.
    hidden : (2, 8) int64
        Number of opaque pieces and of canopies that hide each light.
    """

    rows: np.ndarray
    slot: np.ndarray
    listed: np.ndarray
    begin: np.ndarray
    of_group: np.ndarray
    hidden: np.ndarray


@inner
def make_share_work(membership):
    """Make the work arrays."""
    n_groups, n_pieces = membership.member.shape
    return ShareWork(
        np.zeros(n_pieces, np.int32),
        np.full(n_groups, -1, np.int32),
        np.zeros(n_groups, np.int32),
        np.zeros(n_groups + 1, np.int64),
        np.zeros(membership.groups.size, np.int32),
        np.zeros((2, 8), np.int64),
    )


@kernel
def add_group_shares(
    bits, pieces, low, high, where, normals, suns, weights, membership, work, cast, sole
):  # fmt: skip
    """
    Add up to eight lights to the hours due to each group.

    Parameters
    ----------
    bits : (rows, n) uint8
        Lights from which a piece hides each receiver; attached shadow is ignored.
    pieces : (n_rows,) int32
        Piece of each row; there may be more rows.
    low, high : int
        The receivers: some columns of ``bits``.
    where : (n,) int64
        Column of each receiver in ``cast`` and ``sole``.
    normals : (n, 3) float64
        NaN where a point faces every light.
    suns : (n_suns, 3) float64
    weights : (2, n_suns) float64
        Duration of each light [h], and the share of it that canopies transmit.
    membership : Membership
    work : ShareWork
    cast, sole : (n_groups, n_receivers) float32
        Hours in the group's shadow, and in its shadow alone [h]. Added to.
    """
    for start in range(low, high, _SEGMENT):
        end = min(start + _SEGMENT, high)
        n_rows = _find_rows(bits, pieces.size, start, end, work.rows)
        if n_rows == 0:
            continue
        n_groups = _list_groups(pieces, n_rows, membership, work)
        for c in range(start, end):
            hidden = _count_hidden(bits, pieces, n_rows, c, membership.is_weak, work)
            if hidden == 0:
                continue
            for k in range(suns.shape[0]):
                facing = 0.0
                for j in range(3):
                    facing += normals[c, j] * suns[k, j]
                # Attached shadow is due to no caster; a point without a normal (NaN) has none.
                if not facing <= 0.0 and (hidden >> k) & 1:
                    _add_light(
                        bits, pieces, c, k, n_groups, weights, membership.is_weak, work, where[c],
                        cast, sole,
                    )  # fmt: skip


@inlined
def _find_rows(bits, n, start, end, rows):
    """List the rows with a bit between two columns; return their number."""
    count = 0
    for r in range(n):
        union = np.uint8(0)
        for c in range(start, end):
            union |= bits[r, c]
        if union:
            rows[count] = r
            count += 1
    return count


@inlined
def _list_groups(pieces, n_rows, membership, work):
    """List the groups of the listed rows, and the rows of each; return their number."""
    first, groups = membership.first, membership.groups
    n = 0
    for q in range(n_rows):
        piece = pieces[work.rows[q]]
        for t in range(first[piece], first[piece + 1]):
            if work.slot[groups[t]] < 0:
                work.slot[groups[t]] = n
                work.listed[n] = groups[t]
                n += 1
    filled = 0
    for g in range(n):
        group = work.listed[g]
        work.slot[group] = -1
        work.begin[g] = filled
        for q in range(n_rows):
            if membership.member[group, pieces[work.rows[q]]]:
                work.of_group[filled] = work.rows[q]
                filled += 1
    work.begin[n] = filled
    return n


@inlined
def _count_hidden(bits, pieces, n_rows, c, is_weak, work):
    """Count the listed rows that hide a receiver from each light; return these lights."""
    hidden = work.hidden
    hidden[:] = 0
    hiding = np.uint8(0)
    for q in range(n_rows):
        r = work.rows[q]
        b = bits[r, c]
        hiding |= b
        if b:
            for k in range(8):
                hidden[np.int64(is_weak[pieces[r]]), k] += (b >> k) & 1
    return hiding


@inlined
def _add_light(bits, pieces, c, k, n_groups, weights, is_weak, work, at, cast, sole):
    """Add a light, the k-th, to the hours of the listed groups at a receiver."""
    hours, through = np.float32(weights[0, k]), weights[1, k]
    all_solid, all_weak = work.hidden[0, k], work.hidden[1, k]
    for g in range(n_groups):
        solid = 0
        weak = 0
        for q in range(work.begin[g], work.begin[g + 1]):
            r = work.of_group[q]
            bit = (bits[r, c] >> k) & 1
            if is_weak[pieces[r]]:
                weak += bit
            else:
                solid += bit
        if solid + weak == 0:
            continue
        group = work.listed[g]
        cast[group, at] += hours * (1.0 - _pass(solid, weak, through))
        sole[group, at] += hours * (
            _pass(all_solid - solid, all_weak - weak, through) - _pass(all_solid, all_weak, through)
        )


@inlined
def _pass(solid, weak, through):
    """Return the share of the light past some opaque pieces and some canopies."""
    if solid > 0:
        return 0.0
    return through if weak > 0 else 1.0
