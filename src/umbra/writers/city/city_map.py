"""The map of a report on a city: hours as a raster, named areas over it as vectors by verdict."""

import io
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.scene.grid import Grid
from umbra.scene.named_places import Area
from umbra.verdicts.outcome import FAIL, PASS, UNKNOWN
from umbra.writers.city.city_plan import CityPlan
from umbra.writers.city.finer_squares import count_finer_squares
from umbra.writers.city.overview import find_squares, shrink_hours
from umbra.writers.city.store_window import StoredTile
from umbra.writers.folder.captions import find_mean, outline_areas
from umbra.writers.folder.foot import tell_steps
from umbra.writers.picture_content import MISSING
from umbra.writers.pixels import NO_SUN, paint_shares, shade_ramp, write_png
from umbra.writers.proof.drawing import COLORS
from umbra.writers.report.markup import make_address

__all__ = ["make_city_map"]

_WIDEST = 4000  # of the picture, more than a window is, which CSS holds to its own [pixels]
_ASIDE = 100.0  # of the areas' bounds, that the map shows at least [m]
_FINE = 1600  # most cells along a map that is drawn cell by cell
_SMALL = 0.012  # of the map: areas that are smaller have a ring around them
_NAMED = 12  # areas that are named on the map
_ROOF = (0.80, 0.79, 0.78)
_LETTERS = 48  # lines of a name along the map's longer side


def make_city_map(plan: CityPlan, areas: Sequence[Area], verdicts: Mapping[str, str]) -> str:
    """
    Return the map as HTML: an SVG, and the key of its colours.

    It shows all named areas with what is around them; without areas the whole city.

    Parameters
    ----------
    plan : CityPlan
    areas : sequence of Area
    verdicts : mapping of str to str
        Verdict on each area that was judged, by name.
    """
    hours, roofs, held, squares = _read(plan, areas)
    finer = count_finer_squares(plan, squares, hours)
    up_hours = plan.result.up_hours
    if finer is not None:
        hours, up_hours = finer.refine(hours, finer.shadow_hours), finer.up_hours
    west, south, east, north = _find_frame(areas) or held
    divisor, words = find_mean(plan.study, plan.job.options)
    most = plan.result.up_hours / divisor
    png = _paint(hours / np.float32(divisor), roofs, most, up_hours / divisor)
    wide, high = east - west, north - south
    shapes = _draw_areas(areas, verdicts, (west, north), (wide, high))
    # Areas may lie beyond the plan: the raster is then a part of the map.
    place = (
        f'x="{held[0] - west:.3f}" y="{north - held[3]:.3f}" width="{held[2] - held[0]:.3f}" '
        f'height="{held[3] - held[1]:.3f}"'
    )
    svg = (
        f'<svg viewBox="0 0 {wide:.3f} {high:.3f}" width="{_WIDEST}" '
        f'height="{_WIDEST * high / wide:.0f}" role="img" aria-label="Hours of sun, and the '
        f'named areas by verdict"><image href="{make_address(png)}" {place} '
        f'preserveAspectRatio="none" class="pixels"/>{shapes}{_draw_scale(wide, high)}</svg>'
    )
    options = plan.job.options
    steps = "" if options.exact else tell_steps(plan.study, options, finer)
    nothing = ""
    if (np.isnan(hours) if roofs is None else np.isnan(hours) & (roofs <= 0)).any():
        nothing = plan.context.kind.nothing
    told = {verdicts.get(one.name, "") for one in areas}
    key = _make_key(most, words, told, steps, nothing)
    return f"{key}{svg}"


_Rectangle = tuple[float, float, float, float]


def _read(
    plan: CityPlan, areas: Sequence[Area]
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None, _Rectangle, Grid]:
    """Return hours in shadow, roofs, the rectangle that they fill [m], and its cells."""
    result = plan.result
    (dx, dy), (x0, y0, *_) = result.cell, result.extent
    rows, cols = slice(0, len(result.y)), slice(0, len(result.x))
    frame = _find_frame(areas)
    if frame is not None:
        cols = _cut(frame[0] - x0, frame[2] - x0, dx, len(result.x))
        rows = _cut(frame[1] - y0, frame[3] - y0, dy, len(result.y))
    size = rows.stop - rows.start, cols.stop - cols.start
    if frame is not None and max(size) <= _FINE and min(size) > 0:
        window = StoredTile(-1, rows, cols)
        roofs = plan.find_roofs(window).astype(np.float32) if plan.has_roofs else None
        held = (x0 + cols.start * dx, y0 + rows.start * dy,
                x0 + cols.stop * dx, y0 + rows.stop * dy)  # fmt: skip
        hours = result.read("shadow_hours", window)
        return hours, roofs, held, plan.lattice.grid.part(rows, cols)
    hours, times, roofs = shrink_hours(result, plan=plan)
    height, width = hours.shape
    held = x0, y0, x0 + width * times * dx, y0 + height * times * dy
    return hours, roofs, held, find_squares(plan.lattice.grid, times)


def _find_frame(areas: Sequence[Area]) -> _Rectangle | None:
    """Return the rectangle of all areas and what is around them [m]; None without areas."""
    if not areas:
        return None
    bounds = np.array([area.polygon.bounds for area in areas])
    low, high = bounds[:, :2].min(0), bounds[:, 2:].max(0)
    aside = max(_ASIDE, 0.15 * float((high - low).max()))
    (west, south), (east, north) = (low - aside).tolist(), (high + aside).tolist()
    return west, south, east, north


def _cut(low: float, high: float, side: float, count: int) -> slice:
    """Return the cells between two distances from the first one's edge."""
    first, stop = (int(np.clip(edge / side, 0, count)) for edge in (low, high + side))
    return slice(first, stop)


def _paint(
    hours: NDArray[np.float32], roofs: NDArray[np.float32] | None, most: float, dark_from: float
) -> bytes:
    """Return the map's pixels as PNG, north on top."""
    image = paint_shares(np.nan_to_num(hours) / max(most, 1e-9))
    image[hours >= dark_from - 1e-3] = NO_SUN
    image[np.isnan(hours)] = MISSING
    if roofs is not None:
        image[roofs > 0] = _ROOF
    file = io.BytesIO()
    write_png(file, np.ascontiguousarray(np.rint(image[::-1] * 255).astype(np.uint8)))
    return file.getvalue()


def _draw_areas(
    areas: Sequence[Area], verdicts: Mapping[str, str], corner: tuple[float, float],
    size: tuple[float, float],
) -> str:  # fmt: skip
    """Return the areas as paths: a small one with a ring around it, few with their names."""
    longest = max(size)
    worst = [k for k, one in enumerate(areas) if verdicts.get(one.name) == FAIL]
    named = {*range(len(areas))} if len(areas) <= _NAMED else {*worst[:_NAMED]}
    shapes, names = [], []
    for k, one in enumerate(outline_areas(list(areas))):
        verdict = verdicts.get(one.name, "")
        rings = [np.asarray(ring) for ring in one.rings]
        path = "".join(
            "M" + "L".join(f"{x - corner[0]:.2f} {corner[1] - y:.2f}" for x, y in ring) + "Z"
            for ring in rings
        )
        x, y = one.middle[0] - corner[0], corner[1] - one.middle[1]
        title = f"<title>{escape(one.name)}{f': {verdict}' if verdict else ''}</title>"
        style = f'class="area {verdict}" id="area-{k}"'
        corners = np.concatenate(rings)
        extent = float(np.ptp(corners, axis=0).max())
        ring = ""
        if extent < _SMALL * longest:
            ring = f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{_SMALL * longest:.2f}"/>'
        shapes.append(
            f'<g {style}>{title}<path class="halo" d="{path}"/><path d="{path}"/>{ring}</g>'
        )
        if k in named:
            above = y - max(_SMALL * longest, float(np.ptp(corners[:, 1])) / 2) * 1.15
            names.append(
                f'<text x="{x:.2f}" y="{max(above, longest / _LETTERS):.2f}" '
                f'font-size="{longest / _LETTERS:.2f}" class="{verdict}">{escape(one.name)}</text>'
            )
    return "".join(shapes + names)


def _draw_scale(wide: float, high: float) -> str:
    """Return a scale bar of a round length."""
    most = wide / 5
    step = 10 ** np.floor(np.log10(most))
    length = float(next(k * step for k in (5, 2, 1) if k * step <= most))
    x, y, unit = wide * 0.02, high - max(wide, high) * 0.02, max(wide, high) / 200
    told = f"{length / 1000:g} km" if length >= 1000 else f"{length:g} m"
    return (
        f'<g class="scale"><rect x="{x:.2f}" y="{y:.2f}" width="{length:.2f}" '
        f'height="{unit:.2f}"/><text x="{x:.2f}" y="{y - unit:.2f}" '
        f'font-size="{4 * unit:.2f}">{told}</text></g>'
    )


def _make_key(most: float, words: str, verdicts: set[str], steps: str, nothing: str) -> str:
    """Return the key of the colours, and from what steps of the sun their hours are."""
    file = io.BytesIO()
    ramp = np.rint(shade_ramp(128)[::-1] * 255).astype(np.uint8)
    write_png(file, np.ascontiguousarray(ramp[None]))
    told: dict[str, Any] = {PASS: "pass", FAIL: "fail", UNKNOWN: "unknown", "": "not judged"}
    marks = "".join(
        f'<span class="mark {word}"><svg viewBox="0 0 14 12"><rect x="1" y="1" width="12" '
        f'height="10" fill="none" stroke="{COLORS[word]}" stroke-width="2.5"/></svg>{name}</span>'
        for word, name in told.items() if word in verdicts
    )  # fmt: skip
    tints = [("no sun", NO_SUN), ("buildings", _ROOF)]
    tints += [(nothing, (MISSING,) * 3)] * bool(nothing)
    swatches = "".join(_make_swatch(name, color) for name, color in tints)
    return (
        f'<div class="bar over"><div class="key"><span>hours of sun{escape(words)}: 0 h</span>'
        f'<img id="ramp" src="{make_address(file.getvalue())}" alt=""><span>{most:.3g} h</span>'
        f'{swatches}{marks}<span class="quiet">{f"sun {steps}" if steps else ""}</span>'
        "</div></div>"
    )


def _make_swatch(name: str, color: Sequence[float]) -> str:
    """Return a colour and its name."""
    tint = ", ".join(f"{round(255 * part)}" for part in color)
    return (
        f'<span class="no-sun"><svg viewBox="0 0 14 12"><rect width="14" height="12" '
        f'fill="rgb({tint})"/></svg>{escape(name)}</span>'
    )
