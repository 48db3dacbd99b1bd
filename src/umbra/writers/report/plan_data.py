"""What the page's script reads of a raster: a plan, an elevation, a camera's picture."""

import io

import numpy as np
from PIL import Image

from umbra.study import Study
from umbra.writers.color import shade_ramp
from umbra.writers.plan import Plan, shade_roofs
from umbra.writers.report.markup import make_address
from umbra.writers.report.packed import make_steps, pack, pack_masks
from umbra.writers.report.timeline import Timeline

__all__ = ["make_plan_data", "tell_plan"]

_AXES = {"along": "along the view", "z": "z", "row": "row", "col": "column"}


def make_plan_data(study: Study, plan: Plan, timeline: Timeline) -> dict[str, object]:
    """Gather what the script reads."""
    rows, cols = timeline.shape
    x, y = timeline.x, timeline.y
    roofs = Plan(x, y, np.nan_to_num(timeline.surface).astype(np.float32))
    dx, dy = roofs.cell
    heights = np.round(timeline.surface, 2).astype("<f4") + np.float32(0)
    more: dict[str, object] = {}
    if study.shadow_hours.shape == timeline.shape and not timeline.is_summed(study):
        more["hours"] = pack(np.nan_to_num(study.shadow_hours).astype("<f4").tobytes())
    return {
        "kind": "plan",
        "rows": rows,
        "cols": cols,
        "x0": float(x[0]),
        "y0": float(y[0]),
        "dx": dx,
        "dy": dy,
        "decimals": 0 if study.receivers == "camera" else 2 if min(dx, dy) < 0.1 else 1,
        "north": plan.true_north,
        "receivers": study.receivers,
        "axes": ["y", "x"] if study.is_plan else [_AXES.get(name, name) for name in study.dims],
        "is_plan": study.is_plan,
        "has_scale": study.receivers != "camera",
        "up_hours": study.up_hours,
        "days": [day.isoformat() for day in study.period.days],
        "steps": make_steps(study.period, timeline.which, timeline.last),
        "bits": pack_masks(timeline.bits[study.sun.is_up[timeline.which]]),
        "heights": pack(heights.tobytes()),
        "roofs": _make_roofs(roofs, timeline),
        "ramp": np.round(shade_ramp(128) * 255).astype(int).tolist(),
        **more,
    }


def tell_plan(study: Study, timeline: Timeline, own_hours: bool) -> str:
    """Say how the page's cells and instants compare with the study's."""
    rows, cols = timeline.shape
    cell = Plan(timeline.x, timeline.y).cell
    words = f"This {'plan' if study.is_plan else 'view'} shows {cols:,} x {rows:,} "
    words += "pixels" if study.receivers == "camera" else f"cells of {cell[0]:.3g} m"
    if timeline.shape == study.shadow_hours.shape:
        words += ", those of the study itself"
    else:
        words += (
            f", counted anew at their own centres; the study has {len(study.x):,} x "
            f"{len(study.y):,} of {study.grid.dx:.3g}"
        )
    return words + timeline.tell_steps(study, own_hours)


def _make_roofs(plan: Plan, timeline: Timeline) -> str:
    """Draw roofs, or what a view sees, clear where there is nothing, as a PNG in an address."""
    if timeline.shade is None:
        grey, coverage = shade_roofs(plan, timeline.shape)
    else:
        grey, coverage = timeline.shade, np.isfinite(timeline.surface).astype(np.float32)
    pixels = np.zeros((*timeline.shape, 2), np.uint8)
    pixels[..., 0] = np.round(np.clip(grey, 0, 1) * 255)
    pixels[..., 1] = np.round(np.clip(coverage, 0, 1) * 255)
    pixels[..., 0][coverage == 0] = 0
    stream = io.BytesIO()
    Image.fromarray(pixels[::-1].copy(), "LA").save(stream, "PNG", optimize=True)
    return make_address(stream.getvalue())
