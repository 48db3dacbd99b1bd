"""Which format a file is in: by its first bytes, its name's ending and, in JSON, its type."""

import gzip
import re
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from json import JSONDecodeError
from pathlib import Path
from typing import Any

from umbra.errors import InputError
from umbra.packages import load_named
from umbra.readers.added import REGISTRY, read_added
from umbra.readers.content import GZIP, ZIP, FileContent
from umbra.readers.model import FileModel, ReadChoices

__all__ = [
    "CITYGML", "STREAMED", "find_format_kind", "has_reader", "list_citygml_members", "load_reader",
    "read_json", "tell_formats",
]  # fmt: skip

FORMATS = (
    "CityJSON (.json, .jsonl), CityGML (.gml, .zip), FlatCityBuf, glTF (.gltf, .glb), 3D Tiles "
    "(tileset.json), IFC, Rhino, COLLADA, HBJSON, OBJ, PLY, STL, OFF, KMZ, footprints (.geojson, "
    ".gpkg, .shp, .parquet), height rasters (.tif), LAZ"
)

Reader = Callable[[Any, Path, ReadChoices], FileModel]

# Readers load on first use: each brings libraries that take time to import.
READERS = {
    "json": "umbra.readers.formats:read_json",
    "b3dm": "umbra.readers.tileset:read_b3dm",
    "citygml": "umbra.readers.citygml:read_citygml",
    "collada": "umbra.readers.collada:read_collada",
    "fcb": "umbra.readers.flatcitybuf:read_flatcitybuf",
    "glb": "umbra.readers.gltf:read_gltf",
    "i3dm": "umbra.readers.tileset:read_i3dm",
    "ifc": "umbra.readers.ifc:read_ifc",
    "kml": "umbra.readers.kml:read_kml",
    "obj": "umbra.readers.obj:read_obj",
    "parquet": "umbra.readers.parquet:read_parquet",
    "points": "umbra.readers.point_cloud:read_cloud_points",
    "rhino": "umbra.readers.rhino:read_rhino",
    "off": "umbra.readers.triangle_soup:read_off",
    "ply": "umbra.readers.triangle_soup:read_ply",
    "stl": "umbra.readers.triangle_soup:read_stl",
    "tiff": "umbra.readers.height_raster:read_raster",
    "vector": "umbra.readers.footprint_files:read_vectors",
}

STREAMED = {"citygml", "fcb", "parquet", "points", "tiff", "vector"}
"""Formats whose readers take a `FileContent`, and read it as a stream or by its name."""

BY_ENDING = {
    ".json": "json",
    ".jsonl": "json",
    ".hbjson": "json",
    ".cityjson": "json",
    ".gml": "citygml",
    ".citygml": "citygml",
    ".geojson": "json",
    ".gltf": "json",
    ".glb": "glb",
    ".obj": "obj",
    ".off": "off",
    ".ply": "ply",
    ".stl": "stl",
    ".ifc": "ifc",
    ".3dm": "rhino",
    ".dae": "collada",
    ".fcb": "fcb",
    ".parquet": "parquet",
    ".geoparquet": "parquet",
    ".kml": "kml",
    ".kmz": "kml",
    ".las": "points",
    ".laz": "points",
    ".tif": "tiff",
    ".tiff": "tiff",
    ".gpkg": "vector",
    ".shp": "vector",
}

CITYGML = (".gml", ".citygml")

BY_CONTENT = {
    b"glTF": "glb",
    b"b3dm": "b3dm",
    b"i3dm": "i3dm",
    b"ply\n": "ply",
    b"ply\r": "ply",
    b"fcb\x01fcb": "fcb",
    b"fcb\x00fcb": "fcb",
    b"3D Geometry File Format": "rhino",
    b"PAR1": "parquet",
    b"LASF": "points",
    b"ISO-10303-21": "ifc",
    b"II*\x00": "tiff",
    b"MM\x00*": "tiff",
    b"II+\x00": "tiff",
    b"MM\x00+": "tiff",
    b"SQLite format 3": "vector",
    b"\x00\x00\x27\x0a": "vector",
}


def tell_formats() -> str:
    """List the formats that are read, those of packages beside umbra by their endings."""
    added = [f".{name}" for name in REGISTRY.names if f".{name}" not in BY_ENDING]
    return FORMATS + (f"; by packages installed beside umbra {', '.join(added)}" if added else "")


def has_reader(ending: str) -> bool:
    """Return whether files of an ending, with its dot, are read."""
    return ending.lower() in BY_ENDING or ending.lower().removeprefix(".") in REGISTRY


def load_reader(kind: str) -> Reader:
    """Import the reader of a kind: (data or content, path, choices) -> FileModel."""
    if kind not in READERS:
        return partial(read_added, kind)
    reader: Reader = load_named(READERS[kind])
    return reader


def find_format_kind(content: FileContent) -> str:
    """Find the kind of a file that is not empty, a key of `READERS` or a reader of a package."""
    ending = content.path.suffix.lower()
    if ending and ending not in BY_ENDING and ending[1:] in REGISTRY and not is_known(content):
        return ending[1:]
    if is_citygml(content):
        return "citygml"
    if is_kml(content):
        return "kml"
    if is_collada(content):
        return "collada"
    data, path = content.head, content.path
    start = data[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
    unread = find_unread(data, path, by_ending=False)
    if unread is not None:
        msg = f"{unread}; umbra reads {tell_formats()}"
        raise InputError(msg)
    kind = BY_ENDING.get(path.suffix.lower())
    by_content = next((kind for magic, kind in BY_CONTENT.items() if start.startswith(magic)), None)
    if by_content is not None:
        kind = by_content
    elif start.startswith(b"{") and kind != "stl":
        kind = "json"
    elif kind is None and start.startswith(b"OFF"):
        kind = "off"
    elif kind is None and _OF_OBJ.search(data):
        kind = "obj"
    if kind is None:
        unread = find_unread(data, path, by_ending=True)
        if unread is not None:
            msg = f"{unread}; umbra reads {tell_formats()}"
            raise InputError(msg)
        ending = f"'{path.suffix}'" if path.suffix else "its ending"
        msg = f"its format is unknown (by its content and {ending}); umbra reads {tell_formats()}"
        raise InputError(msg, ending=path.suffix)
    if by_content is None and kind in {
        "citygml",
        "collada",
        "fcb",
        "ifc",
        "kml",
        "parquet",
        "rhino",
        "tiff",
        "vector",
    }:
        msg = f"is named {path.suffix} but does not begin as such a file does; export it again"
        raise InputError(msg, ending=path.suffix)
    return kind


def is_known(content: FileContent) -> bool:
    """Return whether a file begins as one of umbra's own formats, whatever its name."""
    start = content.head[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
    return any(start.startswith(magic) for magic in BY_CONTENT)


def is_citygml(content: FileContent) -> bool:
    """Return whether a file is CityGML, by its root's namespaces; also compressed."""
    start = content.head
    try:
        if start.startswith(GZIP):
            with content.open() as file, gzip.GzipFile(fileobj=file) as unpacked:
                start = unpacked.read(16_000)
        elif start.startswith(ZIP):
            with content.open() as file, zipfile.ZipFile(file) as archive:
                return bool(list_citygml_members(archive))
    except (EOFError, OSError, zipfile.BadZipFile, zlib.error):
        return False
    start = start.replace(b"\x00", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return start.startswith(b"<") and b"opengis.net/citygml" in start


def is_collada(content: FileContent) -> bool:
    """Return whether a file is COLLADA, by its root; also packed."""
    start = content.head
    if start.startswith(ZIP):
        try:
            with content.open() as file, zipfile.ZipFile(file) as archive:
                return any(name.lower().endswith(".dae") for name in archive.namelist())
        except (OSError, ValueError, zipfile.BadZipFile):
            return False
    start = start.replace(b"\x00", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return start.startswith(b"<") and b"<COLLADA" in start


def is_kml(content: FileContent) -> bool:
    """Return whether a file is KML, by its root; also packed."""
    start = content.head
    if start.startswith(ZIP):
        try:
            with content.open() as file, zipfile.ZipFile(file) as archive:
                names = [name.lower() for name in archive.namelist()]
        except (OSError, ValueError, zipfile.BadZipFile):
            return False
        return any(name.endswith(".kml") for name in names)
    start = start.replace(b"\x00", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return start.startswith(b"<") and b"<kml" in start


def list_citygml_members(archive: zipfile.ZipFile) -> list[str]:
    """Return the names of the CityGML files in an archive, without those that a Mac adds."""
    return [
        name
        for name in archive.namelist()
        if name.lower().endswith(CITYGML) and not Path(name).name.startswith(".")
    ]


OLD = "is glTF 1.0; umbra reads 2.0, convert it (npx gltf-pipeline -i FILE -o OUT.glb)"

BOM = b"\xef\xbb\xbf"

GEOJSON = {"FeatureCollection", "Feature", "GeometryCollection", "MultiPolygon", "Polygon"}


def read_json(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read a JSON file of any supported kind; errors locate damage."""
    documents = parse_documents(data, path)
    head = documents[0]
    if not isinstance(head, dict):
        msg = (
            f"is JSON, but holds a {type(head).__name__}, not a model; "
            "give CityJSON, GeoJSON or glTF"
        )
        raise InputError(msg)
    if "asset" in head and "root" in head:
        from umbra.readers.tileset import read_tileset  # noqa: PLC0415

        return read_tileset(head, path, choices)
    if "asset" in head:
        from umbra.readers.gltf import read_gltf_tree  # noqa: PLC0415 - only if it is one

        return read_gltf_tree(head, None, path, choices)
    kind = head.get("type")
    if kind in {"CityJSON", "CityJSONFeature"}:
        from umbra.readers.cityjson import read_cityjson  # noqa: PLC0415

        return read_cityjson(documents, choices)
    if kind in GEOJSON:
        from umbra.readers.footprint_files import read_geojson  # noqa: PLC0415

        return read_geojson(documents, choices)
    if kind == "Model" and "properties" in head:
        from umbra.readers.honeybee import read_honeybee  # noqa: PLC0415

        return read_honeybee(head, choices)
    if isinstance(head.get("accessors"), dict):
        raise InputError(OLD)
    if kind == "Topology":
        msg = "is TopoJSON, which is not read; convert it to GeoJSON or CityJSON"
        raise InputError(msg)
    shown = f"its type is {str(kind)[:40]!r}" if kind else "it has no type"
    msg = f"is JSON, but neither CityJSON, GeoJSON nor glTF ({shown}); export it as one of them"
    raise InputError(msg, kind=kind)


def parse_documents(data: bytes, path: Path) -> list[Any]:
    """Parse a JSON document, or one a line."""
    import orjson  # noqa: PLC0415 - only if it is JSON

    data = data.removeprefix(BOM)
    try:
        return [orjson.loads(data)]
    except JSONDecodeError as error:
        return _parse_lines(data, path, error)


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


@dataclass(frozen=True)
class UnreadFormat:
    """An unsupported format."""

    text: str  # name and remedy, as the end of a sentence that begins with the file
    endings: tuple[str, ...] = ()
    starts: tuple[bytes, ...] = ()  # first bytes, after white space
    holds: bytes = b""  # A word among the first bytes, besides them


_OF_OBJ = re.compile(rb"^v[ \t]+[-+.\d]+[-+.\deE]*[ \t]+[-+.\d]", re.MULTILINE)  # from a pipe
_BLENDER = "open it in Blender and export glTF"
_OGR = "ogr2ogr FILE.geojson FILE{} makes footprints of it"
_ANY_XML = UnreadFormat("XML is not read; convert it to CityJSON, glTF or OBJ", (), (b"<?xml",))

# More specific formats come first: XML by its words, archives by their endings.
REFUSED = (
    _ANY_XML,
    UnreadFormat("SketchUp files are not read; export glTF or COLLADA from it (File > Export)",
                 (".skp",), (b"\xff\xfe\xff\x0eS\x00k\x00e\x00t\x00c\x00h",)),
    UnreadFormat("DWG is not read; export IFC or OBJ from the CAD program, or convert it to DXF "
                 f"(ODA File Converter): {_OGR.format('.dxf')}", (".dwg",), (b"AC10",)),
    UnreadFormat("DXF is not read; open it in FreeCAD or Blender and export OBJ, or "
                 f"{_OGR.format('.dxf')}",
                 (".dxf",), (b"0\nSECTION", b"0\r\nSECTION", b"AutoCAD Binary DXF")),
    UnreadFormat("E57 point clouds are not read; convert it to LAZ (pdal translate FILE FILE.laz)",
                 (".e57",), (b"ASTM-E57",)),
    UnreadFormat(f"FBX is not read; {_BLENDER} (or assimp export FILE.fbx FILE.glb)",
                 (".fbx",), (b"Kaydara FBX", b"; FBX")),
    UnreadFormat("3MF is not read; export STL or OBJ from the slicer, or convert it "
                 "(assimp export FILE.3mf FILE.obj)", (".3mf",)),
    UnreadFormat(f"Blender files are not read; {_BLENDER}", (".blend",), (b"BLENDER",)),
    UnreadFormat(f"USD is not read; {_BLENDER}",
                 (".usd", ".usda", ".usdc", ".usdz"), (b"PXR-USDC", b"#usda")),
    UnreadFormat("an ESRI ASCII grid is not read; convert it to GeoTIFF (gdal_translate FILE.asc "
                 "FILE.tif)", (".asc",), (b"ncols", b"NCOLS")),
    UnreadFormat("of 3D Tiles only sets (tileset.json), B3DM, I3DM and GLB are read",
                 (".cmpt", ".pnts"), (b"cmpt", b"pnts")),
    UnreadFormat("Revit files are not read; export IFC from Revit",
                 (".rvt", ".rfa"), (b"\xd0\xcf\x11\xe0",)),
    UnreadFormat("is compressed (gzip) and holds no CityGML; unpack it first", (), (b"\x1f\x8b",)),
    UnreadFormat("is a ZIP archive without CityGML (*.gml), COLLADA or KML; unpack it first",
                 (), (b"PK\x03\x04",)),
    UnreadFormat("HDF5 files are not read", (), (b"\x89HDF",)),
    UnreadFormat("is a Git LFS pointer, not the file; run git lfs pull",
                 (), (b"version https://git-lfs",)),
)  # fmt: skip


def find_unread(data: bytes, path: Path, *, by_ending: bool) -> str | None:
    """Name an unsupported format and its converter; None for any other."""
    head = data[:4000].lstrip(b"\xef\xbb\xbf \t\r\n")
    ending = path.suffix.lower()
    for entry in REFUSED:
        begins = head.startswith(entry.starts) if entry.starts else False
        if begins and entry.holds in head:
            # XML and archives may be anything; an ending says what.
            named = next((o for o in REFUSED if ending in o.endings), entry)
            return (
                named.text
                if entry is _ANY_XML or head.startswith((b"PK", b"\x1f\x8b"))
                else entry.text
            )
        if by_ending and ending in entry.endings:
            return entry.text
    return None
