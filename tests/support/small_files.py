"""A small whole file of each format that tests damage."""

import json
import struct

import numpy as np

from support.gml_files import building, city

TRIANGLES = [t for a, b, c, d in ((0, 1, 2, 3), (0, 1, 5, 4)) for t in ((a, b, c), (a, c, d))]
VERTICES = [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0], [0, 0, 4], [2, 0, 4]]


def cityjson(kind="CityJSON", **more):
    geometry = {
        "type": "Solid",
        "lod": "2",
        "boundaries": [[[[0, 1, 2, 3]], [[0, 1, 5, 4]]]],
        "semantics": {
            "surfaces": [{"type": "RoofSurface"}, {"type": "WallSurface"}],
            "values": [[0, 1]],
        },
    }
    loose = {"type": "MultiSurface", "lod": "2", "boundaries": [[[0, 1, 2, 3], [4, 5, 1]]]}
    instance = {"type": "GeometryInstance", "template": 0, "boundaries": [1]}
    return {
        "type": kind,
        "version": "2.0",
        "transform": {"scale": [0.5, 0.5, 0.5], "translate": [85000, 447000, 0]},
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
        "CityObjects": {
            "a": {"type": "Building", "geometry": [loose, geometry], "children": ["b"]},
            "b": {"type": "BuildingPart", "parents": ["a"], "geometry": [loose]},
            "t": {"type": "SolitaryVegetationObject", "geometry": [instance]},
        },
        "vertices": VERTICES,
        "geometry-templates": {"templates": [loose], "vertices-templates": VERTICES},
    } | more


def sequence():
    head = cityjson(CityObjects={}, vertices=[])
    feature = {k: v for k, v in cityjson("CityJSONFeature").items() if k != "metadata"}
    return "\n".join(json.dumps(d) for d in (head, feature, feature))


def gltf():
    points = np.array(VERTICES, "<f4").tobytes()
    indices = np.array(TRIANGLES, "<u2").tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "scale": [1, 2, 1]}, {"mesh": 0, "rotation": [0, 0, 0, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(indices)},
        ],
        "buffers": [{"byteLength": len(points) + len(indices)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary = points + indices
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def ply(*, binary):
    form = "binary_little_endian" if binary else "ascii"
    head = f"ply\nformat {form} 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    if not binary:
        rows = [" ".join(map(str, v)) for v in VERTICES] + ["4 0 1 2 3", "3 0 1 5"]
        return head + "\n".join(rows) + "\n"
    data = head.encode() + np.array(VERTICES, "<f4").tobytes()
    for face in ([0, 1, 2, 3], [0, 1, 5]):
        data += bytes([len(face)]) + np.array(face, "<i4").tobytes()
    return data


def stl():
    facets = np.zeros(4, [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    facets["c"] = np.array(VERTICES, float)[np.array(TRIANGLES)]
    return b"stl".ljust(80) + np.uint32(4).tobytes() + facets.tobytes()


def geojson():
    square = [[16, 48], [16.001, 48], [16.001, 48.001], [16, 48.001], [16, 48]]
    yard = [[16.0002, 48.0002], [16.0004, 48.0002], [16.0004, 48.0004], [16.0002, 48.0002]]
    polygon = {"type": "Polygon", "coordinates": [square, yard]}
    several = {"type": "MultiPolygon", "coordinates": [[square], [yard]]}
    both = {"type": "GeometryCollection", "geometries": [polygon, several]}
    features = [
        {"type": "Feature", "id": n, "properties": {"height": h, "name": "a"}, "geometry": g}
        for n, (h, g) in enumerate(((5, polygon), ("7.5", several), (3.0, both)))
    ]
    named = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    return {"type": "FeatureCollection", "crs": named, "features": features}


def tiff():
    try:
        from rasterio.io import MemoryFile  # noqa: PLC0415
        from rasterio.transform import from_origin  # noqa: PLC0415
    except ImportError:
        return None
    with MemoryFile() as memory:
        with memory.open(
            driver="GTiff", width=4, height=3, count=1, dtype="float32", crs="EPSG:32633",
            transform=from_origin(600000, 5340000, 1, 1), nodata=-9999,
        ) as file:  # fmt: skip
            file.write(np.arange(12, dtype="float32").reshape(1, 3, 4))
        return memory.read()


OBJ = (
    "mtllib a.mtl\no a\n"
    + "".join(f"v {x} {y} {z}\n" for x, y, z in VERTICES)
    + "usemtl m\nf 1/1 2/2 3/3 4/4\ng b\nf 1 2 6 -2\nf 1 2 \\\n3\nf 1 2 6 5 4\n"
)
OFF = "OFF\n6 2 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in VERTICES) + "4 0 1 2 3\n3 0 1 5\n"
TEXT_STL = """solid a
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid a
"""

FILES = {
    "a.json": json.dumps(cityjson(), indent=1),
    "b.json": json.dumps(cityjson(version="1.0")),
    "a.jsonl": sequence(),
    "a.gml": city(building()),
    "a.glb": gltf(),
    "a.obj": OBJ,
    "f.geojson": json.dumps(geojson()),
    "a.off": OFF,
    "t.ply": ply(binary=False),
    "b.ply": ply(binary=True),
    "b.stl": stl(),
    "t.stl": TEXT_STL,
}
if made := tiff():
    FILES["t.tif"] = made
BYTES = {n: c if isinstance(c, bytes) else c.encode() for n, c in FILES.items()}
