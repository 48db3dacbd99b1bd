"""
Counting on a plan where casters hang over receivers.

A plan's sweep takes its receivers to be topmost, and to lie a hair to the east and north of
the cells' centres. Where canopies, which are looked through, are above them, or there is
nothing on that side, the way to each sun is tried instead, with the same rules.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.study.receivers import Places

__all__ = ["BeneathSweep"]


class BeneathSweep:
    """
    Count shadows on a plan, sun after sun; a ``Counter``.

    Parameters
    ----------
    sweep : Counter
        Right in all other cells, on any device.
    cells : (n,) int
        Flat indices of the cells that rays count.
    tree : FaceTree
        Of what casts.
    places : Places
        Of these cells.
    threads : int
    attached : bool
        Whether a cell that is turned from the sun is in shadow.
    """

    def __init__(
        self,
        sweep: Any,
        cells: NDArray[np.intp],
        tree: FaceTree,
        places: Places,
        threads: int,
        *,
        attached: bool = True,
    ) -> None:
        self.sweep, self.cells, self.tree, self.places = sweep, cells, tree, places
        self.threads, self.attached = threads, attached

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Tell for each sun which cells are in shadow, (n, rows, cols) uint8."""
        masks = self.sweep.masks(suns)
        masks.reshape(len(suns), -1)[:, self.cells] = self._find(suns)
        return masks

    def add_steps(
        self,
        suns: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Count for each cell how many suns leave it in shadow."""
        beneath = steps.ravel()[self.cells]
        for first in range(0, len(suns), 64):
            beneath += self._find(suns[first : first + 64]).sum(0, dtype=np.int32)
        self.sweep.add_steps(suns, steps, progress)
        steps.reshape(-1)[self.cells] = beneath

    def _find(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        where = self.places
        return find_hidden(
            self.tree, where.points, where.normals, suns, self.threads,
            attached=self.attached,
        )  # fmt: skip
