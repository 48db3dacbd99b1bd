"""Writing a study's folder: the result, pictures, further files, and a summary as JSON."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from umbra.errors import InputError
from umbra.folders.atomic import replace_file, replace_results
from umbra.ground.level import has_terrain
from umbra.receivers.standing import name_holders
from umbra.study import Preview, Study, StudyOptions, make_preview
from umbra.study.preview import choose_stamps
from umbra.study.remarks import tell_long_shadows
from umbra.study.window_table import average_windows
from umbra.writers.folder import FolderJob, Outputs
from umbra.writers.folder.month_maps import write_month_table
from umbra.writers.folder.named_tables import WINDOWS, write_named_tables
from umbra.writers.output_formats import is_usual_name

if TYPE_CHECKING:
    from umbra.writers.folder.pictures import PictureSheets
    from umbra.writers.painter import Painter
    from umbra.writers.picture_content import Plan
    from umbra.writers.report.markup import Pin, Table

__all__ = [
    "draw_one", "fill_folder", "note_cut", "note_earlier", "raise_failures", "write_study",
]  # fmt: skip

RESULT, REPORT, VERDICTS = "study.nc", "report.html", "verdicts.csv"
LISTING = ".umbra-files"
"""Names of the files in a folder that are of no usual name."""
_LONGEST = 1 << 20  # that is read of it [byte]
_MOST_DARK = 1000
"""Points without sun that are looked for in bodies."""
_FRONT = 0.01
"""Distance before a point that counts: a window lies on its wall, to the digits of a table [m]."""
Say = Callable[[str], object]


def write_study(
    study: Study,
    folder: str | os.PathLike[str],
    outputs: Outputs,
    options: StudyOptions,
    say: Say = lambda _line: None,
) -> tuple[list[Path], list[InputError]]:
    """
    Write a study into a folder, whose earlier results are replaced when all is complete.

    ``options`` are the study's; ``say`` is called with each line that the user should read.
    Returns the paths of the files, and the failures of packages' outputs, for ``raise_failures``.
    An `InputError` is raised if an output is not made of these receivers, or the folder cannot be
    written to.
    """
    outputs.check_receivers(options.receivers, has_hours=options.asks_hours)
    from umbra.writers.painter import Painter  # noqa: PLC0415  (it starts a child)

    with replace_results(folder, say) as unfinished, Painter(outputs.endings) as painter:
        first, more, _, failures = fill_folder(study, unfinished, outputs, options, painter, say)
    return [Path(folder) / name for name in (*first, *more)], failures


def raise_failures(failures: Sequence[InputError], say: Say) -> None:
    """Raise the first failure of a package's output; tell the others."""
    for failure in failures[1:]:
        say(f"note: {failure}")
    if failures:
        raise failures[0]


def note_earlier(written: Sequence[Path], say: Say) -> None:
    """
    Name the files of earlier studies that lie beside those of this one.

    A study's usual files are known by their names; others, as of a format of one's own, are listed
    in the folder.
    """
    folder = written[0].parent
    new = {path.name for path in written}
    listed = _read_listing(folder / LISTING)
    old = sorted(
        path.name
        for path in folder.iterdir()
        if path.name not in new
        and (path.name in listed or is_usual_name(path.name))
        and path.is_file()
    )
    own = sorted(name for name in (*new, *old) if not is_usual_name(name))
    if own or listed:
        with replace_file(folder / LISTING) as beside:
            beside.write_text("".join(f"{name}\n" for name in own), "utf-8", "replace")
    if old:
        files = ", ".join(old[:5]) + (f" and {len(old) - 5} more" if len(old) > 5 else "")
        verb = "is" if len(old) == 1 else "are"
        say(
            f"note: {files} in '{folder}' {verb} of an earlier study, which this one did not "
            "replace; remove what is not wanted, or write into a new folder"
        )


def _read_listing(path: Path) -> set[str]:
    """Read the names of a folder's files that only their writers know; none if it is damaged."""
    try:
        with os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0)), "rb") as file:
            return set(file.read(_LONGEST).decode("utf-8", "replace").split("\n"))
    except OSError:
        return set()


def draw_one(study: Study, name: str, outputs: Outputs, options: StudyOptions) -> bytes:
    """
    Draw one picture of a study.

    Parameters
    ----------
    study : Study or PointStudy
    name : {'hours', 'profile'}
        Of points, the hours are their map.
    outputs : Outputs
    options : StudyOptions
        Of the study.

    Returns
    -------
    png : bytes

    Raises
    ------
    InputError
        If there is no such picture of these receivers.
    """
    is_map = not study.kind.is_raster and study.samples is None
    if is_map and name != "hours":
        msg = f"such receivers have no picture '{name}'; they have points"
        raise InputError(msg)
    from umbra.writers.painter import Painter  # noqa: PLC0415  (it starts a child)

    with TemporaryDirectory() as folder:
        with Painter() as painter:
            job = FolderJob(
                study, Path(folder), outputs, options, painter, lambda _line: None, only=name
            )
            if study.kind.is_raster:
                from umbra.writers.folder.pictures import PictureSheets, draw_pictures  # noqa: PLC0415

                names = draw_pictures(job, PictureSheets.of(job))
            else:
                names = _draw_points(job)
        return (Path(folder) / names[0]).read_bytes()


def fill_folder(
    study: Study,
    folder: Path,
    outputs: Outputs,
    options: StudyOptions,
    painter: "Painter",
    say: Say,
) -> tuple[list[str], list[str], list[str], list[InputError]]:
    """
    Write a study's files into an unfinished folder; pictures are complete when the painter ends.

    Returns two lists of names, of the result and the pictures in every ending and of further files;
    a sentence on each rule; and the failures of packages' outputs, for ``raise_failures`` when the
    folder is complete.
    """
    job = FolderJob(study, folder, outputs, options, painter, say)
    for name in ("device_note", "opaque_rule"):
        if name in study.facts:
            say(f"note: {study.facts[name]}")
    if outputs.pictures or outputs.sheet:
        from umbra.writers.folder.captions import name_files  # noqa: PLC0415
        from umbra.writers.typeface import note_missing  # noqa: PLC0415

        title = "".join(filter(None, (outputs.title or name_files(job.scene), outputs.subtitle)))
        if lacking := note_missing(title, "title"):
            say(f"note: {lacking}")
    pictures, more = _fill_raster(job) if study.kind.is_raster else _fill_points(job)
    drawn = [str(Path(name).with_suffix(f".{e}")) for name in pictures for e in outputs.endings]
    return [RESULT, *drawn], more, job.verdicts, job.failures


def _fill_raster(job: FolderJob) -> tuple[list[str], list[str]]:
    """Write a plan or a view; return the names of the pictures and of further files."""
    study, outputs = job.study, job.outputs
    if not study.has_hours:
        pictures = _draw_measures(job) if outputs.pictures else []
        _tell_facts(job)
        return pictures, _write_files(job)
    pictures, sheets, preview = _draw_raster(job)
    _tell_facts(job)
    if study.is_plan and job.options.extent is None and not study.model.has_end:
        note_cut(job)
    is_bare = study.kind.is_level and not has_terrain(job.scene)
    if is_bare and preview.has_terrain(job.scene.bounds()):
        job.say(
            f"note: the model covers nearly all of its ground at z = {study.ground:.6g} m,"
            " as a terrain or base plate does; receivers='top' shows the shadows that fall "
            "on it"
        )
    return pictures, _write_files(job, None if sheets is None else sheets.plan)


def _draw_raster(job: FolderJob) -> "tuple[list[str], PictureSheets | None, Preview]":
    """Draw what is asked for; return the names, what pictures and pages share, and the cells."""
    study, outputs = job.study, job.outputs
    if not (outputs.pictures or outputs.sheet or _has_more(outputs)):
        return [], None, make_preview(study, steps=choose_stamps(study.steps, outputs.at))
    from umbra.writers.folder.pictures import PictureSheets, draw_pictures  # noqa: PLC0415

    sheets = PictureSheets.of(job)
    pictures = draw_pictures(job, sheets) if outputs.pictures else []
    pictures += _draw_measures(job, sheets.plan) if outputs.pictures else []
    if outputs.sheet:
        from umbra.writers.folder.elevation_sheet import draw_sheet  # noqa: PLC0415  (it loads matplotlib)

        pictures += draw_sheet(job, sheets.plan)
    return pictures, sheets, sheets.preview


def _has_more(outputs: Outputs) -> bool:
    """Return whether files are asked for that are made beside the result and its pictures."""
    return bool(outputs.report or outputs.files or outputs.rules)


def _draw_measures(job: FolderJob, plan: "Plan | None" = None) -> list[str]:
    """Draw a map of each measure besides hours; return the names of the pictures."""
    if not any(quantity.is_drawn for quantity in job.study.quantities):
        return []
    from umbra.writers.folder.measured import draw_measures  # noqa: PLC0415  (it loads matplotlib)

    return draw_measures(job, plan)


def _tell_facts(job: FolderJob) -> None:
    """Tell what was assumed of the ground, and what was chosen of the raster."""
    facts = job.study.facts
    for name in ("assumption", "extent_note", "cell_note"):
        if name in facts:
            job.say(f"note: {facts[name]}")


def note_cut(job: FolderJob) -> None:
    """Report shadows that run on beyond a plan whose extent was not stated."""
    hours = job.study.shadow_hours - np.float32(job.study.period.land_hours)
    for note in tell_long_shadows((hours[0], hours[-1], hours[:, 0], hours[:, -1])):
        job.say(f"note: {note}")


def _fill_points(job: FolderJob) -> tuple[list[str], list[str]]:
    """Write surfaces or points; return the names of the pictures and of further files."""
    pictures = _draw_points(job) if job.outputs.pictures else []
    tells_roofs = job.study.kind.name == "areas"  # with how much of each lies under them
    if job.study.samples is None and job.study.has_hours and not tells_roofs:
        _note_buried(job)
    if not _has_more(job.outputs):
        return pictures, _write_files(job)
    from umbra.writers.folder.pictures import describe_points  # noqa: PLC0415

    return pictures, _write_files(job, describe_points(job))


def _draw_points(job: FolderJob) -> list[str]:
    """Draw surfaces as they are seen, or points on a plan; return the names of the pictures."""
    from umbra.writers.folder.pictures import (  # noqa: PLC0415
        draw_plan_of_points,
        draw_surfaces,
        look_at_surfaces,
    )

    draw_hours = draw_plan_of_points
    if job.study.kind.own_table == WINDOWS:
        job = replace(job, study=average_windows(job.study))
    if job.study.samples is not None:
        job, draw_hours = look_at_surfaces(job), draw_surfaces
    names = draw_hours(job) if job.study.has_hours else []
    return names + (_draw_measures(job) if job.only is None else [])


def _write_files(job: FolderJob, plan: "Plan | None" = None) -> list[str]:
    """Write the result and further files; the report needs the pictures. Return their names."""
    from umbra.writers.netcdf import write_netcdf  # noqa: PLC0415  (while pictures are drawn)

    study, outputs = job.study, job.outputs
    write_netcdf(job.folder / RESULT, study.variables(), study.facts, study.quantities)
    own = write_named_tables(job) + write_month_table(job)
    if not _has_more(outputs):
        return own
    from umbra.writers.folder.captions import name_files  # noqa: PLC0415
    from umbra.writers.output_formats import Job  # noqa: PLC0415
    from umbra.writers.outputs import write_formats  # noqa: PLC0415
    from umbra.writers.proof.verdict_files import write_study_verdicts  # noqa: PLC0415

    title = job.outputs.title or name_files(job.scene) if plan is None else plan.title
    options = job.options
    formats = Job(
        study, job.folder, title, job.say, job.show, outputs.at, job.failures, options.cast,
        options.no_cast,
    )  # fmt: skip
    names = own + write_formats(formats, outputs.files)
    tables = []
    if isinstance(outputs.rules, list):
        tables += write_study_verdicts(job.folder / VERDICTS, study, job.options, outputs.rules)
    elif outputs.rules:
        from umbra.study.rules import judge  # noqa: PLC0415

        tables.append(_write_verdicts(job, judge(study, outputs.rules)))
        _note_standing(tables[0].pins, job.say)
        _note_area(job)
    if outputs.rules:
        job.verdicts.extend(table.answer or table.title for table in tables)
        names.append(VERDICTS)
    if outputs.report and plan is not None:
        from umbra.writers.folder.reporting import write_job_report  # noqa: PLC0415

        timeline = formats.timeline if study.kind.is_raster else None
        write_job_report(job, job.folder / REPORT, plan, tables, timeline)
        names.append(REPORT)
    return names


def _write_verdicts(job: FolderJob, verdicts: Any) -> "Table":
    """Write the verdicts on the rules, and return their table."""
    from umbra.writers.csv_tables import write_table  # noqa: PLC0415
    from umbra.writers.report.tables import make_verdict_table  # noqa: PLC0415

    table = make_verdict_table(job.outputs.rules, verdicts)
    write_table(job.folder / VERDICTS, table.columns, table.rows)
    return table


def _note_buried(job: FolderJob) -> None:
    """Report points without sun that lie inside a body, as a window does within its wall."""
    study, scene = job.study, job.scene
    names = study.more["name"][1].tolist() if "name" in study.more else None
    every = np.flatnonzero((study.sun_hours <= 0) & (study.up_hours > 0))
    dark = every[:_MOST_DARK]
    limit = "" if len(dark) == len(every) else f" of the first {_MOST_DARK:,} without sun"
    places = study.places
    front = places.points[dark] - scene.origin + _FRONT * np.nan_to_num(places.normals[dark])
    holders = name_holders(scene, study.model.soup, front) if len(dark) else []
    buried = [
        f"{repr(names[k]) if names else f'point {k + 1}'} in '{holder}'"
        for k, holder in zip(dark.tolist(), holders, strict=True)
        if holder
    ]
    if buried:
        listed = ", ".join(buried[:3]) + (f" and {len(buried) - 3} more" if len(buried) > 3 else "")
        job.say(
            f"note: points inside bodies, where no sun comes: {len(buried)}{limit} ({listed}); "
            "move them out of the wall or roof if that is not meant"
        )


def _note_standing(pins: Sequence["Pin"], say: Say) -> None:
    """Report the rules' places that are not in the open."""
    covered = [f"'{pin.name}' {pin.standing}" for pin in pins if pin.standing]
    if covered:
        listed = ", ".join(covered[:3]) + (
            f" and {len(covered) - 3} more" if len(covered) > 3 else ""
        )
        say(
            f"note: places of the rules that are not in the open: {listed}; each is judged where "
            "it is; move it in the rule file if that is not meant"
        )


def _note_area(job: FolderJob) -> None:
    """Report shares of an area that nobody chose: a default plan is as large as its shadows."""
    broad = [
        check.name
        for check in job.outputs.rules.checks
        if not check.places and check.area in {"open_ground", "everywhere"}
    ]
    if broad and job.study.is_plan and job.options.extent is None:
        job.say(
            f"note: check '{broad[0]}' judges a share of the whole plan, which reaches as far as "
            "shadows do, with all that lies around the model; extent= chooses what is meant, such "
            "as one garden"
        )
