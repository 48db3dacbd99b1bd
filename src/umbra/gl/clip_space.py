"""Clip spaces, umbra's own or a caller's: how depth runs, and whether the picture is mirrored."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["ClipSpace"]


@dataclass(frozen=True)
class ClipSpace:
    """
    A clip space as OpenGL's state must match it.

    Parameters
    ----------
    is_reversed : bool
        Depth is largest at the near plane.
    is_zero_to_one : bool
        Depth is from 0 to w; else from -w to w.
    is_mirrored : bool
        Triangles wind the other way in the picture.
    """

    is_reversed: bool = False
    is_zero_to_one: bool = False
    is_mirrored: bool = False

    @property
    def near_plane(self) -> NDArray[np.float32]:
        """Factors (2,) of z and w, whose sum is the distance behind the near plane."""
        if self.is_reversed:
            return _BEHIND_REVERSED
        return _BEHIND_ZERO if self.is_zero_to_one else _BEHIND


_BEHIND_REVERSED, _BEHIND_ZERO, _BEHIND = (
    np.array(factors, np.float32) for factors in ((-1.0, 1.0), (1.0, 0.0), (0.5, 0.5))
)
