"""The words around a study's pictures: site, dates, method, accuracy, casters."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.view import Elevation
from umbra.scene import Scene
from umbra.study import FinerHours, Preview, Study
from umbra.writers.plan import Plan

__all__ = [
    "describe",
    "describe_finer",
    "describe_making",
    "describe_method",
    "describe_place",
    "list_few",
    "name_dates",
    "name_files",
    "place_elevation",
]

_UPRIGHT = 1e-9  # level way to the target of a camera that looks straight down [m]
FEW = 4  # dates that are named one by one


def describe(
    study: Study, preview: Preview, scene: Scene, options: dict[str, Any], which: range
) -> Plan:
    """
    Say in words what the pictures of some days show.

    Parameters
    ----------
    study : Study
    preview : Preview
    scene : Scene
    options : dict
        Of the command.
    which : range
        Of the study's days.
    """
    period = study.period
    dates = name_dates(period.days[which.start : which.stop])
    each = [offset for k in which for offset in period.steps[k].offsets()]
    offsets = "/".join(sorted(set(each)))
    canopies = preview.find_canopies() if options.get("canopy") else None
    x, y, axes = _find_axes(study, preview)
    north, upward = _find_north(study)
    view = _name_view(study, options)
    told = view.removeprefix(", ") if options["title"] else ""
    return Plan(
        x,
        y,
        preview.heights,  # type: ignore[arg-type]
        true_north=north,
        upward=upward,
        title=options["title"] or name_files(scene) + view,
        subtitle=options["subtitle"] or "",
        place=describe_place(study.site),
        date=" · ".join(
            filter(None, [told, f"{dates}, {options['start']} to {options['end']} ({offsets})"])
        ),
        note=describe_making(study, options),
        axes=axes,
        has_scale=study.receivers != "camera",
        canopies=canopies if canopies is not None and canopies.any() else None,
        roofs_cover=study.kind.lies_under_roofs,
        canopy_name=f"{list_few(options['canopy'], 1)}, looked through"
        if canopies is not None
        else "",
    )


def _find_axes(
    study: Study, preview: Preview
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[str, str]]:
    """Give the pictures' coordinates and what to call them; those of an elevation begin at 0."""
    if study.is_plan:
        return preview.x, preview.y, ("x [m]", "y [m]")
    if study.receivers != "elevation":
        return preview.x, preview.y, ("", "")
    x, y = place_elevation(study, preview.x, preview.y)
    label = f"along the facade [m], from its left end; heights above z = {study.ground:.6g} m"
    return x, y, (label, "height [m]")


def place_elevation(
    study: Study, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Measure an elevation from the left end of what it shows, and from the ground.

    Parameters
    ----------
    study : Study
        Of an elevation.
    x, y : (n,) float64
        Along the view, and z, in the model's own coordinates [m].

    Returns
    -------
    x, y : (n,) float64
        From there [m].
    """
    model = study.model
    azimuth = float(study.facts["view_azimuth_deg"])  # type: ignore[arg-type]
    view = Elevation.of(azimuth, study.site.true_north)
    left = view.find_extent(model.scene, getattr(model, "shown", None))[0, 0]
    # What an extent cuts off does not count.
    return x - max(left, float(x[0]) - study.grid.dx / 2), y - study.ground


def name_files(scene: Scene) -> str:
    """Name the files of a scene, the first three."""
    named = [Path(source.name).name for source in scene.sources if not source.is_companion]
    return " + ".join(named[:3]) + (f" and {len(named) - 3} more" if len(named) > 3 else "")


def name_dates(days: Sequence) -> str:
    """Say which dates a study has."""
    if len(days) <= FEW:
        return ", ".join(map(str, days))
    return f"{len(days)} days from {days[0]} to {days[-1]}"


def describe_place(site: Any) -> str:
    """Say where a site is, and by which clock."""
    north = "N" if site.latitude >= 0 else "S"
    east = "E" if site.longitude >= 0 else "W"
    return f"{abs(site.latitude):.3f}° {north}, {abs(site.longitude):.3f}° {east} · {site.zone}"


def describe_making(study: Study, options: dict[str, Any]) -> str:
    """Say how a study was made, for the foot of its pictures; parameters as ``describe`` has."""
    version = f"umbra {study.facts['umbra_version']}"
    return " · ".join([version, _describe_cells(study), *describe_method(study, options)])


def describe_finer(plan: Plan, finer: FinerHours | None) -> Plan:
    """Say below a picture from which steps its contours are drawn, if not from the study's."""
    if finer is None:
        return plan
    minutes = finer.seconds / 60
    step = f"{minutes:g}min" if minutes >= 1 else f"{finer.seconds:g}s"
    return replace(plan, note=f"{plan.note} · contours from steps of {step}")


def describe_method(study: Any, options: dict[str, Any]) -> list[str]:
    """
    Say how instants were judged and how exact hours are, what casts, and what is proposed.

    Parameters
    ----------
    study : Study
    options : dict
        Of the command.
    """
    facts = study.facts
    if "exact_tolerance_seconds" in facts:
        notes = [f"instants solved to {facts['exact_tolerance_seconds']:g} s"]
    else:
        half = float(study.period.hours.max()) * 30
        notes = [
            f"midpoints of {options['every']} steps",
            f"hours ± {half:.3g} min for each edge of shadow that passes",
        ]
    notes.append(f"sun as a point source, refraction {facts['refraction']}")
    chosen, left_out = options.get("cast") or (), options.get("no_cast") or ()
    casters = f"shadows cast only by {list_few(chosen)}" if chosen else "all parts cast shadows"
    notes.append(casters + (f" but {list_few(left_out)}" if left_out else ""))
    if options.get("canopy"):
        notes.append(_describe_canopy(options["canopy"], facts))
    if options.get("proposed"):
        notes.append(f"proposed: {list_few(options['proposed'])}")
    return notes


def _describe_canopy(patterns: Sequence[str], facts: dict[str, Any]) -> str:
    """Say what share of the light canopies let through."""
    shares = [f"{100 * share:.3g}" for share in np.atleast_1d(facts["canopy_transmissivity"])]
    leaves = f" with leaves, {shares[-1]} % without" if len(shares) > 1 else ""
    return f"{list_few(patterns)}: {shares[0]} % of the light comes through{leaves}"


def list_few(names: Sequence[str], most: int = 3) -> str:
    """List names, the rest by their number."""
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "")


def _describe_cells(study: Study) -> str:
    grid, facts = study.grid, study.facts
    if study.receivers == "camera":
        eye, target = (
            ", ".join(f"{float(v):.6g}" for v in np.asarray(facts[name]).ravel())
            for name in ("eye", "target")
        )
        return f"from {eye} toward {target}, {facts['fov_deg']:g}° high"
    cell = f"{grid.dx:.4g} m" if grid.dx == grid.dy else f"{grid.dx:.4g} x {grid.dy:.4g} m"
    return f"cells of {cell}, exact at their centres"


def _name_view(study: Study, options: dict[str, Any]) -> str:
    """Say from where the model is seen, if not from above."""
    if study.receivers == "view":
        azimuth, tilt = (study.facts[f"view_{name}_deg"] for name in ("azimuth", "tilt"))
        return f", seen from azimuth {azimuth:g}°, looking down {tilt:g}°"
    if study.receivers == "elevation":
        receivers = options["receivers"]
        name = "the " + receivers if receivers.isalpha() else f"azimuth {float(receivers):g}°"
        return f", elevation from {name}"
    if study.receivers == "camera":
        return ", a camera\N{RIGHT SINGLE QUOTATION MARK}s view"
    return ""


def _find_north(study: Study) -> tuple[float | None, float]:
    """Give where true north points in the picture, and how foreshortened the ground is."""
    facts, true_north = study.facts, study.site.true_north
    if study.is_plan:
        return true_north, 1.0
    if study.receivers == "elevation":
        return None, 1.0
    if study.receivers == "view":
        azimuth, tilt = (
            float(facts[f"view_{name}_deg"])  # type: ignore[arg-type]
            for name in ("azimuth", "tilt")
        )
        return 180.0 - azimuth, math.sin(math.radians(tilt))
    way = np.asarray(facts["target"]) - np.asarray(facts["eye"])
    level = math.hypot(way[0], way[1])
    if level < _UPRIGHT:
        return None, 1.0
    toward = math.degrees(math.atan2(way[0], way[1]))
    return true_north - toward, abs(way[2]) / math.hypot(level, way[2])
