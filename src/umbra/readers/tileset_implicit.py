"""Implicit tiles of 3D Tiles 1.1: subtrees of quadtrees and octrees as explicit tiles."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.errors import InputError

__all__ = ["expand"]

Place = tuple[int, int, int, int]  # level, x, y, z
Fetch = Callable[[str], bytes]


def expand(tile: dict[str, Any], fetch: Fetch, spend: Callable[[], None]) -> dict[str, Any]:
    """
    Return the tree of an implicit tile, with explicit children.

    ``fetch`` reads a file by its name; ``spend`` is called for every tile, and refuses too many.
    """
    tiling = tile["implicitTiling"]
    scheme = tiling["subdivisionScheme"]
    if scheme not in {"QUADTREE", "OCTREE"}:
        msg = f"has implicit tiles of an unknown scheme, {str(scheme)[:40]}"
        raise InputError(msg)
    forest = _Forest(tile, fetch, spend, 2 if scheme == "QUADTREE" else 3)
    root = forest.make((0, 0, 0, 0), tile.get("boundingVolume"), None)
    return {**(root or {}), "transform": tile.get("transform"), "refine": tile.get("refine")}


class _Subtree:
    """Availability of the tiles, the contents and the children of one subtree."""

    def __init__(self, data: bytes, name: str, fetch: Fetch, axes: int, levels: int) -> None:
        self._axes = axes
        if data[:4] != b"subt" or len(data) < 24:
            msg = f"'{name[:60]}' is not a subtree of 3D Tiles; fetch it again"
            raise InputError(msg)
        n_json, _ = np.frombuffer(data, "<u8", 2, 8).tolist()
        self._tree = orjson.loads(data[24 : 24 + n_json])
        self._binary = data[24 + n_json :]
        self._fetch = fetch
        nodes = (2 ** (axes * levels) - 1) // (2**axes - 1)
        self._tiles = self._read(self._tree["tileAvailability"], nodes)
        contents = self._tree.get("contentAvailability") or [{"constant": 0}]
        contents = [contents] if isinstance(contents, dict) else contents
        self._contents = [self._read(content, nodes) for content in contents]
        children = self._tree["childSubtreeAvailability"]
        self._children = self._read(children, 2 ** (axes * levels))

    def _read(self, availability: dict[str, Any], count: int) -> NDArray[np.uint8] | int:
        """Return bits (n,), or one for all."""
        if "constant" in availability:
            return int(availability["constant"])
        view = self._tree["bufferViews"][
            availability.get("bitstream", availability.get("bufferView"))
        ]
        buffer = self._tree["buffers"][view["buffer"]]
        data = self._fetch(buffer["uri"]) if "uri" in buffer else self._binary
        start = int(view.get("byteOffset", 0))
        part = np.frombuffer(data[start : start + int(view["byteLength"])], np.uint8)
        bits = np.unpackbits(part, bitorder="little")
        if len(bits) < count:
            msg = f"has a subtree of {len(bits)} bits, which needs {count}; fetch it again"
            raise InputError(msg)
        return bits

    def has_tile(self, level: int, morton: int) -> bool:
        return bool(_at(self._tiles, self._index(level, morton)))

    def has_content(self, number: int, level: int, morton: int) -> bool:
        there = self._contents[min(number, len(self._contents) - 1)]
        return bool(_at(there, self._index(level, morton)))

    def has_child(self, morton: int) -> bool:
        return bool(_at(self._children, morton))

    def _index(self, level: int, morton: int) -> int:
        return (2 ** (self._axes * level) - 1) // (2**self._axes - 1) + morton


def _at(bits: NDArray[np.uint8] | int, index: int) -> int:
    return bits if isinstance(bits, int) else int(bits[index])


class _Forest:
    """All subtrees of one implicit tile, read when a tile of them is made."""

    def __init__(
        self, tile: dict[str, Any], fetch: Fetch, spend: Callable[[], None], axes: int
    ) -> None:
        self._tile, self._fetch, self._spend, self._axes = tile, fetch, spend, axes
        tiling = tile["implicitTiling"]
        self._uri = tiling["subtrees"]["uri"]
        self._levels = int(tiling["subtreeLevels"])
        self._most = int(tiling.get("availableLevels", tiling.get("maximumLevel", 0) + 1))
        if not 1 <= self._levels <= 12 or not 1 <= self._most <= 32:
            msg = f"has implicit tiles of {self._most} levels by {self._levels}; export it again"
            raise InputError(msg)

    def make(
        self, coordinates: Place, volume: Any, subtree: _Subtree | None
    ) -> dict[str, Any] | None:
        """Return a tile with its children; None if it is not available."""
        self._spend()
        level, x, y, z = coordinates
        local = level % self._levels
        if subtree is None:
            name = _fill(self._uri, coordinates)
            subtree = _Subtree(self._fetch(name), name, self._fetch, self._axes, self._levels)
        mask = (1 << local) - 1
        morton = _interleave((x & mask, y & mask, z & mask)[: self._axes])
        if not subtree.has_tile(local, morton):
            return None
        wanted = self._tile.get("contents") or [self._tile.get("content")]
        contents = [
            {"uri": _fill(content["uri"], coordinates)}
            for number, content in enumerate(wanted)
            if content and subtree.has_content(number, local, morton)
        ]
        error = float(self._tile.get("geometricError", 0)) / 2**level
        is_last = level + 1 >= self._most
        children = [] if is_last else list(self._list_children(coordinates, volume, subtree))
        return {"boundingVolume": volume, "geometricError": error, "contents": contents,
                "children": children}  # fmt: skip

    def _list_children(
        self, coordinates: Place, volume: Any, subtree: _Subtree
    ) -> Iterator[dict[str, Any]]:
        level, x, y, z = coordinates
        is_last = (level + 1) % self._levels == 0
        mask = (1 << (level + 1) % self._levels) - 1 if not is_last else (1 << self._levels) - 1
        for k in range(2**self._axes):
            step = (k & 1, k >> 1 & 1, k >> 2 & 1)
            there = (2 * x + step[0], 2 * y + step[1], 2 * z + step[2] * (self._axes == 3))
            if is_last and not subtree.has_child(
                _interleave(tuple(coordinate & mask for coordinate in there)[: self._axes])
            ):
                continue
            smaller = _divide(volume, step, self._axes)
            child = self.make((level + 1, *there), smaller, None if is_last else subtree)
            if child is not None:
                yield child


def _fill(uri: str, coordinates: Place) -> str:
    for word, number in zip(("level", "x", "y", "z"), coordinates, strict=True):
        uri = uri.replace(f"{{{word}}}", str(number))
    return uri


def _interleave(coordinates: tuple[int, ...]) -> int:
    """Return the Morton index of a place: its bits in turn, x's first."""
    axes, index = len(coordinates), 0
    for bit in range(max(coordinates).bit_length()):
        for axis, value in enumerate(coordinates):
            index |= (value >> bit & 1) << (axes * bit + axis)
    return index


def _divide(volume: Any, step: tuple[int, int, int], axes: int) -> Any:
    """Return the part of a volume that a child has; the whole if it is of another kind."""
    if isinstance(volume, dict) and "box" in volume:
        numbers = np.array(volume["box"], np.float64).reshape(4, 3)
        for axis in range(axes):
            numbers[1 + axis] /= 2
            numbers[0] += numbers[1 + axis] * (1 if step[axis] else -1)
        return {"box": numbers.ravel().tolist()}
    if isinstance(volume, dict) and "region" in volume:
        region = list(map(float, volume["region"]))
        ends = ((0, 2), (1, 3), (4, 5))
        for (low, high), on in list(zip(ends, step, strict=True))[:axes]:
            region[low if on else high] = (region[low] + region[high]) / 2
        return {"region": region}
    return volume
