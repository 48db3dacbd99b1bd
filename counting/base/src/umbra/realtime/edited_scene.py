"""A scene whose parts are moved, added, removed and replaced by name."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.scene import Part, Scene, make_scene
from umbra.scene.mesh import Mesh, change
from umbra.scene.numbers import read_array

__all__ = ["EditedScene"]


class EditedScene:
    """
    The scene of a renderer, as edited so far.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    scene : Scene
        Replaced by each edit; its origin stays.
    """

    def __init__(self, scene: Scene) -> None:
        if not isinstance(scene, Scene):
            msg = f"a renderer draws a Scene; got a {type(scene).__name__} (see umbra.make_scene)"
            raise InputError(msg, option="scene")
        self.scene = scene
        # Meshes whose own coordinates are the scene's, by ids, which they keep from being reused.
        self._in_scene: dict[int, Mesh] = {}
        self._note(scene.parts)

    def move(self, name: str, matrix: ArrayLike) -> Scene:
        """
        Place the parts of a name by a matrix (4, 4) from their own coordinates to the scene's.

        The own coordinates of a part that came without a transform are the scene's.
        """
        placed = read_array("matrix=", matrix)
        affine = placed.shape == (4, 4) and np.isfinite(placed).all()
        if not affine or (placed[3] != (0.0, 0.0, 0.0, 1.0)).any():
            msg = "matrix= is a matrix of shape (4, 4), finite, whose last row is 0, 0, 0, 1"
            raise InputError(msg, option="matrix")
        chosen = self._find(name)
        before = [self.scene.parts[index].transform for index in chosen]
        first = np.eye(4) if before[0] is None else before[0]
        if any(not np.array_equal(np.eye(4) if t is None else t, first) for t in before):
            msg = (
                f"{len(chosen)} parts are called {name!r} and stand at different places; one "
                "matrix would place all alike: give each a name of its own"
            )
            raise InputError(msg, name=name, count=len(chosen))
        parts, origin = list(self.scene.parts), self.scene.origin
        for index in chosen:
            part = parts[index]
            local = origin if id(part.mesh) in self._in_scene else np.zeros(3)
            transform = _shift(-origin) @ placed.astype(np.float64) @ _shift(local)
            parts[index] = change(part, transform=transform)
        return self._take(parts)

    def add(self, part: Part) -> Scene:
        """Add a part, in the scene's own coordinates."""
        return self._take([*self.scene.parts, self._fit(part)])

    def remove(self, name: str) -> Scene:
        """Remove the parts of a name."""
        chosen = set(self._find(name))
        parts = [part for index, part in enumerate(self.scene.parts) if index not in chosen]
        if not parts:
            msg = f"{name!r} is all that the scene has; replace it, or release the renderer"
            raise InputError(msg, name=name)
        return self._take(parts)

    def replace(self, name: str, part: Part) -> Scene:
        """Put a part, in the scene's own coordinates, in place of those of a name."""
        chosen, fitted = self._find(name), self._fit(part)
        parts = [fitted if index == chosen[0] else old for index, old in enumerate(self.scene.parts)
                 if index == chosen[0] or index not in chosen]  # fmt: skip
        return self._take(parts)

    def _find(self, name: str) -> list[int]:
        """Find the parts of a name, or raise `InputError`."""
        named = {id(part) for part in self.scene[name].parts}
        return [index for index, part in enumerate(self.scene.parts) if id(part) in named]

    def _fit(self, part: Part) -> Part:
        """Check a part, and take it into the scene's frame."""
        if not isinstance(part, Part):
            msg = f"parts are added as umbra.Part; got a {type(part).__name__}"
            raise InputError(msg, option="part")
        alone = make_scene([part])
        fitted, offset = alone.parts[0], alone.origin - self.scene.origin
        self._note([fitted])
        if not offset.any():
            return fitted
        if fitted.transform is not None:
            return change(fitted, transform=_shift(offset) @ fitted.transform)
        fitted = change(fitted, mesh=fitted.mesh.moved(fitted.mesh.vertices + offset))
        self._note([fitted])
        return fitted

    def _take(self, parts: list[Part]) -> Scene:
        self.scene = replace(self.scene, parts=tuple(parts))
        return self.scene

    def _note(self, parts: "tuple[Part, ...] | list[Part]") -> None:
        self._in_scene |= {id(part.mesh): part.mesh for part in parts if part.transform is None}


def _shift(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix of a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix
