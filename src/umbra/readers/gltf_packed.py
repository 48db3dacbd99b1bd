"""glTF in packed forms, unpacked: Draco, meshopt, and instances listed in arrays."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.extras import need

if TYPE_CHECKING:
    from umbra.readers.gltf_buffers import Buffers

__all__ = ["DRACO", "MESHOPT", "list_instances", "unpack_draco", "unpack_meshopt"]

DRACO = "KHR_draco_mesh_compression"
INSTANCES = "EXT_mesh_gpu_instancing"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
EXTRA = "gltf"
NODE = 1200  # [byte] that a node takes until it is a part
INSTANCE_KEYS = {
    "TRANSLATION": ("translation", 3),
    "ROTATION": ("rotation", 4),
    "SCALE": ("scale", 3),
}


def unpack_meshopt(packed: dict[str, Any], data: bytes, where: str) -> bytes:
    """
    Unpack a buffer view of EXT_meshopt_compression.

    Parameters
    ----------
    packed : dict
        The extension's object.
    data : bytes
        Its part of the buffer.
    where : str
        For errors.

    Raises
    ------
    InputError
        If it is damaged, or the package meshopt is not installed.
    """
    meshopt = need("meshopt", EXTRA, f"glTF with {MESHOPT[0]}")
    try:
        rows = meshopt.decode_gltf_buffer(
            data,
            packed["count"],
            packed["byteStride"],
            packed["mode"],
            packed.get("filter", "NONE"),
        )
    except (RuntimeError, ValueError) as error:
        msg = f"{where}: its meshopt data is damaged ({str(error)[:80]}); export it again"
        raise InputError(msg) from error
    return np.ascontiguousarray(rows).tobytes()


def unpack_draco(
    primitive: dict[str, Any], buffers: "Buffers", where: str
) -> tuple[NDArray[np.int64], dict[str, NDArray[Any]]] | None:
    """
    Unpack a primitive of KHR_draco_mesh_compression.

    Parameters
    ----------
    primitive : dict
    buffers : Buffers
    where : str
        For errors.

    Returns
    -------
    unpacked : tuple or None
        Corners of triangles, (3 n,) int64, and arrays (count, width) by glTF's names; None if
        the primitive is not packed so, or has its arrays plain, too.

    Raises
    ------
    InputError
        If it is damaged, or the package DracoPy is not installed.
    """
    packed = primitive.get("extensions", {}).get(DRACO)
    if packed is None or buffers.has_bytes(primitive["attributes"].get("POSITION")):
        return None
    draco = need("DracoPy", EXTRA, f"glTF with {DRACO}")
    data = buffers.read_bytes(packed["bufferView"], where)
    try:
        mesh = draco.decode(data)
    except (
        draco.FileTypeException,
        AssertionError,
        MemoryError,
        RuntimeError,
        ValueError,
    ) as error:
        msg = f"{where}: its Draco data is damaged ({str(error)[:80]}); export it again"
        raise InputError(msg) from error
    found = {}
    for name, number in packed["attributes"].items():
        one = mesh.get_attribute_by_unique_id(number)
        if one is None:
            msg = f"{where}: its Draco data has no attribute {number} ({name}); export it again"
            raise InputError(msg)
        values = np.asarray(one["data"])
        buffers.budget.spend(values.nbytes, where)
        found[name] = values.reshape(len(values), -1)
    faces = getattr(mesh, "faces", None)
    if faces is None:
        msg = f"{where}: its Draco data is a cloud of points; export it as a mesh"
        raise InputError(msg)
    return np.asarray(faces, np.int64).ravel(), found


def list_instances(tree: dict[str, Any], buffers: "Buffers") -> None:
    """
    Write the instances of EXT_mesh_gpu_instancing as nodes below those that list them.

    Raises
    ------
    InputError
        If their arrays are damaged.
    """
    nodes = tree.get("nodes", [])
    for index, node in enumerate(list(nodes)):
        given = node.get("extensions", {}).get(INSTANCES)
        if given is None or "mesh" not in node:
            continue
        where = f"node {index}, instances"
        columns = {}
        for name, (key, width) in INSTANCE_KEYS.items():
            if name in given["attributes"]:
                values = buffers.read_accessor(given["attributes"][name], where)
                if values.shape[1] != width:
                    msg = (
                        f"{where}: {name} has {values.shape[1]} numbers, not {width}; "
                        "export it again"
                    )
                    raise InputError(msg)
                columns[key] = values.astype(np.float64)
        counts = {len(values) for values in columns.values()}
        if len(counts) > 1:
            msg = f"{where}: their arrays have {sorted(counts)} rows; export it again"
            raise InputError(msg)
        count = counts.pop() if counts else 0
        buffers.budget.spend(NODE * count, where)
        name = node.get("name") or tree["meshes"][node["mesh"]].get("name") or f"node {index}"
        shared = {key: node[key] for key in ("mesh", "skin", "weights") if key in node}
        rows = {key: values.tolist() for key, values in columns.items()}
        first = len(nodes)
        nodes.extend(
            {
                "name": f"{name} {number + 1}",
                **shared,
                **{key: row[number] for key, row in rows.items()},
            }
            for number in range(count)
        )
        node["children"] = [*node.get("children", ()), *range(first, len(nodes))]
        for key in shared:
            del node[key]
