"""View factor and overcast light of many points, by the exact outlines of their free sky."""

import numpy as np
from numba import njit

from umbra.sky.events import find_events, find_spans
from umbra.sky.gather import gather_faces
from umbra.sky.skyline import find_skyline
from umbra.sky.sweep import find_pieces, integrate
from umbra.sky.tensors import sum_up


@njit(cache=True, nogil=True)
def see(casters, p, normal, least):
    skyline = find_skyline(casters.strips, casters.strip_boxes, p)
    seen = gather_faces(casters, p, normal, least, skyline)
    every = np.zeros(seen.edge.shape, np.bool_)
    events = find_events(seen, normal, every, skyline)
    spans, owner = find_spans(seen)
    return seen, find_pieces(seen, normal, events, spans, owner, skyline)


@njit(cache=True, nogil=True)
def count(casters, points, normals, least, found):
    for i in range(points.shape[0]):
        _, pieces = see(casters, points[i], normals[i], least)
        moments = np.zeros(7)
        integrate(pieces, moments)
        found[i, 0], found[i, 1] = sum_up(moments, normals[i])
