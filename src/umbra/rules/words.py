"""The words of rule files: measures, standings, dates and times, and what they mean."""

import re
from typing import NamedTuple

from umbra.errors import InputError
from umbra.sun.clock import parse_duration
from umbra.sun.day_times import CLOCKS

__all__ = [
    "MEASURES", "STANDINGS", "TERMS", "RuleQuantity", "check_date", "check_time", "read_amount",
    "tell_amount", "tell_hours", "tell_interval",
]  # fmt: skip


class RuleQuantity(NamedTuple):
    """What a measure is: its unit, its words, and whether it is of suns on dates."""

    unit: str
    words: str
    is_of_dates: bool = True


MEASURES = {
    "sun_hours": RuleQuantity("h", "sun"),
    "longest_sun_hours": RuleQuantity("h", "unbroken sun"),
    "sun_hours_in_spells": RuleQuantity("h", "sun in spells"),
    "shadow_hours": RuleQuantity("h", "shadow"),
    "hours_lost": RuleQuantity("h", "sun lost to the proposal"),
    "new_shadow_hours": RuleQuantity("h", "new shadow on some of it"),
    "new_shadow_share": RuleQuantity("%", "of the sun of an open place newly shaded"),
    "sky_view_factor": RuleQuantity("1", "sky view factor", is_of_dates=False),
    "sky_component": RuleQuantity("%", "vertical sky component", is_of_dates=False),
    "probable_sun_hours": RuleQuantity("h", "probable sun a year", is_of_dates=False),
    "probable_sun_share": RuleQuantity("%", "annual probable sunlight hours", is_of_dates=False),
    "winter_probable_sun_share": RuleQuantity(
        "%", "annual probable sunlight hours, those of winter", is_of_dates=False
    ),
}

STANDINGS = {
    "first-hand": "read in the authority's text, a copy of it, or an official page",
    "in-part": "read in the authority's text in part",
    "second-hand": "known from others' descriptions",
    "hearsay": "known from hearsay only",
    "own": "of the user's own file",
}

TERMS = (
    "winter-solstice", "summer-solstice", "equinox", "spring-equinox", "autumn-equinox",
    "great-cold", "year",
)  # fmt: skip
_DAY = r"(?:(?:\d{4})-)?\d{2}-\d{2}"
_DATE = re.compile(rf"{_DAY}(?:\.\.{_DAY})?")
_CLOCK = re.compile(r"\d{1,2}:\d{2}(?::\d{2})?(?:[+-]\d{2}:\d{2})?")
_EVENT = re.compile(r"(?:sunrise|sunset)(?:\s*[+-]\s*(?P<past>[0-9a-z.]+))?|altitude:\d+(?:\.\d+)?")
_MOST = 1e9
_ZERO = re.compile(r"0+(?:\.0+)?\s*(?:h|min|s)?")


def check_date(text: str) -> str | None:
    """Return what is wrong with a date of a rule; None if nothing is."""
    if text in TERMS:
        return None
    if not _DATE.fullmatch(text):
        return (
            f"'{text}' is not a date of a rule; write 03-21, 2026-03-21, 02-19..10-21, or one of "
            f"{', '.join(TERMS)}"
        )
    for day in text.split(".."):
        month, number = int(day[-5:-3]), int(day[-2:])
        longest = 30 if month in {4, 6, 9, 11} else 29 if month == 2 else 31
        if not 1 <= month <= 12 or not 1 <= number <= longest:
            return f"there is no date '{day}'; correct it"
    return None


def check_time(text: str) -> str | None:
    """Return what is wrong with the time of a day; None if nothing is."""
    if _CLOCK.fullmatch(text):
        hour, minute = map(int, text.split(":")[:2])
        known = hour < 24 and minute < 60 if (hour, minute) != (24, 0) else True
        return None if known else f"the time {text} is not on the clock; write 00:00 to 24:00"
    match = _EVENT.fullmatch(text)
    try:
        if match and match["past"] is not None:
            parse_duration(match["past"], "time past sunrise or sunset", "")
    except InputError as error:
        return str(error)
    if match:
        return None
    return f"'{text}' is not a time of a day; write 09:00, sunrise+1h, sunset-90min or altitude:10"


def read_amount(text: str, unit: str) -> float | None:
    """Return a limit in the unit of its measure: ``2h`` as 2.0, ``27`` as 27.0; None if wrong."""
    if unit == "h":
        if _ZERO.fullmatch(text):
            return 0.0
        try:
            return parse_duration(text, "limit", "").total_seconds() / 3600
        except InputError:
            return None
    try:
        value = float(text.removesuffix("%").strip())
    except ValueError:
        return None
    return value if 0 <= value < _MOST else None


def tell_hours(hours: float) -> str:
    """Describe hours: ``1 h 30 min``."""
    minutes = round(60 * hours)
    if 0 < hours < 1 / 120:
        return f"{3600 * hours:.0f} s"
    hour, minute = divmod(minutes, 60)
    words = f"{hour:,} h" if hour or not minute else ""
    return words + (f" {minute} min" if hour and minute else f"{minute} min" if minute else "")


def tell_interval(start: str, end: str, clock: str) -> str:
    """Describe hours of the day and their clock: ``08:00 to 16:00, true solar time``."""
    if (start, end) == ("00:00", "24:00"):
        return "sunrise to sunset"
    plain = ":" in start.replace("altitude:", "") or ":" in end.replace("altitude:", "")
    return f"{start} to {end}" + (f", {CLOCKS[clock]}" if plain else "")


def tell_amount(value: float, unit: str) -> str:
    """Describe a value with its unit."""
    if unit == "h":
        return tell_hours(value)
    if unit == "%":
        return f"{value:.1f} %" if abs(value) < 1000 else f"{value:,.0f} %"
    return f"{value:.3f}" + (f" {unit}" if unit != "1" else "")
