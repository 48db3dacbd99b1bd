"""A kind of samples for umbra: a point over the highest corner of each part, facing up."""

from typing import Any

import numpy as np

from umbra.extending import InputError, PlacedKind, PlacedSamples, Scene

ABOVE = 0.1
"""Height over the part [m]."""


class Tops(PlacedKind):
    """The top of each part, such as where a mast or an antenna would stand."""

    name = "tops"
    takes = ("on",)

    def place(self, scene: Scene, options: Any) -> PlacedSamples:
        """Return a point for each part, or for those that ``on`` names."""
        chosen = scene.select(options.on, option="on") if options.on else range(len(scene.parts))
        points, parts = [], []
        for part in chosen:
            corners = scene.triangles([part]).find_corners()
            if len(corners):
                points.append(corners[corners[:, 2].argmax()] + scene.origin + (0, 0, ABOVE))
                parts.append(part)
        if not points:
            msg = "no part of the model has a top; choose others with on="
            raise InputError(msg, option="on")
        normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
        names = [scene.parts[part].name for part in parts]
        return PlacedSamples(np.array(points), normals, names=names)
