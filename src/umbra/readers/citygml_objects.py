"""One member of a city model: from GML's elements to a feature as in a CityJSON sequence."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses
from umbra.readers.citygml_elements import (
    HREF,
    IDS,
    LINKED_TAGS,
    PATCH,
    PROPERTY,
    TURNED,
    find_dimension,
    id_of,
    level_of,
    name_of,
    name_owner,
    read_numbers,
    read_plain_ring,
    role_of,
    strip,
)

__all__ = ["FeatureReader"]

_LOST_LINKS = "links to surfaces that the file does not hold"
_LOST_SHAPES = "implicit geometries left out whose shape the file does not hold"
_NUMBER, _LINK, _PATCH = 32, 200, 600  # memory of a coordinate, a followed link, a surface [byte]
_AT_ONCE = 1 << 20  # bytes charged to the budget at once
_SOLIDS = {"CompositeSolid", "MultiSolid", "Solid"}
_RINGS = {"LinearRing", "Ring"}
_EXTERIORS = {"exterior", "outerBoundaryIs"}
_INDOORS = {
    "BridgeFurniture", "BridgeRoom", "BuildingFurniture", "BuildingRoom", "HollowSpace",
    "IntBridgeInstallation", "IntBuildingInstallation", "IntTunnelInstallation", "Room",
    "TunnelFurniture",
}  # fmt: skip
_SURFACES = {
    "AuxiliaryTrafficArea", "CeilingSurface", "ClosureSurface", "Door", "DoorSurface",
    "FloorSurface", "GroundSurface", "InteriorWallSurface", "OuterCeilingSurface",
    "OuterFloorSurface", "RoofSurface", "TrafficArea", "WallSurface", "WaterClosureSurface",
    "WaterGroundSurface", "WaterSurface", "Window", "WindowSurface",
}  # fmt: skip


class FeatureReader:
    """
    Reads the members of a city model.

    Parameters
    ----------
    templates : dict
        ``templates`` and ``vertices-templates`` as in CityJSON; appended to.
    counts : Losses
        Added to.
    budget : Budget
        Of memory: links may repeat the same surfaces many times.
    """

    def __init__(self, templates: dict[str, list[Any]], counts: Losses, budget: Budget) -> None:
        self._templates, self._all_counts, self._budget = templates, counts, budget
        self._template_of: dict[str, int] = {}
        self._unnamed = 0
        self._held = 0  # memory not yet charged to the budget [byte]
        self.shared: dict[str, Any] = {}
        """Elements of other members, by id."""
        self.wanted: set[str] = set()
        """Ids of linked elements outside their members."""
        self.named: set[str] = set()
        """Names of CRSs that members' geometries give."""
        self.is_last = False
        """Whether broken links are left out, as no more elements will be found."""

    def read(self, member: Any) -> dict[str, Any] | None:
        """Read a member's objects; None if it links to elements not yet found."""
        self._counts, self._lacks = Losses(), False
        self._coordinates: list[float] = []
        self._objects: dict[str, Any] = {}
        self._near: dict[str, Any] = {}  # surfaces with kinds, to which most links lead
        self._local: dict[str, Any] | None = None
        self._member = member
        for element in member:
            self._read_object(element, None)
        if self._lacks and not self.is_last:
            return None
        self._all_counts.merge(self._counts)
        vertices = np.array(self._coordinates, np.float64).reshape(-1, 3)
        return {"type": "CityJSONFeature", "CityObjects": self._objects, "vertices": vertices}

    def _read_object(self, element: Any, parent: str | None) -> None:
        """Read an object with its surfaces and its child objects."""
        kind, name = name_of(element), id_of(element)
        if name is None or name in self._objects:
            self._unnamed += 1
            name = f"{name or kind} {self._unnamed}"
        item: dict[str, Any] = {"type": kind, "geometry": [], "children": []}
        self._objects[name] = item
        self._owner = name
        levels: dict[str, tuple[list[Any], list[tuple[str, Any]]]] = {}
        for level, shape, theme in self._walk(element, name):
            bodies, themes = levels.setdefault(level, ([], []))
            if theme:
                themes.append((theme, shape))
            else:
                bodies.append(shape)
        self._owner = name  # its children were read in between
        # Coarser levels, and the surfaces of a complete solid, would be read for nothing.
        for level in sorted(levels, key=lambda level: (level.isdigit(), level), reverse=True):
            bodies, themes = levels[level]
            geometries = self._read_level(level, bodies, themes)
            item["geometry"] += geometries
            if any(geometry["type"] != "GeometryInstance" for geometry in geometries):
                break  # shapes in metres are of no use in a city in degrees
        if not item["geometry"] and not item["children"]:
            del self._objects[name]
        elif parent is not None:
            self._objects[parent]["children"].append(name)

    def _read_level(
        self, level: str, bodies: list[Any], themes: list[tuple[str, Any]]
    ) -> list[dict[str, Any]]:
        """Read the geometries of one level; of a solid whose surfaces have kinds, it alone."""
        geometries = []
        kinds = self._name_surfaces(themes) if bodies else {}
        for shape in bodies:
            geometry = self._read_geometry(level, shape, kinds)
            if geometry is not None:
                geometries.append(geometry)
                if geometry["type"] == "Solid" and "semantics" in geometry:
                    return geometries
        boundaries: list[Any] = []
        values: list[str | None] = []
        for theme, shape in themes:
            patches = self._find_patches(shape)
            boundaries += [rings for rings, _ in patches]
            values += [theme] * len(patches)
        if boundaries:
            geometries.append(_with_semantics("MultiSurface", level, boundaries, values))
        return geometries

    def _walk(self, element: Any, name: str) -> Iterator[tuple[str, Any, str]]:
        """Return an object's geometries: level, element, and kind for surfaces."""
        for prop in element:
            level = level_of(prop.tag)
            if level:
                if level == "tin":
                    level = str(element.findtext("{*}lod"))
                for shape in prop:
                    yield level, shape, ""
                continue
            for child in prop:
                inner = strip(child.tag)
                if not inner[:1].isupper():
                    continue
                if inner in _INDOORS:
                    self._counts.add("rooms and furniture left out (indoors)", name)
                elif inner in _SURFACES:
                    for level, shape, own in self._walk(child, name):
                        yield level, shape, own or inner
                elif len(child):
                    self._read_object(child, name)

    def _name_surfaces(self, themes: list[tuple[str, Any]]) -> dict[str, str]:
        """Return the kind of each surface by its id, and remember the surfaces by it."""
        kinds = {}
        for theme, shape in themes:
            for element in shape.iter(*LINKED_TAGS):
                name = id_of(element)
                if name is not None:
                    kinds[name] = theme
                    self._near[name] = element
        return kinds

    def _read_geometry(
        self, level: str, shape: Any, kinds: dict[str, str]
    ) -> dict[str, Any] | None:
        """Read a solid, surfaces or an implicit geometry; None for points and lines."""
        kind = name_of(shape)
        if kind == "ImplicitGeometry":
            return self._read_instance(level, shape)
        patches = self._find_patches(shape)
        if not patches:
            return None
        boundaries = [rings for rings, _ in patches]
        values = [next((kinds[i] for i in ids if i in kinds), None) for _, ids in patches]
        if kind in _SOLIDS:  # shells are not distinguished after this
            return _with_semantics("Solid", level, [boundaries], [values])
        return _with_semantics("MultiSurface", level, boundaries, values)

    def _find_patches(self, shape: Any) -> list[tuple[list[range], tuple[str, ...]]]:
        """Return each polygon's rings of vertex indices, and the ids of all that hold it."""
        patches: list[tuple[list[range], tuple[str, ...]]] = []
        self._add_patches(patches, shape, (), is_turned=False)
        return patches

    def _add_patches(
        self, patches: list[Any], shape: Any, ids: tuple[str, ...], *, is_turned: bool
    ) -> None:
        role = role_of(shape.tag)
        if role != PROPERTY:
            name = self._look_at(shape)
            ids = (*ids, name) if name else ids
            if role == PATCH:
                rings = self._read_rings(shape)
                if rings:
                    self._hold(_PATCH)
                    patches.append(([ring[::-1] for ring in rings] if is_turned else rings, ids))
                return
            if role == TURNED:
                is_turned ^= shape.get("orientation") == "-"
        for child in shape:
            link = child.get(HREF)
            if link is None:
                self._add_patches(patches, child, ids, is_turned=is_turned)
            elif link.strip().removeprefix("#") not in ids:  # else it leads back
                target = self._follow(link)
                if target is not None:
                    self._add_patches(patches, target, ids, is_turned=is_turned)

    def _look_at(self, element: Any) -> str | None:
        """Return an element's id, and note the CRS that it names."""
        name = None
        for key, value in element.items():  # all at once: most elements have no attribute
            if key == "srsName":
                self.named.add(value)
            elif key in IDS:
                name = value
        return name

    def _follow(self, link: str) -> Any | None:
        """Find the element that a link points to."""
        self._hold(_LINK)
        name = link.strip().removeprefix("#")
        target = self._near.get(name)
        if target is None:
            if self._local is None:
                linked = ((id_of(element), element) for element in self._member.iter(*LINKED_TAGS))
                self._local = {name: element for name, element in linked if name is not None}
            target = self._local.get(name)
        if target is None:
            target = self.shared.get(name)
        if target is None:
            self.wanted.add(name)
            self._lacks = True
            self._counts.add(_LOST_LINKS, self._owner)
        return target

    def _hold(self, size: int) -> None:
        """Charge memory to the budget [byte], much of it at once."""
        self._held += size
        if self._held > _AT_ONCE:
            self._budget.spend(self._held, "coordinates")
            self._held = 0

    def _read_rings(self, polygon: Any) -> list[range]:
        """Read a polygon's rings, the exterior first, as indices of new vertices."""
        rings: list[range] = []
        for bound in polygon:
            for ring in bound:
                if strip(ring.tag) not in _RINGS:
                    continue
                numbers = read_plain_ring(ring)
                if numbers is None:
                    numbers = self._read_ring(ring)
                count = len(numbers)
                if count % 3:
                    owner = name_owner(ring)
                    msg = (
                        f"a ring of '{owner}' has {count} coordinates, not three for each corner; "
                        "export the file again"
                    )
                    raise InputError(msg, ring=owner)
                if numbers[:3] == numbers[-3:]:
                    count -= 3
                    del numbers[-3:]
                if count < 9:
                    continue
                self._hold(_NUMBER * count)
                start = len(self._coordinates)
                self._coordinates += numbers
                corners = range(start // 3, (start + count) // 3)
                if rings and strip(bound.tag) in _EXTERIORS:
                    rings.insert(0, corners)
                else:
                    rings.append(corners)
        return rings

    def _read_ring(self, ring: Any) -> list[float]:
        """Return the coordinates of a ring of any form; none if it has no heights."""
        numbers: list[float] = []
        self._look_at(ring)
        for element in ring.iter("{*}posList", "{*}pos", "{*}coordinates"):
            self._look_at(element)
            if find_dimension(element, ring) != 3:
                self._counts.add("rings left out that have no heights", self._owner)
                return []
            more = read_numbers(element, ring)
            # Each piece of a composed ring begins at the end of the one before.
            numbers += more[3:] if numbers and more[:3] == numbers[-3:] else more
        return numbers

    def _read_instance(self, level: str, shape: Any) -> dict[str, Any] | None:
        """Place a shape that several objects share at a point."""
        parts = {name_of(child): child for child in shape}
        index = self._find_template(level, parts.get("relativeGMLGeometry"))
        if index is None:
            index = self._find_template(level, parts.get("relativeGeometry"))
        point = parts.get("referencePoint")
        anchor = None if point is None else next(point.iter("{*}pos"), None)
        if anchor is not None:
            for around in (anchor, anchor.getparent()):
                self._look_at(around)
        position = [] if anchor is None else list(map(float, (anchor.text or "").split()))
        if index is None or len(position) != 3:
            self._counts.add(_LOST_SHAPES, self._owner)
            return None
        self._coordinates += position
        geometry = {
            "type": "GeometryInstance", "template": index,
            "boundaries": [len(self._coordinates) // 3 - 1],
        }  # fmt: skip
        matrix = parts.get("transformationMatrix")
        if matrix is not None and matrix.text:
            geometry["transformationMatrix"] = list(map(float, matrix.text.split()))
        return geometry

    def _find_template(self, level: str, holder: Any | None) -> int | None:
        """Return the index of a shape's template, read once."""
        if holder is None:
            return None
        link = holder.get(HREF)
        name = link.removeprefix("#") if link else None
        if name in self._template_of:
            return self._template_of[name]
        shape = self._follow(link) if link else next(iter(holder), None)
        if shape is None:
            return None
        outer, self._coordinates = self._coordinates, []
        boundaries = [rings for rings, _ in self._find_patches(shape)]
        coordinates, self._coordinates = self._coordinates, outer
        vertices, templates = self._templates["vertices-templates"], self._templates["templates"]
        first = len(vertices)
        vertices += np.reshape(coordinates, (-1, 3)).tolist()
        shifted = [[[first + i for i in ring] for ring in rings] for rings in boundaries]
        templates.append({"type": "MultiSurface", "lod": level, "boundaries": shifted})
        name = name or id_of(shape)
        if name is not None:
            self._template_of[name] = len(templates) - 1
        return len(templates) - 1


def _with_semantics(
    kind: str, level: str, boundaries: list[Any], values: list[Any]
) -> dict[str, Any]:
    """Make a geometry of CityJSON whose surfaces' kinds are given by name, or None."""
    flat = values if kind == "MultiSurface" else values[0]
    names = sorted({value for value in flat if value is not None})
    geometry: dict[str, Any] = {"type": kind, "lod": level, "boundaries": boundaries}
    if names:
        numbers = [None if value is None else names.index(value) for value in flat]
        geometry["semantics"] = {
            "surfaces": [{"type": name} for name in names],
            "values": numbers if kind == "MultiSurface" else [numbers],
        }
    return geometry
