"""``umbra render``: a picture with exact shadows."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from umbra.calls.camera_options import CameraOptions
from umbra.calls.options import LightOptions, RenderOptions
from umbra.cli.options import HeadedOption, NewPath, SectionedCommand, record_options, take_record
from umbra.cli.reading import (
    find_model_site,
    read_model,
    reading_options,
    site_options,
    take_site,
)
from umbra.cli.terminal import echo, echo_json, echo_path, name_reading, show_progress
from umbra.errors import InputError, write_for_shell

if TYPE_CHECKING:
    from umbra.calls.picture import Picture
    from umbra.sun import Site

__all__ = ["command"]

HEADINGS = ("Camera", "Lights", "Style", "Casters", "Site", "Reading", "Counting", "Files")


@click.command("render", cls=SectionedCommand, headings=HEADINGS)
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@record_options(CameraOptions)
@record_options(LightOptions)
@site_options
@reading_options("--axis-up")
@record_options(RenderOptions)
@click.option(
    "--no-ground", cls=HeadedOption, heading="Style", is_flag=True, help="No ground plane."
)
@click.option("--out", type=NewPath(), metavar="FILE.png", help="The picture to write.")
@click.option("--arrays", type=NewPath(), metavar="FILE.npz", help="The arrays to write.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    out: Path | None,
    arrays: Path | None,
    no_ground: bool,
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
    """  # noqa: D301  (click asks for a real backspace)
    written = _find_paths(out, arrays)
    lights = take_record(LightOptions, given)
    _check_site(lights)
    given["ground"] = False if no_ground else given["ground"]
    options = take_record(RenderOptions, given)
    if out is None:  # arrays are those of the pixels' centres
        options = replace(options, samples=1)
    lens = take_record(CameraOptions, given)
    from umbra.calls.arguments import check_picture_memory  # noqa: PLC0415
    from umbra.calls.picture import draw_picture  # noqa: PLC0415
    from umbra.writers.atomic import replace_file  # noqa: PLC0415
    from umbra.writers.pixels import write_png  # noqa: PLC0415

    check_picture_memory(lens.size, lights.count)
    with ExitStack() as stack:
        beside = {path: stack.enter_context(replace_file(path)) for path in written}
        stages = stack.enter_context(show_progress(quiet=False))
        stages.begin(name_reading(files))
        scene = read_model(files)
        stages.show_scene(scene)
        stages.begin("drawing")
        shining = lights.make(lambda: find_model_site(scene))
        if lights.date is not None and not options.caption:
            options = replace(options, caption=_tell_sun(lights, find_model_site(scene)))
        picture = draw_picture(
            scene, lens.make(scene), shining, options, _warn, is_bare=arrays is not None,
            tell=_tell,
        )  # fmt: skip
        if out is not None:
            write_png(beside[out], picture.image)
        if arrays is not None:
            import numpy as np  # noqa: PLC0415

            with beside[arrays].open("wb") as file:
                np.savez_compressed(file, **picture.arrays())  # type: ignore[arg-type]
    if as_json:
        echo_json({"files": [str(path) for path in written], **_sum_up(picture)})
    else:
        for path in written:
            echo_path(path)


def _find_paths(out: Path | None, arrays: Path | None) -> list[Path]:
    """List what is to be written; there must be something."""
    if out is None and arrays is None:
        msg = "nothing to write; give --out FILE.png or --arrays FILE.npz"
        raise InputError(msg)
    if out is not None and out.suffix.lower() != ".png":
        msg = f"the picture '{out}' would be a PNG; name it {out.with_suffix('.png')}"
        raise InputError(msg)
    return [path for path in (out, arrays) if path is not None]


def _check_site(lights: LightOptions) -> None:
    """Refuse a site without the sun that it places, before anything is read."""
    given = [f"{name}=" for name, value in take_site().items() if value is not None]
    if lights.date is None and given:
        msg = f"{' and '.join(given)} places the sun; give date= and at=, too, or leave it out"
        raise InputError(msg)


def _sum_up(picture: "Picture") -> dict[str, Any]:
    """Give a picture's numbers for ``--json``."""
    seen = int(picture.is_seen.sum())
    return {
        "pixels": seen,
        "deepest_count": [int(n.max()) for n in picture.count],
        "lit_share": [float(m.sum() / max(seen, 1)) for m in picture.lit],
    }


def _tell_sun(lights: LightOptions, site: "Site") -> str:
    """Describe the sun's date, time and place."""
    from umbra.sun.clock import find_stamps  # noqa: PLC0415
    from umbra.sun.local_time import parse_date  # noqa: PLC0415

    stamp = find_stamps(parse_date(str(lights.date)), [str(lights.at)], site.zone)
    north = f"{abs(site.latitude):.3f}° {'N' if site.latitude >= 0 else 'S'}"
    east = f"{abs(site.longitude):.3f}° {'E' if site.longitude >= 0 else 'W'}"
    return f"{lights.date} {lights.at} {'/'.join(stamp.abbreviations())} · {north}, {east}"


def _tell(message: str) -> None:
    """Tell the person at the terminal which ground was assumed."""
    echo(f"{write_for_shell(message)}, --no-ground none", err=True)


def _warn(message: str) -> None:
    """Tell the person at the terminal, whatever the results are for."""
    echo(f"umbra: warning: {write_for_shell(message)}", err=True)
