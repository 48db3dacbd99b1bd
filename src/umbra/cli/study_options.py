"""The options of ``umbra study``, by what they are about."""

from collections.abc import Callable
from typing import Any

import click

from umbra.cli.columns import remember
from umbra.cli.site import SITE
from umbra.cli.values import LENGTH, SIZE, NewPath, Numbers
from umbra.devices import CHOICES

__all__ = ["study_options"]

_TIME = [
    click.option(
        "--date",
        "date",
        required=True,
        multiple=True,
        metavar="DATE",
        help="Local date YYYY-MM-DD; also A,B or A..B, a month 2026-06, a year 2026, or 2026-*-21 "
        "for a day of every month; repeatable.",
    ),
    click.option(
        "--every-days",
        type=click.IntRange(1),
        default=1,
        metavar="N",
        help="Of a range, a month or a year take every N-th day.",
    ),
    click.option(
        "--from",
        "start",
        default="09:00",
        show_default=True,
        metavar="HH:MM",
        help="Start, on the local clock.",
    ),
    click.option(
        "--to",
        "end",
        default="17:00",
        show_default=True,
        metavar="HH:MM",
        help="End; 24:00 is midnight.",
    ),
    click.option(
        "--every",
        default="15min",
        show_default=True,
        metavar="DURATION",
        help="Step of the clock: 15min, 1h, 30s.",
    ),
    click.option(
        "--refraction",
        type=click.Choice(["standard", "none"]),
        default="standard",
        show_default=True,
        help="The sun where it is seen, or where it is.",
    ),
    click.option(
        "--by-day/--sum",
        "by_day",
        default=None,
        help="Keep results by date as well, or only their sums; default: by date up to 12 dates.",
    ),
]
_RECEIVERS = [
    click.option(
        "--receivers",
        default="auto",
        show_default=True,
        metavar="WHAT",
        help="auto: top where the model brings ground of its own, else ground; ground: the "
        "plane; top: whatever is topmost in the plan; an elevation from north, east, south, west "
        "or an azimuth in degrees; camera: what --eye sees; surfaces: walls and roofs, sampled; "
        "points: those of --points.",
    ),
    click.option(
        "--spacing",
        type=float,
        default=0.5,
        show_default=True,
        metavar="M",
        help="Between the samples of surfaces.",
    ),
    click.option(
        "--on",
        multiple=True,
        metavar="PATTERN",
        help="Sample or, in an elevation or by a camera, show these parts alone: names, kinds or "
        "layers; repeatable.",
    ),
    click.option(
        "--points",
        metavar="FILE",
        help="CSV of points: x,y,z or x,y,z,nx,ny,nz in the model's coordinates.",
    ),
    click.option("--eye", type=Numbers("X,Y,Z", 3), help="Where the camera is [m]."),
    click.option("--target", type=Numbers("X,Y,Z", 3), help="What the camera looks at [m]."),
    click.option(
        "--fov",
        type=float,
        default=50.0,
        show_default=True,
        metavar="DEG",
        help="The camera's vertical field of view.",
    ),
    click.option(
        "--ground",
        type=LENGTH,
        metavar="Z",
        help="The ground's height [m]; default: the file's, or where the middle building stands.",
    ),
    click.option(
        "--extent",
        type=Numbers("XMIN,YMIN,XMAX,YMAX", 4),
        help="The plan's rectangle [m]; default: the model and its shadows.",
    ),
    click.option(
        "--cell",
        type=LENGTH,
        metavar="M",
        help="Side of a cell [m]; default: about 1000 cells on the longer side.",
    ),
    click.option("--size", type=SIZE, help="The raster's size, instead of --cell."),
]
_CASTERS = [
    click.option(
        "--cast",
        multiple=True,
        metavar="PATTERN",
        help="Names or kinds of parts that cast; repeatable.",
    ),
    click.option(
        "--no-cast",
        multiple=True,
        metavar="PATTERN",
        help="Those of parts that do not; repeatable.",
    ),
    click.option(
        "--canopy",
        multiple=True,
        metavar="PATTERN",
        help="Parts that let a share of the light through, such as trees: names, kinds or layers; "
        "repeatable.",
    ),
    click.option(
        "--transmissivity",
        metavar="SHARE",
        help="What share of the light that is; ON:OFF with leaves and without; default: 0.03.",
    ),
    click.option(
        "--leaf-on",
        metavar="MM-DD..MM-DD",
        help="When leaves are on, with two shares: 04-15..10-31.",
    ),
    click.option(
        "--trunk",
        metavar="SHARE|FILE",
        expose_value=False,
        callback=remember,
        help="Where crowns of a canopy raster begin: a share of the height, or a GeoTIFF of "
        "heights; default: 0.25.",
    ),
    click.option(
        "--canopy-heights",
        type=click.Choice(["above-ground", "absolute"]),
        expose_value=False,
        callback=remember,
        help="What the heights of a canopy raster are above; default: the ground.",
    ),
    click.option("--up", type=click.Choice(["x", "y", "z"]), help="The file's upward axis."),
]
_RESULTS = [
    click.option(
        "--by",
        type=click.Choice(["part", "kind", "layer"]),
        help="Also write the hours due to each part, kind or layer; with --who of those only.",
    ),
    click.option(
        "--who",
        multiple=True,
        metavar="PATTERN",
        help="Also write the hours due to these parts: names, kinds or layers; repeatable.",
    ),
    click.option(
        "--proposed",
        multiple=True,
        metavar="PATTERN",
        help="Parts that are not there yet: also write what they take from the others; repeatable.",
    ),
    click.option(
        "--under",
        metavar="DURATION",
        help="With --proposed: where fewer hours of sun are left than this, but were not before; "
        "default: 2h.",
    ),
    click.option(
        "--spells",
        is_flag=True,
        help="Also write first and last sun, number of spells, longest spell, shaded share.",
    ),
    click.option(
        "--exact",
        is_flag=True,
        help="Solve when each cell enters and leaves shadow, to a second, instead of adding up "
        "steps.",
    ),
    click.option(
        "--min-spell",
        metavar="DURATION",
        help="Also the hours in spells of at least this length; implies --spells.",
    ),
    click.option("--masks", is_flag=True, help="Also write in_shadow, every instant."),
]
_PICTURES = [
    click.option("--title", metavar="TEXT", help="Of all pictures; default: the files' names."),
    click.option("--subtitle", metavar="TEXT", help="A line below the title."),
    click.option(
        "--show",
        type=click.Choice(["shadow", "sun"]),
        default="shadow",
        show_default=True,
        help="Which hours pictures and lines of equal hours tell; study.nc has both.",
    ),
    click.option(
        "--at",
        multiple=True,
        metavar="HH:MM,...",
        help="Clock times that the profile, films and outlines show: 09:00,12:00,15:00; default: "
        "of the profile the ends of all steps, of films round times as dense, of outlines whole "
        "hours.",
    ),
]
_RUN = [
    click.option(
        "--device",
        type=click.Choice(CHOICES),
        default="auto",
        help="Where to count plans; auto: cpu, or a GPU that proves faster on large ones.",
    ),
    click.option("--threads", type=click.IntRange(1), metavar="N", help="Default: all cores."),
    click.option(
        "--out",
        type=NewPath(),
        required=True,
        metavar="DIR",
        help="Folder for results; made if missing.",
    ),
    click.option(
        "--quiet", is_flag=True, help="Say nothing but errors and, with --json, the result."
    ),
]


def study_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command all options of a study, in the order of its help."""
    for option in reversed([*SITE, *_TIME, *_RECEIVERS, *_CASTERS, *_RESULTS, *_PICTURES, *_RUN]):
        command = option(command)
    return command
