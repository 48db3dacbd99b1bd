"""``umbra.sky_view``: the sky above a place."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from umbra.errors import InputError, check_type
from umbra.land.named_land import NamedLand
from umbra.lights import Horizon
from umbra.receivers.points import check_points
from umbra.scene import Scene
from umbra.sky.casters import find_sky_casters
from umbra.sky.free_sky import ExactSky
from umbra.sky.land_curtain import add_land
from umbra.sun import Site, find_site, parse_dates
from umbra.sun.date_words import Date

__all__ = ["SkyView", "find_known_site", "find_land", "sky_view", "view_skies"]


class SkyView(ExactSky):
    """The sky above a place, which can be drawn; see `umbra.sky.free_sky.ExactSky`."""

    def plot(self, projection: str = "stereographic", dates: Date | Sequence[Date] = ()) -> Any:
        """
        Draw the sky: what obstructs it, and the paths of the sun.

        Parameters
        ----------
        projection : {"stereographic", "equidistant", "orthographic", "waldram"}
        dates : str, date, or several
            Paths of the sun on local dates, which need a site.

        Returns
        -------
        picture : PaperPicture
            With ``save(path)`` as PNG, SVG or PDF.
        """
        from umbra.writers.sky_pictures import draw_sky  # noqa: PLC0415

        return draw_sky(self, projection, parse_dates(dates) if dates else ())


def sky_view(
    scene: Scene,
    point: ArrayLike,
    normal: ArrayLike | None = None,
    site: Site | None = None,
    *,
    cast: Sequence[str] = (),
    no_cast: Sequence[str] = (),
    horizon: Any = None,
    horizon_from: float | None = None,
) -> SkyView:
    """
    Find the sky that a point sees, exactly: by its outlines, without a ray or a patch.

    Parameters
    ----------
    scene : Scene
    point : (3,) float
        In the model's own coordinates [m].
    normal : (3,) float, optional
        Of the plane that is judged, of any length; level and looking up by default.
    site : Site, optional
        For the sun, and for true north; by default the file's, if it says one.
    cast, no_cast : sequences of str
        Shell patterns of the parts that obstruct, and of those that do not; all do by default.
    horizon : path or pandas.Series, optional
        Land far away, as ``umbra.shadow_study`` takes it: it obstructs as an object ``land``.
    horizon_from : float, optional
        Distance from which the land of a raster counts [m].

    Returns
    -------
    view : SkyView

    Raises
    ------
    InputError
        If the point or the normal are not three finite numbers, or a pattern matches no part.

    Examples
    --------
    >>> view = umbra.sky_view(umbra.read("town.obj"), (3, 4, 1.6), (0, -1, 0))  # doctest: +SKIP
    >>> view.sky_component  # doctest: +SKIP
    27.31
    """
    check_type("scene", scene, Scene)
    position = np.asarray(point, np.float64).ravel()
    toward = np.array([0.0, 0.0, 1.0] if normal is None else normal, np.float64).ravel()
    if position.shape != (3,) or toward.shape != (3,):
        msg = "a point and its normal are three numbers each, such as point=(3, 4, 1.6)"
        raise InputError(msg, point=point)
    known = find_known_site(scene) if site is None else site
    land = find_land(scene, known, horizon, horizon_from)
    return view_skies(scene, np.hstack([position, toward])[None], known, cast, no_cast, land)[0]


def view_skies(
    scene: Scene,
    points: ArrayLike,
    site: Site | None = None,
    cast: Sequence[str] = (),
    no_cast: Sequence[str] = (),
    land: Horizon | None = None,
) -> list[SkyView]:
    """Find the skies of several points, (n, 3) or with normals (n, 6), as ``sky_view``."""
    given = check_points(points)
    if given.shape[1] == 3:
        given = np.hstack([given, np.tile([0.0, 0.0, 1.0], (len(given), 1))])
    parts = scene.select(cast, no_cast)
    whole, around = add_land(scene, land, 0.0 if site is None else site.true_north)
    casters, names = find_sky_casters(whole, [*parts, *around])
    first = SkyView(casters, names, given[0, :3], given[0, 3:], given[0, :3], site)
    return [
        replace(first, local=row[:3] - scene.origin, normal=row[3:].copy(), point=row[:3].copy())
        for row in given
    ]


def find_land(
    scene: Scene, site: Site | None, horizon: Any, horizon_from: float | None
) -> Horizon | None:
    """Read the land around a model; tell what a raster is read as."""
    land = NamedLand.of(horizon, horizon_from).settle(scene.model_bounds(), site)
    for line in () if land is None else land.told:
        warnings.warn(line, stacklevel=3)
    return land


def find_known_site(scene: Scene) -> Site | None:
    """Return the file's site, or None where it says none."""
    if scene.latitude is None or scene.longitude is None:
        return None
    return find_site(scene)
