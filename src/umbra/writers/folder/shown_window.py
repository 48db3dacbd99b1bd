"""
The part of a plan that a picture shows: what matters, with whole gardens and whole buildings.

Pictures of what a proposal takes show where it takes it; those of hours, shadows of half an hour
and more and the ground that shares are of.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study
from umbra.study.finer import LONGEST
from umbra.writers.folder import FolderJob
from umbra.writers.picture_content import Plan, find_map_size
from umbra.writers.pixels import HALF, resample

__all__ = ["CROPPED", "crop_dates", "crop_plan", "find_lasting", "find_shown_window"]

CROPPED = "cropped to shadows of half an hour and more"
"""Words of a picture that is."""
_LASTS = 0.5  # shadow that maps must include, at any distance [h]
_SPARES = 0.1  # least share of a plan whose loss makes its maps larger
_SMALL_ROOM = 0.05  # around it on small maps, of its length


def crop_plan(study: Study, plan: Plan, where: tuple[slice, slice]) -> Plan:
    """Return a window of a plan of the pictures' cells, with the appearance of its surfaces."""
    plan = plan.crop(where)
    if plan.appearance is None:
        return plan
    from umbra.writers.edges import find_grid_appearance  # noqa: PLC0415

    part = study.grid.coarser(LONGEST).part(*where)
    return replace(plan, appearance=find_grid_appearance(study, find_map_size(plan), part))


def crop_dates(
    job: FolderJob,
    plan: Plan,
    maps: Sequence[NDArray[np.float32]],
    shadow_hours: Sequence[NDArray[np.floating]],
) -> tuple[Plan, list[NDArray[np.float32]]]:
    """
    Crop the maps of dates or months to one window.

    A chosen rectangle or an elevation is shown whole.

    Parameters
    ----------
    job : FolderJob
    plan : Plan
    maps : sequence of (rows, cols) float32
        In the plan's cells.
    shadow_hours : sequence of (rows, cols) float
        Of each, those of the land around left out.

    Returns
    -------
    plan : Plan
        Its note says so where something is left out.
    maps : list of (rows, cols) float32
    """
    where = find_lasting(job, plan, shadow_hours)
    if where is None:
        return plan, list(maps)
    cropped = replace(crop_plan(job.study, plan, where), note=f"{plan.note} · {CROPPED}")
    return cropped, [hours[where] for hours in maps]


def find_lasting(
    job: FolderJob, plan: Plan, shadow_hours: Sequence[NDArray[np.floating]]
) -> tuple[slice, slice] | None:
    """
    Find the window of lasting shadows; of one date, also of the ground that shares are of.

    Parameters as in ``crop_dates``. None where the plan is shown whole.
    """
    study = job.study
    if not study.kind.is_plan or job.options.extent is not None:
        return None
    held = study.laid.is_built
    counted = study.kind.find_counted(study) if len(shadow_hours) == 1 else None
    held = held if counted is None else held | counted.which
    matters = resample(held.astype(np.float32), plan.shape) > HALF
    for hours in shadow_hours:
        matters |= np.nan_to_num(hours) >= _LASTS
    if not matters.any():
        return None
    where = find_shown_window(matters, plan, _SMALL_ROOM)
    kept = math.prod(part.stop - part.start for part in where)
    return where if kept <= (1 - _SPARES) * math.prod(plan.shape) else None


_ROOM = 0.25  # margin around what matters, of its length, by default
_REACH = 0.15  # by which a whole building may widen the window, of its length
_EDGE = 0.1  # beyond a building, of that


def find_shown_window(
    matters: NDArray[np.bool_], plan: Plan, room: float = _ROOM
) -> tuple[slice, slice]:
    """
    Find the window around some cells of a plan: all named areas, and no building cut a little.

    Parameters
    ----------
    matters : (rows, cols) bool
        At least one cell.
    plan : Plan
    room : float
        Margin around them, of their length.

    Returns
    -------
    rows, cols : slice
        Buildings that reach into it are shown whole
        where that makes it little wider.
    """
    from scipy.ndimage import find_objects, label  # noqa: PLC0415  (half a second)

    spans = [np.flatnonzero(matters.any(axis))[[0, -1]] + (0, 1) for axis in (1, 0)]
    for area in plan.areas:
        corners = np.concatenate(area.rings)
        for k, cells in ((0, plan.y), (1, plan.x)):
            own = np.searchsorted(cells, (corners[:, 1 - k].min(), corners[:, 1 - k].max()))
            spans[k] = np.array([min(spans[k][0], own[0]), max(spans[k][1], own[1] + 1)])
    edges = round(room * max(float(np.ptp(span)) for span in spans)) + 1
    spans = [span + (-edges, edges) for span in spans]
    reach = round(_REACH * max(float(np.ptp(span)) for span in spans))
    edge = round(_EDGE * reach) + 1
    core = [span.copy() for span in spans]
    for found in find_objects(label(plan.is_building)[0]):
        ends = [np.array([part.start - edge, part.stop + edge]) for part in found]
        meets = all(a < span[1] and b > span[0] for (a, b), span in zip(ends, core, strict=True))
        near = all(
            a >= span[0] - reach and b <= span[1] + reach
            for (a, b), span in zip(ends, core, strict=True)
        )
        if meets and near:
            spans = [np.array([min(span[0], own[0]), max(span[1], own[1])])
                     for own, span in zip(ends, spans, strict=True)]  # fmt: skip
    rows, cols = (
        slice(max(int(a), 0), min(int(b), count))
        for (a, b), count in zip(spans, matters.shape, strict=True)
    )
    return rows, cols
