"""A noon that can be told by hand."""

import pytest
from support.days import find_noon

import umbra
from umbra.sun import find_sun


@pytest.fixture(scope="session")
def noon():
    """Solar noon at Greenwich on the day of the equinox, UTC."""
    return find_noon()


@pytest.fixture(scope="session")
def at_45(noon):
    """A site on Greenwich's meridian over which the sun is 45 degrees high at that noon."""
    altitude = find_sun(umbra.Site(45.0, 0.0, "UTC"), noon, refraction="none").altitude[0]
    return umbra.Site(altitude, 0.0, "UTC")  # as much nearer to the pole as the sun was too high
