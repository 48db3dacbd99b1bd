"""STL and OFF: triangles and polygons without groups."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import list_counts
from umbra.readers.model import FileModel, ReadChoices
from umbra.readers.placement import turn_up
from umbra.readers.triangulate import cut_faces, triangulate
from umbra.scene import Mesh, Part

__all__ = [
    "make_model",
    "read_off",
    "read_stl",
]

STL_HEADER = 84
STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def make_model(
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
    # Triangles alone are kept as they are: inspect tells degenerate ones.
    cut = (cut_faces if (lengths == 3).all() else triangulate)(vertices, corners, lengths)
    part = Part(path.stem, "", Mesh(vertices, cut.faces))
    return FileModel(form, turn_up((part,), choices.up), notes=list_counts(cut.losses))


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
            raise InputError(msg)
        facets = np.frombuffer(data, STL_FACET, count, STL_HEADER)
        points = facets["corners"].reshape(-1, 3).astype(np.float64)
    corners = np.arange(len(points), dtype=np.int64)
    return make_model("STL", path, points, corners, np.full(len(points) // 3, 3), choices)


def _read_stl_text(data: bytes) -> NDArray[np.float64]:
    rows = [
        (number, line.split())
        for number, line in enumerate(data.lower().splitlines(), 1)
        if line.lstrip().startswith(b"vertex")
    ]
    try:
        points = np.array([[float(word) for word in row[1:4]] for _, row in rows], np.float64)
        points = points.reshape(len(rows), 3)
    except ValueError as error:
        number, row = next(((n, row) for n, row in rows if not _are_numbers(row[1:4])), rows[0])
        text = b" ".join(row).decode("utf-8", "replace")[:60]
        msg = f"line {number}: a vertex needs three numbers, not {text!r}; repair the file"
        raise InputError(msg, line=number) from error
    if len(points) % 3 or b"endsolid" not in data.lower()[-2000:]:
        msg = f"is cut short after {len(points)} corners; fetch or export it again"
        raise InputError(msg)
    return points


def _are_numbers(words: list[bytes]) -> bool:
    try:
        return len([float(word) for word in words]) == 3
    except ValueError:
        return False


def read_off(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read an OFF file in text."""
    lines = [line.partition(b"#")[0].split() for line in data.splitlines()]
    rows = [(number, words) for number, words in enumerate(lines, 1) if words]
    head = rows[0][1]
    kind = head[0].upper()
    if not kind.endswith(b"OFF") or kind in {b"4OFF", b"NOFF4", b"NCOFF4"} or b"BINARY" in head:
        msg = "is no OFF file in text with three coordinates; export it again, or as OBJ"
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
        raise InputError(msg)
    points = [_numbers(number, words[:3], float, 3) for number, words in body[:n_vertices]]
    faces = []
    for number, words in body[n_vertices : n_vertices + n_faces]:
        n = int(_numbers(number, words[:1], int, 1)[0])
        faces.append(_numbers(number, words[1 : 1 + max(n, 0)], int, n))
    return make_model(
        "OFF",
        path,
        np.array(points, np.float64).reshape(-1, 3),
        np.array([corner for face in faces for corner in face], np.int64),
        np.array([len(face) for face in faces], np.int64),
        choices,
    )


def _numbers(line: int, words: list[bytes], kind: type, count: int) -> list[float]:
    try:
        values = [kind(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count:
        text = b" ".join(words).decode("utf-8", "replace")[:60]
        msg = f"line {line}: expected {count} numbers, not {text!r}; repair the file"
        raise InputError(msg, line=line)
    return values
