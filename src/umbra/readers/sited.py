"""
Layers without a CRS that are placed by the site that their file states.

The coordinate reference system that a caller names for files that name none.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from umbra.errors import InputError, show_value
from umbra.readers.apart import BESIDE, FilePlan, find_site_among
from umbra.readers.georeference import find_on_plan, is_known_crs, name_crs, show_crs
from umbra.readers.model import NO_CRS, FileModel, FilePlace
from umbra.readers.placing import Placing

__all__ = ["assume_crs", "check_crs", "find_by_site", "leave_crs", "tell_unused_crs"]

_STEP = 0.005  # half of a northward way [degrees], 1 km in all, of which the azimuth is taken


def find_by_site(
    layer: str, plan: FilePlan, place: FilePlace, others: Sequence[FilePlan], crs: str
) -> Placing | None:
    """
    Find where the site of a file lies among others.

    Parameters
    ----------
    layer : str
    plan : FilePlan
        Of the file, as it is.
    place : FilePlace
        That it states.
    others : sequence of FilePlan
    crs : str
        Of the plan.

    Returns
    -------
    placing : Placing or None
        None for a file that names a CRS, that lies among the others as it is, or whose site does
        not.
    """
    there = [other for other in others if other.crs is not None]
    if plan.crs is not None or not there:
        return None
    low, high = (np.array([other.bounds[k] for other in there]) for k in (0, 1))
    gaps = np.maximum(np.maximum(low - plan.bounds[1], plan.bounds[0] - high), 0.0)
    if (np.hypot(*gaps.T) <= BESIDE).any():
        return None
    found = find_site_among(plan, low, high, crs)
    if found is None or place.latitude is None or place.longitude is None:
        return None
    north = find_on_plan(crs, place.latitude + _STEP, place.longitude)
    south = find_on_plan(crs, place.latitude - _STEP, place.longitude)
    if north is None or south is None:
        return None
    meridian = math.degrees(math.atan2(*(north - south)))
    azimuth = meridian - (place.true_north or 0.0)
    reason = f"the site that {plan.name} states"
    return Placing(layer, (place.latitude, place.longitude), azimuth, reason=reason)


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
    named = ", ".join(show_crs(one) for one in dict.fromkeys(own) if one)
    return [f"crs='{crs}' is for files that name none, and each names its own ({named})"]
