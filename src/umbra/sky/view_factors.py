"""View factor and overcast light of many points, by the exact outlines of their free sky."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.kernels import kernel, run_shared, take_next
from umbra.machine import choose_threads, use_threads
from umbra.sky.casters import SkyCasters
from umbra.sky.events import find_events, find_spans
from umbra.sky.gather import gather_faces, keep_above
from umbra.sky.nearest import add_shares
from umbra.sky.skyline import make_cover, make_covers
from umbra.sky.sweep import find_pieces, integrate, is_on_cover
from umbra.sky.tensors import find_open, sum_tensors
from umbra.sky.wall_cover import cover_by_walls, find_wall_covers

__all__ = ["PointSkies", "find_seen", "measure_sky", "trace_bands", "trace_free_sky"]

_NEAREST = 8.0
"""Distance within which walls hide what is behind them, and its doubles [m]."""


class PointSkies(NamedTuple):
    """
    What n points see of the sky.

    Parameters
    ----------
    sky_view_factor : (n,) float64
    sky_component : (n,) float64
        Of an open level plane's [%].
    blocked_by : (n, n_objects) float64 or None
        Share of the open sky component of each point's own plane that each object takes, as the
        nearest in its directions.
    """

    sky_view_factor: NDArray[np.float64]
    sky_component: NDArray[np.float64]
    blocked_by: NDArray[np.float64] | None


def measure_sky(
    casters: SkyCasters,
    points: ArrayLike,
    normals: ArrayLike,
    threads: int | None = None,
    *,
    objects: int = 0,
) -> PointSkies:
    """
    Measure the upper sky before planes, exactly.

    Parameters
    ----------
    casters : SkyCasters
    points : (n, 3) float64
        In the casters' frame [m]. A face whose plane holds a point covers nothing of its sky.
    normals : (n, 3) float64
        Unit normals of the planes.
    threads : int, optional
        All cores by default.
    objects : int
        Number of objects whose shares are found, too, which takes longer; 0: none.

    Raises
    ------
    InputError
        If the arrays do not fit each other, or are not finite.
    """
    at = np.ascontiguousarray(points, np.float64)
    toward = np.ascontiguousarray(normals, np.float64)
    if at.ndim != 2 or at.shape[1:] != (3,) or at.shape != toward.shape:
        msg = f"points and normals are arrays (n, 3); got {at.shape} and {toward.shape}"
        raise InputError(msg)
    length = np.linalg.norm(toward, axis=1)
    wrong = ~(np.isfinite(at).all(1) & np.isfinite(length) & (length > 0))
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        msg = (
            f"{int(wrong.sum())} points are not finite or have a normal of length 0 "
            f"(first: point {first + 1}); correct or remove them"
        )
        raise InputError(msg, point=first)
    toward = toward / length[:, None]
    use_threads(choose_threads(threads))
    integrals = np.zeros((len(at), 2))
    run_shared(len(at), _measure, casters, at, toward, integrals)
    svf, share = np.maximum(integrals, 0.0).T
    if not objects:
        return PointSkies(svf, 100.0 * share, None)
    taken = np.zeros((len(at), objects))
    run_shared(len(at), _share, casters, at, toward, taken)
    whole = find_open(toward)[1]
    return PointSkies(svf, 100.0 * share, taken / np.where(whole > 0, whole, np.inf)[:, None])


@kernel
def find_seen(casters, p, normal):
    """Find the faces that a point sees or may see, (``SeenFaces``); hidden ones may be left out."""
    covers, reaches = find_wall_covers(casters, p, normal, _NEAREST)
    return gather_faces(casters, p, normal, covers, reaches, False)


@kernel
def trace_free_sky(casters, p, normal):
    """Find the pieces of the free upper sky before a plane through a point, and its faces."""
    covers = make_covers(1)
    cover_by_walls(casters, p, normal, np.inf, covers)
    seen, pieces = _trace_beyond(casters, p, normal, covers, True)
    if is_on_cover(pieces):
        seen, pieces = _trace_beyond(casters, p, normal, make_covers(1), False)
    return seen, pieces


@kernel
def _trace_beyond(casters, p, normal, covers, raises):
    """Find the pieces that a cover (1, BINS, 6) leaves; see ``gather_faces`` for ``raises``."""
    seen = gather_faces(casters, p, normal, covers, np.zeros(1), raises)
    seen = keep_above(seen, covers[0])
    events = find_events(seen, normal, np.zeros(casters.n_edges, np.bool_), covers[0])
    spans, owner = find_spans(seen)
    return seen, find_pieces(seen, normal, events, spans, owner, covers[0])


@kernel
def _measure(casters, points, normals, integrals, taken):
    while True:
        i = take_next(taken)
        if i >= points.shape[0]:
            return
        _, pieces = trace_free_sky(casters, points[i], normals[i])
        moments = np.zeros(7)
        integrate(pieces, moments)
        integrals[i, 0], integrals[i, 1] = sum_tensors(moments, normals[i])


@kernel
def _share(casters, points, normals, shares, taken):
    while True:
        i = take_next(taken)
        if i >= points.shape[0]:
            return
        seen = find_seen(casters, points[i], normals[i])
        events = find_events(seen, normals[i], casters.is_between, make_cover())
        moments = np.zeros((shares.shape[1], 7))
        bands = np.empty((0, 10))
        add_shares(seen, casters, normals[i], events, moments, bands)
        for k in range(shares.shape[1]):
            shares[i, k] = max(sum_tensors(moments[k], normals[i])[1], 0.0)


def trace_bands(
    casters: SkyCasters, p: NDArray[np.float64], normal: NDArray[np.float64], objects: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the bands of ``add_shares`` that objects take before a plane, and the events."""
    seen = find_seen(casters, p, normal)
    events = find_events(seen, normal, casters.is_between, make_cover())
    moments = np.zeros((objects, 7))
    count = add_shares(seen, casters, normal, events, moments, np.empty((0, 10)))
    bands = np.zeros((count, 10))
    add_shares(seen, casters, normal, events, moments, bands)
    return bands, events
