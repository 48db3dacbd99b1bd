"""``umbra.sun_access``: what shades places at given times, for models of photovoltaic power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.calls.sky import find_known_site, find_land
from umbra.casters.casting import prepare_casting
from umbra.errors import InputError, check_type
from umbra.machine import choose_threads
from umbra.rays.hidden import find_hidden
from umbra.receivers.points import check_points
from umbra.scene import Scene
from umbra.sky.casters import SkyCasters, find_sky_casters
from umbra.sky.heights import find_heights
from umbra.sky.land_curtain import add_land
from umbra.sky.tensors import find_open
from umbra.sky.view_factors import find_seen, measure_sky
from umbra.sun import Site, find_sun

__all__ = ["sun_access"]

_MOST = 50_000_000
"""Rows of a frame, some 4 GB."""
_LEVEL = np.array([0.0, 0.0, 1.0])


def sun_access(
    scene: Scene,
    points: ArrayLike,
    times: Any,
    site: Site | None = None,
    *,
    cast: Sequence[str] = (),
    no_cast: Sequence[str] = (),
    horizon: Any = None,
    horizon_from: float | None = None,
    threads: int | None = None,
) -> Any:
    """
    Find what shades places at given times, as models of photovoltaic power take it.

    Parameters
    ----------
    scene : Scene
    points : (3,), (6,), (n, 3) or (n, 6) float
        In the model's own coordinates [m]; with normals of the planes, which are level by default.
    times : pandas.DatetimeIndex, or what makes one
        With a time zone. The sun is that of the instants themselves.
    site : Site, optional
        By default the file's, if it says one.
    cast, no_cast : sequences of str
        Shell patterns of the parts that cast shadows, and of those that do not; all do by default.
    horizon : path or pandas.Series, optional
        Land far away, as ``umbra.shadow_study`` takes it; it counts in every column.
    horizon_from : float, optional
        Distance from which the land of a raster counts [m].
    threads : int, optional
        All cores by default.

    Returns
    -------
    frame : pandas.DataFrame
        Rows by ``time``, as given, and for several points by ``time`` and ``point`` (their
        number). Columns:

        - ``shaded_fraction``: share of the sun's beam that does not reach the place, 0 or 1; 1
          also while the sun is behind the plane or below the horizon;
        - ``horizon_elevation``: elevation up to which everything is obstructed in the sun's
          azimuth [degrees];
        - ``sky_diffuse_fraction``: of an even sky's light on the open plane, the share that
          arrives; the same at all times;
        - ``apparent_elevation``, ``azimuth``: of the sun, as pvlib names them [degrees].

    Raises
    ------
    InputError
        If a point or a time is wrong, times have no zone, or the site is not known.

    Examples
    --------
    >>> times = pd.date_range("2026-03-21", periods=24, freq="1h", tz="UTC")  # doctest: +SKIP
    >>> umbra.sun_access(scene, (2, 3, 4, 0, -0.5, 0.9), times)  # doctest: +SKIP
    """
    import pandas as pd  # noqa: PLC0415 - takes half a second

    check_type("scene", scene, Scene)
    index = _read_times(times)
    given = np.asarray(points, np.float64)
    is_one = given.ndim == 1
    given = check_points(given[None] if is_one else given)
    if len(given) * len(index) > _MOST:
        msg = f"{len(given):,} points at {len(index):,} times are more than {_MOST:,} rows; give "
        msg += "fewer at once"
        raise InputError(msg, points=len(given))
    known = find_known_site(scene) if site is None else site
    if known is None:
        msg = "the sun needs a site, and the file does not say it; give site=Site(48.2, 16.37)"
        raise InputError(msg, option="site")
    threads = choose_threads(threads)
    parts = scene.select(cast, no_cast)
    land = find_land(scene, known, horizon, horizon_from)
    local = np.ascontiguousarray(given[:, :3] - scene.origin)
    has_normals = given.shape[1] == 6
    normals = given[:, 3:] if has_normals else np.tile(_LEVEL, (len(given), 1))
    normals = np.ascontiguousarray(normals)
    sun = find_sun(known, index.tz_convert("UTC").tz_localize(None).to_numpy())
    up = np.flatnonzero(sun.is_up)
    shaded = np.ones((len(index), len(given)), np.uint8)
    tree = prepare_casting(scene, parts, threads).tree
    shaded[up] = find_hidden(tree, local, normals, sun.direction[up], threads)
    if land is not None:
        shaded[up[land.covers(sun.direction[up], known.true_north)]] = 1
    whole, around = add_land(scene, land, known.true_north)
    casters, _ = find_sky_casters(whole, [*parts, *around])
    skies = measure_sky(casters, local, normals, threads)
    open_ = find_open(normals)[0]
    share = np.divide(skies.sky_view_factor, open_, out=np.zeros_like(open_), where=open_ > 0)
    columns = {
        "shaded_fraction": shaded.astype(np.float64).ravel(),
        "horizon_elevation": _find_horizons(casters, local, sun.direction).ravel(),
        "sky_diffuse_fraction": np.tile(np.minimum(share, 1.0), len(index)),
        "apparent_elevation": np.repeat(sun.altitude, len(given)),
        "azimuth": np.repeat(sun.azimuth, len(given)),
    }
    if not is_one:
        index = pd.MultiIndex.from_product([index, range(len(given))], names=["time", "point"])
    return pd.DataFrame(columns, index=index.rename(["time", "point"] if not is_one else "time"))


def _read_times(times: Any) -> Any:
    """Return times as an index with a zone."""
    import pandas as pd  # noqa: PLC0415

    try:
        index = pd.DatetimeIndex(times)
    except (TypeError, ValueError, OverflowError) as error:
        msg = f"times cannot be read ({error}); give a pandas DatetimeIndex with a time zone"
        raise InputError(msg, option="times") from None
    if index.tz is None:
        msg = "times have no time zone; give it, such as times.tz_localize('Europe/Vienna')"
        raise InputError(msg, option="times")
    if not len(index) or index.hasnans:
        msg = "times are empty or hold a NaT; give at least one, and no NaT"
        raise InputError(msg, option="times")
    return index


def _find_horizons(
    casters: SkyCasters, points: NDArray[np.float64], toward: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the lowest free elevation above points in directions' azimuths (m, n) [degrees]."""
    level = toward[:, :2] / np.linalg.norm(toward[:, :2], axis=1, keepdims=True)
    heights = np.zeros((len(toward), len(points)))
    for k, point in enumerate(points):
        heights[:, k] = find_heights(find_seen(casters, point, _LEVEL), level)
    return np.degrees(heights)
