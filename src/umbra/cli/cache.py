"""``--no-cache``: whether scenes are kept from run to run."""

from collections.abc import Callable
from typing import Any

import click

__all__ = ["cache_option", "is_cached"]

_KEY = "umbra.cache"


def cache_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option to a command; `is_cached` gives its value."""
    return click.option(
        "--no-cache",
        is_flag=True,
        expose_value=False,
        callback=_remember,
        help="Read files anew and keep nothing; umbra doctor says where read files are kept.",
    )(command)


def is_cached() -> bool:
    """Tell whether the running command may use the cache."""
    return not click.get_current_context().meta.get(_KEY, False)


def _remember(context: click.Context, _: click.Parameter, value: bool) -> None:
    context.meta[_KEY] = value
