"""
Streets, green and water under a plan: of a file, or of the model's own parts.

They are drawn, never counted: lines that end at buildings, and pale tints where a picture leaves
the paper bare.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_value
from umbra.option_fields import is_area_file
from umbra.readers.context_file import Shape, load_context, place_context
from umbra.receivers.area_search import join_plans
from umbra.scene import Scene
from umbra.writers.folder import FolderJob
from umbra.writers.picture_content import ContextShape, Plan

__all__ = ["add_context", "cut_line", "find_context"]

_KIND_OF_PART = {
    "Road": "street", "Railway": "street", "TransportSquare": "street", "Track": "street",
    "PlantCover": "green", "SolitaryVegetationObject": "green", "WaterBody": "water",
    "Waterway": "water",
}  # fmt: skip
_STEPS = 3000  # along the longer side of a plan, at which lines are looked at


def add_context(job: FolderJob, plan: Plan) -> Plan:
    """Return a plan with what ``context=`` asks for under it."""
    asked, study = job.outputs.context, job.study
    if asked is None:
        return plan
    shapes = job.keep("context", lambda: find_context(job.scene, asked))
    if study.kind.is_plan:
        cells = study.x, study.y, study.laid.is_built
        found = job.keep("context lines", lambda: cut_shapes(shapes, *cells))
    else:  # a plan of points
        found = cut_shapes(shapes, plan.x, plan.y, plan.is_building)
    name = Path(asked).name if is_area_file(asked) else ""
    return replace(plan, context=found, context_name=name)


def find_context(scene: Scene, asked: Any) -> list[Shape]:
    """
    Find the kind, rings and lines of each street, green or water, in own coordinates.

    Parameters
    ----------
    scene : Scene
    asked : path, str or sequence of str
        A file, or patterns of the model's parts and kinds.

    Raises
    ------
    InputError
        If there is none, or it lies elsewhere.
    """
    if is_area_file(asked):
        return place_context(load_context(asked), Path(asked), scene)
    patterns = (asked,) if isinstance(asked, str) else asked
    if not isinstance(patterns, Sequence) or not all(isinstance(one, str) for one in patterns):
        msg = (
            "context is a file of streets, green or water, or a pattern of the model's parts or "
            f"kinds; got {show_value(asked)}"
        )
        raise InputError(msg, option="context")
    import shapely  # noqa: PLC0415  (``join_plans`` asks for it)

    shapes: list[Shape] = []
    parts, labels = scene.select(patterns, option="context"), scene.labels()
    for name in dict.fromkeys(labels[k] for k in parts):
        own = [k for k in parts if labels[k] == name]
        soup = scene.triangles(own)
        plan = join_plans(soup.vertices[soup.faces][..., :2], scene.origin[:2])
        if plan is not None:
            kind = _KIND_OF_PART.get(scene.parts[own[0]].kind, "other")
            rings = [shapely.get_coordinates(r)[:-1] for r in shapely.get_rings([plan]).ravel()]
            shapes.append((kind, rings, []))
    return shapes


def cut_shapes(
    shapes: Sequence[Shape],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    built: NDArray[np.bool_],
) -> tuple[ContextShape, ...]:
    """
    Cut lines at a plan's frame and buildings.

    Parameters
    ----------
    shapes : sequence of (str, list, list)
        Kind, rings and lines of each.
    x, y : (cols,) and (rows,) float64
        Cell centres.
    built : (rows, cols) bool
    """
    found = []
    for kind, rings, lines in shapes:
        every = [np.concatenate([ring, ring[:1]]) for ring in rings] + lines
        pieces = [piece for line in every for piece in cut_line(line, x, y, built)]
        low = np.array([x[0], y[0]])
        high = np.array([x[-1], y[-1]])
        kept = [r for r in rings if (r.max(0) >= low).all() and (r.min(0) <= high).all()]
        if pieces or kept:
            found.append(ContextShape(kind, tuple(kept), tuple(pieces)))
    return tuple(found)


def cut_line(
    line: NDArray[np.float64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    built: NDArray[np.bool_],
) -> list[NDArray[np.float64]]:
    """Return the pieces of a line (n, 2) within a plan's cells that lie over no building."""
    cell = np.array([np.ptp(x) / max(len(x) - 1, 1) or 1.0, np.ptp(y) / max(len(y) - 1, 1) or 1.0])
    corner = np.array([x[0], y[0]]) - cell / 2
    # A cell more on each side, so that lines meet the frame, which clips them.
    low, high = corner - cell, np.array([x[-1], y[-1]]) + 1.5 * cell
    a, b = line[:-1], line[1:]
    meets = ((np.maximum(a, b) >= low) & (np.minimum(a, b) <= high)).all(1)
    if not meets.any():
        return []
    which = np.flatnonzero(meets)
    a, b = a[which], b[which]
    step = max(float(cell.min()) / 2, float((high - low).max()) / _STEPS)
    # A segment may be far longer than the plan: only so much of it as the plan can hold.
    reach = 2 * float(np.hypot(*(high - low))) / step
    count = np.maximum(np.ceil(np.hypot(*(b - a).T) / step), 1)
    if (count > 16 * reach).any():
        a, b = _clip(a, b, low, high)
        count = np.maximum(np.ceil(np.hypot(*(b - a).T) / step), 1)
    count = count.astype(np.int64) + 1
    owner = np.repeat(np.arange(len(a)), count)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    t = k / np.repeat(count - 1, count)
    points = a[owner] + t[:, None] * (b - a)[owner]
    place = np.floor((points - corner) / cell).astype(np.int64)
    last = np.array([len(x) - 1, len(y) - 1])
    col, row = np.clip(place, 0, last).T
    is_open = ((place >= -1) & (place <= last + 1)).all(1) & ~built[row, col]
    # A run ends where a building begins, and between segments that do not follow each other.
    follows = np.zeros(len(points), np.bool_)
    follows[1:] = (k[1:] > 0) | (which[owner[1:]] == which[owner[:-1]] + 1)
    starts = is_open & ~(follows & np.concatenate([[False], is_open[:-1]]))
    run = np.cumsum(starts)
    is_end = np.concatenate([~is_open[1:] | starts[1:], [True]])
    kept = is_open & (starts | is_end | (k == 0) | (t == 1.0))
    pieces = []
    for piece in np.split(points[kept], np.flatnonzero(np.diff(run[kept])) + 1):
        if len(piece) > 1:
            pieces.append(piece)
    return pieces


def _clip(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Clip segments (n, 2) to a rectangle; those that miss it shrink to a point."""
    away = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (low - a) / away, (high - a) / away
    one, two = np.where(away == 0, -np.inf, one), np.where(away == 0, np.inf, two)
    first = np.clip(np.minimum(one, two).max(1), 0, 1)
    last = np.maximum(np.clip(np.maximum(one, two).min(1), 0, 1), first)
    return a + first[:, None] * away, a + last[:, None] * away
