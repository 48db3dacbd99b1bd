"""Counter of a plan with cells that only rays can count."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.rays.masks import add_masks
from umbra.scene.grid import Places

__all__ = ["CoveredSweep"]


class CoveredSweep:
    """
    Counter of a plan, by a sweep and by rays for covered and rim cells.

    A sweep assumes topmost receivers, slightly east and north of the cells' centres. Cells
    below canopies, which are seen through, or without a surface on that side are counted by
    rays to each sun instead, with the same rules.

    Parameters
    ----------
    sweep : Counter
        Counter of all other cells, on any device.
    cells : (n,) int
        Flat indices of the cells that rays count.
    tree : FaceTree
        Over the casting faces.
    places : Places
        Of these cells.
    threads : int
    attached : bool
        Whether a cell that faces away from the sun is in shadow.
    """

    def __init__(
        self, sweep: Any, cells: NDArray[np.intp], tree: FaceTree, places: Places, threads: int,
        *, attached: bool = True,
    ) -> None:  # fmt: skip
        self.sweep, self.cells, self.tree, self.places = sweep, cells, tree, places
        self.threads, self.attached = threads, attached

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the cells in shadow, (n, rows, cols) uint8."""
        masks = self.sweep.masks(suns)
        masks.reshape(len(suns), math.prod(masks.shape[1:]))[:, self.cells] = self._find(suns)
        return masks

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each cell the weights (n, k) of the suns that leave it in shadow."""
        flat = sums.reshape(len(sums), -1)
        covered = flat[:, self.cells]
        add_masks(self._find, suns, weights, covered, at_once=64)
        self.sweep.add_weights(suns, weights, sums, progress)
        flat[:, self.cells] = covered

    def _find(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        where = self.places
        return find_hidden(
            self.tree, where.points, where.normals, suns, self.threads,
            attached=self.attached,
        )  # fmt: skip
