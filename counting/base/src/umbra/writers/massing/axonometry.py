"""A shaded parallel view of an envelope among its neighbours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.zenith import find_surface
from umbra.scene import Mesh, Triangles
from umbra.scene.grid import Grid

__all__ = ["Axonometry", "look_at"]

_FINER = 2  # rays across a pixel
_LIGHT = np.array([-0.45, 0.35, 0.82])  # toward the light, in the view: from the upper left
_STONE, _GROUND = np.array([0.86, 0.86, 0.875]), np.array([0.975, 0.975, 0.97])
_INK = np.array([0.2, 0.2, 0.24])
_BEND = 0.9  # cosine between faces that meet at an edge


@dataclass(frozen=True, eq=False)
class Axonometry:
    """
    A parallel view.

    Parameters
    ----------
    axes : (3, 3) float64
        Rows: to the right, up, and toward the viewer.
    box : (2, 2) float64
        Lowest and highest place on the picture's plane [m].
    """

    axes: NDArray[np.float64]
    box: NDArray[np.float64]

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return shares (n, 2) of the picture's width and height, from its lower left."""
        flat = points @ self.axes[:2].T
        return (flat - self.box[0]) / np.ptp(self.box, axis=0)

    def draw(
        self, around: Triangles, solid: Mesh | None, colors: NDArray[np.float64],
        size: tuple[int, int],
    ) -> NDArray[np.float64]:  # fmt: skip
        """
        Draw what stands around in grey, and a solid in the colours (n_faces, 3) of its faces.

        Returns sRGB (rows, cols, 3) in [0, 1], row 0 lowest.
        """
        vertices, faces = around.vertices, around.faces
        if solid is not None:
            faces = np.concatenate([faces, solid.faces + len(vertices)])
            vertices = np.concatenate([vertices, solid.vertices])
        paint = np.concatenate([np.tile(_STONE, (len(around.faces), 1)), colors])
        turned = vertices @ self.axes.T
        soup = Triangles(turned, faces.astype(np.int32), np.zeros(len(faces), np.int32))
        rows, cols = size[0] * _FINER, size[1] * _FINER
        wide, high = np.ptp(self.box, axis=0)
        dx, dy = wide / cols, high / rows
        low = self.box[0]
        grid = Grid(low[0] + dx / 2, low[1] + dy / 2, dx, dy, cols, rows)
        seen = find_surface(soup, grid, float(turned[:, 2].min()) - 1.0)
        image = self._shade(seen.face, seen.heights, turned, faces, paint, max(dx, dy))
        return image.reshape(size[0], _FINER, size[1], _FINER, 3).mean((1, 3))

    def _shade(
        self, face: NDArray[np.int32], depth: NDArray[np.float64], turned: NDArray[np.float64],
        faces: NDArray[np.integer], paint: NDArray[np.float64], pixel: float,
    ) -> NDArray[np.float64]:  # fmt: skip
        corners = turned[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals /= np.where(length > 0, length, 1.0)
        normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)  # toward the viewer
        light = _LIGHT / np.linalg.norm(_LIGHT)
        bright = 0.62 + 0.42 * np.clip(normals @ light, 0, 1)
        drawn = np.vstack([np.clip(paint * bright[:, None], 0, 1), _GROUND])
        image = drawn[np.where(face < 0, len(paint), face)]
        # Lines where the view jumps or two faces meet at an angle.
        nothing = face < 0
        bent = np.vstack([normals, [[0.0, 0.0, 1.0]]])[np.where(nothing, len(paint), face)]
        flat = np.where(nothing, depth.min(), depth)
        ink = np.zeros(face.shape, np.bool_)
        for axis in range(2):
            a, b = (np.s_[1:], np.s_[:-1]) if axis == 0 else (np.s_[:, 1:], np.s_[:, :-1])
            fold = (bent[a] * bent[b]).sum(-1) < _BEND
            jump = (np.abs(flat[a] - flat[b]) > 8 * pixel + 1.0) & ~(nothing[a] & nothing[b])
            ink[a] |= (fold & ~nothing[a] & ~nothing[b]) | jump
        image[ink] = 0.45 * image[ink] + 0.55 * _INK
        return image


def look_at(
    points: NDArray[np.float64], azimuth: float, altitude: float, shape: float
) -> Axonometry:
    """
    Choose a view from an azimuth (from +y) and altitude [degrees] that holds some points.

    Parameters
    ----------
    points : (n, 3) float64
    azimuth, altitude : float
        Of the viewer.
    shape : float
        Width of the picture by its height.
    """
    turn, lift = np.radians(azimuth), np.radians(altitude)
    toward = np.array([np.sin(turn) * np.cos(lift), np.cos(turn) * np.cos(lift), np.sin(lift)])
    right = np.array([-np.cos(turn), np.sin(turn), 0.0])
    axes = np.stack([right, np.cross(toward, right), toward])
    flat = points @ axes[:2].T
    middle = (flat.min(0) + flat.max(0)) / 2
    half = np.ptp(flat, axis=0) / 2 * 1.04 + 1e-6
    half = np.maximum(half, [half[1] * shape, half[0] / shape])
    return Axonometry(axes, np.array([middle - half, middle + half]))
