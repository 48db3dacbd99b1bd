"""
Pixels of an orthographic view, as samples of the planes that are seen.

The pixels of one plane are a regular grid along the view's axes, so that patches count them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patches import Patches, make_patches
from umbra.kernels import kernel
from umbra.rays.depth import GROUND, NOTHING
from umbra.rays.face_tree import FaceTree
from umbra.receivers.samples import join_coplanar
from umbra.scene import Camera, Scene, Triangles
from umbra.scene.grid import Places
from umbra.volume.adjacency import Caster, weld_vertices

__all__ = ["PixelCounter", "SeenPlanes", "make_pixel_patches", "snap_to_faces"]


@dataclass(frozen=True, eq=False)
class SeenPlanes:
    """
    Seen pixels, and the triangles on which they lie: a ``PatchSource``.

    Parameters
    ----------
    points, normals : (n, 3) float64
        In the scene's local frame [m]; normals of the side that is seen.
    triangle : (n,) int64
    corners : (n_triangles, 3, 3) float64
        Wound counter-clockwise as they are seen.
    owner : (n_triangles,) int64
        Plane of each triangle; ascending.
    axes : (n_planes, 2, 3) float64
        The view's axes to the right and up.
    start : (n_planes, 2) float64
        First pixel's centre along these axes [m].
    spacing : float
        Side of a pixel [m].
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    triangle: NDArray[np.int64]
    corners: NDArray[np.float64]
    owner: NDArray[np.int64]
    axes: NDArray[np.float64]
    start: NDArray[np.float64]
    spacing: float

    def pick_normals(self, which: NDArray[np.integer]) -> NDArray[np.float64]:
        """Return the normals of some pixels."""
        return self.normals[which]


def make_pixel_patches(
    places: Places,
    face: NDArray[np.integer],
    camera: Camera,
    soup: Triangles,
    scene: Scene,
    ground: float | None,
    tree: FaceTree,
) -> Patches:
    """
    Arrange the pixels of an orthographic view in patches; their indices are those of the pixels.

    Parameters
    ----------
    places : Places
        All pixels, row 0 lowest; local frame.
    face : (n,) int
        Index in ``soup`` of the triangle that each pixel shows, ``GROUND`` or ``NOTHING``.
    camera : Camera
    soup : Triangles
    scene : Scene
        For the origin of the local frame.
    ground : float, optional
        z of the visible ground, in the model's own coordinates [m].
    tree : FaceTree
        Hierarchy over the casting faces.
    """
    seen = np.flatnonzero(face != NOTHING)
    used, triangle = np.unique(face[seen], return_inverse=True)
    right, up, forward = camera.axes()
    # The ground is a triangle of its own, behind all others.
    z = 0.0 if ground is None else ground - scene.origin[2]
    vertices = np.concatenate([soup.vertices, [(0.0, 0.0, z), (1.0, 0.0, z), (0.0, 1.0, z)]])
    last = len(soup.vertices)
    faces = np.concatenate([soup.faces, [(last, last + 1, last + 2)]])
    part = np.append(soup.part, -1)
    used = np.where(used == GROUND, len(soup.faces), used)
    faces, part = weld_vertices(vertices)[faces[used]], part[used]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_back = normals @ forward > 0
    normals[is_back] *= -1
    corners[is_back] = corners[is_back][:, ::-1]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    owner, _ = join_coplanar(faces, normals, part)
    order = np.argsort(owner, kind="stable")
    rank = np.argsort(order)  # of each triangle in this order
    count = int(owner.max(initial=-1)) + 1
    rows = camera.size[1]
    pixel = float(camera.height or 0.0) / rows
    eye = camera.eye - scene.origin
    start = (
        eye @ right - pixel * camera.center[0],
        eye @ up + pixel * (camera.center[1] - (rows - 1)),
    )
    planes = SeenPlanes(
        places.points[seen],
        places.normals[seen],
        rank[triangle.ravel()],
        corners[order],
        owner[order].astype(np.int64),
        np.tile(np.array([right, up]), (count, 1, 1)),
        np.tile(np.array(start), (count, 1)),
        pixel,
    )
    patches = make_patches(planes, tree)
    return patches._replace(where=seen[patches.where])


@kernel
def snap_to_faces(points, face, vertices, faces):
    """
    Move points onto the planes of the triangles that they show, where rounding has left them off.

    ``points`` (n, 3) is written to; ``face`` (n,) is the index of each in ``faces``, below 0 for
    none. Rays take a point for one of a face within 2^-46 of the largest coordinate.
    """
    for i in range(face.size):
        if face[i] < 0:
            continue
        a, b, c = (
            vertices[faces[face[i], 0]],
            vertices[faces[face[i], 1]],
            vertices[faces[face[i], 2]],
        )
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        p = points[i]
        height = x * (p[0] - a[0]) + y * (p[1] - a[1]) + z * (p[2] - a[2])
        height /= x * x + y * y + z * z
        p[0] -= height * x
        p[1] -= height * y
        p[2] -= height * z


class PixelCounter:
    """
    Counts shadows on the pixels of an orthographic view.

    Parameters
    ----------
    patches : Patches
        Of ``make_pixel_patches``.
    caster : Caster
    tree : FaceTree
    shape : tuple of int
        Rows and columns.
    threads : int
    """

    def __init__(
        self, patches: Patches, caster: Caster, tree: FaceTree, shape: tuple[int, ...], threads: int
    ) -> None:
        self._pixels, self._shape = patches.where, shape
        alone = patches._replace(where=np.arange(len(patches.where)))
        self._counter = PatchCounter(alone, EdgeBinner(caster), tree, threads)

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each sun the pixels in shadow, cast or attached."""
        masks = np.zeros((len(suns), int(np.prod(self._shape))), np.uint8)
        masks[:, self._pixels] = self._counter.masks(suns)
        return masks.reshape(-1, *self._shape)

    def add_weights(
        self,
        suns: NDArray[np.float64],
        weights: NDArray[np.int32],
        sums: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each pixel the weights (n, k) of the suns that leave it in shadow."""
        added = np.zeros((len(sums), len(self._pixels)), np.int32)
        self._counter.add_weights(suns, weights, added, progress)
        sums.reshape(len(sums), -1)[:, self._pixels] += added
