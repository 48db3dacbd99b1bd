"""
Trees in files, to be kept beside the models they were made of.

A file is numpy's ``.npz``: the tree's arrays, and a digest of all of a caster that the
tree depends on. It is read only for a caster with that digest.
"""

import hashlib
import os
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.volume.adjacency import Caster
from umbra.volume.dual_tree import DualTree
from umbra.volume.duals import Fit
from umbra.volume.hextree import Hextree
from umbra.volume.segments import Segments, Tree

__all__ = ["read_tree", "write_tree"]

_KINDS: dict[str, type[Tree]] = {"tree": DualTree, "hextree": Hextree}
_FORMAT = "umbra tree 1"


def write_tree(path: str | os.PathLike[str], caster: Caster, tree: Tree) -> None:
    """
    Store a tree; a file that exists is replaced when the new one is complete.

    Parameters
    ----------
    path : path
        Ends in ``.npz``.
    caster : Caster
        That the tree was made of.
    tree : Tree
    """
    target = Path(path)
    segments = tree.segments
    own = {f.name: getattr(tree, f.name) for f in fields(tree) if f.name != "segments"}  # type: ignore[arg-type]
    unfinished = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with unfinished.open("wb") as file:
            np.savez(
                file,
                format=_FORMAT,
                kind=next(kind for kind, made in _KINDS.items() if isinstance(tree, made)),
                digest=_digest(caster),
                centre=segments.fit.centre,
                reach=segments.fit.reach,
                always=segments.always,
                numbers=segments.numbers,
                blocks=segments.blocks,
                **own,
            )
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)


def read_tree(path: str | os.PathLike[str], caster: Caster) -> Tree:
    """
    Read a tree that was stored.

    Parameters
    ----------
    path : path
    caster : Caster

    Returns
    -------
    tree : Tree

    Raises
    ------
    InputError
        If the file is missing, damaged, no tree, or that of another caster.
    """
    try:
        with Path(path).open("rb") as file:
            found = np.load(file, allow_pickle=False)
            arrays = dict(found) if isinstance(found, np.lib.npyio.NpzFile) else {}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        msg = f"cannot read a tree from {path}: {error}; remove the file"
        raise InputError(msg, path=path) from error
    if str(arrays.get("format")) != _FORMAT:
        msg = f"{path} holds no tree of this version of umbra; remove the file"
        raise InputError(msg, path=path)
    if str(arrays["digest"]) != _digest(caster):
        msg = f"{path} holds the tree of another model, or of this one before it changed"
        raise InputError(msg, path=path)
    kind = _KINDS[str(arrays["kind"])]
    own: dict[str, Any] = {f.name: arrays[f.name] for f in fields(kind) if f.name != "segments"}  # type: ignore[arg-type]
    fit = Fit(arrays["centre"], float(arrays["reach"]))
    segments = Segments(fit, arrays["always"], arrays["numbers"], arrays["blocks"])
    return kind(segments=segments, **own)  # type: ignore[call-arg]


def _digest(caster: Caster) -> str:
    """Sum up all that a tree depends on; weights and open components are not part of it."""
    found = hashlib.blake2b(digest_size=16)
    for array in (caster.planes, caster.edge_faces, caster.turn, caster.vertices, caster.faces):
        found.update(f"{array.dtype} {array.shape} ".encode())
        found.update(np.ascontiguousarray(array).data)
    return found.hexdigest()
