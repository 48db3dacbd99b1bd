"""
The map of the sun that a proposal takes, and the maps of dates that it shares with other pictures.

Hours lost are hatched where too few are left.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import select_replaced
from umbra.study import FinerHours, Preview, Study, count_finer, name_dates, split_dates
from umbra.sun.clock import say_hours
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import (
    choose_panels,
    find_maps,
    find_together,
    name_picture,
    tell_daylight,
)
from umbra.writers.folder.foot import describe_finer, list_few
from umbra.writers.folder.shown_window import crop_plan, find_shown_window
from umbra.writers.picture_content import DayMap, Plan
from umbra.writers.pixels import HALF, Ramp, resample

__all__ = ["count_dates", "count_lost", "draw_lost", "fit_hours", "make_map"]

_MATTERS = 1.0  # hours lost or won that the picture must include, at any distance
_WON = 1 / 60  # hours won, of more than which there is a scale of both


def draw_lost(job: FolderJob, plan: Plan, preview: Preview) -> list[str]:
    """
    Draw the hours lost to the proposal, cropped to them, with the proposal outlined.

    Returns the names of the files: none where nothing is lost.
    """
    study, options, painter = job.study, job.options, job.painter
    dates = split_dates(study)
    finer = count_dates(dates, job)
    every = count_lost(job, dates, finer, plan.shape)
    most = np.nan_to_num(every).max(0)
    if not most.max() > 0:
        return []
    new = preview.find_cells(job.scene.select(options.proposed))
    won = max(0.0, -float(np.nanmin(every)))
    ramp: Ramp = "change" if won > _WON else "loss"
    plan = replace(describe_finer(plan, job, finer), proposed=new)
    where: Any = ...
    if study.kind.is_plan and options.extent is None:
        newly = _fit_mask(study.more["newly_under"][1], most.shape)
        least = min(_MATTERS, float(most.max()) / 4)
        matters = (most >= least) | newly | (np.nan_to_num(every).min(0) <= -least)
        where = find_shown_window(_drop_specks(matters) | new, plan)
        cropped = crop_plan(study, plan, where)
        is_cut = cropped.shape != plan.shape
        told = f" · cropped to {say_hours(least)} of sun {_name_change(ramp)} and more" * is_cut
        plan = replace(cropped, note=plan.note + told)
    taken = f"sun lost to {list_few(options.proposed)}"
    plan = replace(plan, title=name_picture(job, range(len(study.period.days)), taken))
    what = f"hours of sun {_name_change(ramp)} to {list_few(options.proposed)}"
    limit = f"newly under {study.facts['under_hours']:g} h"
    divisor, words = (1, "") if len(dates) > 1 else find_together(job)
    if words:
        what += words
        limit += f" on at least one of {len(study.period.days)} dates"
    of = study.kind.area_of
    shown, plan = find_maps(study, plan)
    maps = []
    which = range(1) if len(dates) == 1 else choose_panels(study)
    for k, one in zip(which, shown, strict=True):
        hours = every[k][where] / divisor
        hatched = _fit_mask(one.more["newly_under"][1], most.shape)[where]
        area = f"{limit}: {_tell_area(_find_newly(one), of)}"
        maps.append(make_map(one, shown, hours, area, hatched=hatched))
    if len(shown) == 1:
        limit = area
    end = float(most.max()) if len(shown) > 1 else float(np.nanmax(maps[0].hours))
    end = max(end, won / divisor) if ramp == "change" else end
    painter.draw_hours(
        job.folder / "hours_lost.png", plan, maps, end, what=what, hatch=limit, ramp=ramp
    )
    return ["hours_lost.png"]


def _drop_specks(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Leave out what is less than three cells wide; but all, where nothing would be left."""
    from scipy.ndimage import binary_opening  # noqa: PLC0415  (half a second)

    opened = binary_opening(cells, np.ones((3, 3), np.bool_))
    return opened if opened.any() else cells


def _name_change(ramp: Ramp) -> str:
    """Name what happens to the sun."""
    return "won or lost" if ramp == "change" else "lost"


def count_lost(
    job: FolderJob,
    dates: Sequence[Study],
    finer: Sequence[FinerHours | None],
    shape: tuple[int, int],
) -> list[NDArray[np.float32]]:
    """Return the hours of sun lost to the proposal on each date, in a picture's cells."""
    return [
        job.keep(("lost", one.period.days, shape), partial(_find_lost, job, one, fine, shape))
        for one, fine in zip(dates, finer, strict=True)
    ]


def _find_lost(
    job: FolderJob, study: Study, finer: FinerHours | None, shape: tuple[int, int]
) -> NDArray[np.float32]:
    """Return the hours of sun lost to the proposal on a date, in a picture's cells."""
    lost = fit_hours(study.more["hours_lost"][1], shape)
    if finer is None:
        return lost
    options, scene = job.options, job.scene
    before = scene.select(options.cast, (*options.no_cast, *options.proposed))
    before += select_replaced(scene, options.cast, options.no_cast)
    found = fit_hours(finer.find_lost(before), shape)
    return np.where(np.isnan(lost), lost, found)


def _find_newly(study: Study) -> float:
    """Return the area newly under the limit, of what the summary and tables count [m2]."""
    groups = study.kind.list_counted(study)
    newly = np.asarray(study.more["newly_under"][1]) > 0
    return groups[-1].add_up(newly) if groups else 0.0


def _tell_area(area: float, of: str) -> str:
    """Describe an area, followed by what it is ``of``."""
    told = "nothing" if of else "nowhere"
    if area > 0:
        told = f"{area:,.0f} m²" if area >= 10 else f"{area:.2g} m²"
    return told + of


def fit_hours(hours: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Average hours to the cells of the pictures."""
    return hours if hours.shape == shape else resample(hours, shape)


def _fit_mask(mask: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.bool_]:
    return fit_hours(mask.astype(np.float32), shape) > HALF


def make_map(
    study: Study, shown: Sequence[Study], hours: NDArray, told: str = "", **more: Any
) -> DayMap:
    """Make a map of hours; one of several gets its date, sunrise, sunset and a remark."""
    more["is_night"] = study.up_hours <= 0
    if len(shown) == 1:
        return DayMap(hours, **more)
    remark = " · ".join(filter(None, [tell_daylight(study), told]))
    return DayMap(hours, name_dates(study), remark, **more)


def count_dates(shown: Sequence[Study], job: FolderJob) -> list[FinerHours | None]:
    """Count each date in finer steps, where these cost little; once for all files of a job."""

    def count() -> list[FinerHours | None]:
        finer: list[FinerHours | None] = []
        for one in shown:
            like = next(filter(None, finer), None)
            finer.append(count_finer(one, 1 / len(shown), like=like))
        return finer

    return job.keep(("finer", *(one.period.days for one in shown)), count)
