"""
The map of a report: hours in the steps of the pictures, and lines that stay sharp at any size.

Lines of equal hours and regions are traced between cells; outlines of buildings are exact.
"""

from collections.abc import Sequence
from typing import Any

import contourpy
import numpy as np
from numpy.typing import NDArray

from umbra.study import FinerHours, Study
from umbra.volume.silhouette import find_silhouette_edges
from umbra.writers.context_lines import CONTEXT_COLORS
from umbra.writers.contours import find_levels
from umbra.writers.packing import pack_differences
from umbra.writers.picture_content import Plan, Show

__all__ = [
    "MOST_DATES",
    "PER_HOUR",
    "outline_buildings",
    "pack_context",
    "pack_regions",
    "pack_vector_map",
]

MOST_DATES = 8
"""Most dates with a map of their own."""
PER_HOUR = 1000
"""Hours are packed as whole numbers of this part of one: 3.6 s."""
UNIT = 1 / 32
"""Places are packed as whole numbers of this part of a cell."""
_BLUR = 0.8  # of cells before they are traced: the staircase of a line goes, the line stays [cell]
_SPECK = 4.0  # a line of equal hours that is no longer than this is left out [cell]
_STRAIGHT = 0.08  # a point of a line that is no farther from its neighbours' chord is left out
_MIDDLE = 0.5  # of a region's share, where its border runs

Paths = Sequence[NDArray[np.floating]]


def pack_vector_map(
    plan: Plan,
    finer: Sequence[FinerHours],
    losses: Sequence[NDArray[np.float32]],
    show: Show,
) -> dict[str, object]:
    """
    Pack a plan's hours of each date in finer steps, with lines of equal hours and outlines.

    ``losses`` are the hours that a proposal takes on each date, in the same cells; none without
    a proposal. ``show`` names the hours whose whole numbers have lines.
    """
    rows, cols = finer[0].shadow_hours.shape
    hidden = np.zeros((rows, cols), np.bool_)
    if plan.shape == (rows, cols):
        hidden = plan.is_building if plan.roofs_cover else hidden
        if plan.appearance is not None:
            hidden = hidden | plan.appearance.find_breaks(plan.shape)
    dates = []
    for k, dated in enumerate(finer):
        hours = dated.shadow_hours
        there = np.isfinite(hours)
        shown = dated.up_hours - hours if show == "sun" else hours
        date: dict[str, object] = {
            "up": dated.up_hours,
            "hours": pack_differences(_round(np.where(there, hours, -1.0))),
            "lines": _pack_lines(shown, find_levels(dated.up_hours), hidden),
        }
        if losses:
            lost = np.where(there, losses[k], np.nan)
            levels = [sign * n for n in find_levels(_find_most(lost)) for sign in (1, -1)]
            date |= {
                "lost": pack_differences(_round(np.nan_to_num(lost))),
                "lost_lines": _pack_lines(lost, levels, hidden),
            }
        dates.append(date)
    return {
        "rows": rows, "cols": cols, "seconds": finer[0].seconds, "unit": UNIT,
        "per_hour": PER_HOUR, "dates": dates,
    }  # fmt: skip


def pack_regions(mask: NDArray[np.bool_]) -> dict[str, object]:
    """Pack the borders of a region of cells (rows, cols): closed rings, holes among them."""
    from scipy.ndimage import gaussian_filter  # noqa: PLC0415  (half a second)

    share = gaussian_filter(np.pad(mask, 1).astype(np.float32), _BLUR)
    share[[0, -1]] = share[:, [0, -1]] = 0
    return {"rows": mask.shape[0], "cols": mask.shape[1], "unit": UNIT} | _pack(
        [_thin(line - 1) for line in _trace(share, _MIDDLE)]
    )


def _find_most(lost: NDArray[np.float32]) -> float:
    """Return the most hours that are lost or won."""
    return float(np.abs(np.nan_to_num(lost)).max(initial=0.0))


def _round(hours: NDArray[np.floating]) -> NDArray[np.int64]:
    return np.rint(hours * PER_HOUR).astype(np.int64)


def _pack_lines(
    hours: NDArray[np.floating], levels: Sequence[int], hidden: NDArray[np.bool_]
) -> list[dict[str, Any]]:
    """Pack the lines of equal hours at some levels; they end at hidden cells."""
    from scipy.ndimage import gaussian_filter  # noqa: PLC0415  (half a second)

    known = ~hidden & np.isfinite(hours)
    if not levels or not known.any():
        return []
    weight = gaussian_filter(known.astype(np.float32), _BLUR)
    total = gaussian_filter(np.where(known, hours, 0).astype(np.float32), _BLUR)
    smooth = np.where(known, total / np.maximum(weight, 1e-6), np.nan)
    packed = []
    for level in levels:
        # A plateau of exactly these hours lies inside, as on sheets.
        lines = _trace(smooth, level - 0.5 / PER_HOUR)
        pieces = [_thin(line) for line in lines if np.ptp(line, axis=0).max() > _SPECK]
        if pieces:
            packed.append({"level": level, **_pack(pieces)})
    return packed


def _trace(values: NDArray[np.floating], level: float) -> list[NDArray[np.float64]]:
    """Trace a level as lines (n, 2), in cells from the raster's lower left corner."""
    tracer = contourpy.contour_generator(z=values, line_type=contourpy.LineType.Separate)
    lines: Any = tracer.lines(level)
    return [line + 0.5 for line in lines]


def _thin(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Leave out points that lie nearly on the chord of their neighbours: every second at most."""
    for _ in range(3):
        if len(line) < 5:
            return line
        a, b, c = line[:-2:2], line[1:-1:2], line[2::2]
        n = min(len(a), len(b), len(c))
        chord, off = c[:n] - a[:n], b[:n] - a[:n]
        apart = np.abs(chord[:, 0] * off[:, 1] - chord[:, 1] * off[:, 0])
        is_bend = np.ones(len(line), np.bool_)
        is_bend[1 : 2 * n : 2] = apart > _STRAIGHT * np.maximum(np.hypot(*chord.T), 1e-9)
        line = line[is_bend]
    return line


def _pack(lines: Paths) -> dict[str, object]:
    """Pack lines: the number of points of each, and all points as x, y."""
    counts = np.array([len(line) for line in lines], np.int64)
    points = np.rint(np.concatenate([*lines, np.zeros((0, 2))]) / UNIT).astype(np.int64)
    return {"counts": pack_differences(counts), "points": pack_differences(points.T)}


def pack_context(study: Study, plan: Plan) -> list[dict[str, object]]:
    """Pack the lines of a plan's context by kind, each with its colour."""
    corner = np.array([study.x[0] - study.grid.dx / 2, study.y[0] - study.grid.dy / 2])
    size = {"rows": study.grid.rows, "cols": study.grid.cols, "unit": UNIT}
    found = []
    for kind, color in CONTEXT_COLORS.items():
        own = [line for shape in plan.context if shape.kind == kind for line in shape.lines]
        lines = [(line - corner) / (study.grid.dx, study.grid.dy) for line in own]
        if lines:
            found.append({"color": color, **size, **_pack(lines)})
    return found


def outline_buildings(study: Study) -> dict[str, object]:
    """Pack the exact outlines of the casting parts as seen from straight above, as segments."""
    caster, grid = study.model.caster, study.grid
    edges, _ = find_silhouette_edges(caster, np.array([0.0, 0.0, 1.0, 0.0]))
    corner = np.array([grid.x0 - grid.dx / 2, grid.y0 - grid.dy / 2])
    ends = (caster.vertices[edges][..., :2] - corner) / (grid.dx, grid.dy)
    low, high = ends.min(1), ends.max(1)
    seen = (high > 0).all(1) & (low < (grid.cols, grid.rows)).all(1)
    return {"rows": grid.rows, "cols": grid.cols, "unit": UNIT} | _pack(list(ends[seen]))
