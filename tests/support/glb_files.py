"""Coloured models, read back without umbra."""

import io
import json

import numpy as np
import trimesh
from PIL import Image


def read_glb(path):
    """Return the tree of a GLB, its arrays by accessor, and its texture."""
    data = path.read_bytes()
    size = int.from_bytes(data[12:16], "little")
    tree = json.loads(data[20 : 20 + size])
    binary = data[28 + size :]

    def get(k):
        accessor = tree["accessors"][k]
        view = tree["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        raw = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        return np.frombuffer(raw, kind).reshape(accessor["count"], -1)

    view = tree["bufferViews"][tree["images"][0]["bufferView"]]
    png = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    return tree, get, Image.open(io.BytesIO(png))


def hold(triangles, point):
    """Tell which triangles a point lies on, and its weights there."""
    everywhere = np.broadcast_to(point, (len(triangles), 3))
    weights = trimesh.triangles.points_to_barycentric(triangles, everywhere)
    apart = np.linalg.norm(np.einsum("nk,nkj->nj", weights, triangles) - point, axis=1)
    return (apart < 2e-3) & (weights > -1e-4).all(1), weights
