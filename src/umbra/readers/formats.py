"""Which format a file is in: by its first bytes, then by its name's ending."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from umbra.errors import InputError
from umbra.readers.model import Model

__all__ = ["FORMATS", "find_reader"]

FORMATS = "CityJSON (.json, .jsonl), glTF (.gltf, .glb), OBJ, PLY, STL, OFF"

Reader = Callable[[bytes, Path, str | None], Model]

# Readers load on first use: each brings libraries that take time to import.
READERS = {
    "json": ("umbra.readers.json_family", "read_json"),
    "glb": ("umbra.readers.gltf", "read_gltf"),
    "obj": ("umbra.readers.obj", "read_obj"),
    "off": ("umbra.readers.soup", "read_off"),
    "ply": ("umbra.readers.ply", "read_ply"),
    "stl": ("umbra.readers.soup", "read_stl"),
}

BY_ENDING = {
    ".json": "json",
    ".jsonl": "json",
    ".cityjson": "json",
    ".gltf": "json",
    ".glb": "glb",
    ".obj": "obj",
    ".off": "off",
    ".ply": "ply",
    ".stl": "stl",
}

UNREAD = {
    b"ISO-10303-21": "IFC is not read; export it as CityJSON, glTF or OBJ",
    b"<?xml": "XML (CityGML, COLLADA) is not read; convert it to CityJSON, glTF or OBJ",
    b"\x1f\x8b": "is compressed (gzip); unpack it first",
    b"PK\x03\x04": "is a ZIP archive; unpack it first",
    b"Kaydara FBX": "FBX is not read; export it as glTF or OBJ",
    b"BLENDER": "Blender files are not read; export it as glTF or OBJ",
    b"II*\x00": "TIFF rasters are not read",
    b"MM\x00*": "TIFF rasters are not read",
    b"\x89HDF": "HDF5 files are not read",
    b"version https://git-lfs": "is a Git LFS pointer, not the file; run git lfs pull",
}


def find_reader(data: bytes, path: Path) -> Reader:
    """
    Find the function that reads a file.

    Parameters
    ----------
    data : bytes
        The file, not empty.
    path : Path
        Its name.

    Returns
    -------
    reader : function of (data, path, up) -> Model

    Raises
    ------
    InputError
        If the format is not one that is read.
    """
    start = data[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
    for magic, what in UNREAD.items():
        if start.startswith(magic):
            msg = f"{what}; umbra reads {FORMATS}"
            raise InputError(msg)
    kind = BY_ENDING.get(path.suffix.lower())
    if start.startswith(b"glTF"):
        kind = "glb"
    elif start.startswith((b"ply\n", b"ply\r")):
        kind = "ply"
    elif start.startswith(b"{") and kind != "stl":
        kind = "json"
    elif kind is None and start.startswith(b"OFF"):
        kind = "off"
    if kind is None:
        ending = f"'{path.suffix}'" if path.suffix else "its ending"
        msg = f"is in no format that is read (by its content and {ending}); umbra reads {FORMATS}"
        raise InputError(msg)
    module, function = READERS[kind]
    return getattr(import_module(module), function)
