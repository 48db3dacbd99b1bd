"""``--lat``, ``--lon``, ``--tz`` and ``--north``: where on earth a model stands."""

from collections.abc import Callable
from typing import Any

import click

__all__ = ["SITE", "site_options"]

SITE = [
    click.option("--lat", type=float, metavar="DEG", help="Latitude; default: what the file says."),
    click.option(
        "--lon",
        type=float,
        metavar="DEG",
        help="Longitude, east positive; default: what the file says.",
    ),
    click.option(
        "--tz",
        metavar="ZONE",
        help="IANA zone, as Europe/Vienna; default: that of the coordinates.",
    ),
    click.option(
        "--north",
        type=float,
        metavar="DEG",
        help="True north's azimuth in the plan, clockwise from y; default: what the file says, "
        "or 0.",
    ),
]


def site_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the four options to a command."""
    for option in reversed(SITE):
        command = option(command)
    return command
