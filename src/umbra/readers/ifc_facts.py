"""Site, map conversion and names of elements in an IFC file."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.packages import need
from umbra.readers.georeference import is_known_crs, name_crs
from umbra.readers.model import APART, FilePlace, tell_doubt

__all__ = [
    "IfcWords",
    "count_names",
    "count_rooms",
    "describe_element",
    "find_grade",
    "find_map",
    "find_place",
]


def find_place(file: Any) -> tuple[FilePlace, list[str]]:
    """Find latitude, longitude and elevation of the site (if its sites agree), and true north."""
    notes: list[str] = []
    places: dict[str, tuple[float, float, float | None]] = {}
    for site in file.by_type("IfcSite"):
        latitude, longitude = _degrees(site.RefLatitude), _degrees(site.RefLongitude)
        name = site.Name or site.GlobalId
        if latitude is None or longitude is None:
            continue
        if abs(latitude) > 90 or abs(longitude) > 180 or (latitude == 0 and longitude == 0):
            notes.append(
                f"site '{name}' says latitude {latitude:g}°, longitude {longitude:g}°, which "
                "is left out"
            )
            continue
        places[name] = (latitude, longitude, _elevation(file, site, notes))
    north = _true_north(file)
    if not places:
        return FilePlace(true_north=north), notes
    (latitude, longitude, elevation), *others = places.values()
    if any(abs(a - latitude) > APART or abs(b - longitude) > APART for a, b, _ in others):
        listed = "; ".join(f"'{n}' at {a:.4f}°, {b:.4f}°" for n, (a, b, _) in places.items())
        doubt = f"its {len(places)} sites disagree ({listed})"
        return FilePlace(true_north=north, doubt=doubt), [*notes, tell_doubt(doubt)]
    return FilePlace(latitude, longitude, elevation, north), notes


def find_grade(file: Any) -> tuple[float, str] | None:
    """
    Find the height of the ground [m] in the file's coordinates, and what states it.

    That is the storey whose elevation is the building's zero, or near it; else the site.
    """
    unit = _unit_scale(file)
    near: list[tuple[float, str, Any]] = []
    for storey in file.by_type("IfcBuildingStorey"):
        height = _find_height(storey, unit)
        level = storey.Elevation
        away = abs(float(level) * unit) if level is not None else abs(height or math.inf)
        if height is None and level is not None:
            height = float(level) * unit
        if height is not None and away <= GRADE:
            near.append((away, str(storey.Name or storey.GlobalId), height))
    if near:
        _, name, height = min(near)
        return float(height), f"its storey '{name}'"
    for site in file.by_type("IfcSite"):
        height = _find_height(site, unit)
        if height is not None:
            return height, "the height of its site"
    return None


def _find_height(product: Any, unit: float) -> float | None:
    """Return the height of an object's placement in the file's coordinates [m]."""
    if product.ObjectPlacement is None:
        return None
    placement = need("ifcopenshell.util.placement", "ifc", "IFC")
    height = float(placement.get_local_placement(product.ObjectPlacement)[2, 3]) * unit
    return height if math.isfinite(height) else None


def find_map(
    file: Any, site: FilePlace
) -> tuple[NDArray[np.float64] | None, str | None, list[str]]:
    """Find the matrix (4, 4) from the file's metres to a map, and the map's CRS if it is known."""
    conversion, target = _read_conversion(file)
    if conversion is None:
        return None, None, []
    name = target.get("Name")
    crs = name_crs(name)
    if crs is None or not is_known_crs(crs):
        what = f"'{name}'" if name else "without a name"
        return None, None, [
            f"the map conversion leads to a CRS {what}, which is not known, and is not used"
        ]  # fmt: skip
    project = _unit_scale(file)
    unit = _metres(target.get("MapUnit"), project)
    # Scale converts the project's unit to the map's; here both sides are metres.
    scale = float(conversion.get("Scale") or 1.0) * unit / project
    notes: list[str] = []
    if not LEAST < scale < MOST:
        # Many exporters leave Scale out where the project is in millimetres.
        notes.append(f"the map conversion scales metres by {scale:g}; 1 is taken instead")
        scale = 1.0
    along = float(conversion.get("XAxisAbscissa") or 0.0)
    across = float(conversion.get("XAxisOrdinate") or 0.0)
    if along == 0.0 and across == 0.0:
        along = 1.0
    length = math.hypot(along, across)
    cos, sin = along / length, across / length
    east, north, height = (
        float(conversion.get(key) or 0.0) * unit
        for key in ("Eastings", "Northings", "OrthogonalHeight")
    )
    matrix = np.array(
        [
            [scale * cos, -scale * sin, 0, east],
            [scale * sin, scale * cos, 0, north],
            [0, 0, scale, height],
            [0, 0, 0, 1],
        ]
    )
    turned = math.degrees(math.atan2(across, along))
    if site.true_north is not None and abs((turned - site.true_north + 180) % 360 - 180) > 5:
        notes.append(
            f"TrueNorth ({site.true_north:.2f}°) and the map conversion's north ({turned:.2f}°) "
            "differ; the map's is used"
        )
    return matrix, crs, notes


def _read_conversion(file: Any) -> tuple[dict[str, Any] | None, dict[str, Any]]:
    """Read the map conversion: an entity in IFC4 and later, property sets in IFC2x3."""
    if file.schema != "IFC2X3":
        for conversion in file.by_type("IfcMapConversion"):
            target = conversion.TargetCRS
            return conversion.get_info(), {} if target is None else target.get_info()
        return None, {}
    element = need("ifcopenshell.util.element", "ifc", "IFC")
    for owner in (*file.by_type("IfcProject"), *file.by_type("IfcSite")):
        sets = {name.lower(): values for name, values in element.get_psets(owner).items()}
        if "epset_mapconversion" in sets:
            return sets["epset_mapconversion"], sets.get("epset_projectedcrs", {})
    return None, {}


def _metres(unit: Any, project: float) -> float:
    """Return the metres of a map's unit, an IFC entity or a word; the project's by default."""
    if unit is None:
        return project
    if isinstance(unit, str):
        prefixes = {"MILLIMETRE": 1e-3, "CENTIMETRE": 1e-2, "METRE": 1.0, "METER": 1.0}
        return prefixes.get(unit.strip().upper(), project)
    units = need("ifcopenshell.util.unit", "ifc", "IFC")
    if unit.is_a("IfcSIUnit"):
        return float(units.get_prefix_multiplier(unit.Prefix))
    return float(unit.ConversionFactor.ValueComponent.wrappedValue)


def _unit_scale(file: Any) -> float:
    """Return the metres of the project's length unit."""
    units = need("ifcopenshell.util.unit", "ifc", "IFC")
    return float(units.calculate_unit_scale(file))


def _degrees(parts: tuple[int, ...] | None) -> float | None:
    """Turn degrees, minutes, seconds and millionths of seconds into degrees."""
    if not parts:
        return None
    weights = (1.0, 1 / 60, 1 / 3600, 1e-6 / 3600)
    return sum(part * weight for part, weight in zip(parts, weights, strict=False))


def _elevation(file: Any, site: Any, notes: list[str]) -> float | None:
    if site.RefElevation is None:
        return None
    elevation = float(site.RefElevation) * _unit_scale(file)
    if -500 <= elevation <= 9000:
        return elevation
    notes.append(f"site '{site.Name or site.GlobalId}' lies {elevation:g} m high: left out")
    return None


def _true_north(file: Any) -> float | None:
    """Return the azimuth of true north in the file's plan, clockwise from +y [degrees]."""
    for context in file.by_type("IfcGeometricRepresentationContext", include_subtypes=False):
        direction = context.TrueNorth
        if direction is not None and context.ContextType != "Plan":
            x, y = direction.DirectionRatios[:2]
            # Rounded, because exporters write cos 90° as 6e-17.
            return round(math.degrees(math.atan2(x, y)), 9) + 0.0
    return None


GRADE = 1.5  # from the zero of a building within which a storey is at grade [m]
LEAST, MOST = 0.9, 1.1  # scales of a map projection


@dataclass(frozen=True)
class IfcWords:
    """Name and class of the whole that an element belongs to; its own tags, name and class."""

    name: str
    kind: str
    tags: tuple[str, ...]
    own_name: str
    own_kind: str


def count_names(products: Iterable[Any]) -> Counter[str]:
    """Count the elements of each name, without pieces of assemblies."""
    wholes = {chain[-1].id(): chain[-1] for chain in map(_ancestors, products)}
    return Counter(whole.Name for whole in wholes.values() if whole.Name)


def count_rooms(file: Any) -> Counter[str]:
    """Count the spaces of each name."""
    return Counter(filter(None, map(_title, file.by_type("IfcSpace"))))


def describe_element(product: Any, uses: Counter[str], rooms: Counter[str]) -> IfcWords:
    """Collect the name, class and tags of an element; of each name so many elements and rooms."""
    element = need("ifcopenshell.util.element", "ifc", "IFC")
    chain = _ancestors(product)
    whole = chain[-1]
    name = whole.Name or f"{whole.is_a()} {whole.GlobalId}"
    if whole.Name and uses[whole.Name] > 1:
        name = f"{whole.Name} {whole.GlobalId}"
    words: list[str | None] = []
    for piece in chain:
        words += [piece.Name, piece.is_a(), piece.is_a().replace("StandardCase", "")]
        words += [getattr(piece, "PredefinedType", None), getattr(piece, "ObjectType", None)]
        words.append(getattr(element.get_type(piece), "Name", None))
        words += [getattr(material, "Name", None) for material in element.get_materials(piece)]
        words.append(piece.GlobalId)
    storey = _find_storey(element.get_container(whole))
    words.append(storey)
    if product.is_a("IfcWindow") or product.is_a("IfcDoor"):
        words += [f"storey={storey}" if storey else None, *_find_spaces(product, rooms)]
    skip = {name, whole.is_a(), "NOTDEFINED", "USERDEFINED"}
    tags = tuple(dict.fromkeys(str(w) for w in words if w and w not in skip))
    return IfcWords(name, whole.is_a(), tags, product.Name or product.GlobalId, product.is_a())


def _find_spaces(product: Any, rooms: Counter[str]) -> list[str]:
    """
    Name the space that an opening serves, by the boundaries of spaces: ``space=Kitchen``.

    The kitchens of two flats are two rooms: ``space=Kitchen (A103)``.
    """
    for boundary in getattr(product, "ProvidesBoundaries", ()) or ():
        space = boundary.RelatingSpace
        name = _title(space) if space is not None and space.is_a("IfcSpace") else ""
        if name:
            number = space.Name if space.Name and space.Name != name else space.GlobalId
            return [f"space={name} ({number})" if rooms[name] > 1 else f"space={name}"]
    return []


def _title(space: Any) -> str:
    """Return what people call a space: its long name, else its number."""
    return getattr(space, "LongName", None) or space.Name or ""


def _find_storey(container: Any) -> str | None:
    """Name the storey that holds a container: itself, or one above it."""
    seen: set[int] = set()
    while container is not None and not container.is_a("IfcBuildingStorey"):
        if container.id() in seen:  # a damaged file: it is a piece of itself
            return None
        seen.add(container.id())
        above = [r.RelatingObject for r in getattr(container, "Decomposes", ()) or ()]
        container = above[0] if above else None
    return None if container is None else container.Name


def _ancestors(product: Any) -> list[Any]:
    """Follow an element up to its outermost assembly; the element itself is first."""
    chain = [product]
    while True:
        relations = getattr(chain[-1], "Decomposes", ()) or ()
        above = next((r.RelatingObject for r in relations), None)
        if above is None or not above.is_a("IfcElement") or above in chain:
            return chain
        chain.append(above)
