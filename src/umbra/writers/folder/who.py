"""The map of who casts the shadow, of a study with by= or who=."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import Preview
from umbra.study.accumulators.groups import find_members
from umbra.writers.caster_map import HUES, WhoMap
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import find_together, name_picture
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
    cast: Any = study.more["cast_hours"][1]
    main, hours = _find_main(cast)
    order = _rank(main, hours, len(names))
    if not len(order):
        return []
    rank_of = np.full(len(names) + 1, -1)  # the last: of none
    rank_of[order] = np.arange(len(order))
    shown = order[: len(HUES)]
    rows = np.arange(plan.shape[0]) * main.shape[0] // plan.shape[0]
    cols = np.arange(plan.shape[1]) * main.shape[1] // plan.shape[1]
    own = hours if hours.shape == plan.shape else resample(hours, plan.shape)
    scene, options = job.scene, job.options
    casting = scene.select(options.cast) if options.cast else range(len(scene.parts))
    _, member = find_members(scene, list(casting), options.who, options.by)
    stands = [preview.find_cells(np.flatnonzero(member[:, k]).tolist()) for k in shown]
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


def _find_main(cast: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Return the caster with most hours of each cell, -1 for none, and its hours."""
    hours = np.asarray(cast[0], np.float32).copy()
    main = np.where(hours > 0, 0, -1)
    for k in range(1, len(cast)):  # one at a time: there may be hundreds
        longer = cast[k] > hours
        hours[longer], main[longer] = cast[k][longer], k
    return main, hours


def _rank(main: NDArray[np.intp], hours: NDArray[np.float32], count: int) -> NDArray[np.intp]:
    """Return the casters that are main somewhere, those with most shadow first."""
    is_cast = main >= 0
    total = np.bincount(main[is_cast], hours[is_cast].astype(np.float64), count)
    order = np.argsort(-total, kind="stable")
    return order[total[order] > 0]
