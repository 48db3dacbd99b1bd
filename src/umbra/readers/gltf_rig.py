"""glTF's nodes, skins and animations: where things stand, and how they move."""

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.gltf_buffers import Buffers, find_item
from umbra.scene.rig import Animation, Rig, Track
from umbra.scene.shape import Skin

__all__ = ["read_animations", "read_nodes", "read_skin"]

WAYS = {"STEP": "step", "LINEAR": "linear", "CUBICSPLINE": "cubic"}
WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}


def read_nodes(tree: dict[str, Any], base: NDArray[np.float64]) -> tuple[Rig, dict[int, int], int]:
    """
    Read the nodes: those of the scene, then any others that joints may need.

    Parameters
    ----------
    tree : dict
        The glTF JSON.
    base : (4, 4) float64
        From glTF's axes to the scene's.

    Returns
    -------
    rig : Rig
        Without animations.
    slots : dict of int to int
        The place in the rig of each node of the file.
    shown : int
        Number of nodes of the scene; they come first in the rig.

    Raises
    ------
    InputError
        If a node is not there, or in two places of the tree.
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
    """
    Read a skin.

    Raises
    ------
    InputError
        If a joint is not there, or the inverse bind matrices do not fit.
    """
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
            raise InputError(msg)
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
    """
    Read the animations and give the rig with them.

    Parameters
    ----------
    tree : dict
        The glTF JSON.
    rig : Rig
    slots : dict of int to int
        The place in the rig of each node of the file.
    targets : dict of int to int
        Number of morph targets of the mesh at a place in the rig.
    buffers : Buffers
    counts : Counter
        Of what is left out, by what to call it; added to.

    Raises
    ------
    InputError
        If a channel is damaged (which).
    """
    found = []
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
            found.append(Animation(str(given.get("name") or f"animation {number}"), tuple(tracks)))
    return replace(rig, animations=tuple(found))


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
        raise InputError(msg)
    if not (np.isfinite(times).all() and np.isfinite(values).all()):
        msg = f"{where} has times or values that are not finite; export it again"
        raise InputError(msg)
    if (np.diff(times) < 0).any():
        first = int(np.flatnonzero(np.diff(times) < 0)[0])
        msg = f"{where}: its times do not ascend (first: after time {first}); export it again"
        raise InputError(msg)
    shape = (len(times), 3, width) if way == "cubic" else (len(times), width)
    return Track(node, what, times, values.reshape(shape), way)
