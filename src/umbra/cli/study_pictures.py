"""The pictures of ``umbra study``: what is drawn, and the words around it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Scene
from umbra.study import Preview, Study, make_preview
from umbra.writers.painter import Painter
from umbra.writers.plan import Plan

__all__ = ["Sheets", "draw_pictures"]

MOST_DAYS = 4
"""Of so many dates each has its own pictures besides those of all together."""
_AXES = {
    "x": "x [m]",
    "y": "y [m]",
    "along": "along the view [m]",
    "z": "z [m]",
    "up": "upward [m]",
}


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
    preview = make_preview(study)
    plan = _describe(study, preview, scene, options, range(len(days)))
    _draw_hours(painter, folder / "hours.png", plan, study, study.shadow_hours, study.up_hours)
    names = ["hours.png", "profile.png"]
    if "hours_lost" in study.more:
        lost = study.more["hours_lost"][1]
        most = float(np.nanmax(lost, initial=0.0))
        if most > 0:
            painter.draw_hours(
                folder / "hours_lost.png", plan, _coarsen(lost, plan.shape), most,
                receivers=_kind(study), what="hours of sun lost",
            )  # fmt: skip
            names.append("hours_lost.png")
    by_day = study.more.get("shadow_hours_by_day")
    each = len(days) if by_day is not None and 1 < len(days) <= MOST_DAYS else 0
    for k in range(max(each, 1)):
        of_day = preview if k == 0 else make_preview(study, steps=study.period.steps[k])
        own = _describe(study, of_day, scene, options, range(k, k + 1))
        name = f"profile_{days[k]}.png" if each else "profile.png"
        _draw_profile(painter, folder / name, own, study, of_day, k)
        if k == 0 and each:
            _draw_profile(painter, folder / "profile.png", own, study, of_day, k)
        if each and by_day is not None:
            up = float(study.more["up_hours_by_day"][1][k])
            _draw_hours(painter, folder / f"hours_{days[k]}.png", own, study, by_day[1][k], up)
            names += [f"hours_{days[k]}.png", name]
    return Sheets(plan, preview, names)


def _kind(study: Study) -> Literal["ground", "top"]:
    return "ground" if study.receivers == "ground" else "top"


def _draw_hours(
    painter: Painter,
    path: Path,
    plan: Plan,
    study: Study,
    hours: NDArray[np.float32],
    up_hours: float,
) -> None:
    painter.draw_hours(path, plan, _coarsen(hours, plan.shape), up_hours, receivers=_kind(study))


def _draw_profile(
    painter: Painter, path: Path, plan: Plan, study: Study, preview: Preview, day: int
) -> None:
    steps = study.period.steps[day]
    zone = "/".join(dict.fromkeys(steps.abbreviations()))
    painter.draw_profile(
        path, plan, preview.shadows, steps.labels(), zone=zone, receivers=_kind(study)
    )


def _coarsen(hours: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Average hours to the cells of the pictures."""
    if hours.shape == shape:
        return hours
    from umbra.writers.raster import resample  # noqa: PLC0415

    return resample(hours, shape)


def _name_dates(days: tuple) -> str:
    """Say which dates a study's hours are the sum of."""
    if len(days) <= MOST_DAYS:
        return " + ".join(map(str, days))
    return f"{len(days)} days from {days[0]} to {days[-1]}"


def _describe(
    study: Study, preview: Preview, scene: Scene, options: dict[str, Any], which: range
) -> Plan:
    """Say in words what the pictures of some days show."""
    dates = _name_dates(study.period.days[which.start : which.stop])
    site, facts = study.site, study.facts
    north = "N" if site.latitude >= 0 else "S"
    east = "E" if site.longitude >= 0 else "W"
    grid = study.grid
    cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
    each = [offset for k in which for offset in study.period.steps[k].offsets()]
    offsets = "/".join(sorted(set(each)))
    named = [Path(source.name).name for source in scene.sources if not source.is_companion]
    title = " + ".join(named[:3])
    notes = [f"umbra {facts['umbra_version']}", f"cell {cell}"]
    if study.receivers == "view":
        title += f", seen from {study.facts['view_azimuth_deg']:g}° and above"
    elif study.receivers == "elevation":
        title += f", elevation from {_name_azimuth(options['receivers'])}"
    elif study.receivers == "camera":
        title += ", a camera\N{RIGHT SINGLE QUOTATION MARK}s view"
        notes.pop()
    if "exact_tolerance_seconds" in facts:
        notes.append(f"instants solved to {facts['exact_tolerance_seconds']:g} s")
    else:
        notes.append(f"midpoints of {options['every']} steps")
    notes.append(f"refraction {facts['refraction']}")
    rows, cols = study.dims
    return Plan(
        preview.x,
        preview.y,
        preview.heights,  # type: ignore[arg-type]
        true_north=site.true_north if study.is_plan else None,
        title=title,
        place=(
            f"{abs(site.latitude):.3f}° {north}, {abs(site.longitude):.3f}° {east} · {site.zone}"
        ),
        date=f"{dates}, {options['start']} to {options['end']} ({offsets})",
        note=" · ".join(notes),
        axes=(_AXES.get(cols, "pixels"), _AXES.get(rows, "pixels")),
    )


def _name_azimuth(receivers: str) -> str:
    return receivers if receivers.isalpha() else f"{float(receivers):g}°"
