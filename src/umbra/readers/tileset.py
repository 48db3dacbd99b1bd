"""
3D Tiles 1.0 and 1.1: the tiles of one level of detail, in metres east, north and up.

Instanced models of 3D Tiles 1.0 (I3DM): one glTF at many places, as parts that share meshes.
"""

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import Losses, errors_of, list_counts
from umbra.readers.georeference import show_crs
from umbra.readers.gltf import PART, read_gltf_content
from umbra.readers.gltf_earth import put_on_earth
from umbra.readers.model import FileModel, FilePlace, ReadChoices, UniqueNames
from umbra.readers.tileset_frame import (
    Frame,
    find_axes,
    find_tileset_frame,
    find_volume,
    make_matrix,
    move_part,
)
from umbra.readers.tileset_implicit import expand
from umbra.scene import Part

__all__ = ["read_b3dm", "read_i3dm", "read_tileset"]

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
        replace(move_part(part, matrix), name=f"{part.name} {k}", tags=(*part.tags, part.name))
        for k, matrix in enumerate(places, 1)
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
        entry = self._tree[name]
        if isinstance(entry, dict):
            held = np.frombuffer(self._body, kind, width * count, int(entry["byteOffset"]))
        else:
            held = np.array(entry, np.float64)
        return held.astype(np.float64).reshape(count, width)


def _unfold(codes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit vectors (n, 3) of octahedral codes (n, 2) of 16 bits."""
    xy = codes / 65535.0 * 2.0 - 1.0
    z = 1.0 - np.abs(xy).sum(1)
    folded = (1.0 - np.abs(xy[:, ::-1])) * np.where(xy >= 0, 1.0, -1.0)
    vectors = np.column_stack([np.where(z[:, None] < 0, folded, xy), z])
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


_CORNER = 36  # memory of a triangle's corners beside the mesh [byte]
_DEEPEST = 60
_OTHERS = {b"pnts": "point clouds (pnts)", b"vctr": "vector tiles (vctr)"}

Matrix = NDArray[np.float64]


def read_b3dm(data: bytes, path: Path, choices: ReadChoices) -> FileModel:
    """Read one tile of 3D Tiles 1.0, in its own frame."""
    glb, centre = split_b3dm(data)
    model = read_gltf_content(glb, path, choices)
    if model is None:
        msg = "holds no glTF; fetch it again"
        raise InputError(msg)
    parts = tuple(move_part(part, _shift(centre)) for part in model.parts)
    return put_on_earth(replace(model, format="3D Tiles B3DM", parts=parts), {}, choices)


def read_tileset(tree: dict[str, Any], path: Path, choices: ReadChoices) -> FileModel:
    """Read a set of tiles with the files beside it: the finest tiles, or those fine enough."""
    reader = _TilesetReader(path, choices, tree)
    reader.add_tile(tree["root"], _Context(PurePosixPath(), np.eye(4), "REPLACE", up_of(tree)))
    notes = [*reader.notes, *list_counts(reader.counts)]
    version = str(tree.get("asset", {}).get("version", ""))
    frame = reader.frame
    return FileModel(
        f"3D Tiles {version}".strip(), tuple(reader.parts), frame.crs if frame else None,
        tuple(notes), place=FilePlace(is_ellipsoidal=True), is_high_in_metres=True,
        outside=reader.outside,
    )  # fmt: skip


def up_of(tree: dict[str, Any]) -> str:
    """Return the axis that points up in the glTF of a set; z in some of version 1.0."""
    word = str(tree.get("asset", {}).get("gltfUpAxis", "Y")).lower()
    return word if word in {"x", "y", "z"} else "y"


class _Context:
    """What a tile inherits: the folder of its set, its place, its refinement, the up axis."""

    def __init__(
        self, folder: PurePosixPath, matrix: Matrix, refine: str, up: str, depth: int = 0
    ) -> None:
        self.folder, self.matrix, self.refine = folder, matrix, refine
        self.up, self.depth = up, depth


class _TilesetReader:
    """Collects the parts of tiles."""

    def __init__(self, path: Path, choices: ReadChoices, tree: dict[str, Any]) -> None:
        self._path, self._choices = path, choices
        self._companions = choices.companions_of(path)
        self._budget = choices.budget
        self._files: dict[str, bytes] = {}  # subtrees, of which several may have one name
        self._trees: dict[str, dict[str, Any]] = {}  # other sets
        self._models: dict[str, FileModel] = {}
        self._unique = UniqueNames()
        self._open: list[str] = [path.name]
        self.parts: list[Part] = []
        self.counts = Losses()
        self.notes: list[str] = []
        self.outside = 0
        root = tree["root"]
        points = find_volume(root.get("boundingVolume"), make_matrix(root.get("transform")))
        region = choices.region
        self.frame: Frame | None = find_tileset_frame(points, region)
        if self.frame is not None:
            crs = show_crs(self.frame.crs)
            self.notes.append(f"coordinates are {crs}, heights above the ellipsoid")
        self._box = None
        if region is not None and self.frame is not None:
            self._region = region.settle(self.frame.crs)
            self._box = self._region.find_box(self.frame.crs)

    def add_tile(self, tile: dict[str, Any], context: _Context) -> None:
        """Add a tile's contents, or those of its children if they are finer than wanted."""
        self._budget.count("tiles")
        if context.depth > _DEEPEST:
            msg = f"nests more than {_DEEPEST} tiles; export it again"
            raise InputError(msg)
        matrix = context.matrix @ make_matrix(tile.get("transform"))
        if self._is_outside(tile, matrix):
            self.outside += 1
            return
        refine = str(tile.get("refine") or context.refine).upper()
        if "implicitTiling" in tile:
            tile = expand(
                tile,
                lambda name: self._read(context.folder, name),
                lambda: self._budget.count("tiles"),
            )
        below = _Context(context.folder, matrix, refine, context.up, context.depth + 1)
        children = tile.get("children") or ()
        enough = self._choices.geometric_error
        if enough is not None and float(tile.get("geometricError", 0)) <= enough:
            children = ()
        contents = list(_list_contents(tile))
        # A set that is named by a tile is its children, not its content.
        if refine == "ADD" or not children or all(name.endswith(".json") for name in contents):
            for name in contents:
                self._add_content(name, below)
        for child in children:
            self.add_tile(child, below)

    def _is_outside(self, tile: dict[str, Any], matrix: Matrix) -> bool:
        """Return whether a tile's bounding volume does not meet the box that is wanted."""
        if self._box is None or self.frame is None:
            return False
        points = find_volume(tile.get("boundingVolume"), matrix)
        if points is None:
            return False
        plan = (points @ self.frame.matrix[:3, :3].T + self.frame.matrix[:3, 3])[:, :2]
        low, high = plan.min(0), plan.max(0)
        west, south, east, north = self._box
        return bool(low[0] > east or high[0] < west or low[1] > north or high[1] < south)

    def _read(self, folder: PurePosixPath, name: str) -> bytes:
        where = str(folder / name)
        if where not in self._files:
            self._files[where] = self._companions.read(where)
        return self._files[where]

    def _add_content(self, uri: str, context: _Context) -> None:
        if "://" in uri:
            self.counts.add("contents left out that lie on the net", uri)
            return
        name = unquote(uri.partition("?")[0])
        where = str(context.folder / name)
        if where in self._trees:
            self._add_set(self._trees[where], where, context)
            return
        if where not in self._models:
            data = self._companions.read(where)
            tree = orjson.loads(data) if data.lstrip()[:1] == b"{" else {}
            if "root" in tree:
                self._trees[where] = tree
                self._add_set(tree, where, context)
                return
            with errors_of(f"'{where[-80:]}' "):
                self._models[where] = self._make_model(data, where, context.up)
        self._place(self._models[where], where, context.matrix)

    def _add_set(self, tree: dict[str, Any], where: str, context: _Context) -> None:
        """Add the tiles of another set."""
        if where in self._open:
            msg = f"'{where[-80:]}' leads back to itself; export it again"
            raise InputError(msg)
        self._open.append(where)
        folder = PurePosixPath(where).parent
        self.add_tile(
            tree["root"],
            _Context(folder, context.matrix, context.refine, up_of(tree), context.depth + 1),
        )
        self._open.pop()

    def _make_model(self, data: bytes, where: str, up: str) -> FileModel:
        """Read a tile's content: glTF, B3DM, or several contents in one (CMPT)."""
        if not data.strip():
            msg = "is empty; fetch it again"
            raise InputError(msg)
        up = self._choices.up or up
        choices = replace(self._choices, up=up, region=None, opened=[])
        path = self._path.parent / where
        magic = data[:4]
        if magic == b"cmpt":
            models = [self._make_model(piece, where, up) for piece in _split_cmpt(data)]
            return FileModel("", tuple(part for model in models for part in model.parts))
        if magic in _OTHERS:
            self.counts.add(f"{_OTHERS[magic]} left out", where)
            return FileModel("", ())
        model: FileModel | None
        if magic == b"b3dm":
            model = read_b3dm(data, path, choices)
        elif magic == b"i3dm":
            model = read_i3dm(data, path, choices)
        else:
            model = read_gltf_content(data, path, choices)
        if model is None:
            msg = "is neither glTF nor a tile that is known; fetch it again"
            raise InputError(msg)
        # Files of a tile are files of the set: the cache checks those beside the named file.
        for companions in choices.opened:
            folder = companions.path.parent.relative_to(self._path.parent)
            self._companions.record |= {
                str(folder / name): s for name, s in companions.record.items()
            }
        for note in model.notes:
            what, _, count = note.rpartition(": ")
            if count.isdigit() and what:
                self.counts.add(what, where, int(count))
        return model

    def _place(self, model: FileModel, where: str, matrix: Matrix) -> None:
        """Add a content's parts where its tile puts them."""
        if self.frame is not None:
            matrix = self.frame.matrix @ matrix
        self._budget.count("parts of tiles", len(model.parts))
        corners = sum(part.triangles for part in model.parts)
        self._budget.spend(_CORNER * corners, "tiles' contents")
        stem = PurePosixPath(where).stem
        names: dict[str, str] = {}
        for part in model.parts:
            word = f"{stem}/{part.name}"
            name = names.setdefault(word, "") or self._unique.add(word)
            names[word] = name
            tags = (*part.tags, part.name, stem)
            self.parts.append(replace(move_part(part, matrix), name=name, tags=tags))


def _list_contents(tile: dict[str, Any]) -> Iterator[str]:
    """Return the names of a tile's contents."""
    for content in (tile.get("content"), *(tile.get("contents") or ())):
        if content:
            yield str(content.get("uri") or content["url"])


def _shift(centre: Any) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = centre
    return matrix


def split_b3dm(data: bytes) -> tuple[bytes, Any]:
    """Return the GLB in a B3DM, and the centre that its coordinates are relative to."""
    if len(data) < 28 or data[:4] != b"b3dm":
        msg = "is a damaged B3DM; fetch it again"
        raise InputError(msg)
    sizes = struct.unpack_from("<6I", data, 4)
    start = 28 + sum(sizes[2:])
    if data[start : start + 4] != b"glTF":
        msg = "is a B3DM without a GLB where its header says; fetch it again"
        raise InputError(msg)
    table = orjson.loads(data[28 : 28 + sizes[2]] or b"{}")
    centre = table.get("RTC_CENTER", (0.0, 0.0, 0.0))
    return data[start:], np.array(centre, np.float64).reshape(3)


def _split_cmpt(data: bytes) -> Iterator[bytes]:
    """Return the tiles in a composite one."""
    count = struct.unpack_from("<I", data, 12)[0]
    start = 16
    for _ in range(count):
        size = struct.unpack_from("<I", data, start + 8)[0]
        if size < 12 or start + size > len(data) or data[start : start + 4] == b"cmpt":
            msg = "is a damaged composite tile; fetch it again"
            raise InputError(msg)
        yield data[start : start + size]
        start += size
