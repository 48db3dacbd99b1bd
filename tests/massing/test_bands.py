"""Envelopes by rules: bands of a square plot in closed form, gardens, windows of a flat."""

import numpy as np
import pytest
import shapely
from shapely import affinity
from support.shapes import box

import umbra
from umbra.receivers.lattice import choose_side, cut_polygon
from umbra.scene import Mesh, Part, make_scene
from umbra.sun import Site

SITE = Site(35.7, 139.7, "Asia/Tokyo")
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
HEAD = 'format: 2\nname: A rule\nedition: "1"\nsource: Invented for a test\nchecks:\n'
BAND = """\
  - name: band {near}
    receivers: band
    band: {near}..{far}
    height: 4
    dates: winter-solstice
    from: "08:00"
    to: "16:00"
    clock: solar
    every: 30min
    cast: proposed
    measure: shadow_hours
    at_most: {most}
"""
LATITUDE, A, B, TURN = 40.577189894599, 8.731964840504364, 12.32915057101191, 45.69950126703149


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


def test_slivers_of_a_band_are_kept_as_they_are_verified(field, tmp_path):
    """A turned plot, of whose bands the lattice cuts pieces of less than a square millimetre."""
    checks = "".join(
        BAND.format(near=near, far=far, most=most)
        for near, far, most in ((5, 10, "4h"), (10, 20, "2h30min"))
    )
    plot = affinity.rotate(shapely.box(-A / 2, -B / 2, A / 2, B / 2), TURN)
    found = umbra.envelope(
        field, Site(LATITUDE, 139.7, "Asia/Tokyo"), plot=plot, rules=write(tmp_path, checks),
        cell=2.0, year=2026,
    )  # fmt: skip
    ring = shapely.difference(shapely.buffer(plot, 10), shapely.buffer(plot, 5))
    assert cut_polygon(ring, choose_side(ring.area, None))[1].min() < 1e-6
    assert not found.violations
    assert found.found.shrunk == 0.0


@pytest.mark.parametrize(
    ("rule", "site", "rows"),
    [
        ("poland-wt-60:city-centre", Site(52.2, 21.0, "Europe/Warsaw"),
         ["flush,0,12,2,180,1.5,1.5,0", "deep,3,12,2,180,1.5,1.5,0.3"]),
        ("zurich-abv", Site(47.37, 8.54, "Europe/Zurich"),
         ["north,0,12,2,0,1.5,1.5,0", "east,-12,3,2,120,1.5,1.5,0.1", "south,0,14,2,180,1,1,0"]),
    ],
)  # fmt: skip
def test_reveals_and_facades_turned_away_pass_the_proof_of_the_rule(
    field, tmp_path, rule, site, rows
):
    table = tmp_path / "windows.csv"
    table.write_text("\n".join(["name,x,y,z,azimuth,width,height,reveal", *rows]) + "\n")
    asked = {"rules": rule, "windows": table, "year": 2026}
    plot = shapely.box(-8, -8, 8, 8)
    found = umbra.envelope(field, site, plot=plot, cell=4.0, highest=40.0, **asked)
    assert not found.violations
    assert not found.broken
    assert found.volume_m3 > 500
    built = make_scene([*field.parts, Part("new", "", found.mesh)]).with_facts(ground=0.0)
    proof = umbra.prove(built, site, proposed=["new"], **asked)
    assert proof.verdict == "pass"
    # Higher by what the found heights leave to the cap, it fails.
    block = Part("new", "", Mesh(*box((-8, -8, 0), (8, 8, 40))))
    taller = make_scene([*field.parts, block]).with_facts(ground=0.0)
    assert umbra.prove(taller, site, proposed=["new"], **asked).verdict == "fail"
