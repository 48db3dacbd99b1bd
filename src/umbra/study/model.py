"""A scene made ready for study: who casts, who receives, and how that is counted."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from umbra.cpu.field import FieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.cpu.rays import FaceTree, make_face_tree
from umbra.cpu.sweep import Sweep
from umbra.scene import Scene, Triangles
from umbra.scene.grid import Grid
from umbra.study.receivers import Places, Surface, find_surface
from umbra.volume.adjacency import Caster, make_caster

__all__ = ["Model", "prepare_model"]


@dataclass(frozen=True, eq=False)
class Model:
    """
    Casters and receivers of a plan.

    Parameters
    ----------
    soup : Triangles
        All that is seen from above.
    caster : Caster
        What casts.
    receivers : {'ground', 'top'}
    ground : float
        z of the ground, local frame [m].
    threads : int
    """

    soup: Triangles
    caster: Caster
    receivers: str
    ground: float
    threads: int

    def make_sweep(self, grid: Grid) -> tuple[Surface, Sweep]:
        """
        Look at a raster from above and make ready to count on it.

        On a plane by crossings, on anything else by spans.

        Parameters
        ----------
        grid : Grid
            Local frame.

        Returns
        -------
        surface : Surface
        sweep : Sweep
        """
        surface = find_surface(self.soup, grid, self.ground, self.threads)
        if self.receivers == "ground":
            return surface, PlaneSweep(self.caster, grid, self.ground, self.threads)
        sweep = FieldSweep(self.caster, grid, surface.heights, self.threads, surface.slopes)
        return surface, sweep

    @cached_property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""
        return make_face_tree(self.caster)

    def find_places(self, grid: Grid, surface: Surface) -> Places:
        """
        Give the cells' centres on the receiver.

        Parameters
        ----------
        grid : Grid
            Local frame.
        surface : Surface
            Of this grid.
        """
        x, y = np.meshgrid(grid.x, grid.y)
        is_ground = self.receivers == "ground"
        z = np.full(x.shape, self.ground) if is_ground else surface.heights
        normals = np.zeros((x.size, 3))
        normals[:, 2] = 1.0
        if not is_ground:
            slopes = surface.slopes
            normals[slopes.cells] = slopes.planes[:3, slopes.face].T
        return Places(np.stack([x, y, z], -1).reshape(-1, 3), normals)


def prepare_model(
    scene: Scene, casters: list[int], receivers: str, ground: float, threads: int
) -> Model:
    """
    Find the adjacency of what casts.

    Parameters
    ----------
    scene : Scene
    casters : list of int
        Indices of the parts that cast.
    receivers : {'ground', 'top'}
    ground : float
        Local frame [m].
    threads : int
    """
    everything = scene.triangles()
    soup = everything if len(casters) == len(scene.parts) else scene.triangles(casters)
    caster = make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])
    return Model(everything, caster, receivers, ground, threads)
