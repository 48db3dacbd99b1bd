"""Layers without a CRS that are placed by the site that their file states."""

import math
from collections.abc import Sequence

import numpy as np

from umbra.readers.apart import BESIDE, FilePlan, find_site_among
from umbra.readers.georeference import find_on_plan
from umbra.readers.model import FilePlace
from umbra.readers.placing import Placing

__all__ = ["find_by_site"]

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
