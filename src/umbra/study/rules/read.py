"""Reader of rule files, format 1: YAML with line numbers and checked keys."""

import datetime as dt
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from umbra.errors import InputError, find_similar
from umbra.sun.clock import make_steps, parse_duration
from umbra.sun.local_time import has_offset

__all__ = ["MEASURES", "Block", "Check", "Place", "Rules", "load_block", "read_rules"]

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


class Block:
    """
    A mapping of a YAML file, with a fixed set of keys.

    Parameters
    ----------
    path : Path
        For messages.
    node : yaml.Node
    what : str
        Name of the mapping: "the file", "check 2".
    keys : sequence of str
        Allowed keys.

    Raises
    ------
    InputError
        If it is not a mapping, or has an unknown or repeated key.
    """

    def __init__(self, path: Path, node: Any, what: str, keys: Sequence[str]) -> None:
        self.path, self.node, self.what = path, node, what
        self.values: dict[str, Any] = {}
        if node.id != "mapping":
            self.refuse(f"{what} must be keys with values", node)
        for key, value in node.value:
            name = str(key.value)
            if name not in keys:
                near = find_similar(name, keys)
                advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(keys)}"
                self.refuse(f"{what} has the unknown key '{name}'; {advice}", key)
            if name in self.values:
                self.refuse(f"{what} has the key '{name}' twice; remove one", key)
            self.values[name] = value

    def refuse(self, words: str, node: Any = None) -> NoReturn:
        """Raise the error that names file and line."""
        line = (node or self.node).start_mark.line + 1
        msg = f"{self.path.name}, line {line}: {words}"
        raise InputError(msg, path=self.path, line=line)

    def has(self, key: str) -> bool:
        """Return whether a key is present."""
        return key in self.values

    def text(self, key: str, default: str | None = None) -> str:
        """Return a value as written; required if there is no default."""
        node = self.values.get(key)
        if node is None:
            if default is None:
                self.refuse(f"{self.what} lacks '{key}'")
            return default
        if node.id != "scalar" or not node.value.strip():
            self.refuse(f"'{key}' must be one value", node)
        return str(node.value).strip()

    def number(self, key: str, default: float | None = None) -> float:
        """Return a number."""
        text = self.text(key, None if default is None else str(default))
        try:
            value = float(text)
        except ValueError:
            self.refuse(f"'{key}' must be a number; got '{text}'", self.values[key])
        if not abs(value) < float("inf"):
            self.refuse(f"'{key}' must be finite; got '{text}'", self.values[key])
        return value

    def items(self, key: str) -> list[Any]:
        """Return the nodes of a list; a single value is a list of one."""
        node = self.values.get(key)
        if node is None:
            self.refuse(f"{self.what} lacks '{key}'")
        nodes = list(node.value) if node.id == "sequence" else [node]
        if not nodes:
            self.refuse(f"'{key}' is empty", node)
        return nodes


_LARGEST = 1_000_000  # [byte]; thousands of rules


def load_block(path: Path, keys: Sequence[str]) -> Block:
    """
    Read a YAML file whose root is a mapping.

    Values stay text: YAML reads 10:00 as a sexagesimal number. Raises InputError if the file
    cannot be read or is not YAML.
    """
    import yaml  # noqa: PLC0415  (few studies have rules)

    class Loader(yaml.BaseLoader):
        """Loader without aliases, which let a small file repeat rules a million times."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                problem = "an alias (*name); write it out"
                raise yaml.composer.ComposerError(None, None, problem, self.peek_event().start_mark)
            return super().compose_node(parent, index)

    try:
        with path.open("rb") as file:  # a device has no size
            data = file.read(_LARGEST + 1)
        if len(data) > _LARGEST:
            msg = f"the rules '{path}' are larger than {_LARGEST / 1e6:g} MB; give fewer"
            raise InputError(msg, path=path)
        node = yaml.compose(data.decode("utf-8"), Loader=Loader)
    except RecursionError as error:
        msg = f"{path.name}: lists and mappings are nested too deep; rules need four levels"
        raise InputError(msg, path=path) from error
    except OSError as error:
        msg = f"cannot read the rules '{path}' ({error.strerror}); check the name"
        raise InputError(msg, path=path) from error
    except UnicodeDecodeError as error:
        msg = f"the rules '{path}' are not UTF-8 text; save them so"
        raise InputError(msg, path=path) from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error)
        msg = f"{path.name}{where}: this is not YAML ({problem}); check indents and colons"
        raise InputError(msg, path=path) from error
    if node is None:
        msg = f"the rules '{path}' are empty; give one rule at least"
        raise InputError(msg, path=path)
    return Block(path, node, "the file", keys)


@dataclass(frozen=True)
class Place:
    """
    A named point of the plan.

    Parameters
    ----------
    name : str
    x, y : float
        In the model's own coordinates [m].
    """

    name: str
    x: float
    y: float


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
        one = "has both 'at_least' and 'at_most'; leave one out"
        none = "needs 'at_least' or 'at_most'"
        block.refuse(f"{block.what} {one if block.has('at_least') else none}")
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
