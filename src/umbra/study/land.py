"""The land of a study whose options name a raster of heights."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.land.named_land import is_raster, settle_horizon
from umbra.study.options import StudyOptions
from umbra.sun import Site

__all__ = ["settle_land"]


def settle_land(
    options: StudyOptions,
    bounds: NDArray[np.float64],
    site: Site | None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> StudyOptions:
    """Return options with the horizon of the land around a model's bounds (2, 3) [m]."""
    if not is_raster(options.horizon):
        return options
    horizon = settle_horizon(
        options.horizon, bounds, site, nearest=options.horizon_from,
        is_refracted=options.refraction == "standard", progress=progress,
    )  # fmt: skip
    return replace(options, horizon=horizon)
