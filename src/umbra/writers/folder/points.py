"""Pictures of a study of sampled surfaces or of single points."""

from dataclasses import replace

import numpy as np

from umbra.receivers.zenith import find_surface
from umbra.scene.grid import Grid
from umbra.study import run, split_dates, tell_dates
from umbra.writers.folder.captions import describe_method, describe_place, name_dates, name_files
from umbra.writers.folder.dates import Scale, choose_panels, name_shown, tell_daylight
from umbra.writers.folder.outputs import FolderJob
from umbra.writers.folder.pictures import draw_pictures
from umbra.writers.plan import DayMap, Plan

__all__ = ["describe_points", "draw_plan_of_points", "draw_surfaces"]

_TILT = 35
_ROOM = 12.0  # about points, at least [m]
_CELLS = 1200  # along the plan of points


def draw_surfaces(job: FolderJob) -> list[str]:
    """Draw the model with its hours in shadow, seen from above on the sunny side."""
    site, options = job.study.site, job.options
    azimuth = 215 if site.latitude >= 0 else 325
    options = options.ask_hours(f"{azimuth}/{_TILT}")
    seen = run(job.scene, site, options)
    return draw_pictures(replace(job, study=seen, options=options)).names


def draw_plan_of_points(job: FolderJob) -> list[str]:
    """Draw the points on a plan of the buildings around them, coloured by their hours."""
    study, scene, painter = job.study, job.scene, job.painter
    points, origin = study.places.points, scene.origin
    low, high = points[:, :2].min(0), points[:, :2].max(0)
    room = max(0.12 * float((high - low).max()), _ROOM)
    cell = float((high - low).max() + 2 * room) / _CELLS
    cols, rows = (int(n) for n in np.ceil((high - low + 2 * room) / cell))
    west, south = (float(v) for v in low - room + cell / 2 - origin[:2])
    grid = Grid(west, south, cell, cell, cols, rows)
    ground = scene.ground if job.options.ground is None else job.options.ground
    level = float(scene.bounds()[0, 2] if ground is None else ground) - origin[2]
    heights = find_surface(study.model.soup, grid, level).heights - level
    plan = replace(
        describe_points(job),
        x=grid.x + origin[0],
        y=grid.y + origin[1],
        building_height=heights.astype(np.float32),
        true_north=study.site.true_north,
    )
    names = study.more["name"][1].tolist() if "name" in study.more else []
    path, normals = job.folder / "points.png", study.places.normals
    dates, scale = split_dates(study), Scale.of(job)
    if len(dates) == 1:
        painter.draw_points(
            path, plan, points, normals, scale.read_hours(study), scale.most, names, scale.show,
            scale.what,
        )  # fmt: skip
        return [path.name]
    maps = [
        DayMap(tell_dates(one), tell_daylight(one), scale.read_hours(one))
        for one in (dates[k] for k in choose_panels(study))
    ]
    painter.draw_point_panels(
        path, name_shown(plan, study), points, normals, maps, scale.most, names, scale.show,
        scale.what,
    )  # fmt: skip
    return [path.name]


def describe_points(job: FolderJob) -> Plan:
    """Describe surfaces or points for a report."""
    study, options, outputs = job.study, job.options, job.outputs
    what, spot = "points", f"{len(study.shadow_hours):,} points"
    if study.samples is not None:
        what, spot = "walls and roofs", f"samples {study.samples.spacing:g} m apart"
    steps = study.period.steps
    offsets = "/".join(sorted({offset for day in steps for offset in day.offsets()}))
    dates = name_dates(study.period.days)
    nowhere = np.zeros(1)
    return Plan(
        nowhere,
        nowhere,
        title=outputs.title or f"{name_files(job.scene)}, {what}",
        subtitle=outputs.subtitle or "",
        place=describe_place(study.site),
        date=f"{dates}, {options.start} to {options.end} ({offsets})",
        note=" · ".join(
            [f"umbra {study.facts['umbra_version']}", spot, *describe_method(study, options)]
        ),
    )
