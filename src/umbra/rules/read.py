"""
Reader of rules, format 2: cited, with alternatives, levels and variants.

Files of format 1 are read as well. The keys are in ``docs/rules.md``.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from umbra.errors import InputError, find_similar
from umbra.rules.conditions import CONDITION_KEYS, read_condition
from umbra.rules.file import Block, load_block
from umbra.rules.first_format import Rules, convert, read_rules
from umbra.rules.record import Condition, Place, Requirement, Rule, list_conditions
from umbra.rules.words import STANDINGS

__all__ = ["CHECK_KEYS", "FILE_KEYS", "find_shipped", "is_shipped", "read_any", "read_rule"]

FILE_KEYS = (
    "format", "name", "place", "edition", "asks", "source", "read", "standing", "first_hand",
    "second_hand", "before_use", "notes", "variant", "variants", "checks", "version",
)  # fmt: skip
CHECK_KEYS = (
    "name", "receivers", "where", "facing", "rooms", "judge", "of_each", "one_is_enough",
    "share_of", "share_at_least", "share_at_most", "band", "across_roads", "height",
    "applies_above",
)  # fmt: skip
VARIANT_KEYS = ("name", "about", "values")
EVERY = "every"
"""Choice of all variants."""
RECEIVERS = ("areas", "windows", "band", "places")
_HERE = Path(__file__).parent
_MOST_CHECKS = 100
_MOST_VARIANTS = 50
_NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
_BAND = re.compile(r"(\d+(?:\.\d+)?)\s*\.\.\s*(\d+(?:\.\d+)?)?")


def find_shipped() -> list[str]:
    """Return the names of the rules that come with umbra."""
    return sorted(path.stem for path in _HERE.glob("*.yaml"))


def read_rule(named: str | os.PathLike[str]) -> list[Rule]:
    """
    Read a rule: one that comes with umbra, by its name, or a file.

    Parameters
    ----------
    named : str or path
        ``bre-209-gardens``, ``rules.yaml``; ``NAME:VARIANT`` chooses a variant, ``NAME:every``
        all of them, and ``NAME:KEY=VALUE`` sets a value of all. By default the variant that the
        file names, else all.

    Returns
    -------
    rules : list of Rule
        One for each variant that is left; one without variants.

    Raises
    ------
    InputError
        If there is no such rule or variant, or a key or value is wrong; states file, line and
        remedy.
    """
    text = os.fspath(named)
    path, choice = _find_file(text)
    block = load_block(path, FILE_KEYS)
    if block.has("format") and block.text("format") == "1":
        if choice:
            block.refuse(f"a rule of format 1 has no variant '{choice}'; leave it out")
        return [replace(convert(read_rules(path), path.stem), text=_read_text(path))]
    return _choose(_read_rules(block, path), choice, block, path)


def read_any(named: str | os.PathLike[str]) -> Rules | list[Rule]:
    """Read a rule as ``read_rule``; a file of format 1 as its checks."""
    rules = read_rule(named)
    path, _ = _find_file(os.fspath(named))
    return read_rules(path) if rules[0].is_first_format else rules


def is_shipped(text: str) -> bool:
    """Return whether a text names a rule that umbra brings, or a variant of one."""
    return text.partition(":")[0] in find_shipped()


def _find_file(text: str) -> tuple[Path, str]:
    """Return the file of a rule, and the variant that is chosen."""
    stem, _, choice = text.partition(":")
    if stem in find_shipped():
        return _HERE / f"{stem}.yaml", choice
    path = Path(text)
    if not path.exists() and ":" in text:
        other, _, choice = text.rpartition(":")
        if Path(other).exists():
            return Path(other), choice
    if not path.exists() and _NAME.fullmatch(stem):
        near = find_similar(stem, find_shipped())
        advice = f"did you mean '{near[0]}'?" if near else "'umbra rules' lists them"
        msg = f"there is no rule nor file '{stem}'; {advice}"
        raise InputError(msg, option="rules", name=stem)
    return path, ""


def _read_text(path: Path) -> str:
    return path.read_bytes().decode("utf-8")


def _read_rules(block: Block, path: Path) -> list[Rule]:
    version = block.text("format")
    if version != "2":
        block.refuse(f"'format' is {version}; this version reads 1 and 2", block.values["format"])
    standing = block.text("standing", "own")
    if standing not in STANDINGS:
        listed = ", ".join(STANDINGS)
        block.refuse(f"'standing' is one of {listed}; got '{standing}'", block.values["standing"])
    notes = tuple(str(node.value).strip() for node in block.items("notes")) if block.has(
        "notes") else ()  # fmt: skip
    rule = Rule(
        name=path.stem,
        title=block.text("name"),
        edition=block.text("edition" if not block.has("version") else "version"),
        source=block.text("source"),
        place=block.text("place", ""),
        asks=block.text("asks", ""),
        read=block.text("read", ""),
        first_hand=block.text("first_hand", ""),
        second_hand=block.text("second_hand", ""),
        before_use=block.text("before_use", ""),
        standing=standing,
        notes=notes,
        text=_read_text(path),
    )
    variants = _read_variants(block)
    if not variants:
        return [replace(rule, requirements=_read_checks(block, {}))]
    return [
        replace(
            rule, variant=name, about_variant=about, requirements=_read_checks(block, values),
            notes=(*notes, *(f"{key}={value}" for key, value in values.items())),
        )
        for name, about, values in variants
    ]  # fmt: skip


def _read_variants(block: Block) -> list[tuple[str, str, dict[str, str]]]:
    """Read the variants: their names, words, and values of ``$keys``."""
    if not block.has("variants"):
        return []
    nodes = block.items("variants")
    if len(nodes) > _MOST_VARIANTS:
        block.refuse(f"there are {len(nodes)} variants; give {_MOST_VARIANTS} at most", nodes[0])
    variants: list[tuple[str, str, dict[str, str]]] = []
    keys: Any = None
    for number, node in enumerate(nodes, 1):
        variant = Block(block.path, node, f"variant {number}", VARIANT_KEYS)
        name = variant.text("name")
        inner = variant.values.get("values")
        if inner is None or inner.id != "mapping":
            variant.refuse(f"variant '{name}' lacks 'values', keys with values; give them")
        values = {str(key.value): str(value.value).strip() for key, value in inner.value}
        if keys is not None and values.keys() != keys:
            variant.refuse(f"variant '{name}' has other values than the first ({', '.join(keys)})")
        keys = values.keys()
        if name in [known for known, _, _ in variants]:
            variant.refuse(f"there are two variants '{name}'; rename one", node)
        variants.append((name, variant.text("about", ""), values))
    return variants


def _choose(rules: list[Rule], choice: str, block: Block, path: Path) -> list[Rule]:
    """Return the chosen variant, or those that differ with some values set."""
    names = [rule.variant for rule in rules if rule.variant]
    if block.has("variant") and not choice:
        choice = block.text("variant")
        if choice not in names:
            block.refuse(f"there is no variant '{choice}'; name one", block.values["variant"])
    if not choice or choice == EVERY:
        return rules
    listed = ", ".join(names) or "none"
    if "=" in choice:
        pairs = [pair.partition("=")[::2] for pair in choice.split(",")]
        variants = _read_variants(block)
        known = [*variants[0][2]] if variants else []
        for key, _ in pairs:
            if key not in known:
                msg = (
                    f"rule '{path.stem}' has no value '{key}'; it has {', '.join(known) or 'none'}"
                )
                raise InputError(msg, option="rules", key=key)
        chosen: list[Rule] = []
        for rule, (_, _, values) in zip(rules, variants, strict=True):
            checks = _read_checks(block, values | dict(pairs))
            if checks not in [other.requirements for other in chosen]:
                chosen.append(replace(rule, requirements=checks, about_variant=rule.about_variant))
        if len(chosen) == 1:
            chosen = [replace(chosen[0], variant=choice, about_variant="as set")]
        return chosen
    if choice not in names:
        near = find_similar(choice, names)
        advice = f"did you mean '{near[0]}'?" if near else f"there are {listed}"
        msg = f"rule '{path.stem}' has no variant '{choice}'; {advice}"
        raise InputError(msg, option="rules", variant=choice)
    return [rule for rule in rules if rule.variant == choice]


def _read_checks(block: Block, values: Mapping[str, str]) -> tuple[Requirement, ...]:
    nodes = block.items("checks")
    if len(nodes) > _MOST_CHECKS:
        block.refuse(f"there are {len(nodes)} checks; give {_MOST_CHECKS} at most", nodes[0])
    return tuple(
        _read_check(Block(block.path, fill(block, node, values), f"check {number}",
                          (*CHECK_KEYS, *CONDITION_KEYS)))
        for number, node in enumerate(nodes, 1)
    )  # fmt: skip


def fill(block: Block, node: Any, values: Mapping[str, str], depth: int = 0) -> Any:
    """Return a copy of a node in which each ``$key`` is its value."""
    import yaml  # noqa: PLC0415

    if depth > 12:
        block.refuse("lists and mappings are nested too deep; rules need fewer levels", node)
    marks = (node.start_mark, node.end_mark)
    if node.id == "scalar":
        text = str(node.value)
        if text.startswith("$"):
            if text[1:] not in values:
                block.refuse(f"'{text}' is in no variant's values; name it there", node)
            text = values[text[1:]]
        return yaml.ScalarNode(node.tag, text, *marks)
    if node.id == "sequence":
        inner = [fill(block, item, values, depth + 1) for item in node.value]
        return yaml.SequenceNode(node.tag, inner, *marks)
    pairs = [(key, fill(block, value, values, depth + 1)) for key, value in node.value]
    return yaml.MappingNode(node.tag, pairs, *marks)


def _read_check(block: Block) -> Requirement:
    receivers = tuple(str(node.value).strip() for node in block.items("receivers"))
    for word in receivers:
        if word not in RECEIVERS:
            block.refuse(f"'receivers' are of {', '.join(RECEIVERS)}; got '{word}'",
                         block.values["receivers"])  # fmt: skip
    requirement = Requirement(
        name=block.text("name"),
        receivers=receivers,
        condition=read_condition(block, Condition()),
        places=_read_places(block, receivers),
        facing=_read_facing(block),
        rooms=tuple(word.strip().casefold() for word in _read_words(block, "rooms")),
        judge=_read_word(block, "judge", ("centre", "sill", "pane"), "centre"),
        of_each=_read_word(block, "of_each", ("flat", "room", "storey", ""), ""),
        one_is_enough=_read_word(block, "one_is_enough", ("yes", "no"), "no") == "yes",
        share_of=_read_word(block, "share_of", ("flat", ""), ""),
        share_at_least=_read_percent(block, "share_at_least"),
        share_at_most=_read_percent(block, "share_at_most"),
        band=_read_band(block, receivers),
        across_roads=_read_width(block),
        height=block.number("height") if block.has("height") else None,
        applies_above=block.number("applies_above") if block.has("applies_above") else None,
    )
    limits = (requirement.share_at_least, requirement.share_at_most)
    if bool(requirement.share_of) != (limits.count(None) == 1):
        block.refuse("'share_of' goes with one of 'share_at_least' and 'share_at_most'")
    windows_only = [key for key in ("facing", "rooms", "judge") if block.has(key)]
    if windows_only and "windows" not in receivers:
        block.refuse(f"'{windows_only[0]}' is of windows; add windows to 'receivers'")
    _check_shares(block, requirement)
    return requirement


def _check_shares(block: Block, requirement: Requirement) -> None:
    """Refuse shares of an area where no receiver has one."""
    has_share = any(
        condition.share is not None for condition in list_conditions(requirement.condition)
    )
    if has_share and not {"areas", "band"} & {*requirement.receivers}:
        block.refuse("'share' is of areas and bands; windows have lit_share")


def _read_places(block: Block, receivers: tuple[str, ...]) -> tuple[Place, ...]:
    if block.has("where") != ("places" in receivers):
        block.refuse("'where' goes with receivers: places, a list of name, x and y")
    if not block.has("where"):
        return ()
    places = []
    for number, item in enumerate(block.items("where"), 1):
        place = Block(block.path, item, f"place {number} of {block.what}", ("name", "x", "y", "z"))
        z = place.number("z") if place.has("z") else None
        places.append(Place(place.text("name"), place.number("x"), place.number("y"), z))
    return tuple(places)


def _read_words(block: Block, key: str) -> tuple[str, ...]:
    if not block.has(key):
        return ()
    return tuple(str(node.value).strip() for node in block.items(key))


def _read_word(block: Block, key: str, words: tuple[str, ...], default: str) -> str:
    word = block.text(key, default) if block.has(key) else default
    word = {"true": "yes", "false": "no"}.get(word.lower(), word)
    if word not in words:
        listed = ", ".join(filter(None, words))
        block.refuse(f"'{key}' must be one of {listed}; got '{word}'", block.values[key])
    return word


def _read_percent(block: Block, key: str) -> float | None:
    if not block.has(key):
        return None
    value = block.number(key)
    if not 0 <= value <= 100:
        block.refuse(f"'{key}' is 0 to 100 [%]; got {value:g}", block.values[key])
    return value


def _read_facing(block: Block) -> tuple[float, float] | None:
    if not block.has("facing"):
        return None
    match = _BAND.fullmatch(block.text("facing"))
    if not match or match[2] is None or not float(match[1]) < float(match[2]) <= 360:
        block.refuse("'facing' is a range of azimuths, such as 90..270", block.values["facing"])
    return float(match[1]), float(match[2])


def _read_width(block: Block) -> float | None:
    if not block.has("across_roads"):
        return None
    width = block.number("across_roads")
    if not block.has("band") or not 0 < width <= 1000:
        block.refuse(
            "'across_roads' goes with band and is a width of roads, such as 10 [m]",
            block.values["across_roads"],
        )
    return width


def _read_band(block: Block, receivers: tuple[str, ...]) -> tuple[float, float] | None:
    if block.has("band") != ("band" in receivers):
        block.refuse("'band' goes with receivers: band, such as band: 5..10")
    if not block.has("band"):
        return None
    match = _BAND.fullmatch(block.text("band"))
    far = float("inf") if not match or match[2] is None else float(match[2])
    if not match or not float(match[1]) < far:
        block.refuse("'band' is written 5..10, or 10.. without an end [m]", block.values["band"])
    return float(match[1]), far
