"""Shadows on a level plane as exact polygons, for any directions."""

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.calls.counts import check_lights
from umbra.calls.inputs import check_scene
from umbra.casters.casting import prepare_casting
from umbra.errors import InputError
from umbra.scene import Light, Scene
from umbra.scene.exchange import import_package
from umbra.scene.grid import Grid
from umbra.sun.position import SunPath

__all__ = ["shadow_polygons"]

_CELLS = 1024  # on a side of the raster that looks for components wound inward
_MARGIN = 1.0  # [m] beside the longest shadow


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
        What casts; what lies below the plane does not.
    sun : Light, SunPath, (3,) or (n, 3) float
        Directions toward the light, above the horizon, of any length; `umbra.sun_light`
        and `umbra.find_sun` give them.
    plane : float
        Its z, in the model's own coordinates [m].
    cast, no_cast : str or sequence of str
        Shell patterns of the parts that cast, or do not.

    Returns
    -------
    polygons : geopandas.GeoDataFrame, or shapely.MultiPolygon, or a list of them
        Where geopandas is installed and the scene's CRS is known, a row for each direction:
        ``geometry``, ``area_m2`` and, of a `SunPath`, ``sun_altitude`` and ``sun_azimuth``
        [degrees]. Otherwise a MultiPolygon, of several directions a list. In the model's own
        coordinates [m].

    Raises
    ------
    InputError
        If a direction does not come from above the horizon, or shapely or pyclipr is not
        installed.

    Examples
    --------
    >>> sun = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    >>> umbra.shadow_polygons(scene, sun, plane=171.0).to_file("shadow.gpkg")
    """
    check_scene(scene)
    for package in ("shapely", "pyclipr"):
        import_package(package, "shadow_polygons")
    directions = _find_directions(sun)
    chosen = [(one,) if isinstance(one, str) else tuple(one) for one in (cast, no_cast)]
    if not np.isfinite(plane):
        msg = f"the plane's height must be a finite number; got {plane}"
        raise InputError(msg, option="plane")
    found = _outline(scene, scene.select(*chosen), directions, float(plane))
    if scene.crs is None or find_spec("geopandas") is None:
        is_one = isinstance(sun, Light) or (not isinstance(sun, SunPath) and np.ndim(sun) == 1)
        return found[0] if is_one else found
    import geopandas  # noqa: PLC0415

    values = {"area_m2": [shape.area for shape in found]}
    if isinstance(sun, SunPath):
        values |= {"sun_altitude": sun.altitude.tolist(), "sun_azimuth": sun.azimuth.tolist()}
    return geopandas.GeoDataFrame(values, geometry=found, crs=scene.crs)


def _find_directions(sun: Light | SunPath | ArrayLike) -> NDArray[np.float64]:
    """Give unit vectors toward the light, (n, 3), all above the horizon."""
    given: Any = sun
    if isinstance(sun, SunPath):
        given = sun.direction
    elif isinstance(sun, Light):
        given = sun.position
    vectors = check_lights(np.atleast_2d(given) if np.ndim(given) < 2 else given, "sun")
    if vectors[:, 3].any():
        msg = "shadow_polygons takes directions; a lamp at a place has w = 1 (umbra.count takes it)"
        raise InputError(msg, option="sun")
    low = np.flatnonzero(vectors[:, 2] <= 0)
    if len(low):
        msg = f"{len(low)} directions come from below the horizon (first: row {low[0]}); leave out"
        raise InputError(msg + " what is not up", option="sun", row=int(low[0]))
    return vectors[:, :3]


def _outline(scene: Scene, parts: list[int], suns: NDArray[np.float64], plane: float) -> list[Any]:
    """Give a MultiPolygon for each direction, in the model's own coordinates."""
    import shapely  # noqa: PLC0415

    from umbra.cpu.plane import PlaneSweep  # noqa: PLC0415
    from umbra.writers.vectors.layers import join_polygons  # noqa: PLC0415
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
            [[ring + shift for ring in one] for one in resolve_shadow(cut, sun, height, box)]
        )
        for sun in suns
    ]
