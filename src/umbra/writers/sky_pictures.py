"""Pictures of the sky above a place: obstructions by name, paths of the sun, droop lines."""

import datetime as dt
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from umbra.errors import show_count
from umbra.sky.free_sky import ExactSky
from umbra.sky.projections import Projection, find_projection
from umbra.sun import find_sun
from umbra.writers.paper import (
    INK,
    QUIET,
    RULE,
    SMALL,
    SUBTITLE,
    TITLE,
    Leaf,
    Paper,
    PaperPicture,
    wrap,
)
from umbra.writers.sky_shapes import bend, join_bands, split_at_cut

__all__ = ["draw_sky"]

_COLORS = (
    "#5b7a9d", "#c98f4e", "#6f9a6b", "#a56a7a", "#8d7db5", "#b8a24a", "#4f9a98", "#b5715a",
    "#7b8794", "#96a05f",
)  # fmt: skip
_OTHER = "#b4b4ba"
_SKY, _GRID = "#eef4fa", "#c3ccd6"
_BEHIND = "#dcdce0"
_SUN, _HIDDEN, _SOLAR = "#d9480f", "#f0b89c", "#6b6b76"
_NAMED = 10  # obstructions in colours of their own
_MARGIN, _ROUND, _LEGEND = 0.55, 5.4, 2.35  # [inch]
_WIDE, _HIGH = 7.2, 4.1  # of a Waldram diagram [inch]
_JUMP = 1.5  # between neighbours of a path, over the cut of a diagram [inch]
_LOW = 0.02  # sine of an altitude below which no hour is named
_SHOWN = 0.0005  # least share that is printed
_FLAT = 1e-4  # tilt that is none [degrees]
_LINES = 3  # of a long name
_LINE = 0.15  # between lines of a name [inch]
_LETTER = 0.068  # width of one, on average [inch]
_CLEAR = 0.1  # between words of an axis [inch]
_SOLAR_TILTS = np.radians(np.linspace(-23.44, 23.44, 25))


@dataclass(frozen=True, eq=False)
class _Chart(Paper):
    """Paper with a projection on it: places of the sky in inches."""

    projection: Projection
    start: NDArray[np.float64]
    scale: NDArray[np.float64]

    @classmethod
    def at(
        cls, leaf: Leaf, projection: Projection, corner: tuple[float, float],
        size: tuple[float, float],
    ) -> "_Chart":  # fmt: skip
        """Place a projection's lower left corner on paper, with its size [inch]."""
        low_x, high_x, low_y, high_y = projection.box
        scale = np.array([size[0] / (high_x - low_x), size[1] / (high_y - low_y)])
        return cls(leaf, projection, np.array(corner) - scale * [low_x, low_y], scale)

    def spot(self, directions: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.start + self.scale * self.projection.project(directions)

    def spot_angles(
        self, azimuth: NDArray[np.float64], altitude: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        return self.start + self.scale * self.projection.place(azimuth, altitude)


def draw_sky(view: ExactSky, name: str, dates: Sequence[dt.date]) -> PaperPicture:
    """
    Draw the sky of a view in a projection by name, with the sun's paths on some dates.

    Raises InputError for an unknown projection, and for dates where the site is not known.
    """
    north = 0.0 if view.site is None else view.site.true_north
    projection = find_projection(name, view.normal, north)
    if dates:
        view.need_site()
    size = (_ROUND, _ROUND) if projection.is_round else (_WIDE, _HIGH)
    width = 2 * _MARGIN + (size[0] + _LEGEND if projection.is_round else size[0])
    facts = _tell_facts(view, projection, dates)
    shares = list(view.blocked_by.items())
    rows = min(len(shares), _NAMED) + (len(shares) > _NAMED)
    foot = 0.62 if projection.is_round else 0.7 + 0.19 * ((rows + 2) // 2)
    lines = [line for fact in facts for line in wrap(fact, SMALL, width - 2 * _MARGIN)]
    height = foot + size[1] + 0.35 + 0.16 * len(lines) + 0.55
    leaf = Leaf(width, height)
    chart = _Chart.at(leaf, projection, (_MARGIN, foot), size)
    top = height - 0.42
    chart.write(_MARGIN, top, f"Sky component {view.sky_component:.2f} %", TITLE, weight="bold")
    chart.write(
        width - _MARGIN, top, f"sky view factor {view.sky_view_factor:.4f}", SUBTITLE, ha="right"
    )
    for k, line in enumerate(lines):
        chart.write(_MARGIN, top - 0.2 - 0.16 * k, line, color=QUIET)
    colors = {key: _COLORS[k] for k, (key, _) in enumerate(shares[:_NAMED])}
    _draw_obstructions(chart, view, colors)
    _draw_grid(chart)
    if dates:
        _draw_suns(chart, view, dates)
    if projection.is_round:
        _list_parts(chart, shares, colors, _MARGIN + size[0] + 0.35, foot + size[1] - 0.1, 1)
    else:
        _list_parts(chart, shares, colors, _MARGIN, foot - 0.42, 2)
    return PaperPicture(chart)


def _tell_facts(view: ExactSky, projection: Projection, dates: Sequence[dt.date]) -> Iterator[str]:
    x, y, z = view.point
    tilt = np.degrees(np.arccos(np.clip(view.normal[2], -1, 1)))
    plane = "level plane"
    if tilt > _FLAT:
        facing = np.degrees(np.arctan2(*view.normal[:2]) - projection.north) % 360
        plane = f"plane facing {facing:.1f}°, {tilt:.0f}° from level"
    kind = {
        "stereographic": "stereographic", "equidistant": "equidistant",
        "orthographic": "orthographic", "waldram": "Waldram diagram: equal areas give a "
        f"{'level' if projection.facing is None else 'vertical'} plane equal light",
    }[projection.name]  # fmt: skip
    yield f"At {x:.2f}, {y:.2f}, {z:.2f} m · {plane} · {kind}"
    if projection.is_round:
        up = "true north" if view.site is not None else "the model's y axis"
        yield f"As on a map: {up} is up, east on the right; altitudes every 10°"
    elif projection.facing is not None:
        yield (
            "Across: azimuth from the plane's normal; up: altitude. Droop lines: level edges "
            "parallel to the plane, at 10° to 80° straight ahead"
        )
    if dates and view.site is not None:
        yield (
            f"Sun at {view.site.show()} · orange: by clock ({view.site.zone}); grey, broken: by "
            "solar time; pale where the sun is hidden"
        )


def _draw_obstructions(chart: _Chart, view: ExactSky, colors: dict[str, str]) -> None:
    """Fill the sky, what objects take of it, and draw the outlines of what is free."""
    turn = np.radians(np.arange(0.0, 361.0, 1.0))
    projection = chart.projection
    if projection.is_round:
        edge = chart.spot_angles(turn, np.zeros_like(turn))
        chart.fill([edge], _SKY, RULE, 0.8)
    else:
        low_x, high_x, low_y, high_y = projection.box
        box = np.array([[low_x, low_y], [high_x, low_y], [high_x, high_y], [low_x, high_y]])
        chart.fill([chart.start + chart.scale * box], _SKY, RULE, 0.8)
    by_color: dict[str, list] = {}
    ends = None if projection.is_round or projection.facing is not None else _find_ends(chart)
    for owner, shape in join_bands(*view.trace_bands(), chart.spot, ends):
        by_color.setdefault(colors.get(view.names[owner], _OTHER), []).append(shape)
    for color, shapes in by_color.items():
        chart.fill(shapes, color, color, 0.25)
    if projection.is_round or projection.facing is None:
        _hatch_behind(chart, view)
    for outline in view.outlines:
        points = outline.directions
        lines = []
        for k, part in enumerate(outline.part):
            arc = chart.spot(bend(points[k], points[(k + 1) % len(points)]))
            if part is not None and np.isfinite(arc).all():
                lines += split_at_cut(arc, _JUMP)
        chart.rule(lines, INK, 0.7)


def _hatch_behind(chart: _Chart, view: ExactSky) -> None:
    """Shade what lies behind the plane, which is not level."""
    n = view.normal
    if np.hypot(n[0], n[1]) <= np.radians(_FLAT):
        return
    if not chart.projection.is_round:
        turn = np.radians(np.arange(0.5, 360.0)) + chart.projection.north
        edge = np.arctan2(-(n[0] * np.sin(turn) + n[1] * np.cos(turn)), n[2])
        low = chart.spot_angles(turn, np.zeros_like(turn))
        high = chart.spot_angles(turn, np.maximum(edge, 0.0))
        chart.fill([np.concatenate([low, high[::-1]])], _BEHIND, RULE, 0.5)
        return
    side = np.array([n[1], -n[0], 0.0]) / np.hypot(n[0], n[1])
    up = np.cross(n, side)
    up = up if up[2] >= 0 else -up
    angle = np.linspace(0, np.pi, 121)[:, None]
    plane = side * np.cos(angle) + up * np.sin(angle)
    back = np.array([-n[0], -n[1], 0.0]) / np.hypot(n[0], n[1])
    around = -side * np.cos(angle) + back * np.sin(angle)
    chart.fill([chart.spot(np.concatenate([plane, around]))], _BEHIND, RULE, 0.5)


def _find_ends(chart: _Chart) -> tuple[float, float]:
    """Return the left and right end of a diagram [inch]."""
    low, high = chart.projection.box[:2]
    return tuple((chart.start[0] + chart.scale[0] * np.array([low, high])).tolist())


def _draw_grid(chart: _Chart) -> None:
    projection = chart.projection
    north = projection.north
    if projection.is_round:
        turn = np.radians(np.arange(0.0, 361.0, 2.0))
        circles = [chart.spot_angles(turn, np.full_like(turn, np.radians(a)))
                   for a in range(10, 90, 10)]  # fmt: skip
        spokes = [
            chart.spot_angles(np.full(2, np.radians(a) + north), np.radians([0.0, 80.0]))
            for a in range(0, 360, 15)
        ]
        chart.rule(circles + spokes, _GRID, 0.4)
        for altitude in (30, 60):
            x, y = chart.spot_angles(np.array(north + np.pi), np.array(np.radians(altitude)))
            chart.write(x + 0.03, y + 0.03, f"{altitude}°", 6.5, color=QUIET, halo="white")
        words = {0: "N", 45: "NE", 90: "E", 135: "SE", 180: "S", 225: "SW", 270: "W", 315: "NW"}
        middle = chart.start
        for azimuth in range(0, 360, 15):
            edge = chart.spot_angles(np.array(np.radians(azimuth) + north), np.array(0.0))
            x, y = edge + 0.17 * (edge - middle) / np.linalg.norm(edge - middle)
            word = words.get(azimuth, f"{azimuth}°")
            weight = "bold" if azimuth % 90 == 0 else "normal"
            chart.write(x, y, word, 8 if azimuth % 45 == 0 else 6.5, ha="center", va="center",
                        weight=weight, color=INK if azimuth % 45 == 0 else QUIET)  # fmt: skip
        return
    facing = projection.facing
    angle = np.radians(np.linspace(-90, 90, 91))
    if facing is not None:
        droop = [
            chart.spot_angles(angle + facing, np.arctan(np.tan(np.radians(a)) * np.cos(angle)))
            for a in range(10, 90, 10)
        ]
        chart.rule(droop, _GRID, 0.6)
        marks = [(a, f"{a:+d}°" if a else "0°", facing) for a in (-90, *range(-60, 61, 15), 90)]
    else:
        marks = [(a, f"{a}°", north) for a in range(0, 360, 30)]
    for azimuth, word, zero in marks:
        turn = np.radians(np.clip(azimuth, -89.999, 359.999)) + zero
        line = chart.spot_angles(np.full(2, turn), np.array([0.0, np.pi / 2]))
        chart.rule([line], _GRID, 0.4)
        chart.write(line[0, 0], line[0, 1] - 0.15, word, 6.5, ha="center", color=QUIET)
    last = -np.inf
    for altitude in (0, 10, 20, 30, 40, 50, 60, 70, 90):
        x, y = chart.spot_angles(np.array(angle[1] + (facing or 0)), np.radians(altitude * 1.0))
        if y - last < _CLEAR:
            continue
        last = y
        chart.write(_MARGIN - 0.05, y, f"{altitude}°", 6.5, ha="right", va="center", color=QUIET)


def _draw_suns(chart: _Chart, view: ExactSky, dates: Sequence[dt.date]) -> None:
    """Draw the sun's paths, with hours by the clock and by solar time."""
    site = view.need_site()
    zone = ZoneInfo(site.zone)
    year = dates[0].year
    days = [dt.date(year, 1, 1) + dt.timedelta(days=d) for d in range(0, 366, 5)]
    for hour in range(24):
        times = [dt.datetime.combine(day, dt.time(hour), zone) for day in days]
        toward = find_sun(site, [when.astimezone(dt.UTC) for when in times]).direction
        # Where the clock is changed the line goes on at another place.
        shift = [when.utcoffset() != times[0].utcoffset() for when in times]
        cut = np.flatnonzero(np.diff(shift)) + 1
        for piece in np.split(np.arange(len(times)), cut):
            chart.rule(list(_list_lines(chart, toward[piece])), _SUN, 0.35)
    for lines in _list_solar(chart, view):
        chart.rule([lines], _SOLAR, 0.5).set_linestyle((0, (3, 3)))
    for day in dates:
        start = dt.datetime.combine(day, dt.time(), zone).astimezone(dt.UTC)
        times = [start + dt.timedelta(minutes=4 * k) for k in range(361)]
        toward = find_sun(site, times).direction
        hit = view.name_hits(toward)
        is_free = np.array([part is None for part in hit]) & (toward @ view.normal > 0)
        chart.rule(list(_list_lines(chart, toward)), _HIDDEN, 1.6)
        chart.rule(list(_list_lines(chart, toward, is_free)), _SUN, 1.6)
        _mark_hours(chart, view, day)


def _list_lines(
    chart: _Chart, toward: NDArray[np.float64], is_shown: NDArray[np.bool_] | None = None
) -> Iterator[NDArray[np.float64]]:
    """Yield the pieces of a path above the horizon, where ``is_shown``, without jumps."""
    spots = chart.spot(toward)
    is_there = (toward[:, 2] > 0) & np.isfinite(spots).all(1)
    if is_shown is not None:
        is_there &= is_shown
    apart = np.linalg.norm(np.diff(spots, axis=0), axis=1) > _JUMP
    cut = np.flatnonzero((np.diff(is_there.astype(int)) != 0) | apart) + 1
    for piece in np.split(np.arange(len(toward)), cut):
        if len(piece) > 1 and is_there[piece[0]]:
            yield spots[piece]


def _list_solar(chart: _Chart, view: ExactSky) -> Iterator[NDArray[np.float64]]:
    """Yield a line for each hour of solar time, from one solstice to the other."""
    site = view.need_site()
    latitude, north = np.radians(site.latitude), np.radians(site.true_north)
    for hour in range(24):
        turn = np.radians(15.0 * (hour - 12))
        up = np.sin(latitude) * np.sin(_SOLAR_TILTS)
        up = up + np.cos(latitude) * np.cos(_SOLAR_TILTS) * np.cos(turn)
        east = -np.cos(_SOLAR_TILTS) * np.sin(turn)
        ahead = np.cos(latitude) * np.sin(_SOLAR_TILTS)
        ahead = ahead - np.sin(latitude) * np.cos(_SOLAR_TILTS) * np.cos(turn)
        azimuth = np.arctan2(east, ahead) + north
        level = np.hypot(east, ahead)
        toward = np.stack([level * np.sin(azimuth), level * np.cos(azimuth), up], -1)
        yield from _list_lines(chart, toward)


def _mark_hours(chart: _Chart, view: ExactSky, day: dt.date) -> None:
    site = view.need_site()
    zone = ZoneInfo(site.zone)
    hours = [dt.datetime.combine(day, dt.time(hour), zone) for hour in range(24)]
    toward = find_sun(site, [when.astimezone(dt.UTC) for when in hours]).direction
    spots = chart.spot(toward)
    named = False

    def inside(x: float) -> bool:
        return chart.projection.is_round or abs(x - chart.start[0]) < 0.97 * chart.scale[0]

    for hour, (x, y) in enumerate(spots):
        if toward[hour, 2] <= _LOW or not np.isfinite(x) or not inside(x):
            continue
        dot = 0.028 * np.column_stack([np.cos(np.arange(12) / 1.91), np.sin(np.arange(12) / 1.91)])
        chart.fill([dot + (x, y)], _SUN, "white", 0.3)
        chart.write(x + 0.05, y + 0.04, f"{hour}", 6.5, halo="white")
        if not named:
            low = y - 0.12 if chart.projection.is_round else max(y - 0.12, chart.start[1] + 0.03)
            chart.write(x + 0.05, low, f"{day.day} {day:%b}", 7, weight="bold", halo="white")
            named = True


def _list_parts(
    chart: _Chart, shares: Sequence[tuple[str, float]], colors: dict[str, str], x: float, y: float,
    columns: int,
) -> None:  # fmt: skip
    """List what obstructs, with its share of the plane's open sky component."""
    rows = [(name, share, colors[name]) for name, share in shares[:_NAMED]]
    rest = shares[_NAMED:]
    if rest:
        rows.append(
            (
                show_count(len(rest), "other"),
                sum(share for _, share in rest),
                _OTHER,
            )
        )
    chart.write(x, y, "Open sky component taken by", SMALL, weight="bold")
    wide = (_WIDE if columns == 2 else _LEGEND) / columns
    room = int((wide - 0.72) / _LETTER)
    at = y - 0.2
    for k, (name, share, color) in enumerate(rows):
        left = x + (k % columns) * wide
        if columns > 1:
            at = y - 0.2 - 0.19 * (k // columns)
        box = np.array([[0, -0.01], [0.14, -0.01], [0.14, 0.1], [0, 0.1]]) + (left, at)
        chart.fill([box], color, INK, 0.3)
        shown = f"{100 * share:.1f} %" if share >= _SHOWN else "< 0.1 %"
        chart.write(left + 0.65, at, shown, SMALL, ha="right")
        for line in _cut_name(name, room, 1 if columns > 1 else _LINES):
            chart.write(left + 0.72, at, line, SMALL)
            at -= _LINE
        at -= 0.19 - _LINE


def _cut_name(name: str, room: int, most: int) -> list[str]:
    """Cut a name into lines of ``room`` letters, at most so many; the middle is left out."""
    if len(name) > room * most:
        letters = room * most - 1
        name = name[: letters - letters // 2] + "…" + name[len(name) - letters // 2 :]
    return [name[k : k + room] for k in range(0, len(name), room)] or [""]
