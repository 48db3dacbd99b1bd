"""The options of ``umbra study`` that ask for more than its three files, and who writes them."""

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from umbra.cli.terminal import echo
from umbra.errors import InputError

if TYPE_CHECKING:
    from umbra.scene import Scene
    from umbra.study import PointStudy, Study
    from umbra.writers.painter import Painter
    from umbra.writers.plan import Plan, Show
    from umbra.writers.report import Table
    from umbra.writers.report.table import Pin
    from umbra.writers.rules import Rules

__all__ = ["Outputs", "output_options", "take_outputs"]

F = TypeVar("F", bound=Callable)

REPORT, VERDICTS = "report.html", "verdicts.csv"
NAMES = ("geotiff", "geojson", "gpkg", "dxf", "csv", "glb", "gif", "mp4", "pdf", "svg")
PLANS = ("auto", "ground", "top")
DRAWN = ("pdf", "svg")
"""Of these, what every picture is written as besides PNG."""


def output_options(command: F) -> F:
    """Add the options to a command; ``take_outputs`` takes their values out again."""
    report = click.option(
        "--report",
        is_flag=True,
        help="Also write report.html: all in one page, with a slider through the day.",
    )
    write = click.option(
        "--write",
        multiple=True,
        metavar="FORMAT,...",
        help=f"Also write {', '.join(NAMES)}; several by commas, or repeat. pdf and svg: every "
        "picture, with its type as type.",
    )
    rules = click.option(
        "--rules",
        type=click.Path(path_type=Path),
        metavar="FILE.yaml",
        help="Judge the result by a rule file; writes verdicts.csv.",
    )
    sheet = click.option(
        "--sheet",
        is_flag=True,
        help="Also write sheet.png: plan and four elevations in one scale, on A3.",
    )
    return report(sheet(write(rules(command))))


@dataclass(frozen=True)
class Outputs:
    """
    What is to be written besides ``study.nc`` and the pictures.

    Parameters
    ----------
    report : bool
    formats : tuple of str
        Of ``umbra.writers.formats.FORMATS``.
    casters : tuple of str
        How casters were chosen, as typed.
    rules : Rules, optional
    sheet : bool
    endings : tuple of str
        Of the pictures' files.
    show : {'shadow', 'sun'}
        Which hours pictures and lines tell.
    at : tuple of str
        Clock times that are outlined and filmed; round ones by default.
    """

    report: bool
    formats: tuple[str, ...] = ()
    casters: tuple[str, ...] = ()
    rules: "Rules | None" = None
    sheet: bool = False
    endings: tuple[str, ...] = ("png",)
    show: "Show" = "shadow"
    at: tuple[str, ...] = ()

    def write(
        self,
        folder: Path,
        study: "Study",
        scene: "Scene",
        plan: "Plan",
        painter: "Painter",
    ) -> list[str]:
        """
        Write into the unfinished results folder; the pictures are waited for if needed.

        Returns
        -------
        names : list of str
            Of the files, in the order in which they are told.
        """
        if not self.report and not self.formats and not self.rules:
            return []
        from umbra.writers.formats import Job, write_formats  # noqa: PLC0415

        context = click.get_current_context(silent=True)
        is_quiet = context is not None and bool(context.params.get("quiet"))

        def say(line: str) -> None:
            if not is_quiet:
                echo(line, err=True)

        job = Job(study, folder, plan.title, say, self.show, self.at)
        names = write_formats(job, self.formats)
        tables = []
        if self.rules:
            from umbra.writers.rules import judge, make_verdict_table  # noqa: PLC0415
            from umbra.writers.tables import write_table  # noqa: PLC0415

            verdicts = judge(study, self.rules)
            tables.append(make_verdict_table(self.rules, verdicts))
            _note_standing(tables[0].pins, say)
            write_table(folder / VERDICTS, tables[0].columns, tables[0].rows)
            names.append(VERDICTS)
        if self.report:
            painter.wait()
            from umbra.writers.report import write_report  # noqa: PLC0415

            write_report(
                folder / REPORT, study, plan, _find_sheets(folder, self.show), tables=tables,
                casters=self.casters, notes=scene.notes, timeline=job.timeline, show=self.show,
            )  # fmt: skip
            names.append(REPORT)
        return names

    def write_points(
        self,
        folder: Path,
        study: "PointStudy",
        scene: "Scene",
        options: dict[str, Any],
        painter: "Painter",
    ) -> list[str]:
        """Write what is asked of surfaces and points; ``options`` are the study's."""
        names: list[str] = []
        if self.formats:
            from umbra.writers.point_formats import write_point_formats  # noqa: PLC0415

            names += write_point_formats(folder, study, self.formats)
        tables = []
        if self.rules:
            tables.append(_judge_points(folder, study, scene, self.rules, options))
            names.append(VERDICTS)
        if self.report:
            painter.wait()
            from umbra.cli.study_points import describe_points  # noqa: PLC0415
            from umbra.writers.report import write_point_report  # noqa: PLC0415

            write_point_report(
                folder / REPORT, study, describe_points(study, scene, options),
                _find_sheets(folder, self.show), tables=tables, casters=self.casters,
                notes=scene.notes, show=self.show,
            )  # fmt: skip
            names.append(REPORT)
        return names


def _note_standing(pins: "Sequence[Pin]", say: Callable[[str], None]) -> None:
    """Say which of the rules' places lie in or under something, or on top of it."""
    found = [f"'{pin.name}' {pin.standing}" for pin in pins if pin.standing]
    if found:
        some = ", ".join(found[:3]) + (f" and {len(found) - 3} more" if len(found) > 3 else "")
        say(
            f"note: places of the rules that are not in the open: {some}; each is judged where it "
            "is; move it in the rule file if that is not meant"
        )


def _judge_points(folder: Path, study: "PointStudy", scene: "Scene", rules: "Rules",
                  options: dict[str, Any]) -> "Table":  # fmt: skip
    """Write the verdicts of a study of points, and give them."""
    from umbra.machine import count_cores  # noqa: PLC0415
    from umbra.writers.rules import judge_points, make_verdict_table  # noqa: PLC0415
    from umbra.writers.tables import write_table  # noqa: PLC0415

    casters = scene.select(options.get("cast", ()), options.get("no_cast", ()))
    threads = options.get("threads") or count_cores()
    verdicts = judge_points(study, rules, scene, casters, threads)
    table = make_verdict_table(rules, verdicts)
    write_table(folder / VERDICTS, table.columns, table.rows)
    return table


def _find_sheets(folder: Path, show: "Show") -> list[tuple[str, Path]]:
    """Name the pictures of a results folder, those of the whole period first."""
    from umbra.writers.plan import name_hours  # noqa: PLC0415

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


def take_outputs(options: dict[str, Any]) -> Outputs:
    """
    Take the values of these options out of a command's, and check them before any work.

    Parameters
    ----------
    options : dict
        Of the command; what is left is for the study.

    Returns
    -------
    outputs : Outputs

    Raises
    ------
    InputError
        If a format is unknown, a package that it needs is missing, or the rules are
        not written as they must be.
    """
    casters = [f"--cast {pattern}" for pattern in options.get("cast", ())]
    casters += [f"--no-cast {pattern}" for pattern in options.get("no_cast", ())]
    asked = _parse_formats(options.pop("write"))
    formats = tuple(name for name in asked if name not in DRAWN)
    endings = ("png", *(name for name in asked if name in DRAWN))
    path, rules = options.pop("rules"), None
    if path is not None:
        from umbra.writers.rules import read_rules  # noqa: PLC0415

        rules = read_rules(path)
    report, sheet = options.pop("report"), options.pop("sheet")
    if sheet and options["receivers"] not in PLANS:
        msg = "--sheet shows a plan and its elevations; choose --receivers ground or top"
        raise InputError(msg)
    _check_receivers(options["receivers"], formats, rules is not None)
    return Outputs(
        report, formats, tuple(casters), rules, sheet, endings, options["show"], options["at"]
    )


def _check_receivers(receivers: str, formats: tuple[str, ...], has_rules: bool) -> None:
    """Refuse what is not made of some receivers."""
    if receivers in PLANS:
        return
    is_raster = receivers not in {"surfaces", "points"}
    if formats:
        _check_formats(receivers, formats)
    if has_rules and is_raster:
        msg = (
            f"--rules judge plans, surfaces and points, not --receivers {receivers}, which hides a "
            "part of what is judged; choose --receivers surfaces and the facades with --on"
        )
        raise InputError(msg)


def _check_formats(receivers: str, formats: tuple[str, ...]) -> None:
    """Refuse the formats that receivers other than plans are not written in."""
    from umbra.writers.formats import FORMATS  # noqa: PLC0415

    written = [name for name, each in FORMATS.items() if each.of_views]
    if receivers in {"surfaces", "points"}:
        from umbra.writers import point_formats  # noqa: PLC0415

        is_points = receivers == "points"
        written = list(point_formats.OF_POINTS if is_points else point_formats.OF_SURFACES)
    if receivers == "camera":
        written = []
    refused = [name for name in formats if name not in written]
    if refused:
        there = f"{', '.join(written)} can be, the others are" if written else "all files are"
        msg = (
            f"--write {','.join(refused)} is not for --receivers {receivers}: {there} for plans; "
            "leave it out, or choose --receivers ground or top"
        )
        raise InputError(msg, formats=refused)


def _parse_formats(given: tuple[str, ...]) -> tuple[str, ...]:
    """Read ``--write``: names by commas, each once."""
    names = dict.fromkeys(name for text in given for name in text.replace(",", " ").lower().split())
    if not names:
        return ()
    from umbra.writers.formats import FORMATS, check_extra  # noqa: PLC0415

    for name in names:
        if name in DRAWN:
            continue
        if name not in FORMATS:
            near = difflib.get_close_matches(name, NAMES, n=1, cutoff=0.5)
            advice = f"did you mean {near[0]}?" if near else f"there are {', '.join(NAMES)}"
            msg = f"--write does not know '{name}'; {advice}"
            raise InputError(msg, format=name)
        check_extra(f"--write {name}", FORMATS[name].packages, FORMATS[name].extra)
    return tuple(names)
