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
from umbra.errors import InputError

__all__ = ["command"]

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
        from umbra.cli.study_points import take_points  # noqa: PLC0415

        point_names = take_points(options)

    def say(line: str) -> None:
        if not quiet:
            echo(line, err=True)

    from umbra.cli.study_pictures import draw_pictures  # noqa: PLC0415
    from umbra.cli.study_points import (  # noqa: PLC0415
        PICTURES_ONLY,
        POINTS_ONLY,
        draw_plan_of_points,
        draw_surfaces,
        study_points,
    )
    from umbra.study import run_study  # noqa: PLC0415
    from umbra.sun import find_site  # noqa: PLC0415
    from umbra.writers.netcdf import write_netcdf  # noqa: PLC0415
    from umbra.writers.painter import Painter  # noqa: PLC0415
    from umbra.writers.results import replace_results  # noqa: PLC0415

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
            study = study_points(scene, site, options, point_names, stages.advance)
        stages.begin("drawing and writing")
        study.facts["command"] = _find_command()
        if not study.sun.is_up.any():
            say(
                "umbra: warning: the sun is below the horizon all this time; "
                "there are no hours of sun or shadow"
            )
        more: list[str] = []
        if is_raster:
            sheets = draw_pictures(study, scene, options, painter, unfinished)
            names = sheets.names
            if outputs.sheet:
                from umbra.cli.study_sheet import draw_sheet  # noqa: PLC0415

                names = [
                    *names,
                    *draw_sheet(study, scene, sheets.plan, options, painter, unfinished),
                ]
            if "assumption" in study.facts:
                say(f"note: {study.facts['assumption']}")
            elif study.receivers == "ground" and sheets.preview.has_terrain(scene.bounds()):
                say(
                    f"note: the model covers nearly all of its ground at z = {study.ground:.6g} m,"
                    " as a terrain or base plate does; --receivers top shows the shadows that fall "
                    "on it"
                )
            write_netcdf(unfinished / "study.nc", study.variables(), study.facts)
            more = outputs.write(unfinished, study, scene, sheets.plan, painter)
        else:
            write_netcdf(unfinished / "study.nc", study.variables(), study.facts)
            if options["receivers"] == "surfaces":
                names = draw_surfaces(scene, site, options, painter, unfinished)
            else:
                names = draw_plan_of_points(study, scene, options, painter, unfinished)
            more = outputs.write_points(unfinished, study, scene, options, painter)
        write_options(unfinished / OPTIONS_FILE, click.get_current_context())
    names = [str(Path(name).with_suffix(f".{e}")) for name in names for e in outputs.endings]
    written = [out / name for name in ("study.nc", *names, OPTIONS_FILE, *more)]
    if as_json:
        echo_json({"files": [str(path) for path in written], **_sum_up(study)})
    elif not quiet:
        for path in written:
            echo_path(path)


def _sum_up(study: Any) -> dict[str, Any]:
    """Give a study's numbers for ``--json``; of several dates those of each, too."""
    from umbra.study import split_dates  # noqa: PLC0415
    from umbra.sun import find_daylight  # noqa: PLC0415

    if study.receivers in {"surfaces", "points"}:
        size: dict[str, Any] = {"samples": len(study.shadow_hours)}
    else:
        size = {"cols": len(study.x), "rows": len(study.y), "cell": [study.grid.dx, study.grid.dy]}
    dates, count = split_dates(study), len(study.period.days)
    if "neighbour" in study.more:
        size["neighbours"] = [row for one in dates for row in _list_neighbours(one)]
    if count > 1:
        size["days"] = count
    if len(dates) > 1:
        size["dates"] = []
        for one in dates:
            day = one.period.days[0]
            daylight = find_daylight(study.site, day)
            clock = {
                name: None if when is None else when.isoformat(timespec="seconds")
                for name, when in (("sunrise", daylight.rises), ("sunset", daylight.sets))
            }
            size["dates"].append({"date": str(day), **clock, **_find_hours(one)})
    if "assumed_ground_share" in study.facts:
        size["assumed_ground_share"] = study.facts["assumed_ground_share"]
    return {
        **size,
        **_find_hours(study),
        **{name: study.facts[name] for name in ("prepare_seconds", "count_seconds")},
    }


def _find_hours(study: Any) -> dict[str, Any]:
    """Give how long the sun was up, and the hours in shadow."""
    import numpy as np  # noqa: PLC0415

    is_known = np.isfinite(study.shadow_hours) & getattr(study, "is_of_model", True)
    known = study.shadow_hours[is_known]
    return {
        "hours": study.up_hours,
        "most_shadow_hours": float(known.max(initial=0.0)),
        "mean_shadow_hours": float(known.mean()) if known.size else None,
    }


def _list_neighbours(study: Any) -> list[dict[str, Any]]:
    """Give who loses sun on a date, or on all dates together."""
    from umbra.study import tell_dates  # noqa: PLC0415

    names = [name for name in study.more if name.startswith("neighbour_")]
    columns = [study.more[name][1].tolist() for name in ("neighbour", *names)]
    keys = ["name", *(name.removeprefix("neighbour_") for name in names)]
    rows = [dict(zip(keys, row)) for row in zip(*columns)]
    return [{"date": tell_dates(study), **row} for row in rows if row["area_touched"] > 0]


def _check_clock(options: dict[str, Any]) -> None:
    """Find slips in the dates before anything is read."""
    from umbra.study.canopy import check_transmissivity  # noqa: PLC0415
    from umbra.sun import make_steps, parse_dates  # noqa: PLC0415
    from umbra.sun.clock import check_steps, parse_duration  # noqa: PLC0415
    from umbra.sun.stamps import find_stamps  # noqa: PLC0415

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
        from umbra.study.views import find_direction  # noqa: PLC0415

        find_direction(options["receivers"])


def _find_command() -> str:
    """Give the command as typed; in Unicode, which the names of files need not be."""
    words = shlex.join(["umbra", *click.get_current_context().obj])
    return os.fsencode(words).decode("utf-8", "replace")
