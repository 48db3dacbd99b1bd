"""Envelopes by rules: gardens, points, the sun's whole path."""

import numpy as np
import pytest
import shapely
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene
from umbra.sun import Site, find_sun

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


def test_half_of_a_garden_is_enough(field, tmp_path):
    garden = shapely.box(-6, 8, 6, 14)
    rule = write(tmp_path, """\
  - name: garden
    receivers: areas
    dates: 2026-03-21
    from: 09:00
    to: 15:00
    every: 1h
    at_least: 5h
    share: 50
""")  # fmt: skip
    found = umbra.envelope(
        field, VIENNA, plot=shapely.box(-6, -6, 6, 6), rules=rule, areas={"garden": garden},
        cell=3.0, highest=30.0,
    )  # fmt: skip
    assert not found.violations
    (group,) = found.found.problem.groups
    assert group.weight.sum() == pytest.approx(garden.area)
    met = found.found.hours[0] >= 5 - 1e-4
    assert 0.5 * garden.area - 1e-6 <= group.weight @ met < 0.9 * garden.area
    assert found.volume_m3 <= found.bound_m3


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
        umbra.envelope(field, VIENNA, plot=shapely.box(0, 0, 4, 4), rules="japan-56-2")
    assert caught.value.option == "rules"
