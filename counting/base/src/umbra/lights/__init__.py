"""
Lights: suns of days, directions of the sky, lamps; with columns of weights.

    weighted.py  homogeneous lights with weights     Lights
    period.py    the suns of days                    Period, make_period
    sky.py       directions of the sky               find_directions, spread_directions
    horizon.py   the land far away                   Horizon
    horizon_file.py  files of it                     read_horizon
    perez.py     radiance of the sky by hours        find_shape, sum_sky
    weather.py   a year of weather                   Weather, WeatherSuns
    weather_file.py  files of it                     read_weather

They know nothing of what receives them.
"""

from umbra.lights.horizon import Horizon, LandRaster
from umbra.lights.horizon_file import read_horizon
from umbra.lights.perez import find_shape, sum_sky
from umbra.lights.period import Period, Refraction, make_no_period, make_period
from umbra.lights.sky_directions import find_directions, spread_directions
from umbra.lights.weather_file import read_weather
from umbra.lights.weather_year import Weather, WeatherSuns
from umbra.lights.weighted import Lights

__all__ = [
    "Horizon", "LandRaster", "Lights", "Period", "Refraction", "Weather", "WeatherSuns",
    "find_directions", "find_shape", "make_no_period", "make_period", "read_horizon",
    "read_weather", "spread_directions", "sum_sky",
]  # fmt: skip
