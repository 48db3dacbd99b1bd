"""
CityGML 1.0, 2.0 and 3.0 with PLATEAU's extensions: one city object at a time.

Each member of the city model becomes a feature as in a CityJSON sequence, read by the same
code. An `lxml` parser reads the file as a stream, also unpacked, and holds the tree of one
member; entities and document types are not allowed. Members that link to surfaces of others are
read again in further passes, in which only those surfaces are held.
"""

import gzip
from collections.abc import Iterator
from contextlib import closing
from copy import deepcopy
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses, errors_of, list_counts
from umbra.readers.citygml_elements import HREF, LINKED, LINKED_TAGS, id_of, name_of
from umbra.readers.citygml_objects import FeatureReader
from umbra.readers.cityjson import Templates, make_parts
from umbra.readers.cityjson_choice import DEPTHS, flatten
from umbra.readers.content import GZIP, ZIP, BoundedStream, FileContent, open_archive
from umbra.readers.formats import list_citygml_members
from umbra.readers.georeference import find_axis_orders, is_in_degrees, is_same_plan, name_crs
from umbra.readers.model import FileModel, ReadChoices, turn_up
from umbra.readers.region import Region, is_outside_region

__all__ = ["read_citygml"]

_MEMBERS = ("cityObjectMember", "cityObjectMembers", "featureMember", "featureMembers", "member")
_DOCTYPE = "declares a document type or entities, which CityGML does not need; remove them"
_APPEARANCE = "surfaceDataMember"
_PASSES = 4
"""Most times that surfaces of other members are looked for: their links may lead on."""
_POLAR = 72.0  # degrees of latitude beyond which there is hardly a city
_ELEMENT = 300  # memory of an element with its text [byte]
_TAG = 110  # memory of an element or a text of a member, for each tag [byte]


def read_citygml(content: FileContent, _: Path, choices: ReadChoices) -> FileModel:
    """Read CityGML, also compressed by gzip or in a ZIP archive."""
    need("lxml", "citygml", "CityGML")
    counts = Losses()
    city = _City(content, counts, choices.budget, choices.region)
    # The list of templates grows while members are read.
    parts = make_parts(
        city.read_features(), Templates(city.templates, choices.budget), counts, lambda _: ""
    )
    counts["members left out that lie in other files"] += city.outside
    notes = (*city.notes, *list_counts(counts))
    form = f"CityGML {city.version}".strip()
    return FileModel(form, turn_up(parts, choices.up), city.crs, notes, outside=city.left_out)


class _City:
    """
    A file of CityGML.

    Parameters
    ----------
    content : FileContent
    counts : Losses
        Added to.
    budget : Budget
    region : Region, optional
        Members that lie wholly outside are left out.
    """

    def __init__(
        self, content: FileContent, counts: Losses, budget: Budget, region: Region | None = None
    ) -> None:
        self._region = region
        self.left_out = 0
        self._content, self._counts, self._budget = content, counts, budget
        self.version = ""
        self.crs: str | None = None
        self.templates: dict[str, list[Any]] = {"templates": [], "vertices-templates": []}
        self.notes: list[str] = []
        self.outside = 0
        self._swaps: bool | None = None

    def read_features(self) -> Iterator[dict[str, Any]]:
        """Read the city's members as features of CityJSON."""
        reader = FeatureReader(self.templates, self._counts, self._budget)
        later = set()
        for number, member in enumerate(self._find_members()):
            feature = self._read(reader, member)
            if feature is None:
                later.add(number)
            else:
                yield feature
            _forget(member)
        for _ in range(_PASSES):
            copies = self._find_shared(reader.wanted - reader.shared.keys()) if later else {}
            if not copies:
                break
            reader.shared |= copies
            yield from self._read_again(reader, later)
        reader.is_last = True
        if later:
            yield from self._read_again(reader, later)

    def _read_again(self, reader: FeatureReader, later: set[int]) -> Iterator[dict[str, Any]]:
        """Read members whose links led out of them; those that are read leave ``later``."""
        for number, member in enumerate(self._find_members()):
            if number in later:
                feature = self._read(reader, member)
                if feature is not None:
                    later.discard(number)
                    yield feature
            _forget(member)

    def _read(self, reader: FeatureReader, member: Any) -> dict[str, Any] | None:
        """Read a member as a feature; None if it links to elements not yet found."""
        feature = reader.read(member)
        for named in reader.named:
            self._compare(named)
        reader.named.clear()
        return None if feature is None else self._place(feature)

    def _find_members(self) -> Iterator[Any]:
        """Iterate over the members; set the version, the CRS and the number outside."""
        self.outside = 0
        for root, element in self._parse((*_MEMBERS, "Envelope", _APPEARANCE)):
            if not self.version:
                self.version = _find_version(root)
            name = name_of(element)
            if name == "Envelope":
                self._compare(element.get("srsName"))
            elif name == _APPEARANCE:
                element.clear()  # textures may be larger than all else
            elif element.get(HREF) is not None:
                self.outside += 1
            else:
                yield element

    def _compare(self, named: str | None) -> None:
        """Take the CRS of the first element that names one; refuse another."""
        crs = name_crs(named)
        if crs is None or crs == self.crs:
            return
        if self.crs is not None and not is_same_plan(crs, self.crs):
            msg = (
                f"names two coordinate reference systems, {self.crs} and {crs}; "
                "convert it to one, or give a file for each"
            )
            raise InputError(msg, crs=(self.crs, crs))
        self.crs = self.crs or crs

    def _find_shared(self, wanted: set[str]) -> dict[str, Any]:
        """Read the file again for copies of elements linked from other members."""
        copies = {}
        for _, element in self._parse((*LINKED, *_MEMBERS, _APPEARANCE)):
            name = id_of(element)
            if name is not None and name in wanted:
                self._budget.spend(_ELEMENT * sum(1 for _ in element.iter()), "linked surfaces")
                copies[name] = deepcopy(element)
            elif name_of(element) in _MEMBERS:
                _forget(element)
            elif name_of(element) == _APPEARANCE:
                element.clear()
        return copies

    def _parse(self, names: tuple[str, ...] | None) -> Iterator[tuple[Any, Any]]:
        from lxml import etree  # noqa: PLC0415 - an extra

        tags = None if names is None else [f"{{*}}{name}" for name in names]
        for name, stream in _open(self._content, self._budget):
            with closing(stream), errors_of(name):
                events = etree.iterparse(
                    stream, events=("end",), tag=tags, resolve_entities=False, no_network=True,
                    load_dtd=False, remove_comments=True, remove_pis=True, huge_tree=True,
                )  # fmt: skip
                try:
                    for _, element in events:
                        stream.forget()
                        if element.getroottree().docinfo.doctype:
                            raise InputError(_DOCTYPE)
                        yield element.getroottree().getroot(), element
                except etree.XMLSyntaxError as error:
                    line, reason = error.lineno or 0, " ".join(str(error.msg).split())
                    if "entity" in reason:
                        raise InputError(_DOCTYPE) from error
                    msg = f"is damaged XML at line {line} ({reason}); fetch or export it again"
                    raise InputError(msg, line=line) from error

    def _place(self, feature: dict[str, Any]) -> dict[str, Any]:
        """Reorder a feature's vertices to east, north, up; leave out shapes in degrees."""
        if self.crs is not None and is_in_degrees(self.crs):
            for name, item in feature["CityObjects"].items():
                shapes = item["geometry"]
                item["geometry"] = [g for g in shapes if g["type"] != "GeometryInstance"]
                if len(item["geometry"]) < len(shapes):
                    self._counts.add("implicit geometries left out, as the CRS is in degrees", name)
        vertices: NDArray[np.float64] = feature["vertices"]
        if self._swaps is None and self.crs is not None and len(vertices):
            says, orders = find_axis_orders(self.crs, vertices[0])
            # If either order is possible, choose the one with outward bodies.
            wrong = len(orders) > 1 and _find_volume(feature) * (-1 if orders[0] else 1) < 0
            self._swaps = orders[wrong]
            if self._swaps != says:
                read, said = ("north", "east") if self._swaps else ("east", "north")
                why = "bodies would be inside out" if wrong else f"not where {self.crs} is used"
                self.notes.append(
                    f"coordinates are read {read} first, although {self.crs} says {said} first: "
                    f"that way they would lie elsewhere ({why})"
                )
            north, east = vertices[0, :2] if self._swaps else vertices[0, 1::-1]
            if is_in_degrees(self.crs) and abs(north) > _POLAR > abs(east):
                self.notes.append(
                    f"latitudes are {north:.4f}° as {self.crs} orders the coordinates, where few "
                    "cities are; if the file has them the other way, swap them in it"
                )
        if self._swaps:
            feature["vertices"] = np.ascontiguousarray(vertices[:, [1, 0, 2]])
        if self._region is not None and is_outside_region(feature, self._region, self.crs):
            self.left_out += len(feature["CityObjects"])
            return {**feature, "CityObjects": {}, "vertices": vertices[:0]}
        return feature


def _forget(member: Any) -> None:
    """
    Free a member and all before it: a city's tree does not fit in memory.

    What Python still refers to is emptied first, the inner before the outer: lxml would move it and
    all below it out of the tree, and takes 13 s for 150,000 elements.
    """
    for element in reversed(list(member.iter(*LINKED_TAGS))):
        element.clear()
    member.clear()
    while member.getprevious() is not None:
        del member.getparent()[0]


def _find_volume(feature: dict[str, Any]) -> float:
    """Return the signed volume of a feature's bodies, positive if wound outward as x, y, z."""
    vertices = feature["vertices"] - feature["vertices"][0]
    sixfold = 0.0
    for item in feature["CityObjects"].values():
        for geometry in item["geometry"]:
            for surface in flatten(geometry) if geometry["type"] in DEPTHS else ():
                corners = vertices[surface[0]]
                across = np.cross(corners[1:-1], corners[2:]).sum(0)
                sixfold += float(across @ corners[0])
    return sixfold


def _find_version(root: Any) -> str:
    """Find the version, which ends the root's namespaces."""
    for address in root.nsmap.values():
        front, _, last = str(address).rpartition("/")
        if front.endswith("opengis.net/citygml"):
            return last
    return ""


class _TagStream:
    """
    A stream of XML that accounts for the tree, which grows until a member ends.

    Parameters
    ----------
    stream : binary stream
    budget : Budget
    """

    def __init__(self, stream: Any, budget: Budget) -> None:
        self._stream, self._budget = stream, budget
        self._tags = 0
        self.close = stream.close

    def read(self, size: int = -1) -> bytes:
        """Read a block; refuse more tags since the last member than fit in memory."""
        block: bytes = self._stream.read(size)
        self._tags += block.count(b"<")
        self._budget.check(_TAG * self._tags, "elements of one member")
        return block

    def forget(self) -> None:
        """Begin another member."""
        self._tags = 0


def _open(content: FileContent, budget: Budget) -> Iterator[tuple[str, _TagStream]]:
    """Open the file, or each CityGML file in a ZIP archive, and name it for errors."""
    for name, stream in _open_members(content, budget):
        yield name, _TagStream(stream, budget)


def _open_members(
    content: FileContent, budget: Budget
) -> Iterator[tuple[str, "BinaryIO | BoundedStream"]]:
    with content.open() as file:
        if content.head.startswith(GZIP):
            yield "", BoundedStream(gzip.GzipFile(fileobj=file), budget)
        elif content.head.startswith(ZIP):
            archive, members = open_archive(file, budget, list_citygml_members)
            with archive:
                for name in members:
                    yield f"{name} ", BoundedStream(archive.open(name), budget)
        else:
            yield "", file
