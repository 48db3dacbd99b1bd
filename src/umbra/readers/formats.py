"""Which format a file is in: by its first bytes, its name's ending and, in JSON, its type."""

from collections.abc import Callable
from importlib import import_module
from json import JSONDecodeError
from pathlib import Path

from umbra.errors import InputError
from umbra.readers.model import FileModel, ReadChoices
from umbra.readers.unread import find_unread

__all__ = [
    "FORMATS",
    "find_reader",
    "read_json",
]

FORMATS = (
    "CityJSON (.json, .jsonl), glTF (.gltf, .glb), IFC, OBJ, PLY, STL, OFF, "
    "footprints (.geojson, .gpkg, .shp), height rasters (.tif)"
)

Reader = Callable[[bytes, Path, ReadChoices], FileModel]

# Readers load on first use: each brings libraries that take time to import.
READERS = {
    "json": ("umbra.readers.formats", "read_json"),
    "glb": ("umbra.readers.gltf", "read_gltf"),
    "ifc": ("umbra.readers.ifc", "read_ifc"),
    "obj": ("umbra.readers.obj", "read_obj"),
    "off": ("umbra.readers.triangle_soup", "read_off"),
    "ply": ("umbra.readers.ply", "read_ply"),
    "stl": ("umbra.readers.triangle_soup", "read_stl"),
    "tiff": ("umbra.readers.raster", "read_raster"),
    "vector": ("umbra.readers.footprint_files", "read_vectors"),
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
    """Find the function that reads a file that is not empty: (data, path, choices) -> FileModel."""
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


OLD = "is glTF 1.0; umbra reads 2.0, convert it (npx gltf-pipeline -i FILE -o OUT.glb)"

BOM = b"\xef\xbb\xbf"

GEOJSON = {"FeatureCollection", "Feature", "GeometryCollection", "MultiPolygon", "Polygon"}


def read_json(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a JSON file of any kind that is read; say where it is broken."""
    import orjson  # noqa: PLC0415 - only if it is JSON

    data = data.removeprefix(BOM)
    try:
        documents = [orjson.loads(data)]
    except JSONDecodeError as error:
        documents = _parse_lines(data, path, error)
    head = documents[0]
    if not isinstance(head, dict):
        msg = (
            f"is JSON, but holds a {type(head).__name__}, not a model; "
            "give CityJSON, GeoJSON or glTF"
        )
        raise InputError(msg)
    if "asset" in head:
        from umbra.readers.gltf import read_gltf_tree  # noqa: PLC0415 - only if it is one

        return read_gltf_tree(head, None, path, choices)
    kind = head.get("type")
    if kind in {"CityJSON", "CityJSONFeature"}:
        from umbra.readers.cityjson import read_cityjson  # noqa: PLC0415

        return read_cityjson(documents, choices.up)
    if kind in GEOJSON:
        from umbra.readers.footprint_files import read_geojson  # noqa: PLC0415

        return read_geojson(documents, choices)
    if kind == "Model" and "properties" in head:
        msg = (
            "is a Honeybee model (HBJSON), which is not read; export OBJ or STL from Rhino, or "
            "geometry from honeybee-vtk (honeybee-vtk translate FILE)"
        )
        raise InputError(msg)
    if isinstance(head.get("accessors"), dict):
        raise InputError(OLD)
    if kind == "Topology":
        msg = "is TopoJSON, which is not read; convert it to GeoJSON or CityJSON"
        raise InputError(msg)
    shown = f"its type is {str(kind)[:40]!r}" if kind else "it has no type"
    msg = f"is JSON, but neither CityJSON, GeoJSON nor glTF ({shown}); export it as one of them"
    raise InputError(msg)


def _parse_lines(data: bytes, path: Path, whole: JSONDecodeError) -> list[object]:
    """Parse one JSON document a line, if the first line is one by itself."""
    import orjson  # noqa: PLC0415

    lines = [(number, line) for number, line in enumerate(data.split(b"\n"), 1) if line.strip()]
    documents: list[object] = []
    for number, line in lines:
        try:
            documents.append(orjson.loads(line))
        except JSONDecodeError as error:
            if number == lines[0][0] and path.suffix.lower() != ".jsonl":
                raise _broken(data, whole, whole.lineno) from whole
            raise _broken(line, error, number) from error
    if len(documents) < 2:
        raise _broken(data, whole, whole.lineno) from whole
    return documents


def _broken(text: bytes, error: JSONDecodeError, line: int) -> InputError:
    # orjson counts characters; a byte offset is what an editor or dd can go to.
    offset = len(text.decode("utf-8", "replace")[: error.pos].encode())
    what = "ends too early" if offset >= len(text.rstrip()) else "is broken JSON"
    detail = " ".join(error.msg.split())
    msg = (
        f"{what} at line {line}, column {error.colno}, byte {offset} of "
        f"{len(text)} ({detail}); fetch or export it again"
    )
    return InputError(msg, line=line, byte=offset)
