"""The map of who casts the shadow, of a study with by= or who=."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import select_casters
from umbra.study import FinerHours, Preview, split_dates
from umbra.study.accumulators.groups import find_members
from umbra.study.finer import can_count_casters
from umbra.writers.caster_map import HUES, WhoMap
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import find_together, name_picture
from umbra.writers.folder.foot import describe_finer, tell_steps
from umbra.writers.folder.loss_maps import count_dates
from umbra.writers.picture_content import Plan
from umbra.writers.pixels import resample

__all__ = ["draw_who"]


def draw_who(job: FolderJob, plan: Plan, preview: Preview) -> list[str]:
    """
    Draw the main caster of each cell of a plan or a view, over all dates.

    Returns the names of the files: none where no caster was asked for, or none casts a shadow.
    """
    study, divisor = job.study, find_together(job)[0]
    if "cast_hours" not in study.more:
        return []
    names = np.asarray(study.more["caster"][1]).tolist()
    main, hours = _find_main(study.more["cast_hours"][1])
    order = _rank(main, hours, len(names))
    if not len(order):
        return []
    scene, options = job.scene, job.options
    casting = select_casters(scene, options.cast, options.no_cast)
    _, member = find_members(scene, casting, options.who, options.by)
    members = [np.flatnonzero(column).tolist() for column in member.T]
    finer = [one for one in count_dates(split_dates(study), job) if one is not None]
    if len(finer) == len(study.period.days):
        counted = next(
            (some for some in (range(len(names)), order[: len(HUES)].tolist())
             if can_count_casters(study, finer, len(some))), (),
        )  # fmt: skip
        if counted:
            main, hours = _find_main(_count_casters(job, finer, members, counted))
            order = _rank(main, hours, len(names), first=counted)
            plan = describe_finer(plan, job, finer)
            if len(counted) < len(names):
                others = f"of casters without a name here {tell_steps(study, options)}"
                plan = replace(plan, note=f"{plan.note} · {others}")
    rank_of = np.full(len(names) + 1, -1)  # the last: of none
    rank_of[order] = np.arange(len(order))
    shown = order[: len(HUES)]
    rows = np.arange(plan.shape[0]) * main.shape[0] // plan.shape[0]
    cols = np.arange(plan.shape[1]) * main.shape[1] // plan.shape[1]
    own = hours if hours.shape == plan.shape else resample(hours, plan.shape)
    stands = [preview.find_cells(members[k]) for k in shown]
    who = WhoMap(
        rank_of[main][np.ix_(rows, cols)], own / np.float32(divisor),
        [names[k] for k in shown], stands,
    )  # fmt: skip
    most = float(np.nanmax(who.hours))
    what = "main caster"
    if divisor > 1:
        what += f" (mean of {divisor} dates)"
    title = name_picture(job, range(len(study.period.days)), "main casters of shadow")
    plan = replace(plan, title=title)
    job.painter.draw_who(job.folder / "who.png", plan, who, most, what=what)
    return ["who.png"]


def _count_casters(
    job: FolderJob, finer: list[FinerHours], members: list[list[int]], counted: Iterable[int]
) -> Iterable[NDArray[np.floating]]:
    """Yield the hours of each caster over all dates: of some in finer steps, else the study's."""
    cast: Any = job.study.more["cast_hours"][1]
    shape, again = finer[0].shadow_hours.shape, set(counted)
    for k, parts in enumerate(members):
        if k in again:
            yield np.sum([one.find_cast(parts) for one in finer], 0)
        else:
            yield cast[k] if cast[k].shape == shape else resample(cast[k], shape)


def _find_main(
    cast: Iterable[NDArray[np.floating]],
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Return the caster with most hours of each cell, -1 for none, and its hours."""
    each = iter(cast)  # one at a time: there may be hundreds
    hours = np.asarray(next(each), np.float32).copy()
    main = np.where(hours > 0, 0, -1)
    for k, own in enumerate(each, start=1):
        longer = own > hours
        hours[longer], main[longer] = own[longer], k
    return main, hours


def _rank(
    main: NDArray[np.intp], hours: NDArray[np.float32], count: int, first: Iterable[int] = ()
) -> NDArray[np.intp]:
    """Return the casters that are main somewhere: some first, then those with most shadow."""
    is_cast = main >= 0
    total = np.bincount(main[is_cast], hours[is_cast].astype(np.float64), count)
    is_later = ~np.isin(np.arange(count), list(first))
    order = np.lexsort((-total, is_later))
    return order[total[order] > 0]
