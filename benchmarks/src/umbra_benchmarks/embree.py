"""The ray-casting peer: Embree's any-hit query through embreex, on one thread."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError

__all__ = ["OFFSET", "Embree"]

OFFSET = 1e-3
"""Ray origins stand off their surface by this along its normal [m]."""


class Embree:
    """
    A mesh in Embree's tree.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int32

    Raises
    ------
    InputError
        If embreex is not installed.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh  # noqa: PLC0415
            from embreex.rtcore_scene import EmbreeScene  # noqa: PLC0415
        except ImportError:
            msg = (
                "this benchmark compares with Embree, which is not installed; "
                "pip install 'umbra-benchmarks[embree]'"
            )
            raise InputError(msg) from None
        self._scene: Any = EmbreeScene()
        self._mesh = TriangleMesh(self._scene, vertices.astype(np.float32), faces.astype(np.int32))
        # The first query builds the tree.
        self.find_occluded(np.full((1, 3), -1e4, np.float32), np.array([[0, 0, -1]], np.float32))

    def find_occluded(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        reach: NDArray[np.float32] | None = None,
    ) -> NDArray[np.int32]:
        """
        Ask for each ray whether anything lies on it.

        Parameters
        ----------
        origins, directions : (n, 3) float32
        reach : (n,) float32, optional
            How far to look, in lengths of the direction.

        Returns
        -------
        found : (n,) int32
            0 where something does.
        """
        found: NDArray[np.int32] = self._scene.run(origins, directions, reach, query="OCCLUDED")
        return found
