"""Checks that readers share: missing packages, damage, and the memory a file may take."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.scene import Part

__all__ = ["Budget", "check_soup", "describe_damage", "errors_of", "list_counts", "need", "require"]


@contextmanager
def errors_of(what: str, **data: object) -> Iterator[None]:
    """Prefix the message of an `InputError` with its subject, and add facts."""
    try:
        yield
    except InputError as error:
        msg = f"{what}{error}"
        raise InputError(msg, **{**error.data, **data}) from error


def need(module: str, extra: str, what: str) -> Any:
    """Import a package of an extra that a format needs; an error says how to install it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise _miss(module.partition(".")[0], extra, what, str(error)) from error


def require(package: str, extra: str, what: str) -> None:
    """Check that a package of an extra is installed, as `need`, without importing it."""
    try:
        found = find_spec(package)
    except ValueError:  # a module of this name was loaded from nowhere
        found = None
    if found is None:
        raise _miss(package, extra, what, f"no module named '{package}'")


def _miss(package: str, extra: str, what: str, reason: str) -> InputError:
    msg = (
        f"{what} needs the package {package}, which is not installed here ({reason}); "
        f"install it with: pip install 'umbra-shadows[{extra}]'"
    )
    return InputError(msg, package=package, extra=extra)


def list_counts(counts: Mapping[str, int]) -> tuple[str, ...]:
    """Return notes on what was left out, from the number of each."""
    return tuple(f"{what}: {count}" for what, count in counts.items() if count)


def describe_damage(error: BaseException) -> str:
    """Describe the damage of a file in a line, from the error that its values raised."""
    if isinstance(error, KeyError):
        return f"{str(error.args[0] if error.args else '')[:60]!r} is missing or unknown"
    if isinstance(error, IndexError):
        return "an index is out of range, or a list is too short"
    if isinstance(error, (AttributeError, TypeError)):
        return "a value has the wrong type"
    return " ".join(str(error).split())[:120] or "it breaks off"


LEAST = 1 << 28  # [byte]; what any file may take
FACTOR = 64  # for each byte of a file
SHARE = 0.5  # of the memory
CORNER = 2 * 24  # [byte] of a vertex, copied once as the parts are joined
FACE = 2 * 12
MOST = 2**31 - 1  # vertices and triangles that int32 can number


class Budget:
    """The memory that one file of so many bytes may take."""

    def __init__(self, size: int = 0) -> None:
        self._size = size
        self._spent = 0

    def grow(self, size: int) -> None:
        """Count another file's bytes."""
        self._size += size

    def spend(self, size: int, what: str) -> None:
        """Take memory [byte], before it is used; refuse what the file's size cannot justify."""
        self._spent += size
        limit = min(max(LEAST, FACTOR * self._size), SHARE * find_memory())
        if self._spent > limit:
            msg = (
                f"{what}: {self._spent / 1e9:,.1f} GB of memory in all are more than a file of "
                f"{self._size / 1e6:,.1f} MB may take ({limit / 1e9:,.1f} GB, {FACTOR} times its "
                "size if that is more); export it again, in pieces"
            )
            raise InputError(msg, needed=self._spent, limit=limit)


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
