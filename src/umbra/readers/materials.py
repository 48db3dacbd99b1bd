"""Wavefront material libraries: diffuse colours and textures, opacity, glow."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from umbra.readers.images import image_beside
from umbra.scene import Material
from umbra.scene.material import GREY, Color

__all__ = ["read_materials"]

# Words that each option of a texture takes; those of -o, -s and -t are 1 to 3 numbers.
OPTIONS = {
    "-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1,
    "-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1,
}  # fmt: skip


@dataclass
class _Entry:
    """What a library says of one material."""

    color: Color | None = None
    opacity: float = 1.0
    emission: Color = (0.0, 0.0, 0.0)
    texture: str = ""
    clamps: bool = False
    library: Path = Path()


def read_materials(
    libraries: list[str], path: Path, kinds: Iterable[str]
) -> tuple[dict[str, Material], tuple[str, ...]]:
    """
    Read the materials of the libraries that an OBJ file names.

    Parameters
    ----------
    libraries : list of str
        As after ``mtllib``; a name may hold spaces.
    path : Path
        The OBJ file: libraries are looked for beside it, textures beside them.
    kinds : iterable of str
        Names of the materials that are used; one that no library has is plain.

    Returns
    -------
    materials : dict of str to Material
        Values are clipped to their range.
    notes : tuple of str
        Libraries and textures that are not there.
    """
    entries: dict[str, _Entry] = {}
    notes: list[str] = []
    for name in dict.fromkeys(libraries):
        library = path.parent / name.replace("\\", "/")
        try:
            text = library.read_bytes()
        except (OSError, ValueError):
            notes.append(f"material library '{name}' cannot be read; default colours are used")
            continue
        _read_entries(text.decode("utf-8", "replace"), library, entries)
    materials: dict[str, Material] = {}
    lost = 0
    for kind in kinds:
        if kind not in materials:
            materials[kind], is_lost = _make(entries.get(kind, _Entry()))
            lost += is_lost
    if lost:
        notes.append(f"textures that are not there, drawn plain: {lost}")
    return materials, tuple(notes)


def _make(entry: _Entry) -> tuple[Material, bool]:
    """Make a material, and tell whether its texture is missing."""
    image = None
    if entry.texture:
        wrap = ("clamp", "clamp") if entry.clamps else ("repeat", "repeat")
        image = image_beside(entry.library, entry.texture, wrap)
    color = entry.color or ((1.0, 1.0, 1.0) if image else GREY)
    if image is not None and not any(color):
        color = (1.0, 1.0, 1.0)  # some exporters say black and mean the texture
    material = Material(color, image, entry.opacity, entry.emission)
    return material, bool(entry.texture) and image is None


def _read_entries(text: str, library: Path, entries: dict[str, _Entry]) -> None:
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
            # 0 would be nothing at all; exporters that write it mean opaque.
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
