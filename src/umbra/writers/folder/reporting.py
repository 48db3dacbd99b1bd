"""The report of a folder: its sentences, its map in the steps of the pictures, all sheets."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from umbra.casters.casting import select_casters
from umbra.errors import write_for_shell
from umbra.study import split_dates
from umbra.study.timeline import Timeline
from umbra.writers.folder import FolderJob
from umbra.writers.folder.loss_maps import count_dates, count_lost
from umbra.writers.folder.summary import tell_answers
from umbra.writers.picture_content import Plan, name_hours
from umbra.writers.report import write_report
from umbra.writers.report.measure_tables import caption_measures, list_measures
from umbra.writers.report.vector_map import MOST_DATES, pack_vector_map

if TYPE_CHECKING:
    from umbra.writers.report.markup import Table

__all__ = ["write_job_report"]


def write_job_report(
    job: FolderJob, path: Path, plan: Plan, tables: Sequence["Table"], timeline: Timeline | None
) -> None:
    """Write the report of a study; pictures that are not drawn yet are waited for."""
    study, options, show = job.study, job.options, job.outputs.show or "sun"
    write_report(
        path, study, plan, _find_sheets(job),
        tables=tables, casters=_name_casters(job), notes=job.scene.notes,
        timeline=timeline, show=show,
        answers=tell_answers(study, options.proposed, effect_first=True), proposed=options.proposed,
        obstructing=select_casters(study.model.scene, options.cast, options.no_cast),
        fine=_count_map(job, plan), measured=list_measures(study, options),
    )  # fmt: skip


def _count_map(job: FolderJob, plan: Plan) -> dict[str, object] | None:
    """Count the hours of the map in the steps of the pictures, if these are finer."""
    study, dates = job.study, split_dates(job.study)
    if not study.kind.is_raster or not study.is_plan or len(dates) > MOST_DATES:
        return None
    counted = count_dates(dates, job)
    finer = [fine for fine in counted if fine is not None]
    if len(finer) < len(dates):
        return None
    losses = []
    if "hours_lost" in study.more:
        losses = count_lost(job, dates, finer, finer[0].shadow_hours.shape)
    return pack_vector_map(plan, finer, losses, job.outputs.show or "sun")


def _name_casters(job: FolderJob) -> list[str]:
    """Describe how casters were chosen, as typed."""
    casters = [f"cast={pattern!r}" for pattern in job.options.cast]
    casters += [f"no_cast={pattern!r}" for pattern in job.options.no_cast]
    is_typed_in_shell = str(job.study.facts["command"]).startswith("umbra ")
    return [write_for_shell(name) if is_typed_in_shell else name for name in casters]


def _find_sheets(job: FolderJob) -> Iterator[tuple[str, Path]]:
    """Iterate over the pictures with captions, of the whole period first, once all are drawn."""
    job.painter.wait()
    hours = name_hours(job.show).capitalize()
    words = {
        "hours": hours,
        "hours_lost": "Hours of sun lost to the proposed development",
        "profile": "Shadows through the day",
        "sheet": "Plan and elevations",
        "months": f"{hours} by month",
        "who": "Who casts the shadow",
        "points": f"{hours} at the {job.study.kind.noun}",
    }
    words |= caption_measures(job.study.quantities)
    for path in sorted(job.folder.glob("*.png"), key=lambda path: ("_" in path.stem, path.stem)):
        kind, _, day = path.stem.partition("_")
        caption = f"{words.get(kind, kind)}{f', {day}' if day else ''}"
        yield words.get(path.stem, caption), path
