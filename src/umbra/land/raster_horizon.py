"""The horizon of a place, from a raster of the land's heights up to 100 km away."""

import hashlib
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, make_printable
from umbra.land.eye_rays import LandView, LandWork, Step
from umbra.land.rays import Eye
from umbra.lights import Horizon, LandRaster
from umbra.packages import require
from umbra.readers.child import ChildLimits, ReadingChild

__all__ = ["REACH", "REFRACTION", "find_horizon"]

REACH = 100_000.0
"""Land farther away does not count [m]."""
REFRACTION = 0.13
"""Coefficient of terrestrial refraction, Gauss' mean by day: light is bent to a circle of 1 / 0.13
of the earth's radius."""
_AZIMUTHS, _OTHERS = 3600, 360  # of the site, and of the places that tell how it differs
_MEMORY = 800e6  # of the child [byte]
_SECONDS = 120.0, 1200.0  # processor time of the child, of a block and in all [s]
_FAR = 0.999  # of the reach: what the raster holds whole


def find_horizon(
    raster: LandRaster, longitude: float, latitude: float, radius: float, top: float, *,
    nearest: float | None = None, refraction: float = REFRACTION,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> Horizon:  # fmt: skip
    """
    Find the horizon of the middle of a model.

    A place of height h at distance s is seen at the elevation of ((R + h) cos(s/R) - (R + e)) over
    (R + h) sin(s/R), e the eye's height and R the earth's radius (Euler's, of WGS 84) by
    1 / (1 - k): the land sinks by s^2 / 2R.

    Parameters
    ----------
    raster : LandRaster
    longitude, latitude : float
        Of the middle of the model, where the eye stands on the land [degrees].
    radius, top : float
        Of the model's plan, and its height [m].
    nearest : float, optional
        Distance from which the land counts, ``radius`` by default [m].
    refraction : float
        Coefficient k.
    progress : callable
        Called with the number of blocks read, and of all.

    Returns
    -------
    horizon : Horizon
        ``told`` says what was read, and by how much the horizon differs at the model's edge and
        top.

    Raises
    ------
    InputError
        If the file cannot be read, says no reference system or unit, holds values that no land has,
        or lies elsewhere.
    """
    start = radius if nearest is None else nearest
    path = raster.path.absolute()
    status = path.stat()
    key = (
        str(path), status.st_mtime_ns, status.st_size, longitude, latitude, radius, top, start,
        refraction,
    )  # fmt: skip
    if key not in _known:
        aside = [(radius, 0.0), (0.0, radius), (-radius, 0.0), (0.0, -radius)]
        eyes = (
            Eye(0.0, 0.0, 0.0, _AZIMUTHS),
            *(Eye(east, north, 0.0, _OTHERS) for east, north in aside),
            Eye(0.0, 0.0, top, _OTHERS),
        )
        work = LandWork(str(path), longitude, latitude, start, REACH, refraction, eyes)
        view = _view(raster.path, work, progress)
        _known.clear()  # one place at a time
        _known[key] = _make_horizon(raster.path, work, view, is_given=nearest is not None)
    return _known[key]


_known: dict[tuple[object, ...], Horizon] = {}


def _view(path: Path, work: LandWork, progress: Callable[[int, int], object]) -> LandView:
    """View the land in a child."""
    require(["rasterio"], "gis", "GeoTIFF")
    child = ReadingChild("umbra.land.eye_rays:view_land", work, ChildLimits(*_SECONDS, _MEMORY))
    view = None
    try:
        for piece in child:
            if isinstance(piece, Step):
                progress(piece.done, piece.whole)
            else:
                view = piece
        if view is None or not child.is_done:
            early = child.make_error("a raster", "export it again as GeoTIFF")
            raise early
    except InputError as error:
        msg = f"horizon {path}: {error}"
        raise InputError(msg, **{**error.data, "option": "horizon"}) from None
    return view


def _make_horizon(path: Path, work: LandWork, view: LandView, *, is_given: bool) -> Horizon:
    """Return the horizon of what is seen, with what there is to say of it."""
    is_first = view.eye == 0
    if not (view.seen[is_first] > 0).any():
        msg = (
            f"nothing of {make_printable(path.name)} is {work.nearest:,.0f} m from the model or "
            "farther; give a smaller horizon_from=, or a raster that reaches farther"
        )
        raise InputError(msg, option="horizon_from")
    elevation = np.maximum(view.elevation[is_first], 0.0)
    distance = np.where(elevation > 0, view.distance[is_first], 0.0)
    azimuth = np.arange(_AZIMUTHS) * 360.0 / _AZIMUTHS
    edge = np.concatenate([np.column_stack([azimuth, elevation, distance]), view.peaks])
    azimuth, elevation, distance = edge[np.argsort(edge[:, 0], kind="stable")].T.copy()
    notes = _tell(path, work, view, edge[np.argmax(edge[:, 1])], is_given=is_given)
    name = make_printable(path.name)
    digest = hashlib.sha256(elevation.tobytes()).hexdigest()
    return Horizon(name, digest, azimuth, elevation, distance, notes)


def _tell(
    path: Path, work: LandWork, view: LandView, top: NDArray[np.float64], *, is_given: bool
) -> tuple[str, ...]:
    """Say what was read, its highest (azimuth, elevation, distance), and how it differs about."""
    seen = view.seen[view.eye == 0] / 1000.0
    size = " x ".join(f"{side:.3g}" for side in view.cell)
    least, most = float(seen.min()), float(seen.max())
    reach = f"{least:.3g} to {most:.3g} km" if most - least > 0.01 * most else f"{most:.3g} km"
    why = "as asked" if is_given else "what is nearer is the model's: horizon_from= changes that"
    highest = (
        f"highest {top[1]:.2f} degrees at azimuth {top[0]:.1f}, {top[2] / 1000.0:.3g} km away"
        if top[1] > 0
        else "nowhere above the horizon"
    )
    notes = [(
        f"land of {make_printable(path.name)}: {view.columns:,} x {view.rows:,} cells of {size} m "
        f"({view.crs}), from {work.nearest:,.0f} m ({why}) to {reach}; {highest}; seen from the "
        f"ground at {view.heights[0]:.1f} m, refraction {work.refraction:g}"
    )]  # fmt: skip
    if view.missing > 0:
        notes.append(
            f"{100 * view.missing:.2g} % of the land within reach has no height in the file, and "
            "casts no shadow"
        )
    if view.thinned > 1:
        notes.append(
            f"far cells were thinned by overviews, up to {view.thinned} times: 0.01 degrees where "
            "the skyline is a slope of 45, and lone peaks as low as their overviews have them"
        )
    differs = _tell_differences(work, view)
    return (*notes, *view.notes, *([differs] if differs else []))


def _tell_differences(work: LandWork, view: LandView) -> str:
    """Say how the horizon differs at the edge of the model, and at its top."""
    same = np.maximum(view.elevation[view.eye == 0], 0.0)[:: _AZIMUTHS // _OTHERS]
    gaps = [
        np.abs(np.maximum(view.elevation[view.eye == n], 0.0) - same)
        for n in range(1, len(work.eyes))
        if math.isfinite(view.heights[n])
    ]
    if not gaps:
        return ""
    *edges, top = gaps
    parts = []
    if edges:
        worst, mean = max(float(gap.max()) for gap in edges), float(np.mean(edges))
        away = f"{work.eyes[1].east:,.0f} m from its middle"
        parts.append(f"{away} it differs by up to {worst:.2g} degrees, {mean:.2g} in the mean")
    if work.eyes[-1].height > 0:
        parts.append(f"at its top by up to {float(top.max()):.2g}")
    return "the horizon is that of the model's middle; " + ", ".join(parts) if parts else ""
