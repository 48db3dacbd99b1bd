"""
Coordinates of CityGML's rings, as GML 2 and 3 write them.

Names of CityGML's and GML's elements: roles in a geometry, levels of detail, ids.
"""

import re
from functools import lru_cache
from typing import Any

from orjson import loads

from umbra.errors import InputError

__all__ = [
    "HREF",
    "IDS",
    "LINKED",
    "LINKED_TAGS",
    "PATCH",
    "PROPERTY",
    "TURNED",
    "find_dimension",
    "id_of",
    "level_of",
    "name_of",
    "name_owner",
    "read_numbers",
    "read_plain_ring",
    "role_of",
    "strip",
]

HREF = "{http://www.w3.org/1999/xlink}href"
IDS = ("{http://www.opengis.net/gml}id", "{http://www.opengis.net/gml/3.2}id")
_LEVEL = re.compile(r"lod(\d)")
_PATCHES = {"Polygon", "PolygonPatch", "Rectangle", "Triangle"}
LINKED = (
    "Polygon", "OrientableSurface", "CompositeSurface", "MultiSurface", "TriangulatedSurface",
    "Tin", "PolyhedralSurface", "Surface", "Solid", "CompositeSolid", "MultiSolid",
)  # fmt: skip
"""Elements that others link to."""
LINKED_TAGS = tuple(f"{{*}}{name}" for name in LINKED)
PROPERTY, PATCH, TURNED, OBJECT = range(4)


def name_of(element: Any) -> str:
    """Return an element's name without its namespace; empty for other nodes."""
    return strip(element.tag)


@lru_cache(4096)
def strip(tag: Any) -> str:
    """Return a tag without its namespace; empty for what is no element."""
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""


@lru_cache(4096)
def level_of(tag: Any) -> str:
    """Return the level of a property with a geometry; `tin` where the object has it, else ''."""
    name = strip(tag)
    match = _LEVEL.match(name)
    return match[1] if match else "tin" * (name == "tin")


@lru_cache(4096)
def role_of(tag: Any) -> int:
    """Return what an element of a geometry is; properties begin in lower case and have no id."""
    name = strip(tag)
    if name in _PATCHES:
        return PATCH
    if name == "OrientableSurface":
        return TURNED
    return OBJECT if name[:1].isupper() else PROPERTY


def id_of(element: Any) -> str | None:
    """Return an element's id in either version of GML."""
    return element.get(IDS[0]) or element.get(IDS[1])


_PLAIN: tuple[list[tuple[str, str]], ...] = ([], [("srsDimension", "3")])
"""Attributes of a list of coordinates that say nothing new."""
_NUMBERS = {float, int}


def name_owner(element: Any) -> str:
    """Return the id of the nearest element around that has one."""
    around = (element, *element.iterancestors())
    return next((name for ancestor in around if (name := id_of(ancestor)) is not None), "")


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
            f"a ring of '{owner}' has a coordinate that is not a number (line {line}: {error}); "
            "repair it or export the file again"
        )
        raise InputError(msg, object=owner, line=line) from error


def find_dimension(element: Any, ring: Any) -> int:
    """Return the number of coordinates of each corner."""
    for node in (element, ring):
        dimension = node.get("srsDimension") or node.get("dimension")
        if dimension:
            return int(dimension)
    return 3
