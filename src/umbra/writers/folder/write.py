"""Writing a study's folder: the result, its pictures, and whatever else is asked for."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.errors import write_for_shell
from umbra.scene import Scene
from umbra.study import Study
from umbra.writers.atomic import replace_results
from umbra.writers.folder.outputs import Outputs
from umbra.writers.folder.pictures import draw_pictures
from umbra.writers.folder.points import describe_points, draw_plan_of_points, draw_surfaces
from umbra.writers.folder.sheet import draw_sheet
from umbra.writers.netcdf import write_netcdf
from umbra.writers.painter import Painter
from umbra.writers.plan import Plan, Show, name_hours

if TYPE_CHECKING:
    from umbra.writers.report.markup import Pin

__all__ = ["fill_folder", "write_study"]

RESULT, REPORT, VERDICTS = "study.nc", "report.html", "verdicts.csv"

Say = Callable[[str], object]


def write_study(
    study: Study,
    scene: Scene,
    folder: str | os.PathLike[str],
    outputs: Outputs,
    options: dict[str, Any],
    say: Say = lambda _line: None,
) -> list[Path]:
    """
    Write a study into a folder, whose earlier results are replaced when all is complete.

    Parameters
    ----------
    study : Study
    scene : Scene
        That was studied.
    folder : path
        Made if missing.
    outputs : Outputs
    options : dict
        Of the study, and of its pictures: title, subtitle, show, at.
    say : callable
        Told what a user should know, a line at a time.

    Returns
    -------
    paths : list of Path
    """
    with replace_results(folder) as unfinished, Painter(outputs.endings) as painter:
        first, more = fill_folder(study, scene, unfinished, outputs, options, painter, say)
    return [Path(folder) / name for name in (*first, *more)]


def fill_folder(
    study: Study,
    scene: Scene,
    folder: Path,
    outputs: Outputs,
    options: dict[str, Any],
    painter: Painter,
    say: Say,
) -> tuple[list[str], list[str]]:
    """
    Write a study's files into an unfinished folder; pictures are complete when the painter ends.

    Parameters are those of ``write_study``, and the painter that draws.

    Returns
    -------
    first, more : list of str
        Names of the files: the result and the pictures in every ending; further files.
    """
    if not study.kind.is_raster:
        pictures, more = _fill_points(study, scene, folder, outputs, options, painter)
    else:
        pictures, more = _fill_raster(study, scene, folder, outputs, options, painter, say)
    drawn = [str(Path(name).with_suffix(f".{e}")) for name in pictures for e in outputs.endings]
    return [RESULT, *drawn], more


def _fill_raster(
    study: Study,
    scene: Scene,
    folder: Path,
    outputs: Outputs,
    options: dict[str, Any],
    painter: Painter,
    say: Say,
) -> tuple[list[str], list[str]]:
    """Write a plan or a view; give the names of the pictures and of the other files."""
    sheets = draw_pictures(study, scene, options, painter, folder)
    pictures = sheets.names
    if outputs.sheet:
        pictures = [*pictures, *draw_sheet(study, scene, sheets.plan, options, painter, folder)]
    if "assumption" in study.facts:
        say(f"note: {study.facts['assumption']}")
    elif study.receivers == "ground" and sheets.preview.has_terrain(scene.bounds()):
        say(
            f"note: the model covers nearly all of its ground at z = {study.ground:.6g} m,"
            " as a terrain or base plate does; receivers='top' shows the shadows that fall "
            "on it"
        )
    write_netcdf(folder / RESULT, study.variables(), study.facts)
    return pictures, _write_more(study, scene, folder, outputs, options, sheets.plan, painter, say)


def _fill_points(
    study: Study,
    scene: Scene,
    folder: Path,
    outputs: Outputs,
    options: dict[str, Any],
    painter: Painter,
) -> tuple[list[str], list[str]]:
    """Write surfaces or points; give the names of the pictures and of the other files."""
    write_netcdf(folder / RESULT, study.variables(), study.facts)
    if study.receivers == "surfaces":
        pictures = draw_surfaces(scene, study.site, options, painter, folder)
    else:
        pictures = draw_plan_of_points(study, scene, options, painter, folder)
    return pictures, _write_more_of_points(study, scene, folder, outputs, options, painter)


def _write_more(
    study: Study,
    scene: Scene,
    folder: Path,
    outputs: Outputs,
    options: dict[str, Any],
    plan: Plan,
    painter: Painter,
    say: Say,
) -> list[str]:
    """Write further files of a plan or a view; a report waits for the pictures."""
    if not outputs.report and not outputs.formats and not outputs.rules:
        return []
    from umbra.writers.formats import Job, write_formats  # noqa: PLC0415

    job = Job(study, folder, plan.title, say, outputs.show, outputs.at)
    names = write_formats(job, outputs.formats)
    tables = []
    if outputs.rules:
        from umbra.study.rules import judge  # noqa: PLC0415
        from umbra.writers.report.tables import make_verdict_table  # noqa: PLC0415
        from umbra.writers.tables import write_table  # noqa: PLC0415

        verdicts = judge(study, outputs.rules)
        tables.append(make_verdict_table(outputs.rules, verdicts))
        _note_standing(tables[0].pins, say)
        write_table(folder / VERDICTS, tables[0].columns, tables[0].rows)
        names.append(VERDICTS)
    if outputs.report:
        painter.wait()
        from umbra.writers.report import write_report  # noqa: PLC0415

        write_report(
            folder / REPORT, study, plan, _find_sheets(folder, outputs.show), tables=tables,
            casters=_name_casters(study, options), notes=scene.notes, timeline=job.timeline,
            show=outputs.show,
        )  # fmt: skip
        names.append(REPORT)
    return names


def _write_more_of_points(
    study: Study,
    scene: Scene,
    folder: Path,
    outputs: Outputs,
    options: dict[str, Any],
    painter: Painter,
) -> list[str]:
    """Write further files of surfaces or points; a report waits for the pictures."""
    names: list[str] = []
    if outputs.formats:
        from umbra.writers.formats import Job, write_formats  # noqa: PLC0415

        names += write_formats(Job(study, folder), outputs.formats)
    tables = []
    if outputs.rules:
        from umbra.study.rules import judge  # noqa: PLC0415
        from umbra.writers.report.tables import make_verdict_table  # noqa: PLC0415
        from umbra.writers.tables import write_table  # noqa: PLC0415

        tables.append(make_verdict_table(outputs.rules, judge(study, outputs.rules)))
        write_table(folder / VERDICTS, tables[0].columns, tables[0].rows)
        names.append(VERDICTS)
    if outputs.report:
        painter.wait()
        from umbra.writers.report import write_point_report  # noqa: PLC0415

        write_point_report(
            folder / REPORT, study, describe_points(study, scene, options),
            _find_sheets(folder, outputs.show), tables=tables,
            casters=_name_casters(study, options), notes=scene.notes, show=outputs.show,
        )  # fmt: skip
        names.append(REPORT)
    return names


def _name_casters(study: Study, options: dict[str, Any]) -> list[str]:
    """Say how casters were chosen, as typed."""
    names = ("cast", "no_cast")
    casters = [f"{name}={pattern!r}" for name in names for pattern in options.get(name, ())]
    is_typed_in_shell = str(study.facts["command"]).startswith("umbra ")
    return [write_for_shell(one) if is_typed_in_shell else one for one in casters]


def _note_standing(pins: Sequence["Pin"], say: Say) -> None:
    """Say which of the rules' places lie in or under something, or on top of it."""
    found = [f"'{pin.name}' {pin.standing}" for pin in pins if pin.standing]
    if found:
        some = ", ".join(found[:3]) + (f" and {len(found) - 3} more" if len(found) > 3 else "")
        say(
            f"note: places of the rules that are not in the open: {some}; each is judged where it "
            "is; move it in the rule file if that is not meant"
        )


def _find_sheets(folder: Path, show: Show) -> list[tuple[str, Path]]:
    """Name the pictures of a results folder, those of the whole period first."""
    hours = name_hours(show).capitalize()
    words = {
        "hours": hours,
        "hours_lost": "Hours of sun lost to what is proposed",
        "profile": "Shadows through the day",
        "sheet": "Plan and elevations",
        "points": f"{hours} at the points",
    }
    paths = sorted(folder.glob("*.png"), key=lambda path: ("_" in path.stem, path.stem))
    found = []
    for path in paths:
        kind, _, day = path.stem.partition("_")
        caption = f"{words.get(kind, kind)}{f', {day}' if day else ''}"
        found.append((words.get(path.stem, caption), path))
    return found
