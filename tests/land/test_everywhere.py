"""Verdicts, envelopes and cities know the land, and count what a study counts."""

import numpy as np
import pandas as pd
import pytest
from shapely.geometry import box as rectangle
from support.cities import DAY, make_houses, write_city
from support.shapes import box

import umbra
from umbra.calls.prove import make_proof
from umbra.calls.prove_options import ProofOptions
from umbra.lights import Horizon
from umbra.massing.asks import SUM, Ask
from umbra.scene.grid import Places
from umbra.study.options import StudyOptions
from umbra.study.study_period import find_period
from umbra.tiles.job import read_job

LONDON = umbra.Site(51.5, -0.12, "Europe/London")
RIDGE = pd.Series([0.0, 5, 20, 34, 34, 20, 0, 0], index=np.arange(8) * 45.0)
RULE = """\
format: 2
name: A rule
edition: "1"
source: Invented for a test
checks:
  - name: windows
    receivers: windows
    dates: 2026-03-21
    from: 07:00
    to: 18:00
    every: 15min
    at_least: 6h
"""


@pytest.fixture(scope="module")
def scene():
    return umbra.make_scene(*box((-5, -5, 0), (5, 5, 10)), name="house")


def list_windows():
    return [(0.0, -8.0, 2.0, 0.0, -1.0, 0.0), (9.0, 0.0, 2.0, 1.0, 0.0, 0.0)]


@pytest.fixture
def rule(tmp_path):
    (tmp_path / "rule.yaml").write_text(RULE)
    return str(tmp_path / "rule.yaml")


@pytest.mark.parametrize("measure", ["sun_hours", "sky_component"])
def test_proofs_know_the_land(scene, tmp_path, rule, measure):
    """A proof's value is that of a study with the land."""
    table = tmp_path / "windows.csv"
    table.write_text("name,x,y,z,azimuth,width,height\nsouth,0,-8,2,180,1,1\n")
    asked = {"receivers": "points", "points": list_windows()[:1], "ground": 0.0}
    asked |= {"start": "07:00", "end": "18:00", "date": "2026-03-21"}
    asked |= {"measure": measure, "exact": measure != "sun_hours"}
    found, right = [], []
    for land in (None, RIDGE):
        named = rule if measure == "sun_hours" else "bre-209-vsc"
        options = ProofOptions(rules=(named,), windows=table, ground=0.0, horizon=land)
        outcome = make_proof(scene, LONDON, options).verdicts[0].findings[0].outcome
        both = (outcome, *outcome.parts)
        found.append(next(one.value for one in both if one.value is not None))
        study = umbra.shadow_study(scene, LONDON, horizon=land, **asked)
        right.append(float(study.dataset[measure][0]))
    assert found == pytest.approx(right, abs=0.1)
    assert right[1] < right[0] - 1


def test_suns_behind_the_land_ask_for_nothing(scene):
    """Steps and solved hours of an envelope's asks are those of a study with the land."""
    points = np.array(list_windows()[:1])
    time = {"date": "2026-03-21", "start": "00:00", "end": "24:00", "every": "5min"}
    period = find_period(StudyOptions(**time, horizon=RIDGE), LONDON)
    asked = {"receivers": "points", "points": points, "ground": 0.0, "horizon": RIDGE, **time}
    for is_continuous in (False, True):
        ask = Ask("sun", period, Places(points[:, :3], points[:, 3:]), ("w",), np.ones(1), SUM,
                  is_continuous=is_continuous)  # fmt: skip
        hours = umbra.shadow_study(scene, LONDON, exact=is_continuous, **asked).sun_hours
        assert ask.count(None) == pytest.approx(hours.values, abs=0.01)
        sun = ask.lights.directions
        azimuth = np.degrees(np.arctan2(sun[:, 0], sun[:, 1])) % 360
        edge = np.interp(azimuth, RIDGE.index, RIDGE.values, period=360)
        assert (np.degrees(np.arcsin(sun[:, 2])) > edge - 0.01).all()


def test_an_envelope_takes_no_sun_behind_the_land(scene, rule):
    """Land in the east takes the morning, so that less may be built before the rest."""
    asked = {"plot": rectangle(-40, -50, 40, -30), "rules": rule, "points": list_windows()[:1]}
    asked |= {"cell": 20.0, "ground": 0.0, "threads": 1}
    high = pd.Series([0.0, 80, 80, 80, 0, 0, 0, 0], index=np.arange(8) * 45.0)
    open_ = umbra.envelope(scene, LONDON, **asked)
    land = umbra.envelope(scene, LONDON, horizon=high, **asked)
    assert not open_.violations
    assert not land.violations
    assert land.volume_m3 < open_.volume_m3


@pytest.mark.parametrize("receivers", ["ground", "surfaces"])
def test_a_city_behind_land_is_one_study(tmp_path, receivers):
    low, high = (85000, 447000), (85100, 447070)
    west = make_houses(1, 9, low, (85050, 447070), "w")
    east = make_houses(2, 9, (85052, 447000), high, "e")
    town = [write_city(tmp_path / "a.city.json", west), write_city(tmp_path / "b.city.json", east)]
    asked = {**DAY, "every": "1h", "ground": 0.0, "receivers": receivers, "horizon": RIDGE}
    asked |= {"spacing": 4.0} if receivers == "surfaces" else {"cell": 4.0}
    asked |= {"measure": "sun_hours,sky_view_factor", "sky_directions": 64}
    scene = umbra.read(*town)
    whole = umbra.shadow_study(scene, umbra.find_site(scene), **asked).dataset
    city = umbra.city_study(town, out=tmp_path / "out", tiles=60, **asked)
    for name in ("shadow_hours", "sky_view_factor"):
        found, right = city.dataset[name].values, whole[name].values
        assert np.array_equal(np.sort(found.ravel()), np.sort(right.ravel()), equal_nan=True)
    assert city.facts["horizon_highest_deg"] == 34.0
    plain = umbra.shadow_study(scene, umbra.find_site(scene), **{**asked, "horizon": None})
    assert float(plain.shadow_hours.sum()) < float(whole.shadow_hours.sum()) - 1
    if receivers == "ground":
        again = read_job(tmp_path / "out", "ground").options.horizon
        assert again.highest == 34.0
        with pytest.raises(umbra.InputError):
            umbra.city_study(town, out=tmp_path / "out", tiles=60, **{**asked, "horizon": None})


def test_counts_know_the_land(scene):
    """Directions below it are hidden from points and ground, before lamps; sums count them."""
    ring = Horizon("ring", "", np.arange(0, 360, 45.0), np.full(8, 20.0))
    lights = np.array([[0, 1, 0.3, 0], [0, 1, 0.6, 0], [0, 1000.0, 50, 1]])
    asked = {"horizon": ring, "weights": [1.0, 2, 4]}
    points = [(0.0, 400.0, 0.0)]
    assert umbra.count(scene, points, lights, horizon=ring).tolist() == [[True, False, False]]
    assert umbra.count(scene, points, lights, **asked).tolist() == [1.0]
    assert umbra.count(scene, points, lights, of="light", **asked).tolist() == [6.0]
    ground = {"extent": (0, 390, 4, 394), "cell": 2.0, "ground": 0.0}
    assert (umbra.count(scene, "ground", lights, **asked, **ground) == 1.0).all()
    masks = umbra.count(scene, "ground", lights, horizon=ring, **ground)
    assert masks.values.reshape(-1, 3).tolist() == [[True, False, False]] * 4
