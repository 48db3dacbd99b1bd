"""Names of CityGML's and GML's elements: roles in a geometry, levels of detail, ids."""

import re
from functools import lru_cache
from typing import Any

__all__ = [
    "HREF", "IDS", "LINKED", "LINKED_TAGS", "PATCH", "PROPERTY", "TURNED", "id_of", "level_of",
    "name_of", "role_of", "strip",
]  # fmt: skip

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
    found = _LEVEL.match(name)
    return found[1] if found else "tin" * (name == "tin")


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
