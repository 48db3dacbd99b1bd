"""What colour city objects have where the file gives none: by their kind."""

from functools import cache

from umbra.scene import Material
from umbra.scene.material import GREY

__all__ = ["find_material"]

# Diffuse reflectance, linear RGB; muted, so that shadows stay the subject.
COLORS = {
    "Bridge": (0.50, 0.48, 0.45),
    "Door": (0.28, 0.18, 0.11),
    "GroundSurface": (0.42, 0.40, 0.37),
    "LandUse": (0.44, 0.46, 0.33),
    "PlantCover": (0.22, 0.36, 0.14),
    "Road": (0.26, 0.26, 0.27),
    "RoofSurface": (0.52, 0.22, 0.14),
    "SolitaryVegetationObject": (0.20, 0.34, 0.12),
    "TINRelief": (0.44, 0.46, 0.33),
    "WallSurface": (0.76, 0.70, 0.58),
    "WaterBody": (0.18, 0.34, 0.46),
    "WaterSurface": (0.18, 0.34, 0.46),
    "Window": (0.20, 0.27, 0.32),
}


@cache
def find_material(kind: str) -> Material:
    """Give the material of a CityJSON object type or surface type; grey for others."""
    return Material(COLORS.get(kind, GREY))
