"""``umbra render``: a picture with exact shadows."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import click

from umbra.calls.camera_options import CameraOptions
from umbra.calls.film import FILMS, check_film, write_film
from umbra.calls.film_shots import FilmOptions, find_turned_points, plan_shots
from umbra.calls.light_options import LightOptions
from umbra.calls.picture_options import VECTORS, RenderOptions, ShadowOptions
from umbra.cli.click_options import NewPath, SectionedCommand, record_options, take_record
from umbra.cli.reading import (
    files_argument,
    find_model_site,
    read_model,
    reading_options,
    site_options,
    take_site,
)
from umbra.cli.terminal import Stages, echo, echo_json, echo_path, name_reading, show_progress
from umbra.errors import InputError, write_for_shell
from umbra.machine import load_compiler

__all__ = ["command"]

HEADINGS = ("Camera", "Lights", "Film", "Style", "Casters", "Site", "Reading", "Counting", "Files")


@click.command("render", cls=SectionedCommand, headings=HEADINGS)
@files_argument
@record_options(CameraOptions)
@record_options(LightOptions)
@record_options(FilmOptions)
@site_options
@reading_options("--axis-up")
@record_options(RenderOptions)
@record_options(ShadowOptions)
@click.option(
    "--out",
    type=NewPath(),
    metavar="FILE.png",
    help="The picture; FILE.svg or .pdf: as vectors; FILE.mp4 or .gif: a film.",
)
@click.option(
    "--arrays",
    type=NewPath(),
    metavar="FILE.npz",
    help="Each pixel's position, normal, counts and light.",
)
@click.option("--quiet", is_flag=True, help="Print only errors and, with --json, the result.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    out: Path | None,
    arrays: Path | None,
    shadows: str,
    quiet: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """
    Draw a picture with exact hard shadows of any number of lights, or with soft ones.

    Without --light, --spot and --date the file's own lights are used, or one from the upper left.

    \b
    Examples:
    umbra render tower.glb --eye 40,-60,30 --target 0,0,10 --light 4,-3,8,0 --out tower.png
    umbra render house.ifc --date 2026-03-21 --at 15:00 --out house.png
    umbra render house.ifc --view street --time-of-day evening --out street.png
    umbra render house.ifc --shadows hatched --out house.pdf
    umbra render quarter.city.json --turntable 8s --out quarter.mp4
    umbra render quarter.city.json --date 2026-03-21 --at 07:00 --until 17:30 --out day.mp4
    """  # noqa: D301  (click asks for a real backspace)
    load_compiler()
    moves, kind = take_record(FilmOptions, given), _find_kind(out)
    written = _find_paths(out, arrays, is_film=moves.is_asked)
    lights = take_record(LightOptions, given)
    _check_site(lights)
    options = take_record(RenderOptions, given)
    if out is None:  # arrays are those of the pixels' centres
        options = replace(options, samples=1)
    lens = take_record(CameraOptions, given)
    if out is not None and moves.is_asked:
        check_film(out, lens.size, moves.rate)
        _check_path(moves, lens)
    from umbra.calls.arguments import check_picture_memory  # noqa: PLC0415
    from umbra.folders.atomic import replace_file  # noqa: PLC0415

    said = (_pass_over, _pass_over) if quiet else (_tell, _warn)
    check_picture_memory(lens.size, lights.count)
    with ExitStack() as stack:
        beside = {path: stack.enter_context(replace_file(path)) for path in written}
        stages = stack.enter_context(show_progress(quiet))
        stages.begin(name_reading(files))
        scene = read_model(files, tells=True)
        stages.show_scene(scene)
        drawn = scene, lens, lights, options
        if out is not None and moves.is_asked:
            summary = _draw_film(beside[out], kind, drawn, moves, stages, *said)
        else:
            summary = _draw_pictures(beside, out, arrays, drawn, shadows, stages, *said)
    if as_json:
        echo_json({"files": [str(path) for path in written], **summary})
    elif not quiet:
        for path in written:
            echo_path(path)


Drawn = tuple[Any, CameraOptions, LightOptions, RenderOptions]
Say = Callable[[str], object]


def _draw_film(
    path: Path, kind: str, drawn: Drawn, moves: FilmOptions, stages: Stages, tell: Say, warn: Say
) -> dict[str, Any]:
    """Draw a film; return its numbers."""
    scene, lens, lights, options = drawn
    lights = _settle(lights, lambda: find_model_site(scene), tell)
    if lights.horizon is not None:
        msg = "horizon= judges the sun of a picture; leave it out of a film"
        raise InputError(msg, option="horizon")
    sun = None
    if lights.date is not None:
        sun = find_model_site(scene), lights.date, str(lights.at)
    still = replace(lights, date=None, at=None).make(lambda: find_model_site(scene))
    is_given = lens.eye is not None or lens.height is not None or lens.view == "street"
    held = None if is_given else find_turned_points(scene)
    shots = plan_shots(moves, lens.make(scene), still, sun, held)
    stages.begin(what := f"drawing {len(shots):,} frames")
    write_film(
        path, scene, shots, options, moves.rate, kind=kind, warn=warn, tell=tell,
        advance=partial(stages.advance, what=what, unit="frames"),
    )  # fmt: skip
    return {"frames": len(shots), "seconds": len(shots) / moves.rate}


def _draw_pictures(
    beside: dict[Path, Path], out: Path | None, arrays: Path | None, drawn: Drawn, shadows: str,
    stages: Stages, tell: Say, warn: Say,
) -> dict[str, Any]:  # fmt: skip
    """Draw a picture, its arrays, or both; return its numbers."""
    from umbra.calls.picture import draw_picture  # noqa: PLC0415
    from umbra.calls.vectors import draw_seen  # noqa: PLC0415
    from umbra.land.named_land import NamedLand  # noqa: PLC0415
    from umbra.writers.pixels import write_png  # noqa: PLC0415
    from umbra.writers.typeface import note_missing  # noqa: PLC0415

    scene, lens, lights, options = drawn
    kind = _find_kind(out)
    stages.begin(what := _name_drawing(scene, lens))
    find_once = cache(lambda: find_model_site(scene))
    lights = _settle(lights, find_once, tell)
    shining = lights.make(find_once)
    if lights.horizon is not None:
        when = f"{lights.date} at {lights.at}"
        NamedLand.of(lights.horizon).check_sun(scene, find_once(), shining[-1].position, when)
    if lights.date is not None and not options.caption:
        options = replace(options, caption=lights.tell_sun(find_once()))
    view = scene, lens.make(scene), shining, options
    summary: dict[str, Any] = {}
    if out is not None and kind in VECTORS:
        drawing = draw_seen(*view, shadows, is_filed=True, tell=tell, advance=stages.advance)
        summary = drawing.sum_up()
        lacking = note_missing(options.caption) if kind == "pdf" else ""
        for note in filter(None, (*drawing.notes, lacking)):
            warn(note)
        drawing.write_beside(beside[out], kind)
    if arrays is not None or kind == "png":
        picture = draw_picture(
            *view, warn, is_bare=arrays is not None, is_filed=True, tell=tell,
            advance=partial(stages.advance, what=what, unit="samples"),
        )  # fmt: skip
        summary |= picture.sum_up()
    if out is not None and kind == "png":
        write_png(beside[out], picture.image)
    if arrays is not None:
        import numpy as np  # noqa: PLC0415

        with beside[arrays].open("wb") as file:
            np.savez_compressed(file, **picture.arrays())  # type: ignore[arg-type]
    return summary


def _settle(lights: LightOptions, find_site: Callable[[], Any], tell: Say) -> LightOptions:
    """Find the sun's clock time; tell the one that is assumed."""
    settled = lights.settle(find_site)
    if lights.assumes_time:
        tell(f"note: {settled.tell_assumed()}")
    return settled


def _find_paths(out: Path | None, arrays: Path | None, *, is_film: bool) -> list[Path]:
    """List what is to be written; there must be something."""
    if is_film:
        if out is None or arrays is not None:
            msg = "a film has no arrays; give --out FILE.mp4 or .gif, and leave arrays= out"
            raise InputError(msg, option="arrays" if arrays is not None else "out")
        return [out]
    if out is not None and _find_kind(out) in FILMS:
        msg = (
            f"'{out}' is a film; say what moves: turntable='8s', path='FILE.json' or until='HH:MM'"
        )
        raise InputError(msg, option="turntable")
    if out is None and arrays is None:
        msg = "nothing to write; give --out FILE.png or --arrays FILE.npz"
        raise InputError(msg)
    if out is not None and _find_kind(out) not in {"png", *VECTORS}:
        msg = f"'{out}' would be a PNG, SVG or PDF; name it {out.with_suffix('.png')}"
        raise InputError(msg)
    if arrays is not None and arrays.suffix.lower() != ".npz":  # a slip would replace a model
        msg = f"'{arrays}' would be arrays of NumPy; name it {arrays.with_suffix('.npz')}"
        raise InputError(msg)
    return [path for path in (out, arrays) if path is not None]


def _name_drawing(scene: Any, lens: CameraOptions) -> str:
    """Describe the drawing stage."""
    triangles = sum(part.triangles for part in scene.parts)
    return f"drawing {triangles:,} triangles, {lens.size[0]} x {lens.size[1]} pixels"


def _find_kind(out: Path | None) -> str:
    return "" if out is None else out.suffix.lower().removeprefix(".")


def _check_path(moves: FilmOptions, lens: CameraOptions) -> None:
    """Refuse a camera beside a path, whose views are cameras."""
    if moves.path is None:
        return
    for name in ("eye", "view", "fov", "height"):
        if getattr(lens, name) is not None:
            msg = f"path= has the cameras of its views; leave {name}= out"
            raise InputError(msg, option=name)


def _check_site(lights: LightOptions) -> None:
    """Refuse a site without the sun that it places, before anything is read."""
    given = [f"{name}=" for name, value in take_site().items() if value is not None]
    if not lights.has_sun and given:
        verb, them = ("places", "it") if len(given) == 1 else ("place", "them")
        msg = f"{' and '.join(given)} {verb} the sun; give date= and at=, too, or leave {them} out"
        raise InputError(msg, option="date")
    if not lights.has_sun and lights.horizon is not None:
        msg = "horizon= hides the sun; give date= and at=, too, or leave it out"
        raise InputError(msg, option="horizon")


def _tell(message: str) -> None:
    """Tell the person at the terminal what was assumed."""
    echo(write_for_shell(message), err=True)


def _warn(message: str) -> None:
    """Tell the person at the terminal, whatever the results are for."""
    echo(f"umbra: warning: {write_for_shell(message)}", err=True)


def _pass_over(message: str) -> None:
    """Tell nothing."""
