"""Model files of several formats, made from named meshes (vertices, faces)."""

import json
import struct
from pathlib import Path

import numpy as np

DATA = Path(__file__).parents[2] / "../shared/data"
"""Real models, outside the repository; tests that need them skip without them."""
FILES = [
    "vienna_lod2.city.jsonl",
    "zurich_lod2.city.json",
    "delft.city.json",
    "denhaag.city.json",
    "engel_house.obj",
    "urban_block.obj",
]
"""Some of them, as meshes of every kind: solids, sheets, triangle soups."""
RULES = """
format: 1
name: r
version: "1"
source: here
checks:
  - name: sun
    dates: 09-18
    from: 10:00
    to: 14:00
    every: 1h
    at_least: 1h
    measure: {measure}
    where: [{{name: {place}, x: {x}, y: {y}}}]
"""
"""A rule of one place, to be filled in."""
KINDS = ("WallSurface", "RoofSurface")


def save_obj(path, meshes):
    """Write a group for each mesh."""
    lines, before = [], 1
    for name, (vertices, faces) in meshes.items():
        lines.append(f"g {name}")
        lines += ["v " + " ".join(map(repr, map(float, vertex))) for vertex in vertices]
        lines += ["f " + " ".join(str(before + corner) for corner in face) for face in faces]
        before += len(vertices)
    path.write_text("\n".join(lines) + "\n")
    return path


def save_glb(path, meshes):
    """Write a node for each mesh; glTF's y is up, so z up becomes y up."""
    data, views, accessors, nodes, gltf_meshes = b"", [], [], [], []
    for name, (vertices, faces) in meshes.items():
        turned = np.asarray(vertices, "<f4")[:, [0, 2, 1]] * np.array([1, 1, -1], "<f4")
        for array, kind, code in (
            (turned, "VEC3", 5126),
            (np.asarray(faces, "<u4").ravel(), "SCALAR", 5125),
        ):
            raw = array.tobytes()
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(raw)})
            accessors.append(
                {
                    "bufferView": len(views) - 1,
                    "componentType": code,
                    "count": len(array),
                    "type": kind,
                }
            )
            data += raw
        primitive = {"attributes": {"POSITION": len(accessors) - 2}, "indices": len(accessors) - 1}
        gltf_meshes.append({"primitives": [primitive]})
        nodes.append({"name": name, "mesh": len(nodes)})
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": gltf_meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def _geometry(vertices, faces, first):
    """Make a solid whose level triangles are roofs and whose others are walls."""
    kinds = [int(np.ptp(vertices[face, 2]) == 0) for face in faces]
    rings = [[[first + int(corner) for corner in face]] for face in faces]
    return {
        "type": "Solid",
        "lod": "2.2",
        "boundaries": [rings],
        "semantics": {"surfaces": [{"type": kind} for kind in KINDS], "values": [kinds]},
    }


def _header(crs, scale, shift):
    header = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [scale] * 3, "translate": shift},
        "CityObjects": {},
        "vertices": [],
    }
    if crs:
        system = crs if isinstance(crs, str) else f"https://www.opengis.net/def/crs/EPSG/0/{crs}"
        header["metadata"] = {"referenceSystem": system}
    return header


def _pack(vertices, scale, shift):
    return np.rint((vertices - np.asarray(shift)) / scale).astype(int).tolist()


def _corner(meshes):
    return np.floor(min(np.min(v, 0).tolist() for v, _ in meshes.values())).tolist()


def save_city(path, meshes, crs=None, scale=0.001):
    """Write a CityJSON file with a building for each mesh."""
    shift = _corner(meshes)
    document = _header(crs, scale, shift)
    for name, (vertices, faces) in meshes.items():
        geometry = _geometry(vertices, faces, len(document["vertices"]))
        document["CityObjects"][name] = {"type": "Building", "geometry": [geometry]}
        document["vertices"] += _pack(vertices, scale, shift)
    path.write_text(json.dumps(document))
    return path


def save_city_sequence(path, meshes, crs=None, scale=0.001):
    """Write a CityJSONSeq file with a line for each mesh."""
    shift = _corner(meshes)
    lines = [_header(crs, scale, shift)]
    for name, (vertices, faces) in meshes.items():
        thing = {"type": "Building", "geometry": [_geometry(vertices, faces, 0)]}
        lines.append(
            {
                "type": "CityJSONFeature",
                "id": name,
                "CityObjects": {name: thing},
                "vertices": _pack(vertices, scale, shift),
            }
        )
    path.write_text("\n".join(map(json.dumps, lines)) + "\n")
    return path
