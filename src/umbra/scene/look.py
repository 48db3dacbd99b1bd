"""How pictures look on every device: ground, sky, and how bright lights are taken."""

__all__ = ["AMBIENT", "GROUND_COLOR", "HORIZON", "SKY", "find_exposure"]

GROUND_COLOR = (0.50, 0.50, 0.48)
SKY, HORIZON = (0.42, 0.60, 0.82), (0.86, 0.91, 0.95)
"""Behind everything, at the top and at the foot of a picture; linear RGB."""
AMBIENT = 0.20
"""Of a white surface that looks up; half as much looking down."""


def find_exposure(n_lights: int) -> float:
    """Give what one of so many lights of intensity 1 adds to a white surface that faces it."""
    return 0.8 / max(n_lights, 1) ** 0.5
