"""How much memory reading a file may take: few bytes that multiply are refused before."""

from collections.abc import Sequence

from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.scene import Part

__all__ = ["Budget", "check_soup"]

LEAST = 1 << 28  # [byte]; what any file may take
FACTOR = 64  # for each byte of a file
SHARE = 0.5  # of the memory
CORNER = 2 * 24  # [byte] of a vertex, copied once as the parts are joined
FACE = 2 * 12
MOST = 2**31 - 1  # vertices and triangles that int32 can number


class Budget:
    """
    The memory that one file may take.

    Parameters
    ----------
    size : int
        Of the file [byte].
    """

    def __init__(self, size: int = 0) -> None:
        self._size = size
        self._spent = 0

    def grow(self, size: int) -> None:
        """Count another file's bytes."""
        self._size += size

    def spend(self, size: int, what: str) -> None:
        """
        Take memory, before it is used.

        Parameters
        ----------
        size : int
            [byte]
        what : str
            For errors.

        Raises
        ------
        InputError
            If the file has taken more than its size can justify.
        """
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
    """
    Refuse parts whose instances multiply to more than memory holds.

    Raises
    ------
    InputError
        Says how many triangles there are, and what they would take.
    """
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
