"""``umbra view``: look at a model in a window, its lights and its shadows."""

from dataclasses import replace
from pathlib import Path

import click

from umbra.cli.cache import cache_option
from umbra.cli.columns import column_options
from umbra.cli.outside import outside_option
from umbra.cli.pose import pose_options, read_posed
from umbra.cli.values import LENGTH, SIZE, NewPath
from umbra.devices import DEVICES
from umbra.methods import SOFT

__all__ = ["command"]


@click.command("view")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--lat", type=float, metavar="DEG", help="Latitude; default: what the file says.")
@click.option(
    "--lon", type=float, metavar="DEG", help="Longitude, east positive; default: the file's."
)
@click.option("--tz", metavar="ZONE", help="IANA zone; default: that of the coordinates.")
@click.option(
    "--north",
    type=float,
    metavar="DEG",
    help="True north's azimuth in the plan; default: the file's.",
)
@click.option("--date", metavar="DATE", help="Local date YYYY-MM-DD; default: 21 March.")
@click.option("--at", metavar="HH:MM", help="Local clock time; default: 15:00.")
@column_options
@pose_options
@outside_option
@cache_option
@click.option(
    "--ground",
    type=LENGTH,
    metavar="Z",
    help="The ground plane [m]; default: what the file says, or just below the model.",
)
@click.option("--no-ground", is_flag=True, help="No ground plane.")
@click.option("--axis-up", type=click.Choice(["x", "y", "z"]), help="The file's upward axis.")
@click.option(
    "--method",
    metavar="NAME",
    help="auto, z-pass, z-fail, lengyel, mcguire, alpha, screen, max or half.",
)
@click.option(
    "--soft",
    type=click.Choice(["none", *SOFT]),
    help="Soft shadows, as of umbra render; the panel has the lights' sizes.",
)
@click.option("--device", type=click.Choice(list(DEVICES)), help="Where to count; default: gl.")
@click.option("--size", type=SIZE, default=(1280, 800), help="Of the window; default: 1280x800.")
@click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all cores.")
@click.option(
    "--view",
    "view_file",
    type=NewPath(),
    metavar="FILE.json",
    help="A saved view to begin with, and where to save.",
)
@click.option(
    "--out",
    type=NewPath(),
    metavar="FILE.png",
    help="Screenshots; further ones get a number. Default: named after the model.",
)
def command(
    files: tuple[str, ...],
    lat: float | None,
    lon: float | None,
    tz: str | None,
    north: float | None,
    date: str | None,
    at: str | None,
    time: float | None,
    animation: str | None,
    ground: float | None,
    no_ground: bool,
    axis_up: str | None,
    method: str | None,
    soft: str | None,
    device: str | None,
    size: tuple[int, int],
    threads: int | None,
    view_file: Path | None,
    out: Path | None,
) -> None:
    """
    Look at a model in a window: walk around it, move the sun, see how shadows are counted.

    \b
    Example:
    umbra view quarter.city.json --date 2026-06-21 --at 18:30
    """  # noqa: D301  (click asks for a real backspace)
    from umbra.window.screen import check_display  # noqa: PLC0415

    shown = " ".join(files)
    instead = f"umbra render {shown} --eye X,Y,Z --target X,Y,Z --light X,Y,Z,0 --out picture.png"
    check_display(instead)
    from umbra.machine import count_cores  # noqa: PLC0415
    from umbra.sun import find_site  # noqa: PLC0415
    from umbra.sun.local_time import find_instant, parse_date  # noqa: PLC0415
    from umbra.window.app import PANEL, show  # noqa: PLC0415
    from umbra.window.file import load_view  # noqa: PLC0415
    from umbra.window.view import find_ground, make_view  # noqa: PLC0415

    day = None if date is None else parse_date(date)
    scene = read_posed(files, axis_up, time, animation)
    knows = (scene.latitude is not None or lat is not None) and (
        scene.longitude is not None or lon is not None
    )
    asks = any(value is not None for value in (lat, lon, tz, date, at))
    site = find_site(scene, lat, lon, tz, north) if knows or asks else None
    minutes = None
    if at is not None and site is not None:
        from zoneinfo import ZoneInfo  # noqa: PLC0415

        zone = ZoneInfo(site.zone)
        moment = find_instant(day or parse_date("2026-03-21"), at, zone, "time")
        local = moment.astimezone(zone)
        minutes = local.hour * 60 + local.minute + local.second / 60
    if ground is None:
        ground = find_ground(scene.bounds()) if scene.ground is None else scene.ground
    picture_size = (max(size[0] - PANEL, 1), size[1])
    view = make_view(scene, picture_size, site=site, date=day, minutes=minutes)
    if view_file is not None:
        view = load_view(view_file, view.lights)
    if device is not None:
        view = view.choose_device(device)
    if method is not None:
        view = view.choose_method(method)
    if soft is not None:
        view = replace(view, soft=soft)
    stem = Path(files[0]).name.split(".")[0]
    show(
        scene,
        view,
        names=[Path(file).name for file in files],
        size=size,
        instead=instead,
        ground=None if no_ground else ground,
        threads=threads or count_cores(),
        picture=out or Path(f"{stem}.png"),
        view_file=view_file or Path(f"{stem}.view.json"),
    )
