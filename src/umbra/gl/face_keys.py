"""Depth keys of drawn faces in float64, and counts on faces that the light sees edge-on."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.gl.projection import EDGE_ON
from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.rays.holding import find_edge_on, recount_edge_on
from umbra.scene import Camera, Light, Scene, Triangles
from umbra.volume.adjacency import find_caster

__all__ = ["find_face_keys", "settle_edge_on"]


def find_face_keys(
    face: NDArray[np.int32],
    camera: Camera,
    triangles: Triangles,
    origin: NDArray[np.float64],
    ground: float | None,
) -> NDArray[np.float64]:
    """
    Find the depth key of each pixel's centre on the plane of its visible face.

    Parameters
    ----------
    face : (rows, cols) int32
    camera : Camera
    triangles : Triangles
    origin : (3,) float64
        Of the scene.
    ground : float, optional
        z of the plane, relative to the origin [m].

    Returns
    -------
    keys : (rows, cols) float64
    """
    matrix = camera.matrix(origin)
    far, _ = camera.key_range()
    rows, cols = face.shape
    keys = np.full((rows, cols), far)
    y, x = np.nonzero(face != NOTHING)
    is_seen = np.zeros(len(triangles.faces) - GROUND, np.bool_)
    is_seen[face[y, x]] = True  # the ground's negative number makes it the last but one
    number = np.cumsum(is_seen) - 1
    which, row = np.flatnonzero(is_seen), number[face[y, x]]
    which[which >= len(triangles.faces)] = GROUND
    points = np.zeros((len(which), 3, 4))
    points[..., 3] = 1.0
    mesh = which >= 0
    points[mesh, :, :3] = triangles.vertices[triangles.faces[which[mesh]]]
    if ground is not None:
        points[~mesh] = np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, ground, 1)])
    mapped = points @ matrix.T
    # The key of a plane is affine in the picture: three points determine it.
    corners = mapped[..., :3]
    corners[np.abs(np.linalg.det(corners)) < EDGE_ON] = np.eye(3)  # seen edge-on
    slope = np.linalg.solve(corners, mapped[..., 3:])[row, :, 0]
    keys[y, x] = slope[:, 0] * x + slope[:, 1] * y + slope[:, 2]
    return keys


def settle_edge_on(
    counts: NDArray[np.int32],
    view: DepthBuffer,
    locate: Callable[[DepthBuffer, Camera], VisibleSurface],
    scene: Scene,
    triangles: Triangles,
    casters: Sequence[int] | None,
    camera: Camera,
    light: Light,
) -> NDArray[np.int32]:
    """Recount by rays the pixels whose visible face lies in the plane of a light."""
    source, origin = light.local(scene.origin), scene.origin
    edge_on = find_edge_on(view, triangles, source)
    if edge_on is None:
        return counts
    caster = find_caster(scene, range(len(scene.parts)) if casters is None else casters)
    frame = locate(view, camera)
    recounted = recount_edge_on(counts, edge_on, frame, caster, camera, source, origin)
    return recounted.astype(np.int32)
