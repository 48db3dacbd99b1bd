"""
Ladybug's study of direct sun hours, whose rays are Radiance's (``rcontrib``).

The programs of Radiance come with the package pyradiance. A point's sun is Radiance's
source without jitter: one ray to the middle of its disc.
"""

import subprocess
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyradiance
from block import PeerSeconds, TownBlock, serve_tool
from ladybug_geometry.geometry3d import Mesh3D, Point3D, Vector3D
from ladybug_radiance.config import folders
from numpy.typing import NDArray

folders.radiance_path = str(Path(pyradiance.__file__).parent)

# After the folder is set: they look for the programs when they are imported.
from ladybug_radiance import intersection  # noqa: E402
from ladybug_radiance.study.directsun import DirectSunStudy  # noqa: E402


class _Clock:
    """Stands for ``subprocess`` and times the ray tracer among what is started."""

    PIPE = subprocess.PIPE
    seconds = 0.0

    def Popen(self, command: str, **options: Any) -> Any:  # noqa: N802
        """Run a program to its end."""
        begun = time.perf_counter()
        process = subprocess.run(command, check=False, capture_output=True, shell=True,
                                 env=options["env"])  # fmt: skip
        if intersection.RCONTRIB_EXE in command:
            self.seconds = time.perf_counter() - begun
        if process.returncode:
            msg = process.stderr.decode(errors="replace")
            raise RuntimeError(msg)
        process.communicate = lambda: (b"", process.stderr)  # type: ignore[attr-defined]
        return process


class DirectSun:
    """
    A ``DirectSunStudy`` of the block.

    Parameters
    ----------
    block : TownBlock
    """

    def __init__(self, block: TownBlock) -> None:
        self._block = block
        self.suns = block.suns
        self.name = f"Ladybug {version('ladybug-radiance')}, pyradiance {version('pyradiance')}"
        self._folder = tempfile.TemporaryDirectory()
        self._study: DirectSunStudy | None = None

    def run(self) -> PeerSeconds:
        """Make the meshes, the study, and compute it; the ray tracer's time is the calculation."""
        clock = intersection.subprocess = _Clock()
        begun = time.perf_counter()
        study = DirectSunStudy(
            [Vector3D(*-sun) for sun in self._block.suns],
            _make_ground(self._block),
            [_make_mesh(self._block.vertices, self._block.faces)],
            timestep=round(1 / self._block.hours),
            sim_folder=self._folder.name,
        )
        study.compute()
        self._study = study
        return PeerSeconds(clock.seconds, time.perf_counter() - begun)

    def find_masks(self) -> NDArray[np.bool_]:
        """Read the study's matrix, which says what is in the sun."""
        assert self._study is not None
        in_sun = np.asarray(self._study.intersection_matrix, bool)
        return ~in_sun.T.reshape(-1, *self._block.heights.shape)


def _make_mesh(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> Mesh3D:
    points = [Point3D(*vertex) for vertex in vertices.tolist()]
    return Mesh3D(points, [tuple(face) for face in faces.tolist()])


def _make_ground(block: TownBlock) -> Mesh3D:
    """Make one quadrilateral for each cell; its centre is where the sun is looked for."""
    rows, cols = block.heights.shape
    x, y = np.meshgrid(block.cell * np.arange(cols + 1), block.cell * np.arange(rows + 1))
    corner = np.arange(x.size).reshape(x.shape)
    quads = [corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]]
    vertices = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3)
    return _make_mesh(vertices, np.stack(quads, -1).reshape(-1, 4))


if __name__ == "__main__":
    serve_tool(DirectSun)
