"""The pictures of ``umbra study``: which are drawn, and of what."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from umbra.cli.captions import describe, list_few
from umbra.scene import Scene
from umbra.study import Preview, Study, make_preview
from umbra.study.moments import choose_stamps
from umbra.study.preview import LONGEST
from umbra.sun.stamps import Stamps
from umbra.writers.painter import Painter
from umbra.writers.plan import Plan, Show, find_map_size

__all__ = ["Sheets", "draw_pictures"]

MOST_DAYS = 4
"""Of so many dates each has its own pictures besides those of all together."""
MOST_PANELS = 12
"""Dates of which profile.png has a panel; of more, every n-th."""


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


def draw_pictures(
    study: Study, scene: Scene, options: dict[str, Any], painter: Painter, folder: Path
) -> Sheets:
    """
    Have the hours and the profile drawn; of few dates those of each date, too.

    Parameters
    ----------
    study : Study
    scene : Scene
    options : dict
        Of the command.
    painter : Painter
    folder : Path
    """
    days = study.period.days
    preview = make_preview(study, steps=choose_stamps(study.steps, options["at"]))
    plan = describe(study, preview, scene, options, range(len(days)))
    if study.receivers != "ground":
        from umbra.writers.edges import make_look  # noqa: PLC0415

        plan = replace(plan, look=make_look(study, find_map_size(plan)))
    show = options["show"]
    _draw_hours(
        painter, folder / "hours.png", plan, study, study.shadow_hours, study.up_hours, show
    )
    names = ["hours.png", "profile.png"]
    if "hours_lost" in study.more and _draw_lost(
        painter, folder, plan, study, scene, preview, options
    ):
        names.append("hours_lost.png")
    names += _draw_days(painter, folder, plan, study, scene, preview, options)
    return Sheets(plan, preview, names)


def _draw_lost(
    painter: Painter,
    folder: Path,
    plan: Plan,
    study: Study,
    scene: Scene,
    preview: Preview,
    options: dict[str, Any],
) -> bool:
    """Have drawn what the proposal takes away, close up, and the proposal outlined."""
    lost = _coarsen(study.more["hours_lost"][1], plan.shape)
    most = float(np.nanmax(lost, initial=0.0))
    if most <= 0:
        return False
    new = np.isin(preview.find_parts(), list(scene.select(options["proposed"])))
    plan = replace(plan, proposed=new)
    if study.is_plan and options["extent"] is None:
        where = _find_window((np.nan_to_num(lost) > 0) | new)
        plan, lost = plan.crop(where), lost[where]
        if plan.look is not None:
            from umbra.writers.edges import make_look  # noqa: PLC0415

            part = study.grid.coarser(LONGEST).part(*where)
            plan = replace(plan, look=make_look(study, find_map_size(plan), part))
    painter.draw_hours(
        folder / "hours_lost.png", plan, lost, most,
        receivers=_kind(study), what=f"hours of sun lost to {list_few(options['proposed'])}",
    )  # fmt: skip
    return True


def _find_window(is_shown: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Give the rows and columns about some cells, a quarter of their length around them."""
    window = []
    room = round(0.25 * max(np.ptp(np.flatnonzero(is_shown.any(axis))) for axis in (0, 1))) + 1
    for axis in (1, 0):
        found = np.flatnonzero(is_shown.any(axis))
        end = min(int(found[-1]) + 1 + room, is_shown.shape[1 - axis])
        window.append(slice(max(int(found[0]) - room, 0), end))
    return window[0], window[1]


def _draw_days(
    painter: Painter,
    folder: Path,
    plan: Plan,
    study: Study,
    scene: Scene,
    preview: Preview,
    options: dict[str, Any],
) -> list[str]:
    """Have the profile drawn, a panel for each date; of few dates pictures of each, too."""
    days = study.period.days
    if len(days) == 1:
        stamps = choose_stamps(study.steps, options["at"])
        _draw_profile(painter, folder / "profile.png", plan, study, preview, stamps)
        return []
    shown = range(0, len(days), -(-len(days) // MOST_PANELS))
    longest = round(LONGEST / math.sqrt(len(shown)))
    steps = [choose_stamps(each, options["at"]) for each in study.period.steps]
    views = [make_preview(study, longest, steps[k]) for k in shown]
    zones = dict.fromkeys(name for k in shown for name in steps[k].abbreviations())
    whole = replace(plan, x=views[0].x, y=views[0].y, building_height=views[0].heights)  # type: ignore[arg-type]
    date = plan.date.replace(" + ", ", ")  # side by side, not added up
    if len(shown) < len(days):
        date = f"{len(shown)} of {date}"
    whole = replace(whole, date=date)
    painter.draw_profiles(
        folder / "profile.png", whole,
        [(str(days[k]), view.shadows, steps[k].labels()) for k, view in zip(shown, views)],
        zone="/".join(zones), receivers=_kind(study),
    )  # fmt: skip
    by_day = study.more.get("shadow_hours_by_day")
    names: list[str] = []
    show = options["show"]
    if by_day is None or len(days) > MOST_DAYS:
        return names
    for k, day in enumerate(days):
        of_day = preview if k == 0 else make_preview(study, steps=steps[k])
        own = replace(describe(study, of_day, scene, options, range(k, k + 1)), look=plan.look)
        up = float(study.more["up_hours_by_day"][1][k])
        _draw_profile(painter, folder / f"profile_{day}.png", own, study, of_day, steps[k])
        _draw_hours(painter, folder / f"hours_{day}.png", own, study, by_day[1][k], up, show)
        names += [f"hours_{day}.png", f"profile_{day}.png"]
    return names


def _kind(study: Study) -> Literal["ground", "top"]:
    return "ground" if study.receivers == "ground" else "top"


def _draw_hours(
    painter: Painter,
    path: Path,
    plan: Plan,
    study: Study,
    hours: NDArray[np.float32],
    up_hours: float,
    show: Show,
) -> None:
    painter.draw_hours(
        path, plan, _coarsen(hours, plan.shape), up_hours, receivers=_kind(study), show=show
    )


def _draw_profile(
    painter: Painter, path: Path, plan: Plan, study: Study, preview: Preview, stamps: Stamps
) -> None:
    zone = "/".join(dict.fromkeys(stamps.abbreviations()))
    painter.draw_profile(
        path, plan, preview.shadows, stamps.labels(), zone=zone, receivers=_kind(study)
    )


def _coarsen(hours: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Average hours to the cells of the pictures."""
    if hours.shape == shape:
        return hours
    from umbra.writers.raster import resample  # noqa: PLC0415

    return resample(hours, shape)
