"""glTF's bytes: the chunks of a GLB, buffers in and beside the file, accessors."""

import base64
import binascii
import struct
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.budget import Budget
from umbra.readers.checks import Companions, errors_of, find_reason
from umbra.scene import Source

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")

__all__ = ["Buffers", "find_item", "split_glb"]

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


def split_glb(data: bytes) -> tuple[bytes, bytes]:
    """Split a GLB file into its JSON text and its binary chunk."""
    if len(data) < 20:
        msg = f"is cut short: a GLB needs 20 bytes, this has {len(data)}; fetch it again"
        raise InputError(msg, bytes=len(data), needed=20)
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        msg = (
            f"is GLB version {version}; umbra reads version 2, convert it "
            "(npx gltf-pipeline -i FILE -o OUT.glb)"
        )
        raise InputError(msg, version=version)
    if length > len(data):
        msg = f"is cut short: its header says {length} bytes, it has {len(data)}; fetch it again"
        raise InputError(msg, bytes=len(data), needed=length)
    text, binary = b"", b""
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        chunk = data[offset + 8 : offset + 8 + size]
        if len(chunk) < size:
            msg = f"is damaged: the chunk at byte {offset} reaches past the end; fetch it again"
            raise InputError(msg, byte=offset)
        if kind == JSON_CHUNK and not text:
            text = chunk
        elif kind == BINARY_CHUNK and not binary:
            binary = chunk
        offset += 8 + size
    if not text:
        msg = "is damaged: it has no JSON chunk; export it again"
        raise InputError(msg)
    return text, binary


def find_item(tree: dict[str, Any], key: str, index: Any, where: str = "") -> Any:
    """Return ``tree[key][index]``; an `InputError` names a missing one, and ``where``."""
    items = tree.get(key, [])
    if type(index) is not int or not 0 <= index < len(items):
        msg = f"{where} names {key}[{index}], but there are {len(items)}; export it again"
        raise InputError(msg.lstrip(), key=key, index=index, count=len(items))
    return items[index]


class Buffers:
    """The buffers of one glTF file, loaded when first needed, within a budget."""

    def __init__(
        self, tree: dict[str, Any], binary: bytes | None, companions: Companions, budget: Budget
    ) -> None:
        self._tree = tree
        self._binary = binary
        self._companions = companions
        self.budget = budget
        self._unpacked: dict[int, bytes] = {}  # decompressed views
        self._held: dict[int, NDArray[Any]] = {}  # accessors with values from elsewhere
        self._loaded: dict[int, bytes] = {}
        self._sources: list[Source] = []

    @property
    def sources(self) -> tuple[Source, ...]:
        """The other files that were read."""
        return tuple(self._sources)

    def read_accessor(self, index: int, where: str) -> NDArray[Any]:
        """Read an accessor (count, width) in its type; float64 if it is of normalized numbers."""
        accessor = find_item(self._tree, "accessors", index, where)
        dtype = np.dtype(DTYPES[accessor["componentType"]])
        width = WIDTHS[accessor["type"]]
        count = accessor["count"]
        if index in self._held:
            return self._scale(accessor, self._held[index])
        if "bufferView" in accessor:
            values = self._read_view(
                accessor["bufferView"], accessor.get("byteOffset", 0), count, width, dtype, where
            )
        else:
            self._check_count(count, where)
            self.budget.spend(count * width * dtype.itemsize, where)
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._fill_sparse(values, accessor["sparse"], where)
        return self._scale(accessor, values)

    def hold(self, index: int, values: NDArray[Any]) -> None:
        """Set an accessor's values from outside its bytes, until they are set again."""
        self._held[index] = values

    def _scale(self, accessor: dict[str, Any], values: NDArray[Any]) -> NDArray[Any]:
        """Scale normalized whole numbers to -1 to 1."""
        if accessor.get("normalized") and values.dtype.kind != "f":
            return np.maximum(values / np.iinfo(values.dtype).max, -1.0)
        return values

    def has_bytes(self, index: Any) -> bool:
        """Return whether an accessor has unpacked bytes, too."""
        return "bufferView" in find_item(self._tree, "accessors", index)

    def read_bytes(self, index: int, where: str) -> bytes:
        """Read a whole buffer view."""
        view = find_item(self._tree, "bufferViews", index, where)
        count = view["byteLength"]
        return self._read_view(index, 0, count, 1, np.dtype(np.uint8), where).tobytes()

    def _check_count(self, count: int, where: str) -> None:
        if not 0 <= count < 1 << 31:
            msg = f"{where}: {count} values are not possible; export it again"
            raise InputError(msg, where=where, count=count)

    def _fill_sparse(
        self, values: NDArray[Any], sparse: dict[str, Any], where: str
    ) -> NDArray[Any]:
        count, places, new = sparse["count"], sparse["indices"], sparse["values"]
        kind = np.dtype(DTYPES[places["componentType"]])
        rows = self._read_view(
            places["bufferView"], places.get("byteOffset", 0), count, 1, kind, where
        ).ravel()
        filled = values.copy()
        filled[rows] = self._read_view(
            new["bufferView"], new.get("byteOffset", 0), count, values.shape[1], values.dtype, where
        )
        return filled

    def _read_view(
        self, index: int, offset: int, count: int, width: int, dtype: np.dtype[Any], where: str
    ) -> NDArray[Any]:
        view = find_item(self._tree, "bufferViews", index, where)
        row = width * dtype.itemsize
        stride = view.get("byteStride", row)
        self._check_count(count, where)
        data, first, end = self._find_bytes(index, where)
        if count == 0:
            return np.zeros((0, width), dtype)
        self.budget.spend(count * row, where)
        start = first + offset
        need = start + (count - 1) * stride + row
        if first < 0 or offset < 0 or stride < row or need > end:
            msg = (
                f"{where} needs bytes {start} to {need} of buffer {view['buffer']}, but only "
                f"{end} are there; the file is cut short or damaged, export it again"
            )
            raise InputError(msg, where=where, needed=need, bytes=end)
        return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize)).copy()

    def _find_bytes(self, index: int, where: str) -> tuple[bytes, int, int]:
        """Return the data that hold a view's bytes, their start and their end."""
        if index in self._unpacked:
            data = self._unpacked[index]
            return data, 0, len(data)
        view = find_item(self._tree, "bufferViews", index, where)
        extensions = view.get("extensions", {})
        packed = next((extensions[name] for name in MESHOPT if name in extensions), None)
        given = view if packed is None else packed
        data = self._load(given["buffer"], where)
        first = given.get("byteOffset", 0)
        end = min(first + given["byteLength"], len(data))
        if packed is None:
            return data, first, end
        self.budget.spend(packed["count"] * packed["byteStride"], where)
        data = self._unpacked[index] = _unpack_meshopt(packed, data[max(first, 0) : end], where)
        return data, 0, len(data)

    def _load(self, index: int, where: str) -> bytes:
        if index not in self._loaded:
            self._loaded[index] = self._fetch(find_item(self._tree, "buffers", index, where), index)
        return self._loaded[index]

    def _fetch(self, buffer: dict[str, Any], index: int) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            if index == 0 and self._binary is not None:
                return self._binary
            msg = f"buffer {index} has neither a name nor bytes; export it again"
            raise InputError(msg, buffer=index)
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except (binascii.Error, ValueError) as error:
                msg = f"buffer {index} is not base64 ({error}); export it again"
                raise InputError(msg, buffer=index) from error
        name = unquote(uri)
        with errors_of("buffer ", buffer=uri):
            data = self._companions.read(name)
        self._sources.append(Source(name, str(self._companions.record[name]), "glTF buffer"))
        return data


def _unpack_meshopt(packed: dict[str, Any], data: bytes, where: str) -> bytes:
    """Unpack a buffer view of EXT_meshopt_compression."""
    meshopt = need("meshopt", "gltf", f"glTF with {MESHOPT[0]}")
    try:
        rows = meshopt.decode_gltf_buffer(
            data,
            packed["count"],
            packed["byteStride"],
            packed["mode"],
            packed.get("filter", "NONE"),
        )
    except (RuntimeError, ValueError) as error:
        msg = f"{where}: its meshopt data is damaged ({find_reason(error, 80)}); export it again"
        raise InputError(msg, where=where) from error
    return np.ascontiguousarray(rows).tobytes()
