"""What colour city objects have where the file gives none: by their kind."""

from umbra.scene.mesh import GREY

__all__ = ["find_color"]

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


def find_color(kind: str) -> tuple[float, float, float]:
    """Give the colour of a CityJSON object type or surface type; grey for others."""
    return COLORS.get(kind, GREY)
