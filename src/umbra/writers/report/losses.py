"""Data on the sun that a proposal takes: hours lost, where too few are left, its outline."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study, split_dates
from umbra.study.timeline import LONGEST_VIEW, Timeline
from umbra.writers.packing import pack_hours
from umbra.writers.pixels import shade_ramp
from umbra.writers.report.vector_map import MOST_DATES, pack_regions

__all__ = ["pack_losses", "pack_plan_losses"]


def pack_losses(
    study: Study, choose: Callable[[NDArray], NDArray] = np.asarray
) -> dict[str, object]:
    """Pack the hours lost of each date, or of all of many; ``choose`` takes the shown receivers."""
    if "hours_lost" not in study.more:
        return {}
    dates = split_dates(study)
    shown = dates if len(dates) <= MOST_DATES else [study]
    return {
        "lost": [pack_hours(choose(np.asarray(dated.more["hours_lost"][1]))) for dated in shown],
        "change_ramp": np.round(shade_ramp(129, "change") * 255).astype(int).tolist(),
    }


def pack_plan_losses(
    study: Study, timeline: Timeline, proposed: Sequence[str]
) -> dict[str, object]:
    """Pack the same of a raster, with the regions newly under the limit and proposed."""
    if "hours_lost" not in study.more:
        return {}
    cells = np.ix_(_find_nearest(study.y, timeline.y), _find_nearest(study.x, timeline.x))
    more: dict[str, object] = pack_losses(study, lambda values: values[cells])
    newly = np.asarray(study.more["newly_under"][1])[cells] > 0
    if newly.any():
        more["newly"] = pack_regions(newly)
    if proposed:
        tile = study.model.make_tile(study.grid.coarser(LONGEST_VIEW))
        new = tile.find_cells(study.model.scene.select(proposed))
        more["proposed"] = pack_regions(new)
    return more


def _find_nearest(own: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the index of the nearest of ascending coordinates, for each wanted one."""
    if len(own) == 1:
        return np.zeros(len(wanted), np.intp)
    return np.searchsorted((own[1:] + own[:-1]) / 2, wanted)
