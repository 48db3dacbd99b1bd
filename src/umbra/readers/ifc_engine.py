"""
ifcopenshell on one IFC file: the file's facts, then one shape after another.

This runs in a child process (`umbra.readers.ifc`), because the parser and the geometry
engine may end the process, or never end, on files that are otherwise fine. Everything that
is yielded here is arrays and plain values.
"""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.ifc_facts import (
    IfcWords,
    count_names,
    count_rooms,
    describe_element,
    find_grade,
    find_map,
    find_place,
)
from umbra.readers.model import FilePlace
from umbra.scene import Material
from umbra.scene.material import find_linear

__all__ = [
    "ENGINES",
    "IfcAttempt",
    "IfcFacts",
    "IfcShape",
    "IfcWork",
    "check_whole",
    "find_schema",
    "read_pieces",
]

# Classes with a shape that cast no shadow: rooms, holes, lines on a plan.
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

# The first is fast; the other handles elements at which it fails.
ENGINES = ("hybrid-cgal-simple-opencascade", "opencascade")


@dataclass(frozen=True)
class IfcWork:
    """Request to read a file."""

    path: str
    engines: tuple[str, ...] = ENGINES  # geometry engines in the order in which they are tried
    made: frozenset[int] = frozenset()  # elements that have their shape already
    skip: frozenset["IfcAttempt"] = frozenset()  # not to be tried again


@dataclass(frozen=True)
class IfcAttempt:
    """An element, by its place among the facts' elements, and the engine that will shape it."""

    element: int
    engine: str


@dataclass(frozen=True)
class IfcFacts:
    """The contents of a file besides its shapes."""

    schema: str  # as ``IFC4``
    elements: tuple[IfcWords, ...]  # names of each element, in the order of the shapes
    place: FilePlace
    matrix: NDArray[np.float64] | None  # (4, 4): from the file's coordinates in metres to its map's
    crs: str | None  # the map's
    notes: tuple[str, ...]
    # Height of the ground that a storey or the site states [m], and which
    grade: tuple[float, str] | None = None


@dataclass(frozen=True, eq=False)
class IfcShape:
    """The triangles of one element."""

    vertices: NDArray[np.float64]  # (n, 3): [m], in the file's coordinates
    faces: NDArray[np.int32]  # (m, 3)
    style: NDArray[np.int32]  # (m,): index into ``styles`` of each face; -1 for none
    styles: tuple[tuple[str, Material], ...]


def read_pieces(work: IfcWork) -> Iterator[IfcFacts | IfcAttempt | IfcShape]:
    """Read a file: its facts, then attempts, each followed by a shape if it succeeds."""
    file, notes = _open(work.path)
    products, words, unnamed = _find_elements(file)
    if unnamed:
        notes.append(f"elements left out that refer to missing entities: {unnamed}")
    broken = _drop_broken_openings(file)
    if broken:
        notes.append(f"openings left out that are missing from the file: {broken}")
    site, remarks = find_place(file)
    notes += remarks
    matrix, crs, remarks = find_map(file, site)
    notes += remarks
    grade = find_grade(file)
    yield IfcFacts(file.schema, tuple(words), site, matrix, crs, tuple(notes), grade)
    yield from _make_shapes(file, products, work)


def _open(path: str) -> tuple[Any, list[str]]:
    ifcopenshell = need("ifcopenshell", "ifc", "IFC")
    notes = []
    ifcopenshell.get_log()  # empties it
    with open(path, "rb") as stream:  # noqa: PTH123 - a path as text
        data = stream.read()
    name, schema, span = find_schema(data)
    if is_draft(name):
        notes.append(f"its schema {name} is a draft, read as {schema}")
    try:
        if data[span] == schema.encode():
            file = ifcopenshell.open(path, format=".ifc")
        else:
            # The parser knows each schema by its last edition's name only.
            renamed = data[: span.start] + schema.encode() + data[span.stop :]
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
    """Return a file's text; its norm is ASCII, and many write UTF-8 or Latin-1."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _find_elements(file: Any) -> tuple[list[Any], list[IfcWords], int]:
    """Return the elements that cast shadows, their names, and the number of broken ones."""
    products = [
        product
        for product in sorted(file.by_type("IfcProduct"), key=lambda product: product.id())
        if product.Representation and not any(product.is_a(name) for name in LEFT_OUT)
    ]
    uses, rooms = count_names(products), count_rooms(file)
    named, words, broken = [], [], 0
    for product in products:
        try:
            words.append(describe_element(product, uses, rooms))
        except (RuntimeError, AttributeError, TypeError):  # an entity that it names is no such
            broken += 1
        else:
            named.append(product)
    return named, words, broken


def _drop_broken_openings(file: Any) -> int:
    """Drop openings of no element, or by no opening, at which the engine would crash."""
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
        # Element by element, so that the parent knows which one hangs; the engine's own loop is
        # only faster where thousands share a shape, by a fifth.
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
    styles = tuple(_find_material(material, file, looks) for material in geometry.materials)
    return IfcShape(np.array(geometry.verts, np.float64).reshape(-1, 3), faces, style, styles)


def _find_material(
    style: Any, file: Any, looks: dict[tuple[Any, ...], tuple[str, Material]]
) -> tuple[str, Material]:
    """Return a style's name, and its colour in linear RGB."""
    number = style.instance_id()
    entity = file.by_id(number) if number else None
    name = getattr(entity, "Name", None) or ""
    diffuse = style.diffuse
    srgb = np.clip([diffuse.r(), diffuse.g(), diffuse.b()], 0, 1)
    clear = float(style.transparency)
    clear = min(max(clear, 0.0), 1.0) if np.isfinite(clear) else 0.0
    key = (name, *srgb.tolist(), clear)
    if key not in looks:
        red, green, blue = np.nan_to_num(find_linear(srgb), nan=0.7).tolist()
        looks[key] = (name, Material((red, green, blue), opacity=1 - clear))
    return looks[key]


# By which schema the file of each is read: an edition's own, and what came before it.
SCHEMAS = {
    "IFC2X3": re.compile(r"IFC2X3(_TC\d|_FINAL)?"),
    "IFC4": re.compile(r"IFC4(_ADD\d(_TC\d)?)?"),
    "IFC4X3_ADD2": re.compile(r"IFC4X3(_ADD\d|_TC\d)?"),
}
DRAFT = re.compile(r"IFC4X(1|2|3_\w+)")
LAST = "IFC4X3_ADD2"

SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'\s*([^']*?)\s*'")
ENTITY = re.compile(rb"\n#(\d+) *=")
HEAD = 1 << 16


def find_schema(data: bytes) -> tuple[str, str, slice]:
    """Find a STEP file's schema as written, the one to read it by, and the position of its name."""
    match = SCHEMA.search(data[:HEAD])
    if match is None:
        check_whole(data)  # it may break off before
        msg = "is a STEP file whose header names no schema (FILE_SCHEMA); export it again as IFC"
        raise InputError(msg)
    # A registration may follow: 'AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'.
    name = match[1].decode("latin-1").partition("{")[0].strip().upper()[:80]
    span = slice(match.start(1), match.end(1))
    for schema, names in SCHEMAS.items():
        if names.fullmatch(name):
            return name, schema, span
    if DRAFT.fullmatch(name):
        return name, LAST, span
    what = "IFC" if name.startswith("IFC") else "a STEP file, but not IFC,"
    msg = (
        f"is {what} of the schema '{name}', which is not read; export it as IFC4 (IFC2X3, IFC4 "
        "and IFC4X3 are read), glTF or OBJ"
    )
    raise InputError(msg, schema=name)


def is_draft(name: str) -> bool:
    """Return whether a schema was never published as it is."""
    return not any(names.fullmatch(name) for names in SCHEMAS.values())


def check_whole(data: bytes) -> None:
    """Refuse a file that ends too early, or in which two entities have one number."""
    if b"END-ISO-10303-21" not in data[-4096:]:
        msg = (
            f"is IFC that ends too early (no END-ISO-10303-21 in its {len(data)} bytes); "
            "export it again"
        )
        raise InputError(msg, byte=len(data))
    numbers = ENTITY.findall(data)
    if len(set(numbers)) == len(numbers):
        return
    twice = [int(number) for number, count in Counter(numbers).items() if count > 1]
    msg = (
        f"is damaged IFC (entity numbers that come more than once: {len(twice)}, "
        f"first: #{twice[0]}); export it again"
    )
    raise InputError(msg, entity=twice[0])


ERROR = re.compile(r"^\[error\](?: *\[[^\]]*\])* *(.*)$", re.IGNORECASE | re.MULTILINE)


def list_errors(log: str) -> list[str]:
    """Return the errors in ifcopenshell's log, without their time."""
    return [" ".join(error.split())[:200] for error in ERROR.findall(log)]


def one_line(error: BaseException) -> str:
    """Return an error's type and message in a line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]
