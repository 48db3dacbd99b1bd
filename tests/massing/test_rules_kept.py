"""Envelopes by rules: bands of a square plot in closed form, gardens, windows of a flat."""

import numpy as np
import pytest
import shapely
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene
from umbra.sun import Site, find_sun

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
    assert np.ptp(found.heights[:, 1:-1], axis=1).max() < 0.01  # the same along each row
    assert not found.violations


def test_the_shipped_rule_of_bands_is_kept(field):
    plot = shapely.box(-8, -8, 8, 8)
    found = umbra.envelope(
        field, SITE, plot=plot, rules="japan-56-2:4m-4h", cell=4.0, highest=30.0, year=2026
    )
    assert not found.violations
    assert found.bound_m3 >= found.volume_m3 > 16 * 16 * 4.0  # up to the plane is always allowed
    asks = found.found.problem.asks
    assert len(asks) == 2
    for ask, hours, most in zip(asks, found.found.hours, (4.0, 2.5), strict=True):
        whole = ask.lights.lengths.sum() / 3.6e9
        assert whole == pytest.approx(8.0)
        assert np.all(whole - hours <= most + 1e-3)
    lower = umbra.envelope(
        field, SITE, plot=plot, rules="japan-56-2:4m-3h", cell=4.0, highest=30.0, year=2026
    )
    assert lower.volume_m3 <= found.volume_m3


def test_half_of_a_garden_is_enough_or_what_it_had(field, tmp_path):
    gardens = {"garden": shapely.box(-6, 8, 6, 14)}
    plot = shapely.box(-6, -6, 6, 6)
    volumes = []
    for share in (100, 50):
        rule = write(tmp_path, f"""\
  - name: garden
    receivers: areas
    dates: 2026-03-21
    from: 09:00
    to: 15:00
    every: 30min
    at_least: 5h
    share: {share}
""")  # fmt: skip
        found = umbra.envelope(
            field, VIENNA, plot=plot, rules=rule, areas=gardens, cell=2.0, highest=30.0
        )
        assert not found.violations
        ask, hours = found.found.problem.asks[0], found.found.hours[0]
        (group,) = found.found.problem.groups
        met = hours >= 5 - 1e-4
        assert group.weight @ met >= share / 100 * 72 - 1e-6  # of 12 x 6 m
        assert len(ask.labels) > 10
        volumes.append(found.volume_m3)
    assert volumes[1] > volumes[0] + 10


def test_points_stand_for_windows(field, tmp_path):
    rule = write(tmp_path, """\
  - name: windows
    receivers: windows
    dates: 2026-03-21
    any_of:
      - {from: "09:00", to: "15:00", measure: sun_hours, at_least: 4h, every: 30min}
      - {from: "09:00", to: "15:00", measure: longest_sun_hours, at_least: 2h, every: 30min}
""")  # fmt: skip
    plot = shapely.box(-6, -6, 6, 6)
    points = [(0, 9, 2, 0, -1, 0), (3, 9, 5, 0, -1, 0)]
    found = umbra.envelope(
        field, VIENNA, plot=plot, rules=rule, points=points, names=["low", "high"], cell=2.0
    )
    assert not found.violations
    assert [group.name for group in found.found.problem.groups] == ["low (windows)",
                                                                    "high (windows)"]  # fmt: skip
    for group in found.found.problem.groups:
        total, longest = (found.found.hours[a][r]
                          for a, r in zip(group.ask, group.receiver))  # fmt: skip
        assert total >= 4 - 1e-4 or longest >= 2 - 1e-4


def test_a_rule_without_steps_takes_the_whole_path(field, tmp_path):
    text = """\
  - name: windows
    receivers: windows
    dates: 2026-03-21
    from: "12:00"
    to: "13:00"
    at_least: 1h
"""
    plot = shapely.box(-6, -6, 6, 6)
    points = [(0, 9, 2, 0, -1, 0)]
    more = {"plot": plot, "points": points, "cell": 1.0, "highest": 40.0}
    whole = umbra.envelope(field, VIENNA, rules=write(tmp_path, text), **more)
    stepped = umbra.envelope(
        field, VIENNA, rules=write(tmp_path, text + "    every: 30min\n"), **more
    )
    assert whole.found.problem.asks[0].is_continuous
    assert not stepped.found.problem.asks[0].is_continuous
    assert whole.volume_m3 < stepped.volume_m3
    start = np.datetime64("2026-03-21T11:00", "us")
    suns = find_sun(VIENNA, start + np.arange(0, 3601, 10).astype("timedelta64[s]")).direction
    from umbra.calls.counts import count  # noqa: PLC0415

    scene = make_scene([Part("envelope", "", whole.mesh)])
    lit = count(scene, [(0, 9, 2)], suns)
    assert not np.any(np.asarray(lit))


def test_a_rule_with_variants_asks_for_a_choice(field):
    with pytest.raises(InputError) as caught:
        umbra.envelope(field, SITE, plot=shapely.box(0, 0, 4, 4), rules="japan-56-2")
    assert caught.value.option == "rules"
