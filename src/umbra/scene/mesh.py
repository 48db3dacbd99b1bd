"""Triangles and the parts they make: what a file holds, before any shadow."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError

__all__ = ["Mesh", "Part"]

GREY = (0.72, 0.70, 0.67)


@dataclass(frozen=True, eq=False)
class Mesh:
    """
    A triangle soup in its own frame.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
        Positions [m]. Several meshes may share one array.
    faces : (n_faces, 3) int32
        Vertex indices, counter-clockwise seen from outside.

    Raises
    ------
    InputError
        If a face names a vertex that does not exist, or a used vertex is not
        finite.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, np.float64)
        faces = np.ascontiguousarray(self.faces, np.int32)
        # A reshape makes a new array object: keep the one that meshes share.
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            vertices = vertices.reshape(-1, 3)
        if faces.ndim != 2 or faces.shape[1] != 3:
            faces = faces.reshape(-1, 3)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            wrong = (faces < 0) | (faces >= len(vertices))
            first = int(np.flatnonzero(wrong.any(1))[0])
            msg = (
                f"{int(wrong.any(1).sum())} faces name vertices that do not exist "
                f"(first: face {first}, {len(vertices)} vertices); repair the file"
            )
            raise InputError(msg, face=first)


@dataclass(frozen=True, eq=False)
class Part:
    """
    A named instance of a mesh.

    Parameters
    ----------
    name : str
        The thing it belongs to: a building's id, an OBJ group, a glTF node.
    kind : str
        What it is: ``WallSurface``, ``RoofSurface``, an OBJ or glTF material.
    mesh : Mesh
        Shared by every instance of it.
    transform : (4, 4) float64, optional
        From the mesh's frame to the scene's; None is the identity.
    color : (3,) float, optional
        Diffuse reflectance, linear RGB in 0 to 1.
    """

    name: str
    kind: str
    mesh: Mesh
    transform: NDArray[np.float64] | None = None
    color: tuple[float, float, float] = field(default=GREY)

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.mesh.faces)


def transform_points(transform: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """
    Move points by an affine transform.

    Parameters
    ----------
    transform : (4, 4) float64
    points : (n, 3) float64

    Returns
    -------
    moved : (n, 3) float64
    """
    matrix = np.asarray(transform, np.float64)
    return np.asarray(points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
