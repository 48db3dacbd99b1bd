"""Layers that stand where they should not: in each other's place, or far apart."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Part

__all__ = ["find_far", "find_overlaps"]

SAME = 0.5  # of their union: boxes that share more stand for one thing
FAR = 10_000.0  # [m]; layers of one study are not farther apart
MOST = 20_000_000  # pairs of boxes that are compared at once


def find_far(layers: Mapping[str, Sequence[Part]]) -> list[str]:
    """
    Find layers that lie so far from the first that their coordinates cannot be of one kind.

    Parameters
    ----------
    layers : dict of str to list of Part
        In one CRS.

    Returns
    -------
    notes : list of str
    """
    boxes = {name: _boxes(parts)[1] for name, parts in layers.items()}
    bounds = {n: np.stack([b[:, 0].min(0), b[:, 1].max(0)]) for n, b in boxes.items()}
    names = list(bounds)
    notes = []
    for name in names[1:]:
        first, other = bounds[names[0]], bounds[name]
        gap = np.maximum(first[0] - other[1], other[0] - first[1])[:2].max()
        if gap > FAR:
            notes.append(
                f"layer '{name}' lies {gap / 1000:.0f} km from layer '{names[0]}'; "
                "are both in the same coordinates?"
            )
    return notes


def find_overlaps(layers: Mapping[str, Sequence[Part]]) -> list[str]:
    """
    Find things of one layer that stand in the place of another's.

    Parameters
    ----------
    layers : dict of str to list of Part
        In one CRS.

    Returns
    -------
    notes : list of str
        One for each pair of layers: how many, and the first.
    """
    boxes = {name: _boxes(parts) for name, parts in layers.items()}
    notes = []
    for one, other in combinations(boxes, 2):
        (names, a), (others, b) = boxes[one], boxes[other]
        pairs = _find_same(a, b)
        if len(pairs):
            count = len(np.unique(pairs[:, 1]))
            i, j = pairs[0]
            notes.append(
                f"layers overlap: {count} of {len(b)} things of '{other}' stand where things of "
                f"'{one}' do (first: '{others[j]}' and '{names[i]}'); choose with --no-cast"
            )
    return notes


def _boxes(parts: Sequence[Part]) -> tuple[list[str], NDArray[np.float64]]:
    """Give the names of things and their boxes (n, 2, 3)."""
    found: dict[str, NDArray[np.float64]] = {}
    for part in parts:
        if part.triangles:
            box = part.bounds
            if part.name in found:
                other = found[part.name]
                box = np.stack([np.minimum(box[0], other[0]), np.maximum(box[1], other[1])])
            found[part.name] = box
    return list(found), np.array(list(found.values()))


def _find_same(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find pairs (index in a, index in b) of boxes that are nearly one box."""
    # No thickness, no volume: a sheet is taken as a centimetre thick.
    a, b = (np.stack([box[:, 0], np.maximum(box[:, 1], box[:, 0] + 0.01)], 1) for box in (a, b))
    order = np.argsort(a[:, 0, 0], kind="stable")
    a = a[order]
    widest = (a[:, 1, 0] - a[:, 0, 0]).max()
    first = np.searchsorted(a[:, 0, 0], b[:, 0, 0] - widest)
    last = np.searchsorted(a[:, 0, 0], b[:, 1, 0], "right")
    lengths = np.maximum(last - first, 0)
    found = [np.zeros((0, 2), np.int64)]
    ends = np.cumsum(lengths)
    start = 0
    while start < len(b):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + MOST, "right")), start + 1)
        j = np.repeat(np.arange(start, stop), lengths[start:stop])
        offset = np.arange(len(j)) - np.repeat(
            np.cumsum(lengths[start:stop]) - lengths[start:stop], lengths[start:stop]
        )
        i = first[j] + offset
        common = np.minimum(a[i, 1], b[j, 1]) - np.maximum(a[i, 0], b[j, 0])
        shared = np.maximum(common, 0).prod(1)
        union = (a[i, 1] - a[i, 0]).prod(1) + (b[j, 1] - b[j, 0]).prod(1) - shared
        same = shared > SAME * union
        found.append(np.stack([order[i[same]], j[same]], axis=1))
        start = stop
    return np.concatenate(found)
