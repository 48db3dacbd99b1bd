"""OBJ: groups and materials, polygons of any shape, indices from either end."""

from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import list_counts
from umbra.readers.model import FileModel, ReadChoices, turn_up
from umbra.readers.obj_materials import read_materials, read_texture_corners
from umbra.readers.triangulate import cut_faces
from umbra.scene import Mesh, Part

__all__ = ["read_obj"]

BLOCK = 65536  # face lines turned into numbers at once, to bound memory


@dataclass(eq=False)
class _Statements:
    """An OBJ file's lines, sorted by statement."""

    vertices: list[bytes] = field(default_factory=list)
    faces: list[bytes] = field(default_factory=list)
    # Vertices before each face, only where an index counts from the end.
    seen: list[int] = field(default_factory=list)
    # First face, object or group name, material; at each change.
    states: list[tuple[int, str, str]] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    _object: str = ""
    _group: str = ""
    _material: str = ""

    def switch(self, key: bytes, text: str) -> None:
        """Begin an object, a group or a material, or name a library of materials."""
        if key == b"mtllib":
            self.libraries.append(text)
            return
        if key == b"o":
            self._object, self._group = text, ""
        elif key == b"g":
            self._group = text
        else:
            self._material = text
        self.states.append((len(self.faces), self._group or self._object, self._material))


def read_obj(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a Wavefront OBJ file: a part for each pair of group (``g``, else ``o``) and material."""
    lines = _split_lines(data)
    statements = _sort_lines(lines, data)
    vertices = _parse_vertices(statements, data)
    corners, lengths = _parse_faces(statements, len(vertices), data)
    cut = cut_faces(vertices, corners, lengths, choices.budget)

    # Parts in the order in which the file first names them.
    starts = [start for start, _, _ in statements.states]
    state = np.searchsorted(starts, cut.polygon, "right") - 1
    keys: dict[tuple[str, str], int] = {}
    key_of_state = [keys.setdefault(s[1:], len(keys)) for s in statements.states]
    part = np.array(key_of_state, np.int64)[state]
    order = np.argsort(part, kind="stable")
    faces, face_line = cut.faces[order], cut.polygon[order]
    ends = np.cumsum(np.bincount(part, minlength=len(keys))).tolist()
    spans = {key: slice(start, end) for key, start, end in zip(keys, [0, *ends], ends)}
    spans = {key: span for key, span in spans.items() if span.stop > span.start}
    companions = choices.companions_of(path)
    kinds = [kind for _, kind in spans]
    materials, notes = read_materials(statements.libraries, companions, kinds)
    meshes = {key: Mesh(vertices, faces[span]) for key, span in spans.items()}
    textured = [key for key in spans if materials[key[1]].image is not None]
    if textured:
        texture, lost = read_texture_corners(
            lines, statements.faces, corners, lengths, len(vertices)
        )
        for key in textured:
            meshes[key] = texture.split(vertices, faces[spans[key]], face_line[spans[key]])
        if lost:
            notes += (f"corners without their texture coordinates: {lost}",)
    parts = [
        Part(name or path.stem, kind, mesh, None, materials[kind])
        for (name, kind), mesh in meshes.items()
    ]
    notes += list_counts(cut.losses)
    return FileModel("OBJ", turn_up(tuple(parts), choices.up), notes=notes)


def _split_lines(data: bytes) -> list[bytes]:
    if b"\\" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    return data.splitlines()


def _sort_lines(lines: list[bytes], data: bytes) -> _Statements:
    statements = _Statements(states=[(0, "", "")])
    vertices, faces, seen = statements.vertices, statements.faces, statements.seen
    # An index from the end depends on the vertices so far.
    relative = b" -" in data
    for line in lines:
        start = line[:2]
        if start == b"v ":
            vertices.append(line)
        elif start == b"f ":
            faces.append(line)
            if relative:
                seen.append(len(vertices))
        elif start not in {b"vt", b"vn", b"# ", b""}:
            words = line.split(None, 1)
            key = words[0] if words else b""
            if key == b"v":
                vertices.append(line)
            elif key in {b"f", b"fo"}:
                faces.append(line.strip())
                if relative:
                    seen.append(len(vertices))
            elif key in {b"o", b"g", b"usemtl", b"mtllib"}:
                text = words[1].strip() if len(words) > 1 else b""
                statements.switch(key, text.decode("utf-8", "replace"))
    return statements


def _parse_vertices(statements: _Statements, data: bytes) -> NDArray[np.float64]:
    blocks = [np.zeros(0)]
    for first in range(0, len(statements.vertices), BLOCK):
        block = statements.vertices[first : first + BLOCK]
        words = _split_even(block, 3)
        try:
            if words is None:
                # Further numbers are a weight or a colour.
                rows = [line.split() for line in block]
                words = [word for row in rows for word in (row[1], row[2], row[3])]
            blocks.append(np.array([float(word) for word in words], np.float64))
        except (IndexError, ValueError) as error:
            raise _bad_vertex([line.split() for line in statements.vertices], data) from error
    return np.concatenate(blocks).reshape(-1, 3)


def _split_even(lines: list[bytes], count: int) -> list[bytes] | None:
    """Split lines at once, without their keywords, if each has ``count`` words besides."""
    words = b" ".join(lines).split()
    step = count + 1
    # If lines have too many and too few words, keywords are out of step.
    if len(words) != step * len(lines) or set(words[::step]) != {lines[0].split()[0]}:
        return None
    del words[::step]
    return words


def _bad_vertex(rows: list[list[bytes]], data: bytes) -> InputError:
    for index, row in enumerate(rows):
        try:
            complete = len(list(map(float, row[1:4]))) == 3
        except ValueError:
            complete = False
        if not complete:
            line = _find_line(data, b"v", index)
            text = b" ".join(row).decode("utf-8", "replace")[:60]
            msg = f"line {line}: a vertex needs three numbers, not {text!r}; repair the file"
            return InputError(msg, line=line)
    msg = "a vertex is damaged; repair the file"
    return InputError(msg)


def _parse_faces(
    statements: _Statements, n_vertices: int, data: bytes
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return all faces' corners, checked and from 0, and how many each face has."""
    corner_blocks = [np.zeros(0, np.int64)]
    length_blocks = [np.zeros(0, np.int64)]
    for first in range(0, len(statements.faces), BLOCK):
        block = statements.faces[first : first + BLOCK]
        if any(b"#" in line for line in block):
            block = [line.partition(b"#")[0] for line in block]
        words = _split_even(block, 3)
        if words is not None:
            lengths = np.full(len(block), 3)
        else:
            rows = [line.split() for line in block]
            lengths = np.array([len(row) for row in rows], np.int64) - 1
            words = list(chain.from_iterable(row[1:] for row in rows))
        try:
            corners = np.array([int(word) for word in words], np.int64)
        except (ValueError, OverflowError):
            try:
                corners = np.array([int(word.partition(b"/")[0]) for word in words], np.int64)
            except (ValueError, OverflowError) as error:
                raise _bad_face(block, first, data) from error
        if statements.seen:
            seen = np.repeat(np.array(statements.seen[first : first + BLOCK]), lengths)
            corners = np.where(corners < 0, corners + seen, corners - 1)
        else:
            corners -= 1
        wrong = np.flatnonzero((corners < 0) | (corners >= n_vertices))
        if len(wrong):
            face = int(np.searchsorted(np.cumsum(lengths), wrong[0], "right"))
            line = _find_line(data, b"f", first + face)
            word = words[wrong[0]].decode("utf-8", "replace")
            msg = (
                f"line {line}: a face names vertex {word}, but there are {n_vertices} vertices; "
                "repair the file"
            )
            raise InputError(msg, line=line)
        corner_blocks.append(corners)
        length_blocks.append(lengths)
    return np.concatenate(corner_blocks), np.concatenate(length_blocks)


def _bad_face(lines: list[bytes], first: int, data: bytes) -> InputError:
    for index, line_words in enumerate(lines):
        for word in line_words.split()[1:]:
            try:
                np.int64(int(word.partition(b"/")[0]))
            except (ValueError, OverflowError):
                line = _find_line(data, b"f", first + index)
                text = word.decode("utf-8", "replace")[:40]
                msg = f"line {line}: {text!r} is not a vertex index; repair the file"
                return InputError(msg, line=line)
    msg = "a face is damaged; repair the file"
    return InputError(msg)


def _find_line(data: bytes, key: bytes, index: int) -> int:
    """Find the line, from 1, of the index-th statement of a kind."""
    keys = {key, b"fo"} if key == b"f" else {key}
    continued = False
    for number, line in enumerate(data.splitlines(), 1):
        words = line.split(None, 1)
        if not continued and words and words[0] in keys:
            if index == 0:
                return number
            index -= 1
        continued = line.endswith(b"\\")
    return 0
