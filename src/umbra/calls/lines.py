"""Lines of a picture: outlines, behind which another surface begins, and creases."""

import numpy as np
from numpy.typing import NDArray

from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.scene import Camera, Scene
from umbra.scene.mesh import ADDED_GROUND

__all__ = ["LineFinder", "draw_lines"]

_BEND = np.cos(np.radians(22.0))  # of two faces, from which there is a crease
_CREASE = 0.55  # strength, that of an outline being 1
_GAP = 3.0  # least step in depth at an outline, in that of the surfaces from pixel to pixel
_INK = np.array((0.025, 0.025, 0.032))  # linear RGB
_DARKEST = 0.8
_REACH = 7  # half the window of a density [pixels]
_DENSE = 0.22  # mean strength from which lines are fainter


class LineFinder:
    """Finder of lines in views of a scene."""

    def __init__(self, scene: Scene) -> None:
        soup = scene.triangles()
        a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        length = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        self._normals = (normals / length).astype(np.float32)
        kinds = np.array([part.kind in ADDED_GROUND for part in scene.parts])
        # A ground beside the model is drawn as a plane is: without creases.
        self._is_ground = np.append(kinds[soup.part], True) if len(kinds) else np.ones(1, np.bool_)
        self._normals[self._is_ground[:-1]] = (0.0, 0.0, 1.0)

    def find(self, view: DepthBuffer, camera: Camera) -> NDArray[np.float32]:
        """Return the strength of the line in each pixel, (rows, cols): 0 to 1."""
        face = view.face
        bare = self._is_ground[np.maximum(face, -1)]
        normal = self._normals[np.maximum(face, 0)]
        normal[face == GROUND] = (0.0, 0.0, 1.0)
        normal[face == NOTHING] = 0.0
        with np.errstate(invalid="ignore"):
            return self._draw(face, bare, normal, *_find_steps(view, normal, camera))

    @staticmethod
    def _draw(
        face: NDArray[np.int32],
        bare: NDArray[np.bool_],
        normal: NDArray[np.float32],
        away: NDArray[np.float32],
        step: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Compare each pixel with its right and its lower neighbour."""
        ink = np.zeros(face.shape, np.float32)
        for first, second in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            at = np.nonzero(face[first] != face[second])
            gap = np.abs(away[first][at] - away[second][at])
            is_bare = bare[first][at] & bare[second][at]
            is_outline = bare[first][at] != bare[second][at]
            is_outline |= gap > _GAP * (step[first][at] + step[second][at])
            bend = np.abs(np.einsum("ij,ij->i", normal[first][at], normal[second][at]))
            strength = np.where(is_outline, 1.0, np.where(bend < _BEND, _CREASE, 0.0))
            strength[is_bare] = 0.0  # the horizon is no line
            # A line lies on the nearer surface.
            is_other = away[second][at] < away[first][at]
            for side, chosen in ((first, ~is_other), (second, is_other)):
                places = at[0][chosen], at[1][chosen]
                ink[side][places] = np.maximum(ink[side][places], strength[chosen])
        return ink


def _find_steps(
    view: DepthBuffer, normal: NDArray[np.float32], camera: Camera
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return distances along the view axis, and how much they change from pixel to pixel [m]."""
    _, rows = camera.size
    seen = view.face != NOTHING
    facing = np.abs(normal @ camera.axes()[2].astype(np.float32))
    tangent = np.sqrt(np.maximum(1.0 - facing**2, 0.0)) / np.maximum(facing, 0.05)
    away = np.full(view.face.shape, np.inf, np.float32)
    if camera.is_perspective:
        away[seen] = 1.0 / view.key[seen]
        pixel = np.where(seen, away, 0.0) * (2 * np.tan(np.radians(camera.fov) / 2) / rows)
    else:
        away[seen] = -view.key[seen]
        pixel = np.full(view.face.shape, (camera.height or 1.0) / rows, np.float32)
    return away, (pixel * (0.5 + tangent)).astype(np.float32)


def draw_lines(linear: NDArray[np.float64], ink: NDArray[np.float32]) -> NDArray[np.float64]:
    """Draw lines of a strength (rows, cols) on a picture in linear RGB; dense ones are fainter."""
    density = _average(ink)
    strength = _DARKEST * ink * np.minimum(1.0, _DENSE / np.maximum(density, 1e-6))
    return linear + strength[..., None] * (_INK - linear)


def _average(values: NDArray[np.float32]) -> NDArray[np.float64]:
    """Average over a window around each pixel."""
    size = 2 * _REACH + 1
    sums = np.pad(values.astype(np.float64), _REACH, mode="edge")
    for _ in range(2):  # along the columns, then turned along the rows
        sums = np.pad(sums.cumsum(0), ((1, 0), (0, 0)))
        sums = ((sums[size:] - sums[:-size]) / size).T
    return sums
