"""Places and days whose sun can be told by hand."""

import datetime as dt

import numpy as np

import umbra
from support.shapes import box
from umbra.scene import Mesh, Part, make_scene
from umbra.sun import find_sun

EQUINOX = "2026-03-20"
"""14:46 UTC: all day long the sun is within 0.25 degrees of the equator."""


def find_noon(longitude=0.0, date=EQUINOX):
    """Find the second [UTC] at which the sun of an equinox stands highest over a meridian."""
    seconds = np.datetime64(date, "s") + np.arange(86_400).astype("timedelta64[s]")
    site = umbra.Site(10.0, longitude, "UTC")
    rough = int(np.argmax(find_sun(site, seconds[::60], refraction="none").altitude)) * 60
    near = seconds[rough - 90 : rough + 90]
    return near[np.argmin(np.abs(find_sun(site, near, refraction="none").direction[:, 0]))]


def around(instant, seconds=2):
    """Give a study's period whose one midpoint is an instant [UTC]."""
    middle = instant.astype("datetime64[s]").item()
    half = dt.timedelta(seconds=seconds / 2)
    assert seconds % 2 == 0
    return {
        "date": middle.date(),
        "start": (middle - half).time(),
        "end": (middle + half).time(),
        "every": f"{seconds}s",
    }


def pole(height=10.0, side=0.2):
    """Make a square pole on z = 0 about the z axis."""
    return make_scene(*box((-side / 2, -side / 2, 0), (side / 2, side / 2, height)), name="pole")


def wall(height=10.0):
    """Make a wall along y, its east face at x = 0."""
    return make_scene(*box((-0.2, -200, 0), (0, 200, height)), name="wall")


def parts(**meshes):
    """Make a scene of named parts."""
    return make_scene([Part(name, name[:4], Mesh(*mesh)) for name, mesh in meshes.items()])
