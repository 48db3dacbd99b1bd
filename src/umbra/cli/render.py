"""``umbra render``: a picture with exact shadows."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from umbra.cli.cache import cache_option
from umbra.cli.columns import column_options
from umbra.cli.outside import outside_option
from umbra.cli.pose import pose_options, read_posed
from umbra.cli.progress import name_reading, show_progress
from umbra.cli.render_checks import (
    check_light,
    check_memory,
    check_sun,
    warn,
    warn_of_view,
)
from umbra.cli.sections import make_sectioned
from umbra.cli.site import site_options
from umbra.cli.soft import check_soft, size_lights, soft_options, soften
from umbra.cli.terminal import echo_json, echo_path
from umbra.cli.values import LENGTH, SIZE, NewPath, Numbers
from umbra.devices import CHOICES, DEFAULT, DEVICES, find_device
from umbra.errors import InputError

__all__ = ["command"]

SECTIONS = {
    "--eye": "Camera",
    "--light": "Lights",
    "--lat": "Site",
    "--height-column": "Reading",
    "--name-column": "Reading",
    "--ground": "Counting",
    "--axis-up": "Reading",
    "--method": "Counting",
    "--out": "Files",
    "--help": "Files",
}

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


@click.command("render", cls=make_sectioned(SECTIONS))
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--eye", type=POINT, help="Where the camera is [m]; default: the whole model, seen from above."
)
@click.option("--target", type=POINT, help="What it looks at [m].")
@click.option(
    "--up", type=UPWARD, default=(0.0, 0.0, 1.0), help="Upward in the picture; default: 0,0,1."
)
@click.option(
    "--fov",
    type=float,
    metavar="DEG",
    default=50.0,
    show_default=True,
    help="Vertical field of view [degrees].",
)
@click.option(
    "--height", type=LENGTH, metavar="M", help="Orthographic instead: the picture's height [m]."
)
@click.option("--size", type=SIZE, default=(1024, 768), help="In pixels; default: 1024x768.")
@click.option(
    "--near",
    type=LENGTH,
    metavar="M",
    help="Near plane [m]; default: 0.1, or a thousandth of a model smaller than 100 m.",
)
@click.option(
    "--light",
    "lights",
    type=Numbers("X,Y,Z[,W]", 3, 4),
    multiple=True,
    help="Repeatable; W=1 a point (default), W=0 a direction toward the light.",
)
@click.option(
    "--spot",
    "spots",
    type=Numbers("X,Y,Z,TX,TY,TZ,DEG", 7),
    multiple=True,
    help="Repeatable: place, target and half angle of a spot light, after the others.",
)
@click.option(
    "--date", metavar="DATE", help="Also the sun's light on this local date, YYYY-MM-DD, at --at."
)
@click.option("--at", "clock", metavar="HH:MM", help="Local clock time of the sun.")
@site_options
@column_options
@pose_options
@outside_option
@cache_option
@click.option("--ground", type=LENGTH, metavar="Z", help="Add a ground plane [m].")
@click.option("--axis-up", type=click.Choice(["x", "y", "z"]), help="The file's upward axis.")
@click.option(
    "--method",
    metavar="NAME",
    default="auto",
    show_default=True,
    help=_tell_methods(),
)
@click.option(
    "--mask-scale",
    type=click.Choice(["1", "2", "4"]),
    default="1",
    show_default=True,
    help="On gl: count in a picture so many times smaller, and lay it over this one.",
)
@click.option(
    "--mask-filter",
    type=click.Choice(["joint", "bilinear", "nearest"]),
    default="joint",
    show_default=True,
    help="How it is laid: joint takes only pixels of the same surface.",
)
@click.option(
    "--device",
    type=click.Choice(CHOICES),
    default="auto",
    help="Where to count: cpu (auto), or gl with OpenGL.",
)
@soft_options
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all cores.")
@click.option("--out", type=NewPath(), metavar="FILE.png", help="Picture to write.")
@click.option("--arrays", type=NewPath(), metavar="FILE.npz", help="Arrays to write.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    files: tuple[str, ...],
    eye: tuple[float, ...] | None,
    target: tuple[float, ...] | None,
    up: tuple[float, ...],
    fov: float,
    height: float | None,
    size: tuple[int, int],
    near: float | None,
    lights: tuple[tuple[float, ...], ...],
    spots: tuple[tuple[float, ...], ...],
    date: str | None,
    clock: str | None,
    lat: float | None,
    lon: float | None,
    tz: str | None,
    north: float | None,
    time: float | None,
    animation: str | None,
    ground: float | None,
    axis_up: str | None,
    method: str,
    mask_scale: str,
    mask_filter: str,
    device: str,
    soft: str | None,
    light_sizes: tuple[float, ...],
    threads: int | None,
    out: Path | None,
    arrays: Path | None,
    as_json: bool,
) -> None:
    """
    Draw a picture with exact hard shadows of any number of lights, or with soft ones.

    Without --light, --spot and --date a glTF file's own lights shine, or one from the upper left.

    \b
    Examples:
    umbra render tower.glb --eye 40,-60,30 --target 0,0,10 --light 4,-3,8,0 --out tower.png
    umbra render house.ifc --date 2026-03-21 --at 15:00 --out house.png
    """  # noqa: D301  (click asks for a real backspace)
    if out is None and arrays is None:
        msg = "nothing to write; give --out FILE.png or --arrays FILE.npz"
        raise InputError(msg)
    if out is not None and out.suffix.lower() != ".png":
        msg = f"the picture '{out}' would be a PNG; name it {out.with_suffix('.png')}"
        raise InputError(msg)
    import numpy as np  # noqa: PLC0415

    from umbra.cpu.shade import shade  # noqa: PLC0415
    from umbra.machine import count_cores  # noqa: PLC0415
    from umbra.scene import Camera, Light, directional_light, spot_light  # noqa: PLC0415
    from umbra.scene.palette import expose_lights  # noqa: PLC0415
    from umbra.sun import find_site, sun_light  # noqa: PLC0415
    from umbra.window.viewpoint import frame_bounds  # noqa: PLC0415
    from umbra.writers.atomic import replace_file  # noqa: PLC0415
    from umbra.writers.raster import write_png  # noqa: PLC0415

    if (eye is None) != (target is None):
        msg = "a view needs both --eye and --target; leave both out to see the whole model"
        raise InputError(msg)
    check_sun(date, clock, {"lat": lat, "lon": lon, "tz": tz, "north": north})
    counting = find_device(device)
    counting.methods.check(method)
    check_soft(soft, light_sizes)
    if mask_scale != "1" and (device != "gl" or soft is not None):
        msg = "--mask-scale is for hard shadows on gl; give --device gl and no --soft"
        raise InputError(msg)
    lens: dict[str, Any] = {"size": size, "fov": fov, "height": height}
    lens |= {} if near is None else {"near": near}
    # Slips in a camera that is given are told before anything is read.
    camera = None if eye is None else Camera(eye, target, up, **lens)  # type: ignore[arg-type]
    all_lights = [Light(check_light(v)) for v in lights]
    all_lights += [spot_light(v[:3], v[3:6], v[6]) for v in spots]
    threads = threads or count_cores()
    check_memory(size, len(all_lights))
    written = [path for path in (out, arrays) if path is not None]
    with ExitStack() as stack:
        beside = {path: stack.enter_context(replace_file(path)) for path in written}
        stages = stack.enter_context(show_progress(quiet=False))
        stages.begin(name_reading(files))
        scene = read_posed(files, axis_up, time, animation)
        stages.show_scene(scene)
        stages.begin("drawing")
        if date is not None and clock is not None:
            all_lights.append(sun_light(find_site(scene, lat, lon, tz, north), date, clock))
            check_memory(size, len(all_lights))
        if not all_lights:
            all_lights = list(expose_lights(scene))
            check_memory(size, len(all_lights))
        framed = frame_bounds(scene.bounds(), size, fov=fov).camera(size)
        if camera is None:
            camera = Camera(framed.eye, framed.target, up, **lens)  # type: ignore[arg-type]
        if near is None:
            camera = replace(camera, near=framed.near)
        if not all_lights:
            right, up_there, forward = camera.axes()
            all_lights = [directional_light(-0.6 * right + 0.9 * up_there - 0.5 * forward)]
        sized = size_lights(all_lights, light_sizes) if soft is not None else []
        counter: Any = stack.enter_context(
            counting.open_frames(scene, ground, threads=threads, warn=warn)
        )
        view, frame = counter.see(camera)
        warn_of_view(scene, camera, frame, threads)
        shares = []
        if mask_scale == "1":
            counts = [counter.count(view, camera, light, method) for light in all_lights]
        else:
            from umbra.gl.masks.upsampling import find_shares  # noqa: PLC0415

            shares = find_shares(
                counter, frame, camera, all_lights, method, scale=int(mask_scale), kind=mask_filter
            )
            seen_at = frame.part != -1
            counts = [((share < 0.5) & seen_at).astype(np.int32) for share in shares]
        lit = [frame.lit(n, light) for n, light in zip(counts, all_lights, strict=True)]
        softened, reached = (
            soften(soft, counter, view, frame, camera, sized) if soft is not None else ([], lit)
        )
        if shares:
            none = np.zeros_like(counts[0])
            reached = [
                share * frame.lit(none, light)
                for share, light in zip(shares, all_lights, strict=True)
            ]
        if out is not None:
            write_png(beside[out], shade(scene, frame, all_lights, reached, view))
        if arrays is not None:
            kept: dict[str, Any] = {
                "position": frame.position,
                "normal": frame.normal,
                "count": np.stack(counts).astype(np.int32),
                "lit": np.stack(lit),
            }
            if soft is not None:
                kept["visibility"] = np.stack(softened)
            with beside[arrays].open("wb") as file:
                np.savez_compressed(file, **kept)
    if as_json:
        seen = frame.part != -1
        echo_json(
            {
                "files": [str(path) for path in written],
                "pixels": int(seen.sum()),
                "deepest_count": [int(n.max()) for n in counts],
                "lit_share": [float(m.sum() / max(seen.sum(), 1)) for m in lit],
            }
        )
    else:
        for path in written:
            echo_path(path)
