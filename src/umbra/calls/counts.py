"""
Counting of given points and lights: the primitive below every study.

Shadows on a level plane are also outlined, as exact polygons.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from importlib.util import find_spec
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.calls.sky import find_known_site, find_land
from umbra.casters.casting import prepare_casting
from umbra.devices import check_device, find_device
from umbra.devices.by_points import PointDevice
from umbra.errors import InputError, check_type, show_value
from umbra.option_fields import read_texts
from umbra.packages import require
from umbra.rays.hidden import find_hidden
from umbra.registry import take_notes
from umbra.scene import Light, Scene
from umbra.scene.grid import Grid
from umbra.scene.numbers import OUTSIDE, check_reach, read_array
from umbra.sun.position import SunPath

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["check_lights", "count", "shadow_polygons"]

_PLACE = 3  # columns of a position; a normal follows
_HALF = 0.5
_NO_DATE = "2000-01-01"  # required by options, unused for lights without times
_WORK = 64e6  # memory of a block of points with all lights [byte]
_CELLS = 1024  # side of the raster that finds components wound inward
_MARGIN = 1.0  # beyond the longest shadow [m]


def count(
    scene: Scene,
    receivers: ArrayLike,
    directions: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    of: Literal["shadow", "light"] = "shadow",
    cast: str | Sequence[str] = (),
    no_cast: str | Sequence[str] = (),
    horizon: Any = None,
    device: str = "auto",
    threads: int | None = None,
    **options: Any,
) -> Any:
    """
    Find the points in shadow of each light, or add up the weights of hidden lights.

    Parameters
    ----------
    scene : Scene
        Scene with the casters.
    receivers : (n, 3) or (n, 6) float, or str
        Points in the model's own coordinates [m], or points with normals. With a normal a
        point is in attached shadow if it faces away from a light; without one, a point on a
        face sees both sides of it. Or the name of a study's receivers:
        ``'ground'``, ``'top'``, ``'surfaces'``, ``'south'``.
    directions : (m, 3) or (m, 4) float
        Directions toward the lights, of any length, in the model's axes; or homogeneous
        lights: w = 0 is a direction, w = 1 a lamp's position [m].
    weights : (m,) or (m, k) float, optional
        Weight of each light: hours, shares of the sky, W/m2. One sum per column.
    of : {'shadow', 'light'}
        Whether to count hidden or visible lights.
    cast, no_cast : str or sequence of str
        Shell patterns of the parts that cast, or do not.
    horizon : path, pandas.Series or Horizon, optional
        Land far away, as in `umbra.shadow_study`: directions below it reach no point; lamps stand
        before it. The site is the file's, without one the model's y axis is north.
    device : str
        Device that counts, as in `umbra.shadow_study`; what it cannot count, the CPU does.
    threads : int, optional
        All cores by default.
    **options
        Options of named receivers, as in `umbra.shadow_study`: ``ground``, ``extent``, ``cell``,
        ``size``, ``spacing``, ``on``, ``points``, ``eye``; and ``canopy``, ``transmissivity``.

    Returns
    -------
    counts : (n, m) bool, (n,) float64 or (n, k) float64
        Without weights, whether each light is hidden from (for 'light': visible to) each
        point; with weights, the sum of their weights, in the weights' unit. For named
        receivers an xarray.DataArray (float32 sums) with their dimensions and coordinates
        before ``light`` or ``weight``; NaN or False where nothing receives.

    Raises
    ------
    InputError
        If an array has a wrong shape or is not finite, a light has zero length, or a pattern
        matches no part.

    Examples
    --------
    >>> hidden = umbra.count(scene, [(2, 3, 1.5)], [(0.3, -0.5, 0.8), (0, 0, 1)])
    >>> suns = umbra.find_sun(site, times)
    >>> sky = umbra.count(scene, "top", sky_directions, weights=shares, of="light", cell=1.0)
    >>> hours = umbra.count(scene, points, suns.direction, weights=np.full(len(times), 0.25))
    """
    check_type("scene", scene, Scene)
    if not isinstance(of, str) or of not in {"shadow", "light"}:
        msg = f"of={show_value(of)} is not one of shadow, light"
        raise InputError(msg, option="of")
    lights = check_lights(directions, "directions")
    sums = None if weights is None else _check_weights(weights, len(lights))
    threads = check_device(device, threads)
    for note in take_notes():
        warnings.warn(note, stacklevel=2)
    lights[:, :3] -= lights[:, 3:] * scene.origin
    behind = _find_behind(scene, horizon, lights)
    if isinstance(receivers, str):
        choices = {
            "receivers": receivers, "cast": cast, "no_cast": no_cast, "threads": threads,
            "device": device,
        }  # fmt: skip
        return _count_named(scene, lights, sums, of, behind, {**choices, **options})
    if options:
        name = next(iter(options))
        msg = f"{name}= is for named receivers, such as 'top'; leave it out"
        raise InputError(msg, option=name)
    points = _check_array("receivers", receivers, (3, 6))
    places = np.ascontiguousarray(points[:, :_PLACE] - scene.origin)
    normals = np.full(places.shape, np.nan)
    if points.shape[1] > _PLACE:
        normals[:] = points[:, _PLACE:]
    chosen = [
        read_texts(name, patterns) for name, patterns in (("cast", cast), ("no_cast", no_cast))
    ]
    casting, own = prepare_casting(scene, scene.select(*chosen), threads), find_device(device)
    triangles = casting.caster.vertices[casting.caster.faces]
    block = max(int(_WORK / (9 * len(lights))), 1)
    counts = []
    for first in range(0, len(places), block):
        batch = slice(first, first + block)
        if isinstance(own, PointDevice):
            masks = own.ask(triangles, places[batch], normals[batch], lights)
        else:
            masks = find_hidden(casting.tree, places[batch], normals[batch], lights, threads)
        masks[behind] = 1
        counted = (masks == (of == "shadow")).T
        counts.append(counted if sums is None else counted @ sums)
    return np.concatenate(counts)


def _count_named(
    scene: Scene,
    lights: NDArray[np.float64],
    sums: NDArray[np.float64] | None,
    of: str,
    behind: NDArray[np.bool_],
    choices: dict[str, Any],
) -> xr.DataArray:
    """Count on a study's receivers; without weights each light is a column."""
    import xarray as xr  # noqa: PLC0415

    from umbra.lights import Lights  # noqa: PLC0415
    from umbra.study.options import StudyOptions  # noqa: PLC0415
    from umbra.study.shadow_study import count_lights  # noqa: PLC0415

    columns = (np.eye(len(lights)) if sums is None else sums).reshape(len(lights), -1)
    options = StudyOptions(date=_NO_DATE, **choices)
    rest = np.where(behind[:, None], 0.0, columns)
    laid, dark = count_lights(scene, Lights.of(lights, rest), options)
    result: NDArray[Any] = np.moveaxis(dark, 0, -1) + (columns - rest).sum(0, dtype=np.float32)
    if of == "light":
        result = (columns.sum(0) - result).astype(np.float32)
    dims: tuple[str, ...] = (*laid.dims, "light" if sums is None else "weight")
    if sums is None:
        result = result > _HALF
    elif sums.ndim == 1:
        result, dims = result[..., 0], laid.dims
    coordinates = {
        name: (axes, array)
        for name, (axes, array) in {**laid.coordinates(), **laid.variables()}.items()
        if set(axes) <= set(laid.dims)
    }
    return xr.DataArray(result, coordinates, dims, name="count")


def _find_behind(scene: Scene, horizon: Any, lights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which homogeneous lights (m, 4) are behind the land."""
    site = find_known_site(scene)
    land = find_land(scene, site, horizon, None)
    if land is None:
        return np.zeros(len(lights), np.bool_)
    return land.covers(lights, 0.0 if site is None else site.true_north)


def _check_array(name: str, given: ArrayLike, columns: tuple[int, ...]) -> NDArray[np.float64]:
    """Return an array of finite numbers with one of these numbers of columns."""
    try:
        array = read_array(name, given).copy()
    except InputError:
        array = np.zeros(0)
    shapes = " or ".join(f"(n, {count})" for count in columns)
    if array.ndim != 2 or array.shape[1] not in columns or not len(array):
        shape = np.shape(array) if array.size else show_value(given)
        msg = f"{name}= takes an array {shapes} of numbers; got {shape}"
        raise InputError(msg, option=name)
    wrong = np.flatnonzero(~np.isfinite(array).all(1))
    if len(wrong):
        msg = f"{name} have {len(wrong)} rows that are not finite (first: {wrong[0]})"
        raise InputError(msg, option=name, row=int(wrong[0]))
    return array


def check_lights(given: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return homogeneous lights, (m, 4); directions of length 1."""
    vectors = _check_array(name, given, (3, 4))
    lights = np.zeros((len(vectors), 4))
    lights[:, : vectors.shape[1]] = vectors
    is_lamp = lights[:, 3] == 1
    wrong = np.flatnonzero(~is_lamp & (lights[:, 3] != 0))
    if len(wrong):
        msg = (
            "the w of a light is 1 (a lamp at a place) or 0 (a direction); row "
            f"{wrong[0]} of {name} has {lights[wrong[0], 3]:g}"
        )
        raise InputError(msg, option=name, row=int(wrong[0]))
    check_reach(f"the lamps of {name}", lights[is_lamp, :3], "give directions, W=0", OUTSIDE)
    # Directions near length 1, by powers of 2: exact, and their squares cannot overflow or vanish.
    size = np.frexp(np.abs(lights[:, :3]).max(1))[1]
    lights[:, :3] = np.ldexp(lights[:, :3], np.where(is_lamp, 0, -size)[:, None])
    length = np.linalg.norm(lights[:, :3], axis=1, keepdims=True)
    zero = np.flatnonzero(~is_lamp & (length[:, 0] == 0))
    if len(zero):
        msg = f"row {zero[0]} of {name} is 0 and points nowhere"
        raise InputError(msg, option=name, row=int(zero[0]))
    np.divide(lights[:, :3], length, out=lights[:, :3], where=~is_lamp[:, None])
    return lights


def _check_weights(given: ArrayLike, lights: int) -> NDArray[np.float64]:
    """Return weights, (m,) or (m, k)."""
    try:
        weights = read_array("weights", given)
    except InputError:
        weights = np.zeros(0)
    if weights.ndim not in {1, 2} or len(weights) != lights:
        msg = (
            f"weights are numbers, one or one row for each of {lights} lights; "
            f"got shape {weights.shape}"
        )
        raise InputError(msg, option="weights")
    wrong = np.flatnonzero(~np.isfinite(weights.reshape(lights, -1)).all(1))
    if len(wrong):
        msg = f"{len(wrong)} weights are not finite (first: that of light {wrong[0]})"
        raise InputError(msg, option="weights", row=int(wrong[0]))
    return weights


def shadow_polygons(
    scene: Scene,
    sun: Light | SunPath | ArrayLike,
    plane: float = 0.0,
    *,
    cast: str | Sequence[str] = (),
    no_cast: str | Sequence[str] = (),
) -> Any:
    """
    Outline the shadows on a level plane as polygons, exact to a millionth of a metre.

    Parameters
    ----------
    scene : Scene
        Scene with the casters; parts below the plane do not cast.
    sun : Light, SunPath, (3,) or (n, 3) float
        Directions toward the light, above the horizon, of any length, as from
        `umbra.sun_light` and `umbra.find_sun`.
    plane : float
        z of the plane, in the model's own coordinates [m].
    cast, no_cast : str or sequence of str
        Shell patterns of the parts that cast, or do not.

    Returns
    -------
    polygons : geopandas.GeoDataFrame, or shapely.MultiPolygon, or a list of them
        If geopandas is installed and the scene's CRS is known, one row per direction:
        ``geometry``, ``area_m2`` and, for a `SunPath`, ``sun_altitude`` and ``sun_azimuth``
        [degrees]. Otherwise a MultiPolygon, or a list for several directions. In the model's
        own coordinates [m].

    Raises
    ------
    InputError
        If a direction is not above the horizon, or shapely or pyclipr is not installed.

    Examples
    --------
    >>> sun = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    >>> umbra.shadow_polygons(scene, sun, plane=171.0).to_file("shadow.gpkg")
    """
    check_type("scene", scene, Scene)
    require(["shapely", "pyclipr"], "gis", "shadow_polygons")
    directions = _find_directions(sun)
    chosen = [
        read_texts(name, patterns) for name, patterns in (("cast", cast), ("no_cast", no_cast))
    ]
    if not isinstance(plane, Real) or not np.isfinite(plane):
        msg = f"the plane's height must be a finite number; got {show_value(plane)}"
        raise InputError(msg, option="plane")
    check_reach("heights of the plane", np.array([plane], np.float64), "give plane= in metres")
    shapes = _outline(scene, scene.select(*chosen), directions, float(plane))
    if scene.crs is None or find_spec("geopandas") is None:
        is_one = isinstance(sun, Light) or (not isinstance(sun, SunPath) and np.ndim(sun) == 1)
        return shapes[0] if is_one else shapes
    import geopandas  # noqa: PLC0415

    values = {"area_m2": [shape.area for shape in shapes]}
    if isinstance(sun, SunPath):
        values |= {"sun_altitude": sun.altitude.tolist(), "sun_azimuth": sun.azimuth.tolist()}
    return geopandas.GeoDataFrame(values, geometry=shapes, crs=scene.crs)


def _find_directions(sun: Light | SunPath | ArrayLike) -> NDArray[np.float64]:
    """Return unit vectors toward the light, (n, 3), all above the horizon."""
    given: Any = sun
    if isinstance(sun, SunPath):
        given = sun.direction
    elif isinstance(sun, Light):
        given = sun.position
    is_one = isinstance(given, (list, tuple, np.ndarray)) and all(map(np.isscalar, given))
    vectors = check_lights([given] if is_one else given, "sun")
    if vectors[:, 3].any():
        msg = "shadow_polygons takes directions; a lamp at a place has w = 1 (umbra.count takes it)"
        raise InputError(msg, option="sun")
    low = np.flatnonzero(vectors[:, 2] <= 0)
    if len(low):
        msg = f"{len(low)} directions come from below the horizon (first: row {low[0]}); leave out"
        raise InputError(msg + " what is not up", option="sun", row=int(low[0]))
    return vectors[:, :3]


def _outline(scene: Scene, parts: list[int], suns: NDArray[np.float64], plane: float) -> list[Any]:
    """Return a MultiPolygon for each direction, in the model's own coordinates."""
    import shapely  # noqa: PLC0415

    from umbra.cpu.plane import PlaneSweep  # noqa: PLC0415
    from umbra.writers.vectors import join_polygons  # noqa: PLC0415
    from umbra.writers.vectors.outlines import resolve_shadow  # noqa: PLC0415

    caster = prepare_casting(scene, parts, 1).caster
    height = plane - scene.origin[2]
    corners = caster.vertices[caster.faces.ravel()]
    low, high = corners.min(0), corners.max(0)
    if high[2] <= height:
        return [shapely.MultiPolygon() for _ in suns]
    dx, dy = (np.maximum(high[:2] - low[:2], 1e-3) / _CELLS).tolist()
    grid = Grid(float(low[0]) + dx / 2, float(low[1]) + dy / 2, dx, dy, _CELLS, _CELLS)
    cut = PlaneSweep(caster, grid, height).caster
    reach = np.abs(suns[:, :2] / suns[:, 2:]).max(0) * (high[2] - height) + _MARGIN
    box = (low[:2] - reach, high[:2] + reach)
    shift = scene.origin[:2]
    return [
        join_polygons(
            [[ring + shift for ring in rings] for rings in resolve_shadow(cut, sun, height, box)]
        )
        for sun in suns
    ]
