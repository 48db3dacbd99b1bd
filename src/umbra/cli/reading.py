"""Options for reading and locating models, which several commands share, and their use."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from umbra.calls.reading_options import CanopyOptions, ReadingOptions, SiteOptions
from umbra.cli.click_options import FilesArgument, record_options
from umbra.cli.terminal import echo
from umbra.errors import InputError, write_for_shell
from umbra.option_fields import list_options

if TYPE_CHECKING:
    from umbra.lights import Weather
    from umbra.scene import Scene
    from umbra.sun import Site

__all__ = [
    "canopy_options",
    "files_argument",
    "find_any_site",
    "find_model_site",
    "read_model",
    "read_values",
    "reading_options",
    "site_options",
    "take_reading",
    "take_site",
]

_KEY = "umbra.reading"


def _remember(context: click.Context, option: click.Parameter, value: Any) -> None:
    context.meta.setdefault(_KEY, {})[str(option.name)] = value


def read_values(context: click.Context | None = None) -> dict[str, Any]:
    """Return the values of these options; by default those of the running command."""
    return (context or click.get_current_context()).meta.get(_KEY, {})


def _add(record: type, **flags: str) -> Callable[[Callable], Callable]:
    return record_options(record, flags, expose_value=False, callback=_remember)


files_argument = click.argument(
    "files", cls=FilesArgument, nargs=-1, required=True, metavar="FILE..."
)
"""Adds the files of the model."""

site_options = _add(SiteOptions)
"""Adds the options of the site; ``find_model_site`` uses their values."""

canopy_options = _add(CanopyOptions)
"""Adds the options for canopy rasters."""


def reading_options(up: str = "--up") -> Callable[[Callable], Callable]:
    """Make a decorator that adds the reading options; ``up`` names the one for the up axis."""
    return _add(ReadingOptions, up_axis=up)


def take_reading() -> dict[str, Any]:
    """Return a command's options as ``umbra.read`` takes them."""
    others = {name for name, _, _ in list_options(SiteOptions)} | {"time", "animation"}
    values = {name: value for name, value in read_values().items() if name not in others}
    return {"up": values.pop("up_axis"), "cache": not values.pop("no_cache"), **values}


def take_site() -> dict[str, Any]:
    """Return a command's options of the site as ``umbra.find_site`` takes them."""
    return {name: read_values()[name] for name, _, _ in list_options(SiteOptions)}


def read_model(
    files: Sequence[str], canopy: Sequence[str] = (), *, poses: bool = True, tells: bool = False
) -> "Scene":
    """
    Read files with a command's options, and pose them if a time is given and this is wanted.

    ``tells`` says where layers were placed, for commands that show no notes.

    Raises
    ------
    InputError
        As ``umbra.read`` and ``umbra.pose``.
    """
    from umbra.readers import read  # noqa: PLC0415

    time, animation = read_values()["time"], read_values()["animation"]
    if animation is not None and time is None and poses:
        msg = f"--animation {animation} is posed at a time; give --time S too"
        raise InputError(msg)
    scene = read(*files, canopy=canopy, **take_reading())
    scene = scene.with_facts(notes=tuple(map(write_for_shell, scene.notes)))
    if tells:
        _tell_places(scene)
    if time is None or not poses:
        return scene
    from umbra.scene import pose  # noqa: PLC0415

    return pose(scene, time, 0 if animation is None else animation)


def _tell_places(scene: "Scene") -> None:
    """Say where layers were placed."""
    begun = tuple(
        f"layer '{' '.join(source.layer.split())}': " for source in scene.sources if source.frame
    )
    for note in scene.notes:
        if begun and note.startswith(begun):
            echo(f"note: {note}", err=True)


def find_model_site(scene: "Scene", say: Callable[[str], object] | None = None) -> "Site":
    """Find a model's site from a command's options and the file; say if they are far apart."""
    from umbra.sun import find_site  # noqa: PLC0415

    say = say or (lambda line: echo(write_for_shell(line), err=True))
    return find_site(scene, **take_site(), tell=lambda note: say(f"note: {note}"))


def find_any_site(
    scene: "Scene",
    say: Callable[[str], object],
    *,
    is_needed: bool,
    weather: "Weather | None" = None,
) -> "Site | None":
    """Find a model's site, or that of its weather; None where none says it nor needs it."""
    given = [take_site()[name] for name in ("latitude", "longitude")]
    if given != [None, None] or None not in {scene.latitude, scene.longitude}:
        return find_model_site(scene, say)
    if weather is not None:
        from umbra.sun import find_site  # noqa: PLC0415

        location = {"latitude": weather.latitude, "longitude": weather.longitude}
        site = find_site(scene, **{**take_site(), **location})
        note = f"the model does not say its place, so that of {weather.name} counts"
        say(f"note: {note}: {site.show()}")
        return site
    if not is_needed:
        return None
    return find_model_site(scene, say)
