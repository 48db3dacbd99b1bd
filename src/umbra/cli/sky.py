"""``umbra sky``: the sky above a place."""

import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from umbra.cli.click_options import HeadedOption, NewPath, SectionedCommand
from umbra.cli.reading import (
    files_argument,
    find_model_site,
    read_model,
    reading_options,
    site_options,
    take_site,
)
from umbra.cli.terminal import echo, echo_json, echo_path, name_reading, show_progress
from umbra.errors import FLAGS, InputError, find_similar, write_for_shell
from umbra.machine import load_compiler

if TYPE_CHECKING:
    from umbra.calls.sky import SkyView
    from umbra.scene import Scene
    from umbra.sun import Site

__all__ = ["command"]

PICTURES = ("png", "svg", "pdf")
OUTPUTS = (*PICTURES, "csv", "horizon", "json")
HEADINGS = ("Place", "Sun", "Casters", "Site", "Reading", "Files")
_MOST = 1000  # places of one run
_SHOWN = 0.001  # least share that is printed


def _option(*names: str, heading: str, **more: Any) -> Any:
    flag = names[0]  # errors and notes name it as in Python
    FLAGS.setdefault(flag[2:].replace("-", "_"), flag)
    return click.option(*names, cls=HeadedOption, heading=heading, **more)


@click.command("sky", cls=SectionedCommand, headings=HEADINGS)
@files_argument
@_option(
    "--at", heading="Place", metavar="X,Y,Z[,NX,NY,NZ]",
    help="The place, in the model's coordinates, and the normal of its plane; default: level.",
)  # fmt: skip
@_option(
    "--points", heading="Place", type=click.Path(path_type=Path), metavar="FILE.csv",
    help="Several places: a table of x,y,z or x,y,z,nx,ny,nz; a column name names them.",
)  # fmt: skip
@_option(
    "--date", "dates", heading="Sun", multiple=True, metavar="YYYY-MM-DD",
    help="Draw the sun's path, and print when it reaches the place; repeatable.",
)  # fmt: skip
@_option(
    "--cast", heading="Casters", multiple=True, metavar="PATTERN",
    help="Only these parts obstruct: names, kinds, layers or tags; repeatable.",
)  # fmt: skip
@_option(
    "--no-cast", heading="Casters", multiple=True, metavar="PATTERN",
    help="These parts do not obstruct; repeatable.",
)  # fmt: skip
@_option(
    "--horizon", heading="Casters", metavar="FILE",
    help="Land up to 100 km away: a raster of heights (GeoTIFF), or a table azimuth,elevation from "
    "true north, PVGIS' horizon profile, or elevations of --write horizon.",
)  # fmt: skip
@_option(
    "--horizon-from", heading="Casters", metavar="M",
    help="Distance from which the land of a raster counts; default: as far as the model reaches "
    "from its middle.",
)  # fmt: skip
@site_options
@reading_options()
@_option(
    "--projection", heading="Files", default="stereographic", metavar="NAME",
    help="stereographic (default), equidistant, orthographic or waldram.",
)  # fmt: skip
@_option(
    "--write", heading="Files", multiple=True, metavar="NAME,...",
    help="Also write svg, pdf, csv (outlines), horizon (for PVGIS and pvlib), json.",
)  # fmt: skip
@_option("--out", heading="Files", type=NewPath(), metavar="DIR", help="Folder for the files.")
@click.option("--quiet", is_flag=True, help="Print only errors and, with --json, the result.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    at: str | None,
    points: Path | None,
    dates: tuple[str, ...],
    cast: tuple[str, ...],
    no_cast: tuple[str, ...],
    projection: str,
    write: tuple[str, ...],
    out: Path | None,
    quiet: bool,
    as_json: bool,
    **around: str | None,
) -> None:
    """
    Show the sky above a place: how much of it is free, what obstructs it, and the sun's paths.

    The results are exact: no rays, no patches of sky.

    \b
    Examples:
    umbra sky town.obj --at 12,4,1.6 --out sky
    umbra sky town.obj --at 12,4,1.6,0,-1,0 --projection waldram --out sky
    umbra sky town.obj --at 12,4,1.6 --lat 48.2 --lon 16.37 --date 2026-03-21 --json
    """  # noqa: D301  (click asks for a real backspace)
    load_compiler()
    import numpy as np  # noqa: PLC0415

    from umbra.calls.sky import view_skies  # noqa: PLC0415
    from umbra.land.named_land import NamedLand  # noqa: PLC0415
    from umbra.receivers.points import read_points  # noqa: PLC0415
    from umbra.sky.projections import find_projection  # noqa: PLC0415
    from umbra.sun import parse_dates  # noqa: PLC0415

    outputs = _find_outputs(write)
    if out is None and not as_json:
        msg = "nothing to write; give --out DIR, or --json"
        raise InputError(msg)
    if (at is None) == (points is None):
        msg = "give the place: --at X,Y,Z, or --points FILE.csv for several (one of the two)"
        raise InputError(msg)
    named = NamedLand.of(around["horizon"], around["horizon_from"])
    find_projection(projection, np.array([0.0, 0.0, 1.0]), 0.0)
    if dates:
        parse_dates(dates)
    places, names = (_parse_place(at), []) if at is not None else read_points(points or "")
    if len(places) > _MOST:
        msg = (
            f"{len(places):,} places would be {len(places):,} pictures, of at most {_MOST:,}; cut "
            "the table"
        )
        raise InputError(msg, points=len(places))
    with show_progress(quiet) as stages:
        stages.begin(name_reading(files))
        scene = read_model(files, tells=True)
        stages.show_scene(scene)
        site = _find_site(scene, dates)
        look = partial(stages.advance, what="reading the land", unit="blocks")
        land = named.settle(scene.model_bounds(), site, look)
        for line in () if quiet or land is None else land.told:
            echo(f"note: {write_for_shell(line)}", err=True)
        stages.begin("tracing the sky")
        views = view_skies(scene, places, site, cast, no_cast, land)
        stems = _name_files(names, len(views))
        written: list[Path] = []
        if out is not None:
            written = _write(out, views, stems, outputs, projection, dates)
        results = [view.sum_up(dates) for view in views] if as_json else []
    if as_json:
        if len(views) == 1:
            echo_json(results[0])
        else:
            echo_json({"points": [
                {"name": stem.removeprefix("sky-")} | result
                for stem, result in zip(stems, results, strict=True)
            ]})  # fmt: skip
    elif not quiet:
        _tell(views, stems, dates)
        for path in written:
            echo_path(path)


def _parse_place(text: str) -> Any:
    """Read three or six numbers."""
    from umbra.receivers.points import check_points  # noqa: PLC0415

    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in {3, 6}:
        msg = f"--at '{text}' is not X,Y,Z or X,Y,Z,NX,NY,NZ; give numbers, such as --at 12,4,1.6"
        raise InputError(msg, option="at")
    return check_points([numbers])


def _find_outputs(write: tuple[str, ...]) -> list[str]:
    """Return the names of what is written, the picture first."""
    formats = [word.strip() for text in write for word in text.split(",") if word.strip()]
    for word in formats:
        if word not in OUTPUTS:
            near = find_similar(word, OUTPUTS)
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(OUTPUTS)}"
            msg = f"--write '{word}' is not known; {advice}"
            raise InputError(msg, option="write")
    return list(dict.fromkeys(["png", *formats]))


def _find_site(scene: "Scene", dates: tuple[str, ...]) -> "Site | None":
    """Return the site where the sun, or an option, asks for it, or the file says it."""
    angles = [value for name, value in take_site().items() if name in {"latitude", "longitude"}]
    is_known = scene.latitude is not None and scene.longitude is not None
    if dates or is_known or any(value is not None for value in angles):
        return find_model_site(scene)
    return None


def _name_files(names: list[str], count: int) -> list[str]:
    """Return the stem of each place's files: sky, or sky-NAME for several."""
    if count == 1:
        return ["sky"]
    stems: list[str] = []
    for k in range(count):
        word = re.sub(r"[^\w.-]+", "_", names[k])[:60].strip("._") if names else ""
        stem = f"sky-{word or k + 1}"
        stems.append(stem if stem not in stems else f"{stem}-{k + 1}")
    return stems


def _write(
    out: Path, views: "list[SkyView]", stems: list[str], outputs: list[str], projection: str,
    dates: tuple[str, ...],
) -> list[Path]:  # fmt: skip
    """Write the files of all places; return their paths."""
    from umbra.folders.atomic import check_folder_name, replace_results  # noqa: PLC0415
    from umbra.writers.sky_tables import WRITERS, write_values  # noqa: PLC0415

    check_folder_name(out)
    files = []
    with replace_results(out) as folder:
        for view, stem in zip(views, stems, strict=True):
            picture = view.plot(projection, dates)
            for name in outputs:
                ending = WRITERS[name][0] if name in WRITERS else f".{name}"
                path = folder / f"{stem}{ending}"
                if name in PICTURES:
                    picture.save(path)
                elif name == "json":
                    write_values(path, view, dates)
                else:
                    WRITERS[name][1](path, view)
                files.append(out / path.name)
    return files


def _tell(views: "list[SkyView]", stems: list[str], dates: tuple[str, ...]) -> None:
    """Print the results for a person."""
    from umbra.sun import name_date  # noqa: PLC0415

    for view, stem in zip(views, stems, strict=True):
        point = ", ".join(f"{value:g}" for value in view.point)
        echo(
            f"{stem}: sky component {view.sky_component:.2f} %, sky view factor "
            f"{view.sky_view_factor:.4f} at {point}"
        )
        for name, share in list(view.blocked_by.items())[:5]:
            if share >= _SHOWN:
                echo(f"  {100 * share:5.1f} % of the open sky component behind {name}")
        for spell in view.sun(dates) if dates else ():
            echo(
                f"  {name_date(spell.date)}: sun from {spell.start:%H:%M:%S} (from behind "
                f"{spell.out_of}) to {spell.end:%H:%M:%S} (goes behind {spell.behind})"
            )
