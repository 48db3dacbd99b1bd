"""Reader of a check's conditions: a measure with limits, ``any_of``, ``all_of`` and ``levels``."""

import datetime as dt
from dataclasses import replace
from itertools import pairwise
from typing import Any

from umbra.errors import InputError, find_similar
from umbra.rules.file import Block
from umbra.rules.record import Alternative, Condition
from umbra.rules.words import MEASURES, check_date, check_time, read_amount
from umbra.sun.clock import parse_duration

__all__ = ["CONDITION_KEYS", "read_condition"]

LEAF_KEYS = (
    "measure", "dates", "over", "from", "to", "every", "clock", "cast", "min_altitude",
    "min_angle", "min_spell", "lit_area", "lit_share", "at_least", "at_most", "share",
    "ratio_to_before", "loss_at_most", "report",
)  # fmt: skip
GROUP_KEYS = ("any_of", "all_of", "levels")
CONDITION_KEYS = (*LEAF_KEYS, *GROUP_KEYS)
OVER = {"each": "each", "any": "best", "best": "best", "every": "worst", "worst": "worst",
        "sum": "sum"}  # fmt: skip
_MOST_DEEP, _MOST_PARTS = 4, 20
_NUMBERS = {
    "min_altitude": 90.0, "min_angle": 90.0, "share": 100.0, "lit_share": 100.0, "lit_area": 1e6,
    "ratio_to_before": 10.0,
}  # fmt: skip
_WORDS = {"clock": ("local", "standard", "solar"), "cast": ("all", "proposed")}


def read_condition(block: Block, base: Condition, depth: int = 0) -> Condition | Alternative:
    """
    Read a condition; what it does not say is as in the one around it.

    Parameters
    ----------
    block : Block
    base : Condition
        Of the block around it.
    depth : int
        Number of alternatives around it.
    """
    base = _read_leaf(block, base)
    groups = [key for key in GROUP_KEYS if block.has(key)]
    if len(groups) > 1:
        block.refuse(
            f"{block.what} has both '{groups[0]}' and '{groups[1]}'; nest one in the other"
        )
    if not groups:
        _check_leaf(block, base)
        return base
    if groups[0] == "levels":
        return _read_levels(block, base)
    if depth >= _MOST_DEEP:
        block.refuse(f"'any_of' and 'all_of' are nested deeper than {_MOST_DEEP}; simplify them")
    nodes = block.items(groups[0])
    if not 2 <= len(nodes) <= _MOST_PARTS:
        block.refuse(f"'{groups[0]}' needs 2 to {_MOST_PARTS} conditions; got {len(nodes)}")
    parts = tuple(
        read_condition(
            Block(block.path, node, f"condition {k} of {block.what}", CONDITION_KEYS),
            base,
            depth + 1,
        )
        for k, node in enumerate(nodes, 1)
    )
    return Alternative("any" if groups[0] == "any_of" else "all", parts)


def _read_levels(block: Block, base: Condition) -> Alternative:
    node = block.values["levels"]
    if node.id != "mapping" or not node.value:
        block.refuse("'levels' are names with limits, such as {minimum: 90min, medium: 3h}", node)
    unit = MEASURES[base.measure].unit
    levels = []
    for key, value in node.value:
        amount = read_amount(str(value.value), unit) if value.id == "scalar" else None
        if amount is None:
            block.refuse(f"level '{key.value}' is no limit in {unit}; got '{value.value}'", value)
        levels.append(replace(base, at_least=amount, at_most=None, level=str(key.value)))
    if any(b.at_least <= a.at_least for a, b in pairwise(levels)):  # type: ignore[operator]
        block.refuse("'levels' rise from the first to the last; order them", node)
    return Alternative("levels", tuple(levels))


def _read_leaf(block: Block, base: Condition) -> Condition:
    """Read what a block says itself of measure, time and limits."""
    measure = _pick(block, "measure", tuple(MEASURES)) if block.has("measure") else base.measure
    facts = {"measure": measure, **_read_time(block), **_read_limits(block, MEASURES[measure].unit)}
    for key, most in _NUMBERS.items():
        if block.has(key):
            facts[key] = block.number(key)
            if not 0 <= facts[key] <= most:
                block.refuse(f"'{key}' is 0 to {most:g}; got {facts[key]:g}", block.values[key])
    if block.has("min_spell"):
        facts["min_spell"] = _read_duration(block, "min_spell")
    if block.has("cast"):
        facts["casters"] = _pick(block, "cast", _WORDS["cast"])
    return replace(base, **facts)


def _read_time(block: Block) -> dict[str, Any]:
    """Read dates, hours, steps and clock."""
    times: dict[str, Any] = {}
    if block.has("dates"):
        times["dates"] = tuple(_read_date(block, node) for node in block.items("dates"))
    if block.has("over"):
        times["over"] = OVER[_pick(block, "over", tuple(OVER))]
    for key, name in (("from", "start"), ("to", "end")):
        if block.has(key):
            times[name] = block.text(key)
            wrong = check_time(times[name])
            if wrong:
                block.refuse(wrong, block.values[key])
    if block.has("every"):
        _read_duration(block, "every")
        times["every"] = block.text("every")
    if block.has("clock"):
        times["clock"] = _pick(block, "clock", _WORDS["clock"])
    return times


def _read_limits(block: Block, unit: str) -> dict[str, Any]:
    """Read the limits, in the unit of the measure."""
    limits: dict[str, Any] = {}
    if block.has("at_least") and block.has("at_most"):
        block.refuse(f"{block.what} has both 'at_least' and 'at_most'; leave one out")
    for key in ("at_least", "at_most", "loss_at_most"):
        if block.has(key):
            amount = read_amount(block.text(key), unit)
            if amount is None:
                example = "1h30min" if unit == "h" else "27"
                block.refuse(
                    f"'{key}' is an amount [{unit}], such as {example}; got '{block.text(key)}'",
                    block.values[key],
                )
            limits[key] = amount
            other = {"at_least": "at_most", "at_most": "at_least"}.get(key)
            if other:
                limits[other] = None
    return limits


def _check_leaf(block: Block, leaf: Condition) -> None:
    """Refuse a condition that lacks a date or a limit, or has what is not for its measure."""
    is_of_dates = MEASURES[leaf.measure].is_of_dates
    if is_of_dates and not leaf.dates:
        block.refuse(f"{block.what} lacks 'dates', which {leaf.measure} is of; give them")
    if not is_of_dates and leaf.dates:
        block.refuse(f"{leaf.measure} is of no date; leave 'dates' out of {block.what}")
    if bool(leaf.min_spell) != (leaf.measure == "sun_hours_in_spells"):
        block.refuse(f"{block.what}: 'min_spell' goes with measure: sun_hours_in_spells")
    if not leaf.has_limit and not (block.has("report") and block.text("report") in {"yes", "true"}):
        block.refuse(
            f"{block.what} needs a limit: at_least, at_most, ratio_to_before or loss_at_most; or "
            "report: yes"
        )


def _pick(block: Block, key: str, words: tuple[str, ...]) -> str:
    word = block.text(key)
    if word not in words:
        near = find_similar(word, words)
        advice = f"did you mean '{near[0]}'?" if near else f"it is one of {', '.join(words)}"
        block.refuse(f"'{key}' is '{word}'; {advice}", block.values[key])
    return word


def _read_date(block: Block, node: Any) -> str:
    text = str(node.value).strip() if node.id == "scalar" else ""
    wrong = check_date(text)
    if wrong:
        block.refuse(wrong, node)
    return text


def _read_duration(block: Block, key: str) -> dt.timedelta:
    try:
        return parse_duration(block.text(key), f"duration '{key}'", "")
    except InputError as error:
        message = str(error)
    return block.refuse(message, block.values[key])
