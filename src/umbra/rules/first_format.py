"""Rules of format 1: their reader, and the same as records of format 2."""

import datetime as dt
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from umbra.errors import InputError
from umbra.rules.file import Block, load_block
from umbra.rules.record import Condition, Place, Requirement, Rule
from umbra.sun.clock import make_steps, parse_duration
from umbra.sun.local_time import has_offset

__all__ = ["CHECK_KEYS", "MEASURES", "Check", "Rules", "convert", "read_rules"]

FORMAT = "1"
FILE_KEYS = ("format", "name", "version", "source", "checks")
CHECK_KEYS = (
    "name", "dates", "from", "to", "every", "min_altitude", "measure", "min_spell",
    "at_least", "at_most", "where", "share",
)  # fmt: skip
PLACE_KEYS = ("name", "x", "y")
MEASURES = ("sun_hours", "longest_sun_hours", "sun_hours_in_spells", "shadow_hours")
AREAS = ("open_ground", "roofs", "walls", "everywhere")
_DATE = re.compile(r"(?:(\d{4})-)?(\d{2})-(\d{2})")


@dataclass(frozen=True)
class Check:
    """
    A quantity to measure, and its limit.

    Parameters
    ----------
    name : str
    dates : tuple of (year or None, month, day)
        Each is judged separately; without a year, in the study's year.
    start, end, every : str
        Local clock and steps.
    min_altitude : float
        Least altitude of the sun that counts [degrees].
    measure : str
        One of ``MEASURES``.
    min_spell : timedelta
        For ``sun_hours_in_spells``.
    limit : timedelta
        Limit of the hours [h].
    is_least : bool
        Whether ``limit`` is a minimum, not a maximum.
    area : str
        One of ``AREAS``, or empty with places.
    places : tuple of Place
    share : float
        Share of the area that must meet the limit [%].
    """

    name: str
    dates: tuple[tuple[int | None, int, int], ...]
    start: str
    end: str
    every: str
    min_altitude: float
    measure: str
    min_spell: dt.timedelta
    limit: dt.timedelta
    is_least: bool
    area: str
    places: tuple[Place, ...]
    share: float


@dataclass(frozen=True)
class Rules:
    """
    A rule file.

    Parameters
    ----------
    name, version, source : str
        Author, edition and source of the rule.
    checks : tuple of Check
    """

    name: str
    version: str
    source: str
    checks: tuple[Check, ...]


def read_rules(path: str | os.PathLike[str]) -> Rules:
    """
    Read a rule file.

    Parameters
    ----------
    path : path
        YAML; the keys are in the docs.

    Returns
    -------
    rules : Rules

    Raises
    ------
    InputError
        If it cannot be read, or has a wrong key or value; states key, line and remedy.
    """
    file = Path(path)
    block = load_block(file, FILE_KEYS)
    version = block.text("format")
    if version != FORMAT:
        block.refuse(f"'format' is {version}; this version reads {FORMAT}", block.values["format"])
    checks = tuple(
        _read_check(Block(file, node, f"check {number}", CHECK_KEYS))
        for number, node in enumerate(block.items("checks"), 1)
    )
    return Rules(block.text("name"), block.text("version"), block.text("source"), checks)


def _read_check(block: Block) -> Check:
    measure = _choose(block, "measure", MEASURES, "sun_hours")
    if block.has("at_least") == block.has("at_most"):
        both = "has both 'at_least' and 'at_most'; leave one out"
        none = "needs 'at_least' or 'at_most'"
        block.refuse(f"{block.what} {both if block.has('at_least') else none}")
    if block.has("min_spell") != (measure == "sun_hours_in_spells"):
        block.refuse(f"{block.what}: 'min_spell' goes with measure: sun_hours_in_spells")
    limit = "at_least" if block.has("at_least") else "at_most"
    area, places = _read_where(block)
    share = block.number("share", 100.0)
    if not 0 < share <= 100:
        block.refuse(f"'share' must be above 0 and at most 100 [%]; got {share:g}")
    if places and block.has("share"):
        block.refuse("'share' is for areas; named places are judged one by one")
    start, end, every = _read_times(block)
    return Check(
        name=block.text("name"),
        dates=tuple(_read_date(block, node) for node in block.items("dates")),
        start=start,
        end=end,
        every=every,
        min_altitude=block.number("min_altitude", 0.0),
        measure=measure,
        min_spell=_read_duration(block, "min_spell") if block.has("min_spell") else dt.timedelta(),
        limit=_read_duration(block, limit, may_be_none=True),
        is_least=limit == "at_least",
        area=area,
        places=places,
        share=share,
    )


def _choose(block: Block, key: str, words: tuple[str, ...], default: str) -> str:
    word = block.text(key, default)
    if word not in words:
        block.refuse(f"'{key}' must be one of {', '.join(words)}; got '{word}'",
                         block.values[key])  # fmt: skip
    return word


def _read_times(block: Block) -> tuple[str, str, str]:
    """Read a check's start, end and step; those with an offset are checked at the site."""
    times = block.text("from", "00:00"), block.text("to", "24:00"), block.text("every", "5min")
    if block.has("every"):
        _read_duration(block, "every")
    if not any(map(has_offset, times[:2])):
        try:
            make_steps("2001-01-01", *times, "UTC")
        except InputError as error:
            message = str(error)
            block.refuse(f"{block.what}: {message}")
    return times


def _read_duration(block: Block, key: str, *, may_be_none: bool = False) -> dt.timedelta:
    text = block.text(key)
    if may_be_none and re.fullmatch(r"0+\s*(h|min|s)?", text):
        return dt.timedelta()
    try:
        return parse_duration(text, f"duration '{key}'", "")
    except InputError as error:
        message = str(error)
    return block.refuse(message, block.values[key])


def _read_date(block: Block, node: Any) -> tuple[int | None, int, int]:
    match = _DATE.fullmatch(str(node.value).strip()) if node.id == "scalar" else None
    if match:
        year, month, day = (int(part) if part else None for part in match.groups())
        try:
            dt.date(year or 2000, month or 0, day or 0)
        except ValueError:
            return block.refuse(f"there is no date '{node.value}'", node)
        return year, month or 0, day or 0
    return block.refuse("a date is written 03-21, for the study's year, or 2026-03-21", node)


def _read_where(block: Block) -> tuple[str, tuple[Place, ...]]:
    """Read an area's name, or a list of places."""
    node = block.values.get("where")
    if node is None or node.id == "scalar":
        return _choose(block, "where", AREAS, "open_ground"), ()
    places = []
    for number, item in enumerate(block.items("where"), 1):
        place = Block(block.path, item, f"place {number} of {block.what}", PLACE_KEYS)
        places.append(Place(place.text("name"), place.number("x"), place.number("y")))
    return "", tuple(places)


def convert(rules: Rules, name: str) -> Rule:
    """
    Return rules of format 1 as a rule of format 2.

    Named places are judged one by one; a share of a plan becomes that of named areas, and
    applies to windows one by one.
    """
    return Rule(
        name=name,
        title=rules.name,
        edition=rules.version,
        source=rules.source,
        is_first_format=True,
        requirements=tuple(map(_convert_check, rules.checks)),
    )


def _convert_check(check: Check) -> Requirement:
    limit = check.limit.total_seconds() / 3600
    condition = Condition(
        measure=check.measure,
        dates=tuple(f"{f'{year}-' if year else ''}{m:02}-{d:02}" for year, m, d in check.dates),
        start=check.start,
        end=check.end,
        every=check.every,
        min_altitude=check.min_altitude,
        min_spell=check.min_spell,
        at_least=limit if check.is_least else None,
        at_most=None if check.is_least else limit,
        share=None if check.places else check.share,
    )
    receivers = ("areas", "windows") if check.area in {"open_ground", "everywhere"} else ()
    return Requirement(
        name=check.name,
        receivers=("places",) if check.places else receivers or (check.area,),
        condition=condition,
        places=check.places,
    )
