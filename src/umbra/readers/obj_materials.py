"""Materials of OBJ: Wavefront material libraries and texture coordinates."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.budget import TooLargeError
from umbra.readers.checks import Companions, OutsideError, image_beside, list_counts
from umbra.scene import Material, Mesh
from umbra.scene.material import GREY, Color

__all__ = ["read_materials", "read_texture_corners"]

OUTSIDE = "textures outside the model's folder left out (allow_outside=True reads them)"
LARGEST = 1 << 26  # [byte] of a library

# Words that each option of a texture takes; -o, -s and -t take 1 to 3 numbers.
OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1,
    "-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1,
}  # fmt: skip


@dataclass
class _Entry:
    """One material of a library."""

    color: Color | None = None
    opacity: float = 1.0
    emission: Color = (0.0, 0.0, 0.0)
    texture: str = ""
    clamps: bool = False
    library: str = ""


def read_materials(
    libraries: list[str], companions: Companions, kinds: Iterable[str]
) -> tuple[dict[str, Material], tuple[str, ...]]:
    """
    Read the materials of these kinds from the libraries that an OBJ file names.

    Missing ones are plain. Textures lie beside the libraries that name them.
    """
    entries: dict[str, _Entry] = {}
    notes: list[str] = []
    for name in dict.fromkeys(libraries):
        library = name.replace("\\", "/")
        try:
            text = companions.read(library, LARGEST)
        except TooLargeError:
            raise
        except InputError as error:
            notes.append(f"material library {error}; default colours are used")
            continue
        _read_entries(text.decode("utf-8", "replace"), library, entries)
    counts: Counter[str] = Counter()
    materials = {
        kind: _make(entries.get(kind, _Entry()), companions, counts)
        for kind in dict.fromkeys(kinds)
    }
    return materials, (*notes, *list_counts(counts))


def _make(entry: _Entry, companions: Companions, counts: Counter[str]) -> Material:
    """Make a material; a texture that cannot be read is counted."""
    image = None
    if entry.texture:
        wrap = ("clamp", "clamp") if entry.clamps else ("repeat", "repeat")
        try:
            beside = str(PurePosixPath(entry.library).parent / entry.texture)
            image = image_beside(companions, beside, wrap)
        except TooLargeError:
            raise
        except OutsideError:
            counts[OUTSIDE] += 1
        except InputError:
            counts["missing textures left out"] += 1
    color = entry.color or ((1.0, 1.0, 1.0) if image else GREY)
    if image is not None and not any(color):
        color = (1.0, 1.0, 1.0)  # some exporters write black with a texture
    return Material(color, image, entry.opacity, entry.emission)


def _read_entries(text: str, library: str, entries: dict[str, _Entry]) -> None:
    entry = None
    for line in text.splitlines():
        words = line.split()
        key = words[0] if words else ""
        if key == "newmtl":
            entry = entries[line.strip()[6:].strip()] = _Entry(library=library)
        elif entry is None:
            continue
        elif key in {"Kd", "Ke"}:
            color = _read_color(words[1:4])
            if color is not None and key == "Kd":
                entry.color = color
            elif color is not None:
                entry.emission = color
        elif key == "d":
            try:
                opacity = float(words[-1])
            except ValueError:
                continue
            # 0 would be invisible; exporters that write it mean opaque.
            entry.opacity = opacity if 0 < opacity < 1 else 1.0
        elif key == "map_Kd":
            _read_texture(words[1:], entry)


def _read_color(words: list[str]) -> Color | None:
    try:
        values = [min(max(float(word), 0.0), 1.0) for word in words]
    except ValueError:
        return None  # a texture or a spectrum
    if len(values) not in {1, 3}:
        return None
    red, green, blue = values * 3 if len(values) == 1 else values
    return red, green, blue


def _read_texture(words: list[str], entry: _Entry) -> None:
    """Read a texture's name, which may hold spaces, after its options."""
    while words and words[0] in OPTIONS:
        option, words = words[0], words[1:]
        taken = 0
        while taken < OPTIONS[option] and len(words) > 1:
            if option in {"-o", "-s", "-t"} and not _is_number(words[0]):
                break
            if option == "-clamp":
                entry.clamps = words[0] == "on"
            words, taken = words[1:], taken + 1
    entry.texture = " ".join(words).replace("\\", "/")


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


@dataclass(frozen=True, eq=False)
class TextureCorners:
    """The texture coordinates of a file's corners."""

    # (n, 2): (0, 0) is the upper left corner; the last row is for corners that have none
    uv: NDArray[np.float32]
    # (n_corners,): ascending: face of the file times the number of vertices, plus vertex
    keys: NDArray[np.int64]
    places: NDArray[np.int64]  # (n_corners,): rows of ``uv``

    def split(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int32], source: NDArray[np.int64]
    ) -> Mesh:
        """Make a mesh of faces with a vertex for each pair of place and texture coordinate."""
        corners = faces.astype(np.int64)
        row = np.searchsorted(self.keys, source[:, None] * len(vertices) + corners)
        pairs = corners * len(self.uv) + self.places[row]
        used, new = np.unique(pairs, return_inverse=True)
        vertex, texel = np.divmod(used, len(self.uv))
        return Mesh(vertices[vertex], new.reshape(-1, 3).astype(np.int32), uv=self.uv[texel])


def read_texture_corners(
    lines: list[bytes],
    face_lines: list[bytes],
    corners: NDArray[np.int64],
    lengths: NDArray[np.int64],
    n_vertices: int,
) -> tuple[TextureCorners, int]:
    """Read texture coordinates and their corners; count the corners without any."""
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
    """Return a corner's texture index as the file has it; 0 if it has none."""
    parts = word.split(b"/", 2)
    try:
        return int(parts[1]) if len(parts) > 1 and parts[1] else 0
    except ValueError:
        return 0
