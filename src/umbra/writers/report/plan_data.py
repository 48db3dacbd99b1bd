"""What the page's script reads of a raster: a plan, an elevation, a camera's picture."""

import io
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from umbra.study import Study
from umbra.study.timeline import LONGEST_VIEW, Timeline
from umbra.writers.edges import find_appearance
from umbra.writers.plan import Appearance, Plan, shade_roofs
from umbra.writers.report.markup import Pin, make_address
from umbra.writers.report.packed import make_common_data, pack, pack_hours, tell_steps

__all__ = ["make_plan_data", "tell_plan"]

_BRIGHT, _SHADED, _INK = 0.9, 0.26, 0.7  # of a view's surfaces, their shade, and lines
_VEIL = 0.06  # of the hours' colours, the deepest shade: they stay nearest to their own
_FINE = 0.1  # cells whose places are told to a centimetre [m]
_AXES = {"along": "along the view", "z": "z", "row": "row", "col": "column"}


def make_plan_data(
    study: Study, plan: Plan, timeline: Timeline, pins: Sequence[Pin] = ()
) -> dict[str, object]:
    """Gather what the script reads."""
    rows, cols = timeline.shape
    x, y = timeline.x, timeline.y
    roofs = Plan(x, y, np.nan_to_num(timeline.surface).astype(np.float32))
    appearance = find_appearance(study, _find_size(timeline))
    is_view = appearance is not None and not study.is_plan
    drawn = _draw_view(appearance) if appearance and is_view else _draw_roofs(roofs, timeline)
    dx, dy = roofs.cell
    heights = np.round(timeline.surface, 2).astype("<f4") + np.float32(0)
    more: dict[str, object] = {}
    if study.shadow_hours.shape == timeline.shape and not timeline.is_summed(study):
        more["hours"] = pack_hours(study.shadow_hours)
        if timeline.behind is not None:
            more["behind_hours"] = pack_hours(np.asarray(study.more["canopy_hours"][1]))
    return {
        "kind": "plan",
        "rows": rows,
        "cols": cols,
        "x0": float(x[0]),
        "y0": float(y[0]),
        "dx": dx,
        "dy": dy,
        "decimals": 0 if not study.kind.has_scale else 2 if min(dx, dy) < _FINE else 1,
        "north": plan.true_north,
        "under_roofs": study.kind.lies_under_roofs,
        "axes": ["y", "x"] if study.is_plan else [_AXES.get(name, name) for name in study.dims],
        "is_plan": study.is_plan,
        "has_scale": study.kind.has_scale,
        **make_common_data(study, timeline),
        "heights": pack(heights.tobytes()),
        "roofs": drawn,
        "places": [asdict(pin) for pin in pins],
        "relief": None if appearance is None else _draw_relief(appearance),
        **more,
    }


def tell_plan(study: Study, timeline: Timeline, own_hours: bool) -> str:
    """Say how the page's cells and instants compare with the study's."""
    rows, cols = timeline.shape
    cell = Plan(timeline.x, timeline.y).cell
    has_scale = study.kind.has_scale
    words = f"This {'plan' if study.is_plan else 'view'} shows {cols:,} x {rows:,} "
    words += f"cells of {cell[0]:.3g} m" if has_scale else "pixels"
    if timeline.shape == study.shadow_hours.shape:
        words += ", those of the study itself"
    else:
        words += ", counted anew at their own centres; the study has "
        words += f"{len(study.x):,} x {len(study.y):,}"
        words += f" of {study.grid.dx:.3g} m" if has_scale else ""
    return words + tell_steps(study, timeline, own_hours)


def _draw_roofs(plan: Plan, timeline: Timeline) -> str:
    """Draw roofs, clear where there are none, as a PNG in an address."""
    grey, coverage = shade_roofs(plan, timeline.shape)
    return _make_picture(grey, coverage)


def _draw_view(appearance: Appearance) -> str:
    """Draw what a view sees, with its edges, clear where it sees nothing."""
    shade, lines = appearance.shade / np.float32(255), appearance.lines / np.float32(255)
    seen = 1 if appearance.sky is None else 1 - appearance.sky / np.float32(255)
    grey = _BRIGHT * (1 - _SHADED * (1 - shade)) * (1 - _INK * lines)
    return _make_picture(grey, np.maximum(seen, lines))


def _draw_relief(appearance: Appearance) -> str:
    """Draw the shade and the lines that lie over hours on roofs and walls: black, mostly clear."""
    shade, lines = appearance.shade / np.float32(255), appearance.lines / np.float32(255)
    veil = np.maximum(_VEIL * (1 - shade), _INK * lines)
    return _make_picture(np.zeros(veil.shape), veil)


def _find_size(timeline: Timeline) -> tuple[int, int]:
    """Give the rows and columns of a picture that is drawn over the timeline's cells."""
    times = max(1.0, LONGEST_VIEW / max(timeline.shape))
    rows, cols = (max(1, round(side * times)) for side in timeline.shape)
    return rows, cols


def _make_picture(grey: NDArray[np.floating], coverage: NDArray[np.floating]) -> str:
    pixels = np.zeros((*grey.shape, 2), np.uint8)
    pixels[..., 0] = np.round(np.clip(grey, 0, 1) * 255)
    pixels[..., 1] = np.round(np.clip(coverage, 0, 1) * 255)
    pixels[..., 0][coverage == 0] = 0
    stream = io.BytesIO()
    Image.fromarray(pixels[::-1].copy(), "LA").save(stream, "PNG", optimize=True)
    return make_address(stream.getvalue())
