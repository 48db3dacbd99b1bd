"""A measure for umbra: the free share of the upper half's solid angle."""

from umbra.extending import Asked, Lights, Measure, find_directions

COUNT = 2048
"""Directions, each of an equal solid angle."""


class Openness(Measure):
    """Openness: 1 on an open plain, at most a half before a wall."""

    name = "openness"
    unit = "1"
    long_name = "free share of the upper half's solid angle"
    most = 1.0  # upper end of the map's scale

    def make_lights(self, asked: Asked) -> Lights:
        """Return directions of the sky, of equal weights that add up to 1."""
        directions, angles = find_directions(COUNT)
        return Lights.of(directions, angles / angles.sum())
