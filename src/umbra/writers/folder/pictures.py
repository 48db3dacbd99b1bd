"""The pictures of a study: maps of hours and profiles of plans, surfaces and points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from umbra.ground.choice import find_ground
from umbra.receivers.zenith import find_surface
from umbra.scene.grid import Grid
from umbra.study import (
    Preview,
    Study,
    make_preview,
    refine_preview,
    split_dates,
)
from umbra.study.finer import LONGEST
from umbra.study.measures import Measure
from umbra.study.preview import choose_stamps
from umbra.sun import find_daylight, find_sun, name_date
from umbra.sun.clock import Stamps, find_stamps
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import (
    Scale,
    choose_panels,
    describe,
    describe_moments,
    describe_smooth,
    find_maps,
    list_files,
    name_model,
    name_picture,
    name_shown,
    name_sun,
    outline_areas,
    tell_place,
    tell_times,
)
from umbra.writers.folder.drawn_context import add_context
from umbra.writers.folder.foot import describe_finer, describe_method, list_few
from umbra.writers.folder.loss_maps import count_dates, draw_lost, fit_hours, make_map
from umbra.writers.folder.month_maps import BY_MONTH, draw_months
from umbra.writers.folder.shown_window import CROPPED, crop_dates, crop_plan, find_lasting
from umbra.writers.picture_content import DayShadows, Plan, find_map_size, name_hours

if TYPE_CHECKING:
    from umbra.receivers.seen import ViewTile

__all__ = [
    "TILT",
    "PictureSheets",
    "describe_points",
    "draw_pictures",
    "draw_plan_of_points",
    "draw_surfaces",
    "find_sunny_side",
    "lay_out_points",
    "look_at_surfaces",
    "name_points",
]

MOST_DAYS = 4
"""Most dates that also get separate pictures."""
_MOST_STAMPS = 12  # of each date on a sheet of many small maps
_DENSE = 0.25  # mean share of a day in shadow, of the ground that is ever in it
_EDGE = 0.03  # around what three moments show, of its length
_FEW_TIMES = "shadows of these times exactly; those of the whole day would cover one another"
_CLOCKS = ("09:00", "12:00", "15:00")
TILT = 35
_ROOM = 12.0  # least margin around points [m]
_CELLS = 1200  # along the plan of points


@dataclass(frozen=True, eq=False)
class PictureSheets:
    """Content of a raster's pictures."""

    plan: Plan  # of the hours
    preview: Preview  # of the first day

    @classmethod
    def of(cls, job: FolderJob) -> Self:
        """Describe the hours and, if drawn, the appearance of surfaces."""
        study = job.study
        preview = make_preview(study, steps=choose_stamps(study.steps, job.outputs.at))
        plan = describe(job, preview, range(len(study.period.days)))
        plan = add_context(job, plan) if study.kind.is_plan else plan
        if job.outputs.endings and not study.kind.is_level:
            from umbra.writers.edges import find_grid_appearance  # noqa: PLC0415

            plan = replace(plan, appearance=find_grid_appearance(study, find_map_size(plan)))
        return cls(plan, preview)


def draw_pictures(job: FolderJob, sheets: PictureSheets) -> list[str]:
    """
    Draw the hours and the profile; for a few dates also of each date.

    Returns the names of the files.
    """
    if job.only != "hours":
        _draw_profiles(job, sheets)  # takes longest to draw
    if job.only != "profile":
        shown, named = find_maps(job.study, sheets.plan)
        which = range(len(job.study.period.days))
        _draw_hours(job, "hours.png", which, named, shown, Scale.of(job).what)
    if job.only is not None:
        return [f"{job.only}.png"]
    names = ["hours.png", "profile.png"]
    if "hours_lost" in job.study.more:
        names += draw_lost(job, sheets.plan, sheets.preview)
    if BY_MONTH in job.study.more:
        names += draw_months(job, sheets.plan)
    if "cast_hours" in job.study.more:  # not of surfaces, whose picture is of hours alone
        from umbra.writers.folder.who import draw_who  # noqa: PLC0415  (it loads matplotlib)

        names += draw_who(job, sheets.plan, sheets.preview)
    return names + _draw_each_date(job, sheets)


def _draw_profiles(job: FolderJob, sheets: PictureSheets) -> None:
    """Draw the profile, with a map for each of several dates."""
    study = job.study
    plan = describe_moments(sheets.plan, job, range(len(study.period.days)))
    most = _MOST_STAMPS if len(study.period.days) > MOST_DAYS else None
    steps = [choose_stamps(each, job.outputs.at, most) for each in study.period.steps]
    if len(steps) == 1:
        view = refine_preview(study, sheets.preview, steps=steps[0])
        smooth = describe_smooth(plan, study, view)
        if study.is_plan and not job.outputs.at and _is_dense(view):
            _draw_moments(job, smooth)
        else:
            _draw_profile(job, "profile.png", smooth, [(0, steps[0], view)])
        return
    shown = choose_panels(study)
    longest = round(LONGEST / math.sqrt(len(shown)))
    views: list[tuple[int, Stamps, Preview]] = []
    coarse: Preview | None = None
    fine: Preview | None = None
    for k in shown:
        coarse = make_preview(study, longest, steps[k], like=coarse)
        fine = refine_preview(study, coarse, longest, steps[k], like=fine)
        views.append((k, steps[k], fine))
    whole = describe_smooth(plan, study, views[0][2])
    dates = [fit_hours(one.shadow_hours - one.period.land_hours, whole.shape)
             for one in split_dates(study)]  # fmt: skip
    where = find_lasting(job, whole, dates)
    if where is not None:
        whole = replace(crop_plan(study, whole, where), note=f"{whole.note} · {CROPPED}")
    _draw_profile(job, "profile.png", name_shown(whole, study), views, where)


def _is_dense(view: Preview) -> bool:
    """Return whether shadows of a day lie over one another nearly everywhere, as in a city."""
    often = view.shadows.mean(0)
    shaded = (often > 0) & ~(np.nan_to_num(view.heights) > 0)
    return bool(shaded.any()) and float(often[shaded].mean()) > _DENSE


def _span(is_seen: NDArray[np.bool_]) -> slice:
    """Return the cells from the first to the last that is seen, with a margin."""
    first, last = np.flatnonzero(is_seen)[[0, -1]].tolist()
    room = round(_EDGE * (last - first)) + 1
    return slice(max(first - room, 0), last + room + 1)


def _draw_moments(job: FolderJob, plan: Plan) -> None:
    """Draw the shadows of a date at three of its times, a map each."""
    study = job.study
    clocks = find_stamps(study.period.days[0], _CLOCKS, study.site.zone).stamps
    own = study.steps.stamps
    if not ((clocks >= own[0]) & (clocks <= own[-1])).all():
        clocks = own[[0, len(own) // 2, -1]]
    stamps = Stamps(stamps=clocks, zone=study.site.zone)
    path = find_sun(study.site, clocks, refraction=study.refraction)
    longest = round(LONGEST / math.sqrt(len(clocks)))
    view = refine_preview(study, make_preview(study, longest, stamps), longest, stamps)
    seen = view.shadows.any(0) | (np.nan_to_num(view.heights) > 0)
    where = _span(np.asarray(seen.any(1))), _span(np.asarray(seen.any(0)))
    maps = [
        DayShadows([mask[where]], [label], None, label,
                   f"sun {path.altitude[k]:.0f}\N{DEGREE SIGN} high", not path.is_up[k])
        for k, (mask, label) in enumerate(zip(view.shadows, stamps.labels(), strict=True))
    ]  # fmt: skip
    zone = "/".join(dict.fromkeys(stamps.abbreviations()))
    plan = describe_smooth(plan, study, view).crop(where)
    plan = replace(plan, note=f"{plan.note} · {_FEW_TIMES}")
    if plan.appearance is not None:
        from umbra.writers.edges import find_grid_appearance  # noqa: PLC0415

        grid = study.grid.coarser(max(seen.shape)).part(*where)
        plan = replace(plan, appearance=find_grid_appearance(study, find_map_size(plan), grid))
    job.painter.draw_profile(job.folder / "profile.png", plan, maps, zone=zone)


def _draw_each_date(job: FolderJob, sheets: PictureSheets) -> list[str]:
    """Draw the hours and the profile of each of a few dates; return the names of the files."""
    study, dates = job.study, split_dates(job.study)
    names: list[str] = []
    of_day = view = sheets.preview
    if not 1 < len(dates) <= MOST_DAYS:
        return names
    for k, (day, one) in enumerate(zip(study.period.days, dates, strict=True)):
        stamps = choose_stamps(study.period.steps[k], job.outputs.at)
        if k > 0:
            of_day = make_preview(study, steps=stamps, like=of_day)
        own = describe(job, of_day, range(k, k + 1))
        own = replace(
            own, appearance=sheets.plan.appearance, context=sheets.plan.context,
            context_name=sheets.plan.context_name,
        )  # fmt: skip
        view = refine_preview(study, of_day, steps=stamps, like=view)
        smooth = describe_smooth(describe_moments(own, job, range(k, k + 1)), study, view)
        _draw_profile(job, f"profile_{day}.png", smooth, [(k, stamps, view)])
        _draw_hours(job, f"hours_{day}.png", range(k, k + 1), own, [one])
        names += [f"hours_{day}.png", f"profile_{day}.png"]
    return names


def _draw_hours(
    job: FolderJob,
    name: str,
    which: range,
    plan: Plan,
    shown: Sequence[Study],
    what: str = "",
) -> None:
    """Draw the hours of some dates, ``which`` by number, a map each, on the scale of all."""
    scale, finer = Scale.of(job), count_dates(shown, job)
    plan = replace(plan, title=name_picture(job, which, scale.show))
    plan = describe_finer(plan, job, finer)
    each = [fit_hours(scale.read_hours(fine or one), plan.shape)
            for one, fine in zip(shown, finer, strict=True)]  # fmt: skip
    darks = [scale.find_dark(fine or one) for one, fine in zip(shown, finer, strict=True)]
    # Hours in shadow, without those of the land and those by which maps of the sun are shifted.
    shadows = [hours - (dark - one.up_hours + one.period.land_hours)
               for one, hours, dark in zip(shown, each, darks, strict=True)]  # fmt: skip
    plan, each = crop_dates(job, plan, each, shadows)
    maps = [
        make_map(
            one, shown, hours,
            f"of {one.up_hours:.3g} h with the sun up" if scale.show == "sun" else "",
            dark_from=dark,
        )
        for one, hours, dark in zip(shown, each, darks, strict=True)
    ]  # fmt: skip
    job.painter.draw_hours(
        job.folder / name, plan, maps, scale.most,
        what=what, show=scale.show,
    )  # fmt: skip


def _draw_profile(
    job: FolderJob,
    name: str,
    plan: Plan,
    views: Sequence[tuple[int, Stamps, Preview]],
    where: tuple[slice, slice] | None = None,
) -> None:
    """Draw the shadows of some dates, by number, at their stamps, or a window of them."""
    shown: Any = (slice(None), *(where or ()))
    days = job.study.period.days
    maps = [
        DayShadows(view.shadows[shown], stamps.labels(), view.away, name_date(days[k]),
                   str(find_daylight(job.study.site, days[k])) if len(views) > 1 else "",
               bool(np.isnan(view.away).all()))
        for k, stamps, view in views
    ]  # fmt: skip
    zones = dict.fromkeys(zone for _, stamps, _ in views for zone in stamps.abbreviations())
    job.painter.draw_profile(job.folder / name, plan, maps, zone="/".join(zones))


def find_sunny_side(study: Study) -> int:
    """Return the azimuth from which sunlit sides are seen [degrees]."""
    return 325 if study.site is not None and study.site.latitude < 0 else 215


def look_at_surfaces(job: FolderJob) -> FolderJob:
    """Return the same job with the model as it is seen from above on the sunny side."""
    from umbra.study import show_samples  # noqa: PLC0415  (plans need no views)

    options = job.options
    asked = {name: getattr(options, name) for name in ("proposed", "under", "exact")}
    options = options.ask_hours(f"{find_sunny_side(job.study)}/{TILT}", measures=True, **asked)
    study = show_samples(job.study, options, is_drawn=job.only != "profile")
    tile: ViewTile = study.laid.tile  # type: ignore[attr-defined]
    if options.on and tile.nothing.all():
        job.say(
            f"note: nothing of {list_few(options.on)} is seen in the pictures, from azimuth "
            f"{find_sunny_side(job.study)}°; study.nc has its hours, and receivers='north' or "
            "another side shows them"
        )
    if backs := tile.is_back.mean():
        job.say(
            f"note: {100 * backs:.2g} % of the pictures shows backs of surfaces, in grey: samples "
            "lie on a surface's outward side, by its winding"
        )
    if "assumption" in study.facts:  # of the ground that only the picture shows
        job.say(f"note: {study.facts['assumption']}")
    return replace(job, study=study, options=options)


def draw_surfaces(job: FolderJob) -> list[str]:
    """Draw the model with its hours in shadow, as ``look_at_surfaces`` shows it."""
    return draw_pictures(job, PictureSheets.of(job))


def lay_out_points(job: FolderJob, measures: Sequence[Measure] | None = None) -> Plan:
    """Lay out a plan of the buildings around points, of hours or of ``measures``."""
    study, scene = job.study, job.scene
    points, origin, asked = study.places.points, scene.origin, job.options.proposed
    new = scene.select(asked) if asked else []
    shown = [points[:, :2]]
    if new:  # without them their shadow has no source
        shown.append(scene.triangles(new).find_corners()[:, :2] + origin[:2])
    low, high = (pick([pick(some, 0) for some in shown], 0) for pick in (np.min, np.max))
    room = max(0.12 * float((high - low).max()), _ROOM)
    cell = float((high - low).max() + 2 * room) / _CELLS
    cols, rows = (int(n) for n in np.ceil((high - low + 2 * room) / cell))
    west, south = (float(v) for v in low - room + cell / 2 - origin[:2])
    grid = Grid(west, south, cell, cell, cols, rows)
    soup = study.model.soup
    level = find_ground(study.model.scene, job.options.ground).lowest - origin[2]
    surface, floor = find_surface(soup, grid, level), level
    own = study.model.scene.list_own()
    if own is not None:  # over the ground that was added
        chosen = ~np.isin(soup.part, own)
        land = replace(soup, faces=soup.faces[chosen], part=soup.part[chosen])
        floor = find_surface(land, grid, level).heights
    heights = surface.heights - floor
    return replace(
        describe_points(job, measures),
        x=grid.x + origin[0],
        y=grid.y + origin[1],
        building_height=heights.astype(np.float32),
        true_north=study.true_north,
        areas=outline_areas(study.named_areas),
        fills_areas=study.kind.name == "areas",
        proposed=np.isin(np.append(soup.part, -1)[surface.face], new) if new else None,
    )


def draw_plan_of_points(job: FolderJob) -> list[str]:
    """Draw the points on a plan of the buildings around them, coloured by their hours."""
    study, plan, asked = job.study, add_context(job, lay_out_points(job)), job.options.proposed
    names = study.more["name"][1].tolist() if "name" in study.more else []
    scale = Scale.of(job)
    dates, plan = find_maps(study, plan)
    maps = [
        make_map(one, dates, scale.read_hours(one), dark_from=scale.find_dark(one)) for one in dates
    ]
    job.painter.draw_points(
        job.folder / "points.png", plan, study.places, maps, scale.most, names, scale.show,
        scale.what,
    )  # fmt: skip
    every = [one.more["hours_lost"][1] / scale.divisor for one in dates] if asked else [np.zeros(1)]
    most = float(np.nanmax(every))
    if job.only is not None or not most > 0:
        return ["points.png"]
    what = scale.what.removeprefix(name_hours(scale.show))
    maps = [make_map(one, dates, hours) for one, hours in zip(dates, every, strict=True)]
    job.painter.draw_points(
        job.folder / "hours_lost.png", plan, study.places, maps, most, names,
        what=f"hours of sun lost to {list_few(asked)}{what}", ramp="loss",
    )  # fmt: skip
    return ["points.png", "hours_lost.png"]


def name_points(job: FolderJob, which: range, what: str = "sun") -> str:
    """Return the title of surfaces or points at some dates: the user's, or their own."""
    named = f"{name_model(list_files(job.scene))}, {job.study.kind.noun}"
    return job.outputs.title or named + name_sun(job.study.period, which, what)


def describe_points(job: FolderJob, measures: Sequence[Measure] | None = None) -> Plan:
    """Describe surfaces or points for a report, or for a map of ``measures`` instead of hours."""
    study, options, outputs = job.study, job.options, job.outputs
    has_dates = measures is None or any(measure.needs_sun for measure in measures)
    which = range(len(study.period.days) if has_dates else 0)
    nowhere = np.zeros(1)
    return Plan(
        nowhere,
        nowhere,
        title=name_points(job, which),
        subtitle=outputs.subtitle or "",
        place=tell_place(study),
        date=tell_times(study.period, options, which, is_titled=not outputs.title),
        note=" · ".join(
            [
                f"umbra {study.facts['umbra_version']}",
                study.kind.tell_count(study),
                str(study.facts["ground"]),
                *describe_method(study, options, measures=measures),
            ]
        ),
    )
