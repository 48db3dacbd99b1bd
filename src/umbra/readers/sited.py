"""
Layers without a CRS that are placed by the site that their file states.

The coordinate reference system that a caller names for files that name none.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from umbra.errors import InputError, show_value
from umbra.readers.apart import BESIDE, FilePlan, find_offset, find_site_among
from umbra.readers.georeference import find_on_plan, is_known_crs, name_crs, show_crs
from umbra.readers.model import APART, NO_CRS, FileModel
from umbra.readers.placing import Placing

__all__ = ["assume_crs", "check_crs", "find_by_site", "leave_crs", "tell_unused_crs"]

_SHARED = 50.0  # files whose sites lie as near have the coordinates of one project [m]
_STEP = 0.005  # half of a northward way [degrees], 1 km in all, of which the azimuth is taken


def find_by_site(
    layer: str,
    plan: FilePlan,
    others: Sequence[FilePlan],
    crs: str | None,
    first: FilePlan,
) -> Placing | None:
    """
    Find where the site of a file lies among others.

    Parameters
    ----------
    layer : str
    plan : FilePlan
        Of the file, as it is.
    others : sequence of FilePlan
    crs : str, optional
        Of the plan.
    first : FilePlan
        The first file that states a site and no CRS; others lie about it if none names a CRS.

    Returns
    -------
    placing : Placing or None
        None for a file that names a CRS, that lies among the others as it is, or whose site does
        not.
    """
    there = [other for other in others if other.crs is not None]
    if plan.crs is not None or plan.site is None:
        return None
    if not there or crs is None:
        return None if plan is first else _place_beside(layer, plan, first)
    low, high = (np.array([other.bounds[k] for other in there]) for k in (0, 1))
    gaps = np.maximum(np.maximum(low - plan.bounds[1], plan.bounds[0] - high), 0.0)
    if (np.hypot(*gaps.T) <= BESIDE).any():
        return None
    latitude, longitude = plan.site
    north = find_on_plan(crs, latitude + _STEP, longitude)
    south = find_on_plan(crs, latitude - _STEP, longitude)
    if find_site_among(plan, low, high, crs) is None or north is None or south is None:
        return None
    meridian = math.degrees(math.atan2(*(north - south)))
    fits = not plan.is_ellipsoidal or all(other.is_ellipsoidal for other in there)
    at = (*plan.site, plan.altitude) if plan.altitude is not None and fits else plan.site
    reason = f"the site that {plan.name} states"
    azimuth = meridian - plan.true_north
    return Placing(layer, at, azimuth, reason=reason)


def _place_beside(layer: str, plan: FilePlan, first: FilePlan) -> Placing | None:
    """Place a file by its site about the first file's, unless both have one project's plan."""
    assert plan.site is not None
    assert first.site is not None
    if any(abs(a - b) > APART for a, b in zip(plan.site, first.site, strict=True)):
        return None  # such sites are doubted
    east, north = find_offset(first.site, plan.site)
    turn = math.radians(first.true_north)
    x = east * math.cos(turn) + north * math.sin(turn)
    y = north * math.cos(turn) - east * math.sin(turn)
    between = plan.bounds.mean(0) - first.bounds.mean(0)
    if math.hypot(x, y) <= _SHARED or math.hypot(*(between - (x, y))) < math.hypot(*between):
        return None
    at: tuple[float, ...] = (x, y)
    if None not in (plan.altitude, first.altitude) and plan.is_ellipsoidal == first.is_ellipsoidal:
        at = (x, y, (plan.altitude or 0.0) - (first.altitude or 0.0))
    reason = f"the sites that {plan.name} and {first.name} state"
    return Placing(layer, at, first.true_north - plan.true_north, reason=reason)


def check_crs(crs: str | None) -> str | None:
    """Return the short name of a caller's CRS; refuse one that is not known."""
    if crs is None:
        return None
    named = name_crs(crs) if isinstance(crs, str) else None
    if named is None or not is_known_crs(named):
        msg = f"crs= is not known: {show_value(crs)}; write it as EPSG:28992"
        raise InputError(msg, option="crs")
    return named


def assume_crs(model: FileModel, crs: str | None) -> FileModel:
    """Return a file's model in the caller's CRS, unless it names its own."""
    if crs is None or model.crs is not None:
        return model
    notes = tuple(note for note in model.notes if not note.endswith(NO_CRS))
    return replace(model, crs=crs, notes=notes)


def leave_crs(model: FileModel) -> FileModel:
    """Return a file's model in its own coordinates, for one that the caller places."""
    notes = tuple(note for note in model.notes if not note.endswith(NO_CRS))
    return replace(model, crs=None, notes=notes)


def tell_unused_crs(own: list[str | None], crs: str | None) -> list[str]:
    """Report a caller's CRS that no file needs; ``own`` are the CRSs that the files name."""
    if crs is None or None in own:
        return []
    named = ", ".join(show_crs(name) for name in dict.fromkeys(own) if name)
    return [f"crs='{crs}' is for files that name none, and each names its own ({named})"]
