"""Which format a file is in: by its first bytes, then by its name's ending."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from umbra.errors import InputError
from umbra.readers.model import Choices, Model
from umbra.readers.unread import find_unread

__all__ = ["FORMATS", "find_reader"]

FORMATS = (
    "CityJSON (.json, .jsonl), glTF (.gltf, .glb), IFC, OBJ, PLY, STL, OFF, "
    "footprints (.geojson, .gpkg, .shp), height rasters (.tif)"
)

Reader = Callable[[bytes, Path, Choices], Model]

# Readers load on first use: each brings libraries that take time to import.
READERS = {
    "json": ("umbra.readers.json_family", "read_json"),
    "glb": ("umbra.readers.gltf", "read_gltf"),
    "ifc": ("umbra.readers.ifc", "read_ifc"),
    "obj": ("umbra.readers.obj", "read_obj"),
    "off": ("umbra.readers.soup", "read_off"),
    "ply": ("umbra.readers.ply", "read_ply"),
    "stl": ("umbra.readers.soup", "read_stl"),
    "tiff": ("umbra.readers.raster", "read_raster"),
    "vector": ("umbra.readers.vectors", "read_vectors"),
}

# These ask for more than the upward axis.
CHOOSY = {"glb", "json", "obj", "tiff", "vector"}

BY_ENDING = {
    ".json": "json",
    ".jsonl": "json",
    ".cityjson": "json",
    ".geojson": "json",
    ".gltf": "json",
    ".glb": "glb",
    ".obj": "obj",
    ".off": "off",
    ".ply": "ply",
    ".stl": "stl",
    ".ifc": "ifc",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".gpkg": "vector",
    ".shp": "vector",
}

BY_CONTENT = {
    b"glTF": "glb",
    b"ply\n": "ply",
    b"ply\r": "ply",
    b"ISO-10303-21": "ifc",
    b"II*\x00": "tiff",
    b"MM\x00*": "tiff",
    b"II+\x00": "tiff",
    b"MM\x00+": "tiff",
    b"SQLite format 3": "vector",
    b"\x00\x00\x27\x0a": "vector",
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
    reader : function of (data, path, choices) -> Model

    Raises
    ------
    InputError
        If the format is not one that is read.
    """
    start = data[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
    unread = find_unread(data, path, by_ending=False)
    if unread is not None:
        msg = f"{unread}; umbra reads {FORMATS}"
        raise InputError(msg)
    kind = BY_ENDING.get(path.suffix.lower())
    told = next((found for magic, found in BY_CONTENT.items() if start.startswith(magic)), None)
    if told is not None:
        kind = told
    elif start.startswith(b"{") and kind != "stl":
        kind = "json"
    elif kind is None and start.startswith(b"OFF"):
        kind = "off"
    if kind is None:
        unread = find_unread(data, path, by_ending=True)
        if unread is not None:
            msg = f"{unread}; umbra reads {FORMATS}"
            raise InputError(msg)
        ending = f"'{path.suffix}'" if path.suffix else "its ending"
        msg = f"is in no format that is read (by its content and {ending}); umbra reads {FORMATS}"
        raise InputError(msg)
    if kind in BY_CONTENT.values() and told is None and kind in {"ifc", "tiff", "vector"}:
        msg = f"is named {path.suffix} but does not begin as such a file does; export it again"
        raise InputError(msg)
    module, function = READERS[kind]
    reader = getattr(import_module(module), function)
    if kind in CHOOSY:
        return reader
    return lambda data, path, choices: reader(data, path, choices.up)
