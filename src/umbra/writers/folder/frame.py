"""The part of a plan that a picture shows: what matters, with whole gardens and whole buildings."""

import numpy as np
from numpy.typing import NDArray

from umbra.writers.picture_content import Plan

__all__ = ["find_shown_window"]

_ROOM = 0.25  # margin around what matters, of its length
_REACH = 0.15  # by which a whole building may widen the window, of its length
_EDGE = 0.1  # beyond a building, of that


def find_shown_window(matters: NDArray[np.bool_], plan: Plan) -> tuple[slice, slice]:
    """
    Find the window around some cells of a plan: all named areas, and no building cut a little.

    Parameters
    ----------
    matters : (rows, cols) bool
        At least one cell.
    plan : Plan

    Returns
    -------
    rows, cols : slice
        With a margin of a quarter of their length. Buildings that reach into it are shown whole
        where that makes it little wider.
    """
    from scipy.ndimage import find_objects, label  # noqa: PLC0415  (half a second)

    spans = [np.flatnonzero(matters.any(axis))[[0, -1]] + (0, 1) for axis in (1, 0)]
    for area in plan.areas:
        corners = np.concatenate(area.rings)
        for k, cells in ((0, plan.y), (1, plan.x)):
            own = np.searchsorted(cells, (corners[:, 1 - k].min(), corners[:, 1 - k].max()))
            spans[k] = np.array([min(spans[k][0], own[0]), max(spans[k][1], own[1] + 1)])
    room = round(_ROOM * max(float(np.ptp(span)) for span in spans)) + 1
    spans = [span + (-room, room) for span in spans]
    reach = round(_REACH * max(float(np.ptp(span)) for span in spans))
    edge = round(_EDGE * reach) + 1
    core = [span.copy() for span in spans]
    for found in find_objects(label(plan.is_building)[0]):
        ends = [np.array([part.start - edge, part.stop + edge]) for part in found]
        meets = all(a < span[1] and b > span[0] for (a, b), span in zip(ends, core, strict=True))
        near = all(
            a >= span[0] - reach and b <= span[1] + reach
            for (a, b), span in zip(ends, core, strict=True)
        )
        if meets and near:
            spans = [np.array([min(span[0], own[0]), max(span[1], own[1])])
                     for own, span in zip(ends, spans, strict=True)]  # fmt: skip
    rows, cols = (
        slice(max(int(a), 0), min(int(b), count))
        for (a, b), count in zip(spans, matters.shape, strict=True)
    )
    return rows, cols
