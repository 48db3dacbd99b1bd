"""OBJ's texture coordinates: read only where a material has a texture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Mesh

__all__ = ["TextureCorners", "read_texture_corners"]


@dataclass(frozen=True, eq=False)
class TextureCorners:
    """
    The texture coordinates of a file's corners.

    Parameters
    ----------
    uv : (n, 2) float32
        (0, 0) is the upper left corner; the last row is for corners that have none.
    keys : (n_corners,) int64
        Ascending: face of the file times the number of vertices, plus vertex.
    places : (n_corners,) int64
        Rows of ``uv``.
    """

    uv: NDArray[np.float32]
    keys: NDArray[np.int64]
    places: NDArray[np.int64]

    def split(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int32], source: NDArray[np.int64]
    ) -> Mesh:
        """
        Make a mesh with a vertex for each pair of place and texture coordinate.

        Parameters
        ----------
        vertices : (n_vertices, 3) float64
        faces : (n_faces, 3) int32
        source : (n_faces,) int64
            The face of the file that each comes from.
        """
        corners = faces.astype(np.int64)
        found = np.searchsorted(self.keys, source[:, None] * len(vertices) + corners)
        pairs = corners * len(self.uv) + self.places[found]
        used, new = np.unique(pairs, return_inverse=True)
        place, texel = np.divmod(used, len(self.uv))
        return Mesh(vertices[place], new.reshape(-1, 3).astype(np.int32), uv=self.uv[texel])


def read_texture_corners(
    lines: list[bytes],
    face_lines: list[bytes],
    corners: NDArray[np.int64],
    lengths: NDArray[np.int64],
    n_vertices: int,
) -> tuple[TextureCorners, int]:
    """
    Read texture coordinates and who uses them.

    Parameters
    ----------
    lines : list of bytes
        The whole file.
    face_lines : list of bytes
        Its faces.
    corners : (n_corners,) int64
        Their vertices, from 0.
    lengths : (n_faces,) int64
    n_vertices : int

    Returns
    -------
    texture : TextureCorners
    lost : int
        Corners with coordinates that are not there; they have (0, 0).
    """
    rows, before = [], []
    for line in lines:
        start = line[:2]
        if start == b"vt":
            rows.append(_read_pair(line))
        elif start in {b"f ", b"f\t", b"fo"} or line.split(None, 1)[:1] in ([b"f"], [b"fo"]):
            before.append(len(rows))
    uv = np.array([*rows, (0.0, 1.0)], np.float32)
    uv[:, 1] = 1 - uv[:, 1]  # the file counts v from the bottom
    none = len(rows)
    uv[none] = 0.0
    words = [word for line in face_lines for word in line.partition(b"#")[0].split()[1:]]
    named = np.array([_read_index(word) for word in words], np.int64)
    behind = np.repeat(np.array(before, np.int64), lengths)
    places = np.where(named < 0, named + behind, named - 1)
    places[named == 0] = none
    wrong = (places < 0) | (places > none)
    places[wrong] = none
    lost = int(wrong.sum())
    keys = np.repeat(np.arange(len(lengths)), lengths) * n_vertices + corners
    order = np.argsort(keys, kind="stable")
    return TextureCorners(uv, keys[order], places[order]), lost


def _read_pair(line: bytes) -> tuple[float, float]:
    words = line.split()
    try:
        return float(words[1]), float(words[2]) if len(words) > 2 else 0.0
    except (IndexError, ValueError):
        return 0.0, 0.0


def _read_index(word: bytes) -> int:
    """Give a corner's texture index as the file has it; 0 if it has none."""
    parts = word.split(b"/", 2)
    try:
        return int(parts[1]) if len(parts) > 1 and parts[1] else 0
    except ValueError:
        return 0
