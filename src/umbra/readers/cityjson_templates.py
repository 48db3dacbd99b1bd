"""CityJSON geometry templates: one mesh, placed many times."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.readers.cityjson_choice import Choice, find_kinds, flatten
from umbra.readers.cityjson_colors import find_material
from umbra.readers.surfaces import Surfaces
from umbra.scene import Mesh, Part

__all__ = ["Templates"]


class Templates:
    """
    The templates of one file.

    Parameters
    ----------
    data : dict or None
        ``geometry-templates`` of the file; their vertices are plain coordinates.
    """

    def __init__(self, data: Any) -> None:
        self.shapes: list[dict[str, Any]] = data["templates"] if data else []
        self._raw: list[Any] = data["vertices-templates"] if data else []
        self._vertices: NDArray[np.float64] | None = None
        self._meshes: dict[int, dict[str, Mesh]] = {}

    def place(
        self,
        name: str,
        kind: str,
        instance: dict[str, Any],
        vertices: NDArray[np.float64],
        counts: dict[str, int],
    ) -> list[Part]:
        """
        Place a template.

        Parameters
        ----------
        name, kind : str
            Of the object; the kind is for surfaces without semantics.
        instance : dict
            The GeometryInstance.
        vertices : (n, 3) float64
            Of the instance's document; one of them is its reference point.
        counts : dict of str to int
            What was left out; added to.

        Returns
        -------
        parts : list of Part
            They share the template's meshes.
        """
        index = instance["template"]
        if index not in self._meshes:
            self._meshes[index] = self._cut(index, counts)
        (anchor,) = instance["boundaries"]
        if not 0 <= anchor < len(vertices):
            msg = f"reference point {anchor} of {len(vertices)} vertices"
            raise IndexError(msg)
        matrix = instance.get("transformationMatrix")
        transform = np.eye(4) if matrix is None else np.array(matrix, np.float64).reshape(4, 4)
        transform[:3, 3] += vertices[anchor]
        return [
            Part(name, surface or kind, mesh, transform, find_material(surface or kind))
            for surface, mesh in self._meshes[index].items()
        ]

    def _cut(self, index: int, counts: dict[str, int]) -> dict[str, Mesh]:
        if self._vertices is None:
            self._vertices = np.array(self._raw, np.float64).reshape(-1, 3)
        vertices = self._vertices
        shape = self.shapes[index]
        surfaces = Surfaces()
        kinds = find_kinds(Choice(shape, shape), "", self._raw)
        surfaces.add(f"geometry template {index}", flatten(shape), kinds)
        surfaces.close(len(vertices), 0)
        return {kind: mesh for (_, kind), mesh in surfaces.cut(vertices, counts).items()}
