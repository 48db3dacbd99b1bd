"""Files to scenes: CityJSON, glTF, OBJ, PLY, STL and OFF."""

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.formats import FORMATS, find_reader
from umbra.readers.georeference import locate, to_metres
from umbra.readers.model import Model
from umbra.scene import Light, Part, Scene, Source, make_scene

__all__ = ["read"]

FARTHEST = 1e10  # [m]; beyond it a coordinate is damage or another unit

UPS = ("x", "y", "z")


def read(*paths: str | os.PathLike[str], up: str | None = None) -> Scene:
    """
    Read one scene from one or more files.

    The format is told by the file's content, then by its name's ending. A CRS in
    degrees or feet is turned into the local UTM zone in metres; one that is not
    known leaves the coordinates as they are, with a note.

    Parameters
    ----------
    *paths : str or path
        CityJSON 1.0, 1.1, 2.0 and sequences of it, glTF and GLB, OBJ, PLY, STL,
        OFF. Several become one scene about one local origin.
    up : {'x', 'y', 'z'}, optional
        The file's axis that points up: z by default, y in glTF.

    Returns
    -------
    scene : Scene
        With the files' names, SHA-256 and formats in ``sources`` and whatever was
        left out in ``notes``.

    Raises
    ------
    InputError
        If a file is missing, damaged, empty or of a format that is not read; if
        it holds no triangles or coordinates that are not finite; if the files'
        coordinate reference systems differ.
    """
    if not paths:
        msg = f"no file given; name one or more of {FORMATS}"
        raise InputError(msg)
    if up is not None and up not in UPS:
        msg = f"the up axis must be x, y or z; got {up!r}"
        raise InputError(msg, up=up)
    # Damaged numbers may overflow on the way to the check that names them.
    with np.errstate(all="ignore"), _pause_collection():
        models: list[Model] = []
        sources: list[Source] = []
        for path in map(Path, paths):
            model, source = _read_one(path, up)
            models.append(model)
            sources += [source, *model.companions]
        named = {model.crs: str(path) for model, path in zip(models, paths) if model.crs}
        if len(named) > 1:
            (one, first), (other, second) = list(named.items())[:2]
            msg = (
                f"{first} is in {one} but {second} is in {other}; "
                "convert them to one coordinate reference system"
            )
            raise InputError(msg, crs=tuple(named))
        parts = tuple(part for model in models for part in model.parts)
        notes = tuple(note for model in models for note in model.notes)
        lights = tuple(light for model in models for light in model.lights)
        return _assemble(parts, next(iter(named), None), tuple(sources), notes, lights, paths)


@contextmanager
def _pause_collection() -> Iterator[None]:
    """Stop looking for cycles: parsers make millions of lists and no cycle."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _assemble(
    parts: tuple[Part, ...],
    crs: str | None,
    sources: tuple[Source, ...],
    notes: tuple[str, ...],
    lights: tuple[Light, ...],
    paths: tuple[str | os.PathLike[str], ...],
) -> Scene:
    names = ", ".join(str(path) for path in paths)
    try:
        metric, metric_crs = to_metres(parts, crs)
        if metric_crs != crs:
            notes = (*notes, f"coordinates were converted from {crs} to {metric_crs}")
        scene = make_scene(metric, crs=metric_crs, sources=sources, notes=notes, lights=lights)
        bounds = scene.bounds()
        _check_size(bounds)
        return locate(scene, bounds)
    except InputError as error:
        msg = f"{names}: {error}"
        raise InputError(msg, **error.data) from error


def _check_size(bounds: NDArray[np.float64]) -> None:
    far = float(np.abs(bounds).max())
    # Numbers near the largest overflow to NaN on the way here, which is not below either.
    if not far <= FARTHEST:
        reach = f"{far:g}" if np.isfinite(far) else f"more than {FARTHEST:g}"
        msg = f"coordinates reach {reach} m from zero; the file is damaged or in another unit"
        raise InputError(msg, far=far)


def _check_triangles(model: Model) -> None:
    if not any(part.triangles for part in model.parts):
        left_out = f" ({'; '.join(model.notes)})" if model.notes else ""
        msg = f"has no triangles{left_out}; export the model with its surfaces"
        raise InputError(msg)


def _read_one(path: Path, up: str | None) -> tuple[Model, Source]:
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        msg = f"{path}: no such file; check the name"
        raise InputError(msg, path=path) from error
    except IsADirectoryError as error:
        msg = f"{path}: is a folder; name a file in it ({FORMATS})"
        raise InputError(msg, path=path) from error
    except (OSError, ValueError) as error:
        # ValueError: a name with a null byte.
        reason = getattr(error, "strerror", None) or error
        msg = f"{path}: cannot be read ({reason}); check the name and its permissions"
        raise InputError(msg, path=path) from error
    if not data.strip():
        msg = f"{path}: is empty; export the model again"
        raise InputError(msg, path=path)
    try:
        model = find_reader(data, path)(data, path, up)
        _check_triangles(model)
    except InputError as error:
        msg = f"{path}: {error}"
        raise InputError(msg, path=path, **error.data) from error
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # Readers name the damage they know; this is for what no one foresaw.
        reason = " ".join(str(error).split())[:200]
        msg = f"{path}: is damaged ({type(error).__name__}: {reason}); export it again"
        raise InputError(msg, path=path) from error
    except (MemoryError, RecursionError, AssertionError) as error:
        msg = f"{path}: is damaged or too large for memory; export it again"
        raise InputError(msg, path=path) from error
    notes = tuple(f"{path.name}: {note}" for note in model.notes)
    source = Source(path.name, sha256(data).hexdigest(), model.format)
    return replace(model, notes=notes), source
