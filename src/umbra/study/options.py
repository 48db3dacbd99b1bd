"""
Options of a study: each with its type, default, unit, help, flag and heading.

``StudyOptions`` defines the command's options and headings, the checks of types and some
attributes of the result; ``umbra.shadow_study`` writes its signature out in full, and a test
compares the two.
"""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from umbra.devices import find_device
from umbra.errors import InputError, show_value
from umbra.options import Option, check_types, list_options, option

if TYPE_CHECKING:
    from umbra.lights import Weather
    from umbra.receivers import ReceiverKind
    from umbra.study.measures import Measure, Quantity

__all__ = ["StudyOptions"]

Refraction = Literal["standard", "none"]
Date = str | dt.date
Duration = str | dt.timedelta

_time = partial(option, heading="Time")
_receivers = partial(option, heading="Receivers")
_casters = partial(option, heading="Casters")
_measures = partial(option, heading="Measures")
_results = partial(option, heading="Results")
_running = partial(option, heading="Running")
_CAMERA = ("camera",)
_RASTERS = ("ground", "top", "elevation", "view", "camera")


@dataclass(frozen=True, kw_only=True, eq=False)
class StudyOptions:
    """
    Options of a study, checked and normalised; see ``umbra.shadow_study``.

    Raises
    ------
    InputError
        If a value is wrong, or does not apply to these receivers.
    """

    date: Date | Sequence[Date] | None = _time(
        "dates",
        "Local date YYYY-MM-DD; also A,B or A..B, a month 2026-06, a year 2026, or 2026-*-21 "
        "for a day of every month; repeatable. Needed by measures of the sun.",
        metavar="DATE",
        unless="measure",
    )
    start: str | dt.time = _time(
        "any", "Start, by the local clock.", default="09:00", flag="--from", metavar="HH:MM"
    )
    end: str | dt.time = _time(
        "any", "End; 24:00 is midnight.", default="17:00", flag="--to", metavar="HH:MM"
    )
    every: Duration = _time(
        "any", "Time step, such as 30s, 15min or 1h.", default="15min", metavar="DURATION"
    )
    every_days: int = _time(
        "whole", "Take only every N-th day of a range, a month or a year.", default=1, least=1,
        metavar="N",
    )  # fmt: skip
    by_day: bool | None = _time(
        "flag",
        "Write results of each date, too, or only of all together; default: of each up to 12.",
        flag="--by-day/--sum",
    )
    refraction: Refraction = _time(
        "choice", "The sun's apparent position (standard), or its position without air (none).",
        default="standard", choices=("standard", "none"), attribute="refraction",
    )  # fmt: skip
    measure: Sequence[str] = _measures(
        "texts",
        "What is measured, one or several by commas: sun_hours and shadow_hours (default), "
        "sky_view_factor, sky_component; of a year of suns probable_sun_hours, probable_sun_share, "
        "winter_probable_sun_share; of --weather sunshine_hours, irradiation (and "
        "irradiation_beam, irradiation_sky, irradiation_ground).",
        default=(), metavar="NAME,...", registry="measure",
    )  # fmt: skip
    sky_directions: int | str = _measures(
        "any",
        "Directions of the sky, spread evenly: a number; or tregenza (145), reinhart2 (577), "
        "reinhart4 (2305), to compare with other tools.",
        default=4096, metavar="N|NAME",
    )  # fmt: skip
    weather: Any = _measures(
        "table",
        "A year of weather: EPW, or TMY3 or PVGIS' typical year (csv); without --date all of it.",
        metavar="FILE",
    )  # fmt: skip
    albedo: float = _measures(
        "number", "Share of the light that the ground reflects, for irradiation.", default=0.2,
        metavar="SHARE",
    )  # fmt: skip
    sunshine: Any = _measures(
        "table",
        "CSV file month,share: the probability that the sun shines; default: 1 in every month.",
        metavar="FILE",
    )  # fmt: skip
    receivers: str = _receivers(
        "text",
        "Where shadows are counted. ground: the ground alone, without roofs; top: ground and "
        "roofs, as seen from straight above; auto: top where the model has ground of its own, "
        "else ground; north, east, south, west or an azimuth in degrees: the elevation seen from "
        "there; 215/35: a view "
        "from azimuth 215, looking down 35 degrees; camera: the view from --eye; surfaces: walls "
        "and roofs, sampled; points: the places in --points.",
        default="auto",
        metavar="WHAT",
        registry="receivers",
    )
    spacing: float = _receivers(
        "length", "Distance between the samples of surfaces [m].", default=0.5, unit="m",
        metavar="M", receivers=("surfaces",), attribute="spacing_m",
    )  # fmt: skip
    on: Sequence[str] = _receivers(
        "patterns",
        "Sample these parts alone or, in elevations and camera views, show these alone: names, "
        "kinds or layers; repeatable.",
        default=(),
        receivers=("elevation", "view", "camera", "surfaces"),
    )
    points: Any = _receivers(
        "table",
        "CSV file of points: x,y,z or x,y,z,nx,ny,nz in the model's coordinates. A point without "
        "a normal is judged from both sides of a surface on which it lies.",
        unit="m", metavar="FILE", receivers=("points",), is_needed=True,
    )  # fmt: skip
    names: Sequence[str] = _receivers("texts", default=(), flag=None, receivers=("points",))
    eye: Sequence[float] | None = _receivers(
        "numbers", "Position of the camera [m].", unit="m", count=3, metavar="X,Y,Z",
        receivers=_CAMERA, attribute="eye", is_needed=True,
    )  # fmt: skip
    target: Sequence[float] | None = _receivers(
        "numbers", "Point that the camera looks at [m].", unit="m", count=3, metavar="X,Y,Z",
        receivers=_CAMERA, attribute="target", is_needed=True,
    )  # fmt: skip
    fov: float = _receivers(
        "number", "The camera's vertical field of view.", default=50.0, unit="degree",
        metavar="DEG", receivers=_CAMERA, attribute="fov_deg",
    )  # fmt: skip
    ground: float | str | None = _receivers(
        "ground", "What the ground is: feet, a surface through the feet of the buildings; level, "
        "a plane at their median height; a height [m]; or a terrain file. Default: the file's own "
        "ground or terrain; else feet where they differ by more than 3 m, else level.", unit="m",
        metavar="feet|level|Z|FILE",
    )  # fmt: skip
    extent: Sequence[float] | None = _receivers(
        "numbers", "Rectangle of the plan [m]; default: the model and its shadows.", unit="m",
        count=4, metavar="XMIN,YMIN,XMAX,YMAX", receivers=_RASTERS,
    )  # fmt: skip
    cell: float | None = _receivers(
        "length", "Side of a cell [m]; default: about 1000 cells on the longer side.", unit="m",
        metavar="M", receivers=_RASTERS,
    )  # fmt: skip
    size: Sequence[int] | None = _receivers(
        "size", "Size of the raster, instead of --cell.", count=2, receivers=_RASTERS
    )
    cast: Sequence[str] = _casters(
        "patterns", "Only these parts cast shadows: names or kinds; repeatable.", default=()
    )
    no_cast: Sequence[str] = _casters(
        "patterns", "These parts cast no shadows: names or kinds; repeatable.", default=()
    )
    canopy: Sequence[str] = _casters(
        "patterns",
        "Parts that transmit a share of the light, such as trees: names, kinds or layers; "
        "repeatable.",
        default=(),
    )
    transmissivity: str | float | Sequence[float] | None = _casters(
        "any",
        "Share of the light that passes canopies, such as 0.1, or 0.1:0.6 with leaves and without; "
        "default: 0.03.",
        metavar="SHARE",
    )
    leaf_on: str | None = _casters(
        "any", "With two shares: the days from which and to which trees have leaves.",
        metavar="MM-DD..MM-DD",
    )  # fmt: skip
    by: Literal["part", "kind", "layer"] | None = _results(
        "choice",
        "Also write the hours of shadow due to each part, kind or layer; with --who only to those.",
        choices=("part", "kind", "layer"),
    )
    who: Sequence[str] = _results(
        "patterns",
        "Also write the hours of shadow due to these parts: names, kinds or layers; repeatable.",
        default=(),
    )
    proposed: Sequence[str] = _results(
        "patterns",
        "Parts of the proposed development: also write the sun that they take from the others; "
        "repeatable.",
        default=(),
    )
    under: str | float | dt.timedelta | None = _results(
        "any",
        "With --proposed: find where fewer hours of sun are left than this, but were not "
        "before; default: 2h.",
        metavar="DURATION",
    )
    spells: bool = _results(
        "flag",
        "Also write when sun first and last comes, how often it returns, the longest time of "
        "sun, and the share of time in shadow.",
        default=False,
    )
    exact: bool | float = _results(
        "flag",
        "Compute when each cell enters and leaves shadow, to a second, instead of adding up steps; "
        "and measures of the sky by the outlines of the free sky, instead of directions.",
        default=False,
        least=0,
    )
    min_spell: Duration | None = _results(
        "any", "Also write the hours of sun that last this long at a time; implies --spells.",
        metavar="DURATION",
    )  # fmt: skip
    masks: bool = _results(
        "flag", "Also write which cells are in shadow at each step.", default=False
    )
    device: str = _running(
        "text", "What counts: auto (cpu, or a GPU that proves faster on large plans), cpu, gl.",
        default="auto", metavar="NAME", registry="device",
    )  # fmt: skip
    threads: int | None = _running(
        "whole", "Number of threads; default: all cores.", least=1, metavar="N",
        is_kept=False,
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

    def _check_receivers(self) -> None:
        """Refuse options of other receivers; require the options that these receivers need."""
        own = [(name, said) for name, said, _ in list_options(self) if self._is_own(name, said)]
        needed = {name: said for name, said in own if said.is_needed}
        for name in needed:
            if getattr(self, name) is None:
                listed = " and ".join(f"{one}={said.form}" for one, said in needed.items())
                msg = f"receivers='{self.receivers}' needs {listed}; give what is missing"
                raise InputError(msg, option=name)
        for name, said, default in list_options(self):
            value = getattr(self, name)
            if not said.receivers or self._is_own(name, said) or value is default:
                continue
            if default is None or value != default:
                taken = ", ".join(f"{one}=" for one, said in own if said.flag is not None)
                takes = f", which takes {taken}" if taken else ""
                few = said.receivers if len(said.receivers) == 1 else ()
                other = "".join(f", or choose receivers='{kind}'" for kind in few)
                msg = f"{name}= is not for receivers='{self.receivers}'{takes}; leave it out{other}"
                raise InputError(msg, option=name)

    @cached_property
    def measures(self) -> "list[Measure]":
        """The measures that are asked for besides hours of sun and shadow."""
        from umbra.study.measures import HOURS, find_measures  # noqa: PLC0415

        return [one for one in find_measures(self.measure) if one.name not in HOURS]

    @property
    def quantities(self) -> "tuple[Quantity, ...]":
        """The variables of these measures."""
        return tuple(one for measure in self.measures for one in measure.quantities)

    @property
    def asks_hours(self) -> bool:
        """Whether hours of sun and shadow are asked for."""
        from umbra.study.measures import HOURS  # noqa: PLC0415

        return not self.measure or bool({*HOURS} & {*self.measure})

    @property
    def needs_sun(self) -> bool:
        """Whether a measure is of the sun, so that a date and a site are needed."""
        return self.asks_hours or any(one.needs_sun for one in self.measures)

    @property
    def needs_site(self) -> bool:
        """Whether a measure is of suns, so that a site is needed."""
        return self.needs_sun or any(one.needs_site for one in self.measures)

    @cached_property
    def weather_year(self) -> "Weather":
        """The weather file, read."""
        from umbra.lights import read_weather  # noqa: PLC0415

        return read_weather(self.weather)

    def _check_measures(self) -> None:
        """Check the measures' names and options; require a date where one is of the sun."""
        from umbra.study.measures.files import check_files  # noqa: PLC0415

        names = [name.strip() for text in self.measure for name in text.split(",")]
        object.__setattr__(self, "measure", tuple(dict.fromkeys(filter(None, names))))
        check_files(self, self.measures)
        if self.date is None or (isinstance(self.date, (list, tuple)) and not self.date):
            object.__setattr__(self, "date", None)
            if self.needs_sun:
                of = "" if not self.measure else f" of {', '.join(self.measure)}"
                msg = f"a study{of} needs a date; give date='YYYY-MM-DD'"
                raise InputError(msg, option="date")
        if self.asks_hours:
            return
        taken = {"proposed", *["exact"] * any(one.has_exact for one in self.measures)}
        taken |= {name for one in self.measures for name in one.takes}
        for name, said, default in list_options(self):
            is_other = said.heading == "Results" and name not in taken
            if is_other and getattr(self, name) != default:
                msg = (
                    f"{name}= is of hours of sun, which are not asked for; add sun_hours to "
                    "measure=, or leave it out"
                )
                raise InputError(msg, option=name)

    def _check_values(self) -> None:
        """Check dates, times, durations and shares, before any model is read."""
        from umbra.casters import check_transmissivity  # noqa: PLC0415
        from umbra.sun import make_steps, parse_dates  # noqa: PLC0415
        from umbra.sun.clock import check_steps, parse_duration  # noqa: PLC0415
        from umbra.sun.local_time import has_offset  # noqa: PLC0415

        # UTC has no missing or repeated times: what fails here fails in every zone. Offsets
        # are checked at the site.
        if self.date is not None:
            days, every = parse_dates(self.date, self.every_days), self.every
        if self.date is not None and not has_offset(self.start) and not has_offset(self.end):
            check_steps(make_steps(days[0], self.start, self.end, every, "UTC"), len(days), every)
        if self.min_spell is not None:
            parse_duration(self.min_spell, "least spell", "min_spell")
        if isinstance(self.under, str):
            parse_duration(self.under, "least sun", "under")
        if self.under is not None and not self.proposed:
            msg = "under= is about what a proposal takes away; name its parts with proposed="
            raise InputError(msg, option="under")
        check_transmissivity(self.canopy, self.transmissivity, self.leaf_on)

    @cached_property
    def kind(self) -> "ReceiverKind":
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

    def ask_hours(
        self, receivers: str, *, measures: bool = False, **changes: Any
    ) -> "StudyOptions":
        """Return options of other receivers, for hours or the same measures, and no more."""
        from umbra.receivers import find_kind  # noqa: PLC0415

        kind = find_kind(receivers).name
        dropped = {
            name: default
            for name, said, default in list_options(self)
            if said.heading in ({"Results"} if measures else {"Results", "Measures"})
            or (said.receivers and kind not in said.receivers)
        }
        return replace(self, **{**dropped, "receivers": receivers, **changes})
