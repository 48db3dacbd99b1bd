"""What of a model is ground of its own rather than stands on it."""

from umbra.scene import Scene

__all__ = ["TERRAIN", "has_terrain"]

TERRAIN = {"Raster", "TINRelief", "LandUse", "Road", "Railway", "TransportSquare", "WaterBody"}
"""Kinds of parts that lie on the ground, or are it."""


def has_terrain(scene: Scene) -> bool:
    """Tell whether a model brings ground of its own."""
    return any(part.kind in TERRAIN for part in scene.parts)
