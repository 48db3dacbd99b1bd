"""``--height-column``, ``--base-column``, ``--name-column``: what a table of footprints holds."""

from collections.abc import Callable
from typing import Any

import click

__all__ = ["chosen_columns", "column_options", "remember"]

_KEY = "umbra.columns"


def column_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command; `chosen_columns` gives their values."""
    command = click.option(
        "--name-column",
        metavar="NAME",
        expose_value=False,
        callback=remember,
        help="Footprints: the column that names each; default: the one that tells most apart.",
    )(command)
    command = click.option(
        "--base-column",
        metavar="NAME",
        expose_value=False,
        callback=remember,
        help="Footprints: the column of the height [m] where each begins; default: 0, or the "
        "terrain of another file.",
    )(command)
    return click.option(
        "--height-column",
        metavar="NAME",
        expose_value=False,
        callback=remember,
        help="Footprints: the column of the height [m] above the base; default: one that is "
        "called so.",
    )(command)


def chosen_columns(context: click.Context | None = None) -> dict[str, Any]:
    """Give the options of a command, by default the running one, as `umbra.read` takes them."""
    return (context or click.get_current_context()).meta.get(_KEY, {})


def remember(context: click.Context, option: click.Parameter, value: str | bool | None) -> None:
    """Keep the value of an option that is for `umbra.read`."""
    context.meta.setdefault(_KEY, {})[str(option.name)] = value
