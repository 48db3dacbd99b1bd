"""
Isolated convex casters: their shadow meets no other caster but falls on what lies below them all.

Such a volume is empty down to there, and all it counts above are its caster's own faces turned
from the light, which get none anyway. So it may begin just above, closed by a fan: that of a ball
over the ground then fills a fraction of the pixels. A caster that another's shadow meets is not
isolated either: where its smooth normals lean to the light, a count of 1 says that no other shades
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.flags import CUT, LOW, SIDES, VolumeSelection

__all__ = ["IsolatedCasters"]

_MOST = 512
"""More shells than take a millisecond to compare with each other are not compared."""


@dataclass(frozen=True, eq=False)
class IsolatedCasters:
    """
    What tells which shells are isolated under a light, while they stand still.

    Parameters
    ----------
    balls : (n_shells, 4) float64
        Middle, relative to the scene's origin, and radius of a ball around each shell [m].
    can_be : (n_shells,) bool
        Convex shells that end above ``top``.
    top : float
        z above every receiver that does not cast, relative to the origin [m].
    """

    balls: NDArray[np.float64]
    can_be: NDArray[np.bool_]
    top: float

    @classmethod
    def of(
        cls, bodies: Sequence[Body], bounds: NDArray[np.float64], top: float
    ) -> "IsolatedCasters":
        """Measure the shells of bodies, whose boxes ``bounds`` (n_shells, 2, 3) are."""
        convex: list[NDArray[np.bool_]] = [np.zeros(0, np.bool_)]
        reach: list[NDArray[np.float64]] = [np.zeros(0)]
        if len(bounds) > _MOST:
            return cls(np.zeros((0, 4)), np.zeros(len(bounds), np.bool_), top)
        for body in bodies:
            count = np.bincount(body.component_shell, minlength=body.n_shells)
            dented = np.bincount(body.component_shell, ~body.is_convex, body.n_shells)
            is_convex = (count == 1) & (dented == 0)
            convex.append(np.tile(is_convex, len(body.transforms)))
            reach.append(np.full(len(convex[-1]), np.inf))
            if is_convex.any():
                axes = body.transforms[:, :3, :3]
                stretch = np.sqrt(np.abs(axes.transpose(0, 2, 1) @ axes).sum(2).max(1))  # or less
                reach[-1] = np.outer(stretch, body.radii).ravel()
        middle, half = bounds.mean(1), (bounds[:, 1] - bounds[:, 0]) / 2
        radius = np.minimum(np.linalg.norm(half, axis=1), np.concatenate(reach))
        can_be = np.concatenate(convex) & (bounds[:, 0, 2] > top)
        return cls(np.column_stack([middle, radius]), can_be, top)

    def shorten(self, selection: VolumeSelection, light: NDArray[np.float64]) -> VolumeSelection:
        """Return a light's selection in which the volumes of isolated casters are ``LOW``."""
        is_cut = (selection.flags & (SIDES | CUT)) == (SIDES | CUT)
        wanted = is_cut & (selection.case == 1) & self.can_be
        if not wanted.any():
            return selection
        isolated = _find_isolated(self.balls, light, wanted)
        flags = selection.flags | np.where(isolated, LOW, np.uint8(0))
        return replace(selection, flags=flags, top=self.top)


@njit(cache=True, nogil=True)
def _find_isolated(balls, light, wanted):
    """Find the wanted balls whose shadow under a light meets no ball, and which none shades."""
    n, is_point = balls.shape[0], light[3] != 0.0
    holds = np.zeros(n, np.bool_)
    ways, sines, cosines = np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    for i in range(n):
        way = ways[i]
        way[:] = balls[i, :3]
        if is_point:
            way -= light[:3]
            distance = max(np.sqrt((way**2).sum()), 1e-300)
            holds[i] = distance <= balls[i, 3]
            way /= distance
            sines[i] = min(balls[i, 3] / distance, 1.0)
            cosines[i] = np.sqrt(1.0 - sines[i] ** 2)
        else:
            way -= (way * light[:3]).sum() * light[:3]
    isolated = wanted.copy()
    for i in range(n):
        if not wanted[i]:
            continue
        for j in range(n):
            if j == i:
                continue
            if is_point:
                cosine = ways[i, 0] * ways[j, 0] + ways[i, 1] * ways[j, 1] + ways[i, 2] * ways[j, 2]
                # A caster whose ball holds the lamp may stand in any direction.
                meets = holds[i] or holds[j]
                meets |= cosine >= cosines[i] * cosines[j] - sines[i] * sines[j]
            else:
                x, y, z = ways[i, 0] - ways[j, 0], ways[i, 1] - ways[j, 1], ways[i, 2] - ways[j, 2]
                meets = x * x + y * y + z * z <= (balls[i, 3] + balls[j, 3]) ** 2
            if meets:
                isolated[i] = False
                break
    return isolated
