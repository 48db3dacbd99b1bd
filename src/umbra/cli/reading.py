"""Options for reading and locating models, which several commands share, and their use."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from umbra.cli.options import HeadedOption
from umbra.errors import InputError, write_for_shell

if TYPE_CHECKING:
    from umbra.scene import Scene
    from umbra.sun import Site

__all__ = [
    "canopy_options",
    "find_model_site",
    "read_model",
    "read_values",
    "reading_options",
    "site_options",
    "take_reading",
    "take_site",
]

_KEY = "umbra.reading"
_SITE = ("lat", "lon", "tz", "north")
_POSED = {*_SITE, "time", "animation"}


def _remember(context: click.Context, option: click.Parameter, value: Any) -> None:
    context.meta.setdefault(_KEY, {})[str(option.name)] = value


_option = partial(
    click.option, cls=HeadedOption, heading="Reading", expose_value=False, callback=_remember
)


def read_values(context: click.Context | None = None) -> dict[str, Any]:
    """Return the values of these options; by default those of the running command."""
    return (context or click.get_current_context()).meta.get(_KEY, {})


def _add(options: Sequence[Callable], command: Callable) -> Callable:
    for option in reversed(options):
        command = option(command)
    return command


def site_options(command: Callable) -> Callable:
    """Add the options of the site; ``find_model_site`` uses their values."""
    on_earth = partial(_option, heading="Site")
    return _add(
        [
            on_earth("--lat", type=float, metavar="DEG", help="Latitude; default: the file's."),
            on_earth(
                "--lon",
                type=float,
                metavar="DEG",
                help="Longitude, east positive; default: the file's.",
            ),
            on_earth(
                "--tz",
                metavar="ZONE",
                help="Time zone by its IANA name, Europe/Vienna; default: the zone at the "
                "coordinates.",
            ),
            on_earth(
                "--north",
                type=float,
                metavar="DEG",
                help="Azimuth of true north in the plan, clockwise from y; default: the file's, "
                "or 0.",
            ),
        ],
        command,
    )


def reading_options(up: str = "--up") -> Callable[[Callable], Callable]:
    """Make a decorator that adds the reading options; ``up`` names the one for the up axis."""
    options = [
        _option(
            up,
            "up_axis",
            type=click.Choice(["x", "y", "z"]),
            help="The file's axis that points up.",
        ),
        _option(
            "--height-column",
            metavar="NAME",
            help="Footprints: column of the height [m] above the base; default: found by its name.",
        ),
        _option(
            "--base-column",
            metavar="NAME",
            help="Footprints: column of the base's height [m]; default: 0, or the terrain of "
            "another file.",
        ),
        _option(
            "--name-column",
            metavar="NAME",
            help="Footprints: column of the names; default: the one with the most different names.",
        ),
        _option(
            "--time",
            type=float,
            metavar="S",
            help="Pose an animated file at this time [s]; default: not animated.",
        ),
        _option(
            "--animation",
            metavar="NAME",
            help="Which animation --time means, or umbra view plays: its name, its number, or "
            "all; default: 0, the first.",
        ),
        _option(
            "--bbox",
            metavar="XMIN,YMIN,XMAX,YMAX[,CRS]",
            help="Read only objects whose bounds meet this box; in degrees if all numbers can be, "
            "else in the first file's CRS.",
        ),
        _option(
            "--area",
            metavar="FILE|WKT",
            help="Read only objects whose bounds meet this polygon: a GeoJSON file, or WKT.",
        ),
        _option(
            "--geometric-error",
            type=float,
            metavar="M",
            help="3D Tiles: do not refine tiles of at most this error [m]; default: the finest.",
        ),
        _option(
            "--allow-outside",
            is_flag=True,
            is_kept=False,
            help="Let models name files outside their own folder (buffers, materials, textures); "
            "only for models that you trust.",
        ),
        _option(
            "--no-cache",
            is_flag=True,
            is_kept=False,
            help="Do not use the cache of files that were read; umbra doctor shows where it is.",
        ),
    ]
    return partial(_add, options)


def canopy_options(command: Callable) -> Callable:
    """Add the options for canopy rasters."""
    raster = partial(_option, heading="Casters")
    return _add(
        [
            raster(
                "--trunk",
                metavar="SHARE|FILE",
                help="Where crowns of a canopy raster begin: a share of the height, or a GeoTIFF "
                "of heights; default: 0.25.",
            ),
            raster(
                "--canopy-heights",
                type=click.Choice(["above-ground", "absolute"]),
                help="Zero of the heights in a canopy raster; default: the ground.",
            ),
        ],
        command,
    )


def take_reading() -> dict[str, Any]:
    """Return a command's options as ``umbra.read`` takes them."""
    values = {name: one for name, one in read_values().items() if name not in _POSED}
    return {"up": values.pop("up_axis"), "cache": not values.pop("no_cache"), **values}


def take_site() -> dict[str, Any]:
    """Return a command's options of the site as ``umbra.find_site`` takes them."""
    names = ("latitude", "longitude", "zone", "true_north")
    return dict(zip(names, (read_values()[name] for name in _SITE), strict=True))


def read_model(files: Sequence[str], canopy: Sequence[str] = (), *, poses: bool = True) -> "Scene":
    """
    Read files with a command's options, and pose them if a time is given and this is wanted.

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
    scene = replace(scene, notes=tuple(map(write_for_shell, scene.notes)))
    if time is None or not poses:
        return scene
    from umbra.scene import pose  # noqa: PLC0415

    return pose(scene, time, 0 if animation is None else animation)


def find_model_site(scene: "Scene") -> "Site":
    """Find a model's site from a command's options and the file."""
    from umbra.sun import find_site  # noqa: PLC0415

    return find_site(scene, **take_site())
