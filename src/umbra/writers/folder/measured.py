"""The pictures of a study's measures besides hours: a map of each, with what a proposal takes."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import make_preview
from umbra.study.measures import Quantity
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import describe
from umbra.writers.folder.context import add_context
from umbra.writers.folder.foot import list_few
from umbra.writers.folder.pictures import lay_out_points
from umbra.writers.measure_map import find_end
from umbra.writers.picture_content import Plan, find_map_size
from umbra.writers.pixels import resample

__all__ = ["draw_measures"]

_MOST = 4
"""Maps of a measure that is told by caster."""


def draw_measures(job: FolderJob, plan: Plan | None = None) -> list[str]:
    """
    Draw a map of each measure; beside a proposal, also of what it takes.

    Parameters
    ----------
    job : FolderJob
        Of surfaces, as ``look_at_surfaces`` returns it.
    plan : Plan, optional
        Of a raster's pictures, if it is made already.

    Returns
    -------
    names : list of str
        Of the files.
    """
    kind = job.study.kind
    if not kind.is_raster and job.study.samples is None:
        return _draw_points(job)
    plan = _describe(job, plan)
    names = []
    for one, values in _list_drawn(job):
        shown = values if values.shape == plan.shape else resample(values, plan.shape)
        names.append(f"{one.name}.png")
        job.painter.draw_measure(job.folder / names[-1], plan, shown, one, find_end(one, values))
    return names


def _describe(job: FolderJob, plan: Plan | None) -> Plan:
    """Describe the maps of measures; those of no sun have no dates."""
    study = replace(job.study, has_hours=False)
    needs_sun = any(one.needs_sun for one in job.options.measures)
    days = range(len(study.period.days) if needs_sun else 0)
    drawn = describe(replace(job, study=study), make_preview(study), days)
    appearance = None if plan is None else plan.appearance
    if appearance is None and job.outputs.endings and not study.kind.is_level:
        from umbra.writers.edges import find_grid_appearance  # noqa: PLC0415

        appearance = find_grid_appearance(study, find_map_size(drawn))
    drawn = add_context(job, drawn) if study.kind.is_plan else drawn
    return replace(drawn, appearance=appearance)


def _list_drawn(job: FolderJob) -> list[tuple[Quantity, NDArray[np.float32]]]:
    """List the variables that have a map, and those of what a proposal takes where it takes any."""
    found: list[tuple[Quantity, NDArray[np.float32]]] = []
    more = job.study.more
    for one in job.study.quantities:
        if not one.is_drawn:
            continue
        values = np.asarray(more[one.name][1], np.float32)
        if one.per:
            found += _pick(one, values, np.asarray(more[one.per][1]).tolist())
            continue
        if not np.nanmax(np.abs(values), initial=0.0) > 0:
            job.say(f"note: {one.name} is 0 everywhere; it has no map")
            continue
        found.append((one, values))
        lost = more.get(f"{one.name}_lost")
        if lost is not None and np.nanmax(lost[1], initial=0.0) > 0:
            of_loss = one.of_loss(list_few(job.options.proposed))
            found.append((of_loss, np.asarray(lost[1], np.float32)))
    return found


def _pick(
    one: Quantity, values: NDArray[np.float32], names: list[str]
) -> list[tuple[Quantity, NDArray[np.float32]]]:
    """Return the groups whose mean is largest, as maps of their own by rank."""
    known = np.isfinite(values)
    mean = np.where(known, values, 0.0).reshape(len(values), -1).mean(1)
    order = [k for k in np.argsort(-mean, kind="stable")[:_MOST] if mean[k] > 0]
    return [
        (replace(one, name=f"{one.name}_{n}", long_name=f"{one.long_name}: {names[k]}"), values[k])
        for n, k in enumerate(order, 1)
    ]


def _draw_points(job: FolderJob) -> list[str]:
    """Draw points on a plan of the buildings around them."""
    plan = add_context(job, lay_out_points(job))
    more: Any = job.study.more
    labels = more["name"][1].tolist() if "name" in more else []
    names = []
    for one, values in _list_drawn(job):
        names.append(f"{one.name}.png")
        job.painter.draw_measured_points(
            job.folder / names[-1], plan, job.study.places, values, one, find_end(one, values),
            labels,
        )  # fmt: skip
    return names
