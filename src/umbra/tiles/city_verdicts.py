"""
Verdicts of cited rules on named receivers of a city, each counted among all that reaches it.

Receivers are laid out, and counted, in runs that lie together; the rules see them as one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Period
from umbra.receivers import find_kind
from umbra.receivers.kind import DIMS
from umbra.rules.record import Rule
from umbra.scene import Mesh, Part, Scene
from umbra.study.accumulators.step_masks import Masks
from umbra.study.options import StudyOptions
from umbra.tiles.city_proposal import find_proposal
from umbra.tiles.city_receivers import RolePlace, count_among, look_around
from umbra.tiles.city_runs import Laid, cut_squares, lay_out_city_areas, lay_out_windows
from umbra.tiles.job import CityJob
from umbra.tiles.matched_parts import fill_bounds, name_city_replaced
from umbra.tiles.prepare import make_plain
from umbra.tiles.settle import locate_city
from umbra.tiles.verdict_pieces import VerdictPieces
from umbra.verdicts.judge import RuleVerdict, judge_rules
from umbra.verdicts.judged_receivers import NEEDS, Gathered, Lacking
from umbra.verdicts.subjects import Subjects
from umbra.verdicts.sunlight import Model, SunlightOf
from umbra.version import __version__

__all__ = ["CityGathered", "gather_city", "judge_city"]


@dataclass(frozen=True, eq=False)
class _Counted:
    """What rules read of a study: that of all samples, joined from runs."""

    period: Period
    masks: Masks | None
    more: dict[str, tuple[tuple[str, ...], NDArray[Any]]]
    quantities: tuple[Any, ...]


@dataclass(eq=False)
class _CitySunlight(SunlightOf):
    """Sunlight and sky of some receivers of a city."""

    job: CityJob = None  # type: ignore[assignment]
    pieces: VerdictPieces = None  # type: ignore[assignment]

    def _run(self, which: str, **more: Any) -> Any:
        job, given = self.job, self.subjects
        casters = self.model.choose_casters(which)
        kept = self.keep_options(which)
        if more.get("exact") and kept.get("horizon") is not None:
            msg = "rules of the sky take no horizon= in tiles; leave one out, or tiles="
            raise InputError(msg, option="horizon")
        normals = np.where(np.isfinite(given.normals), given.normals, [0.0, 0.0, 1.0])
        replaced = [getattr(job.options, name) for name in ("proposed", "replace", "replace_in")]
        plain = {name: make_plain(value) for name, value in kept.items()}
        decides = which, replaced, casters, plain, more
        joined: _Counted | None = None
        for some in cut_squares(given.points, job.square):
            points = np.hstack([given.points[some], normals[some]])
            asked = StudyOptions(receivers="points", points=points, **kept, **casters, **more)
            own = RolePlace(
                replace(job, options=asked, min_altitude=0.0), replace(job.options, **casters),
                is_before=which == "before",
            )  # fmt: skip
            if joined is None:
                self._check_memory(own)
            piece = self.pieces.find(decides, points, partial(_count, own, points))
            if joined is None:
                joined = _begin(own, piece, len(given.points))
            for name, values in piece.items():
                if name != _BITS:
                    joined.more[name][1][some] = values
            if joined.masks is not None:
                joined.masks.bits[:, some] = piece[_BITS]
        return joined

    def _check_memory(self, own: RolePlace) -> None:
        """Refuse moments of more samples than half of the memory holds."""
        steps = int(own.period.sun.is_up.sum()) if own.setup.results.masks else 0
        days = max(len(own.period.days), 1)
        held = len(self.subjects.points) * (steps / 8 + 4 * steps / days)
        if held > self.job.memory / 2:
            msg = (
                f"{len(self.subjects):,} {self.subjects.kind} at {steps:,} moments of a rule take "
                f"{held / 2**30:.1f} GB of the {self.job.memory / 2**30:.1f} GB that the run may "
                "hold; judge fewer at a time, or give more memory="
            )
            raise InputError(msg, option="areas")


_BITS = "bits of masks"


def _count(own: RolePlace, points: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Count points among all that reaches them: what varies over them, and their masks."""
    low, high = points[:, :2].min(0), points[:, :2].max(0)
    shift = own.origin[:2]
    laid: Any = find_kind("points").lay_out(look_around(own, low - shift, high - shift))
    study, _ = count_among(own, laid)
    piece = {name: np.asarray(values) for name, (dims, values) in study.more.items()
             if dims == study.laid.dims and np.asarray(values).dtype.kind == "f"}  # fmt: skip
    return piece if study.masks is None else {**piece, _BITS: study.masks.bits}


def _begin(own: RolePlace, piece: dict[str, NDArray[Any]], count: int) -> _Counted:
    """Make room for the results of all samples, as the first piece has them."""
    masks = Masks(own.period.sun.is_up, (count,)) if _BITS in piece else None
    more: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {
        name: (DIMS, np.zeros(count, values.dtype))
        for name, values in piece.items()
        if name != _BITS
    }
    return _Counted(own.period, masks, more, own.job.options.quantities)


@dataclass(eq=False)
class CityGathered(Gathered):
    """The receivers of rules in a city."""

    job: CityJob = None  # type: ignore[assignment]

    @cached_property
    def pieces(self) -> VerdictPieces:
        """What was counted, in the folder of the city's results."""
        job = self.job
        decides = __version__, job.open().catalogue.fingerprint, job.site, job.frame, job.merged
        return VerdictPieces(Path(job.folder), repr(decides))

    def _make_sunlight(self, subjects: Subjects) -> SunlightOf:
        return _CitySunlight(self.model, subjects, job=self.job, pieces=self.pieces)

    def _find_kind(self, kind: str, requirement: Any) -> "SunlightOf | Lacking":
        if kind == "windows" and self.windows is None:
            return Lacking(
                "windows of files are not read in tiles; give a table with windows=, or leave "
                "tiles= out"
            )
        if kind in {"roofs", "walls"}:
            return Lacking(f"{NEEDS[kind].partition(';')[0]}, which tiles do not; leave tiles= out")
        return super()._find_kind(kind, requirement)

    def find_model_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the lowest and highest corner of the city [m]."""
        low, high = np.array(self.job.frame.bounds)
        return low, high

    def find_corners(self) -> NDArray[np.float64]:
        """Return the corners of the proposal's triangles, (n, 3) [m]."""
        place = self.job.open()
        return np.asarray(find_proposal(place).vertices + place.origin)

    def find_near(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> Scene:
        """Return what stands in a rectangle, with what the proposal replaces there."""
        own = RolePlace(self.job, self.job.options)
        shift = own.origin[:2]
        request = look_around(own, low - shift, high - shift, has_names=True)
        soup, gone = request.scene.triangles(), set(request.gone)
        order = np.argsort(soup.part, kind="stable")
        numbers, first = np.unique(soup.part[order], return_index=True)
        parts: tuple[list[Part], list[Part]] = ([], [])
        for k, faces in zip(numbers.tolist(), np.split(soup.faces[order], first[1:]), strict=True):
            part = replace(request.scene.parts[k], mesh=Mesh(soup.vertices, faces))
            parts[k in gone].append(part)
        standing, replaced = map(tuple, parts)
        return Scene(standing, own.origin, replaced=replaced)

    def name_replaced(self) -> list[str]:
        """Name what stands before the proposal alone."""
        return name_city_replaced(self.job.open().catalogue, self.job.options)

    def _lay_out_kind(self, kind: str, asked: StudyOptions) -> Laid:
        """Lay receivers out in runs that lie together."""
        roles = replace(self.job.options, cast=asked.cast, no_cast=asked.no_cast)
        own = RolePlace(replace(self.job, options=asked), roles)
        return lay_out_windows(own) if kind == "windows" else lay_out_city_areas(own)


def gather_city(job: CityJob, year: int, **given: Any) -> CityGathered:
    """
    Return the receivers of rules in a city.

    Parameters
    ----------
    job : CityJob
    year : int
        Of dates without one.
    **given
        ``areas``, ``windows``, ``plot``, ``areas_on``, ``reveal``, as of ``Gathered``.
    """
    if job.site is None:
        msg = "rules= of the sun need a place; give latitude and longitude with site="
        raise InputError(msg, option="rules")
    catalogue = job.open().catalogue
    where = fill_bounds(locate_city(catalogue), catalogue.bounds)
    sources = tuple(source for file in catalogue.files if file.path for source in file.sources)
    model = Model(
        scene=replace(where, sources=sources), site=job.site, year=year,
        options=job.options, proposed=tuple(job.options.proposed),
    )  # fmt: skip
    return CityGathered(model, **given, job=job)


def judge_city(job: CityJob, rules: Sequence[Sequence[Rule]]) -> list[RuleVerdict]:
    """
    Judge the named areas of a study in tiles by cited rules.

    Parameters
    ----------
    job : CityJob
    rules : sequence of sequences of Rule
        The variants of each.
    """
    days = job.open().period.days
    options = job.options
    gathered = gather_city(
        job, days[0].year if days else 2001, areas=options.areas, areas_on=options.areas_on
    )
    verdicts = judge_rules(gathered, rules)
    gathered.pieces.drop_others()
    return verdicts
