"""A study's arrays as columns and bands: of several dates one for each, sums named so."""

import numpy as np
from numpy.typing import NDArray

from umbra.study import PointStudy, Study, split_dates
from umbra.study.attributes import is_sum

__all__ = ["find_columns"]


def find_columns(
    study: Study | PointStudy, dims: tuple[str, ...], first: tuple[str, ...] = ()
) -> dict[str, NDArray]:
    """
    Give the arrays along some axes by name.

    Parameters
    ----------
    study : Study or PointStudy
    dims : tuple of str
    first : tuple of str
        Names that come before the others.

    Returns
    -------
    columns : dict of str to array
        What each of several dates has is named with it, ``sun_hours_2026-03-21``; where only
        sums are kept, ``sun_hours_sum``.
    """
    dates = split_dates(study)
    if len(dates) == 1:
        has_sums = len(study.period.days) > 1
        return {
            f"{name}_sum" if has_sums and is_sum(name) else name: array
            for name, array in _pick(study, dims, first).items()
        }
    by_day: dict[str, NDArray] = {}
    of_dates = [(one.period.days[0], _pick(one, dims)) for one in dates]
    for name, array in _pick(study, dims, first).items():
        if f"{name}_by_day" not in study.more:
            by_day[name] = array
            continue
        by_day |= {f"{name}_{day}": found[name] for day, found in of_dates}
    return by_day


def _pick(
    study: Study | PointStudy, dims: tuple[str, ...], first: tuple[str, ...] = ()
) -> dict[str, NDArray]:
    arrays = {
        name: np.asarray(array)
        for name, (dimensions, array) in study.variables().items()
        if dimensions == dims
    }
    return {name: arrays.pop(name) for name in first if name in arrays} | arrays
