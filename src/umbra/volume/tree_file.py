"""
Files of dual trees, to be stored with their models.

A file is NumPy's ``.npz``: the tree's arrays, and a digest of the caster data that it depends on.
It is used only for a caster with that digest; ``open_tree`` replaces it for any other.
"""

import hashlib
import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.volume.adjacency import Caster
from umbra.volume.dual_tree import DualTree
from umbra.volume.duals import Fit, Segments
from umbra.volume.silhouette import prepare_tree

__all__ = ["open_tree", "read_tree", "write_tree"]

_NAME = "umbra tree"
_FORMAT = f"{_NAME} 3"


def open_tree(
    path: str | os.PathLike[str],
    caster: Caster,
    *,
    say: Callable[[str], object] = lambda _: None,
) -> DualTree:
    """
    Read the tree of a caster from an ``.npz`` file, or build it and store it there.

    ``find_silhouettes`` uses it from then on. A tree of another caster, or of another version of
    umbra, is replaced; a file that is no tree is not. ``say`` receives one line: whether the tree
    was read or built, and why.

    Raises
    ------
    InputError
        If the file is no tree, or is damaged.
    OSError
        If the tree cannot be stored.
    """
    target = Path(path)
    reason = "there is no such file"
    if target.exists():
        arrays = _load(target)
        reason = _find_fault(arrays, caster)
        if not reason:
            say(f"{path}: read the tree of {len(caster.edges):,} edges")
            return prepare_tree(caster, _unpack(arrays))
    tree = prepare_tree(caster)
    write_tree(target, caster, tree)
    say(f"{path}: {reason}; built the tree of {len(caster.edges):,} edges and stored it")
    return tree


def write_tree(path: str | os.PathLike[str], caster: Caster, tree: DualTree) -> None:
    """Store a caster's tree as ``.npz``; an old file is replaced when the new one is complete."""
    target = Path(path)
    fit, segments = tree.segments.fit, tree.segments
    unfinished = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with unfinished.open("wb") as file:
            np.savez(
                file, format=_FORMAT, digest=_digest(caster), centre=fit.centre, reach=fit.reach,
                always=segments.always, numbers=segments.numbers, blocks=segments.blocks,
                boxes=tree.boxes, starts=tree.starts,
            )  # fmt: skip
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)


def read_tree(path: str | os.PathLike[str], caster: Caster) -> DualTree:
    """
    Read the stored tree of a caster.

    `InputError` if the file is missing, damaged, no tree, or that of another caster.
    """
    arrays = _load(Path(path))
    fault = _find_fault(arrays, caster)
    if fault:
        msg = f"{path} {fault}; remove the file"
        raise InputError(msg, path=path)
    return _unpack(arrays)


def _load(path: Path) -> dict[str, Any]:
    """Return the arrays of a tree's file, for any caster and version."""
    try:
        with path.open("rb") as file:
            found = np.load(file, allow_pickle=False)
            arrays = dict(found) if isinstance(found, np.lib.npyio.NpzFile) else {}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        msg = f"cannot read a tree from {path}: {error}; remove the file"
        raise InputError(msg, path=path) from error
    if not str(arrays.get("format")).startswith(_NAME):
        msg = f"{path} holds no tree; name another file, or remove this one"
        raise InputError(msg, path=path)
    return arrays


def _find_fault(arrays: dict[str, Any], caster: Caster) -> str:
    """Return why the arrays are not this caster's tree; empty if they are."""
    if str(arrays["format"]) != _FORMAT:
        return "holds a tree of another version of umbra"
    if str(arrays["digest"]) != _digest(caster):
        return "holds the tree of another model, or of this one before it changed"
    return ""


def _unpack(arrays: dict[str, Any]) -> DualTree:
    fit = Fit(arrays["centre"], float(arrays["reach"]))
    segments = Segments(fit, arrays["always"], arrays["numbers"], arrays["blocks"])
    return DualTree(segments, arrays["boxes"], arrays["starts"])


def _digest(caster: Caster) -> str:
    """Return a digest of all that a tree depends on: not weights or open components."""
    found = hashlib.sha256()  # twice as fast as others on processors with SHA instructions
    for array in (caster.planes, caster.edge_faces, caster.turn, caster.vertices, caster.faces):
        found.update(f"{array.dtype} {array.shape} ".encode())
        found.update(np.ascontiguousarray(array).data)
    return found.hexdigest()
