"""The sky above a place: its outlines, what they integrate to, and the sun in them."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.sky.casters import SkyCasters
from umbra.sky.closed_outlines import Outline, trace_outlines
from umbra.sky.gather import SeenFaces
from umbra.sky.heights import find_heights
from umbra.sky.nearest import find_hits
from umbra.sky.view_factors import find_seen, measure_sky, trace_bands, trace_free_sky
from umbra.sun import Site, find_sun, parse_dates
from umbra.sun.date_words import Date

__all__ = ["ExactSky", "SunSpell"]

_LOOK = 20_000_000  # between looks at the sun: shorter gaps are not found [us]
_CLOSE = 250_000  # [us]
_SAME = 1e-6  # [degrees]
_MOST = 36_000  # azimuths of a horizon
_LEVEL = np.array([0.0, 0.0, 1.0])


class SunSpell(NamedTuple):
    """
    Sun without a break, local times.

    ``out_of`` and ``behind`` name what the sun comes out of and goes behind: an object, "horizon",
    or "own plane".
    """

    date: dt.date
    start: dt.datetime
    end: dt.datetime
    out_of: str
    behind: str


@dataclass(frozen=True, eq=False)
class ExactSky:
    """
    The upper sky before a plane through a point.

    Parameters
    ----------
    casters : SkyCasters
    names : list of str
        Of the objects.
    local : (3,) float64
        The point in the casters' frame [m].
    normal : (3,) float64
    point : (3,) float64
        In the model's own coordinates [m].
    site : Site, optional
    """

    casters: SkyCasters
    names: list[str]
    local: NDArray[np.float64]
    normal: NDArray[np.float64]
    point: NDArray[np.float64]
    site: Site | None = None

    @cached_property
    def _sums(self) -> Any:
        return measure_sky(
            self.casters, self.local[None], self.normal[None], 1, objects=len(self.names)
        )

    @property
    def sky_view_factor(self) -> float:
        """Share of the plane's view that is free sky: 1 for an open level plane."""
        return float(self._sums.sky_view_factor[0])

    @property
    def sky_component(self) -> float:
        """Light of the CIE overcast sky on the plane, of that on an open level plane [%]."""
        return float(self._sums.sky_component[0])

    @property
    def blocked_by(self) -> dict[str, float]:
        """Share of the open sky component of this plane that each object takes, largest first."""
        shares = self._sums.blocked_by[0]
        order = np.argsort(-shares, kind="stable")
        return {self.names[k]: float(shares[k]) for k in order if shares[k] > 0}

    @cached_property
    def outlines(self) -> tuple[Outline, ...]:
        """Closed outlines of the free sky."""
        _, pieces = trace_free_sky(self.casters, self.local, self.normal)
        return trace_outlines(pieces, self.name_hits)

    @cached_property
    def _seen(self) -> SeenFaces:
        """Faces before the plane."""
        return find_seen(self.casters, self.local, self.normal)

    def trace_bands(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what each object takes, as bands between meridians; see ``points.trace_bands``."""
        return trace_bands(self.casters, self.local, self.normal, len(self.names))

    @cached_property
    def _around(self) -> SeenFaces:
        """Faces of the whole turn, behind the plane too."""
        return find_seen(self.casters, self.local, _LEVEL)

    def name_hits(self, directions: NDArray[np.float64]) -> list[str | None]:
        """Name what obstructs the sky in each direction (n, 3); None where nothing does."""
        hits = find_hits(self._seen, self.casters, np.ascontiguousarray(directions))
        return [self.names[hit] if hit >= 0 else None for hit in hits]

    def horizon(self, step: float = 1.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """
        Find the altitude up to which everything is obstructed.

        Parameters
        ----------
        step : float
            Between azimuths, which divides 360 [degrees].

        Returns
        -------
        azimuth : (n,) float64
            Clockwise from true north, from 0 on; without a site, from the model's y axis [degrees].
        elevation : (n,) float64
            Of the lowest free sky, 90 where there is none; the plane itself does not count
            [degrees].

        Raises
        ------
        InputError
            If the step does not divide the turn.
        """
        count = round(360.0 / step) if np.isfinite(step) and step > 0 else 0
        if not 1 <= count <= _MOST or abs(count * step - 360.0) > _SAME:
            msg = f"a step of {step:g} degrees does not divide the turn of 360; give 1, or 7.5"
            raise InputError(msg, step=step)
        azimuth = np.arange(count) * 360.0 / count
        north = 0.0 if self.site is None else self.site.true_north
        angle = np.radians(azimuth + north)
        toward = np.column_stack([np.sin(angle), np.cos(angle)])
        return azimuth, np.degrees(find_heights(self._around, toward))

    def sun(self, date: Date | Sequence[Date]) -> list[SunSpell]:
        """
        Find when the sun's middle is seen before the plane, to a second.

        Parameters
        ----------
        date : str, date, or several
            Local dates, such as ``2026-03-21``.

        Raises
        ------
        InputError
            If the site is not known, or a date is wrong.
        """
        site = self.need_site()
        return [spell for day in parse_dates(date) for spell in self._find_spells(day, site)]

    def need_site(self) -> Site:
        """Return the site; InputError if it is not known."""
        if self.site is None:
            msg = "the sun needs a site, and the file does not say it; give site=Site(48.2, 16.37)"
            raise InputError(msg)
        return self.site

    def _find_spells(self, day: dt.date, site: Site) -> list[SunSpell]:
        zone = ZoneInfo(site.zone)
        start, end = (
            dt.datetime.combine(day + dt.timedelta(days=k), dt.time(), zone).timestamp()
            for k in range(2)
        )
        times = np.arange(round(start * 1e6), round(end * 1e6) + 1, _LOOK)
        state = self._find_states(times, site)
        change = np.flatnonzero((state[1:] == _FREE) != (state[:-1] == _FREE))
        low, high = times[change], times[change + 1]
        was_free = state[change] == _FREE
        while len(change) and int((high - low).max()) > _CLOSE:
            middle = (low + high) // 2
            is_low = (self._find_states(middle, site) == _FREE) == was_free
            low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
        bounds = [(int(b), self._tell(int(s))) for b, s in zip(
            (low + high) // 2,
            self._find_states(np.where(was_free, high, low), site), strict=True,
        )]  # fmt: skip
        if len(state) and state[0] == _FREE:
            bounds.insert(0, (int(times[0]), "midnight"))
        if len(bounds) % 2:
            bounds.append((int(times[-1]), "midnight"))

        def show(when: int) -> dt.datetime:
            utc = dt.datetime.fromtimestamp(round(when / 1e6), dt.UTC)
            return utc.astimezone(zone)

        pairs = zip(bounds[::2], bounds[1::2], strict=True)
        return [SunSpell(day, show(a), show(b), out, into) for (a, out), (b, into) in pairs]

    def _find_states(self, times: NDArray[np.int64], site: Site) -> NDArray[np.int64]:
        """Return the object that hides the sun at each time [us], or one of the codes below."""
        toward = find_sun(site, times.view("datetime64[us]")).direction
        state = np.full(len(times), _BELOW)
        up = np.flatnonzero(toward[:, 2] > 0)
        ahead = toward[up] @ self.normal > 0
        state[up[~ahead]] = _OWN
        which = up[ahead]
        state[which] = find_hits(self._seen, self.casters, np.ascontiguousarray(toward[which]))
        return state

    def _tell(self, state: int) -> str:
        return {_BELOW: "horizon", _OWN: "own plane", _FREE: "sky"}.get(state) or self.names[state]

    def sum_up(self, dates: Date | Sequence[Date] = ()) -> dict[str, Any]:
        """Return the results as plain values, for JSON."""
        return {
            "point": self.point.tolist(),
            "normal": self.normal.tolist(),
            "sky_view_factor": self.sky_view_factor,
            "sky_component": self.sky_component,
            "blocked_by": self.blocked_by,
            "sun": [
                {"date": spell.date.isoformat(), "from": f"{spell.start:%H:%M:%S}",
                 "to": f"{spell.end:%H:%M:%S}", "out_of": spell.out_of, "behind": spell.behind}
                for spell in (self.sun(dates) if dates else ())
            ],
            "outlines": [
                {"part": list(outline.part), "directions": outline.directions.tolist()}
                for outline in self.outlines
            ],
        }  # fmt: skip


_FREE, _BELOW, _OWN = -1, -2, -3
