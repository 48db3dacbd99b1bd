"""Hours from finer steps, for smooth contour lines, where they cost little beside the study."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.study.lights import Lights
from umbra.study.loop import add_up
from umbra.study.period import Period
from umbra.study.result import Study
from umbra.sun import find_sun

__all__ = ["FinerHours", "count_finer"]

LONGEST = 800
"""Cells along the longer side: those on which a picture's contours are traced."""
FACE = 75
"""Work of a sun for each face that casts, beside one for each cell. Measured."""
FREE = 250_000_000
"""So much work is done in any case: 0.15 to 0.6 s of one core, less than drawing takes."""
LEAST = 60_000_000
"""Steps are not cut below a minute [us]."""
_COUNTED_OTHERWISE = {"exact_tolerance_seconds", "canopy_transmissivity"}


@dataclass(frozen=True, eq=False)
class FinerHours:
    """
    Hours of one date on the cells of its contours.

    Parameters
    ----------
    shadow_hours : (rows, cols) float32
        NaN where there is nothing.
    up_hours : float
        How long the sun was up, by these steps [h].
    seconds : float
        Length of a step [s].
    """

    shadow_hours: NDArray[np.float32]
    up_hours: float
    seconds: float


def count_finer(study: Study, pictures: int = 1) -> FinerHours | None:
    """
    Count one date of a plan in finer steps, for as much work again as the study took.

    Of small studies there is more, ``FREE``, which is little beside drawing. Work is the number
    of suns times the cells and the faces that each of them passes, so that the same study
    gives the same picture on every machine.

    Parameters
    ----------
    study : Study
        Of one date.
    pictures : int
        How many such dates share what is always free.

    Returns
    -------
    finer : FinerHours or None
        None where the work does not allow finer steps, and of several dates together, of views,
        of canopies, and of studies that solve instants exactly.
    """
    facts, period = study.facts, study.period
    if (
        not study.is_plan
        or len(period.days) > 1
        or "exact_tolerance_seconds" in facts
        or "canopy_transmissivity" in facts
    ):
        return None
    grid = study.grid.coarser(LONGEST)
    faces = FACE * len(study.model.caster.faces)
    suns = int(period.sun.is_up.sum())
    own = suns * (study.grid.rows * study.grid.cols + faces)
    each = grid.rows * grid.cols + faces
    parts = _choose_parts(period, int(max(own, FREE / pictures) / (each * max(suns, 1))))
    if parts == 1:
        return None
    tile = study.model.make_tile(grid)
    hours, starts = period.hours, period.starts
    part = (period.ends - starts) / parts
    middles = starts[:, None] + part[:, None] * (np.arange(parts) + 0.5)
    path = find_sun(
        study.site, middles.ravel().astype(np.int64).view("datetime64[us]"),
        refraction=study.refraction,
    )  # fmt: skip
    length = np.repeat(hours / parts, parts)
    lights = Lights.of(path.direction[path.is_up], length[path.is_up])  # the last step is shorter
    total = add_up(tile.make_counter(), tile.shape, lights)[0]
    total[tile.nothing] = np.nan
    return FinerHours(total, float(length[path.is_up].sum()), 3600 * float(length[0]))


def _choose_parts(period: Period, most: int) -> int:
    """Cut a step into at most so many parts of whole minutes, or of whole seconds."""
    step = round(float(period.hours[0]) * 3.6e9)
    parts = range(min(most, step // LEAST), 1, -1)
    for unit in (60_000_000, 1_000_000):
        found = next((n for n in parts if step % (n * unit) == 0), 1)
        if found > 1:
            return found
    return 1
