"""Coordinates of CityGML's rings, as GML 2 and 3 write them."""

from typing import Any

from orjson import loads

from umbra.errors import InputError
from umbra.readers.citygml_names import id_of, name_of, strip

__all__ = ["find_dimension", "name_owner", "read_numbers", "read_plain_ring"]

_PLAIN: tuple[list[tuple[str, str]], ...] = ([], [("srsDimension", "3")])
"""Attributes of a list of coordinates that say nothing new."""
_NUMBERS = {float, int}


def name_owner(element: Any) -> str:
    """Return the id of the nearest element around that has one."""
    around = (element, *element.iterancestors())
    return next((name for one in around if (name := id_of(one)) is not None), "")


def read_plain_ring(ring: Any) -> list[float] | None:
    """Return the coordinates of a ring of one list, as most are; None for any other."""
    if len(ring) != 1 or ring.items():
        return None
    element = ring[0]
    if strip(element.tag) != "posList" or element.items() not in _PLAIN:
        return None
    try:
        numbers: list[float] = loads(f"[{(element.text or '').strip().replace(' ', ',')}]")
    except ValueError:  # numbers that JSON writes otherwise, or further blanks, or damage
        return None
    return numbers if _NUMBERS.issuperset(map(type, numbers)) else None


def read_numbers(element: Any, ring: Any) -> list[float]:
    """Return the coordinates of a list, which GML 2 may part by other marks."""
    text = element.text or ""
    if name_of(element) == "coordinates":
        point = element.get("decimal", ".")
        for mark in (element.get("cs", ","), element.get("ts", " ")):
            text = text.replace(mark, " ") if mark != point else text
        text = text.replace(point, ".")
    try:
        return list(map(float, text.split()))
    except ValueError as error:
        owner, line = name_owner(ring), element.sourceline
        msg = (
            f"a ring of '{owner}' has a coordinate that is no number (line {line}: {error}); "
            "repair it or export the file again"
        )
        raise InputError(msg, object=owner, line=line) from error


def find_dimension(element: Any, ring: Any) -> int:
    """Return the number of coordinates of each corner."""
    for one in (element, ring):
        told = one.get("srsDimension") or one.get("dimension")
        if told:
            return int(told)
    return 3
