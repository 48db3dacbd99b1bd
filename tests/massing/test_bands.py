"""Envelopes by rules: bands of a square plot in closed form, gardens, windows of a flat."""

import numpy as np
import pytest
import shapely
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.sun import Site

SITE = Site(35.7, 139.7, "Asia/Tokyo")
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
HEAD = 'format: 2\nname: A rule\nedition: "1"\nsource: Invented for a test\nchecks:\n'


def write(tmp_path, text):
    path = tmp_path / "rule.yaml"
    path.write_text(HEAD + text)
    return path


@pytest.fixture(scope="module")
def field():
    """Flat land with a house far off."""
    far = Part("house", "", Mesh(*box((60, -60, 0), (70, -50, 6))))
    return make_scene([far]).with_facts(ground=0.0)


def test_a_band_north_of_a_square_plot_makes_a_slope(field, tmp_path):
    """At solar noon the sun is due south: the heights rise with the distance from the band."""
    rule = write(tmp_path, """\
  - name: band
    receivers: band
    band: 5..10
    height: 4
    dates: 2026-12-21
    from: 11:50
    to: 12:10
    every: 20min
    clock: solar
    cast: proposed
    measure: shadow_hours
    at_most: 0h
""")  # fmt: skip
    plot = shapely.box(-10, -10, 10, 10)
    found = umbra.envelope(field, SITE, plot=plot, rules=rule, cell=2.0, highest=30.0)
    ask = found.found.problem.asks[0]
    sun = ask.lights.directions[0]
    assert abs(sun[0]) < 2e-3  # due south
    points = ask.places.points + field.origin
    assert np.allclose(points[:, 2], 4.0)
    north = points[(points[:, 1] > 14.9) & (np.abs(points[:, 0]) < 9)]
    edges = found.y + 1.0  # northern edge of each row
    slope = sun[2] / np.hypot(*sun[:2])
    expected = np.minimum(4.0 + (north[:, 1].min() - edges) * slope, 30.0)
    rows = np.nanmin(found.heights[:, 1:-1], axis=1)
    assert rows == pytest.approx(expected, abs=0.01)
    assert np.ptp(found.heights[:, 1:-1], axis=1).max() < 0.05  # the same along each row
    assert not found.violations
