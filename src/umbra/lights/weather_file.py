"""
Weather files: EPW, TMY3 (CSV) and PVGIS' typical year (CSV).

Only the irradiance, the times and the place are read. EPW and TMY3 end their hours: hour 1 runs
from 0:00 to 1:00 of the place's standard time, and its sun stands at the half (EnergyPlus,
"Auxiliary Programs"; Wilcox and Marion 2008, NREL/TP-581-43156). PVGIS gives values of an instant
of UTC, later than the time that it writes by the offset that its head names.
"""

import csv
import hashlib
import math
import re
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, make_printable, shorten, show_value
from umbra.lights.weather_year import Weather

__all__ = ["read_weather"]

_LARGEST = 32_000_000  # [byte]; an EPW has 1.6 million
_MOST_ROWS = 8784
_MOST = 2000.0  # irradiance above which no hour is [W/m2]
_DAYS = (31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)
_FIRST = np.cumsum((0, *_DAYS[:-1]))
_TYPICAL = 2001  # stands for a year whose months are of several
_ENERGY = ("global horizontal", "direct normal", "diffuse horizontal")
_OFFSET = re.compile(r"irradiance time offset \(h\)\s*:\s*([-+0-9.]+)", re.IGNORECASE)


class _Row(NamedTuple):
    line: int
    year: int
    month: int
    day: int
    hour: int  # 0 to 23, the hour's start
    values: tuple[float, ...]


class _Read(NamedTuple):
    place: tuple[float, float, float]  # latitude, longitude, elevation
    utc_offset: float
    sun_at: float
    rows: list[_Row]


class _Lines:
    """Rows of a table with their line numbers, for error messages."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = text.splitlines()

    def refuse(self, what: str, remedy: str) -> NoReturn:
        """Raise the error of a wrong file."""
        msg = f"{self.path}: {what}; {remedy}"
        raise InputError(msg, option="weather", path=self.path) from None

    def find(self, start: str) -> int:
        """Return the number of the line of the head that starts with some words."""
        head = (line.lower() for line in self.lines[:100])
        number = next((n for n, line in enumerate(head, 1) if line.startswith(start)), None)
        if number is None:
            self.refuse(f"has no line '{start.upper()}' in its head", _WHOLE)
        return number

    def split(self, first: int) -> Iterator[tuple[int, list[str]]]:
        """Yield the numbers and words of the lines from one on, counted from 1."""
        try:
            yield from enumerate(csv.reader(self.lines[first - 1 :]), first)
        except csv.Error as error:
            self.refuse(f"cannot be read as a table ({error})", "give the file whole")

    def read_numbers(self, line: int, words: Sequence[str], where: Sequence[int]) -> list[float]:
        """Return the finite numbers of some columns of a line."""
        try:
            numbers = [float(words[column]) for column in where]
        except (ValueError, IndexError):
            numbers = [math.nan]
        if not all(map(math.isfinite, numbers)):
            shown = shorten(make_printable(",".join(words)), 60)
            self.refuse(f"line {line} has not the numbers it should ({shown})", _WHOLE)
        return numbers


_WHOLE = "give a whole year, as it was downloaded"


def read_weather(path: Any) -> Weather:
    """
    Read a year of weather.

    Parameters
    ----------
    path : str or path

    Returns
    -------
    weather : Weather

    Raises
    ------
    InputError
        If the file cannot be read, is none of these formats, lacks an hour or has one twice, or a
        value is missing or none that irradiance has.
    """
    if not isinstance(path, (str, Path)):
        msg = f"weather is a file; got {show_value(path)}"
        raise InputError(msg, option="weather")
    path = Path(path)
    data = _read_bytes(path)
    lines = _Lines(path, data.decode("utf-8-sig", "replace"))
    read = _find_format(lines)(lines)
    latitude, longitude, elevation = read.place
    is_place = abs(latitude) <= 90 and abs(longitude) <= 180 and -500 <= elevation <= 9000
    if not is_place or abs(read.utc_offset) > 14:
        site = f"{latitude:g}°, {longitude:g}°, {elevation:g} m, UTC{read.utc_offset:+g}"
        lines.refuse(f"its place ({site}) is not on earth", "correct its head")
    values, years = _order(lines, read.rows)
    is_leap = len(values) > 365 * 24
    year = years.pop() if len(years) == 1 else 2000 if is_leap else _TYPICAL
    if not 1 <= year <= 3000 or (year % 4 == 0) != is_leap:
        year = 2000 if is_leap else _TYPICAL
    return Weather(
        make_printable(path.name), hashlib.sha256(data).hexdigest(), latitude, longitude,
        elevation, read.utc_offset, read.sun_at, year, values,
    )  # fmt: skip


def _read_bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        msg = f"{path}: {reason}; name a weather file (EPW, TMY3 or PVGIS)"
        raise InputError(msg, option="weather", path=path) from None
    if len(data) > _LARGEST:
        msg = f"{path}: is larger than {_LARGEST / 1e6:.0f} MB; give one year of hours"
        raise InputError(msg, option="weather", path=path)
    return data


def _find_format(lines: _Lines) -> Any:
    """Return what reads a file, told by its first lines."""
    first, second = (line.strip().lower() for line in (*lines.lines[:2], "", "")[:2])
    if first.startswith("location,"):
        return _read_epw
    if second.startswith("date (mm/dd/yyyy),time (hh:mm)"):
        return _read_tmy3
    if not first.startswith("latitude (decimal degrees)"):
        lines.refuse("is not a weather file that umbra reads", "give EPW, TMY3 or PVGIS (csv)")
    return _read_pvgis


def _read_epw(lines: _Lines) -> _Read:
    _, head = next(lines.split(1))
    latitude, longitude, utc_offset, elevation = lines.read_numbers(1, head, (6, 7, 8, 9))
    begin = lines.find("data periods") + 1
    rows: list[_Row] = []
    for line, words in islice(lines.split(begin), _MOST_ROWS + 2):
        if any(map(str.strip, words)):
            when = _as_whole(lines, line, lines.read_numbers(line, words, (0, 1, 2, 3)))
            year, month, day, hour = when
            values = tuple(lines.read_numbers(line, words, (13, 14, 15)))
            rows.append(_Row(line, year, month, day, hour - 1, values))
    return _Read((latitude, longitude, elevation), utc_offset, 0.5, rows)


def _read_tmy3(lines: _Lines) -> _Read:
    _, head = next(lines.split(1))
    utc_offset, latitude, longitude, elevation = lines.read_numbers(1, head, (3, 4, 5, 6))
    _, names = next(lines.split(2))
    wanted = ("ghi (w/m^2)", "dni (w/m^2)", "dhi (w/m^2)")
    where = _find_columns(lines, names, wanted)
    rows: list[_Row] = []
    for line, words in islice(lines.split(3), _MOST_ROWS + 2):
        if any(map(str.strip, words)):
            month, day, year = _as_whole(lines, line, _split_numbers(lines, line, words, 0, "/"))
            hour, _ = _as_whole(lines, line, _split_numbers(lines, line, words, 1, ":"))
            values = tuple(lines.read_numbers(line, words, where))
            rows.append(_Row(line, year, month, day, hour - 1, values))
    return _Read((latitude, longitude, elevation), utc_offset, 0.5, rows)


def _read_pvgis(lines: _Lines) -> _Read:
    begin = lines.find("time(utc)")
    site = [
        lines.read_numbers(n, [line.partition(":")[2]], (0,))[0]
        for n, line in enumerate(lines.lines[:3], 1)
    ]
    offset = next((match for line in lines.lines[:begin] if (match := _OFFSET.search(line))), None)
    sun_at = 0.0 if offset is None else lines.read_numbers(0, [offset[1]], (0,))[0]
    if not -1 <= sun_at <= 1:
        lines.refuse(
            f"its irradiance time offset ({sun_at:g} h) is over an hour", "correct its head"
        )
    _, names = next(lines.split(begin))
    where = _find_columns(lines, names, ("g(h)", "gb(n)", "gd(h)"))
    rows: list[_Row] = []
    for line, words in islice(lines.split(begin + 1), _MOST_ROWS + 2):
        match = re.fullmatch(r"(\d{4})(\d{2})(\d{2}):(\d{2})(\d{2})", words[0] if words else "")
        if match is None:  # what follows the table explains its columns
            break
        year, month, day, hour, minute = map(int, match.groups())
        if rows and minute != 0:
            lines.refuse(f"line {line} is of minute {minute}", "give PVGIS' own hours")
        values = tuple(lines.read_numbers(line, words, where))
        rows.append(_Row(line, year, month, day, hour, values))
    return _Read((site[0], site[1], site[2]), 0.0, sun_at, rows)


def _find_columns(lines: _Lines, names: Sequence[str], wanted: Sequence[str]) -> list[int]:
    known = [name.strip().lower() for name in names]
    missing = [name for name in wanted if name not in known]
    if missing:
        lines.refuse(f"has no column {', '.join(missing)}", _WHOLE)
    return [known.index(name) for name in wanted]


def _split_numbers(
    lines: _Lines, line: int, words: Sequence[str], column: int, by: str
) -> list[float]:
    """Return the numbers of a date, ``12/31/1999``, or of a time, ``24:00``."""
    parts = words[column].split(by) if column < len(words) else []
    return lines.read_numbers(line, parts, range(3 if by == "/" else 2))


def _as_whole(lines: _Lines, line: int, numbers: Sequence[float]) -> list[int]:
    if any(number != int(number) for number in numbers):
        lines.refuse(f"line {line} has no whole date and hour", _WHOLE)
    return [int(number) for number in numbers]


def _order(lines: _Lines, rows: Sequence[_Row]) -> tuple[NDArray[np.float64], set[int]]:
    """Return the values in the order of the year, each hour once, and the years they are of."""
    if not rows:
        lines.refuse("has no hours", _WHOLE)
    if len(rows) > _MOST_ROWS:
        lines.refuse(f"has more than the {_MOST_ROWS:,} hours of a year", "give one year")
    values = np.full((_MOST_ROWS, 3), np.nan)
    for row in rows:
        known = 1 <= row.month <= 12 and 1 <= row.day <= _DAYS[row.month - 1]
        if not known or not 0 <= row.hour < 24:
            lines.refuse(f"line {row.line} is of no hour of a year", _WHOLE)
        index = (_FIRST[row.month - 1] + row.day - 1) * 24 + row.hour
        if not np.isnan(values[index, 0]):
            lines.refuse(f"line {row.line} gives {_name(index)} again", "give hours, each once")
        for what, value in zip(_ENERGY, row.values, strict=True):
            if not 0 <= value <= _MOST:
                fault = f"line {row.line} has {value:g} W/m2 of {what} irradiance"
                how = "a missing value" if value >= _MOST else "no irradiance"
                lines.refuse(f"{fault}, which is {how}", "fill or correct it")
        values[index] = row.values
    leap = slice((31 + 28) * 24, (31 + 29) * 24)
    if np.isnan(values[leap, 0]).all():
        places = np.r_[0 : leap.start, leap.stop : _MOST_ROWS]
    else:
        places = np.arange(_MOST_ROWS)
    missing = places[np.isnan(values[places, 0])]
    if len(missing):
        lines.refuse(
            f"lacks {len(missing):,} of {len(places):,} hours (first: {_name(missing[0])})", _WHOLE
        )
    return values[places], {row.year for row in rows}


def _name(index: int) -> str:
    """Name an hour of a leap year: ``3 February, hour 5``."""
    day, hour = divmod(int(index), 24)
    month = int(np.searchsorted(_FIRST, day, side="right"))
    when = np.datetime64("2000-01-01") + np.timedelta64(day, "D")
    return f"{when.item():%B} {day - int(_FIRST[month - 1]) + 1}, {hour}:00 to {hour + 1}:00"
