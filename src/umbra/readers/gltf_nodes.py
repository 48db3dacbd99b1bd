"""glTF's nodes: transforms, animations, skins and lights."""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.gltf_buffers import Buffers, find_item
from umbra.scene import Light
from umbra.scene.making import place_light
from umbra.scene.rig import Animation, Rig, RigBinding, Skin, Track

__all__ = ["list_instances", "read_animations", "read_lights", "read_nodes", "read_skin"]

WAYS = {"STEP": "step", "LINEAR": "linear", "CUBICSPLINE": "cubic"}
WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}


def read_nodes(tree: dict[str, Any], base: NDArray[np.float64]) -> tuple[Rig, dict[int, int], int]:
    """
    Read the scene's nodes, then others that joints may need.

    Returns a rig without animations, each file node's index in it, and the number of nodes in
    the scene. ``base`` maps glTF's axes to the scene's.
    """
    nodes = tree.get("nodes", [])
    children = {child for node in nodes for child in node.get("children", ())}
    orphans = [index for index in range(len(nodes)) if index not in children]
    if tree.get("scenes"):
        roots = find_item(tree, "scenes", tree.get("scene", 0)).get("nodes", [])
    else:
        roots = orphans
    slots: dict[int, int] = {}
    parents: list[int] = []
    _walk(tree, roots, slots, parents)
    shown = len(slots)
    if tree.get("skins"):
        _walk(tree, [index for index in orphans if index not in slots], slots, parents)
    used = [nodes[index] for index in slots]

    def gather(key: str, default: tuple[float, ...]) -> NDArray[np.float64]:
        rows = [node.get(key, default) for node in used]
        return np.array(rows, np.float64).reshape(len(used), len(default))

    rig = Rig(
        np.array(parents, np.int64),
        gather("translation", (0, 0, 0)),
        gather("rotation", (0, 0, 0, 1)),
        gather("scale", (1, 1, 1)),
        {
            # Column by column in the file.
            slot: np.array(node["matrix"], np.float64).reshape(4, 4).T
            for slot, node in enumerate(used)
            if "matrix" in node
        },
        base,
    )
    return rig, slots, shown


def _walk(
    tree: dict[str, Any], roots: list[int], slots: dict[int, int], parents: list[int]
) -> None:
    """Add nodes below roots, parents first."""
    stack = [(root, -1) for root in reversed(roots)]
    while stack:
        index, parent = stack.pop()
        node = find_item(tree, "nodes", index)
        if index in slots:
            msg = f"node {index} stands in two places of the tree; export it again"
            raise InputError(msg, node=index)
        slot = slots[index] = len(slots)
        parents.append(parent)
        stack += [(child, slot) for child in reversed(node.get("children", ()))]


def read_skin(tree: dict[str, Any], index: int, slots: dict[int, int], buffers: Buffers) -> Skin:
    """Read a skin."""
    where = f"skin {index}"
    given = find_item(tree, "skins", index)
    joints = given["joints"]
    for joint in joints:
        find_item(tree, "nodes", joint, where)
    matrices = np.broadcast_to(np.eye(4), (len(joints), 4, 4))
    if "inverseBindMatrices" in given:
        rows = buffers.read_accessor(given["inverseBindMatrices"], where).astype(np.float64)
        if rows.shape[1] != 16 or len(rows) < len(joints):
            msg = (
                f"{where} has {len(joints)} joints, but {len(rows)} inverse bind matrices "
                f"of {rows.shape[1]} numbers; export it again"
            )
            raise InputError(msg, where=where, count=len(rows), needed=len(joints))
        matrices = rows[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)
    return Skin(np.array([slots[joint] for joint in joints], np.int64), np.array(matrices))


def read_animations(
    tree: dict[str, Any],
    rig: Rig,
    slots: dict[int, int],
    targets: dict[int, int],
    buffers: Buffers,
    counts: Counter[str],
) -> Rig:
    """Return the rig with its animations; ``targets`` are the morph targets of its nodes."""
    animations = []
    for number, given in enumerate(tree.get("animations", ())):
        tracks = []
        for index, channel in enumerate(given["channels"]):
            where = f"animation {number}, channel {index}"
            target = channel.get("target", {})
            what, node = target.get("path"), target.get("node")
            slot = slots.get(node) if type(node) is int else None
            width = targets.get(slot, 0) if what == "weights" and slot is not None else None
            width = WIDTHS.get(what) if width is None else width
            if slot is None or not width:
                counts["animated properties that are not read"] += 1
                continue
            sampler = find_item(given, "samplers", channel["sampler"], where)
            tracks.append(_read_track(sampler, slot, what, width, buffers, where))
        if tracks:
            animations.append(
                Animation(str(given.get("name") or f"animation {number}"), tuple(tracks))
            )
    return replace(rig, animations=tuple(animations))


def _read_track(
    sampler: dict[str, Any], node: int, what: str, width: int, buffers: Buffers, where: str
) -> Track:
    times = buffers.read_accessor(sampler["input"], where).astype(np.float64).ravel()
    values = buffers.read_accessor(sampler["output"], where).astype(np.float64)
    way = WAYS.get(sampler.get("interpolation", "LINEAR"), "linear")
    knots = 3 if way == "cubic" else 1
    if not len(times) or values.size != len(times) * knots * width:
        msg = (
            f"{where}: {values.size} numbers do not fit {len(times)} times of {knots * width}; "
            "export it again"
        )
        raise InputError(msg, where=where, count=values.size, times=len(times))
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        msg = f"{where} has times or values that are not finite; export it again"
        raise InputError(msg, where=where)
    if (np.diff(times) < 0).any():
        first = int(np.flatnonzero(np.diff(times) < 0)[0])
        msg = f"{where}: its times do not ascend (first: after time {first}); export it again"
        raise InputError(msg, where=where, time=first)
    shape = (len(times), 3, width) if way == "cubic" else (len(times), width)
    return Track(node, what, times, values.reshape(shape), way)


INSTANCES = "EXT_mesh_gpu_instancing"
NODE = 1200  # [byte] of a node until it is a part
INSTANCE_KEYS = {
    "TRANSLATION": ("translation", 3),
    "ROTATION": ("rotation", 4),
    "SCALE": ("scale", 3),
}
EXTENSION = "KHR_lights_punctual"


def read_lights(
    tree: dict[str, Any], node: dict[str, Any], rig: Rig, slot: int, places: NDArray[np.float64]
) -> list[Light]:
    """Read the light at a node, if any; points and spots weaken with the square of the distance."""
    link = node.get("extensions", {}).get(EXTENSION)
    if link is None:
        return []
    number = link["light"]
    given = find_item(tree.get("extensions", {}).get(EXTENSION, {}), "lights", number, EXTENSION)
    strength = max(float(given.get("intensity", 1.0)), 0.0)
    red, green, blue = (strength * max(float(v), 0.0) for v in given.get("color", (1, 1, 1)))
    color, kind = (red, green, blue), given.get("type")
    reach = float(given.get("range", np.inf))
    square = (0.0, 0.0, 1.0)
    if kind == "directional":
        light = Light(np.array([0, 0, 1.0, 0]), color)
    elif kind == "point":
        light = Light(np.array([0, 0, 0, 1.0]), color, range=reach, attenuation=square)
    elif kind == "spot":
        cone = given.get("spot", {})
        outer = min(np.degrees(float(cone.get("outerConeAngle", np.pi / 4))), 90.0)
        inner = min(np.degrees(float(cone.get("innerConeAngle", 0.0))), outer)
        light = Light(
            np.array([0, 0, 0, 1.0]),
            color,
            np.array([0, 0, -1.0]),
            float(outer),
            float(inner),
            reach,
            square,
        )
    else:
        msg = f"{EXTENSION}: light {number} is of the kind {kind!r}; export it again"
        raise InputError(msg, light=number, kind=kind)
    binding = RigBinding(rig, slot)
    placed = place_light(light, binding, places)
    return [replace(placed, binding=binding) if rig.animations else placed]


def list_instances(tree: dict[str, Any], buffers: Buffers) -> None:
    """Write the instances of EXT_mesh_gpu_instancing as nodes below those that list them."""
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
                    raise InputError(msg, where=where, attribute=name, count=values.shape[1])
                columns[key] = values.astype(np.float64)
        counts = {len(values) for values in columns.values()}
        if len(counts) > 1:
            msg = f"{where}: their arrays have {sorted(counts)} rows; export it again"
            raise InputError(msg, where=where, counts=sorted(counts))
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
