"""
Sites, their clocks, and the position of the sun.

Data flows one way::

    find_site -> Site -> make_steps -> Steps -> find_sun -> SunPath
    a scene      place   local clock   UTC     NREL SPA    unit vectors in the model's axes
"""

from umbra.sun.clock import Steps, make_steps
from umbra.sun.date_words import name_date, name_days, parse_dates
from umbra.sun.day_times import sun_light
from umbra.sun.position import Daylight, SunPath, find_daylight, find_sun
from umbra.sun.site import Site, find_site

__all__ = [
    "Daylight",
    "Site",
    "Steps",
    "SunPath",
    "find_daylight",
    "find_site",
    "find_sun",
    "make_steps",
    "name_date",
    "name_days",
    "parse_dates",
    "sun_light",
]
