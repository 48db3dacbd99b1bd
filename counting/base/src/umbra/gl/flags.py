"""Which faces of each shadow volume are drawn under one light, as bits for kernels."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "COARSE", "CUT", "DARK_CAP", "DRAWS", "FAN", "LIGHT_CAPS", "LOW", "SIDES", "Z_FAILS",
    "VolumeSelection",
]  # fmt: skip

SIDES, Z_FAILS, CUT, FAN, DARK_CAP, LIGHT_CAPS, COARSE, LOW = (
    np.uint8(1 << bit) for bit in range(8)
)
"""Bits of `VolumeSelection.flags`."""

DRAWS = (
    ("sides_z_pass", False), ("sides_z_fail", False), ("dark_cap", False),
    ("sides_z_pass", True), ("sides_z_fail", True), ("dark_cap", True),
    ("light_cap", False),
    ("coarse_z_pass", False), ("coarse_z_fail", False),
    ("coarse_z_pass", True), ("coarse_z_fail", True),
    ("low", True),
)  # fmt: skip
"""Kinds of faces, and whether their volumes are cut, in the order in which they are drawn."""


@dataclass(frozen=True, eq=False)
class VolumeSelection:
    """
    Faces to draw of each shell's volume under one light.

    Parameters
    ----------
    flags : (n_shells,) uint8
        Bits: ``SIDES`` in view; ``Z_FAILS``, counted behind the visible surface rather than in
        front of it; ``CUT``, ends at the floor rather than at infinity; ``FAN``, a fan over the
        silhouette closes the far end; ``DARK_CAP`` and ``LIGHT_CAPS``, drawn;
        ``COARSE``, a level of detail, in no depth buffer: its caps are drawn as its sides;
        ``LOW``, begins just above the receivers below all casters, closed by a fan.
    case : (n_shells,) int8
        McGuire's; 0 where culled.
    moved : float
        How far any corner of the levels of detail moves at most [m].
    start : int
        Count at the near rectangle of the shells counted from there, though of case 2 or 3.
    top : float
        z, relative to the scene's origin, at which ``LOW`` volumes begin [m].
    """

    flags: NDArray[np.uint8]
    case: NDArray[np.int8]
    start: int = 0
    moved: float = 0.0
    top: float = 0.0

    def find(self, bit: np.uint8) -> NDArray[np.bool_]:
        """Return the shells (n_shells,) whose bit is set."""
        return (self.flags & bit) != 0

    @cached_property
    def sides(self) -> NDArray[np.bool_]:
        """Shells whose volumes are in view, (n_shells,) bool."""
        return self.find(SIDES)

    @cached_property
    def shells(self) -> NDArray[np.intp]:
        """Numbers of the shells in view, ascending."""
        return np.flatnonzero(self.flags)

    def find_bodies(self, starts: NDArray[np.intp]) -> list[int]:
        """List the bodies of the shells in view; body k's begin at ``starts[k]``."""
        if not len(self.shells):
            return []
        if len(starts) == 2:
            return [0]
        return np.unique(np.searchsorted(starts, self.shells, "right") - 1).tolist()
