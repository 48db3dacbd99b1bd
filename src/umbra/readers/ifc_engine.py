"""
ifcopenshell on one IFC file: what the file says, then one shape after another.

This runs in a child process (`umbra.readers.ifc_child`), because the parser and the geometry
engine may end the process, or never end, on files that are otherwise fine. Everything that
is yielded here can be pickled.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.extras import need
from umbra.readers.ifc_header import find_schema, is_draft
from umbra.readers.ifc_log import list_errors, one_line
from umbra.readers.ifc_place import find_map, find_place
from umbra.readers.ifc_words import Words, count_names, describe
from umbra.readers.model import Place
from umbra.scene import Material

__all__ = ["ENGINES", "IfcAttempt", "IfcFacts", "IfcShape", "IfcWork", "read_pieces"]

# What has a shape and casts no shadow: rooms, holes, lines on a plan.
LEFT_OUT = (
    "IfcSpace",
    "IfcSpatialZone",
    "IfcExternalSpatialElement",
    "IfcFeatureElementSubtraction",
    "IfcVirtualElement",
    "IfcAnnotation",
    "IfcGrid",
    "IfcStructuralItem",
    "IfcPort",
    "IfcPositioningElement",
    "IfcLinearElement",
)

# The first is quick and right for what it takes; the other takes what is left.
ENGINES = ("hybrid-cgal-simple-opencascade", "opencascade")


@dataclass(frozen=True)
class IfcWork:
    """
    What to read of a file.

    Parameters
    ----------
    path : str
    engines : tuple of str
        Geometry engines in the order in which they are tried.
    made : frozenset of int
        Elements that have their shape already.
    skip : frozenset of IfcAttempt
        What is not tried again.
    """

    path: str
    engines: tuple[str, ...] = ENGINES
    made: frozenset[int] = frozenset()
    skip: frozenset["IfcAttempt"] = frozenset()


@dataclass(frozen=True)
class IfcAttempt:
    """An element, by its place among the facts' elements, and the engine that will shape it."""

    element: int
    engine: str


@dataclass(frozen=True)
class IfcFacts:
    """
    What a file says beside its shapes.

    Parameters
    ----------
    schema : str
        As ``IFC4``.
    elements : tuple of Words
        What each element is called, in the order of the shapes.
    place : Place
    matrix : (4, 4) float64 or None
        From the file's coordinates in metres to its map's.
    crs : str or None
        The map's.
    notes : tuple of str
    """

    schema: str
    elements: tuple[Words, ...]
    place: Place
    matrix: NDArray[np.float64] | None
    crs: str | None
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class IfcShape:
    """
    The triangles of one element.

    Parameters
    ----------
    vertices : (n, 3) float64
        [m], in the file's coordinates.
    faces : (m, 3) int32
    style : (m,) int32
        Index into ``styles`` of each face; -1 for none.
    styles : tuple of (str, Material)
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    style: NDArray[np.int32]
    styles: tuple[tuple[str, Material], ...]


def read_pieces(work: IfcWork) -> Iterator[IfcFacts | IfcAttempt | IfcShape]:
    """
    Read a file: its facts, then attempts, each followed by a shape if it succeeds.

    Parameters
    ----------
    work : IfcWork

    Yields
    ------
    piece : IfcFacts, then IfcAttempt or IfcShape
        An attempt comes before it is made.

    Raises
    ------
    InputError
        If the file cannot be parsed, or is of a schema that is not read.
    """
    file, notes = _open(work.path)
    products, words, unnamed = _find_elements(file)
    if unnamed:
        notes.append(f"elements that name what is not in the file left out: {unnamed}")
    broken = _drop_broken_openings(file)
    if broken:
        notes.append(f"openings that are not in the file left out: {broken}")
    place, remarks = find_place(file)
    notes += remarks
    matrix, crs, remarks = find_map(file, place)
    notes += remarks
    yield IfcFacts(file.schema, tuple(words), place, matrix, crs, tuple(notes))
    yield from _make_shapes(file, products, work)


def _open(path: str) -> tuple[Any, list[str]]:
    ifcopenshell = need("ifcopenshell", "ifc", "IFC")
    notes = []
    ifcopenshell.get_log()  # empties it
    with open(path, "rb") as stream:  # noqa: PTH123 - a path as text
        data = stream.read()
    name, schema, place = find_schema(data)
    if is_draft(name):
        notes.append(f"its schema {name} is a draft, read as {schema}")
    try:
        if data[place] == schema.encode():
            file = ifcopenshell.open(path, format=".ifc")
        else:
            # The parser knows each schema by its last edition's name only.
            renamed = data[: place.start] + schema.encode() + data[place.stop :]
            file = ifcopenshell.file.from_string(_decode(renamed))
        projects = file.by_type("IfcProject")
    except Exception as error:  # whatever the parser raises, the file is not IFC
        errors = list_errors(ifcopenshell.get_log()) or [one_line(error)]
        msg = f"is damaged IFC ({errors[-1]}); export it again"
        raise InputError(msg) from error
    errors = list_errors(ifcopenshell.get_log())
    if errors:
        notes.append(f"errors in the file: {len(errors)} (first: {errors[0]})")
    if not projects:
        msg = "is IFC without an IfcProject, so its units are not known; export the whole project"
        raise InputError(msg)
    return file, notes


def _decode(data: bytes) -> str:
    """Give a file's text; its norm is ASCII, and many write UTF-8 or Latin-1."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _find_elements(file: Any) -> tuple[list[Any], list[Words], int]:
    """Give what casts with its words, in the order of their numbers, and how many are broken."""
    products = [
        product
        for product in sorted(file.by_type("IfcProduct"), key=lambda product: product.id())
        if product.Representation and not any(product.is_a(name) for name in LEFT_OUT)
    ]
    uses = count_names(products)
    named, words, broken = [], [], 0
    for product in products:
        try:
            words.append(describe(product, uses))
        except (RuntimeError, AttributeError, TypeError):  # an entity that it names is no such
            broken += 1
        else:
            named.append(product)
    return named, words, broken


def _drop_broken_openings(file: Any) -> int:
    """Drop openings of what is no element, or by what is no opening: the engine would crash."""
    broken = [
        relation
        for relation in file.by_type("IfcRelVoidsElement")
        if not _is(relation.RelatedOpeningElement, "IfcFeatureElementSubtraction")
        or not _is(relation.RelatingBuildingElement, "IfcElement")
    ]
    for relation in broken:
        file.remove(relation)
    return len(broken)


def _is(entity: Any, kind: str) -> bool:
    return entity is not None and entity.is_a(kind)


def _make_shapes(
    file: Any, products: Sequence[Any], work: IfcWork
) -> Iterator[IfcAttempt | IfcShape]:
    geom = need("ifcopenshell.geom", "ifc", "IFC")
    settings = geom.settings()
    settings.set("use-world-coords", True)
    settings.set("no-normals", True)
    looks: dict[tuple[Any, ...], tuple[str, Material]] = {}
    made = set(work.made)
    for engine in work.engines:
        # One by one, so that the parent knows which was at work when nothing more comes; the
        # engine's own loop is faster only where thousands share a shape, and by a fifth.
        for number, product in enumerate(products):
            attempt = IfcAttempt(number, engine)
            if number in made or attempt in work.skip:
                continue
            yield attempt
            with suppress(RuntimeError):  # of C++; or this build lacks the engine
                shape = geom.create_shape(settings, product, geometry_library=engine)
                if len(shape.geometry.faces):
                    made.add(number)
                    yield _copy(shape.geometry, file, looks)


def _copy(geometry: Any, file: Any, looks: dict[tuple[Any, ...], tuple[str, Material]]) -> IfcShape:
    """Copy a shape out of the engine's memory."""
    faces = np.array(geometry.faces, np.int32).reshape(-1, 3)
    style = np.array(geometry.material_ids, np.int32)
    if len(style) != len(faces):
        style = np.full(len(faces), -1, np.int32)
    styles = tuple(_find_material(one, file, looks) for one in geometry.materials)
    return IfcShape(np.array(geometry.verts, np.float64).reshape(-1, 3), faces, style, styles)


def _find_material(
    style: Any, file: Any, looks: dict[tuple[Any, ...], tuple[str, Material]]
) -> tuple[str, Material]:
    """Give a style's name, and its colour in linear RGB."""
    number = style.instance_id()
    entity = file.by_id(number) if number else None
    name = getattr(entity, "Name", None) or ""
    diffuse = style.diffuse
    srgb = np.clip([diffuse.r(), diffuse.g(), diffuse.b()], 0, 1)
    clear = float(style.transparency)
    clear = min(max(clear, 0.0), 1.0) if np.isfinite(clear) else 0.0
    key = (name, *srgb.tolist(), clear)
    if key not in looks:
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        red, green, blue = np.nan_to_num(linear, nan=0.7).tolist()
        looks[key] = (name, Material((red, green, blue), opacity=1 - clear))
    return looks[key]
