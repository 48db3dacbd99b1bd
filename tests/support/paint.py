"""Polygons of a drawing painted at pixels' centres, and compared with the counter."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.path import Path as Outline

from umbra.cpu.frame import FrameCounter
from umbra.drawing import see_model
from umbra.rays.depth import NOTHING

NEAR = 1 / 64  # [pixels]


def fill(rings, size):
    """Return a box of pixels, and which centres in it lie within rings: an odd number of times."""
    points, last = np.concatenate(rings), np.array(size)
    low = np.clip(np.ceil(points.min(0)), 0, last).astype(int)
    high = np.clip(np.floor(points.max(0)) + 1, low, last).astype(int)
    (x0, y0), (x1, y1) = low, high
    box = np.s_[y0:y1, x0:x1]
    inside = np.zeros((y1 - y0, x1 - x0), np.bool_)
    if inside.size:
        x, y = np.meshgrid(np.arange(x0, x1), np.arange(y0, y1))
        spots = np.column_stack([x.ravel(), y.ravel()])
        for ring in rings:
            found = Outline(ring, closed=False).contains_points(spots)
            inside ^= found.reshape(inside.shape)
    return box, inside


def find_distances(spots, ends):
    """Return how far spots (n, 2) are from the nearest of some lines (m, 2, 2) [pixels]."""
    found = np.full(len(spots), np.inf)
    a, way = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.maximum((way**2).sum(1), 1e-300)
    for k, spot in enumerate(spots):
        share = np.clip(((spot - a) * way).sum(1) / length, 0, 1)
        found[k] = np.linalg.norm(a + share[:, None] * way - spot, axis=1).min(initial=np.inf)
    return found


def list_sides(rings):
    return [np.stack([ring, np.roll(ring, -1, axis=0)], 1) for ring in rings]


@dataclass
class Painted:
    """What is wrong with a drawing beside the counter: pixels, and how far off the farthest is."""

    pixels: int
    wrong: int
    farthest: float
    surfaces: int
    shadows: int


def judge_drawing(scene, camera, light, ground=None):
    """
    Compare a drawing of opaque parts with the visible surface and the counts of every pixel.

    A pixel is right if just one polygon shows there, in the plane of the visible point, and
    it is drawn in shadow where the counter says so. Pixels where a face is seen edge-on count as
    near its edges.
    """
    seen = see_model(scene, camera, [light], range(len(scene.parts)), ground)
    counter = FrameCounter(scene, ground=ground)
    view, frame = counter.see(camera)
    lit = frame.lit(counter.count(view, camera, light), light)
    regions, shape = seen.regions, lit.shape
    times, height = np.zeros(shape, int), np.full(shape, np.inf)
    dark, sides, shadows = np.zeros(shape, np.bool_), [np.zeros((0, 2, 2))], 0
    points = frame.position - seen.origin
    for one in seen.surfaces:
        box, inside = fill(one.rings, camera.size)
        times[box] += inside
        height[box][inside] = points[box][inside] @ one.plane[:3] + one.plane[3]
        sides += list_sides(one.rings)
        for mask, rings in one.shadows:
            assert mask == (False,)
            box, shaded = fill(rings, camera.size)
            dark[box] |= shaded
            shadows += 1
            sides += list_sides(rings)
    is_seen = frame.part != NOTHING
    with np.errstate(invalid="ignore"):
        # Within the rounding of a pixel's position, and the planes of one sheet.
        is_off = ~(np.abs(height) <= 4 * regions.tolerance + 1e-6) & is_seen
    wrong = (times != is_seen) | is_off | (lit == dark) & is_seen
    at = np.argwhere(wrong)[:, ::-1]
    triangles = scene.triangles()
    corners = triangles.vertices[triangles.faces[np.maximum(view.face[at[:, 1], at[:, 0]], 0)]]
    homogeneous = (
        corners @ camera.matrix(scene.origin)[:3, :3].T + camera.matrix(scene.origin)[:3, 3]
    )
    away = find_distances(at.astype(float), np.concatenate(sides))
    for k, spots in enumerate(homogeneous):  # the visible face may be thinner than a pixel
        if (spots[:, 2] > 0).all():
            ring = spots[:, :2] / spots[:, 2:]
            away[k] = min(
                away[k], *find_distances(at[k : k + 1].astype(float), list_sides([ring])[0])
            )
    return Painted(lit.size, len(at), float(away.max(initial=0)), len(seen.surfaces), shadows)


def opaque(scene):
    """Return the parts of a scene that transmit no light."""
    return replace(scene, parts=tuple(p for p in scene.parts if not p.material.transmits))
