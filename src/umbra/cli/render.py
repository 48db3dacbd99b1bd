"""``umbra render``: a picture with exact shadows."""

from contextlib import ExitStack
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import click

from umbra.calls.camera_options import CameraOptions
from umbra.calls.options import VECTORS, LightOptions, RenderOptions, ShadowOptions
from umbra.cli.options import NewPath, SectionedCommand, record_options, take_record
from umbra.cli.reading import (
    find_model_site,
    read_model,
    reading_options,
    site_options,
    take_site,
)
from umbra.cli.terminal import echo, echo_json, echo_path, name_reading, show_progress
from umbra.errors import InputError, write_for_shell
from umbra.machine import load_compiler

__all__ = ["command"]

HEADINGS = ("Camera", "Lights", "Style", "Casters", "Site", "Reading", "Counting", "Files")


@click.command("render", cls=SectionedCommand, headings=HEADINGS)
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@record_options(CameraOptions)
@record_options(LightOptions)
@site_options
@reading_options("--axis-up")
@record_options(RenderOptions)
@record_options(ShadowOptions)
@click.option(
    "--out", type=NewPath(), metavar="FILE.png", help="The picture; FILE.svg or .pdf: as vectors."
)
@click.option(
    "--arrays", type=NewPath(), metavar="FILE.npz", help="What each pixel shows, as numbers."
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
    umbra render house.ifc --shadows hatched --out house.pdf
    """  # noqa: D301  (click asks for a real backspace)
    load_compiler()
    written, kind = _find_paths(out, arrays), _find_kind(out)
    lights = take_record(LightOptions, given)
    _check_site(lights)
    options = take_record(RenderOptions, given)
    if out is None:  # arrays are those of the pixels' centres
        options = replace(options, samples=1)
    lens = take_record(CameraOptions, given)
    from umbra.calls.arguments import check_picture_memory  # noqa: PLC0415
    from umbra.calls.picture import draw_picture  # noqa: PLC0415
    from umbra.calls.vectors import draw_seen  # noqa: PLC0415
    from umbra.folders.atomic import replace_file  # noqa: PLC0415
    from umbra.writers.pixels import write_png  # noqa: PLC0415
    from umbra.writers.typeface import note_missing  # noqa: PLC0415

    tell, warn = (_pass_over, _pass_over) if quiet else (_tell, _warn)
    check_picture_memory(lens.size, lights.count)
    with ExitStack() as stack:
        beside = {path: stack.enter_context(replace_file(path)) for path in written}
        stages = stack.enter_context(show_progress(quiet))
        stages.begin(name_reading(files))
        scene = read_model(files, tells=True)
        stages.show_scene(scene)
        stages.begin(what := _name_drawing(scene, lens))
        find_once = cache(lambda: find_model_site(scene))
        shining = lights.make(find_once)
        if lights.date is not None and not options.caption:
            options = replace(options, caption=lights.tell_sun(find_once()))
        view = scene, lens.make(scene), shining, options
        summary = {}
        if out is not None and kind in VECTORS:
            drawing = draw_seen(*view, shadows, tell=tell, advance=stages.advance)
            summary = drawing.sum_up()
            lacking = note_missing(options.caption) if kind == "pdf" else ""
            for note in filter(None, (*drawing.notes, lacking)):
                warn(note)
            drawing.write_beside(beside[out], kind)
        if arrays is not None or kind == "png":
            picture = draw_picture(
                *view, warn, is_bare=arrays is not None, tell=tell,
                advance=partial(stages.advance, what=what, unit="samples"),
            )  # fmt: skip
            summary |= picture.sum_up()
        if out is not None and kind == "png":
            write_png(beside[out], picture.image)
        if arrays is not None:
            import numpy as np  # noqa: PLC0415

            with beside[arrays].open("wb") as file:
                np.savez_compressed(file, **picture.arrays())  # type: ignore[arg-type]
    if as_json:
        echo_json({"files": [str(path) for path in written], **summary})
    elif not quiet:
        for path in written:
            echo_path(path)


def _find_paths(out: Path | None, arrays: Path | None) -> list[Path]:
    """List what is to be written; there must be something."""
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


def _check_site(lights: LightOptions) -> None:
    """Refuse a site without the sun that it places, before anything is read."""
    given = [f"{name}=" for name, value in take_site().items() if value is not None]
    if lights.date is None and given:
        msg = f"{' and '.join(given)} places the sun; give date= and at=, too, or leave it out"
        raise InputError(msg)


def _tell(message: str) -> None:
    """Tell the person at the terminal what was assumed."""
    echo(write_for_shell(message), err=True)


def _warn(message: str) -> None:
    """Tell the person at the terminal, whatever the results are for."""
    echo(f"umbra: warning: {write_for_shell(message)}", err=True)


def _pass_over(message: str) -> None:
    """Tell nothing."""
