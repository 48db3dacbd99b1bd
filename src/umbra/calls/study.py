"""``umbra.shadow_study``: hours of shadow on a plan, in a view, on surfaces or at points."""

from __future__ import annotations

import datetime as dt
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from numpy.typing import ArrayLike

from umbra.calls.chunked import ChunkedStudy, Chunks
from umbra.calls.result import ShadowStudy
from umbra.errors import InputError, check_type
from umbra.scene import Scene
from umbra.study.land import settle_land
from umbra.study.options import StudyOptions
from umbra.study.remarks import tell_request
from umbra.study.study import check_names, run
from umbra.study.time_options import Clock, Date, Refraction
from umbra.sun import Site
from umbra.sun.site import tell_moved

__all__ = ["shadow_study"]


@check_names
def shadow_study(  # noqa: PLR0913  (each option by its name)
    scene: Scene,
    site: Site | None = None,
    *,
    date: Date | Sequence[Date] | None = None,
    start: str | dt.time = "09:00",
    end: str | dt.time = "17:00",
    clock: Clock = "local",
    every: str | dt.timedelta = "15min",
    every_days: int = 1,
    by_day: bool | None = None,
    refraction: Refraction = "standard",
    horizon: Any = None,
    horizon_from: float | str | None = None,
    measure: str | Sequence[str] = (),
    sky_directions: int | str = 4096,
    weather: str | Path | None = None,
    albedo: float = 0.2,
    sunshine: str | Path | Sequence[float] | None = None,
    receivers: str = "auto",
    spacing: float | str = 0.5,
    on: str | Sequence[str] = (),
    points: ArrayLike | str | Path | None = None,
    names: Sequence[str] = (),
    eye: Sequence[float] | None = None,
    target: Sequence[float] | None = None,
    fov: float = 50.0,
    ground: float | str | Path | None = None,
    windows: str | Path | Sequence[Any] | None = None,
    judge: Literal["centre", "sill", "pane"] = "centre",
    reveal: str | float | None = None,
    areas: Any = None,
    areas_on: str = "ground",
    least: str | float | dt.timedelta = "2h",
    extent: Sequence[float] | None = None,
    cell: float | str | None = None,
    size: Sequence[int] | None = None,
    cast: str | Sequence[str] = (),
    no_cast: str | Sequence[str] = (),
    canopy: str | Sequence[str] = (),
    transmissivity: str | float | Sequence[float] | None = None,
    leaf_on: str | None = None,
    by: Literal["part", "kind", "layer"] | None = None,
    who: str | Sequence[str] = (),
    proposed: str | Sequence[str] = (),
    replace: str | Sequence[str] = (),
    replace_in: Any = None,
    under: str | float | dt.timedelta | None = None,
    spells: bool = False,
    exact: bool | float = False,
    min_spell: str | dt.timedelta | None = None,
    disc: bool = False,
    masks: bool = False,
    device: str = "auto",
    threads: int | None = None,
    chunks: Chunks | None = None,
) -> ShadowStudy:
    """
    Measure the sun and the sky of every receiver: by default hours over one or more dates.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    site : Site, optional
        Latitude, longitude, time zone and true north; needed by measures of the sun.
    date : str, date, datetime64, Timestamp, or a sequence of them, optional
        Needed by measures of the sun.
        Local date, ``"2026-09-18"``; or several: separated by commas, a range
        ``"2026-03-21..2026-09-23"``, a month ``"2026-06"``, a year ``"2026"``, a day of
        every month ``"2026-*-21"``, ``"2026-winter-solstice"``, ``"2026-great-cold"``.
    every_days : int
        Take every n-th day of a range, a month or a year.
    by_day : bool, optional
        Also return results for each date, along ``day``; by default up to 12 dates.
    start, end : str
        Clock times, ``"09:00"`` and ``"17:00"`` by default; or times of the sun: ``"sunrise+1h"``,
        ``"sunset-1h"`` (of its upper rim), ``"altitude:10"`` (of its middle).
    clock : {'local', 'standard', 'solar'}
        By which they are read: the local clock, the same without daylight saving time, or true
        solar time.
    every : str
        Step, ``"15min"`` by default.
    spells : bool
        Also find first and last sun, the number of sun intervals, the longest and
        the shaded share of the time with the sun up.
    min_spell : str, optional
        Also the hours in sun intervals of at least this length, ``"30min"``; implies ``spells``.
    exact : bool or float
        Solve the times at which each cell enters and leaves shadow, and sunrise and sunset,
        to a second (or N seconds) instead of adding up steps.
    disc : bool
        Weigh each step by the share of the sun's disc that is seen, instead of its middle alone,
        and find its first and last contact, to a second.
    who : sequence of str
        Shell patterns of parts: find the hours due to each pattern's parts.
    by : {'part', 'kind', 'layer'}, optional
        Find the hours due to each part, kind or layer, of all or of those in ``who``.
    proposed : sequence of str
        Shell patterns of the proposed parts: find the sun that they take from the others.
    replace : sequence of str
        Shell patterns of what the proposal replaces: it stands before, and is gone after; where
        it stood there was no receiver before. Ground and terrain stay.
    replace_in : path or polygons, optional
        The plot, a file as of ``areas`` or shapely's polygons in the model's own coordinates:
        objects with at least half of their plan in it are replaced.
    under : str or float
        Find where ``proposed`` reduces the hours of sun below this limit.
    horizon : path or pandas.Series, optional
        The land up to 100 km away, the same from every receiver: a raster of heights (GeoTIFF in
        any reference system), seen from the ground at the model's middle; or a table
        ``azimuth,elevation`` from true north clockwise, PVGIS' horizon profile (text or JSON), or
        bare elevations as ``umbra sky --write horizon`` writes them [degrees]; or elevations by
        azimuth as ``pvlib.iotools.get_pvgis_horizon`` returns them. Suns and directions of the sky
        below it reach no receiver.
    horizon_from : float, optional
        Distance from which the land of a raster counts; what is nearer is the model's. By default
        as far as the model reaches from its middle [m].
    measure : str or sequence of str
        What is measured: ``'sun_hours'`` and ``'shadow_hours'`` (default), ``'sky_view_factor'``,
        ``'sky_component'``; of a year of suns ``'probable_sun_hours'`` with both shares
        (``'probable_sun_share'``, ``'winter_probable_sun_share'``); of ``weather``
        ``'sunshine_hours'`` and ``'irradiation'`` with its sources (``'irradiation_beam'``,
        ``'irradiation_sky'``, ``'irradiation_ground'``); or one of a package installed beside
        umbra. Each is a variable.
    sky_directions : int or str
        Number of directions of the sky, spread evenly; or ``'tregenza'``, ``'reinhart2'``,
        ``'reinhart4'``.
    weather : path, optional
        A year of weather by hours: EPW, TMY3 or PVGIS' typical year. Without a date its whole
        year counts, by its own standard time.
    albedo : float
        Share of the light that the ground reflects.
    sunshine : path or (12,) float, optional
        Probability that the sun shines, by month; 1 by default.
    receivers : str
        ``'auto'`` (default): ``'top'`` if the model has its own ground and no ``ground`` is
        given, else ``'ground'``.
        ``'ground'``, the ground alone, without roofs; ``'top'``, the topmost surface of the plan;
        an elevation from ``'north'``, ``'east'``, ``'south'``, ``'west'`` or an azimuth such
        as ``'217'``; a view from above, ``'215/35'``; ``'camera'``; ``'surfaces'``;
        ``'points'``; ``'windows'``; ``'areas'``.
    eye, target : (3,) float, optional
        Of the camera [m]; ``fov`` is its vertical field of view [degrees].
    spacing : float
        Distance between the samples of surfaces, 0.5 by default [m]. Lengths may be text with
        a unit, here and below: ``"50cm"``, ``"30 ft"``.
    on : sequence of str
        Shell patterns of the parts to sample, or to show in an elevation or camera view; all
        by default.
    points : (n, 3) or (n, 6) float, or path, optional
        Receivers 'points', with or without normals [m]; or a table of them.
    names : sequence of str
        Names of the points.
    ground : float, str or path, optional
        ``'feet'``: a surface through the feet of the buildings; ``'level'``: a plane at their
        median; z of a plane [m]; or a terrain file. By default what the file states or brings,
        else ``'feet'`` where they differ by more than 3 m, else ``'level'``. Attributes
        ``ground`` and ``assumption`` state it.
    windows : path, optional
        Receivers 'windows': a table with the columns name, x, y, z (the middle of the pane's outer
        face), azimuth, width, height and, if known, tilt, sill, reveal, flat, room [m, degrees
        clockwise from true north]; by default the model's own. ``study.windows`` is their result.
    judge : {'centre', 'sill', 'pane'}
        Where windows are judged; a whole pane by the share of it in the sun.
    reveal : float or 'none', optional
        Depth of panes behind the wall's outer face, where neither table nor model tells [m];
        ``'none'`` judges all on the outer face.
    areas : path, str, GeoDataFrame, mapping or sequence of Area, optional
        Named areas such as gardens, judged each on a lattice of its own besides the receivers: a
        file of polygons, a pattern of the model's parts or kinds, or polygons by name.
        ``study.areas`` is their table. ``receivers='areas'`` judges them alone.
    areas_on : str
        What areas are judged on: ``'ground'``, ``'top'``, or a plane above the ground
        (``'ground+1.5'``) or above the mean ground of each area (``'mean+4'``) [m].
    least : str or float
        Hours of sun on a date that the table's share of each area has at least: ``'2h'``.
    extent : (4,) float, optional
        xmin, ymin, xmax, ymax in the model's own coordinates [m]; the model and its
        shadows by default.
    cell : float, optional
        Side of a cell [m]; or ``size``, (columns, rows).
    cast, no_cast : sequences of str
        Shell patterns of the names or kinds of parts that cast, or do not.
    canopy : sequence of str
        Shell patterns of casters that weaken the light instead of blocking it, such as
        trees; they receive nothing.
    transmissivity : float, str or (float, float), optional
        Share of the light that they transmit, 0.03 by default; ``"0.03:0.5"`` with and
        without leaves.
    leaf_on : str, optional
        Season with leaves, both dates included: ``"04-15..10-31"``.
    masks : bool
        Keep every instant as ``in_shadow``.
    refraction : {'standard', 'none'}
        The sun's apparent position (default), or its position without air.
    device : {'auto', 'cpu', 'gl'}, or one of a package
        Device that counts; ``'auto'`` takes a GPU if it proves faster on large plans. What it
        cannot count, the CPU does, with a warning.
    threads : int, optional
        All cores by default; results do not depend on it.
    chunks : int, (int, int), dict or 'auto', optional
        Sides of chunks of a plan [cell]: nothing is counted yet, and ``study.dataset`` holds
        Dask arrays. Computing a part of them counts its chunks, with the same values, on the
        active ``dask.distributed.Client``, else on this machine; each chunk on one thread
        unless ``threads`` says otherwise. A client that is active now receives the scene.

    Returns
    -------
    study : ShadowStudy
        ``study.shadow_hours`` and ``study.sun_hours`` [h] and all other variables of
        ``study.dataset``, which is made on first use; pictures, a report, files
        and verdicts.

    Raises
    ------
    InputError
        If an option is wrong, a pattern matches no part, or the raster is too large.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> site = umbra.find_site(scene)
    >>> study = umbra.shadow_study(scene, site, date="2026-03-21", receivers="top", cell=0.5)
    >>> study.plot()
    >>> study.write("out/", "geotiff", report=True)
    >>> study.sun_hours.sel(x=2705, y=340092, method="nearest")
    """
    own = {"scene", "site", "chunks"}
    given = {name: value for name, value in locals().items() if name not in {*own, "own"}}
    check_type("scene", scene, Scene)
    if site is not None:
        check_type("site", site, Site)
    options = StudyOptions(**given)
    options = settle_land(options, scene.model_bounds(), site)
    moved = () if site is None else tell_moved(scene, site)
    for note in (*moved, *tell_request(scene, options, site)):
        warnings.warn(note, stacklevel=2)
    if chunks is not None:
        if site is None or options.measures or options.areas is not None:
            msg = (
                "chunks= count hours of sun alone, with a site; leave measure=, areas= or chunks= "
                "out"
            )
            raise InputError(msg, option="chunks")
        return ChunkedStudy(scene, site, options, chunks)
    study = run(scene, site, options)
    if "device_note" in study.facts:
        warnings.warn(str(study.facts["device_note"]), stacklevel=2)
    return ShadowStudy(study, options)
