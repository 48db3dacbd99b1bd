"""
Data for the page's script: a raster, or the model with each receiver's day.

A raster is a plan, an elevation or a camera's picture; surfaces and points have the model.
"""

import io
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from umbra.study import Study
from umbra.study.timeline import LONGEST_VIEW, Instants, Timeline
from umbra.writers.edges import find_grid_appearance
from umbra.writers.packing import pack, pack_differences, pack_grids, pack_hours
from umbra.writers.picture_content import Appearance, OutlinedArea, Plan, shade_roofs
from umbra.writers.pixels import write_png
from umbra.writers.report.losses import pack_losses, pack_plan_losses
from umbra.writers.report.markup import Pin, make_address
from umbra.writers.report.packed import make_common_data, tell_steps
from umbra.writers.report.vector_map import outline_buildings, pack_context

__all__ = [
    "make_model_data",
    "make_plan_data",
    "tell_model",
    "tell_plan",
]

_BRIGHT, _SHADED, _INK = 0.9, 0.26, 0.7  # of a view's surfaces, their shade, and lines
_VEIL = 0.06  # of the hours' colours, the deepest shade: they stay nearest to their own
_FINER = 1.25  # cells on which edges are looked for per pixel: those of a sheet of a million cells
_FINE = 0.1  # cell size below which positions have centimetres [m]
_AXES = {"along": "along the view", "z": "z", "row": "row", "col": "column"}


def make_plan_data(
    study: Study,
    plan: Plan,
    timeline: Timeline,
    pins: Sequence[Pin] = (),
    proposed: Sequence[str] = (),
) -> dict[str, object]:
    """Gather the script's data on a raster; ``proposed`` are the patterns of a proposal."""
    rows, cols = timeline.shape
    x, y = timeline.x, timeline.y
    roofs = Plan(x, y, np.nan_to_num(timeline.surface).astype(np.float32))
    appearance = find_grid_appearance(study, _find_size(timeline), finer=_FINER)
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
        "areas": [_outline(area) for area in plan.areas],
        "context": pack_context(study, plan),
        "outlines": outline_buildings(study) if study.is_plan else None,
        "relief": None if appearance is None else _draw_relief(appearance),
        **pack_plan_losses(study, timeline, proposed),
        **more,
    }


def _outline(area: OutlinedArea) -> dict[str, object]:
    """Return a named area for the script: its rings and a place inside, to centimetres."""
    rings = [np.round(ring, 2).tolist() for ring in area.rings]
    return {"name": area.name, "rings": rings, "x": area.middle[0], "y": area.middle[1]}


def tell_plan(study: Study, timeline: Timeline, own_hours: bool) -> str:
    """Describe how the page's cells and instants differ from the study's."""
    rows, cols = timeline.shape
    cell = Plan(timeline.x, timeline.y).cell
    has_scale = study.kind.has_scale
    words = f"This {'plan' if study.is_plan else 'view'} shows {cols:,} x {rows:,} "
    words += f"cells of {cell[0]:.3g} m" if has_scale else "pixels"
    if timeline.shape == study.shadow_hours.shape:
        words += ", as in the study itself"
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
    """Draw a view's surfaces with their edges, clear where it sees nothing."""
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
    """Return the rows and columns of a picture that is drawn over the timeline's cells."""
    times = max(1.0, LONGEST_VIEW / max(timeline.shape))
    rows, cols = (max(1, round(side * times)) for side in timeline.shape)
    return rows, cols


def _make_picture(grey: NDArray[np.floating], coverage: NDArray[np.floating]) -> str:
    pixels = np.zeros((*grey.shape, 2), np.uint8)
    pixels[..., 0] = np.round(np.clip(grey, 0, 1) * 255)
    pixels[..., 1] = np.round(np.clip(coverage, 0, 1) * 255)
    pixels[..., 0][coverage == 0] = 0
    stream = io.BytesIO()
    write_png(stream, pixels[::-1])
    return make_address(stream.getvalue())


def make_model_data(study: Study, instants: Instants) -> dict[str, object]:
    """Gather the script's data on surfaces or points."""
    scene = study.model.scene
    middle = np.round(scene.bounds().mean(0)) - scene.origin
    samples = study.samples
    shown = np.arange(len(study.shadow_hours))
    more: dict[str, object]
    if samples is None:
        given = study.more.get("name")
        named = [] if given is None else np.asarray(given[1]).tolist()
        more = {
            "names": [name or f"{study.kind.spot} {k + 1}" for k, name in enumerate(named)]
            or [f"{study.kind.spot} {k + 1}" for k in shown],
            "normals": pack(study.places.normals.astype("<f4").tobytes()),
        }
    else:
        grids, shown = pack_grids(samples, middle)
        more = {
            **grids,
            "sample_surface": pack_differences(samples.surface[shown]),
            **_list_surfaces(study),
        }
    if instants.behind is not None:
        more["behind_hours"] = pack_hours(np.asarray(study.more["canopy_hours"][1])[shown])
    more |= pack_losses(study, lambda values: values[shown])
    places = study.places.points[shown] - scene.origin - middle
    return {
        "kind": "model",
        "count": len(shown),
        "decimals": 2,
        "origin": (scene.origin + middle).tolist(),
        "north": study.site.true_north,
        **make_common_data(
            study, instants, shown if len(shown) < len(study.shadow_hours) else None
        ),
        "hours": pack_hours(study.shadow_hours[shown]),
        "positions": pack_differences(np.rint(places.T * 1000).astype(np.int64)),
        **more,
    }


def tell_model(study: Study, instants: Instants, data: dict[str, object]) -> str:
    """Describe the receivers and instants of the page."""
    count = len(study.shadow_hours)
    what = study.kind.noun if study.samples is None else "samples"
    shown = int(str(data["count"]))
    if shown < count:
        words = f"This picture shows {shown:,} of the study's {count:,} {what}; study.nc has all"
    else:
        words = f"This picture shows all {count:,} {what} of the study"
    return words + tell_steps(study, instants, own_hours=True)


def _list_surfaces(study: Study) -> dict[str, object]:
    """List names of parts, and orientations of surfaces."""
    arrays = {name: array for name, (_, array) in study.more.items() if name != "in_shadow"}
    azimuth = np.round(arrays["surface_azimuth"], 1)
    return {
        "parts": arrays["part"].tolist(),
        "surfaces": {
            "part": arrays["surface_part"].tolist(),
            "kind": arrays["surface_kind"].tolist(),
            "azimuth": [None if np.isnan(v) else v for v in azimuth.tolist()],
            "tilt": np.round(arrays["surface_tilt"], 1).tolist(),
        },
    }
