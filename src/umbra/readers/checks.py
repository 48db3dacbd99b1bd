"""
Checks that readers share: damage, memory, and files that a model names.

Untrusted models can name any file. So only regular files of bounded size, in the model's own
folder and below, are opened, and all of them here.
"""

import io
import os
import re
import stat
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, UmbraError
from umbra.machine import find_memory, name_memory
from umbra.readers.budget import Budget
from umbra.scene import Image, Part

__all__ = [
    "Companions",
    "Losses",
    "OutsideError",
    "check_soup",
    "damage_of",
    "describe_damage",
    "encoded_image",
    "errors_of",
    "find_reason",
    "image_beside",
    "list_counts",
    "read_bounded",
]

ALLOW = "allow_outside=True reads it"
FILE_SHARE = 0.25  # of the memory: reading a file takes several times its size

_BLOCK = 1 << 24
_LONGEST = 4096  # characters of a name; no system opens longer ones
_POINTER = b"version https://git-lfs"
# A pipe would wait for a writer; a link may be swapped in after the check.
_FLAGS = (
    os.O_RDONLY
    | getattr(os, "O_NOFOLLOW", 0)
    | getattr(os, "O_NONBLOCK", 0)
    | getattr(os, "O_BINARY", 0)
)


@contextmanager
def errors_of(what: str, **data: object) -> Iterator[None]:
    """Prefix the message of an `InputError` of any kind with its subject, and add facts."""
    try:
        yield
    except InputError as error:
        msg = f"{what}{error}"
        raise type(error)(msg, **{**error.data, **data}) from error


class Losses(Counter[str]):
    """Numbers of what was left out, and the first object of each kind of loss."""

    def __init__(self) -> None:
        super().__init__()
        self.first: dict[str, str] = {}

    def add(self, what: str, name: str, count: int = 1) -> None:
        """Count a loss of an object."""
        self[what] += count
        self.first.setdefault(what, name)

    def merge(self, other: "Losses") -> None:
        """Add later losses."""
        for what, count in other.items():
            self[what] += count
        self.first = {**other.first, **self.first}


def list_counts(counts: Mapping[str, int]) -> tuple[str, ...]:
    """Return notes on losses, from the number of each; the first is named if it is known."""
    first = counts.first if isinstance(counts, Losses) else {}
    return tuple(
        f"{what}: {count}" + (f" (first: '{first[what][:80]}')" if what in first else "")
        for what, count in counts.items()
        if count
    )


def describe_damage(error: BaseException) -> str:
    """Describe the damage of a file in a line, from the error that its values raised."""
    if isinstance(error, KeyError):
        return f"{str(error.args[0] if error.args else '')[:60]!r} is missing or unknown"
    if isinstance(error, IndexError):
        return "an index is out of range, or a list is too short"
    if isinstance(error, (AttributeError, TypeError)):
        return "a value has the wrong type"
    return find_reason(error) or "it breaks off"


_CLASS = re.compile(
    r"(?<![\w.])(?:\w+(?:\.|::))*\w*(?:Exception|Error)\b:?\s*|<[\w.]+ object at [^>]*>"
)


def find_reason(error: BaseException, longest: int = 120) -> str:
    """Return what a library says of a file, in one line, without the names of its classes."""
    text = str(getattr(error, "msg", None) or error)
    return " ".join(_CLASS.sub("", text).split())[:longest].rstrip(" :;,.")


@contextmanager
def damage_of(what: object, **data: object) -> Iterator[None]:
    """
    Make one `InputError`, with the file's name, of whatever reading a file raises.

    Readers report the damage that they know. Their libraries raise kinds of their own, of which
    no list is complete, so this is the one place where all of them end.
    """
    try:
        with errors_of(f"{what}: ", **data):
            yield
    except UmbraError:
        raise
    except (MemoryError, RecursionError, AssertionError) as error:
        msg = f"{what}: is damaged or too large for memory; export it again"
        raise InputError(msg, **data) from error
    except Exception as error:
        msg = f"{what}: is damaged ({describe_damage(error)}); export it again"
        raise InputError(msg, **data) from error


CORNER = 2 * 24  # [byte] of a vertex, with a copy made in joining parts
FACE = 2 * 12
MOST = 2**31 - 1  # vertices and triangles that int32 can number


def check_soup(parts: Sequence[Part]) -> None:
    """Refuse parts whose instances need more than the memory."""
    shared: set[int] = set()
    vertices = triangles = instances = 0
    for part in parts:
        triangles += part.triangles
        instances += part.transform is not None
        if part.transform is not None or id(part.mesh.vertices) not in shared:
            vertices += len(part.mesh.vertices)
            shared.add(id(part.mesh.vertices))
    needed, held = CORNER * vertices + FACE * triangles, find_memory()
    if needed > held or max(vertices, triangles) > MOST:
        msg = (
            f"its {len(parts):,} parts, {instances:,} of them placed, have {triangles:,} triangles "
            f"and {vertices:,} vertices, which need {needed / 1e9:,.0f} GB; "
            f"{name_memory(held)}, and {MOST:,} is the most of either: leave instances out"
        )
        raise InputError(msg, needed=needed, triangles=triangles)


def _check_length(name: str) -> None:
    if len(name) > _LONGEST:
        msg = "a name is too long"
        raise ValueError(msg)


class OutsideError(InputError):
    """A model names a file outside its own folder."""


class Companions:
    """The files beside one model; regular files anywhere if outside ones are allowed."""

    def __init__(
        self, path: Path, budget: Budget | None = None, *, allow_outside: bool = False
    ) -> None:
        self.path = path
        self._budget = budget or Budget()
        self._allow_outside = allow_outside
        #: SHA-256 of each file, by its name in the model; None if it was not read.
        self.record: dict[str, str | None] = {}

    def find(self, name: str) -> Path:
        """Find a regular file by its name in the model, without opening it; links are followed."""
        self._budget.find_file()
        self.record[name] = None
        shown = " ".join(name[:_LONGEST].split())[:80]
        try:
            _check_length(name)
            folder = self.path.parent.resolve()
            real = (folder / name).resolve()
            if not (self._allow_outside or real.is_relative_to(folder)):
                msg = f"'{shown}' lies outside the model's folder; put it there, or {ALLOW}"
                raise OutsideError(msg, companion=name)
            mode = real.lstat().st_mode
        except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: circular links
            if isinstance(error, InputError):
                raise
            msg = f"'{shown}' is not beside the file; keep both together"
            raise InputError(msg, companion=name) from error
        if not stat.S_ISREG(mode):
            msg = f"'{shown}' is not a regular file (a folder, a device or a pipe); export it again"
            raise InputError(msg, companion=name)
        return real

    def read(self, name: str, most: float | None = None) -> bytes:
        """Read a file of at most ``most`` bytes, by default a share of the memory."""
        real = self.find(name)
        try:
            with (
                open(os.open(real, _FLAGS), "rb") as file,  # noqa: PTH123 - a descriptor
                errors_of(f"'{real.name[:80]}' ", companion=name),
            ):
                data = read_bounded(file, most)
                if data.startswith(_POINTER):
                    msg = "is a Git LFS pointer, not the file; run git lfs pull"
                    raise InputError(msg)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            msg = f"'{real.name[:80]}' cannot be read ({reason}); check its permissions"
            raise InputError(msg, companion=name) from error
        self._budget.grow(real, len(data))
        self.record[name] = sha256(data).hexdigest()
        return data

    def look(self, name: str, *, is_read: bool) -> str:
        """
        Return a file's current fingerprint.

        ``is_read``: whether the scene depends on its content, or only on whether it could be read.
        """
        try:
            if is_read:
                return sha256(self.read(name)).hexdigest()
            status = self.find(name).stat()
        except (InputError, OSError) as error:
            return str(error)
        return f"{status.st_size} {status.st_mtime_ns}"

    def check_beside(self) -> None:
        """Check files with the model's name and other endings, which a library will open."""
        with os.scandir(self.path.parent) as entries:
            beside = [
                entry.name for entry in entries if entry.name.startswith(f"{self.path.stem}.")
            ]
        for name in sorted({*beside} - {self.path.name}):
            other = self.path.parent / name
            if other.exists() and not other.is_dir():
                self.find(name)


def read_bounded(file: BinaryIO, most: float | None = None) -> bytes:
    """Read an open file of bounded size; also a pipe, whose size is unknown."""
    limit = FILE_SHARE * find_memory() if most is None else most
    status = os.fstat(file.fileno())
    size = status.st_size
    blocks = []
    if stat.S_ISREG(status.st_mode) and size <= limit:
        blocks.append(file.read())
        size = len(blocks[0])
    while not stat.S_ISREG(status.st_mode) and size <= limit:
        blocks.append(file.read(_BLOCK))
        size += len(blocks[-1])
        if not blocks[-1]:
            break
    if size > limit:
        msg = f"is larger than {limit / 1e6:,.0f} MB, the most that is read here; cut it to less"
        raise InputError(msg, most=limit)
    return b"".join(blocks)


REPEAT = ("repeat", "repeat")
LARGEST = 1 << 28  # [byte] of a picture's file

# Not all that Pillow opens: for PostScript it would run a program.
FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA", "GIF", "TIFF", "DDS", "PPM", "JPEG2000")


def encoded_image(
    name: str,
    fetch: Callable[[], bytes],
    wrap: tuple[str, str] = REPEAT,
    **more: Any,
) -> Image:
    """Make an image that is read and decoded on first access to its pixels; ``more`` as `Image`."""
    return Image(name, lambda: _decode(name, fetch), wrap, **more)


def image_beside(
    companions: Companions, file: str, wrap: tuple[str, str] = REPEAT, **more: Any
) -> Image:
    """Make an image of an existing file beside a model."""
    companions.find(file)  # raises now; checked again when read
    name = f"{companions.path.name}: {file}"[:120]
    return encoded_image(name, lambda: companions.read(file, LARGEST), wrap, **more)


def _decode(name: str, fetch: Callable[[], bytes]) -> NDArray[np.uint8]:
    import PIL.Image  # noqa: PLC0415 - only where a texture is drawn

    try:
        with errors_of("texture ", texture=name):
            data = fetch()
        with PIL.Image.open(io.BytesIO(data), formats=FORMATS) as picture:
            return np.array(picture.convert("RGBA"))
    except InputError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError, PIL.Image.DecompressionBombError) as error:
        reason = " ".join(str(error).replace("<_io.BytesIO object at ", "<").split())[:100]
        if isinstance(error, PIL.UnidentifiedImageError):
            reason = "its image format is unknown"
        msg = f"texture '{name}' cannot be read ({reason}); export it as PNG or JPEG"
        raise InputError(msg, texture=name) from error
