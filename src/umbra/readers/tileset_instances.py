"""Instanced models of 3D Tiles 1.0 (I3DM): one glTF at many places, as parts that share meshes."""

import struct
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import errors_of
from umbra.readers.gltf import PART, read_gltf_content
from umbra.readers.model import FileModel, ReadChoices
from umbra.readers.tileset_frame import find_axes, move_part

__all__ = ["read_i3dm"]

_HEAD = 32


def read_i3dm(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read one tile of instances, in its own frame; its glTF is in it or beside it."""
    if len(data) < _HEAD or data[:4] != b"i3dm":
        msg = "is a damaged I3DM; fetch it again"
        raise InputError(msg)
    *sizes, is_within = struct.unpack_from("<5I", data, 12)
    start = _HEAD + sum(sizes)
    table = orjson.loads(data[_HEAD : _HEAD + sizes[0]])
    places = _Table(table, data[_HEAD + sizes[0] : _HEAD + sizes[0] + sizes[1]]).find_places()
    content = data[start:]
    if not is_within:
        name = unquote(content.rstrip(b"\x00 ").decode())
        content = choices.companions_of(path).read(name)
        path = path.parent / name
    with errors_of("its glTF "):
        model = read_gltf_content(content, path, choices)
        if model is None:
            msg = "does not begin as glTF does; fetch it again"
            raise InputError(msg)
    many = len(places) * len(model.parts)
    choices.budget.spend(PART * many, f"{len(places):,} instances of {len(model.parts):,} parts")
    parts = tuple(
        replace(move_part(part, place), name=f"{part.name} {k}", tags=(*part.tags, part.name))
        for k, place in enumerate(places, 1)
        for part in model.parts
    )
    return replace(model, format="3D Tiles I3DM", parts=parts)


class _Table:
    """
    A feature table: properties of all instances, in JSON or as places in its binary body.

    Parameters
    ----------
    tree : dict
    body : bytes
    """

    def __init__(self, tree: dict[str, Any], body: bytes) -> None:
        self._tree, self._body = tree, body
        self._count = int(self._read("INSTANCES_LENGTH", "<u4", 1, 1)[0, 0])

    def find_places(self) -> NDArray[np.float64]:
        """Return the place of each instance in the tile's frame, (n, 4, 4) float64."""
        n = self._count
        if "POSITION" in self._tree:
            points = self._read("POSITION", "<f4", 3, n)
        else:
            shares = self._read("POSITION_QUANTIZED", "<u2", 3, n) / 65535.0
            points = shares * self._read("QUANTIZED_VOLUME_SCALE", "<f4", 3, 1)
            points += self._read("QUANTIZED_VOLUME_OFFSET", "<f4", 3, 1)
        if "RTC_CENTER" in self._tree:
            points = points + self._read("RTC_CENTER", "<f4", 3, 1)
        places = np.tile(np.eye(4), (n, 1, 1))
        places[:, :3, 3] = points
        axes = self._find_axes(points)
        if "SCALE" in self._tree:
            axes = axes * self._read("SCALE", "<f4", 1, n)[:, None]
        if "SCALE_NON_UNIFORM" in self._tree:
            axes = axes * self._read("SCALE_NON_UNIFORM", "<f4", 3, n)[:, None]
        places[:, :3, :3] = axes
        if not np.isfinite(places).all():
            msg = "has instances at places that are not finite; fetch it again"
            raise InputError(msg)
        return places

    def _find_axes(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the images of the model's axes as columns, (n, 3, 3)."""
        if "NORMAL_UP" in self._tree:
            right, up = (
                self._read(name, "<f4", 3, self._count) for name in ("NORMAL_RIGHT", "NORMAL_UP")
            )
        elif "NORMAL_UP_OCT32P" in self._tree:
            right, up = (
                _unfold(self._read(f"NORMAL_{name}_OCT32P", "<u2", 2, self._count))
                for name in ("RIGHT", "UP")
            )
        elif self._tree.get("EAST_NORTH_UP"):
            return find_axes(points)
        else:
            return np.tile(np.eye(3), (self._count, 1, 1))
        return np.stack([right, up, np.cross(right, up)], axis=2)

    def _read(self, name: str, kind: str, width: int, count: int) -> NDArray[np.float64]:
        """Return a property, (count, width)."""
        told = self._tree[name]
        if isinstance(told, dict):
            held = np.frombuffer(self._body, kind, width * count, int(told["byteOffset"]))
        else:
            held = np.array(told, np.float64)
        return held.astype(np.float64).reshape(count, width)


def _unfold(codes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit vectors (n, 3) of octahedral codes (n, 2) of 16 bits."""
    xy = codes / 65535.0 * 2.0 - 1.0
    z = 1.0 - np.abs(xy).sum(1)
    folded = (1.0 - np.abs(xy[:, ::-1])) * np.where(xy >= 0, 1.0, -1.0)
    found = np.column_stack([np.where(z[:, None] < 0, folded, xy), z])
    return found / np.linalg.norm(found, axis=1, keepdims=True)
