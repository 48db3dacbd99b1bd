"""``--time`` and ``--animation``: an animated file as it stands at one time."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from umbra.cli.cache import is_cached
from umbra.cli.columns import chosen_columns
from umbra.errors import InputError, write_for_shell

if TYPE_CHECKING:
    from umbra.scene import Scene

__all__ = ["pose_options", "read_posed"]


def pose_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the two options to a command."""
    command = click.option(
        "--animation",
        metavar="NAME",
        help="Which animation --time means: name, number or all; default: 0, the first.",
    )(command)
    return click.option(
        "--time",
        type=float,
        metavar="S",
        help="Pose an animated file at this time [s]; default: as its nodes stand, unplayed.",
    )(command)


def read_posed(
    files: tuple[str, ...], up: str | None, time: float | None, animation: str | None
) -> "Scene":
    """
    Read files and pose them if a time is given.

    Raises
    ------
    InputError
        As `umbra.read` and `umbra.scene.pose`.
    """
    from umbra.readers import read  # noqa: PLC0415

    if animation is not None and time is None:
        msg = f"--animation {animation} is posed at a time; give --time S too"
        raise InputError(msg)
    canopy = click.get_current_context().params.get("canopy", ())
    scene = read(*files, up=up, canopy=canopy, **chosen_columns(), cache=is_cached())
    scene = replace(scene, notes=tuple(map(write_for_shell, scene.notes)))
    if time is None:
        return scene
    from umbra.scene import pose  # noqa: PLC0415

    return pose(scene, time, animation if animation is not None else 0)
