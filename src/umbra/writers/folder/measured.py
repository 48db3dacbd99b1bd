"""The pictures of a study's measures besides hours: a map of each, with what a proposal takes."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import Preview, make_preview
from umbra.study.measures import Measure, Quantity, guard
from umbra.writers.folder import FolderJob
from umbra.writers.folder.captions import describe, name_picture
from umbra.writers.folder.drawn_context import add_context
from umbra.writers.folder.foot import list_few
from umbra.writers.folder.pictures import lay_out_points, name_points
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
    preview, names = make_preview(job.study), []
    for measure in job.options.measures:
        drawn = _list_drawn(job, measure)
        if not drawn:
            continue
        days = _list_days(job, measure)
        plan = _describe(job, measure, days, preview, plan)
        for one, values, is_lost in drawn:
            own = replace(plan, title=name_picture(job, days, one.long_name))
            if is_lost and plan.proposed is None:
                new = preview.find_cells(job.scene.select(job.options.proposed))
                own = replace(own, proposed=new)
            shown = values if values.shape == plan.shape else resample(values, plan.shape)
            names.append(f"{one.name}.png")
            path, end = job.folder / names[-1], find_end(one, values)
            job.painter.draw_measure(path, own, shown, one, end)
    return names


def _list_days(job: FolderJob, measure: Measure) -> range:
    """Return the indices of the dates that a measure's map is of: none without the sun."""
    return range(len(job.study.period.days) if measure.needs_sun else 0)


def _describe(
    job: FolderJob, measure: Measure, days: range, preview: Preview, plan: Plan | None
) -> Plan:
    """Describe the maps of a measure; one of no sun has no dates."""
    study = job.study
    drawn = describe(job, preview, days, [measure])
    appearance = None if plan is None else plan.appearance
    if appearance is None and job.outputs.endings and not study.kind.is_level:
        from umbra.writers.edges import find_grid_appearance  # noqa: PLC0415

        appearance = find_grid_appearance(study, find_map_size(drawn))
    drawn = add_context(job, drawn) if study.kind.is_plan else drawn
    return replace(drawn, appearance=appearance)


def _list_drawn(
    job: FolderJob, measure: Measure
) -> list[tuple[Quantity, NDArray[np.float32], bool]]:
    """List a measure's maps, and whether each is of what a proposal takes, where it takes any."""
    found: list[tuple[Quantity, NDArray[np.float32], bool]] = []
    more = job.study.more
    for one in guard(measure, lambda: measure.quantities):
        if not one.is_drawn:
            continue
        values = np.asarray(more[one.name][1], np.float32)
        if one.per:
            each = _pick(one, values, np.asarray(more[one.per][1]).tolist())
            found += [(of_caster, own, False) for of_caster, own in each]
            continue
        if not np.nanmax(np.abs(values), initial=0.0) > 0:
            job.say(f"note: {one.name} is 0 everywhere; it has no map")
            continue
        found.append((one, values, False))
        lost = more.get(f"{one.name}_lost")
        if lost is not None and np.nanmax(lost[1], initial=0.0) > 0:
            of_loss = one.of_loss(list_few(job.options.proposed))
            found.append((of_loss, np.asarray(lost[1], np.float32), True))
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
    more: Any = job.study.more
    labels = more["name"][1].tolist() if "name" in more else []
    names = []
    for measure in job.options.measures:
        drawn = _list_drawn(job, measure)
        if not drawn:
            continue
        days = _list_days(job, measure)
        plan = add_context(job, lay_out_points(job, [measure]))
        for one, values, _ in drawn:
            plan = replace(plan, title=name_points(job, days, one.long_name))
            names.append(f"{one.name}.png")
            path, end, places = job.folder / names[-1], find_end(one, values), job.study.places
            job.painter.draw_measured_points(path, plan, places, values, one, end, labels)
    return names
