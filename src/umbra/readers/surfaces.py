"""CityJSON surfaces, gathered into flat lists as they are met, then cut into meshes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.polygons import Polygons, triangulate
from umbra.scene import Mesh

__all__ = ["Surfaces"]


class Surfaces:
    """Surfaces by object and kind."""

    def __init__(self) -> None:
        self._parts: dict[tuple[str, str], int] = {}
        self._part: list[int] = []
        self._rings: list[int] = []
        self._ring_lengths: list[int] = []
        self._open: list[int] = []
        self._closed: list[NDArray[np.int64]] = []
        self._first_ring = 0

    def add(self, name: str, surfaces: list[Any], kinds: list[str]) -> None:
        """
        Add an object's surfaces.

        Parameters
        ----------
        name : str
        surfaces : list
            Each a list of rings, each a list of vertex indices of the document.
        kinds : list of str
            One for each surface.
        """
        parts, lengths, corners = self._parts, self._ring_lengths, self._open
        for surface, kind in zip(surfaces, kinds, strict=True):
            self._part.append(parts.setdefault((name, kind), len(parts)))
            self._rings.append(len(surface))
            for ring in surface:
                lengths.append(len(ring))
                corners += ring

    def close(self, n_vertices: int, offset: int, where: str = "") -> None:
        """
        End a document: check the indices added since the last, and shift them.

        Parameters
        ----------
        n_vertices : int
            Of the document.
        offset : int
            Vertices of all documents before it.
        where : str
            Put before errors.

        Raises
        ------
        InputError
            If a corner is not a whole number, or names no vertex (which object).
        """
        try:
            corners = np.array(self._open) if self._open else np.zeros(0, np.int64)
        except ValueError:  # ragged: an index is a list
            corners = np.array([None])
        if corners.dtype.kind != "i" or corners.ndim != 1:
            wrong = next((i for i, c in enumerate(self._open) if type(c) is not int), 0)
            msg = (
                f"{where}object '{self._owner(wrong)}' has a vertex index that is not a whole "
                f"number ({str(self._open[wrong])[:40]}); repair it or export the file again"
            )
            raise InputError(msg)
        bad = np.flatnonzero((corners < 0) | (corners >= n_vertices))
        if len(bad):
            msg = (
                f"{where}object '{self._owner(int(bad[0]))}' names vertex {corners[bad[0]]}, but "
                f"there are {n_vertices} vertices ({len(bad)} such corners in all); "
                "repair it or export the file again"
            )
            raise InputError(msg, vertex=int(corners[bad[0]]), count=len(bad))
        self._closed.append(corners.astype(np.int64, copy=False) + offset)
        self._open.clear()
        self._first_ring = len(self._ring_lengths)

    def _owner(self, corner: int) -> str:
        """Find the object that a corner of the open document belongs to."""
        ring = np.searchsorted(np.cumsum(self._ring_lengths[self._first_ring :]), corner, "right")
        surface = np.searchsorted(np.cumsum(self._rings), ring + self._first_ring, "right")
        part = self._part[int(surface)]
        return next(name for (name, _), index in self._parts.items() if index == part)

    def cut(
        self, vertices: NDArray[np.float64], counts: dict[str, int]
    ) -> dict[tuple[str, str], Mesh]:
        """
        Cut all surfaces into triangles.

        Parameters
        ----------
        vertices : (n_vertices, 3) float64
            Of all documents; the meshes share it.
        counts : dict of str to int
            What was left out, by what it is; added to.

        Returns
        -------
        meshes : dict of (name, kind) to Mesh
        """
        corners = np.concatenate(self._closed) if self._closed else np.zeros(0, np.int64)
        result = triangulate(
            vertices,
            Polygons(
                corners,
                np.array(self._ring_lengths, np.int64),
                np.array(self._rings, np.int64),
            ),
        )
        for what, number in (
            ("polygons with fewer than three distinct corners left out", result.degenerate),
            ("polygons whose rings cross themselves, so that triangles overlap", result.crossed),
        ):
            counts[what] = counts.get(what, 0) + number
        part = np.array(self._part, np.int64)[result.polygon]
        order = np.argsort(part, kind="stable")
        faces = result.faces[order]
        ends = np.cumsum(np.bincount(part, minlength=len(self._parts))).tolist()
        meshes = {}
        start = 0
        for key, end in zip(self._parts, ends):
            meshes[key] = Mesh(vertices, faces[start:end])
            start = end
        return meshes
