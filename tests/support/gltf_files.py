"""glTF documents made by hand, array by array."""

import json
import struct

import numpy as np

KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
TYPES = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125, "i2": 5122, "i1": 5120}


class Document:
    """A glTF document whose arrays go into one buffer."""

    def __init__(self):
        self.bytes = b""
        self.tree = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "materials": [
                {"name": "brick", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.1, 1]}},
                {},
            ],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, data, **more):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.tree["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)} | more
        )
        self.bytes += data
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, array, **more):
        array = np.asarray(array)
        kind = KINDS[array.shape[1:]]
        code = array.dtype.str[1:]
        self.tree["accessors"].append(
            {
                "bufferView": self.view(array.astype("<" + code).tobytes()),
                "componentType": TYPES[code],
                "count": len(array),
                "type": kind,
            }
            | more
        )
        return len(self.tree["accessors"]) - 1

    def mesh(self, *primitives, **more):
        self.tree["meshes"].append({"primitives": list(primitives)} | more)
        return len(self.tree["meshes"]) - 1

    def node(self, *, root=True, **members):
        self.tree["nodes"].append(members)
        index = len(self.tree["nodes"]) - 1
        if root:
            self.tree["scenes"][0]["nodes"].append(index)
        return index

    def glb(self):
        self.tree["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.tree).encode()
        text += b" " * (-len(text) % 4)
        binary = self.bytes + b"\0" * (-len(self.bytes) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def gltf(self, uri):
        self.tree["buffers"] = [{"byteLength": len(self.bytes), "uri": uri}]
        return json.dumps(self.tree)
