"""Lay out what a requirement judges: areas, windows, bands around a plot, and places."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.receivers import find_kind
from umbra.receivers.window_search import count_windows
from umbra.rules.record import Requirement, list_conditions
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.study.settled import settle_ground
from umbra.study.setup import Setup
from umbra.verdicts.receiver_remarks import tell_buried, tell_far, tell_off_plot
from umbra.verdicts.subjects import Subjects, of_points
from umbra.verdicts.sunlight import Model, SunlightOf

__all__ = ["Gathered", "Lacking"]

NEEDS = {
    "areas": "there are no areas; give gardens or open spaces with areas=",
    "windows": "there are no windows; give a table with windows=, or a model that has them",
    "band": "there is no plot; give its boundary with plot=",
    "roofs": "it is of a plan's roofs; judge it by a study with receivers='top' and rules=",
    "walls": "it is of walls; judge it by a study with receivers='surfaces' and rules=",
}
_LOWEST = 5.0  # altitude of the sun below which bands do not follow shadows [degrees]
_STEP = 0.05  # half a side of a place's square [m]


@dataclass(frozen=True)
class Lacking:
    """What a requirement needs and the model lacks: what to give."""

    needs: str


@dataclass(eq=False)
class Gathered:
    """
    The receivers of rules, laid out once for each way in which rules judge them.

    Parameters
    ----------
    model : Model
    areas, windows, plot, roads : optional
        As ``umbra.prove`` takes them.
    areas_on : str
        On what areas are judged: ``ground``, ``top``, ``ground+1.5``, ``mean+4``.
    reveal : float or str, optional
        Depth of panes behind the wall [m].
    """

    model: Model
    areas: Any = None
    windows: Any = None
    plot: Any = None
    roads: Any = None
    areas_on: str = "ground"
    reveal: Any = None
    notes: list[str] = field(default_factory=list)
    _kept: dict[Any, Any] = field(default_factory=dict)

    def find(self, requirement: Requirement) -> "list[SunlightOf] | Lacking":
        """Return the receivers of a requirement, each kind with its sunlight; or what lacks."""
        receivers: list[SunlightOf] = []
        lacking: list[str] = []
        for kind in requirement.receivers:
            sunlight = self._find_kind(kind, requirement)
            if isinstance(sunlight, Lacking):
                lacking.append(sunlight.needs)
            else:
                receivers.append(sunlight)
        return receivers or Lacking("; or ".join(dict.fromkeys(lacking)))

    def _find_kind(self, kind: str, requirement: Requirement) -> "SunlightOf | Lacking":
        if kind == "areas" and self.areas is not None:
            return self._keep(kind, self._lay_areas)
        if kind == "windows" and self._has_windows():
            judge = requirement.judge
            return self._keep((kind, judge), lambda: self._lay_windows(judge))
        if kind == "places":
            return self._keep((kind, requirement.places), lambda: self._lay_places(requirement))
        if kind == "band" and self.plot is not None:
            key = (kind, requirement.band, requirement.across_roads, requirement.height)
            return self._keep(key, lambda: self._lay_band(requirement))
        return Lacking(NEEDS[kind])

    def _keep(self, key: Any, make: Any) -> SunlightOf:
        if key not in self._kept:
            subjects = make()
            if subjects.kind in {"areas", "windows"}:
                self._tell(tell_far(subjects, *self.find_model_bounds()))
            self._kept[key] = self._make_sunlight(subjects)
        sunlight: SunlightOf = self._kept[key]
        return sunlight

    def _tell(self, notes: Sequence[str]) -> None:
        """Keep notes, each once."""
        self.notes += [note for note in notes if note not in self.notes]

    def _make_sunlight(self, subjects: Subjects) -> SunlightOf:
        """Return what counts the sun and the sky on receivers."""
        return SunlightOf(self.model, subjects)

    def _has_windows(self) -> bool:
        if self.windows is None and "has_windows" not in self._kept:
            self._kept["has_windows"] = count_windows(self.model.scene) > 0
        return self.windows is not None or bool(self._kept["has_windows"])

    def _lay_out(self, kind: str, *, is_told: bool = False, **more: Any) -> Any:
        """Lay named receivers out, as a study of them would; tell of those that a user gave."""
        options = self.model.options
        study_options = StudyOptions(
            receivers=kind, date=f"{self.model.year}-03-21", ground=options.ground,
            canopy=options.canopy, transmissivity=options.transmissivity, leaf_on=options.leaf_on,
            cast=options.cast, no_cast=options.no_cast, threads=options.threads, **more,
        )  # fmt: skip
        laid = self._lay_out_kind(kind, study_options)
        self._tell(getattr(laid, "notes", ()) if is_told else ())
        return laid

    def _lay_out_kind(self, kind: str, options: StudyOptions) -> Any:
        """Lay out receivers of a kind as options ask for them."""
        scene = settle_ground(self.model.scene, options).scene
        setup = Setup.of(scene, self.model.site, options)
        return find_kind(kind, scene, options.ground).lay_out(setup.request)

    def _lay_areas(self) -> Subjects:
        laid = self._lay_out("areas", is_told=True, areas=self.areas, areas_on=self.areas_on)
        properties = [area.properties for area in laid.records]
        return _read_laid(
            "areas", laid,
            flats=tuple(str(area.get("flat") or "") for area in properties),
            rooms=tuple(str(area.get("room") or "") for area in properties),
        )  # fmt: skip

    def _lay_windows(self, judge: str) -> Subjects:
        laid = self._lay_out(
            "windows", is_told=True, windows=self.windows, judge=judge, reveal=self.reveal
        )
        windows, north = laid.records, self.model.site.true_north
        subjects = _read_laid(
            "windows", laid,
            azimuths=np.array([window.find_azimuth(north) for window in windows], np.float64),
            flats=tuple(window.flat for window in windows),
            rooms=tuple(window.room for window in windows),
            storeys=tuple(window.storey for window in windows),
        )  # fmt: skip
        with suppress(InputError):  # some stand where the model has no ground
            spots = [(window.center[0], window.center[1]) for window in windows]
            self._tell(tell_buried(subjects, self._find_ground(spots)))
        return subjects

    def _find_ground(self, spots: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
        """Return the height of the ground at places in plan [m]."""
        from umbra.scene.named_places import Area  # noqa: PLC0415

        shapely = need("shapely", "gis", "areas")
        squares = [
            Area(f"{k}", shapely.box(x - _STEP, y - _STEP, x + _STEP, y + _STEP))
            for k, (x, y) in enumerate(spots)
        ]
        laid = self._lay_out("areas", areas=squares)
        heights: NDArray[np.float64] = laid.average(laid.places.points[:, 2])
        return heights

    def find_height(self) -> float:
        """Return the height of the proposal, or of the model, above its ground [m]."""
        low, high = self.find_bounds()
        middle = (low + high) / 2
        return float(high[2] - self._find_ground([(middle[0], middle[1])])[0])

    def find_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lowest and highest corner of the proposal, or of the model [m]."""
        if not self.model.proposed:
            return self.find_model_bounds()
        corners = self.find_corners()
        return corners.min(0), corners.max(0)

    def find_model_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lowest and highest corner of the model [m]."""
        low, high = self.model.scene.model_bounds()
        return low, high

    def find_near(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> Scene:
        """Return what stands in a rectangle of the plan, or more, to be drawn there."""
        del low, high
        return self.model.scene

    def name_replaced(self) -> list[str]:
        """Name what stands before the proposal alone."""
        return list(dict.fromkeys(part.name for part in self.model.scene.replaced))

    def find_corners(self) -> NDArray[np.float64]:
        """Return the corners of the proposal's triangles, (n, 3) [m]."""
        scene: Scene = self.model.scene
        parts = scene.select(self.model.proposed, option="proposed")
        return scene.triangles(parts).find_corners() + scene.origin

    def _lay_places(self, requirement: Requirement) -> Subjects:
        places = requirement.places
        ground = self._find_ground([(place.x, place.y) for place in places])
        points = [
            (place.x, place.y, float(z) if place.z is None else place.z)
            for place, z in zip(places, ground, strict=True)
        ]
        up = np.tile([0.0, 0.0, 1.0], (len(places), 1))
        return of_points("places", [place.name for place in places], points, up, records=places)

    def _lay_band(self, requirement: Requirement) -> Subjects:
        from umbra.scene.named_places import Area  # noqa: PLC0415

        shapely = need("shapely", "gis", "plot")
        plot, boundary = self.find_plot(), self.find_boundary(requirement.across_roads)
        if self.model.proposed:
            self._tell(tell_off_plot(plot, self.find_corners()))
        assert requirement.band is not None
        near, far = requirement.band
        ground = self._lay_out("areas", areas=[Area("plot", plot)], areas_on="mean")
        z = float(np.mean(ground.places.points[:, 2])) + (requirement.height or 0.0)
        if math.isinf(far):
            far = near + self._find_reach(requirement, z)
        ring = shapely.difference(shapely.buffer(boundary, far), shapely.buffer(boundary, near))
        name = (
            f"{near:g} to {far:g} m"
            if not math.isinf(requirement.band[1])
            else f"beyond {near:g} m"
        )
        laid = self._lay_out("areas", areas=[Area(name, ring)], areas_on="mean")
        band = _read_laid("band", laid)
        band.points[:, 2] = z
        band.normals[:] = (0.0, 0.0, 1.0)
        return band

    def list_counted(self) -> list[SunlightOf]:
        """Return all receivers that rules asked of."""
        return [sunlight for sunlight in self._kept.values() if isinstance(sunlight, SunlightOf)]

    def find_plot(self) -> Any:
        """Return the plot's boundary, a polygon in the model's own coordinates."""
        if "plot" not in self._kept:
            from umbra.receivers.area_search import find_areas  # noqa: PLC0415

            shapely = need("shapely", "gis", "plot")
            areas, _ = find_areas(self.model.scene, self.plot)
            self._kept["plot"] = shapely.union_all([area.polygon for area in areas])
        return self._kept["plot"]

    def find_boundary(self, half_up_to: float | None) -> Any:
        """Return the plot, its boundary moved across roads where a rule moves it (see `Rule`)."""
        plot = self.find_plot()
        if half_up_to is None or self.roads is None:
            return plot
        key = ("boundary", half_up_to)
        if key not in self._kept:
            from umbra.receivers.moved_boundary import (  # noqa: PLC0415
                find_roads,
                move_boundary,
                tell_frontages,
            )

            roads = find_roads(self.model.scene, self.roads)
            self._kept[key], frontages = move_boundary(plot, roads, half_up_to)
            self._tell([tell_frontages("the plot", frontages)])
        return self._kept[key]

    def list_boundaries(self) -> list[Any]:
        """Return the boundaries that were moved for rules."""
        return [
            kept
            for key, kept in self._kept.items()
            if isinstance(key, tuple) and key[0] == "boundary"
        ]

    def _find_reach(self, requirement: Requirement, z: float) -> float:
        """
        Return the distance from the plot beyond which no place is dark for the limit [m].

        A place that is dark for L hours is so at some moment at least L/2 from both ends of the
        period, when the sun is no lower than at these two.
        """
        height = float(self.find_bounds()[1][2]) - z
        reach = 0.0
        probe = self._make_sunlight(of_points("places", ["probe"], [self.find_model_bounds()[1]]))
        for condition in list_conditions(requirement.condition):
            for day in probe.list_days(condition, "after"):
                past = np.cumsum(day.hours)
                half = (condition.at_most or 0.0) / 2
                inside = (past >= half) & (past <= past[-1] - half) if len(past) else past > 0
                lowest = day.altitudes[inside].min() if inside.any() else 90.0
                reach = max(reach, height / math.tan(math.radians(max(lowest, _LOWEST))))
        return max(reach, 10.0)


def _read_laid(kind: str, laid: Any, **more: Any) -> Subjects:
    """Return laid-out receivers as what rules judge."""
    count = len(laid.records)
    none = ("",) * count
    normals: NDArray[np.float64] = np.array(laid.places.normals)
    return Subjects(**{
        "kind": kind, "names": tuple(laid.group_names), "owner": laid.owner,
        "points": np.array(laid.places.points), "normals": normals, "areas": laid.areas,
        "azimuths": np.full(count, np.nan), "flats": none, "rooms": none, "storeys": none,
        "records": tuple(laid.records), "openings": getattr(laid, "openings", None), **more,
    })  # fmt: skip
