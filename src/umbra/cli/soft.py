"""Options of soft shadows, for ``umbra render``."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from umbra.errors import InputError
from umbra.methods import SOFT

if TYPE_CHECKING:
    from umbra.soft import AreaLight

__all__ = ["check_soft", "size_lights", "soft_options", "soften"]


def soft_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of soft shadows to a command."""
    command = click.option(
        "--light-size",
        "light_sizes",
        type=float,
        multiple=True,
        metavar="R",
        help="With --soft, radius of the lights, or repeated, of each: metres, or for a "
        "direction degrees (default: 0.2665, the sun's).",
    )(command)
    return click.option(
        "--soft",
        type=click.Choice(SOFT),
        help="Soft shadows, by samples of the light (the reference), penumbra wedges (fast) "
        "or scaled layers after Weng (only looks soft).",
    )(command)


def check_soft(soft: str | None, light_sizes: Sequence[float]) -> None:
    """Refuse options that do not go together, before anything is read."""
    if light_sizes and soft is None:
        msg = "--light-size is for soft shadows; add --soft wedges"
        raise InputError(msg)


def size_lights(lights: Sequence[Any], light_sizes: Sequence[float]) -> list["AreaLight"]:
    """
    Give lights their size.

    Parameters
    ----------
    lights : sequence of Light
    light_sizes : sequence of float
        None, one for all, or one each: metres or, for a direction, degrees.

    Raises
    ------
    InputError
        If their number fits in no way, a place has no size, or one is out of range.
    """
    from umbra.soft import SUN_RADIUS, ball_light  # noqa: PLC0415

    if len(light_sizes) not in {0, 1, len(lights)}:
        msg = f"{len(light_sizes)} --light-size for {len(lights)} lights; give one, or one for each"
        raise InputError(msg)
    if not light_sizes and any(light.is_point for light in lights):
        msg = "a light at a place needs its radius for soft shadows; give --light-size R [m]"
        raise InputError(msg)
    sizes = list(light_sizes) or [SUN_RADIUS]
    sizes *= len(lights) // len(sizes)
    return [ball_light(light, size) for light, size in zip(lights, sizes, strict=True)]


def soften(
    soft: str, counter: Any, view: Any, frame: Any, camera: Any, lights: Sequence["AreaLight"]
) -> tuple[list[Any], list[Any]]:
    """
    Find what share of each light reaches each visible point.

    Returns
    -------
    visibility, reached : list of (rows, cols) float32
        What is not hidden by casters; and that, where the surface faces the light
        within its reach, else 0.
    """
    import numpy as np  # noqa: PLC0415

    none = np.zeros(frame.part.shape, np.int32)
    visibility = counter.find_visibility(view, camera, lights, soft)
    reached = [
        part * frame.lit(none, light.light) for part, light in zip(visibility, lights, strict=True)
    ]
    return visibility, reached
