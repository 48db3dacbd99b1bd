"""The foot of a study's pictures: how it was made, its accuracy, and what the frame cuts."""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from umbra.study import FinerHours, Study, StudyOptions
from umbra.study.finer import FinerSteps
from umbra.study.measures import Measure, guard
from umbra.sun.clock import say_hours
from umbra.writers.folder import FolderJob
from umbra.writers.picture_content import Plan

__all__ = [
    "describe_finer",
    "describe_foot",
    "describe_making",
    "describe_method",
    "list_few",
    "tell_cut",
    "tell_every",
    "tell_steps",
]


def _space(duration: object) -> str:
    """Write a duration with a space before its unit."""
    return re.sub(r"(?<=[0-9.])(?=[a-z])", " ", str(duration))


def describe_making(
    study: Study,
    options: StudyOptions,
    finer: FinerSteps | None = None,
    *,
    shows_hours: bool = True,
    measures: Sequence[Measure] | None = None,
) -> str:
    """
    Describe how a study was made and drawn, for the foot of its pictures.

    A profile shows no hours, only shadows at times that it names; ``measures`` are those that a
    picture shows instead of hours.
    """
    version = f"umbra {study.facts['umbra_version']}"
    cells = study.kind.tell_cells(study.grid, study.facts)
    ground = [str(study.facts["ground"])]
    shown = []
    if getattr(study.model, "asked", None) is not None:
        shown.append(f"hours of {list_few(options.on)} alone")
    elif options.on:  # without a word a shadow of what is not drawn looks like a wall
        shown.append(f"only {list_few(options.on)} and the ground are drawn, shaded by all casters")
    if study.period.horizon is not None:
        shown.append("the land around casts shadows")
    method = describe_method(study, options, finer, shows_hours=shows_hours, measures=measures)
    return " · ".join([version, cells, *ground, *shown, *method])


def describe_foot(
    study: Study,
    options: StudyOptions,
    finer: FinerSteps | None = None,
    *,
    shows_hours: bool = True,
    measures: Sequence[Measure] | None = None,
) -> str:
    """Describe how a study was made and drawn, and what its frame cuts of hours."""
    making = describe_making(study, options, finer, shows_hours=shows_hours, measures=measures)
    cut = tell_cut(study, shows_hours=shows_hours) if measures is None else ""
    return " · ".join(filter(None, [making, cut]))


def tell_cut(study: Any, *, shows_hours: bool = True) -> str:
    """Say that a plan's frame cuts shadows, and of one date how long they last there."""
    if not study.is_plan or not study.has_hours:
        return ""
    shown = np.isfinite(study.shadow_hours) & study.kind.find_open(study) & ~study.laid.is_built
    hours = np.where(shown, study.shadow_hours - study.period.land_hours, 0)
    most = max(float(side.max()) for side in (hours[0], hours[-1], hours[:, 0], hours[:, -1]))
    if not round(most, 3) > 0:  # of hours in float32
        return ""
    is_told = shows_hours and len(study.period.days) == 1
    told = f", where they last up to {say_hours(most)}" if is_told else ""
    return f"the frame cuts shadows{told}"


def describe_finer(plan: Plan, job: FolderJob, finer: Sequence[FinerHours | None]) -> Plan:
    """Return a plan whose caption tells the steps from which hours are drawn, if all are finer."""
    if None in finer:
        return plan
    return replace(plan, note=describe_foot(job.study, job.options, finer[0]))


def tell_every(options: StudyOptions, finer: FinerSteps | None) -> str:
    """Describe the time step from which hours are drawn."""
    if finer is None:
        return _space(options.every)
    return f"{finer.seconds / 60:g} min" if finer.seconds >= 60 else f"{finer.seconds:g} s"


def tell_steps(study: Study, options: StudyOptions, finer: FinerSteps | None = None) -> str:
    """Describe the time step from which hours are drawn, by default the study's, and its half."""
    half = float(study.period.hours.max()) * 30 if finer is None else finer.seconds / 120
    return f"every {tell_every(options, finer)}, ± {half:.3g} min"


def describe_method(
    study: Study,
    options: StudyOptions,
    finer: FinerSteps | None = None,
    *,
    shows_hours: bool = True,
    measures: Sequence[Measure] | None = None,
) -> list[str]:
    """Describe time steps or measures, accuracy, casters and the proposed development."""
    facts = study.facts
    notes = []
    if measures is None and not study.has_hours:
        measures = options.measures
    if measures is not None:
        notes = list(filter(None, (guard(one, one.tell, options) for one in measures)))
        notes = list(dict.fromkeys(notes))
    elif shows_hours and "exact_tolerance_seconds" in facts:
        notes = [f"instants solved to {facts['exact_tolerance_seconds']:g} s"]
    elif shows_hours:
        half = float(study.period.hours.max()) * 30
        every = tell_every(options, finer)
        if finer is not None:
            half = finer.seconds / 120
            every += f" (in {finer.kept} every {_space(options.every)})"
        notes = [f"sun every {every}, at the middle of each step"]
        if study.up_hours > 0:
            notes.append(f"hours ± {half:.3g} min for each edge of shadow that passes")
    if measures is None:
        radius = facts.get("sun_disc_deg")
        how = f"as a disc of {radius}\N{DEGREE SIGN} radius" if radius else "as a point source"
        notes.append(f"sun {how}, refraction {facts['refraction']}")
    chosen, left_out = options.cast, options.no_cast
    casters = f"shadows cast only by {list_few(chosen)}" if chosen else "all parts cast shadows"
    notes.append(casters + (f" but {list_few(left_out)}" if left_out else ""))
    if options.canopy:
        notes.append(_describe_canopy(options.canopy, facts))
    if options.proposed:
        gone = list_few(str(facts.get("replaced", "")).split(", "))
        instead = f" instead of {gone}, which is there before" if gone else ""
        notes.append(f"proposed: {list_few(options.proposed)}{instead}")
    return notes


def _describe_canopy(patterns: Sequence[str], facts: dict[str, Any]) -> str:
    """Describe what share of the light canopies transmit."""
    shares = [f"{100 * share:.3g}" for share in np.atleast_1d(facts["canopy_transmissivity"])]
    leaves = f" with leaves, {shares[-1]} % without" if len(shares) > 1 else ""
    return f"{list_few(patterns)}: {shares[0]} % of the light comes through{leaves}"


def list_few(names: Sequence[str], most: int = 3) -> str:
    """List the first names and the number of the others."""
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "")
