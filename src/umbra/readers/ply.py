"""PLY, text and binary: vertices and polygons; whatever else it holds is passed over."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.model import FileModel, ReadChoices
from umbra.readers.triangle_soup import make_model

__all__ = ["read_ply"]

TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}

FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


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


def read_ply(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a PLY file as one part, without colours."""
    order, elements, start = _parse_header(data)
    source: _Binary | _Text = _Binary(data, start, order) if order else _Text(data, start)
    columns: dict[tuple[str, str], Any] = {}
    for element in elements:
        try:
            columns.update(
                ((element.name, name), values) for name, values in source.read(element).items()
            )
        except (IndexError, OverflowError, TypeError, ValueError) as error:
            msg = (
                f"its {element.count} '{element.name}' elements are cut short or damaged; "
                "fetch or export it again"
            )
            raise InputError(msg, element=element.name) from error
    try:
        points = np.stack([columns["vertex", axis] for axis in "xyz"], axis=1).astype(np.float64)
    except KeyError as error:
        msg = f"its vertices have no {error.args[0][1]}; export it again"
        raise InputError(msg) from error
    for name in ("vertex_indices", "vertex_index"):
        if ("face", name) in columns:
            corners, lengths = columns["face", name]
            return make_model("PLY", path, points, corners, lengths, choices)
    msg = "holds points but no faces; export it as a mesh"
    raise InputError(msg)


def _parse_header(data: bytes) -> tuple[str, list[_Element], int]:
    """Give the byte order ('' for text), the elements, and where the body starts."""
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
            return FORMATS[form]
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
    """The body as words, one element a line."""

    def __init__(self, data: bytes, start: int) -> None:
        self._lines = [line for line in data[start:].splitlines() if line.strip()]
        self._next = 0

    def read(self, element: _Element) -> dict[str, Any]:
        """Read an element: columns, and (corners, lengths) for lists."""
        rows = [line.split() for line in self._lines[self._next : self._next + element.count]]
        self._next += element.count
        if len(rows) < element.count:
            msg = "too few lines"
            raise ValueError(msg)
        columns: dict[str, Any] = {}
        starts = [0] * len(rows)
        for item in element.properties:
            if not item.length_kind:
                columns[item.name] = np.array(
                    [float(row[at]) for row, at in zip(rows, starts)], np.float64
                )
                starts = [at + 1 for at in starts]
                continue
            lengths = [int(row[at]) for row, at in zip(rows, starts)]
            stops = [at + 1 + n for at, n in zip(starts, lengths)]
            if any(n < 0 or stop > len(row) for row, n, stop in zip(rows, lengths, stops)):
                msg = "a list is too short"
                raise ValueError(msg)
            words = [
                word for row, at, stop in zip(rows, starts, stops) for word in row[at + 1 : stop]
            ]
            if item.kind[0] != "f":  # texture coordinates are of no use here
                corners = np.array([int(word) for word in words], np.int64)
                columns[item.name] = corners, np.array(lengths, np.int64)
            starts = stops
        return columns


class _Binary:
    """The body as packed numbers."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self._data = data
        self._at = start
        self._order = order

    def read(self, element: _Element) -> dict[str, Any]:
        """Read an element: columns, and (corners, lengths) for lists."""
        if not element.count:
            return {item.name: _empty(item) for item in element.properties}
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
            lists = [i for i, item in enumerate(element.properties) if item.length_kind]
            if all((table[f"n{i}"] == first[i]).all() for i in lists):
                self._at += row.itemsize * element.count
                return self._columns(element, table, first)
        return self._read_rows(element)

    def _columns(
        self, element: _Element, table: NDArray[Any], lengths: list[int]
    ) -> dict[str, Any]:
        columns: dict[str, Any] = {}
        for number, (item, n) in enumerate(zip(element.properties, lengths)):
            values = table[f"v{number}"]
            if not item.length_kind:
                columns[item.name] = values
            elif item.kind[0] != "f":
                columns[item.name] = values.reshape(-1).astype(np.int64), np.full(len(table), n)
        return columns

    def _read_one(self, element: _Element, at: int) -> tuple[int, list[int], list[Any]]:
        """Read one row: where the next begins, the lists' lengths, the values."""
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
        """Read rows of different lengths one by one."""
        smallest = sum(
            np.dtype(item.length_kind or item.kind).itemsize for item in element.properties
        )
        if self._at + element.count * smallest > len(self._data):
            msg = "too few bytes"
            raise ValueError(msg)
        rows = []
        lengths = []
        for _ in range(element.count):
            self._at, n, values = self._read_one(element, self._at)
            rows.append(values)
            lengths.append(n)
        columns: dict[str, Any] = {}
        for number, item in enumerate(element.properties):
            joined = np.concatenate([row[number] for row in rows])
            if not item.length_kind:
                columns[item.name] = joined
            elif item.kind[0] != "f":
                sizes = np.array([n[number] for n in lengths], np.int64)
                columns[item.name] = joined.astype(np.int64), sizes
        return columns


def _empty(item: _Property) -> Any:
    nothing = np.zeros(0, np.int64)
    return (nothing, nothing) if item.length_kind else nothing
