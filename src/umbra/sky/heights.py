"""The altitude up to which a meridian is covered, for horizons."""

import math

import numpy as np

from umbra.kernels import kernel
from umbra.sky.events import find_spans
from umbra.sky.meridians import cut_face
from umbra.sky.skyline import find_turn

__all__ = ["find_heights"]


@kernel
def find_heights(seen, toward):
    """
    Find the lowest free altitude of meridians [radians].

    Parameters
    ----------
    seen : SeenFaces
    toward : (n, 2) float64
        Horizontal unit directions.

    Returns
    -------
    heights : (n,) float64
    """
    spans, owner = find_spans(seen)
    n_spans = owner.size
    places = np.empty(toward.shape[0])
    for k in range(toward.shape[0]):
        places[k] = find_turn(toward[k, 0], toward[k, 1])
    active = np.empty(n_spans + 1, np.int32)
    low, high = np.empty(n_spans + 1), np.empty(n_spans + 1)
    altitudes = np.zeros(toward.shape[0])
    n_active = waiting = 0
    for k in np.argsort(places):
        while waiting < n_spans and spans[waiting, 0] <= places[k]:
            active[n_active] = waiting
            n_active += 1
            waiting += 1
        n = n_left = 0
        for q in range(n_active):
            span = active[q]
            if spans[span, 1] < places[k]:
                continue
            active[n_left] = span
            n_left += 1
            i = owner[span]
            lowest, highest, _, _ = cut_face(
                seen.corners[i], seen.size[i], toward[k, 0], toward[k, 1]
            )
            if lowest < math.inf:
                low[n], high[n] = lowest, highest
                n += 1
        n_active = n_left
        top = 0.0
        for q in np.argsort(low[:n]):
            if low[q] > top + 1e-12 * (1.0 + top * top):
                break
            top = max(top, high[q])
        altitudes[k] = math.pi / 2 if top == math.inf else math.atan(top)
    return altitudes
