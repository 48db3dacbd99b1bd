"""Options of a study about when it is, and what is measured."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

from umbra.option_fields import Given, Options, option, record

__all__ = ["TimeOptions"]

_time = partial(option, heading="Time")
_measures = partial(option, heading="Measures")


@record
class TimeOptions(Options):
    """Options of time and measures; see ``umbra.shadow_study``."""

    date: str | dt.date | Sequence[str | dt.date] | None = _time(
        "dates", "Local date YYYY-MM-DD; also A,B or A..B, a month 2026-06, a year 2026, or "
        "2026-*-21 for a day of every month, 2026-winter-solstice, 2026-great-cold. Needed by "
        "measures of the sun.", more="Or dates of Python, NumPy or pandas.",
        metavar="DATE", unless="measure",
    )  # fmt: skip
    start: str | dt.time = _time(
        "any", "Start by the clock; or of the sun: sunrise+1h, altitude:10.",
        more="It rises and sets with its upper rim; an altitude is that of its middle.",
        default="09:00", flag="--from", metavar="TIME",
    )  # fmt: skip
    end: str | dt.time = _time(
        "any", "End; 24:00 is midnight; sunset-1h, altitude:10.",
        default="17:00", flag="--to", metavar="TIME",
    )  # fmt: skip
    clock: Literal["local", "standard", "solar"] = _time(
        "choice", "Clock of start and end: local; standard, without daylight saving time; solar, "
        "true solar time.",
        default="local", choices=("local", "standard", "solar"), attribute="clock",
    )  # fmt: skip
    every: str | dt.timedelta = _time(
        "any", "Time step, such as 30s, 15min or 1h.", default="15min", metavar="DURATION"
    )
    every_days: int = _time(
        "whole", "Take only every N-th day of a range, a month or a year.", default=1, least=1,
        metavar="N",
    )  # fmt: skip
    by_day: bool | None = _time(
        "flag", "Write results of each date, too, or only of all together; default: of each, up to "
        "12 dates.", more="They are along ``day``.", flag="--by-day/--sum",
    )  # fmt: skip
    refraction: Literal["standard", "none"] = _time(
        "choice", "The sun's apparent position (standard), or its position without air (none).",
        default="standard", choices=("standard", "none"), attribute="refraction",
    )  # fmt: skip
    horizon: Given[str | Path | Any | None, Any] = _time(
        "table", "Land up to 100 km away, which blocks the sun and the sky below it: a raster of "
        "heights (GeoTIFF), or a table azimuth,elevation from true north [degrees], PVGIS' horizon "
        "profile (text, JSON), or elevations that umbra sky writes (write='horizon').",
        more="Or elevations by azimuth as ``pvlib.iotools.get_pvgis_horizon`` returns them. A "
        "raster is seen from the ground at the model's middle; the horizon is the same from every "
        "receiver.",
        metavar="FILE",
    )  # fmt: skip
    horizon_from: Given[float | str | None, float | None] = _time(
        "length", "Distance from which the land of a raster counts; what is nearer is the model's; "
        "default: as far as the model reaches from its middle.",
        unit="m", metavar="M",
    )  # fmt: skip
    measure: Sequence[str] = _measures(
        "texts", "What is measured, one or several by commas: sun_hours and shadow_hours "
        "(default), sky_view_factor, sky_component, sky_blocked_by (with by= or who=); of a year "
        "of suns probable_sun_hours, probable_sun_share, winter_probable_sun_share; of weather= "
        "sunshine_hours, irradiation (and irradiation_beam, irradiation_sky, irradiation_ground).",
        more="Each is a variable.", default=(), metavar="NAME,...", registry="measure",
    )  # fmt: skip
    sky_directions: int | str = _measures(
        "any", "Directions of the sky, spread evenly: a number; or tregenza (145), reinhart2 "
        "(577), reinhart4 (2305), to compare with other tools.", default=4096, metavar="N|NAME",
    )  # fmt: skip
    weather: Given[str | Path | None, Any] = _measures(
        "table", "A year of weather: EPW, or TMY3 or PVGIS' typical year (csv); without date= all "
        "of it.", more="Its hours are by its own standard time.", metavar="FILE",
    )  # fmt: skip
    albedo: float = _measures(
        "number", "Share of the light that the ground reflects, for irradiation.", default=0.2,
        metavar="SHARE",
    )  # fmt: skip
    sunshine: Given[str | Path | Sequence[float] | None, Any] = _measures(
        "table", "CSV file month,share: the probability that the sun shines; default: 1 in every "
        "month.", more="Or twelve numbers.", metavar="FILE",
    )  # fmt: skip
