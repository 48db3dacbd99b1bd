"""Mutators: bytes, numbers and lines of any file, values and branches of JSON."""

import json
import random
import re
import struct
from collections.abc import Callable
from copy import deepcopy
from typing import Any

__all__ = ["mutate"]

ODD_BYTES = b"0123456789-.e,:[]{}\"\\/ \n#\x00\xff\x7f'"
ODD_NUMBERS = (
    b"0", b"-1", b"1", b"255", b"65535", b"65536", b"2147483647", b"4294967295", b"-2147483648",
    b"1e308", b"-1e400", b"1e-320", b"nan", b"inf", b"9" * 40, b"0.1", b"1000000",
)  # fmt: skip
ODD_VALUES: tuple[Any, ...] = (
    None, True, False, -1, 0, 1, 7, 2**31 - 1, 2**31, 2**53, 10**12, 1.5, 1e308, -1e-300, "", "a",
    "\x00", "\u202e", "../x", "/dev/zero", "%2e%2e/x", "data:,", [], {}, [[]], [0], [[0]], [None],
    {"type": "Solid"}, {"a": {}}, [1e400], "x" * 3000,
)  # fmt: skip
WORDS = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def mutate(data: bytes, others: list[bytes], dice: random.Random) -> bytes:
    """
    Damage a file.

    Parameters
    ----------
    data : bytes
    others : list of bytes
        Files to take pieces from.
    dice : Random
        All chance comes from it.
    """
    for _ in range(dice.choice((1, 1, 1, 2, 3, 6))):
        ways: list[Callable[..., bytes]] = [_change_bytes, _change_number, _move_piece]
        ways += [_change_tree] * 6 if _parse(data) is not None else []
        way = dice.choice(ways)
        if way is _move_piece:
            other = data if dice.random() < 0.5 else dice.choice(others)
            data = _move_piece(data, dice, other) or data
        else:
            data = way(data, dice) or data
    return data


def _change_bytes(data: bytes, dice: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(dice.choice((1, 1, 2, 8, 64))):
        if not changed:
            break
        place = dice.randrange(len(changed))
        new = dice.choice((dice.choice(ODD_BYTES), dice.randrange(256)))
        way = dice.randrange(4)
        if way == 0:
            changed[place] ^= 1 << dice.randrange(8)
        elif way == 1:
            changed[place] = new
        elif way == 2:
            changed.insert(place, new)
        else:
            del changed[place]
    return bytes(changed)


def _change_number(data: bytes, dice: random.Random) -> bytes:
    """Put an odd number for one in text, or for a word of four bytes."""
    found = list(WORDS.finditer(data[: 1 << 18]))
    if found and dice.random() < 0.8:
        one = dice.choice(found)
        return data[: one.start()] + dice.choice(ODD_NUMBERS) + data[one.end() :]
    if len(data) < 8:
        return data
    place = dice.randrange(len(data) - 4)
    word = dice.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 0x7F800000, 0x7FC00000, 1 << 24))
    return data[:place] + struct.pack("<I", word) + data[place + 4 :]


def _move_piece(data: bytes, dice: random.Random, other: bytes) -> bytes:
    """Cut a piece out, or put one of a file in, once or often."""
    size = dice.choice((1, 4, 16, 200, 3000))
    place, start = dice.randrange(len(data) + 1), dice.randrange(max(len(other), 1))
    piece = other[start : start + size]
    way = dice.randrange(4)
    if way == 0:
        return data[:place]
    if way == 1:
        return data[:place] + data[place + size :]
    return data[:place] + piece * dice.choice((1, 1, 1, 50)) + data[place:]


def _parse(data: bytes) -> Any:
    start, end = _find_json(data)
    try:
        return json.loads(data[start:end])
    except (ValueError, RecursionError):
        return None


def _find_json(data: bytes) -> tuple[int, int]:
    """Give where the JSON of a file or of a GLB lies."""
    if data[:4] == b"glTF" and len(data) >= 20:
        return 20, 20 + int.from_bytes(data[12:16], "little")
    return 0, len(data)


def _change_tree(data: bytes, dice: random.Random) -> bytes:
    """Change, drop, double or move values of a JSON tree; a GLB stays one."""
    start, end = _find_json(data)
    try:
        tree = json.loads(data[start:end])
        for _ in range(dice.choice((1, 1, 2, 4))):
            _change_value(tree, dice)
        text = json.dumps(tree).encode()
    except (RecursionError, ValueError):
        return data
    if start == 0 or len(text) > 1 << 24:
        return text[: 1 << 24]
    text += b" " * (-len(text) % 4)
    rest = data[end:]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + rest


def _change_value(tree: Any, dice: random.Random) -> None:
    places = [tree] if isinstance(tree, dict | list) and tree else []
    for place in places:
        inner = place.values() if isinstance(place, dict) else place
        places += [one for one in inner if isinstance(one, dict | list) and one]
        if len(places) > 20_000:
            break
    if not places:
        return
    place = dice.choice(places)
    key = dice.choice(list(place) if isinstance(place, dict) else range(len(place)))
    way = dice.randrange(6)
    if way == 0:
        del place[key]
    elif way == 1:
        place[key] = json.loads(json.dumps(dice.choice(places)))
    elif way == 2 and isinstance(place, list):
        place[:] = place * dice.choice((2, 50))
    elif way == 3:
        for _ in range(dice.choice((1, 30, 900))):
            place[key] = [place[key]]
    else:
        place[key] = deepcopy(dice.choice(ODD_VALUES))  # a later change must not reach them
