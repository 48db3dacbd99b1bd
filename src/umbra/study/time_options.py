"""Options of a study about when it is, and what is measured."""

import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from umbra.options import option

__all__ = ["Clock", "Date", "Duration", "Refraction", "TimeOptions"]

Clock = Literal["local", "standard", "solar"]
Refraction = Literal["standard", "none"]
Date = str | dt.date
Duration = str | dt.timedelta

_time = partial(option, heading="Time")
_measures = partial(option, heading="Measures")


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeOptions:
    """Options of time and measures; see ``umbra.shadow_study``."""

    date: Date | Sequence[Date] | None = _time(
        "dates",
        "Local date YYYY-MM-DD; also A,B or A..B, a month 2026-06, a year 2026, or 2026-*-21 "
        "for a day of every month, 2026-winter-solstice, 2026-great-cold; repeatable. Needed by "
        "measures of the sun.",
        metavar="DATE",
        unless="measure",
    )
    start: str | dt.time = _time(
        "any",
        "Start by the clock; or of the sun: sunrise+1h, altitude:10.",
        default="09:00",
        flag="--from",
        metavar="TIME",
    )
    end: str | dt.time = _time(
        "any",
        "End; 24:00 is midnight; sunset-1h, altitude:10.",
        default="17:00",
        flag="--to",
        metavar="TIME",
    )
    clock: Clock = _time(
        "choice",
        "Clock of start and end: local; standard, without daylight saving time; solar, true solar "
        "time.",
        default="local", choices=("local", "standard", "solar"), attribute="clock",
    )  # fmt: skip
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
    horizon: Any = _time(
        "table",
        "Land up to 100 km away, which blocks the sun and the sky below it: a raster of heights "
        "(GeoTIFF), or a table azimuth,elevation from true north [degrees], PVGIS' horizon profile "
        "(text, JSON), or elevations of --write horizon.",
        metavar="FILE",
    )  # fmt: skip
    horizon_from: Any = _time(
        "length", "Distance from which the land of a raster counts; what is nearer is the model's; "
        "default: as far as the model reaches from its middle.",
        unit="m", metavar="M",
    )  # fmt: skip
    measure: Sequence[str] = _measures(
        "texts",
        "What is measured, one or several by commas: sun_hours and shadow_hours (default), "
        "sky_view_factor, sky_component, sky_blocked_by (with --by or --who); of a year of suns "
        "probable_sun_hours, probable_sun_share, winter_probable_sun_share; of --weather "
        "sunshine_hours, irradiation (and irradiation_beam, irradiation_sky, "
        "irradiation_ground).",
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
