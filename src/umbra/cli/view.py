"""``umbra view``: look at a model in a window, its lights and its shadows."""

from typing import Any

import click

from umbra.cli.options import LENGTH, SIZE, NewPath
from umbra.cli.reading import (
    find_model_site,
    read_model,
    read_values,
    reading_options,
    site_options,
)
from umbra.devices import DEVICES
from umbra.methods import SOFT

__all__ = ["command"]


@click.command("view")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@site_options
@click.option("--date", metavar="DATE", help="Local date YYYY-MM-DD; default: 21 March.")
@click.option("--at", metavar="HH:MM", help="Local time; default: 15:00.")
@reading_options("--axis-up")
@click.option(
    "--ground",
    type=LENGTH,
    metavar="Z",
    help="Height of the ground plane [m]; default: from the file, or just below the model.",
)
@click.option("--no-ground", is_flag=True, help="No ground plane.")
@click.option(
    "--method",
    metavar="NAME",
    help="auto, z-pass, z-fail, lengyel, mcguire, alpha, screen, max or half.",
)
@click.option(
    "--soft",
    type=click.Choice(["none", *SOFT]),
    help="Soft shadows, as in umbra render; the panel sets the sizes of the lights.",
)
@click.option("--device", type=click.Choice(list(DEVICES)), help="Device that counts; default: gl.")
@click.option(
    "--size", type=SIZE, default=(1280, 800), help="Size of the window; default: 1280x800."
)
@click.option(
    "--threads", type=click.IntRange(1), metavar="N", help="Number of threads; default: all cores."
)
@click.option(
    "--view",
    type=NewPath(),
    metavar="FILE.json",
    help="A saved view to start with, and the file to save views in.",
)
@click.option(
    "--out",
    type=NewPath(),
    metavar="FILE.png",
    help="File of the first screenshot; further ones get a number; default: named after the model.",
)
def command(
    files: tuple[str, ...],
    no_ground: bool,
    **options: Any,
) -> None:
    """
    Show a model in a window: walk around it, move the sun, see how shadows are counted.

    \b
    Example:
    umbra view quarter.city.json --date 2026-06-21 --at 18:30
    """  # noqa: D301  (click asks for a real backspace)
    from umbra.window.screen import check_display  # noqa: PLC0415

    shown = " ".join(files)
    instead = f"umbra render {shown} --eye X,Y,Z --target X,Y,Z --light X,Y,Z,0 --out picture.png"
    check_display(instead)
    from umbra.calls.window import ViewOptions, open_window  # noqa: PLC0415

    lat, lon, tz = (read_values()[name] for name in ("lat", "lon", "tz"))
    chosen = ViewOptions(**{**options, "ground": False if no_ground else options["ground"]})
    scene = read_model(files)
    places = ((lat, scene.latitude), (lon, scene.longitude))
    is_known = all(given is not None or said is not None for given, said in places)
    is_asked = any(value is not None for value in (lat, lon, tz, chosen.date, chosen.at))
    site = find_model_site(scene) if is_known or is_asked else None
    open_window(scene, site, chosen, instead)
