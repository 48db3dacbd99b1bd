"""
Cache of scenes that are slow to read, stored as arrays.

The folder stores arrays by name, limited in size and safe to delete: each file is NumPy's ``.npz``
without pickles, written under another name and renamed, so that concurrent or killed runs leave
only complete files. An unreadable file is removed and rewritten. Nothing here raises: if the cache
cannot be written, it is not used; nor is a folder that others own or may write to, who could put
another scene in the place of one that was read.

Arrays shared by parts are stored once and shared again after loading. Scenes with lights, motion or
images are not cached: their formats are as fast to read. A SHA-256 among the arrays detects
changes, and every index is checked, since compiled kernels check no bounds.
"""

import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.scene import Material, Mesh, Part, Scene, Source

__all__ = [
    "LIMIT",
    "drop",
    "find_doubt",
    "find_folder",
    "keep",
    "keep_scene",
    "load",
    "load_scene",
    "measure_cache",
]

T = TypeVar("T")

_PLACE = ("latitude", "longitude", "elevation", "is_ellipsoidal", "true_north", "ground")
_WIDTHS = {
    "vertices": 3, "faces": 3, "normals": 3, "uv": 2, "colors": 3, "tangents": 4, "uv2": 2,
    "alpha": 1,
}  # fmt: skip
_NONE = -1

Beside = list[list[Any]]
"""Companion files of the scene's file, read or missing, as reported by their reader."""


def keep_scene(key: str, scene: Scene, beside: Beside | None = None) -> None:
    """Store a scene, with the companion files ``beside`` it that it depends on."""
    if scene.lights or any(part.binding or part.material.images for part in scene.parts):
        return
    if not all(np.isfinite(getattr(scene, name) or 0.0) for name in _PLACE):
        return
    try:
        arrays = _pack(scene, beside or [])
    except TypeError:  # text that is not Unicode, e.g. in a file's name
        return
    keep(key, {**arrays, "sum": _sum(arrays)})


def load_scene(key: str, is_current: Callable[[Beside], bool] = lambda _: True) -> Scene | None:
    """Return the scene of a key, or None; ``is_current`` checks the companion files."""
    arrays = load(key)
    if arrays is None:
        return None
    try:
        if arrays.pop("sum").tobytes() != _sum(arrays).tobytes():
            msg = "checksum mismatch"
            raise ValueError(msg)  # noqa: TRY301
        words = orjson.loads(arrays["words"].tobytes())
        return _unpack(arrays, words) if is_current(words["beside"]) else None
    except Exception:  # noqa: BLE001 - changed files can raise anything
        drop(key)
        return None


class _Pool:
    """Unique objects, by identity, and their indices."""

    def __init__(self) -> None:
        self.items: list[Any] = []
        self._numbers: dict[int, int] = {}

    def add(self, item: Any) -> int:
        """Return the object's index; -1 for None."""
        if item is None:
            return _NONE
        number = self._numbers.setdefault(id(item), len(self.items))
        if number == len(self.items):
            self.items.append(item)
        return number


def _sum(arrays: Mapping[str, NDArray]) -> NDArray[np.uint8]:
    """Return the SHA-256 of arrays with their names, types and shapes."""
    summed = sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        summed.update(f"{name} {array.dtype.str} {array.shape} ".encode())
        summed.update(array.data if array.size else b"")
    return np.frombuffer(summed.digest(), np.uint8)


def _pack(scene: Scene, beside: Beside) -> dict[str, NDArray]:
    meshes, materials, transforms = _Pool(), _Pool(), _Pool()
    table = [
        (meshes.add(part.mesh), materials.add(part.material), transforms.add(part.transform))
        for part in scene.parts
    ]
    pools = {name: _Pool() for name in _WIDTHS}
    rows = [[pools[name].add(getattr(m, name)) for name in _WIDTHS] for m in meshes.items]
    words = {
        "names": [part.name for part in scene.parts],
        "kinds": [part.kind for part in scene.parts],
        "layers": [part.layer for part in scene.parts],
        "tags": [part.tags for part in scene.parts],
        "materials": [{**asdict(material), "image": None} for material in materials.items],
        "place": {name: getattr(scene, name) for name in _PLACE},
        "crs": scene.crs,
        "site_doubt": scene.site_doubt,
        "sources": [asdict(source) for source in scene.sources],
        "notes": scene.notes,
        "beside": beside,
    }
    arrays: dict[str, NDArray] = {
        "words": np.frombuffer(orjson.dumps(words), np.uint8),
        "origin": scene.origin,
        "parts": np.array(table, np.int64).reshape(-1, 3),
        "meshes": np.array(rows, np.int64).reshape(-1, len(_WIDTHS)),
        "transforms": np.array(transforms.items, np.float64).reshape(-1, 4, 4),
    }
    for name, width in _WIDTHS.items():
        items = pools[name].items
        arrays[name] = np.concatenate(items) if items else np.zeros((0, width))
        arrays[f"{name}_length"] = np.array([len(item) for item in items], np.int64)
    return arrays


def _unpack(arrays: dict[str, NDArray], words: dict[str, Any]) -> Scene:
    pools = {name: _cut(arrays[name], arrays[f"{name}_length"]) for name in _WIDTHS}
    is_optional = [name not in {"vertices", "faces"} for name in _WIDTHS]
    _check_numbers(arrays["meshes"], list(pools.values()), is_optional=is_optional)
    tables = [arrays["meshes"], words["materials"], arrays["transforms"]]
    _check_numbers(arrays["parts"], tables, is_optional=[False, False, True])
    for name, shape in (("vertices", (-1, 3)), ("transforms", (-1, 4, 4)), ("origin", (3,))):
        array = arrays[name].reshape(shape)
        if array.dtype != np.float64 or not np.isfinite(array).all():
            msg = f"{name} are not all numbers"
            raise ValueError(msg)
    meshes = [
        Mesh(*(_pick(pools[name], number) for name, number in zip(_WIDTHS, row, strict=True)))
        for row in arrays["meshes"].tolist()
    ]
    materials = [Material(**_with_tuples(record)) for record in words["materials"]]
    transforms = list(arrays["transforms"])
    parts = tuple(
        Part(
            name, kind, meshes[mesh], _pick(transforms, transform), materials[material],
            layer=layer, tags=tuple(tags),
        )
        for name, kind, layer, tags, (mesh, material, transform) in zip(
            words["names"], words["kinds"], words["layers"], words["tags"],
            arrays["parts"].tolist(), strict=True,
        )
    )  # fmt: skip
    return Scene(
        parts,
        arrays["origin"],
        crs=words["crs"],
        site_doubt=words["site_doubt"],
        **words["place"],
        sources=tuple(Source(**_with_tuples(record)) for record in words["sources"]),
        notes=tuple(words["notes"]),
    )


def _cut(array: NDArray, lengths: NDArray[np.int64]) -> list[NDArray]:
    """Split an array into pieces, without copying."""
    if (lengths < 0).any() or lengths.sum() != len(array):
        msg = "pieces that do not make up their array"
        raise ValueError(msg)
    ends = np.cumsum(lengths).tolist()
    return [array[end - length : end] for end, length in zip(ends, lengths.tolist(), strict=True)]


def _check_numbers(
    table: NDArray[np.int64], pools: Sequence[Sequence], is_optional: Sequence[bool]
) -> None:
    """Check that each column of a table holds valid indices of its pool; -1 means none."""
    lowest = [_NONE if optional else 0 for optional in is_optional]
    if (table < lowest).any() or (table >= [len(pool) for pool in pools]).any():
        msg = "numbers of what is not there"
        raise ValueError(msg)


def _pick(items: Sequence[T], number: int) -> Any:
    return None if number == _NONE else items[number]


def _with_tuples(facts: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in facts.items()}


LIMIT = 1_000_000_000
"""Maximum total size of all files, and minimum free space on the disk [byte]."""

_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_ENDING, _UNFINISHED = ".npz", ".unfinished"
_ABANDONED = 3600.0  # age at which an unfinished file is that of a killed run [s]


def find_folder() -> Path:
    """Return the cache folder: ``UMBRA_CACHE``, else the user's cache folder of this system."""
    given = os.environ.get("UMBRA_CACHE")
    if given:
        return Path(given).absolute()
    from platformdirs import user_cache_path  # noqa: PLC0415 - only with a cache

    return user_cache_path("umbra", appauthor=False)


def find_doubt(folder: Path) -> str:
    """Return why a folder cannot be trusted: it is another user's, or others may write there."""
    try:
        status = folder.stat()
    except OSError:  # it is made, for this user alone, when something is kept
        return ""
    if os.name != "posix":
        return ""  # each user's folder is in their profile there
    if status.st_uid != os.geteuid():
        return "it belongs to another user"
    return "others may write into it" if status.st_mode & _OTHERS_WRITE else ""


def load(name: str) -> dict[str, NDArray] | None:
    """Return the arrays stored under a name; None if missing, damaged (CRC-32) or in doubt."""
    if find_doubt(find_folder()):
        return None
    try:
        with _find_path(name).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
    except FileNotFoundError:
        return None
    except Exception:  # noqa: BLE001 - damage can raise anything
        drop(name)
        return None
    with suppress(OSError):
        os.utime(_find_path(name))  # for removal of the least recently used
    return arrays


def keep(name: str, arrays: Mapping[str, NDArray]) -> None:
    """Store arrays under a name, if there is room; then remove the least recently used."""
    size = sum(array.nbytes for array in arrays.values())
    if size > LIMIT // 4:
        return
    unfinished = None
    try:
        folder = find_folder()
        if not folder.is_absolute():
            return  # a user without a home
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if find_doubt(folder):
            return
        if shutil.disk_usage(folder).free < size + LIMIT:
            return
        handle, unfinished = tempfile.mkstemp(_UNFINISHED, dir=folder)
        with os.fdopen(handle, "wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        Path(unfinished).replace(_find_path(name))
        _sweep(folder)
    except OSError:
        pass  # caching is optional
    finally:
        if unfinished is not None:
            with suppress(OSError):
                Path(unfinished).unlink()


def drop(name: str) -> None:
    """Remove the file stored under a name."""
    with suppress(OSError):
        _find_path(name).unlink()


def measure_cache() -> tuple[int, int]:
    """Return the number of files and their total size [byte]."""
    sizes = [size for _, size, _ in _list(find_folder())]
    return len(sizes), sum(sizes)


def _find_path(name: str) -> Path:
    return find_folder() / f"{name}{_ENDING}"


def _list(folder: Path) -> list[tuple[float, int, Path]]:
    """Return the time of last use, the size [byte] and the path of each file."""
    entries = []
    with suppress(OSError):
        for path in folder.glob(f"*{_ENDING}"):
            with suppress(OSError):  # another run may have removed it
                status = path.stat()
                entries.append((status.st_mtime, status.st_size, path))
    return entries


def _sweep(folder: Path) -> None:
    """Remove the least recently used files, and unfinished files of killed runs."""
    files = sorted(_list(folder), key=lambda entry: entry[0])
    excess = sum(size for _, size, _ in files) - LIMIT
    for _, size, path in files:
        if excess <= 0:
            break
        excess -= size
        with suppress(OSError):
            path.unlink()
    for path in folder.glob(f"*{_UNFINISHED}"):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > _ABANDONED:
                path.unlink()
