"""``umbra study``: hours of shadow around buildings."""

import os
import shlex
from pathlib import Path
from typing import Any

import click

from umbra.cli.cache import cache_option
from umbra.cli.columns import column_options
from umbra.cli.outputs import output_options, take_outputs
from umbra.cli.outside import outside_option
from umbra.cli.pose import pose_options, read_posed
from umbra.cli.progress import name_reading, show_progress
from umbra.cli.sections import make_sectioned
from umbra.cli.study_file import OPTIONS_FILE, option_file, write_options
from umbra.cli.study_options import study_options
from umbra.cli.terminal import echo, echo_json, echo_path
from umbra.errors import InputError, write_for_shell

__all__ = ["command"]

RASTER_ONLY = ("ground", "extent", "cell", "size", "eye", "target", "fov")
POINTS_ONLY = ("spacing", "points")
PICTURES_ONLY = ("title", "subtitle", "show", "at")
SECTIONS = {
    "--lat": "Site",
    "--date": "Time",
    "--receivers": "Receivers",
    "--cast": "Casters",
    "--up": "Reading",
    "--by": "Results",
    "--title": "Pictures",
    "--device": "Running",
    "--height-column": "Reading",
    "--name-column": "Reading",
    "--report": "Further files",
    "--json": "Running",
    "--help": "Options",
}


@click.command("study", cls=make_sectioned(SECTIONS))
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@option_file
@study_options
@column_options
@pose_options
@outside_option
@cache_option
@output_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    lat: float | None,
    lon: float | None,
    tz: str | None,
    north: float | None,
    up: str | None,
    time: float | None,
    animation: str | None,
    device: str,
    out: Path,
    quiet: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Find the hours of shadow around buildings on one or more days.

    Writes study.nc, hours.png, profile.png and study.toml into the folder --out.

    \b
    Example:
    umbra study block.city.json --date 2026-03-21 --receivers top --cell 0.5 --out out/
    """  # noqa: D301  (click asks for a real backspace)
    outputs = take_outputs(options)
    _check_clock(options)
    is_raster = options["receivers"] not in {"surfaces", "points"}
    point_names: list[str] = []
    if not is_raster:
        point_names = _take_points(options)

    def say(line: str) -> None:
        if not quiet:
            echo(write_for_shell(line), err=True)

    from umbra.study import run_study  # noqa: PLC0415
    from umbra.sun import find_site  # noqa: PLC0415
    from umbra.writers.atomic import replace_results  # noqa: PLC0415
    from umbra.writers.folder.summary import sum_up  # noqa: PLC0415
    from umbra.writers.folder.write import fill_folder  # noqa: PLC0415
    from umbra.writers.painter import Painter  # noqa: PLC0415

    # The painter's process starts when all this is loaded: two that load at once take longer.
    with (
        replace_results(out) as unfinished,
        show_progress(quiet) as stages,
        Painter(outputs.endings) as painter,
    ):
        stages.begin(name_reading(files))
        scene = read_posed(files, up, time, animation)
        for note in scene.notes:
            say(f"note: {note}")
        site = find_site(scene, lat, lon, tz, north)
        options["device"] = device
        stages.show_scene(scene)
        stages.begin("preparing")
        study: Any
        if is_raster:
            raster = {n: v for n, v in options.items() if n not in {*POINTS_ONLY, *PICTURES_ONLY}}
            study = run_study(scene, site, progress=stages.advance, **raster)
            if options["receivers"] == "auto":
                options["receivers"] = study.receivers
        else:
            study = _study_points(scene, site, options, point_names, stages.advance)
        stages.begin("drawing and writing")
        study.facts["command"] = _find_command()
        if "assumption" in study.facts:
            study.facts["assumption"] = write_for_shell(study.facts["assumption"])
        if not study.sun.is_up.any():
            say(
                "umbra: warning: the sun is below the horizon all this time; "
                "there are no hours of sun or shadow"
            )
        first, more = fill_folder(study, scene, unfinished, outputs, options, painter, say)
        write_options(unfinished / OPTIONS_FILE, click.get_current_context())
    written = [out / name for name in (*first, OPTIONS_FILE, *more)]
    if as_json:
        echo_json({"files": [str(path) for path in written], **sum_up(study)})
    elif not quiet:
        for path in written:
            echo_path(path)


def _take_points(options: dict[str, Any]) -> list[str]:
    """Read the table of points before any model, and refuse options of rasters."""
    for name in ("extent", "cell", "size"):
        if options[name] is not None:
            msg = f"--{name} is for rasters; surfaces are sampled by --spacing, points by --points"
            raise InputError(msg)
    from umbra.receivers.points import read_points  # noqa: PLC0415

    path = options["points"]
    names: list[str] = []
    if options["receivers"] == "points":
        if path is None:
            msg = "receivers 'points' need a table; give --points FILE with lines of x,y,z"
            raise InputError(msg)
        options["points"], names = read_points(path)
    return names


def _study_points(
    scene: Any, site: Any, options: dict[str, Any], names: list[str], progress: Any
) -> Any:
    """Run a study of surfaces or points with the options of the command."""
    from umbra.study import run_study  # noqa: PLC0415

    others = {*RASTER_ONLY, *PICTURES_ONLY}
    kept = {name: value for name, value in options.items() if name not in others}
    if options["receivers"] != "points":
        del kept["points"]
    if names:
        kept["names"] = names
    return run_study(scene, site, progress=progress, **kept)


def _check_clock(options: dict[str, Any]) -> None:
    """Find slips in the dates before anything is read."""
    from umbra.casters.canopy import check_transmissivity  # noqa: PLC0415
    from umbra.sun import make_steps, parse_dates  # noqa: PLC0415
    from umbra.sun.clock import (  # noqa: PLC0415
        check_steps,
        find_stamps,
        parse_duration,
    )

    # In UTC no time is missing or doubled: what fails here fails everywhere.
    days = parse_dates(options["date"], options["every_days"])
    day, every = days[0], options["every"]
    check_steps(make_steps(day, options["start"], options["end"], every, "UTC"), len(days), every)
    find_stamps(day, options["at"], "UTC")
    if options["min_spell"] is not None:
        parse_duration(options["min_spell"], "least spell")
    if options["under"] is not None:
        parse_duration(options["under"], "least sun")
        if not options["proposed"]:
            msg = "--under is about what a proposal takes away; name its parts with --proposed"
            raise InputError(msg, under=options["under"])
    check_transmissivity(options["canopy"], options["transmissivity"], options["leaf_on"])
    if options["receivers"] not in {"auto", "ground", "top", "camera", "surfaces", "points"}:
        from umbra.receivers.view import find_direction  # noqa: PLC0415

        find_direction(options["receivers"])


def _find_command() -> str:
    """Give the command as typed; in Unicode, which the names of files need not be."""
    words = shlex.join(["umbra", *click.get_current_context().obj])
    return os.fsencode(words).decode("utf-8", "replace")
