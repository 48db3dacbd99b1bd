"""What of a model is ground of its own rather than stands on it."""

import numpy as np

from umbra.scene import Scene

__all__ = ["TERRAIN", "choose_receivers", "has_terrain"]

TERRAIN = {
    "Raster", "TINRelief", "LandUse", "Road", "Railway", "TransportSquare", "WaterBody",
    "PlantCover", "IfcSite", "IfcGeographicElement",
}  # fmt: skip
"""Kinds of parts that lie on the ground, or are it."""
RELIEF = {"Raster", "TINRelief"}
"""Of these, what is a terrain however little it covers."""
COVERED = 0.2
"""Share of the model's plan, a rectangle, that ground of other kinds covers at least."""


def has_terrain(scene: Scene) -> bool:
    """
    Tell whether a model brings ground of its own, and not only a street or a pond.

    Parameters
    ----------
    scene : Scene
    """
    kinds = np.array([part.kind in TERRAIN for part in scene.parts])
    if not kinds.any():
        return False
    if any(part.kind in RELIEF for part in scene.parts):
        return True
    soup = scene.triangles(np.flatnonzero(kinds).tolist())
    a, b, c = (soup.vertices[soup.faces[:, k], :2] for k in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    covered = float(np.abs(x1 * y2 - x2 * y1).sum()) / 2
    return covered >= COVERED * float(np.prod(np.ptp(scene.bounds(), axis=0)[:2]))


def choose_receivers(scene: Scene, ground: float | None) -> str:
    """
    Choose what a plan shows of a model where nobody says it.

    Parameters
    ----------
    scene : Scene
    ground : float or None
        The ground's height, if it is given.

    Returns
    -------
    receivers : {'top', 'ground'}
        The topmost surfaces of a model with ground of its own; else the ground plane.
    """
    is_level = ground is not None or scene.ground is not None
    return "top" if has_terrain(scene) and not is_level else "ground"
