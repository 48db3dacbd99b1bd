"""Setup of a study from its options, and counting on receivers of any kind."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy, describe_opaque
from umbra.casters.casting import select_casters, select_replaced
from umbra.devices import DEFAULT, StudyCounters, check_device
from umbra.lights import Lights, Period
from umbra.receivers.kind import Receivers, Request, Tile, Variables
from umbra.scene import Scene
from umbra.study.accumulators.arrays import ResultArrays, ResultOptions
from umbra.study.accumulators.attribution import Attribution, AttributionOptions, ExactAttribution
from umbra.study.accumulators.before_and_after import Proposal
from umbra.study.accumulators.exact import ExactIntervals, find_least_interval, follow_sun
from umbra.study.accumulators.named_hours import GroupDays, NamedDays
from umbra.study.accumulators.step_masks import HourSums, InstantMasks, Masks, SunIntervals
from umbra.study.compare import read_hours
from umbra.study.engine import Progress, count_each_tile, run_on_device
from umbra.study.land import settle_land
from umbra.study.loop import Accumulator, TileRun, pass_lights
from umbra.study.measures import Asked, Measure, guard
from umbra.study.measures.measure import count_at_once
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.study.study_period import ask_for_site, find_period
from umbra.sun import Site
from umbra.version import __version__

if TYPE_CHECKING:
    from umbra.receivers.named import NamedReceivers

__all__ = ["Result", "Setup"]


def _find_disc_radius() -> float:
    """Return the radius of the sun's disc [degrees]."""
    from umbra.study.accumulators.disc import RADIUS  # noqa: PLC0415  (kernels)

    return RADIUS


@dataclass(frozen=True, eq=False)
class Result:
    """
    Results of counting.

    Parameters
    ----------
    arrays : ResultArrays
    accumulators : list of Accumulator
    seconds : float
        Time spent counting [s].
    device : str
        The device that counted.
    note : str
        Why it is another than was chosen; empty if it is not.
    """

    arrays: ResultArrays
    accumulators: list[Accumulator]
    seconds: float
    device: str
    note: str = ""

    @property
    def groups(self) -> GroupDays | None:
        """Figures of named receivers by date."""
        return next((a.groups for a in self.accumulators if isinstance(a, NamedDays)), None)

    @property
    def masks(self) -> Masks | None:
        """Masks of every instant, if requested."""
        masks = [a.masks for a in self.accumulators if isinstance(a, InstantMasks)]
        return masks[0] if masks else None

    def blank(self, nothing: NDArray[np.bool_]) -> None:
        """Blank the results where nothing receives."""
        self.arrays.blank(nothing)
        for accumulator in self.accumulators:
            accumulator.blank(nothing)

    def collect(self, laid: Receivers) -> tuple[Variables, frozenset[str]]:
        """
        Return the arrays of the result besides the hours of the whole period.

        With them come the names of those that are of no single date.
        """
        variables = {**self.arrays.variables(laid), **laid.locate()}
        totals: set[str] = set()
        for accumulator in self.accumulators:
            own = accumulator.variables(laid)
            totals |= own.keys() - accumulator.of_any_date
            variables |= own
        return variables, frozenset(totals)


@dataclass(frozen=True, eq=False)
class Setup:
    """
    Setup of a study from its options, for all kinds of receivers.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : StudyOptions
    period : Period
    results : ResultOptions
    attribution : AttributionOptions
    casters : list of int
        Indices of the parts that cast.
    threads : int
    device : {'auto', 'cpu', 'gl'}
    canopy : Canopy, optional
    begun : float
        Clock at the start of the work [s].
    is_cut : bool
        Whether parts of the receivers are counted alone, so that not all are held in memory.
    proposal : Proposal, optional
    """

    scene: Scene
    site: Site | None
    options: StudyOptions
    period: Period
    results: ResultOptions
    attribution: AttributionOptions
    casters: list[int]
    threads: int
    device: str = "auto"
    canopy: Canopy | None = None
    begun: float = field(default_factory=time.perf_counter)
    is_cut: bool = False
    proposal: Proposal | None = None

    @classmethod
    def of(
        cls, scene: Scene, site: Site | None, options: StudyOptions, *, is_cut: bool = False
    ) -> "Setup":
        """Read the options common to all receivers."""
        threads = check_device(options.device, options.threads)
        if site is None and options.needs_site:
            raise ask_for_site()
        options = settle_land(options, scene.model_bounds(), site)
        period = find_period(options, site)
        casters = select_casters(scene, options.cast, options.no_cast)
        canopies = Canopy.of(
            scene, casters, options.canopy, options.transmissivity, options.leaf_on
        )
        attribution = AttributionOptions.of(scene, casters, options, canopies)
        proposal = None
        if proposed := frozenset(attribution.proposed or ()):
            before = [part for part in casters if part not in proposed]
            before += select_replaced(scene, options.cast, options.no_cast)
            replaced = range(len(scene.parts), len(scene.whole.parts))
            proposal = Proposal.of(sorted(proposed), before, replaced)
        if not options.asks_hours and not any(measure.by_caster for measure in options.measures):
            attribution = AttributionOptions()
        results = ResultOptions.of(period, options)
        return cls(
            scene, site, options, period, results, attribution, casters, threads,
            DEFAULT if canopies else options.device, canopies, is_cut=is_cut,
            proposal=proposal,
        )  # fmt: skip

    @property
    def bytes_of_masks(self) -> int:
        """Memory of the masks of each receiver [byte]."""
        size = (int(self.period.sun.is_up.sum()) + 7) // 8 if self.results.masks else 0
        return 2 * size if self.canopy else size

    @property
    def bytes_kept(self) -> int:
        """Memory of each receiver's results besides hours [byte]."""
        days = len(self.period.days)
        behind = (4 + 4 * days * self.results.by_day) if self.canopy else 0
        attribution = self.attribution.bytes_kept(days if self.results.by_day else 0)
        measured = sum(
            8 * (self.attribution.shown if q.per else 1) for q in self.options.quantities
        )
        measured *= 3 if self.proposal else 1
        return self.results.bytes_kept(days) + attribution + behind + measured

    @property
    def request(self) -> Request:
        """The request for its receivers."""
        return Request(
            self.scene, self.options, self.casters, self.threads, self.canopy,
            true_north=0.0 if self.site is None else self.site.true_north,
            lights=max(int(self.period.sun.is_up.sum()), self._count_measured()),
            find_reaching=self.period.find_reaching_suns,
            bytes_kept=self.bytes_kept,
            bytes_of_masks=self.bytes_of_masks,
            by_day=self.results.by_day,
            is_streamed=self.results.is_streamed,
            has_groups=self.attribution.groups is not None,
            limit_tiles=self._limit_tiles,
            is_cut=self.is_cut,
        )  # fmt: skip

    def _limit_tiles(self, side: int) -> int:
        """Return the longest tile side, at most the given one, whose results fit in memory."""
        copies = (2 if self.proposal else 1) * (2 if self.canopy else 1)
        for measure in self.options.measures:
            lights = guard(measure, self.asked.make_lights, measure)
            side = min(side, math.isqrt(count_at_once(measure, lights, copies=copies)))
        return self.attribution.limit_tiles(side, len(self.period.days))

    def _count_measured(self) -> int:
        """Return the greatest number of lights of a measure."""
        counts = (len(guard(m, self.asked.make_lights, m)) for m in self.options.measures)
        return max(counts, default=0)

    @property
    def asked(self) -> Asked:
        """What measures may read."""
        return Asked(self.options, self.period, self.site)

    def begin(self, laid: Receivers, *, reads_days: bool = True) -> Result:
        """
        Make the arrays of the results, before anything is counted.

        ``reads_days`` is false if no accumulator will read the hours of a date.
        """
        attribution, results = self.attribution, self.results
        judges_days = attribution.groups is not None and results.tolerance > 0
        arrays = ResultArrays(
            self.period, laid.shape, results, self.canopy,
            reads_days=reads_days and (attribution.proposed is not None or judges_days),
        )  # fmt: skip
        return Result(arrays, self.make_accumulators(arrays, laid), 0.0, DEFAULT)

    def count(self, laid: Receivers, progress: Progress = lambda _done, _all: None) -> Result:
        """
        Count the whole period on all receivers.

        Parameters
        ----------
        laid : Receivers
        progress : callable
            Called with the number of instants done and the total.
        """
        tiles, begun = laid.make_tiles(self.request), self.begin(laid)
        suns = self.period.sun.direction[self.period.sun.is_up]
        with StudyCounters(self.device, self.casters, suns, math.prod(laid.shape)) as counters:
            make_run = run_on_device(counters, self.canopy, suns, self.period)
            seconds = count_each_tile(
                tiles, self.make_lights(), begun.accumulators, make_run, progress
            )
        return replace(begun, seconds=seconds, device=counters.device, note=counters.note)

    def finish(
        self, done: Result, laid: Receivers, facts: dict[str, object] | None = None
    ) -> Study:
        """
        Return the study of what was counted, blank where nothing receives.

        ``facts`` are those of the receivers by default.
        """
        nothing = laid.finish()
        if nothing is not None:
            done.blank(nothing)
        arrays, (more, totals) = done.arrays, done.collect(laid)
        return Study(
            laid, self.period, arrays.shadow_hours, arrays.up_hours, done.masks,
            laid.facts if facts is None else facts, more, totals,
            self.options.asks_hours, self.options.quantities, done.groups,
        )  # fmt: skip

    def make_lights(self) -> Lights:
        """Return the suns at the steps' midpoints, or dense enough to miss no interval."""
        if self.results.tolerance:
            return follow_sun(self.period, self.results.tolerance)
        if not self.period.days:
            return Lights.of(np.zeros((0, 3)))
        return self.period.make_lights()

    def make_accumulators(self, arrays: ResultArrays, laid: Receivers) -> list[Accumulator]:
        """Return the accumulators that options need, hours first: the others read them."""
        results, attribution = self.results, self.attribution
        accumulators = [self._make_measured(measure, laid) for measure in self.options.measures]
        if not self.options.asks_hours:
            return accumulators
        accumulators.insert(
            0,
            ExactIntervals(arrays) if results.tolerance
            else SunIntervals(arrays) if results.is_streamed
            else self._make_disc(arrays) if self.options.disc
            else HourSums(arrays)
        )  # fmt: skip
        if laid.group_names and self.period.days:
            inner = ExactIntervals if results.tolerance else SunIntervals
            groups, least = cast("NamedReceivers", laid), read_hours(self.options.least, "least")
            accumulators.append(NamedDays(arrays, groups, least, inner))
        if results.masks:
            has_canopy = self.canopy is not None
            accumulators.append(InstantMasks(self.period, laid.shape, has_canopy=has_canopy))
        if attribution.groups is not None and results.tolerance:
            solve, proposal = self._solve, self.proposal
            accumulators.append(ExactAttribution(attribution, laid, arrays, solve, proposal))
        elif attribution.groups is not None:
            accumulators.append(Attribution(attribution, laid, arrays, self.proposal))
        return accumulators

    def _make_disc(self, arrays: ResultArrays) -> Accumulator:
        """Return the accumulator of hours by the share of the sun's disc."""
        from umbra.study.accumulators.disc import DiscHours  # noqa: PLC0415  (kernels)

        return DiscHours(arrays)

    def _make_measured(self, measure: Measure, laid: Receivers) -> Accumulator:
        """Return the accumulator of a measure."""
        if measure.by_caster:
            from umbra.study.accumulators.blocked import BlockedSky  # noqa: PLC0415  (the sky's)

            return BlockedSky(
                measure, self.asked, laid, self.attribution, self.casters, self.proposal
            )
        from umbra.study.accumulators.measure_sums import MeasureSums  # noqa: PLC0415  (kernels)

        return MeasureSums(measure, self.asked, laid, self.canopy, self.proposal, self.casters)

    def _solve(self, tile: Tile, parts: Sequence[int]) -> NDArray[np.float32]:
        """Return a tile's exact hours in shadow of some casters by date, (days, ...) [h]."""
        chosen, canopy = [parts], self.canopy
        if canopy is not None and canopy.weak.intersection(parts):
            chosen.append(sorted({*parts} - canopy.weak))
        else:
            canopy = None
        tiles = [tile.with_casters(casters) for casters in chosen]
        run = TileRun(tile.shape, [tile.make_counter() for tile in tiles], ..., tiles)
        results = ResultOptions(tolerance=self.results.tolerance)
        alone = replace(self.period, horizon=None)  # the land's hours are no caster's
        arrays = ResultArrays(alone, tile.shape, results, canopy, reads_days=True)
        pass_lights(run, self.make_lights(), [ExactIntervals(arrays)])
        return np.array([arrays.read_hours(day) for day in range(len(self.period.days))])

    def describe(self, receivers: str, seconds: float, **more: object) -> dict[str, object]:
        """Return the attributes of a result, without None."""
        scene, site = self.scene, self.site
        facts: dict[str, object] = {
            "umbra_version": __version__,
            "command": "umbra.shadow_study",
            "source": "; ".join(f"{s.name} sha256:{s.sha256}" for s in scene.sources),
            "device": DEFAULT,
            "threads": self.threads,
            "crs": scene.crs,
            "receivers": receivers,
            **more,
            "measures": ", ".join(self.options.measure) or None,
            "latitude": getattr(site, "latitude", None),
            "longitude": getattr(site, "longitude", None),
            "time_zone": getattr(site, "zone", None),
            "true_north_deg": getattr(site, "true_north", None),
            "sun_disc_deg": _find_disc_radius() if self.options.disc else None,
            "replaced": ", ".join(dict.fromkeys(part.name for part in scene.replaced)) or None,
            **(self.period.horizon.facts if self.period.horizon else {}),
            **self._describe_measures(),
            **self.options.attributes,
            **(self._describe_period() if self.period.days else {"refraction": None}),
            **self.attribution.facts,
            **(self.canopy.facts if self.canopy else {}),
            "opaque_rule": describe_opaque(scene, self.casters, self.canopy),
            "prepare_seconds": time.perf_counter() - self.begun - seconds,
            "count_seconds": seconds,
        }
        return {name: fact for name, fact in facts.items() if fact is not None}

    def _describe_measures(self) -> dict[str, object]:
        """Return attributes that the measures give."""
        described = [guard(m, m.describe, self.asked) for m in self.options.measures]
        return {name: fact for facts in described for name, fact in facts.items()}

    def _describe_period(self) -> dict[str, object]:
        """Return attributes of the time axis, if it is more than one plain day."""
        facts: dict[str, object] = {}
        days, results = self.period.days, self.results
        if len(days) > 1:
            facts |= {"days": len(days), "first_date": str(days[0]), "last_date": str(days[-1])}
        if results.min_spell:
            facts["min_spell_minutes"] = results.min_spell / 6e7
        if results.tolerance:
            facts["exact_tolerance_seconds"] = results.tolerance
            facts["exact_least_spell_seconds"] = find_least_interval(self.period)
        return facts
