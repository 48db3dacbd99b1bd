"""
Meshes of one file as arrays on disk, read by units.

A unit is the least piece that is read: an object, or for a large object a closed component or a
block of its open faces. Closed components stay whole. Arrays are mapped into memory, so that only
the units in use are read.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Scene
from umbra.volume.adjacency import make_caster, sort_along_curve

__all__ = ["FileGeometry", "find_units", "write_geometry"]

LARGE = 4096
"""Faces of an object from which it is cut into several units."""
_BLOCK = 1024  # open faces per unit


@dataclass(frozen=True)
class FileGeometry:
    """
    Meshes of a file, mapped from its folder.

    Parameters
    ----------
    folder : Path
    """

    folder: Path

    def _map(self, name: str) -> NDArray:
        return np.load(self.folder / f"{name}.npy", mmap_mode="r")

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """Corners of the triangles in the file's local frame, (n_vertices, 3) [m]."""
        return self._map("vertices")

    @cached_property
    def faces(self) -> NDArray[np.int32]:
        """Vertex indices, counter-clockwise seen from outside, (n_faces, 3)."""
        return self._map("faces")

    @cached_property
    def part(self) -> NDArray[np.int32]:
        """Part of each face, in ``Scene.parts`` of the file, (n_faces,)."""
        return self._map("part")

    @cached_property
    def boxes(self) -> NDArray[np.float64]:
        """Bounds of each unit in the file's local frame, (n_units, 2, 3) [m]."""
        return np.asarray(self._map("boxes"))

    @cached_property
    def objects(self) -> NDArray[np.int32]:
        """Object of each unit, (n_units,)."""
        return np.asarray(self._map("objects"))

    @cached_property
    def object_of(self) -> NDArray[np.int32]:
        """Object of each part, (n_parts,)."""
        return np.asarray(self._map("object_of"))

    @cached_property
    def unit_start(self) -> NDArray[np.int64]:
        """First entry of each unit in ``unit_faces``, (n_units + 1,)."""
        return np.asarray(self._map("unit_start"))

    def find_faces(self, units: NDArray[np.intp]) -> NDArray[np.int32]:
        """Return the indices of the units' faces, ascending."""
        if len(units) == len(self.boxes):
            return np.arange(len(self.faces), dtype=np.int32)
        start, rows = self.unit_start, self._map("unit_faces")
        pieces = [rows[start[unit] : start[unit + 1]] for unit in units]
        return np.sort(np.concatenate([np.zeros(0, np.int32), *pieces]))

    def count_faces(self, units: NDArray[np.intp]) -> int:
        """Return the number of the units' faces."""
        return int((self.unit_start[units + 1] - self.unit_start[units]).sum())


def write_geometry(scene: Scene, folder: Path) -> FileGeometry:
    """
    Write the meshes of a scene into a folder.

    Parameters
    ----------
    scene : Scene
    folder : Path
        Exists.
    """
    soup, groups = scene.triangles(), scene.groups()
    unit = find_units(soup.vertices, soup.faces, groups[soup.part])
    order = np.argsort(unit, kind="stable").astype(np.int32)
    starts = np.flatnonzero(np.append(True, np.diff(unit[order]) != 0))
    corners = soup.vertices[soup.faces[order]]
    low = np.minimum.reduceat(corners.min(1), starts, axis=0)
    high = np.maximum.reduceat(corners.max(1), starts, axis=0)
    arrays: dict[str, NDArray] = {
        "vertices": soup.vertices,
        "faces": soup.faces,
        "part": soup.part,
        "unit_faces": order,
        "unit_start": np.append(starts, len(order)).astype(np.int64),
        "boxes": np.stack([low, high], axis=1),
        "objects": groups[soup.part[order[starts]]],
        "object_of": groups,
    }
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array)
    return FileGeometry(folder)


def find_units(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], group: NDArray[np.int32]
) -> NDArray[np.int64]:
    """
    Find the unit of each face.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
    faces : (n_faces, 3) int32
    group : (n_faces,) int32
        Object of each face.

    Returns
    -------
    unit : (n_faces,) int64
        Ascending with the objects.
    """
    unit = group.astype(np.int64) << 32
    count = np.bincount(group)
    for large in np.flatnonzero(count > LARGE):
        members = np.flatnonzero(group == large)
        caster = make_caster(vertices, faces[members])
        closed = caster.face_is_closed
        unit[members[caster.source[closed]]] += 1 + caster.component[closed]
        # Faces without area are in no component; they cast nothing and go with the open ones.
        loose = np.setdiff1d(members, members[caster.source[closed]])
        curve = sort_along_curve(vertices[faces[loose]].mean(1))
        block = np.zeros(len(loose), np.int64)
        block[curve] = np.arange(len(loose)) // _BLOCK
        unit[loose] += 1 + len(caster.is_closed) + block
    return unit
