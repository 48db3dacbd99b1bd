"""Casters of a tile follow the lights that are counted: suns, lamps, any directions."""

import numpy as np
import pytest
from support.cities import DAY, make_houses, write_city

import umbra
from umbra.lights import Lights
from umbra.study.light_sums import add_up
from umbra.study.loop import Accumulator
from umbra.study.setup import Setup
from umbra.tiles.neighbourhood import find_reaching

OPTIONS = {**DAY, "every": "3h", "ground": 0.0}
EXTENT = (84980, 446980, 85220, 447090)


def make_own():
    """Return lights from all sides, level and from below, suns near the horizon, and lamps."""
    rng = np.random.default_rng(4)
    vectors = np.zeros((40, 4))
    vectors[:20, :3] = rng.normal(size=(20, 3))
    vectors[18:20, 2] = 0.0
    vectors[20:30, :3] = rng.normal(size=(10, 3)) * (1, 1, 0.02)
    vectors[20:30, 2] = np.abs(vectors[20:30, 2]) + 1e-3
    vectors[:30, :3] /= np.linalg.norm(vectors[:30, :3], axis=1)[:, None]
    vectors[30:, :3] = rng.uniform((84990, 446990, 1), (85210, 447080, 70), (10, 3))
    vectors[30:, 3] = 1
    return vectors


class Own(Accumulator):
    """Adds up lights of its own, whatever the study's are."""

    is_streamed = False
    needs_masks = False

    def __init__(self, laid):
        self.sums = np.zeros((2, *laid.shape), np.float32)
        self.dims, self.origin = laid.dims, laid.casting.scene.origin

    def add_sums(self, run, lights, progress):
        vectors = make_own()
        vectors[:, :3] -= vectors[:, 3:] * self.origin
        where = run.where if isinstance(run.where, tuple) else (run.where,)
        self.sums[0, *where] = run.add_up(Lights.of(vectors))[0]
        # As an accumulator that knows nothing of tiles asks its counter.
        suns = Lights.of(vectors[20:30, :3])
        self.sums[1, *where] = add_up(run.counters[0], run.shape, suns)[0]
        progress(len(lights))

    def variables(self, laid):
        return {"own_lights": (self.dims, self.sums[0]), "own_suns": (self.dims, self.sums[1])}


@pytest.fixture
def town(tmp_path):
    low, high = (85000, 447000), (85200, 447070)
    return [
        write_city(tmp_path / "a.city.json", make_houses(1, 25, low, (85100, 447070), "west")),
        write_city(tmp_path / "b.city.json", make_houses(2, 25, (85102, 447000), high, "east")),
    ]


@pytest.fixture
def _own(monkeypatch):
    make = Setup.make_accumulators

    def add(self, arrays, laid):
        return [*make(self, arrays, laid), Own(laid)]

    monkeypatch.setattr(Setup, "make_accumulators", add)


@pytest.mark.usefixtures("_own")
@pytest.mark.parametrize(
    "options",
    [
        {"receivers": "ground", "cell": 2.0, "extent": EXTENT},
        {"receivers": "top", "cell": 2.0, "extent": EXTENT},
        {"receivers": "surfaces", "spacing": 4.0},
    ],
)
def test_own_lights_in_tiles_are_those_of_one_piece(town, tmp_path, options):
    scene = umbra.read(*town)
    whole = umbra.shadow_study(scene, umbra.find_site(scene), **OPTIONS, **options).dataset
    made = umbra.city_study(town, out=tmp_path / "out", tiles=40, **OPTIONS, **options).dataset
    for name in ("own_lights", "own_suns", "shadow_hours"):
        found, right = made[name].values, whole[name].values
        assert found.tobytes() == right.tobytes(), (name, (found != right).mean())
    assert 10 < float(whole.own_lights.mean()) < 39
    assert 2 < float(whole.own_suns.mean()) < 10


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_lights_in_the_place_of_suns_choose_the_casters(town, tmp_path, receivers, monkeypatch):
    """The study's own lights may be any; hours are then sums of their weights."""
    options = {**OPTIONS, "every": "10min", "receivers": receivers, "cell": 2.0}
    options["extent"] = EXTENT
    scene = umbra.read(*town)
    vectors = make_own()
    own = Lights.of(vectors, np.full(len(vectors), 0.25))
    laid = umbra.count(
        scene, receivers, vectors, weights=np.full(len(vectors), 0.25), ground=0.0, cell=2.0,
        extent=EXTENT,
    )  # fmt: skip

    def make_lights(self):
        moved = vectors.copy()
        moved[:, :3] -= moved[:, 3:] * self.scene.origin
        return Lights.of(moved, own.weights)

    monkeypatch.setattr(Setup, "make_lights", make_lights)
    made = umbra.city_study(town, out=tmp_path / "out", tiles=40, **options).dataset
    np.testing.assert_array_equal(made.shadow_hours.values, laid.values)


def test_reach_of_any_light_is_that_of_every_pair_of_points():
    rng = np.random.default_rng(7)
    target = np.array([[0.0, 0, 0], [10, 10, 5]])
    low = rng.uniform((-60, -60, -40), (60, 60, 40), (3000, 3))
    boxes = np.stack([low, low + rng.uniform(1, 10, (3000, 3))], axis=1)
    lights = np.zeros((6, 4))
    lights[:3, :3] = [(0.6, 0.0, -0.8), (0, 1, 0), (-0.6, -0.8, 0.0)]
    lights[3:] = [(40, 5, 30, 1), (5, 5, 2, 1), (-30, 20, -25, 1)]
    for light in lights:
        found = find_reaching(boxes, target, light[None])
        hit = np.zeros(len(boxes), bool)
        s = np.linspace(0, 1, 1001)[:, None]
        if light[3]:
            least, most = ((1 - s) * t + s * light[:3] for t in target)
        else:
            least, most = (t + 150 * s * light[:3] for t in target)
        for k, box in enumerate(boxes):
            hit[k] = ((box[1] >= least) & (box[0] <= most)).all(1).any()
        assert 2 < hit.sum() < 1500
        assert not (hit & ~found).any()
        assert (found & ~hit).sum() < 40  # between two steps
