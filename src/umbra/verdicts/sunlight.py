"""Sun at each moment on the samples of what is judged: before, after, or by the proposal alone."""

import datetime as dt
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Period
from umbra.rules.record import Condition
from umbra.scene import Mesh, Part, Scene, make_scene
from umbra.study import run
from umbra.study.accumulators.step_masks import Masks
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.sun import Site
from umbra.verdicts.dates import settle_dates
from umbra.verdicts.moments import find_sun_windows, follows_clock
from umbra.verdicts.subjects import Subjects

__all__ = ["Model", "SunDay", "SunlightOf"]

_DEEP = 1000.0  # below all that is judged [m]


@dataclass(frozen=True, eq=False, kw_only=True)
class Model:
    """
    The model that is judged, and how it casts shadows.

    Parameters
    ----------
    scene : Scene
        Before the proposal ``scene.whole`` casts, with what it replaces.
    site : Site
    year : int
        Of dates without one.
    options : StudyOptions
        Casters, canopies, ground, device, threads and the probability of sunshine are read.
    proposed : tuple of str
        Patterns of the proposal's parts.
    """

    scene: Scene
    site: Site
    year: int
    options: StudyOptions
    proposed: tuple[str, ...] = ()

    def choose_casters(self, which: str) -> dict[str, Any]:
        """Return the study's options of casters: 'after', 'before', 'proposed'."""
        options = self.options
        if which == "before":
            return {"cast": options.cast, "no_cast": (*options.no_cast, *self.proposed)}
        if which == "proposed" and self.proposed:
            return {"cast": self.proposed, "no_cast": options.no_cast}
        return {"cast": options.cast, "no_cast": options.no_cast}


@dataclass(frozen=True, eq=False)
class SunDay:
    """
    The sun on samples over one date.

    Parameters
    ----------
    date : datetime.date
    lit : (s, n) bool
        Whether each sample is in the sun at each step with the sun up.
    hours : (s,) float64
        Length of each step [h].
    starts, ends : (s,) int64
        UTC [us since 1970].
    altitudes : (s,) float64
        Of the sun [degrees].
    directions : (s, 3) float64
        Toward the sun, in the model's axes.
    """

    date: dt.date
    lit: NDArray[np.bool_]
    hours: NDArray[np.float64]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    altitudes: NDArray[np.float64]
    directions: NDArray[np.float64]

    def pick(self, which: NDArray[np.bool_]) -> "SunDay":
        """Return some of the steps."""
        return replace(
            self,
            lit=self.lit[which],
            **{
                name: getattr(self, name)[which]
                for name in ("hours", "starts", "ends", "altitudes", "directions")
            },
        )

    def trim(self, first: int, last: int) -> "SunDay":
        """Return the steps between two instants [us since 1970], those at the ends cut."""
        steps = self.pick((self.ends > first) & (self.starts < last))
        starts, ends = np.maximum(steps.starts, first), np.minimum(steps.ends, last)
        return replace(steps, starts=starts, ends=ends, hours=(ends - starts) / 3.6e9)


@dataclass(eq=False)
class SunlightOf:
    """
    Sunlight and sky of some receivers, counted once for each time that rules ask for.

    Parameters
    ----------
    model : Model
    subjects : Subjects
    lines : dict
        Of a limit in hours, its measure and a date, the hours of each sample of areas, (n,) [h].
    line_conditions : dict
        The conditions of these limits.
    """

    model: Model
    subjects: Subjects
    lines: dict[tuple[float, str, str], NDArray[np.float64]] = field(default_factory=dict)
    line_conditions: dict[tuple[float, str, str], Condition] = field(default_factory=dict)
    _studies: dict[Any, Study] = field(default_factory=dict)

    def list_days(self, condition: Condition, which: str) -> Iterator[SunDay]:
        """
        Yield the dates of a condition.

        Parameters
        ----------
        condition : Condition
        which : {'after', 'before', 'proposed'}
            Casters of the shadows.
        """
        study = self._count(condition, which)
        period, masks = study.period, study.masks
        assert masks is not None
        windows = None
        if not follows_clock(condition):
            windows = find_sun_windows(condition, period.days, self.model.site)
        for day, date in enumerate(period.days):
            whole = _cut_day(period, masks, day, date)
            whole = replace(whole, lit=whole.lit & ~self.subjects.find_framed(whole.directions))
            yield whole if windows is None else whole.trim(*windows[day])

    def keep_line(self, condition: Condition, values: Sequence[Any]) -> None:
        """Keep the hours at the samples of areas, on which a drawing rules the limit's line."""
        amount = condition.at_most if condition.at_least is None else condition.at_least
        for value in values:
            has_line = (
                self.subjects.kind in {"areas", "band"} and value.hours is not None and amount
            )
            if has_line and value.date and value.date[0] is not None:
                key = (float(amount or 0.0), condition.measure, f"{value.date[0]}")
                self.lines[key], self.line_conditions[key] = value.hours, condition

    def _count(self, condition: Condition, which: str) -> Study:
        # Hours by the sun or another clock are cut out of whole days, which rules share.
        hours = (condition.start, condition.end) if follows_clock(condition) else ("00:00", "24:00")
        time = {
            "date": settle_dates(condition, self.model.year, self.model.site.zone),
            "start": hours[0],
            "end": hours[1],
            "every": condition.every,
        }
        key = (which, *map(str, time.values()))
        if key not in self._studies:
            self._studies[key] = self._run(which, masks=True, by_day=False, **time)
        return self._studies[key]

    def measure_sky(self, measure: str, which: str) -> NDArray[np.float64]:
        """Return a measure of the sky at each sample, (n,)."""
        key = (which, measure)
        if key not in self._studies:
            variable = "probable_sun_hours" if "probable" in measure else measure
            exact = (
                {"exact": True}
                if variable.startswith("sky") and not self.model.options.canopy
                else {}
            )
            study = self._run(
                which, measure=[variable], sunshine=self.model.options.sunshine, **exact
            )
            for name in (measure, *(quantity.name for quantity in study.quantities)):
                self._studies[which, name] = study
        return np.asarray(self._studies[key].more[measure][1], np.float64)

    def keep_options(self, which: str) -> dict[str, Any]:
        """Return the model's options that hold for a study of these casters."""
        options = self.model.options
        settings = {
            name: getattr(options, name)
            for name in ("canopy", "transmissivity", "leaf_on", "ground", "device", "threads",
                         "refraction")
        }  # fmt: skip
        if which != "proposed":  # what the proposal alone shades, it shades without land, too
            settings["horizon"] = options.horizon
        return settings

    def _run(self, which: str, **more: Any) -> Study:
        model, given = self.model, self.subjects
        normals = np.where(np.isfinite(given.normals), given.normals, [0.0, 0.0, 1.0])
        settings, casters = self.keep_options(which), model.choose_casters(which)
        scene = model.scene.whole if which == "before" else model.scene
        if not scene.select(casters["cast"], casters["no_cast"]):
            scene, casters, settings = _make_empty(given.points), {}, {
                name: settings[name] for name in ("threads", "horizon") if name in settings
            }  # fmt: skip
        points = np.hstack([given.points, normals])
        study_options = StudyOptions(
            receivers="points", points=points, **settings, **casters, **more
        )
        return run(scene, model.site, study_options)


def _make_empty(points: NDArray[np.float64]) -> Scene:
    """Return a scene in which nothing shades some points: a study needs a caster."""
    low = points.min(0) - (0.0, 0.0, _DEEP)
    corners = low + np.array([(0.0, 0.0, 0.0), (1e-3, 0.0, 0.0), (0.0, 1e-3, 0.0)])
    return make_scene([Part("nothing", "", Mesh(corners, np.array([[0, 1, 2]], np.int32)))])


def _cut_day(period: Period, masks: Masks, day: int, date: dt.date) -> SunDay:
    steps = np.flatnonzero((period.day_of_step == day) & period.sun.is_up)
    lit = np.zeros((len(steps), *masks.shape[1:]), np.bool_)
    for row, step in enumerate(steps):
        lit[row] = masks[int(step)] == 0
    return SunDay(
        date, lit, period.hours[steps], period.starts[steps], period.ends[steps],
        period.sun.altitude[steps], period.sun.direction[steps],
    )  # fmt: skip


def check_year(year: int) -> int:
    """Return a year of which the sun is known."""
    if not 1950 <= year <= 2100:
        msg = f"year {year} is far from ours; give one of 1950 to 2100"
        raise InputError(msg, option="year")
    return year
