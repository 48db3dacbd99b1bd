"""``umbra view``: look at a model in a window, its lights and its shadows."""

from dataclasses import replace
from functools import partial
from typing import Any

import click

from umbra.calls.picture_options import ViewOptions
from umbra.cli.click_options import HeadedOption, SectionedCommand, record_options, take_record
from umbra.cli.reading import (
    files_argument,
    find_model_site,
    read_model,
    read_values,
    reading_options,
    site_options,
    take_site,
)
from umbra.cli.terminal import echo, echo_path, show_progress
from umbra.errors import write_for_shell
from umbra.machine import load_compiler

__all__ = ["command"]

HEADINGS = ("Window", "Site", "Lights", "Casters", "Counting", "Reading")


@click.command("view", cls=SectionedCommand, headings=HEADINGS)
@files_argument
@site_options
@record_options(ViewOptions)
@click.option(
    "--web",
    cls=HeadedOption,
    heading="Window",
    is_flag=True,
    help="Show it in the browser: serve a page to this machine until Ctrl-C.",
)
@reading_options("--axis-up")
def command(
    files: tuple[str, ...],
    web: bool,
    **given: Any,
) -> None:
    """
    Show a model in a window or a browser: walk around it, move the sun, see shadows move.

    \b
    Examples:
    umbra view quarter.city.json --date 2026-06-21 --at 18:30
    umbra view quarter.city.json --horizon alps.tif --date 2026-12-21
    umbra view quarter.city.json --web
    umbra view quarter.city.json --out scene.html
    """  # noqa: D301  (click asks for a real backspace)
    load_compiler()
    from umbra.calls.window import is_page, open_window  # noqa: PLC0415

    moved = {name: read_values()[name] for name in ("animation", "time")}
    chosen = replace(take_record(ViewOptions, given), **moved)
    shown = " ".join(files)
    instead = f"umbra render {shown} --eye X,Y,Z --target X,Y,Z --light X,Y,Z,0 --out picture.png"
    if not web and not is_page(chosen.out):
        from umbra.window.screen import check_display  # noqa: PLC0415

        check_display(instead)
    scene = read_model(files, poses=False, tells=True)
    typed = take_site()
    is_known = all(
        typed[name] is not None or getattr(scene, name) is not None
        for name in ("latitude", "longitude")
    )
    asking = (*typed.values(), chosen.date, chosen.at, chosen.horizon)
    is_asked = any(value is not None for value in asking)
    site = find_model_site(scene) if is_known or is_asked else None
    chosen = _settle_land(scene, site, chosen)
    if is_page(chosen.out):
        from umbra.calls.live import write_live_page  # noqa: PLC0415

        write_live_page(chosen.out, scene, site, chosen)
        echo_path(chosen.out)
    if web:
        _serve(scene, site, chosen)
    elif not is_page(chosen.out):
        open_window(scene, site, chosen, instead)


def _settle_land(scene: Any, site: Any, chosen: ViewOptions) -> ViewOptions:
    """Find the horizon of the land that is named, and tell what was read."""
    from umbra.calls.first_view import settle_view  # noqa: PLC0415

    if chosen.horizon is None:
        return chosen
    with show_progress(quiet=False) as stages:
        look = partial(stages.advance, what="reading the land", unit="blocks")
        chosen = settle_view(chosen, scene, site, look)
    for line in chosen.horizon.told:
        echo(f"note: {write_for_shell(line)}", err=True)
    return chosen


def _serve(scene: Any, site: Any, chosen: ViewOptions) -> None:
    """Serve the page until Ctrl-C."""
    from umbra.calls.live import make_live_page  # noqa: PLC0415
    from umbra.web.server import PageServer  # noqa: PLC0415

    server = PageServer(make_live_page(scene, site, chosen))
    echo(server.url)
    echo("Ctrl-C ends it", err=True)
    server.run(lambda words: echo(words, err=True))
