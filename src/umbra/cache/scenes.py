"""
Scenes as a few arrays, so that a thousand parts load as fast as one.

Arrays that parts share are stored once and shared again; small ones lie end to end. What
shines, moves or bears a picture is not kept: it comes in formats that read as fast.
"""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, TypeVar

import numpy as np
import orjson
from numpy.typing import NDArray

from umbra.cache.folder import drop, keep, load
from umbra.scene import Material, Mesh, Part, Scene, Source

__all__ = ["keep_scene", "load_scene"]

T = TypeVar("T")

_PLACE = ("latitude", "longitude", "elevation", "true_north", "ground")
_WIDTHS = {"vertices": 3, "faces": 3, "normals": 3, "uv": 2, "colors": 3}
_NONE = -1


def keep_scene(key: str, scene: Scene) -> None:
    """
    Keep a scene for later runs, if it is of a kind that is kept.

    Parameters
    ----------
    key : str
        Of all that the scene depends on.
    scene : Scene
    """
    if scene.lights or any(part.binding or part.material.image for part in scene.parts):
        return
    if not all(np.isfinite(getattr(scene, name) or 0.0) for name in _PLACE):
        return
    try:
        arrays = _pack(scene)
    except TypeError:  # of a text that is no Unicode, in a file's name say
        return
    keep(key, arrays)


def load_scene(key: str) -> Scene | None:
    """
    Give the scene that was kept by a key, or None.

    Parameters
    ----------
    key : str
    """
    arrays = load(key)
    if arrays is None:
        return None
    try:
        return _unpack(arrays)
    except Exception:  # noqa: BLE001 - whatever another hand wrote there
        drop(key)
        return None


class _Pool:
    """Things by number, each once: the same thing again has the same number."""

    def __init__(self) -> None:
        self.things: list[Any] = []
        self._numbers: dict[int, int] = {}

    def add(self, thing: Any) -> int:
        """Give the thing's number; -1 of None."""
        if thing is None:
            return _NONE
        number = self._numbers.setdefault(id(thing), len(self.things))
        if number == len(self.things):
            self.things.append(thing)
        return number


def _pack(scene: Scene) -> dict[str, NDArray]:
    meshes, materials, transforms = _Pool(), _Pool(), _Pool()
    table = [
        (meshes.add(part.mesh), materials.add(part.material), transforms.add(part.transform))
        for part in scene.parts
    ]
    pools = {name: _Pool() for name in _WIDTHS}
    rows = [[pools[name].add(getattr(m, name)) for name in _WIDTHS] for m in meshes.things]
    words = {
        "names": [part.name for part in scene.parts],
        "kinds": [part.kind for part in scene.parts],
        "layers": [part.layer for part in scene.parts],
        "tags": [part.tags for part in scene.parts],
        "materials": [{**asdict(one), "image": None} for one in materials.things],
        "place": {name: getattr(scene, name) for name in _PLACE},
        "crs": scene.crs,
        "sources": [asdict(source) for source in scene.sources],
        "notes": scene.notes,
    }
    arrays: dict[str, NDArray] = {
        "words": np.frombuffer(orjson.dumps(words), np.uint8),
        "origin": scene.origin,
        "parts": np.array(table, np.int64).reshape(-1, 3),
        "meshes": np.array(rows, np.int64).reshape(-1, len(_WIDTHS)),
        "transforms": np.array(transforms.things, np.float64).reshape(-1, 4, 4),
    }
    for name, width in _WIDTHS.items():
        things = pools[name].things
        arrays[name] = np.concatenate(things) if things else np.zeros((0, width))
        arrays[f"{name}_length"] = np.array([len(one) for one in things], np.int64)
    return arrays


def _unpack(arrays: dict[str, NDArray]) -> Scene:
    words = orjson.loads(arrays["words"].tobytes())
    pools = {name: _cut(arrays[name], arrays[f"{name}_length"]) for name in _WIDTHS}
    meshes = [
        Mesh(*(_pick(pools[name], number) for name, number in zip(_WIDTHS, row, strict=True)))
        for row in arrays["meshes"].tolist()
    ]
    materials = [Material(**_with_tuples(one)) for one in words["materials"]]
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
        **words["place"],
        sources=tuple(Source(**source) for source in words["sources"]),
        notes=tuple(words["notes"]),
    )


def _cut(array: NDArray, lengths: NDArray[np.int64]) -> list[NDArray]:
    """Give the pieces of an array, without copying."""
    ends = np.cumsum(lengths).tolist()
    return [array[end - length : end] for end, length in zip(ends, lengths.tolist(), strict=True)]


def _pick(things: Sequence[T], number: int) -> Any:
    return None if number == _NONE else things[number]


def _with_tuples(facts: dict[str, Any]) -> dict[str, Any]:
    return {name: tuple(v) if isinstance(v, list) else v for name, v in facts.items()}
