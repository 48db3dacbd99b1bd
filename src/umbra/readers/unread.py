"""Formats that are not read: known by their first bytes or ending, with what converts them."""

from dataclasses import dataclass
from pathlib import Path

__all__ = ["find_unread"]


@dataclass(frozen=True)
class UnreadFormat:
    """A format that is not read."""

    text: str  # what it is and what to do, as the end of a sentence that begins with the file
    endings: tuple[str, ...] = ()
    starts: tuple[bytes, ...] = ()  # first bytes, after white space
    holds: bytes = b""  # A word among the first bytes, besides them


_BLENDER = "open it in Blender and export glTF"
_OGR = "ogr2ogr FILE.geojson FILE{} makes footprints of it"
_XML = (b"<?xml", b"<")

_ANY_XML = UnreadFormat("XML is not read; convert it to CityJSON, glTF or OBJ", (), (b"<?xml",))

# Before others stands who says more: XML by its words, archives by their endings.
_FORMATS = (
    UnreadFormat(
        "CityGML is not read; convert it to CityJSON (citygml-tools to-cityjson FILE)",
        (".gml", ".citygml"),
        _XML,
        b"opengis.net/citygml",
    ),
    UnreadFormat(
        "COLLADA is not read; convert it to glTF (assimp export FILE.dae FILE.glb)",
        (".dae",),
        _XML,
        b"<COLLADA",
    ),
    UnreadFormat(
        f"KML is not read; {_OGR.format('.kml')}",
        (".kml", ".kmz"),
        _XML,
        b"<kml",
    ),
    _ANY_XML,
    UnreadFormat(
        "Rhino files are not read; export OBJ or glTF from Rhino",
        (".3dm",),
        (b"3D Geometry File Format",),
    ),
    UnreadFormat(
        "SketchUp files are not read; export glTF, OBJ or IFC from SketchUp",
        (".skp",),
        (b"\xff\xfe\xff\x0eS\x00k\x00e\x00t\x00c\x00h",),
    ),
    UnreadFormat(
        "DWG is not read; export IFC or OBJ from the CAD program, or convert it to DXF (ODA File "
        f"Converter): {_OGR.format('.dxf')}",
        (".dwg",),
        (b"AC10",),
    ),
    UnreadFormat(
        f"DXF is not read; open it in FreeCAD or Blender and export OBJ, or {_OGR.format('.dxf')}",
        (".dxf",),
        (b"0\nSECTION", b"0\r\nSECTION", b"AutoCAD Binary DXF"),
    ),
    UnreadFormat(
        "point clouds are not read; make a height raster of it (pdal translate FILE FILE.tif)",
        (".las", ".laz", ".e57", ".copc"),
        (b"LASF", b"ASTM-E57"),
    ),
    UnreadFormat(
        f"FBX is not read; {_BLENDER} (or assimp export FILE.fbx FILE.glb)",
        (".fbx",),
        (b"Kaydara FBX", b"; FBX"),
    ),
    UnreadFormat(
        "3MF is not read; export STL or OBJ from the slicer, or convert it "
        "(assimp export FILE.3mf FILE.obj)",
        (".3mf",),
    ),
    UnreadFormat(f"Blender files are not read; {_BLENDER}", (".blend",), (b"BLENDER",)),
    UnreadFormat(
        f"USD is not read; {_BLENDER}", (".usd", ".usda", ".usdc", ".usdz"), (b"PXR-USDC", b"#usda")
    ),
    UnreadFormat(
        "an ESRI ASCII grid is not read; convert it to GeoTIFF (gdal_translate FILE.asc FILE.tif)",
        (".asc",),
        (b"ncols", b"NCOLS"),
    ),
    UnreadFormat(
        "B3DM is not read; take the GLB out of it (npx 3d-tiles-tools b3dmToGlb -i FILE -o OUT)",
        (".b3dm",),
        (b"b3dm",),
    ),
    UnreadFormat(
        "3D Tiles are not read but for the GLB in them (npx 3d-tiles-tools convert)",
        (".i3dm", ".cmpt", ".pnts"),
        (b"i3dm", b"cmpt", b"pnts"),
    ),
    UnreadFormat(
        "Revit files are not read; export IFC from Revit", (".rvt", ".rfa"), (b"\xd0\xcf\x11\xe0",)
    ),
    UnreadFormat("is compressed (gzip); unpack it first", (), (b"\x1f\x8b",)),
    UnreadFormat("is a ZIP archive; unpack it first", (), (b"PK\x03\x04",)),
    UnreadFormat("HDF5 files are not read", (), (b"\x89HDF",)),
    UnreadFormat(
        "is a Git LFS pointer, not the file; run git lfs pull", (), (b"version https://git-lfs",)
    ),
)


def find_unread(data: bytes, path: Path, *, by_ending: bool) -> str | None:
    """Tell what a format that is not read is, and what converts it; None for any other."""
    head = data[:4000].lstrip(b"\xef\xbb\xbf \t\r\n")
    ending = path.suffix.lower()
    for one in _FORMATS:
        begins = head.startswith(one.starts) if one.starts else False
        if begins and one.holds in head:
            # XML and archives may be anything; an ending says what.
            named = next((o for o in _FORMATS if ending in o.endings), one)
            return (
                named.text if one is _ANY_XML or head.startswith((b"PK", b"\x1f\x8b")) else one.text
            )
        if by_ending and ending in one.endings:
            return one.text
    return None
