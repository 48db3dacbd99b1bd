"""Picture of the sun lost to a proposal: hours lost, hatched where too few are left."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import Preview, split_dates, tell_dates
from umbra.study.preview import LONGEST
from umbra.writers.folder.captions import list_few
from umbra.writers.folder.dates import (
    choose_panels,
    find_together,
    name_shown,
    tell_daylight,
)
from umbra.writers.folder.outputs import FolderJob
from umbra.writers.plan import DayMap, Plan, find_map_size
from umbra.writers.raster import HALF, resample

__all__ = ["draw_lost"]

_MATTERS = 0.5  # so much lost is in the picture, however far it is [h]


def draw_lost(job: FolderJob, plan: Plan, preview: Preview) -> list[str]:
    """
    Draw the hours lost to the proposal, cropped to them, with the proposal outlined.

    Parameters
    ----------
    job : FolderJob
    plan : Plan
        Of the hours.
    preview : Preview

    Returns
    -------
    names : list of str
        Of the file; empty where nothing is lost.
    """
    study, options, painter = job.study, job.options, job.painter
    dates = split_dates(study)
    every = [_fit(one.more["hours_lost"][1], plan.shape) for one in dates]
    most = np.nan_to_num(every).max(0)
    if not most.max() > 0:
        return []
    new = np.isin(preview.find_parts(), list(job.scene.select(options.proposed)))
    plan = replace(plan, proposed=new)
    where: Any = ...
    if study.kind.is_plan and options.extent is None:
        newly = _fit_mask(study.more["newly_under"][1], most.shape)
        where = _find_window((most >= min(_MATTERS, most.max() / 4)) | newly | new)
        plan = plan.crop(where)
        if plan.appearance is not None:
            from umbra.writers.edges import find_appearance  # noqa: PLC0415

            part = study.grid.coarser(LONGEST).part(*where)
            plan = replace(plan, appearance=find_appearance(study, find_map_size(plan), part))
    what = f"hours of sun lost to {list_few(options.proposed)}"
    limit = f"newly under {study.facts['under_hours']:g} h"
    path = job.folder / "hours_lost.png"
    if len(dates) == 1:
        divisor, words = find_together(job)
        if words:
            limit += f" on at least one of {len(study.period.days)} dates"
        area = _tell_area(study.more["neighbour_area_newly_under"][1])
        hours = every[0][where] / divisor
        painter.draw_hours(
            path, plan, hours, float(np.nanmax(hours)), what=what + words,
            hatched=_fit_mask(study.more["newly_under"][1], most.shape)[where],
            hatch=f"{limit}: {area}",
        )  # fmt: skip
        return [path.name]
    maps = []
    for one, hours in ((dates[k], every[k][where]) for k in choose_panels(study)):
        area = _tell_area(one.more["neighbour_area_newly_under"][1])
        hatched = _fit_mask(one.more["newly_under"][1], most.shape)[where]
        told = f"{tell_daylight(one)} · {limit}: {area}"
        maps.append(DayMap(tell_dates(one), told, hours, hatched))
    painter.draw_hour_panels(
        path,
        name_shown(plan, study),
        maps,
        float(most.max()),
        what=what,
        hatch=limit,
    )
    return [path.name]


def _tell_area(areas: NDArray[np.float64]) -> str:
    """Describe the area of all neighbours together."""
    area = float(areas.sum())
    return "nowhere" if area == 0 else f"{area:,.0f} m²" if area >= 10 else f"{area:.2g} m²"


def _fit(hours: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Average hours to the cells of the pictures."""
    return hours if hours.shape == shape else resample(hours, shape)


def _fit_mask(mask: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.bool_]:
    return _fit(mask.astype(np.float32), shape) > HALF


def _find_window(is_shown: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Return the window around some cells, with a margin of a quarter of its length."""
    window = []
    room = round(0.25 * max(np.ptp(np.flatnonzero(is_shown.any(axis))) for axis in (0, 1))) + 1
    for axis in (1, 0):
        found = np.flatnonzero(is_shown.any(axis))
        end = min(int(found[-1]) + 1 + room, is_shown.shape[1 - axis])
        window.append(slice(max(int(found[0]) - room, 0), end))
    return window[0], window[1]
