"""``umbra render``: a picture with exact shadows."""

from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from umbra.cli.options import LENGTH, SIZE, HeadedOption, NewPath, Numbers, SectionedCommand
from umbra.cli.reading import (
    find_model_site,
    read_model,
    read_values,
    reading_options,
    site_options,
)
from umbra.cli.terminal import echo, echo_json, echo_path, name_reading, show_progress
from umbra.devices import CHOICES, DEFAULT, DEVICES
from umbra.errors import InputError, write_for_shell
from umbra.methods import SOFT

if TYPE_CHECKING:
    from umbra.calls.picture import Picture

__all__ = ["command"]

HEADINGS = ("Camera", "Lights", "Site", "Reading", "Counting", "Files")
_camera = partial(click.option, cls=HeadedOption, heading="Camera")
_lights = partial(click.option, cls=HeadedOption, heading="Lights")
_counting = partial(click.option, cls=HeadedOption, heading="Counting")

POINT = Numbers("X,Y,Z", 3)
UPWARD = Numbers("X,Y,Z", 3, remedy="numbers joined by commas; the file's own axis is --axis-up")


def _tell_methods() -> str:
    """List the methods of the default device, and what others have besides."""
    own = DEVICES[DEFAULT].methods.hard
    texts = [", ".join(own[:-1]) + f" or {own[-1]}"]
    for device in DEVICES.values():
        more = [method for method in device.methods.hard if method not in own]
        if more:
            texts.append(f"on {device.name} also {', '.join(more[:-1])} or {more[-1]}")
    return "; ".join(texts) + "."


@click.command("render", cls=SectionedCommand, headings=HEADINGS)
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@_camera(
    "--eye",
    type=POINT,
    help="Position of the camera [m]; default: the whole model, seen from above.",
)
@_camera("--target", type=POINT, help="Point that the camera looks at [m].")
@_camera(
    "--up",
    type=UPWARD,
    default=(0.0, 0.0, 1.0),
    help="Direction that points up in the picture; default: 0,0,1.",
)
@_camera(
    "--fov",
    type=float,
    metavar="DEG",
    default=50.0,
    show_default=True,
    help="Vertical field of view [degrees].",
)
@_camera(
    "--height",
    type=LENGTH,
    metavar="M",
    help="Orthographic view: the height that the picture shows [m].",
)
@_camera(
    "--size",
    type=SIZE,
    default=(1024, 768),
    help="Size of the picture in pixels; default: 1024x768.",
)
@_camera(
    "--near",
    type=LENGTH,
    metavar="M",
    help=(
        "Distance of the near plane [m]; default: 0.1, or a thousandth of the diagonal of a model "
        "smaller than 100 m."
    ),
)
@_lights(
    "--light",
    "lights",
    type=Numbers("X,Y,Z[,W]", 3, 4),
    multiple=True,
    help="A light; W=1 is a point (default), W=0 a direction toward the light; repeatable.",
)
@_lights(
    "--spot",
    "spots",
    type=Numbers("X,Y,Z,TX,TY,TZ,DEG", 7),
    multiple=True,
    help="A spot light: its position, target and half angle; repeatable.",
)
@_lights("--date", metavar="DATE", help="Add the sun on this local date, YYYY-MM-DD, at --at.")
@_lights("--at", metavar="HH:MM", help="Local time of the sun.")
@site_options
@reading_options("--axis-up")
@_counting("--ground", type=LENGTH, metavar="Z", help="Add a ground plane at this height [m].")
@_counting(
    "--method",
    metavar="NAME",
    default="auto",
    show_default=True,
    help=_tell_methods(),
)
@_counting(
    "--mask-scale",
    type=click.Choice(["1", "2", "4"]),
    default="1",
    show_default=True,
    help="With gl: count in a picture with this fraction of the width and height: 1, 1/2 or 1/4.",
)
@_counting(
    "--mask-filter",
    type=click.Choice(["joint", "bilinear", "nearest"]),
    default="joint",
    show_default=True,
    help="How to enlarge that picture: joint interpolates only within a surface.",
)
@_counting(
    "--device",
    type=click.Choice(CHOICES),
    default="auto",
    help="Device that counts: cpu (auto), or gl, which is OpenGL.",
)
@_lights(
    "--soft",
    type=click.Choice(SOFT),
    help=(
        "Soft shadows: by samples of the light (the reference), penumbra wedges (fast), depth "
        "complexity (right for overlaps, too) or scaled layers after Weng (which only look soft)."
    ),
)
@_lights(
    "--light-size",
    type=float,
    multiple=True,
    metavar="R",
    help=(
        "With --soft, the radius of all lights or, repeated, of each: metres, or for a direction "
        "degrees (default: 0.2665, the sun's)."
    ),
)
@_counting(
    "--threads", type=click.IntRange(1), metavar="N", help="Number of threads; default: all cores."
)
@click.option("--out", type=NewPath(), metavar="FILE.png", help="The picture to write.")
@click.option("--arrays", type=NewPath(), metavar="FILE.npz", help="The arrays to write.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    out: Path | None,
    arrays: Path | None,
    as_json: bool,
    **options: Any,
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
    from umbra.calls.arguments import (  # noqa: PLC0415
        check_picture_memory,
        make_camera,
        make_lights,
    )
    from umbra.calls.picture import RenderOptions, draw_picture  # noqa: PLC0415
    from umbra.scene import Camera, spot_light  # noqa: PLC0415
    from umbra.sun import sun_light  # noqa: PLC0415
    from umbra.writers.atomic import replace_file  # noqa: PLC0415
    from umbra.writers.pixels import write_png  # noqa: PLC0415

    site = {name: read_values()[name] for name in ("lat", "lon", "tz", "north")}
    date, at = options.pop("date"), options.pop("at")
    _check_sun(date, at, site)
    lens = {
        name: options.pop(name) for name in ("eye", "target", "up", "size", "fov", "height", "near")
    }
    lights = make_lights(options.pop("lights"))
    lights += [spot_light(v[:3], v[3:6], v[6]) for v in options.pop("spots")]
    chosen = RenderOptions(**{**options, "mask_scale": int(options["mask_scale"])})
    if (lens["eye"] is None) != (lens["target"] is None):
        msg = "a view needs both --eye and --target; leave both out to see the whole model"
        raise InputError(msg)
    if lens["eye"] is not None:  # slips in a camera are told before anything is read
        Camera(**{name: value for name, value in lens.items() if value is not None})
    check_picture_memory(lens["size"], len(lights) + (date is not None))
    with ExitStack() as stack:
        beside = {path: stack.enter_context(replace_file(path)) for path in written}
        stages = stack.enter_context(show_progress(quiet=False))
        stages.begin(name_reading(files))
        scene = read_model(files)
        stages.show_scene(scene)
        stages.begin("drawing")
        if date is not None and at is not None:
            lights.append(sun_light(find_model_site(scene), date, at))
        picture = draw_picture(scene, make_camera(scene, **lens), lights, chosen, _warn)
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


def _check_sun(date: str | None, at: str | None, site: dict[str, Any]) -> None:
    """Refuse half of what says where the sun stands, before anything is read."""
    if (date is None) != (at is None):
        msg = "the sun's light needs both --date and --at (a clock time: --at 15:00)"
        raise InputError(msg)
    given = [f"--{name}" for name, value in site.items() if value is not None]
    if date is None and given:
        msg = f"{' and '.join(given)} places the sun; give --date and --at, too, or leave it out"
        raise InputError(msg)
    if date is not None:
        from umbra.sun.local_time import parse_date  # noqa: PLC0415

        parse_date(date)


def _sum_up(picture: "Picture") -> dict[str, Any]:
    """Give a picture's numbers for ``--json``."""
    seen = int(picture.is_seen.sum())
    return {
        "pixels": seen,
        "deepest_count": [int(n.max()) for n in picture.count],
        "lit_share": [float(m.sum() / max(seen, 1)) for m in picture.lit],
    }


def _warn(message: str) -> None:
    """Tell the person at the terminal, whatever the results are for."""
    echo(f"umbra: warning: {write_for_shell(message)}", err=True)
