"""STL, OFF and PLY: triangles and polygons without groups; colours are ignored."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import list_counts
from umbra.readers.model import FileModel, ReadChoices, turn_up
from umbra.readers.triangulate import cut_faces, triangulate
from umbra.scene import Mesh, Part

__all__ = ["read_off", "read_ply", "read_stl"]

STL_HEADER = 84
STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

DAMAGE = (IndexError, OverflowError, TypeError, ValueError)


@dataclass(frozen=True, eq=False)
class _Property:
    name: str
    kind: str
    length_kind: str = ""  # of a list


@dataclass(frozen=True, eq=False)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


def read_stl(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read an STL file, binary or text."""
    count = int.from_bytes(data[80:STL_HEADER], "little")
    size = STL_HEADER + count * STL_FACET.itemsize
    # Binary files may begin with "solid" too; only the size tells.
    if len(data) != size and data.lstrip()[:5].lower() == b"solid" and b"facet" in data[:2000]:
        points = _read_stl_text(data)
    else:
        if len(data) < STL_HEADER or len(data) < size:
            msg = (
                f"is cut short or no STL: {count} facets need {size} bytes, it has {len(data)}; "
                "fetch or export it again"
            )
            raise InputError(msg, bytes=len(data), needed=size)
        facets = np.frombuffer(data, STL_FACET, count, STL_HEADER)
        points = facets["corners"].reshape(-1, 3).astype(np.float64)
    corners = np.arange(len(points), dtype=np.int64)
    return _make_model("STL", path, points, corners, np.full(len(points) // 3, 3), choices)


def _read_stl_text(data: bytes) -> NDArray[np.float64]:
    rows = [
        (number, line.split()[1:])
        for number, line in enumerate(data.lower().splitlines(), 1)
        if line.lstrip().startswith(b"vertex")
    ]
    points = _read_points(_Text(rows), len(rows))
    if len(points) % 3 or b"endsolid" not in data.lower()[-2000:]:
        msg = f"is cut short after {len(points)} corners; fetch or export it again"
        raise InputError(msg, count=len(points))
    return points


def _read_points(source: "_Text", count: int) -> NDArray[np.float64]:
    columns = source.read(_Element("vertex", count, [_Property(axis, "f8") for axis in "xyz"]))
    return np.stack([columns[axis] for axis in "xyz"], axis=1)


def read_off(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read an OFF file in text."""
    lines = [line.partition(b"#")[0].split() for line in data.splitlines()]
    rows = [(number, words) for number, words in enumerate(lines, 1) if words]
    head = rows[0][1]
    kind = head[0].upper()
    if not kind.endswith(b"OFF") or kind in {b"4OFF", b"NOFF4", b"NCOFF4"} or b"BINARY" in head:
        msg = "is not an OFF file in text with three coordinates; export it again, or as OBJ"
        raise InputError(msg)
    # The counts may stand behind the keyword.
    counts, body = (head[1:], rows[1:]) if len(head) > 1 else (rows[1][1], rows[2:])
    try:
        n_vertices, n_faces = int(counts[0]), int(counts[1])
    except (IndexError, ValueError) as error:
        msg = "the line of counts does not say how many vertices and faces; export it again"
        raise InputError(msg) from error
    if min(n_vertices, n_faces) < 0 or len(body) < n_vertices + n_faces:
        msg = (
            f"is cut short: it announces {n_vertices} vertices and {n_faces} faces, "
            f"but {len(body)} lines follow; fetch or export it again"
        )
        raise InputError(msg, lines=len(body), needed=n_vertices + n_faces)
    source = _Text(body)
    points = _read_points(source, n_vertices)
    faces = source.read(_Element("face", n_faces, [_Property("corners", "i8", "i8")]))
    corners, lengths = faces["corners"]
    return _make_model("OFF", path, points, corners, lengths, choices)


def read_ply(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a PLY file, text or binary."""
    order, elements, start = _parse_header(data)
    source: _Binary | _Text
    if order:
        source = _Binary(data, start, order)
    else:
        first = data.count(b"\n", 0, start) + 1
        lines = enumerate(data[start:].splitlines(), first)
        source = _Text([(number, line.split()) for number, line in lines if line.strip()])
    columns: dict[tuple[str, str], Any] = {}
    for element in elements:
        try:
            read = source.read(element)
        except InputError:
            raise
        except DAMAGE as error:
            msg = (
                f"its {element.count} '{element.name}' elements are cut short or damaged; "
                "fetch or export it again"
            )
            raise InputError(msg, element=element.name) from error
        columns.update(((element.name, name), values) for name, values in read.items())
    try:
        points = np.stack([columns["vertex", axis] for axis in "xyz"], axis=1).astype(np.float64)
    except KeyError as error:
        msg = f"its vertices have no {error.args[0][1]}; export it again"
        raise InputError(msg) from error
    for name in ("vertex_indices", "vertex_index"):
        if ("face", name) in columns:
            corners, lengths = columns["face", name]
            return _make_model("PLY", path, points, corners, lengths, choices)
    msg = "holds points but no faces; export it as a mesh"
    raise InputError(msg)


def _make_model(
    form: str,
    path: Path,
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    lengths: NDArray[np.int64],
    choices: ReadChoices,
) -> FileModel:
    """Make a model of one part, named like the file, from polygons, corner after corner."""
    wrong = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(lengths), wrong[0], "right"))
        msg = (
            f"face {face} names vertex {corners[wrong[0]]}, but there are {len(vertices)} "
            f"vertices ({len(wrong)} such corners in all); repair the file"
        )
        raise InputError(msg, face=face, count=len(wrong))
    # Triangles are kept as they are: inspect reports degenerate ones.
    cut = (cut_faces if (lengths == 3).all() else triangulate)(vertices, corners, lengths)
    part = Part(path.stem, "", Mesh(vertices, cut.faces))
    return FileModel(form, turn_up((part,), choices.up), notes=list_counts(cut.losses))


def _parse_header(data: bytes) -> tuple[str, list[_Element], int]:
    """Return the byte order ('' for text), the elements, and where the body starts."""
    end = data.find(b"end_header")
    after = data.find(b"\n", end)
    if end < 0 or after < 0:
        msg = "its header does not end; fetch or export it again"
        raise InputError(msg)
    order: str | None = None
    elements: list[_Element] = []
    for number, line in enumerate(data[:end].decode("ascii", "replace").splitlines(), 1):
        try:
            order = _parse_header_line(line.split(), elements, order)
        except (IndexError, KeyError, ValueError) as error:
            msg = f"line {number}: {line[:60]!r} is no PLY header line; repair the file"
            raise InputError(msg, line=number) from error
    if order is None:
        msg = "its header names no format; repair the file"
        raise InputError(msg)
    return order, elements, after + 1


def _parse_header_line(words: list[str], elements: list[_Element], order: str | None) -> str | None:
    match words:
        case ["format", form, *_]:
            return ORDERS[form]
        case ["element", name, count] if count.isdecimal():
            elements.append(_Element(name, int(count)))
        case ["property", "list", length_kind, kind, name]:
            elements[-1].properties.append(_Property(name, TYPES[kind], TYPES[length_kind]))
        case ["property", kind, name]:
            elements[-1].properties.append(_Property(name, TYPES[kind]))
        case ["property" | "element", *_]:
            msg = "too many or too few words"
            raise ValueError(msg)
        case _:
            pass
    return order


class _Text:
    """The body as numbered rows of words, one per element."""

    def __init__(self, rows: list[tuple[int, list[bytes]]]) -> None:
        self._rows = rows
        self._next = 0

    def read(self, element: _Element) -> dict[str, Any]:
        """Read an element: columns, and (corners, lengths) for lists."""
        rows = self._rows[self._next : self._next + element.count]
        self._next += element.count
        if len(rows) < element.count:
            msg = "too few lines"
            raise ValueError(msg)
        try:
            return _read_columns(element, [words for _, words in rows])
        except DAMAGE:
            for number, words in rows:
                try:
                    _read_columns(element, [words])
                except DAMAGE as error:
                    text = b" ".join(words).decode("utf-8", "replace")[:60]
                    msg = (
                        f"line {number}: the {element.name} {text!r} is cut short or damaged; "
                        "fetch or export it again"
                    )
                    raise InputError(msg, line=number, element=element.name) from error
            raise


def _read_columns(element: _Element, rows: list[list[bytes]]) -> dict[str, Any]:
    values: list[Any] = []
    sizes: list[Any] = []
    starts = [0] * len(rows)
    for item in element.properties:
        lengths = [int(row[at]) for row, at in zip(rows, starts)] if item.length_kind else None
        if lengths is None:
            column = [float(row[at]) for row, at in zip(rows, starts)]
            values.append(np.array(column, np.float64))
            starts = [at + 1 for at in starts]
        else:
            stops = [at + 1 + n for at, n in zip(starts, lengths)]
            if any(n < 0 or stop > len(row) for row, n, stop in zip(rows, lengths, stops)):
                msg = "a list is too short"
                raise ValueError(msg)
            words = (w for row, at, stop in zip(rows, starts, stops) for w in row[at + 1 : stop])
            is_passed = item.kind[0] == "f"
            values.append(np.array([] if is_passed else [int(w) for w in words], np.int64))
            starts = stops
        sizes.append(lengths)
    return _gather(element, values, sizes)


def _gather(element: _Element, values: list[Any], sizes: list[Any]) -> dict[str, Any]:
    """Return columns by name, and (corners, lengths) for lists of whole numbers."""
    columns: dict[str, Any] = {}
    for item, column, lengths in zip(element.properties, values, sizes, strict=True):
        if not item.length_kind:
            columns[item.name] = column
        elif item.kind[0] != "f":  # texture coordinates are not needed
            corners = column.reshape(-1).astype(np.int64)
            columns[item.name] = corners, np.array(lengths, np.int64)
    return columns


class _Binary:
    """The body as packed numbers."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self._data = data
        self._at = start
        self._order = order

    def read(self, element: _Element) -> dict[str, Any]:
        """Read an element: columns, and (corners, lengths) for lists."""
        many = range(len(element.properties))
        if not element.count:
            return _gather(element, [np.zeros(0, np.int64) for _ in many], [[] for _ in many])
        _, first, _ = self._read_one(element, self._at)
        # As a rule every row has lists as long as the first: one block of numbers.
        fields: list[tuple[str, str] | tuple[str, str, int]] = []
        for number, (item, n) in enumerate(zip(element.properties, first)):
            if item.length_kind:
                fields.append((f"n{number}", self._order + item.length_kind))
                fields.append((f"v{number}", self._order + item.kind, n))
            else:
                fields.append((f"v{number}", self._order + item.kind))
        row = np.dtype(fields)
        if self._at + row.itemsize * element.count <= len(self._data):
            table = np.frombuffer(self._data, row, element.count, self._at)
            lists = [i for i in many if element.properties[i].length_kind]
            if all((table[f"n{i}"] == first[i]).all() for i in lists):
                self._at += row.itemsize * element.count
                values = [table[f"v{i}"] for i in many]
                return _gather(element, values, [np.full(len(table), n) for n in first])
        return self._read_rows(element)

    def _read_one(self, element: _Element, at: int) -> tuple[int, list[int], list[Any]]:
        """Read one row: start of the next, the lists' lengths, the values."""
        lengths, values = [], []
        for item in element.properties:
            n = 1
            if item.length_kind:
                kind = np.dtype(self._order + item.length_kind)
                n = int(np.frombuffer(self._data, kind, 1, at)[0])
                at += kind.itemsize
            if n < 0:
                msg = "a list of negative length"
                raise ValueError(msg)
            kind = np.dtype(self._order + item.kind)
            values.append(np.frombuffer(self._data, kind, n, at) if n else np.zeros(0, kind))
            lengths.append(n)
            at += n * kind.itemsize
        return at, lengths, values

    def _read_rows(self, element: _Element) -> dict[str, Any]:
        """Read rows of different lengths."""
        smallest = sum(
            np.dtype(item.length_kind or item.kind).itemsize for item in element.properties
        )
        if self._at + element.count * smallest > len(self._data):
            msg = "too few bytes"
            raise ValueError(msg)
        lengths, rows = [], []
        for _ in range(element.count):
            self._at, sizes, values = self._read_one(element, self._at)
            lengths.append(sizes)
            rows.append(values)
        joined = [np.concatenate(column) for column in zip(*rows, strict=True)]
        return _gather(element, joined, list(zip(*lengths, strict=True)))
