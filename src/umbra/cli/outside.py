"""``--allow-outside``: whether a model may name files outside its own folder."""

from collections.abc import Callable
from typing import Any

import click

from umbra.cli.columns import remember

__all__ = ["outside_option"]


def outside_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option to a command; it is for `umbra.read`, as `chosen_columns` gives it."""
    return click.option(
        "--allow-outside",
        is_flag=True,
        expose_value=False,
        callback=remember,
        help="Let models name files outside their own folder (buffers, materials, textures); only "
        "for models you trust.",
    )(command)
