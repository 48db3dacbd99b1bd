"""The pictures of a study: maps of hours and profiles."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.study import Preview, Study, count_finer, make_preview, split_dates, tell_dates
from umbra.study.moments import choose_stamps
from umbra.study.preview import LONGEST
from umbra.sun import find_daylight
from umbra.sun.clock import Stamps
from umbra.writers.folder.captions import describe, describe_finer
from umbra.writers.folder.dates import Scale, choose_panels, name_shown, tell_daylight
from umbra.writers.folder.lost import draw_lost
from umbra.writers.folder.outputs import FolderJob
from umbra.writers.plan import DayMap, Plan, find_map_size

__all__ = ["Sheets", "draw_pictures"]

MOST_DAYS = 4
"""Up to this many dates each have pictures of their own as well."""


@dataclass(frozen=True, eq=False)
class Sheets:
    """
    Pictures that are being drawn.

    Parameters
    ----------
    plan : Plan
        Of the hours.
    preview : Preview
        Of the first day.
    names : list of str
        Of the files.
    """

    plan: Plan
    preview: Preview
    names: list[str]


def draw_pictures(job: FolderJob) -> Sheets:
    """Draw the hours and the profile; for a few dates also those of each date."""
    study = job.study
    preview = make_preview(study, steps=choose_stamps(study.steps, job.outputs.at))
    plan = describe(job, preview, range(len(study.period.days)))
    if not study.kind.is_level:
        from umbra.writers.edges import find_appearance  # noqa: PLC0415

        plan = replace(plan, appearance=find_appearance(study, find_map_size(plan)))
    _draw_dates(job, plan)
    names = ["hours.png", "profile.png"]
    if "hours_lost" in study.more:
        names += draw_lost(job, plan, preview)
    names += _draw_days(job, plan, preview)
    return Sheets(plan, preview, names)


def _draw_days(job: FolderJob, plan: Plan, preview: Preview) -> list[str]:
    """Draw the profile with a panel per date; for a few dates also pictures of each."""
    study, painter, folder, at = job.study, job.painter, job.folder, job.outputs.at
    days = study.period.days
    if len(days) == 1:
        stamps = choose_stamps(study.steps, at)
        _draw_profile(job, "profile.png", plan, preview, stamps)
        return []
    shown = choose_panels(study)
    longest = round(LONGEST / math.sqrt(len(shown)))
    steps = [choose_stamps(each, at) for each in study.period.steps]
    views = [make_preview(study, longest, steps[k]) for k in shown]
    zones = dict.fromkeys(name for k in shown for name in steps[k].abbreviations())
    whole = replace(plan, x=views[0].x, y=views[0].y, building_height=views[0].heights)  # type: ignore[arg-type]
    whole = name_shown(whole, study)
    painter.draw_profiles(
        folder / "profile.png", whole,
        [
            (str(days[k]), view.shadows, steps[k].labels(), view.away)
            for k, view in zip(shown, views)
        ],
        zone="/".join(zones),
        remarks=[str(find_daylight(study.site, days[k])) for k in shown],
    )  # fmt: skip
    dates = split_dates(study)
    names: list[str] = []
    if not 1 < len(dates) <= MOST_DAYS:
        return names
    scale = Scale.of(job)
    for k, (day, one) in enumerate(zip(days, dates, strict=True)):
        of_day = preview if k == 0 else make_preview(study, steps=steps[k])
        own = replace(describe(job, of_day, range(k, k + 1)), appearance=plan.appearance)
        _draw_profile(job, f"profile_{day}.png", own, of_day, steps[k])
        _draw_date(job, f"hours_{day}.png", own, one, scale)
        names += [f"hours_{day}.png", f"profile_{day}.png"]
    return names


def _draw_dates(job: FolderJob, plan: Plan) -> None:
    """Draw the hours: a map per date on one scale, or all dates together."""
    study = job.study
    dates, scale = split_dates(study), Scale.of(job)
    if len(dates) == 1:
        _draw_date(job, "hours.png", plan, study, scale, scale.what)
        return
    shown = [dates[k] for k in choose_panels(study)]
    finer = [count_finer(one, len(shown)) for one in shown]
    maps = [
        DayMap(
            tell_dates(one), tell_daylight(one), _coarsen(scale.read_hours(one), plan.shape),
            finer=None if fine is None else scale.read_hours(fine),
        )
        for one, fine in zip(shown, finer, strict=True)
    ]  # fmt: skip
    whole = describe_finer(name_shown(plan, study), finer[0])
    job.painter.draw_hour_panels(
        job.folder / "hours.png", whole, maps, scale.most, what=scale.what, show=scale.show,
    )  # fmt: skip


def _draw_date(
    job: FolderJob, name: str, plan: Plan, study: Study, scale: Scale, what: str = ""
) -> None:
    """Draw the hours of one date, on the scale of all."""
    hours, finer = _coarsen(scale.read_hours(study), plan.shape), count_finer(study)
    job.painter.draw_hours(
        job.folder / name, describe_finer(plan, finer), hours, scale.most,
        what=what, show=scale.show,
        finer=None if finer is None else scale.read_hours(finer),
    )  # fmt: skip


def _draw_profile(job: FolderJob, name: str, plan: Plan, preview: Preview, stamps: Stamps) -> None:
    zone = "/".join(dict.fromkeys(stamps.abbreviations()))
    job.painter.draw_profile(
        job.folder / name, plan, preview.shadows, stamps.labels(), zone=zone,
        away=preview.away,
    )  # fmt: skip


def _coarsen(hours: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Average hours to the cells of a picture."""
    if hours.shape == shape:
        return hours
    from umbra.writers.raster import resample  # noqa: PLC0415

    return resample(hours, shape)
