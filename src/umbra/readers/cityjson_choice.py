"""Choice of the geometry of each CityJSON object: the best, once."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = [
    "DAMAGE", "Choice", "choose_geometries", "damaged", "find_kinds", "flatten", "walk_values",
]  # fmt: skip

from umbra.errors import InputError
from umbra.readers.checks import describe_damage

# Exceptions of damaged nesting in unchecked walks of lists.
DAMAGE = (AttributeError, IndexError, KeyError, OverflowError, TypeError, ValueError)

# Levels of lists above a surface.
DEPTHS = {
    "MultiSurface": 0,
    "CompositeSurface": 0,
    "Solid": 1,
    "MultiSolid": 2,
    "CompositeSolid": 2,
}


@dataclass(frozen=True, eq=False)
class Choice:
    """Chosen geometry of one object."""

    geometry: dict[str, Any]  # as in the file; a GeometryInstance represents its template
    shape: dict[str, Any]  # with surfaces: the geometry itself, or the template
    # A geometry of the same level whose semantics the shape may borrow
    lender: dict[str, Any] | None = None


def damaged(name: str, error: Exception, where: str = "") -> InputError:
    """Make the error for an object whose lists are not nested as in CityJSON."""
    reason = describe_damage(error)
    msg = f"{where}object '{name}' is damaged ({reason}); repair it or export the file again"
    return InputError(msg, object=name)


def choose_geometries(
    objects: dict[str, Any],
    templates: Sequence[dict[str, Any]],
    vertices: Sequence[Any],
    counts: Counter[str],
    where: str = "",
) -> dict[str, Choice]:
    """Choose the geometry of each object with surfaces, without repetitions of a relative's."""
    choices: dict[str, Choice] = {}
    for name, item in objects.items():
        try:
            geometries = item.get("geometry") or ()
            choice = _choose(geometries, templates)
        except DAMAGE as error:
            raise damaged(name, error, where) from error
        if choice is not None:
            choices[name] = choice
        elif geometries:
            counts["objects without surfaces (points or lines) left out"] += 1
    places = _Places(vertices)
    for name in list(choices):
        try:
            repeated = _find_repeats(name, objects, choices, places)
        except DAMAGE as error:
            raise damaged(name, error, where) from error
        for other in repeated:
            del choices[other]
            counts["geometries left out that repeat a parent's or its parts'"] += 1
    return choices


def _choose(
    geometries: Sequence[dict[str, Any]], templates: Sequence[dict[str, Any]]
) -> Choice | None:
    best, best_rank = None, (-2.0, 0, False)
    for geometry in geometries:
        shape = geometry
        if geometry["type"] == "GeometryInstance":
            index = geometry["template"]
            if index < 0:
                msg = f"template {index}"
                raise IndexError(msg)
            shape = templates[index]
        if shape["type"] not in DEPTHS or not shape["boundaries"]:
            continue
        # Solids before surfaces; geometries with semantics before others.
        solid = DEPTHS[shape["type"]] > 0
        rank = (_level(shape), int(solid), bool(shape.get("semantics")))
        if rank > best_rank:
            best, best_rank = (geometry, shape), rank
    if best is None:
        return None
    geometry, shape = best
    lender = None
    if not shape.get("semantics") and shape is geometry:
        for other in geometries:
            if other.get("semantics") and other["type"] in DEPTHS and _level(other) == best_rank[0]:
                lender = other
                break
    return Choice(geometry, shape, lender)


def _level(geometry: dict[str, Any]) -> float:
    """Return the level of detail as a number: "2.2" > 2 > "1.3"; -1 if there is none."""
    try:
        return float(geometry["lod"])
    except (KeyError, TypeError, ValueError):
        return -1.0


def flatten(shape: dict[str, Any]) -> list[Any]:
    """Return all surfaces of a shape, each a list of rings; of a solid, all shells."""
    surfaces = shape["boundaries"]
    for _ in range(DEPTHS[shape["type"]]):
        surfaces = [inner for outer in surfaces for inner in outer]
    return surfaces


def find_kinds(choice: Choice, kind: str, vertices: Sequence[Any]) -> list[str]:
    """Find the semantic type of each surface of ``flatten(choice.shape)``; ``kind`` without one."""
    surfaces = flatten(choice.shape)
    if choice.lender is None:
        return list(_own_kinds(choice.shape, kind, len(surfaces)))
    lent = flatten(choice.lender)
    kinds = list(_own_kinds(choice.lender, kind, len(lent)))
    if lent == surfaces:
        return kinds
    by_place = {_key(surface, vertices): k for surface, k in zip(lent, kinds, strict=True)}
    return [by_place.get(_key(surface, vertices), kind) for surface in surfaces]


def _own_kinds(shape: dict[str, Any], kind: str, count: int) -> Iterator[str]:
    semantics = shape.get("semantics")
    values = semantics.get("values") if semantics else None
    if not semantics or values is None:
        return iter([kind] * count)
    depth = DEPTHS[shape["type"]]
    indices = list(walk_values(values, shape["boundaries"], depth))
    # A null, at any level, means no semantics there.
    types: dict[int | None, str] = dict(enumerate(str(s["type"]) for s in semantics["surfaces"]))
    types[None] = kind
    return iter([types[i] for i in indices])


def walk_values(values: Any, boundaries: list[Any], depth: int) -> Iterator[int | None]:
    """Yield the index of each surface's semantics; None without any."""
    if depth == 0:
        yield from [None] * len(boundaries) if values is None else values
        return
    inner = [None] * len(boundaries) if values is None else values
    for value, boundary in zip(inner, boundaries, strict=True):
        yield from walk_values(value, boundary, depth - 1)


def _key(surface: list[list[int]], vertices: Sequence[Any]) -> frozenset[tuple[float, ...]]:
    """Identify a surface by the vertices of its outer ring, in any order."""
    return frozenset(tuple(vertices[i]) for i in surface[0])


class _Places:
    """Cache of the surfaces of shapes, identified by the vertices of their outer rings."""

    def __init__(self, vertices: Sequence[Any]) -> None:
        self._vertices = vertices
        self._found: dict[int, set[frozenset[tuple[float, ...]]]] = {}

    def find(self, shape: dict[str, Any]) -> set[frozenset[tuple[float, ...]]]:
        if id(shape) not in self._found:
            self._found[id(shape)] = {_key(s, self._vertices) for s in flatten(shape)}
        return self._found[id(shape)]


def _find_repeats(
    name: str, objects: dict[str, Any], choices: dict[str, Choice], places: _Places
) -> list[str]:
    """
    Find which of an object and its children repeat each other.

    CityGML lets a building with parts carry geometry of its own (its central
    part), so a parent is left out only where its parts show the same surfaces or
    a finer level of detail of the whole; a child (an installation cut out of the
    building's solid) only where all its surfaces are its parent's too.
    """
    named = dict.fromkeys(objects[name].get("children") or ())
    children = [c for c in named if c in choices]
    if name not in choices or not children:
        return []
    own = choices[name]
    parts = [c for c in children if str(objects[c]["type"]).endswith("Part")]
    if parts and all(_level(choices[c].shape) > _level(own.shape) for c in parts):
        return [name]
    if own.shape is not own.geometry:
        return []
    own_surfaces = places.find(own.shape)
    theirs = {
        c: places.find(choices[c].shape)
        for c in children
        if choices[c].shape is choices[c].geometry
    }
    if all(any(surface in other for other in theirs.values()) for surface in own_surfaces):
        return [name]
    return [c for c, surfaces in theirs.items() if surfaces <= own_surfaces]
