"""
Silhouette search, by brute force or by a tree over the edges in dual space.

All methods return identical edges and multiplicities. Brute force reads an edge once for 64 lights,
and needs no preparation; the tree tests only edges near the silhouette, but building it takes as
long as brute force for some 50 single lights, or 1,000 lights 64 at a time.
"""

import weakref
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.machine import get_threads
from umbra.volume.adjacency import Caster
from umbra.volume.dual_tree import DualTree, make_dual_tree
from umbra.volume.duals import Tree
from umbra.volume.facing import LIGHTS_AT_ONCE, Silhouettes, ask_every_edge

__all__ = [
    "METHODS",
    "Silhouettes",
    "find_silhouette_edges",
    "find_silhouettes",
    "prepare_tree",
]

METHODS = ("auto", "brute", "tree")
# Crossovers, measured on towns, towers and boulders. Building takes 0.2 us per edge; brute force 3
# ns per edge for a single light, 0.8 ns for each of 8 and 0.4 ns for each of 64; the tree 50 ns per
# edge found.
_EDGES = 10_000  # casters with fewer edges always use brute force
_SHORT = 32  # single lights use a tree if at most one edge in 32 is in the silhouette,
_LONE_LIGHTS = 4  # from the fourth light with such a short silhouette
_SHORTER = 150  # many lights at once use a tree if at most one edge in 150 is,
_MANY_LIGHTS = 1000  # after 1000 lights, whose brute force costs as much as building the tree
_FEW = 8  # lights at once, up to which each costs twice as much as one of 64


@dataclass(eq=False)
class _Kept:
    """Cache for the edges of a caster, independent of its open components."""

    planes: weakref.ref
    lone_lights: int = 0  # single lights with short silhouettes, found by brute force
    lights: int = 0  # the same for lights in groups; small groups count twice
    are_shorter: bool | None = None  # whether silhouettes are this short; None: unknown
    tree: DualTree | None = None


_kept: dict[int, _Kept] = {}
"""Keyed by the identity of ``edge_faces``, which ``Caster.opened`` keeps."""


def find_silhouettes(
    caster: Caster, lights: NDArray[np.float64], method: str | Tree = "auto"
) -> Iterator[tuple[slice, Silhouettes]]:
    """
    Find the silhouette edges for many lights, in groups.

    Parameters
    ----------
    caster : Caster
    lights : (n_lights, 4) float64
        Homogeneous, in the caster's frame.
    method : {'auto', 'brute', 'tree'} or Tree
        A tree is built when first needed, and cached as long as the caster and casters opened from
        it exist; another tree of the caster may be given. If silhouettes are short, ``auto`` builds
        a tree for the fourth single light, or after enough lights in groups to pay for it; it uses
        an existing tree; otherwise it tests every edge.

    Yields
    ------
    which : slice
        Slice of ``lights``.
    silhouettes : Silhouettes

    Raises
    ------
    InputError
        If the method is unknown.
    """
    tree = _choose(caster, lights, method)
    done = 0
    if tree is None:
        for which, silhouettes in ask_every_edge(caster, lights):
            done = which.stop
            if method == "auto":
                tree = _think_again(caster, silhouettes, len(lights), done)
            yield which, silhouettes
            if tree is not None:
                break
    if tree is None:
        return
    threads = get_threads()
    for first in range(done, len(lights), LIGHTS_AT_ONCE):
        batch = lights[first : first + LIGHTS_AT_ONCE]
        search = partial(_search, tree, caster)
        if threads > 1 and len(batch) > 1:
            with ThreadPoolExecutor(threads) as pool:
                lists = list(pool.map(search, batch))
        else:
            lists = list(map(search, batch))
        starts = np.cumsum([0] + [len(codes) for codes in lists])
        codes = lists[0] if len(lists) == 1 else np.concatenate(lists)
        yield slice(first, first + len(batch)), Silhouettes(codes, starts)


def prepare_tree(caster: Caster) -> DualTree:
    """
    Build a tree before the first light, or return the existing one.

    ``find_silhouettes`` uses it from then on.
    """
    cache = _look_up(caster)
    if cache.tree is None:
        cache.tree = make_dual_tree(caster)
    return cache.tree


def find_silhouette_edges(
    caster: Caster, light: NDArray[np.float64], method: str | Tree = "auto"
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """
    Find the silhouette of one light (4,), in the caster's frame, as edges with multiplicities.

    Returns the vertices of unique edges, (n, 2), wound as in the lit faces, and multiplicities
    (n,), above 0. At every vertex the multiplicities of its edges sum to 0, outgoing minus
    incoming. Methods as in ``find_silhouettes``.
    """
    (_, silhouettes), *_ = find_silhouettes(caster, np.asarray(light, np.float64)[None], method)
    codes = silhouettes.codes[silhouettes.starts[0] : silhouettes.starts[1]]
    which = codes >> 2
    signed = np.where(codes & 1, 1, -1) * (
        caster.weight[which].astype(np.int64) >> (codes >> 1 & 1)
    )
    pairs, index = np.unique(caster.edges[which], axis=0, return_inverse=True)
    sums = np.zeros(len(pairs), np.int64)
    np.add.at(sums, index.ravel(), signed)
    is_left = sums != 0
    edges, sums = pairs[is_left], sums[is_left]
    return np.where(sums[:, None] > 0, edges, edges[:, ::-1]).astype(np.int32), np.abs(sums)


def _choose(caster: Caster, lights: NDArray[np.float64], method: str | Tree) -> Tree | None:
    """Return the tree to search; None for brute force."""
    if isinstance(method, Tree):
        return method
    if method not in METHODS:
        msg = f"there is no method '{method}' for silhouettes; there are {', '.join(METHODS)}"
        raise InputError(msg, method=method)
    if method != "auto":
        return None if method == "brute" else prepare_tree(caster)
    n_edges = len(caster.edges)
    if n_edges < _EDGES or not len(lights):
        return None
    cache = _look_up(caster)
    is_there = cache.tree is not None
    if len(lights) == 1:
        is_due = is_there or cache.lone_lights >= _LONE_LIGHTS - 1
    elif cache.tree is not None and cache.are_shorter is None:
        n_found = len(_search(cache.tree, caster, lights[0]))
        is_due = cache.are_shorter = n_found * _SHORTER <= n_edges
    else:
        is_due = bool(cache.are_shorter) and (is_there or cache.lights >= _MANY_LIGHTS)
    return prepare_tree(caster) if is_due else None


def _think_again(caster: Caster, silhouettes: Silhouettes, n_lights: int, done: int) -> Tree | None:
    """Return the tree if it pays for the remaining lights, judged by the silhouettes so far."""
    n_edges = len(caster.edges)
    if n_edges < _EDGES:
        return None
    n_asked = len(silhouettes.starts) - 1
    n_found = silhouettes.starts[-1] / n_asked
    cache = _look_up(caster)
    if n_lights == 1:
        cache.lone_lights += n_found * _SHORT <= n_edges
        return None
    cache.are_shorter = bool(n_found * _SHORTER <= n_edges)
    if not cache.are_shorter:
        return None
    cache.lights += n_asked * (2 if n_lights <= _FEW else 1)
    left = n_lights - done
    is_worth = cache.tree is not None or cache.lights + left >= _MANY_LIGHTS
    return prepare_tree(caster) if left and is_worth else None


def _search(tree: Tree, caster: Caster, light: NDArray[np.float64]) -> NDArray[np.int32]:
    codes = tree.find(caster, light)
    if codes is not None:
        return codes
    ((_, silhouettes),) = ask_every_edge(caster, light[None])
    return silhouettes.codes[: silhouettes.starts[1]]


def _look_up(caster: Caster) -> _Kept:
    """Return the cache of a caster, which lives as long as its edges."""
    key = id(caster.edge_faces)
    cache = _kept.get(key)
    if cache is None or cache.planes() is not caster.whole_planes:
        if cache is None:
            weakref.finalize(caster.edge_faces, _kept.pop, key, None)
        cache = _kept[key] = _Kept(weakref.ref(caster.whole_planes))
    return cache
