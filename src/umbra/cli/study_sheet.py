"""``umbra study --sheet``: the plan and its four elevations, counted for one sheet."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.cli.shown_dates import Scale, choose_panels, tell_daylight
from umbra.cli.study_points import POINTS_ONLY, QUESTIONS
from umbra.scene import Scene
from umbra.study import Study, run_study, split_dates, tell_dates
from umbra.study.views import COMPASS, Elevation
from umbra.writers.edges import make_look
from umbra.writers.elevations import arrange, find_pixel
from umbra.writers.plan import Plan
from umbra.writers.raster import resample

__all__ = ["draw_sheet"]

_SIDES = ("south", "east", "north", "west")
_MARGIN = 0.03  # of an elevation's length, on each side of it


def draw_sheet(
    study: Study, scene: Scene, plan: Plan, options: dict[str, Any], painter: Any, folder: Path
) -> list[str]:
    """
    Count four elevations at the resolution of a sheet, and have it drawn.

    Parameters
    ----------
    study : Study
        Of a plan.
    scene : Scene
    plan : Plan
        Of its hours.
    options : dict
        Of the command.
    painter : Painter
    folder : Path

    Returns
    -------
    names : list of str
        Of the file; of several dates, of one for each, all on one scale.
    """
    boxes = [_find_box(scene, study, side) for side in _SIDES]
    x0, x1, y0, y1 = plan.extent
    sizes = [(float(box[2] - box[0]), float(box[3] - box[1])) for box in boxes]
    arrangement = arrange((x1 - x0, y1 - y0), sizes)
    cell = find_pixel(arrangement)
    kept = {n: v for n, v in options.items() if n not in {*POINTS_ONLY, *QUESTIONS}}
    plans, scale = split_dates(study), Scale.of(study, options)
    sides = []
    for side, box in zip(_SIDES, boxes, strict=True):
        view = {**kept, "receivers": side, "extent": box, "cell": cell, "size": None}
        seen = run_study(scene, study.site, by_day=len(plans) > 1, **view)
        heights = np.nan_to_num(seen.heights + 1).astype(np.float32)
        elevation = Plan(
            seen.x, seen.y, heights, None, axes=("", "z [m]"), look=make_look(seen, heights.shape)
        )
        sides.append((f"{side.capitalize()} elevation", elevation, split_dates(seen)))
    names = []
    for k in choose_panels(study) if len(plans) > 1 else (0,):
        own, name = plan, "sheet.png"
        if len(plans) > 1:
            date = tell_dates(plans[k])
            clock = f"{options['start']} to {options['end']}"
            own = replace(plan, date=f"{date}, {clock} · {tell_daylight(plans[k])}")
            name = f"sheet_{date}.png"
        maps = [("Plan", own, _fit(scale.read_hours(plans[k]), plan.shape))]
        maps += [(caption, view, scale.read_hours(seen[k])) for caption, view, seen in sides]
        painter.draw_elevations(
            folder / name, arrangement, maps, scale.most, receivers=study.receivers,
            show=scale.show, what=scale.what,
        )  # fmt: skip
        names.append(name)
    return names


def _fit(hours: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Average hours to the cells of the picture."""
    return hours if hours.shape == shape else resample(hours, shape)


def _find_box(scene: Scene, study: Study, side: str) -> tuple[float, float, float, float]:
    """Give the extent of an elevation, from the ground up."""
    low, high = Elevation.of(COMPASS[side], study.site.true_north).find_extent(scene)
    room = _MARGIN * float(high[0] - low[0]) + 1e-3
    top = max(float(high[1]), study.ground) + min(room, 0.1 * float(high[1] - low[1]) + 1e-3)
    return float(low[0]) - room, study.ground, float(high[0]) + room, max(top, study.ground + room)
