"""A pyramid in glTF: plain, and packed by meshopt or Draco."""

import numpy as np
import pytest

from support.gltf_files import Document

POINTS = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 1], [1, 1, 4]], "f4")
CORNERS = np.array([0, 1, 2, 0, 2, 3, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4], "u4")
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]], "f4")
COLORS = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]] + [[51] * 4] * 2, "u1")


def plain(**more):
    """A document with a pyramid, and its primitive."""
    document = Document()
    primitive = {
        "attributes": {
            "POSITION": document.accessor(POINTS),
            "TEXCOORD_0": document.accessor(UV),
            "COLOR_0": document.accessor(COLORS, normalized=True),
        },
        "indices": document.accessor(CORNERS),
    }
    document.node(mesh=document.mesh(primitive, name="pyramid"), **more)
    return document


def meshopt_packed(document, modes, **more):
    """Pack views, in the modes given by their number, as EXT_meshopt_compression does."""
    meshopt = pytest.importorskip("meshopt")
    packed = Document()
    packed.tree = document.tree
    packed.tree["extensionsUsed"] = packed.tree["extensionsRequired"] = ["EXT_meshopt_compression"]
    for number, view in enumerate(document.tree["bufferViews"]):
        start, size = view["byteOffset"], view["byteLength"]
        stride, mode = modes.get(number, (4, "ATTRIBUTES"))
        data = np.frombuffer(document.bytes[start : start + size], "u1").reshape(-1, stride)
        if mode != "ATTRIBUTES":
            data = data.view("u4").ravel()
        encoded = more.get(f"view{number}") or meshopt.encode_gltf_buffer(data, mode)
        packed.bytes += b"\0" * (-len(packed.bytes) % 4)
        view["extensions"] = {
            "EXT_meshopt_compression": {
                "buffer": 0,
                "byteOffset": len(packed.bytes),
                "byteLength": len(encoded),
                "byteStride": stride,
                "mode": mode,
                "count": len(data),
            }
            | more.get(f"more{number}", {})
        }
        view["buffer"] = 7  # a fallback that is not there
        packed.bytes += encoded
    return packed


def draco_packed(**more):
    """The pyramid with its arrays in Draco alone, vertex by vertex as they were."""
    draco = pytest.importorskip("DracoPy")
    data = draco.encode(
        POINTS,
        CORNERS.reshape(-1, 3),
        quantization_bits=20,
        preserve_order=True,
        generic_attributes={3: UV, 5: COLORS},
    )
    numbers = {one["data"].shape[1]: one["unique_id"] for one in draco.decode(data).attributes}
    document = Document()
    for kind, code, count in (("VEC3", 5126, 5), ("VEC2", 5126, 5), ("VEC4", 5121, 5)):
        document.tree["accessors"].append({"componentType": code, "count": count, "type": kind})
    document.tree["accessors"][2]["normalized"] = True
    document.tree["accessors"].append({"componentType": 5125, "count": 18, "type": "SCALAR"})
    packed = {
        "bufferView": document.view(more.get("data", data)),
        "attributes": {"POSITION": numbers[3], "TEXCOORD_0": 3, "COLOR_0": 5}
        | more.get("names", {}),
    }
    primitive = {
        "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2},
        "indices": 3,
        "extensions": {"KHR_draco_mesh_compression": packed},
    }
    document.node(mesh=document.mesh(primitive, name="pyramid"))
    document.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return document
