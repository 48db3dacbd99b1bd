"""
Options of a study: each with its type, default, unit, help, flag and heading.

``StudyOptions`` defines the command's options and headings, the signature and the docstring of
``umbra.shadow_study``, the checks of types and some attributes of the result.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from umbra.devices import find_device
from umbra.errors import InputError, find_similar, show_value
from umbra.option_fields import Option, check_types, list_options, option, read_length, record
from umbra.study.receiver_options import ReceiverOptions

if TYPE_CHECKING:
    from umbra.lights import Weather
    from umbra.receivers import ReceiverKind
    from umbra.study.measures import Measure, Quantity

__all__ = ["StudyOptions"]

_DEEPEST = 10.0  # reveal [m]
_OF_AREAS = ("areas", "areas_on", "band", "roads", "least")
_results = partial(option, heading="Results")
_running = partial(option, heading="Running")


@record
class StudyOptions(ReceiverOptions):
    """
    Options of a study, checked and normalised; see ``umbra.shadow_study``.

    Raises
    ------
    InputError
        If a value is wrong, or does not apply to these receivers.
    """

    by: Literal["part", "kind", "layer"] | None = _results(
        "choice", "Also write the hours of shadow due to each part, kind or layer; with who= only "
        "to those.", choices=("part", "kind", "layer"),
    )  # fmt: skip
    who: Sequence[str] = _results(
        "patterns", "Also write the hours of shadow due to these parts: names, kinds or layers.",
        default=(),
    )  # fmt: skip
    proposed: Sequence[str] = _results(
        "patterns", "Parts of the proposed development: also write the sun that they take from "
        "the others.", default=(),
    )  # fmt: skip
    replace: Sequence[str] = _results(
        "patterns", "Parts that the proposal replaces: they stand before, and are gone after; "
        "where they stood, a plan has no cell before. Ground and terrain stay.", default=(),
    )  # fmt: skip
    replace_in: str | Path | Sequence[Any] | None = _results(
        "table", "Polygons of a plot, a file as of areas= or WKT: the proposal replaces what "
        "stands in them with half of its plan or more.",
        more="Or shapely's polygons in the model's own coordinates.", metavar="FILE|WKT",
    )  # fmt: skip
    under: str | float | dt.timedelta | None = _results(
        "any", "With proposed=: find where fewer hours of sun are left than this, but were not "
        "before; default: 2h.", metavar="DURATION",
    )  # fmt: skip
    spells: bool = _results(
        "flag", "Also write the first and the last sun, the number of sun intervals, the longest "
        "one, and the share of time in shadow.", default=False,
    )  # fmt: skip
    exact: bool | float = _results(
        "flag", "Compute when each cell enters and leaves shadow, to a second, instead of adding "
        "up steps; and measures of the sky by the outlines of the free sky, instead of directions.",
        more="A number is the tolerance instead of a second [s].", default=False, least=0,
    )  # fmt: skip
    min_spell: str | dt.timedelta | None = _results(
        "any", "Also write the hours of sun in intervals at least this long; implies spells=.",
        metavar="DURATION",
    )  # fmt: skip
    disc: bool = _results(
        "flag", "Weigh each step by the share of the sun's disc (0.2666 degrees radius) that is "
        "seen, instead of its middle alone; and write its first and last contact.", default=False,
    )  # fmt: skip
    masks: bool = _results(
        "flag", "Also write which cells are in shadow at each step.", more="It is ``in_shadow``.",
        default=False,
    )  # fmt: skip
    device: str = _running(
        "text", "What counts: auto (cpu, or a GPU that proves faster on large plans), cpu, gl.",
        more="What it cannot count, the CPU does, with a warning.", default="auto",
        metavar="NAME", registry="device",
    )  # fmt: skip
    threads: int | None = _running(
        "whole", "Number of threads; default: all cores.", more="Results do not depend on it.",
        least=1, metavar="N", is_kept=False,
    )  # fmt: skip

    def __post_init__(self) -> None:
        for name in ("receivers", "date"):
            if isinstance(getattr(self, name), Real):
                object.__setattr__(self, name, f"{getattr(self, name):.15g}")
        if not isinstance(self.receivers, str):
            msg = f"receivers are named by a str, such as 'top'; got {show_value(self.receivers)}"
            raise InputError(msg, option="receivers")
        check_types(self)
        find_device(self.device)
        self._check_measures()
        self._check_receivers()
        self._check_values()
        if isinstance(self.points, (str, Path)):
            from umbra.receivers.points import read_points  # noqa: PLC0415

            points, names = read_points(self.points)
            object.__setattr__(self, "points", points)
            object.__setattr__(self, "names", self.names or tuple(names))
        self._check_areas()
        self._check_windows()

    def _check_windows(self) -> None:
        """Read a table of windows; check the depth of reveals."""
        if isinstance(self.windows, (str, Path)):
            from umbra.readers.window_files import read_windows  # noqa: PLC0415

            object.__setattr__(self, "windows", read_windows(self.windows))
        if self.reveal in {None, "none"}:
            return
        try:
            depth = read_length(str(self.reveal))
            assert 0 <= depth <= _DEEPEST
        except (ValueError, AssertionError):
            msg = (
                f"reveal= is a depth of 0 to {_DEEPEST:g} m, or 'none' to judge on the outer face; "
                f"got {show_value(self.reveal)}"
            )
            raise InputError(msg, option="reveal") from None
        object.__setattr__(self, "reveal", depth)

    def _check_areas(self) -> None:
        """Read a file of areas; check what they are judged on, and the least sun."""
        from umbra.study.compare import read_hours  # noqa: PLC0415  (the help needs none)

        if self.areas is None:
            defaults = {"areas_on": "ground", "band": (), "roads": None, "least": "2h"}
            for name, default in defaults.items():
                given = getattr(self, name)
                if type(given) is not type(default) or given != default:
                    msg = f"{name}= is about areas; give areas='FILE', or leave it out"
                    raise InputError(msg, option=name)
            return
        from umbra.receivers.area_search import check_areas  # noqa: PLC0415
        from umbra.receivers.areas import AreaLevel  # noqa: PLC0415
        from umbra.receivers.bands import read_bands  # noqa: PLC0415

        read_bands(self.band)
        object.__setattr__(self, "areas", check_areas(self.areas))
        if self.roads is not None:
            if not self.band:
                msg = "roads= moves the boundary of bands; give band='NEAR,FAR', or leave it out"
                raise InputError(msg, option="roads")
            object.__setattr__(self, "roads", check_areas(self.roads, "roads"))
        AreaLevel.of(self.areas_on)
        read_hours(self.least, "least")

    def _check_receivers(self) -> None:
        """Refuse options of other receivers; require the options that these receivers need."""
        own = [(name, said) for name, said, _ in list_options(self) if self._is_own(name, said)]
        needed = {name: said for name, said in own if said.is_needed}
        for name in needed:
            if getattr(self, name) is None:
                listed = " and ".join(f"{name}={said.form}" for name, said in needed.items())
                msg = f"receivers='{self.receivers}' needs {listed}; give what is missing"
                raise InputError(msg, option=name)
        for name, said, default in list_options(self):
            value = getattr(self, name)
            if not said.receivers or self._is_own(name, said) or value is default:
                continue
            if default is None or value != default:
                taken = ", ".join(f"{name}=" for name, said in own if said.flag is not None)
                takes = f", which takes {taken}" if taken else ""
                few = said.receivers if len(said.receivers) == 1 else ()
                other = "".join(f", or choose receivers='{kind}'" for kind in few)
                msg = f"{name}= is not for receivers='{self.receivers}'{takes}; leave it out{other}"
                raise InputError(msg, option=name)

    @cached_property
    def measures(self) -> list[Measure]:
        """The measures that are asked for besides hours of sun and shadow."""
        from umbra.study.measures import HOURS, find_measures  # noqa: PLC0415

        return [measure for measure in find_measures(self.measure) if measure.name not in HOURS]

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The variables of these measures."""
        return tuple(quantity for measure in self.measures for quantity in measure.quantities)

    @property
    def asks_hours(self) -> bool:
        """Whether hours of sun and shadow are asked for."""
        from umbra.study.measures import HOURS  # noqa: PLC0415

        return not self.measure or bool({*HOURS} & {*self.measure})

    @property
    def needs_sun(self) -> bool:
        """Whether a measure is of the sun, so that a date and a site are needed."""
        return self.asks_hours or any(measure.needs_sun for measure in self.measures)

    @property
    def needs_site(self) -> bool:
        """Whether a measure is of suns, or land is a raster, so that a site is needed."""
        from umbra.land.named_land import is_raster  # noqa: PLC0415

        is_of_suns = self.needs_sun or any(measure.needs_site for measure in self.measures)
        return is_of_suns or is_raster(self.horizon)

    @cached_property
    def weather_year(self) -> Weather:
        """The weather file, read."""
        from umbra.lights import read_weather  # noqa: PLC0415

        return read_weather(self.weather)

    def _check_measures(self) -> None:
        """Check the measures' names and options; require a date where one is of the sun."""
        from umbra.study.measures.climate_files import check_files  # noqa: PLC0415

        names = [name.strip() for text in self.measure for name in text.split(",")]
        object.__setattr__(self, "measure", tuple(dict.fromkeys(filter(None, names))))
        self._check_added()
        check_files(self, self.measures)
        if self.date is None or (isinstance(self.date, (list, tuple)) and not self.date):
            object.__setattr__(self, "date", None)
            if self.needs_sun:
                of = "" if not self.measure else f" of {', '.join(self.measure)}"
                msg = f"a study{of} needs a date; give date='YYYY-MM-DD'"
                raise InputError(msg, option="date")
        if self.asks_hours:
            return
        taken = {
            "proposed",
            "replace",
            "replace_in",
            *["exact"] * any(measure.has_exact for measure in self.measures),
        }
        taken |= {name for measure in self.measures for name in measure.takes}
        for name, said, default in list_options(self):
            is_other = said.heading == "Results" and name not in taken
            if is_other and getattr(self, name) != default:
                msg = (
                    f"{name}= is of hours of sun, which are not asked for; add sun_hours to "
                    "measure=, or leave it out"
                )
                raise InputError(msg, option=name)

    def _check_added(self) -> None:
        """Check what measures and the kind, which may be of packages, say of themselves."""
        known = [name for name, *_ in list_options(self)]
        told = [(f"measure '{one.name}'", "measure", one.takes) for one in self.measures]
        for what, named, given in (
            *told,
            (f"receivers='{self.kind.name}'", "receivers", self.kind.takes),
        ):
            if isinstance(given, str) or not all(isinstance(one, str) for one in given):
                msg = f"{what} takes {show_value(given)}; make it a tuple of names of options"
                raise InputError(msg, option=named)
            if wrong := [name for name in given if name not in known]:
                near = find_similar(wrong[0], known)
                advice = f"did you mean '{near[0]}'?" if near else "name options of a study"
                msg = f"{what} takes '{wrong[0]}', which is no option of a study; {advice}"
                raise InputError(msg, option=named)
        from umbra.study.attributes import check_quantities  # noqa: PLC0415  (the help needs none)

        check_quantities(self.measures)

    def _check_values(self) -> None:
        """Check dates, times, durations and shares, before any model is read."""
        from umbra.casters import check_transmissivity  # noqa: PLC0415
        from umbra.sun import make_steps, parse_dates  # noqa: PLC0415
        from umbra.sun.clock import check_steps, parse_duration  # noqa: PLC0415
        from umbra.sun.day_times import is_of_the_sun  # noqa: PLC0415
        from umbra.sun.local_time import has_offset  # noqa: PLC0415

        # UTC has no missing or repeated times: what fails here fails in every zone. Offsets
        # are checked at the site.
        if self.date is not None:
            days, every = parse_dates(self.date, self.every_days), self.every
        times = self.start, self.end
        if self.date is not None and not any(map(has_offset, times)) and not any(
            map(is_of_the_sun, times)
        ):  # fmt: skip
            check_steps(make_steps(days[0], self.start, self.end, every, "UTC"), len(days), every)
        if self.min_spell is not None:
            parse_duration(self.min_spell, "least spell", "min_spell")
        if isinstance(self.under, str):
            parse_duration(self.under, "least sun", "under")
        if self.under is not None and not self.proposed:
            msg = "under= is about what a proposal takes away; name its parts with proposed="
            raise InputError(msg, option="under")
        given = {"replace": len(self.replace) > 0, "replace_in": self.replace_in is not None}
        for name, is_asked in given.items():
            if is_asked and not self.proposed:
                msg = f"{name}= is what a proposal replaces; name its parts with proposed="
                raise InputError(msg, option=name)
        self._check_disc()
        self._check_horizon()
        check_transmissivity(self.canopy, self.transmissivity, self.leaf_on)

    def _check_horizon(self) -> None:
        """Read the horizon; refuse what does not know the land."""
        if self.horizon is None:
            if self.horizon_from is not None:
                msg = "horizon_from= is of a raster of heights; give horizon='FILE.tif', or leave "
                raise InputError(msg + "it out", option="horizon_from")
            return
        from umbra.land.named_land import check_nearest  # noqa: PLC0415  (the help needs none)
        from umbra.lights import Horizon, read_horizon  # noqa: PLC0415

        is_settled = isinstance(self.horizon, Horizon)
        object.__setattr__(self, "horizon", read_horizon(self.horizon))
        check_nearest(self.horizon, self.horizon_from, is_settled=is_settled)

    def _check_disc(self) -> None:
        """Refuse what is of the sun's middle alone beside its disc."""
        others = ("by", "who", "proposed", "spells", "exact", "min_spell", "masks", "canopy")
        wrong = [name for name in others if getattr(self, name)]
        if self.disc and wrong:
            msg = f"disc= counts hours and contacts; {wrong[0]}= is of the sun's middle, leave it "
            msg += "or disc= out"
            raise InputError(msg, option="disc")

    @cached_property
    def kind(self) -> ReceiverKind:
        """Kind of the receivers; a plan for ``auto``."""
        from umbra.receivers import find_kind  # noqa: PLC0415  (the help needs none)

        return find_kind(self.receivers)

    def _is_own(self, name: str, said: Option) -> bool:
        """Return whether an option is for receivers of this kind among others."""
        return self.kind.name in said.receivers or name in self.kind.takes

    @property
    def attributes(self) -> dict[str, object]:
        """Options of the receivers, as attributes of the result."""
        return {
            said.attribute: getattr(self, name)
            for name, said, _ in list_options(self)
            if said.attribute and (not said.receivers or self._is_own(name, said))
        }

    def ask_hours(self, receivers: str, *, measures: bool = False, **changes: Any) -> StudyOptions:
        """Return options of other receivers, for hours or the same measures, and no more."""
        from umbra.receivers import find_kind  # noqa: PLC0415

        kind = find_kind(receivers).name
        by_caster = (
            {"by", "who"}
            if measures and any(measure.by_caster for measure in self.measures)
            else ()
        )
        dropped = {
            name: default
            for name, said, default in list_options(self)
            if name not in by_caster
            and (
                said.heading in ({"Results"} if measures else {"Results", "Measures"})
                or (said.receivers and kind not in said.receivers)
                or (name in _OF_AREAS and kind != "areas")
            )
        }
        return replace(self, **{**dropped, "receivers": receivers, **changes})
