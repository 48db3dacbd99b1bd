"""The sheet: a plan and four elevations in standard scales."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import has_terrain
from umbra.receivers.orthographic import COMPASS, Elevation
from umbra.scene import Scene
from umbra.study import (
    Study,
    StudyOptions,
    count_finer,
    make_preview,
    run,
    split_dates,
    tell_dates,
)
from umbra.sun import find_sun
from umbra.sun.clock import Stamps, find_stamps
from umbra.writers.edges import find_grid_appearance
from umbra.writers.elevations import SheetContent, arrange, find_pixel_side
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import (
    Scale,
    choose_panels,
    name_picture,
    place_elevation,
    tell_daylight,
)
from umbra.writers.folder.drawn_context import add_context
from umbra.writers.folder.foot import describe_foot, tell_every
from umbra.writers.folder.loss_maps import fit_hours
from umbra.writers.picture_content import DayMap, Plan
from umbra.writers.proof.logo import read_logo
from umbra.writers.title_block import SunRose

__all__ = ["draw_sheet", "find_window"]

_SIDES = ("south", "east", "north", "west")
MATTERS = 1 / 4
"""Share of the time with the sun up from which shadows must be on the sheet."""
_FREE = 4.0  # work that each elevation may take, as a pixel takes much; a sheet is asked for
_MARGIN = 0.03  # of an elevation's length, on each side of it


def draw_sheet(job: FolderJob, plan: Plan) -> list[str]:
    """
    Count four elevations at the resolution of a sheet, and draw them with the plan of hours.

    Returns the names of the files: of several dates one for each, all on one scale.
    """
    study, scene, options = job.study, job.scene, job.options
    boxes = [_find_box(scene, study, side, options.extent) for side in _SIDES]
    sizes = [(float(box[2] - box[0]), float(box[3] - box[1])) for box in boxes]
    need, most = find_window(study, plan, options)
    arrangement = arrange(tuple(np.ptp(need, axis=0)), most, sizes, job.outputs.paper)
    half = np.array(arrangement.plan) / 2
    window = tuple(float(v) for v in (*(need.mean(0) - half), *(need.mean(0) + half)))
    drawn: dict[str, Any] = {"size": None, "by_day": len(split_dates(study)) > 1}
    cell = find_pixel_side(arrangement)
    asked = options.ask_hours(study.kind.name, extent=window, cell=cell, **drawn)
    seen: Any = run(scene, study.site, asked)
    zero = f"heights of elevations above z = {study.ground:.6g} m"  # once: captions are narrow
    plan = add_context(replace(job, study=seen), _redraw(plan, seen))
    plans, scale = split_dates(seen), Scale.of(job)
    sides = _count_sides(job, boxes, cell, drawn, plan.canopy_name)
    model = scene.model_bounds()[:, :2].mean(0) - need.mean(0)
    logo = None if job.outputs.logo is None else read_logo(job.outputs.logo)
    names = []
    for k in choose_panels(study) if len(plans) > 1 else (0,):
        which = range(k, k + 1) if len(plans) > 1 else range(len(study.period.days))
        own = replace(plan, title=name_picture(job, which, job.show))
        file = "sheet.png"
        if len(plans) > 1:
            date = tell_dates(plans[k])
            clock = f"{options.start} to {options.end}"
            own = replace(own, date=f"{clock} · {tell_daylight(plans[k])}")
            file = f"sheet_{date}.png"
        views = [("Plan", own, plans[k]), *((side, view, seen[k]) for side, view, seen in sides)]
        finer = [count_finer(plans[k]), *(count_finer(seen, _FREE) for *_, seen in views[1:])]
        made = [describe_foot(plans[k], options, finer[0])]
        if {fine and fine.seconds for fine in finer[1:]} != {finer[0] and finer[0].seconds}:
            steps = sorted({tell_every(options, fine) for fine in finer[1:]})
            made.append(f"elevations: sun every {' or '.join(steps)}")
        own = replace(own, note=f"{' · '.join(made)}; {zero}")
        views[0] = ("Plan", own, plans[k])
        maps = [
            (
                caption,
                view,
                DayMap(
                    fit_hours(scale.read_hours(fine or one), view.shape),
                    dark_from=scale.find_dark(fine or one),
                ),
            )
            for (caption, view, one), fine in zip(views, finer, strict=True)
        ]
        job.painter.draw_elevations(
            job.folder / file, arrangement, maps, scale.most if plans[k].up_hours > 0 else 0.0,
            show=scale.show, what=scale.what,
            content=SheetContent(
                (float(model[0]), float(model[1])), *_find_moments(plans[k], plan, need),
                _find_sun_path(plans[k]), logo,
            ),
        )  # fmt: skip
        names.append(file)
    return names


def _count_sides(
    job: FolderJob,
    boxes: Sequence[tuple[float, float, float, float]],
    cell: float,
    drawn: dict[str, Any],
    canopy_name: str,
) -> list[tuple[str, Plan, list[Study]]]:
    """Count the elevations of a sheet; return their captions, cells, and hours of each date."""
    scene, site, sides = job.scene, job.study.site, []
    for side, box in zip(_SIDES, boxes, strict=True):
        seen: Any = run(scene, site, job.options.ask_hours(side, extent=box, cell=cell, **drawn))
        heights = np.nan_to_num(seen.heights + 1).astype(np.float32)
        tile = seen.model.make_tile(seen.grid)
        crowns, earth = tile.find_canopies(), tile.is_earth
        elevation = Plan(
            *place_elevation(seen, seen.x, seen.y), heights, None, axes=("", "[m]"),
            appearance=find_grid_appearance(seen, heights.shape),
            canopies=crowns if crowns.any() else None, canopy_name=canopy_name,
            roofs_cover=False, nothing=earth if earth.any() else None,
            nothing_name=seen.kind.nothing,
        )  # fmt: skip
        sides.append((f"{side.capitalize()} elevation", elevation, split_dates(seen)))
    return sides


_CLOCK = [f"{hour:02}:00" for hour in range(24)]
_LONGEST = 400  # cells of the small plans along a side


def _find_hours(study: Study) -> Stamps | None:
    """Return the whole hours of a date within the study's."""
    days = study.period.days
    if len(days) != 1:
        return None
    stamps = find_stamps(days[0], _CLOCK, study.site.zone)
    starts, ends = (of.view("datetime64[us]") for of in (study.period.starts, study.period.ends))
    kept = stamps.stamps[(stamps.stamps >= starts.min()) & (stamps.stamps <= ends.max())]
    return Stamps(stamps=kept, zone=stamps.zone) if len(kept) else None


def _find_moments(
    study: Study, plan: Plan, need: NDArray[np.float64]
) -> tuple[list[tuple[str, NDArray[np.bool_]]], Plan | None]:
    """Return the shadows at whole hours with the sun up, where needed, and their plan."""
    stamps = _find_hours(study)
    if stamps is None:
        return [], None
    preview = make_preview(study, _LONGEST, stamps)
    up: list[bool] = [not np.isnan(one).any() for one in preview.away]
    shown = replace(
        plan, x=preview.x, y=preview.y, building_height=preview.heights.astype(np.float32),
        appearance=None, canopies=None, nothing=None, proposed=None, context=(),
    )  # fmt: skip
    rows, cols = (
        slice(*np.searchsorted(cells, need[:, axis]))
        for axis, cells in ((1, shown.y), (0, shown.x))
    )
    pairs = zip(stamps.labels(), preview.shadows[:, rows, cols], up, strict=True)
    return [(label, mask) for label, mask, is_up in pairs if is_up], shown.crop((rows, cols))


def _find_sun_path(study: Study) -> SunRose:
    """Return the sun's path of a date, and its whole hours."""
    sun, stamps = study.period.sun, _find_hours(study)
    path = np.column_stack([sun.azimuth, sun.altitude])[sun.is_up]
    if stamps is None:
        return SunRose()
    found = find_sun(study.site, stamps.stamps, refraction=study.refraction)
    hours = zip(stamps.labels(), found.azimuth, found.altitude, found.is_up, strict=True)
    return SunRose(path, [(label[:2], float(a), float(h)) for label, a, h, is_up in hours if is_up])


def find_window(
    study: Study, plan: Plan, options: StudyOptions
) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """
    Return the part of the plan that must be on the sheet, and its largest width and height [m].

    The part is the lower left and upper right corner (2, 2) of the model and the shadows that
    matter.
    """
    x0, x1, y0, y1 = plan.extent
    whole = np.array([[x0, y0], [x1, y1]])
    if options.extent is not None:
        return whole, (x1 - x0, y1 - y0)
    model = study.model.scene.model_bounds()[:, :2]
    if has_terrain(study.model.scene):
        model = np.clip(model, *whole)
    room = 0.03 * float(np.ptp(model, axis=0).max())
    hours = study.shadow_hours
    matters = hours >= max(study.up_hours * MATTERS, 1e-6)
    if matters.any():
        x, y = study.x[matters.any(0)], study.y[matters.any(1)]
        model = np.array([np.minimum(model[0], (x[0], y[0])), np.maximum(model[1], (x[-1], y[-1]))])
    for ring in (ring for area in plan.areas for ring in area.rings):
        model = np.array([np.minimum(model[0], ring.min(0)), np.maximum(model[1], ring.max(0))])
    if has_terrain(study.model.scene):  # beyond which nothing is visible
        return np.clip([model[0] - room, model[1] + room], *whole), (x1 - x0, y1 - y0)
    return np.array([model[0] - room, model[1] + room]), (np.inf, np.inf)


def _redraw(plan: Plan, seen: Study) -> Plan:
    """Return a plan with the cells of another study of it."""
    tile = seen.model.make_tile(seen.grid)
    canopies = tile.find_canopies()
    return replace(
        plan,
        x=seen.x,
        y=seen.y,
        building_height=np.nan_to_num(tile.drawn_heights).astype(np.float32),
        appearance=None
        if plan.appearance is None
        else find_grid_appearance(seen, seen.shadow_hours.shape),
        canopies=canopies if canopies.any() else None,
        nothing=tile.nothing if tile.nothing.any() else None,
    )


def _find_box(
    scene: Scene, study: Study, side: str, extent: Sequence[float] | None
) -> tuple[float, float, float, float]:
    """Return the extent of an elevation, from the ground up; along a plan's extent, if given."""
    view = Elevation.of(COMPASS[side], study.true_north)
    low, high = view.find_extent(scene)
    if extent is not None:
        x, y = np.array(extent)[[[0, 0, 2, 2], [1, 3, 1, 3]]]
        ends = np.column_stack([x, y, np.zeros(4)]) @ np.array(view.right)
        start, end = max(float(ends.min()), float(low[0])), min(float(ends.max()), float(high[0]))
        if start < end:
            tops = _find_tops(scene, np.array([view.right, view.up]), start, end)
            low, high = np.array([start, low[1]]), np.array([end, max(tops, study.ground)])
    room = _MARGIN * float(high[0] - low[0]) * (extent is None) + 1e-3
    top = max(float(high[1]), study.ground)
    top += min(_MARGIN * float(high[0] - low[0]) + 1e-3, 0.1 * float(high[1] - low[1]) + 1e-3)
    return float(low[0]) - room, study.ground, float(high[0]) + room, max(top, study.ground + room)


def _find_tops(scene: Scene, axes: NDArray[np.float64], start: float, end: float) -> float:
    """Return the greatest height of the triangles between two places along an elevation [m]."""
    soup = scene.triangles(scene.list_own())
    corners = (soup.vertices[soup.faces] + scene.origin) @ axes.T
    across = corners[..., 0]
    inside = (across.max(1) > start) & (across.min(1) < end)
    return float(corners[inside][..., 1].max(initial=-np.inf))
