"""
IFC: every element that has a shape becomes parts, one for each of its surface styles.

A part bears the name and the class of the whole it belongs to, so that a curtain wall
or a stair is chosen as one; what it is itself (own name and class, storey, type,
materials, styles) are its tags. Openings are cut by ifcopenshell's geometry engine.
"""

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.extras import need
from umbra.readers.ifc_place import find_map, find_place
from umbra.readers.ifc_words import Words, count_names, describe
from umbra.readers.model import Model, Place
from umbra.readers.turn import turn_up
from umbra.scene import Material, Mesh, Part
from umbra.scene.mesh import transform_points

__all__ = ["read_ifc"]

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
)

# The first is quick and right for what it takes; the other takes what is left.
ENGINES = ("hybrid-cgal-simple-opencascade", "opencascade")

ENTITY = re.compile(rb"\n#(\d+) *=")
ERROR = re.compile(r"^\[error\](?: *\[[^\]]*\])* *(.*)$", re.IGNORECASE | re.MULTILINE)

Shape = tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32], list[Any]]


def read_ifc(data: bytes, path: Path, up: str | None = None) -> Model:
    """
    Read an IFC file, 2x3 or 4 and later.

    Parameters
    ----------
    data : bytes
        Only looked at to see that it is whole; the engine reads the file itself.
    path : Path
    up : {'x', 'y', 'z'}, optional
        z if None, as IFC has it.

    Returns
    -------
    model : Model
        In metres; on the map if the file says where its origin lies.

    Raises
    ------
    InputError
        If the file is damaged or ifcopenshell is not installed.
    """
    ifcopenshell = need("ifcopenshell", "ifc", "IFC")
    if b"END-ISO-10303-21" not in data[-4096:]:
        msg = (
            f"is IFC that ends too early (no END-ISO-10303-21 in its {len(data)} bytes); "
            "export it again"
        )
        raise InputError(msg, byte=len(data))
    _check_numbers(data)
    ifcopenshell.get_log()  # empties it
    try:
        file = ifcopenshell.open(str(path))
        projects = file.by_type("IfcProject")
    except Exception as error:  # whatever the parser raises, the file is not IFC
        errors = _list_errors(ifcopenshell.get_log()) or [_one_line(error)]
        msg = f"is damaged IFC ({errors[-1]}); export it again"
        raise InputError(msg) from error
    errors = _list_errors(ifcopenshell.get_log())
    if not projects:
        msg = "is IFC without an IfcProject, so its units are not known; export the whole project"
        raise InputError(msg)

    products = {
        product.id(): product
        for product in sorted(file.by_type("IfcProduct"), key=lambda product: product.id())
        if product.Representation and not any(product.is_a(name) for name in LEFT_OUT)
    }
    notes = []
    if errors:
        notes.append(f"errors in the file: {len(errors)} (first: {errors[0]})")
    broken = _drop_broken_openings(file)
    if broken:
        notes.append(f"openings that are not in the file left out: {broken}")
    shapes = _make_shapes(file, list(products.values()))
    missing = [product for number, product in products.items() if number not in shapes]
    if missing:
        first = f"{missing[0].is_a()} '{missing[0].Name or missing[0].GlobalId}'"
        notes.append(f"elements without a usable shape left out: {len(missing)} (first: {first})")

    uses = count_names(products.values())
    materials: dict[tuple[Any, ...], tuple[str, Material]] = {}
    parts = [
        part
        for number, shape in shapes.items()
        for part in _make_parts(describe(products[number], uses), shape, file, materials)
    ]
    place, remarks = find_place(file)
    notes += remarks
    matrix, crs, remarks = find_map(file, place)
    notes += remarks
    if matrix is not None:
        parts = [_move(part, matrix) for part in parts]
        place = Place(place.latitude, place.longitude, place.elevation)
    place = replace(place, ground=_find_ground(parts))
    return Model(f"IFC ({file.schema})", turn_up(tuple(parts), up), crs, tuple(notes), place=place)


def _check_numbers(data: bytes) -> None:
    """Refuse a file in which two entities have one number: the engine may end the process."""
    numbers = ENTITY.findall(data)
    if len(set(numbers)) == len(numbers):
        return
    twice = [int(number) for number, count in Counter(numbers).items() if count > 1]
    msg = (
        f"is damaged IFC (entity numbers that come more than once: {len(twice)}, "
        f"first: #{twice[0]}); export it again"
    )
    raise InputError(msg, entity=twice[0])


def _list_errors(log: str) -> list[str]:
    """Give the errors in ifcopenshell's log, without their time."""
    return [" ".join(found.split())[:200] for found in ERROR.findall(log)]


def _one_line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]


def _drop_broken_openings(file: Any) -> int:
    """Drop openings that name an element that is not there: the engine would crash on them."""
    broken = [
        relation
        for relation in file.by_type("IfcRelVoidsElement")
        if relation.RelatedOpeningElement is None or relation.RelatingBuildingElement is None
    ]
    for relation in broken:
        file.remove(relation)
    return len(broken)


def _make_shapes(file: Any, products: list[Any]) -> dict[int, Shape]:
    """Give vertices, faces, style of each face and styles, by product's number; in metres."""
    geom = need("ifcopenshell.geom", "ifc", "IFC")
    settings = geom.settings()
    settings.set("use-world-coords", True)
    settings.set("no-normals", True)
    shapes: dict[int, Shape] = {}
    failed = ""
    for engine in ENGINES:
        left = [product for product in products if product.id() not in shapes]
        if not left:
            break
        try:
            _run_engine(geom, settings, file, engine, left, shapes)
        except RuntimeError as error:  # of C++; or this build lacks the engine
            failed = _one_line(error)
    if failed and not shapes:
        msg = f"is IFC that the geometry engine cannot read ({failed}); export it again"
        raise InputError(msg)
    return {product.id(): shapes[product.id()] for product in products if product.id() in shapes}


def _run_engine(
    geom: Any, settings: Any, file: Any, engine: str, products: list[Any], shapes: dict[int, Shape]
) -> None:
    # One thread: two are no faster on any file measured.
    iterator = geom.iterator(settings, file, 1, include=products, geometry_library=engine)
    more = iterator.initialize()
    while more:
        shape = iterator.get()
        geometry = shape.geometry
        faces = np.array(geometry.faces, np.int32).reshape(-1, 3)
        if len(faces):
            vertices = np.array(geometry.verts, np.float64).reshape(-1, 3)
            style = np.array(geometry.material_ids, np.int32)
            shapes[shape.id] = (vertices, faces, style, list(geometry.materials))
        more = iterator.next()


def _make_parts(
    words: Words,
    shape: Shape,
    file: Any,
    materials: dict[tuple[Any, ...], tuple[str, Material]],
) -> list[Part]:
    vertices, faces, style, styles = shape
    made = [_find_material(one, file, materials) for one in styles]
    # An element repeats a style for each of its pieces: one part for each style.
    looks = list(dict.fromkeys(made))
    if len(style) != len(faces):
        style = np.full(len(faces), -1, np.int32)
    look = np.array([looks.index(one) for one in made] + [-1], np.int32)[style]
    parts = []
    for number in np.unique(look).tolist():
        name, material = looks[number] if number >= 0 else ("", Material())
        tags = words.tags if not name or name in words.tags else (*words.tags, name)
        mesh = Mesh(vertices, faces[look == number])
        parts.append(Part(words.name, words.kind, mesh, material=material, tags=tags))
    return parts


def _find_material(
    style: Any, file: Any, materials: dict[tuple[Any, ...], tuple[str, Material]]
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
    if key not in materials:
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        red, green, blue = np.nan_to_num(linear, nan=0.7).tolist()
        materials[key] = (name, Material((red, green, blue), opacity=1 - clear))
    return materials[key]


def _find_ground(parts: list[Part]) -> float | None:
    """Give the height of the site's own body, if its top is level and it has no other slope."""
    site = [part for part in parts if part.kind == "IfcSite"]
    if not site:
        return None
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in site])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    # Roundly level or upright: anything between is terrain, of which no height is the ground.
    level = np.abs(normals[:, 2]) > 0.9999 * length
    upright = np.abs(normals[:, 2]) < 1e-4 * length
    top = float(corners[..., 2].max())
    upper = level & (normals[:, 2] > 0)
    if not (level | upright | (length == 0)).all() or not upper.any():
        return None
    heights = corners[upper][..., 2]
    area = length[upper][np.abs(heights - top).max(1) < 0.01].sum()
    return top if area > 0.5 * length[upper].sum() else None


def _move(part: Part, matrix: NDArray[np.float64]) -> Part:
    mesh = part.mesh
    return Part(
        part.name, part.kind, mesh.moved(transform_points(matrix, mesh.vertices)),
        material=part.material, tags=part.tags,
    )  # fmt: skip
