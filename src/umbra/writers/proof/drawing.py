"""The plan of a proof: buildings, the proposal, areas and windows by verdict, and the lines."""

import datetime as dt
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.packages import need
from umbra.rules.record import Condition
from umbra.rules.words import MEASURES, tell_hours
from umbra.sun import name_date
from umbra.sun.clock import parse_duration
from umbra.verdicts.judge import RuleVerdict
from umbra.verdicts.judged_receivers import Gathered
from umbra.verdicts.outcome import FAIL, PASS, UNKNOWN
from umbra.verdicts.sunlight import SunlightOf
from umbra.verdicts.values import measure

__all__ = [
    "BOUNDARY", "COLORS", "LAND", "PROPOSAL", "REPLACED", "TINTS", "Drawing", "Line", "Spot",
    "group_windows", "make_drawing", "shorten",
]  # fmt: skip

COLORS = {PASS: "#2b8a6e", FAIL: "#d1431f", UNKNOWN: "#8a8a94", "": "#3f5f8a"}
TINTS = {PASS: "#cfe8df", FAIL: "#f6d3c8", UNKNOWN: "#e2e2e6", "": "#dbe4f0"}
LAND, PROPOSAL, REPLACED, BOUNDARY = "#ececef", "#f3e3b5", "#6a6a74", "#7a4fa3"
"""Colours of buildings, the proposal, what it replaces, and the plot."""
_WORST = {"": -1, PASS: 0, UNKNOWN: 1, FAIL: 2}
_MOST_TRIANGLES = 400_000
_MOST_BANDS = 2  # whose lines are drawn: more are of variants among which none was chosen
_FINE = 160  # squares across an area for its lines
_MARGIN = 0.12  # of the frame's longer side
_LEAST_MARGIN = 12.0  # [m]
_FINE_STEP = 60  # of the sun for lines [s]
_MOST_MOMENTS = 3e8  # of all places and lines, of which the rule's own steps are left
_NEAR = 0.25  # between windows above one another, in plan [m]


@dataclass(frozen=True, eq=False)
class Line:
    """A line of equal hours: its pieces, what it is, and its name beside it."""

    pieces: list[NDArray]
    label: str
    short: str


@dataclass(frozen=True)
class Spot:
    """
    Windows above one another, as one mark.

    Parameters
    ----------
    x, y : float
        In the model's own coordinates [m].
    azimuth : float
        In plan, NaN of what lies level [degrees].
    verdict : str
        The worst of them.
    label : str
    """

    x: float
    y: float
    azimuth: float
    verdict: str
    label: str


@dataclass(eq=False)
class Drawing:
    """
    What a plan shows, in the model's own coordinates [m].

    Parameters
    ----------
    frame : (4,) tuple
        xmin, ymin, xmax, ymax of what is judged.
    buildings, proposal, replaced : list of (n, 2) float64
        Outlines from above; of what the proposal replaces, too.
    shapes : list of (rings, verdict, name); no verdict where rules only report
        Of areas and bands.
    windows : list of (x, y, azimuth in plan, verdict, name)
    lines : list of Line
    boundary : list of (n, 2) float64
        The plot.
    offsets : list of (polylines, label)
        Lines beside it.
    """

    frame: tuple[float, float, float, float]
    buildings: list[NDArray] = field(default_factory=list)
    proposal: list[NDArray] = field(default_factory=list)
    replaced: list[NDArray] = field(default_factory=list)
    shapes: list[tuple[list[NDArray], str, str]] = field(default_factory=list)
    windows: list[tuple[float, float, float, str, str]] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    boundary: list[NDArray] = field(default_factory=list)
    offsets: list[tuple[list[NDArray], str]] = field(default_factory=list)


def make_drawing(gathered: Gathered, verdicts: Sequence[RuleVerdict]) -> Drawing:
    """Collect what the plan shows."""
    shapely = need("shapely", "gis", "areas")
    worst = _find_worst(verdicts)
    boxes: list[NDArray] = []
    drawing = Drawing((0.0, 0.0, 0.0, 0.0))
    bands = sum(sunlight.subjects.kind == "band" for sunlight in gathered.list_counted())
    for sunlight in gathered.list_counted():
        subjects = sunlight.subjects
        plan = subjects.points[:, :2]
        if subjects.kind in {"areas", "band"}:
            for area in subjects.records if subjects.kind == "areas" else ():
                verdict = worst.get((subjects.kind, area.name), "")
                drawing.shapes.append((_list_rings(shapely, area.polygon), verdict, area.name))
            if subjects.kind == "areas" or bands <= _MOST_BANDS:
                drawing.lines += _trace(shapely, sunlight)
            near = plan if subjects.kind == "areas" else plan[:0]
        else:
            kind, near = subjects.kind, plan
            starts = np.searchsorted(subjects.owner, np.arange(len(subjects)))
            for k, name in enumerate(subjects.names):
                x, y = plan[starts[k]]
                toward = subjects.normals[starts[k]]
                azimuth = math.degrees(math.atan2(toward[0], toward[1]))
                is_up = not np.isfinite(toward).all() or abs(toward[2]) > 0.99
                known = worst.get((kind, name), "")
                if kind == "windows" or known:
                    spot = (float(x), float(y), math.nan if is_up else azimuth, known, name)
                    if spot not in drawing.windows:
                        drawing.windows.append(spot)
        if len(near):
            boxes += [near.min(0), near.max(0)]
    if gathered.plot is not None:
        boxes += _add_plot(shapely, gathered, drawing)
    _add_buildings(shapely, gathered, drawing, boxes)
    return drawing


def _find_worst(verdicts: Sequence[RuleVerdict]) -> dict[tuple[str, str], str]:
    """Return the worst verdict of each receiver, of rules that ask for something."""
    worst: dict[tuple[str, str], str] = {}
    for verdict in verdicts:
        for finding in verdict.findings:
            if finding.outcome.value is not None and finding.outcome.limit is None:
                continue  # it only reports
            for name in finding.members:
                key = (finding.of, name)
                if _WORST[finding.verdict] >= _WORST[worst.get(key, PASS)]:
                    worst[key] = finding.verdict
    return worst


def _list_rings(shapely: Any, polygon: Any) -> list[NDArray]:
    return [
        shapely.get_coordinates(ring)[:, :2]
        for part in shapely.get_parts(polygon)
        for ring in shapely.get_rings(part)
    ]


def group_windows(windows: Sequence[tuple[float, float, float, str, str]]) -> list[Spot]:
    """Return windows above one another as one place each, those with the worst verdict last."""
    short = shorten([entry[4] for entry in windows])
    groups: dict[tuple[int, int, int], list[tuple[float, float, float, str, str]]] = {}
    for window, name in zip(windows, short, strict=True):
        entry = (*window[:4], name)
        turn = -1 if math.isnan(entry[2]) else round(entry[2] / 5)
        groups.setdefault((round(entry[0] / _NEAR), round(entry[1] / _NEAR), turn), []).append(
            entry
        )
    spots = []
    for own in groups.values():
        x, y, azimuth, _, first = own[0]
        worst = max((entry[3] for entry in own), key=_WORST.__getitem__)
        bad = sum(entry[3] == worst for entry in own)
        label = first if len(own) == 1 else f"{first} to {own[-1][4]}"
        if bad < len(own):
            label += f": {bad} of {len(own)} {worst}"
        spots.append(Spot(x, y, azimuth, worst, label))
    return sorted(spots, key=lambda spot: _WORST[spot.verdict])


def shorten(names: list[str]) -> list[str]:
    """Return names without the words that all begin, or end, with."""
    if len(names) < 2:
        return names
    rows = [name.split(" ") for name in names]
    least = min(map(len, rows)) - 1
    head = next((k for k in range(least) if len({row[k] for row in rows}) > 1), least)
    tail = next((k for k in range(least - head) if len({row[-1 - k] for row in rows}) > 1),
                least - head)  # fmt: skip
    return [" ".join(row[head : len(row) - tail]) for row in rows]


def _count_finer(sunlight: SunlightOf) -> dict[tuple[float, str, str], NDArray[np.float64]]:
    """
    Return the hours at samples by limit, counted in steps of a minute.

    Of a rule's own steps of 5 min the lines would show each.
    """
    found = dict(sunlight.lines)
    finer: dict[str, Condition] = {}
    for condition in sunlight.line_conditions.values():
        if parse_duration(condition.every).total_seconds() > _FINE_STEP:
            finer.setdefault(repr(condition), replace(condition, every=f"{_FINE_STEP}s"))
    moments = 24 * 3600 / _FINE_STEP * len(sunlight.subjects.points)
    if len(finer) * moments * len(found) > _MOST_MOMENTS:
        return found
    for condition in finer.values():
        amount = condition.at_most if condition.at_least is None else condition.at_least
        for values in measure(condition, sunlight, has_before=False):
            key = (float(amount or 0.0), condition.measure, f"{values.date[0]}")
            if key in found and values.hours is not None:
                found[key] = values.hours
    return found


def _trace(shapely: Any, sunlight: SunlightOf) -> list[Line]:
    """Trace the lines of equal hours in each area, at the limits."""
    from contourpy import contour_generator  # noqa: PLC0415
    from scipy.interpolate import griddata  # noqa: PLC0415

    subjects, drawn = sunlight.subjects, []
    limits = [key[0] for key in sunlight.lines]
    for (limit, of, date), hours in _count_finer(sunlight).items():
        lines: list[NDArray] = []
        for k, area in enumerate(subjects.records):
            is_own = subjects.owner == k
            plan, own = subjects.points[is_own, :2], hours[is_own]
            if len(plan) < 4 or own.min() >= limit or own.max() < limit:
                continue
            low, high = plan.min(0), plan.max(0)
            step = max((high - low).max() / _FINE, 1e-6)
            x, y = (np.arange(a, b + step, step) for a, b in zip(low, high, strict=True))
            grid = griddata(plan - low, own, tuple(np.meshgrid(x - low[0], y - low[1])), "linear")
            traced = contour_generator(x, y, np.ma.masked_invalid(grid)).lines(limit)
            inside = [shapely.intersection(shapely.linestrings(line), area.polygon)
                      for line in traced if len(line) > 1]  # fmt: skip
            lines += [
                shapely.get_coordinates(part)
                for whole in inside
                for part in shapely.get_parts(whole)
                if shapely.get_type_id(part) == 1
            ]
        if lines:
            day = name_date(dt.date.fromisoformat(date))
            short = tell_hours(limit) + (f", {day}" if limits.count(limit) > 1 else "")
            label = f"{tell_hours(limit)} of {MEASURES[of].words}, {day}"
            drawn.append(Line(lines, label, short))
    return drawn


def _add_plot(shapely: Any, gathered: Gathered, drawing: Drawing) -> list[NDArray]:
    plot = gathered.find_plot()
    drawing.boundary = _list_rings(shapely, plot)
    reach = 0.0
    moved = gathered.list_boundaries()
    for boundary in moved:
        drawing.offsets.append((_list_rings(shapely, boundary), "boundary moved"))
    counted = moved[0] if len(moved) == 1 else plot
    for distance in (5.0, 10.0):
        ring = shapely.buffer(counted, distance, quad_segs=16)
        drawing.offsets.append((_list_rings(shapely, ring), f"{distance:g} m"))
        reach = distance
    low, high = np.reshape(shapely.bounds(plot), (2, 2))
    return [low - 2 * reach, high + 2 * reach]


def _add_buildings(
    shapely: Any, gathered: Gathered, drawing: Drawing, boxes: list[NDArray]
) -> None:
    """Add outlines of the parts from above, and settle the frame."""
    model = gathered.model
    if not boxes:
        boxes += [corner[:2] for corner in gathered.find_model_bounds()]
    if model.proposed:
        boxes += [corner[:2] for corner in gathered.find_bounds()]
    corners = np.array(boxes)
    low, high = corners.min(0), corners.max(0)
    margin = max(_LEAST_MARGIN, _MARGIN * float((high - low).max()))
    low, high = low - margin, high + margin
    drawing.frame = (*low.tolist(), *high.tolist())
    spread = 0.6 * (high - low).max()  # a sheet is longer than the frame
    near = gathered.find_near(low - spread, high + spread)
    scene, standing = near.whole, len(near.parts)
    proposed = {k for k, part in enumerate(scene.parts) if any(map(part.matches, model.proposed))}
    bounds = np.array([part.bounds for part in scene.parts]).reshape(-1, 2, 3) + scene.origin
    meets = ((bounds[:, 1, :2] >= low - spread) & (bounds[:, 0, :2] <= high + spread)).all(1)
    labels, left = scene.labels(), _MOST_TRIANGLES
    for name in dict.fromkeys(labels[k] for k in np.flatnonzero(meets)):
        parts = [k for k in np.flatnonzero(meets).tolist() if labels[k] == name]
        if any(scene.parts[k].kind in TERRAIN for k in parts):
            continue
        soup = scene.triangles(parts)
        left -= len(soup.faces)
        if left < 0:
            break
        plan = soup.vertices[soup.faces][..., :2] + scene.origin[:2]
        u, v = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
        lies = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > 1e-6
        if not lies.any():
            continue
        whole = shapely.union_all(shapely.polygons(plan[lies]), grid_size=1e-3)
        rings = [
            shapely.get_coordinates(shapely.get_exterior_ring(part))
            for part in shapely.get_parts(whole)
            if shapely.get_type_id(part) == 3
        ]
        if parts[0] >= standing:
            drawing.replaced += rings
        else:
            (drawing.proposal if proposed & {*parts} else drawing.buildings).extend(rings)
