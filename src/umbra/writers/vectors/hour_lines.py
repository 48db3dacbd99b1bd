"""Lines of equal hours in shadow, as vectors."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study, split_dates, tell_dates

if TYPE_CHECKING:
    from umbra.writers.plan import Show

__all__ = ["HourLine", "find_hour_lines", "find_seen"]


@dataclass(frozen=True, eq=False)
class HourLine:
    """
    The lines that enclose the cells with at least so many hours in shadow, or in the sun.

    Parameters
    ----------
    shadow_hours, sun_hours : float
        On the line's deeper side at least, and at most [h]; of lines of equal sun the other way.
    lines : list of (k, 2) float64
        In the study's own coordinates: of a plan the model's, of a view along it and upward [m].
    date : str
        "2026-03-21", or "sum of 30 dates".
    """

    shadow_hours: float
    sun_hours: float
    lines: list[NDArray[np.float64]]
    date: str


def find_hour_lines(study: Study, show: "Show" = "shadow") -> Iterator[HourLine]:
    """
    Trace a study's hours at whole hours, interpolated between the cells' centres.

    Hours grow by whole steps from cell to cell. A line runs half a step below its hour, so
    midway between the last cell that has less and the first that has as much. On the
    ground, lines end at buildings: what is under them does not count. On roofs and walls they end
    at edges, where one surface ends before another or two meet at an angle.

    Parameters
    ----------
    study : Study
    show : {'shadow', 'sun'}
        Whose whole hours.

    Yields
    ------
    hour_line : HourLine
        Each level with its lines, none without; of several dates one date after another.
    """
    for one in split_dates(study):
        yield from _trace(one, show)


def _trace(study: Study, show: "Show") -> Iterator[HourLine]:
    """Trace the lines of one date, or of sums."""
    import contourpy  # noqa: PLC0415

    from umbra.writers.contours import find_levels  # noqa: PLC0415

    found = study.sun_hours if show == "sun" else study.shadow_hours
    hours = np.ma.masked_invalid(found.astype(np.float64))
    if study.receivers == "ground":
        hours = np.ma.masked_where(study.heights > study.ground + 1e-6, hours)
    else:
        from umbra.writers.edges import find_breaks  # noqa: PLC0415

        hours = np.ma.masked_where(find_breaks(study), hours)
    if min(hours.shape) < 2 or hours.mask.all():
        return
    generator = contourpy.contour_generator(study.x, study.y, hours)
    half = float(study.period.hours.min()) / 2
    for level in find_levels(study.up_hours, most=48):
        traced: Any = generator.lines(level - half)
        lines = [line for line in traced if len(line) > 1]
        if lines:
            told = float(level), study.up_hours - level
            yield HourLine(*(told[::-1] if show == "sun" else told), lines, tell_dates(study))


def find_seen(study: Study) -> list[NDArray[np.float64]]:
    """
    Trace the border of what a view sees of the model, half a cell exact.

    Parameters
    ----------
    study : Study
        Of an elevation or a view from above.

    Returns
    -------
    lines : list of (k, 2) float64
        Along the view and upward [m]; closed.
    """
    import contourpy  # noqa: PLC0415

    drawn = np.isfinite(study.shadow_hours) & (study.is_of_model | study.is_plan)
    seen = np.pad(drawn.astype(np.float64), 1)
    grid = study.grid
    x = np.concatenate([[study.x[0] - grid.dx], study.x, [study.x[-1] + grid.dx]])
    y = np.concatenate([[study.y[0] - grid.dy], study.y, [study.y[-1] + grid.dy]])
    traced: Any = contourpy.contour_generator(x, y, seen).lines(0.5)
    return [line for line in traced if len(line) > 2]
