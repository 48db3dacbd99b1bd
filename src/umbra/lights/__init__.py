"""
Lights: suns of days, directions of the sky, lamps; with columns of weights.

    weighted.py  homogeneous lights with weights     Lights
    period.py    the suns of days                    Period, make_period
    sky.py       directions of the sky               find_directions

They know nothing of what receives them.
"""

from umbra.lights.period import Period, Refraction, make_no_period, make_period
from umbra.lights.sky import find_directions
from umbra.lights.weighted import Lights

__all__ = [
    "Lights", "Period", "Refraction", "find_directions", "make_no_period", "make_period",
]  # fmt: skip
