"""What ``umbra render`` refuses before it reads a file, and what it warns of in a picture."""

import math
from typing import Any

from umbra.cli.terminal import echo
from umbra.errors import InputError

__all__ = ["check_light", "check_memory", "check_sun", "warn", "warn_of_view"]

_BYTES, _LIGHT_BYTES = 330, 16  # held for each pixel, and for each of its lights


def check_light(numbers: tuple[float, ...]) -> Any:
    """Give a light's homogeneous place; W says only which of two kinds it is."""
    x, y, z, w = numbers if len(numbers) == 4 else (*numbers, 1.0)
    if w not in {0.0, 1.0}:
        shown = ",".join(f"{v:g}" for v in numbers)
        msg = f"the W of a light is 1 (a point) or 0 (a direction toward it); got --light {shown}"
        raise InputError(msg, light=numbers)
    return (x, y, z, w)


def check_sun(date: str | None, clock: str | None, site: dict[str, Any]) -> None:
    """Refuse half of what says where the sun stands, before anything is read."""
    if (date is None) != (clock is None):
        msg = "the sun's light needs both --date and --at (a clock time: --at 15:00)"
        raise InputError(msg)
    given = [f"--{name}" for name, value in site.items() if value is not None]
    if date is None and given:
        msg = f"{' and '.join(given)} places the sun; give --date and --at, too, or leave it out"
        raise InputError(msg)
    if date is not None:
        from umbra.sun.local_time import parse_date  # noqa: PLC0415

        parse_date(date)


def warn_of_view(scene: Any, camera: Any, frame: Any, threads: int) -> None:
    """Say where a picture shows nothing of the model, or looks into it past the near plane."""
    from umbra.rays.visible import count_cut  # noqa: PLC0415

    if (frame.part == -1).all():
        middle = ",".join(f"{v:g}" for v in scene.bounds().mean(0))
        warn(
            "warning: nothing is seen; leave out --eye and --target to see all of "
            f"it, or look at its middle: --target {middle}"
        )
    cut = count_cut(scene, camera, threads)
    if cut:
        warn(
            f"warning: the near plane, {camera.near:g} m before the eye, cuts the model open in "
            f"{cut} pixels; give a smaller --near or move --eye away"
        )


def check_memory(size: tuple[int, int], lights: int) -> None:
    """Refuse a picture that memory cannot hold, before anything is read."""
    from umbra.machine import find_memory, name_memory  # noqa: PLC0415

    cols, rows = size
    needed, held = cols * rows * (_BYTES + _LIGHT_BYTES * lights), find_memory()
    if needed <= held:
        return
    scale = math.sqrt(held / needed)
    msg = (
        f"a picture of {cols}x{rows} pixels needs {needed / 1e9:.1f} GB and "
        f"{name_memory(held)}; a --size of {max(int(cols * scale), 1)}x{max(int(rows * scale), 1)} "
        "would fit"
    )
    raise InputError(msg, bytes=needed)


def warn(message: str) -> None:
    """Tell the person at the terminal, whatever the results are for."""
    echo(f"umbra: {message}", err=True)
