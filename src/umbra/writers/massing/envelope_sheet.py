"""The sheet of an envelope: its heights in plan, and in axonometry among its neighbours."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.massing.search import HeightEnvelope
from umbra.massing.solid import make_solid
from umbra.receivers.zenith import find_surface
from umbra.scene import Triangles
from umbra.scene.grid import Grid
from umbra.scene.mesh import ADDED_GROUND
from umbra.writers.contours import draw_contours, trace
from umbra.writers.marks import draw_frame, draw_north, draw_scale_bar, find_round, find_ticks
from umbra.writers.massing.axonometry import look_at
from umbra.writers.paper import (
    INK,
    QUIET,
    RULE,
    SMALL,
    SUBTITLE,
    TITLE,
    Leaf,
    Panel,
    Paper,
    PaperPicture,
    measure_text,
    wrap,
)
from umbra.writers.picture_content import DOTS_PER_INCH, Plan, cover_with_roofs
from umbra.writers.pixels import HALF, resample

__all__ = ["draw_envelope"]

_SIDE, _GAP, _LEFT = 5.6, 0.75, 0.95  # of the maps, between them, and beside them [inch]
_FOOT, _HEAD = 0.75, 0.95
_PAPER = np.array((0.985, 0.985, 0.98), np.float32)
_RAMP = np.array([(0.99, 0.95, 0.80), (0.97, 0.75, 0.42), (0.84, 0.45, 0.27), (0.47, 0.16, 0.26)])
_GOOD, _BROKEN = "#1f6fb4", "#c0262d"
_CELLS = 360  # of the map of what stands around
_MARGIN = 12.0  # around plot and receivers [m]
_FARTHEST = 150.0  # from the plot's middle that is drawn [m], if the plot is no wider
_ZOOM = 1.4  # half a side of the view, by the plot's side
_LABELLED = 24  # most receivers with names


def draw_envelope(envelope: HeightEnvelope) -> PaperPicture:
    """Draw the sheet of an envelope."""
    width = 2 * _SIDE + _GAP + _LEFT + 0.45
    facts = [line for fact in _tell_facts(envelope) for line in wrap(fact, SMALL, width - 1.0)]
    head = _HEAD + 0.16 * len(facts)
    leaf = Leaf(width, _FOOT + _SIDE + head)
    paper = Paper(leaf)
    top = _FOOT + _SIDE + head - 0.42
    paper.write(_LEFT, top, _tell_title(envelope), TITLE, weight="bold")
    paper.write(_LEFT, top - 0.22, "; ".join(envelope.rules), SUBTITLE)
    for k, line in enumerate(facts):
        paper.write(_LEFT, top - 0.42 - 0.16 * k, line, color=QUIET)
    end = _find_end(envelope)
    _draw_plan(leaf, envelope, end)
    _draw_view(paper, envelope, end)
    return PaperPicture(paper)


def _tell_title(envelope: HeightEnvelope) -> str:
    if not envelope.volume_m3 > 0:
        return "Nothing may be built here"
    return (
        f"One may build {envelope.volume_m3:,.0f} m³ here, up to {envelope.max_height_m:.1f} m high"
    )


def _tell_facts(envelope: HeightEnvelope) -> Iterator[str]:
    yield " · ".join(envelope.times)
    result = envelope.found
    receivers = len(envelope.list_receivers()[0])
    cells = f"{len(result.heights):,} cells of {envelope.cell:g} m"
    broken = len(envelope.violations)
    checked = "no rule is broken" if not broken else f"{broken:,} are broken"
    yield (
        f"{cells}, {receivers:,} receivers · verified by an exact study with the envelope in the "
        f"model: {checked} · no choice of hours allows more than {envelope.bound_m3:,.0f} m³"
    )
    more = []
    if envelope.capped:
        more.append(f"{envelope.capped:,} cells end at the cap of {envelope.highest:g} m")
    if envelope.broken:
        more.append(
            f"{len(envelope.broken):,} receivers have too little before anything is built (red): "
            "nothing is taken from them"
        )
    if envelope.replaced:
        names = ", ".join(envelope.replaced[:3])
        others = len(envelope.replaced) - 3
        more.append(f"what stands on the plot is left out: {names}"
                    + (f" and {others:,} more" if others > 0 else ""))  # fmt: skip
    if more:
        yield " · ".join(more)


def _find_end(envelope: HeightEnvelope) -> float:
    """Return the end of the scale of heights: a round one."""
    most = max(envelope.max_height_m, 1.0)
    step = find_round(most / 4)
    return float(step * np.ceil(most / step - 1e-9))


def _paint(shares: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the colours of heights, as shares of the scale, (..., 3) sRGB."""
    along = np.clip(np.nan_to_num(shares), 0, 1) * (len(_RAMP) - 1)
    steps = np.arange(len(_RAMP))
    return np.stack([np.interp(along, steps, _RAMP[:, k]) for k in range(3)], -1)


def _find_extent(envelope: HeightEnvelope) -> tuple[float, float, float]:
    """Return the middle and half a side of a square map that holds plot and receivers."""
    cell, x, y = envelope.cell, envelope.x, envelope.y
    low = np.array([x[0], y[0]]) - cell / 2
    high = np.array([x[-1], y[-1]]) + cell / 2
    middle = (low + high) / 2
    reach = max(_FARTHEST, 0.75 * float(np.ptp([low, high], axis=0).max()))
    points = envelope.list_receivers()[0][:, :2]
    near = points[np.abs(points - middle).max(1) < reach] if len(points) else points
    corners = np.concatenate([[low, high], near])
    low, high = corners.min(0) - _MARGIN, corners.max(0) + _MARGIN
    half = float((high - low).max()) / 2
    return (*((low + high) / 2).tolist(), half)


def _draw_plan(leaf: Leaf, envelope: HeightEnvelope, end: float) -> None:
    cx, cy, half = _find_extent(envelope)
    step = 2 * half / _CELLS
    x, y = (c - half + (np.arange(_CELLS, dtype=np.float64) + 0.5) * step for c in (cx, cy))
    origin = envelope.scene.origin
    grid = Grid(x[0] - origin[0], y[0] - origin[1], step, step, _CELLS, _CELLS)
    ground = float(np.median(envelope.found.plot.ground))
    soup = envelope.scene.triangles()
    surface = find_surface(soup, grid, float(soup.vertices[:, 2].min()) - 1.0)
    owner = np.append(soup.part, len(envelope.scene.parts))[surface.face]  # -1: nothing
    stands = _find_standing(envelope)[owner] * np.maximum(surface.heights - ground, 1.0)
    plan = Plan(x, y, stands, envelope.site.true_north)
    pixels = round(_SIDE * DOTS_PER_INCH)
    size = (pixels, pixels)
    panel = Panel(leaf, plan, (_LEFT, _FOOT, _SIDE, _SIDE), size)
    image = np.broadcast_to(_PAPER, (*size, 3)).copy()
    cover_with_roofs(image, plan, size)
    heights = _sample(envelope, x, y)
    on_plot = np.isfinite(heights)
    seen = resample(on_plot, size) > HALF
    shares = np.nan_to_num(resample(heights.astype(np.float32), size)) / end
    image[seen] = _paint(shares)[seen]
    panel.paste(image, _LEFT, _FOOT)
    panel.rule_map(trace(panel, (stands > 0) & ~on_plot), RULE, 0.5)
    levels = [level for level in _list_levels(end) if level < envelope.max_height_m]
    colors = [(INK, "#ffffffb0") if level < 0.6 * end else ("#ffffff", "#501828d0")
              for level in levels]  # fmt: skip
    texts = [f"{level:g} m" for level in levels]
    draw_contours(panel, np.nan_to_num(heights), levels, colors, ~on_plot, texts)
    _outline(panel, envelope)
    _draw_receivers(panel, envelope)
    ticks = [find_ticks(c - half, c + half, _SIDE, lambda label: measure_text(label, SMALL) + 0.25)
             for c in (cx, cy)]  # fmt: skip
    wide = max((measure_text(label, SMALL) for _, label in ticks[1]), default=0.0)
    draw_frame(panel, ticks[0], ticks[1], wide)
    draw_scale_bar(panel, _LEFT + 0.15, _FOOT + 0.15, 1.6)
    draw_north(panel, _LEFT + _SIDE - 0.35, _FOOT + _SIDE - 0.4)


def _find_standing(envelope: HeightEnvelope) -> NDArray[np.bool_]:
    """Return which parts are no ground, and False for nothing, (n_parts + 1,)."""
    kinds = TERRAIN | ADDED_GROUND
    return np.array([*(part.kind not in kinds for part in envelope.scene.parts), False])


def _sample(envelope: HeightEnvelope, x: NDArray, y: NDArray) -> NDArray[np.float64]:
    """Return the heights on other cells; NaN off the plot."""
    raster = np.pad(envelope.heights, 1, constant_values=np.nan)
    col = np.floor((x - envelope.x[0]) / envelope.cell + 0.5).astype(np.int64) + 1
    row = np.floor((y - envelope.y[0]) / envelope.cell + 0.5).astype(np.int64) + 1
    rows, cols = raster.shape
    return raster[np.clip(row, 0, rows - 1)[:, None], np.clip(col, 0, cols - 1)]


def _list_levels(end: float) -> list[float]:
    step = find_round(end / 5)
    return [step * k for k in range(1, round(end / step))]


def _outline(panel: Panel, envelope: HeightEnvelope) -> None:
    import shapely  # noqa: PLC0415  (an extra, which the plot needed)

    outline = envelope.found.plot.outline
    rings = [
        ring
        for polygon in shapely.get_parts(outline)
        for ring in (polygon.exterior, *polygon.interiors)
    ]
    panel.rule_map([panel.place(np.array(ring.coords)[:, :2]) for ring in rings], INK, 1.2)


def _draw_receivers(panel: Panel, envelope: HeightEnvelope) -> None:
    points, lacking, names = envelope.list_receivers()
    x, y, w, h = panel.map_box
    spots = panel.place(points[:, :2])
    inside = ((spots > (x, y)) & (spots < (x + w, y + h))).all(1)
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    radius = 0.035 if len(points) <= 400 else 0.018
    disc = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    for which, color in ((~lacking, _GOOD), (lacking, _BROKEN)):
        chosen = np.flatnonzero(inside & which)
        if len(chosen):
            panel.fill([spots[k] + disc for k in chosen], color, "white", 0.4)
    if len(points) <= _LABELLED:
        for k in np.flatnonzero(inside):
            panel.write(spots[k, 0] + 0.06, spots[k, 1] + 0.03, names[k][:24], SMALL - 0.5,
                        halo="#ffffffc0")  # fmt: skip


def _draw_view(paper: Paper, envelope: HeightEnvelope, end: float) -> None:
    left, low = _LEFT + _SIDE + _GAP, _FOOT + 0.62
    high = _SIDE - 0.62
    pixels = round(high * DOTS_PER_INCH), round(_SIDE * DOTS_PER_INCH)
    plot, result, origin = envelope.found.plot, envelope.found, envelope.scene.origin
    x, y = envelope.x, envelope.y
    middle = np.array([x.mean(), y.mean()]) - origin[:2]
    half = float(max(np.ptp(x), np.ptp(y))) * _ZOOM + _MARGIN
    soup = envelope.scene.triangles()
    soup = replace(soup, faces=soup.faces[_find_standing(envelope)[soup.part]])
    near = _pick_near(soup, middle, half)
    receivers = envelope.list_receivers()[0] - origin
    rows, cols = plot.places
    centres = np.column_stack([plot.x0 + (cols + 0.5) * plot.cell,
                               plot.y0 + (rows + 0.5) * plot.cell])  # fmt: skip
    away = receivers[:, :2].mean(0) - centres.mean(0)
    # From the side of the receivers, for which the planes are cut, somewhat to the left.
    azimuth = float(np.degrees(np.arctan2(away[0], away[1])) + 28.0) % 360
    tops = plot.ground + result.heights
    solid = make_solid(plot, tops)
    foot = float(plot.foot.min())
    span = np.array([half, half])
    corners = [np.append(middle + span * (a, b), foot) for a in (-1, 1) for b in (-1, 1)]
    crown = np.column_stack([centres, tops])
    shown = [np.array(corners)] if not len(near.faces) else [near.vertices[near.faces.ravel()]]
    points = np.concatenate([*shown, crown, np.column_stack([centres, plot.foot])])
    view = look_at(points, azimuth, 32.0, pixels[1] / pixels[0])
    colors = np.zeros((0, 3))
    if solid is not None:
        top = solid.vertices[solid.faces][..., 2].max(1) - np.median(plot.ground)
        colors = _paint(top / end)
    image = view.draw(near, solid, colors, pixels)
    paper.paste(image, left, low)
    box = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]) * (_SIDE, high) + (left, low)
    paper.rule([box], RULE, 0.6)
    turned = (azimuth - envelope.site.true_north) % 360
    caption = f"seen from azimuth {turned:.0f}°, 32° from above; heights above the ground"
    paper.write(left, low - 0.16, caption, SMALL, color=QUIET)
    _draw_scale(paper, left, _FOOT - 0.12, end)


def _pick_near(soup: Triangles, middle: NDArray[np.float64], half: float) -> Triangles:
    """Return the triangles that lie within a square."""
    corners = soup.vertices[soup.faces][..., :2]
    inside = (np.abs(corners - middle) <= half).all((1, 2))
    return replace(soup, faces=soup.faces[inside], part=np.zeros(inside.sum(), np.int32))


def _draw_scale(paper: Paper, x: float, y: float, end: float) -> None:
    """Draw the bar of heights, and the key of receivers."""
    wide, high = 3.0, 0.15
    count = round(wide * DOTS_PER_INCH)
    strip = _paint((np.arange(count) + 0.5) / count)
    paper.paste(np.repeat(strip[None], round(high * DOTS_PER_INCH), 0), x, y)
    box = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]) * (wide, high) + (x, y)
    paper.rule([box], RULE, 0.6)
    for level in [0.0, *_list_levels(end), end]:
        at = x + wide * level / end
        paper.rule([[(at, y - 0.04), (at, y)]], RULE)
        unit = " m" if level == end else ""
        paper.write(at, y - 0.07, f"{level:g}{unit}", SMALL, ha="center", va="top")
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    disc = 0.04 * np.column_stack([np.cos(turn), np.sin(turn)])
    words = (("receiver", _GOOD), ("has too little before", _BROKEN))
    at = x + wide + 0.4
    for word, color in words:
        paper.fill([disc + (at, y + high / 2)], color, "white", 0.4)
        paper.write(at + 0.1, y + high / 2, word, SMALL, va="center_baseline")
        at += measure_text(word, SMALL) + 0.35
