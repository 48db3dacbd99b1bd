"""Elevations and views from above, counted by patches: against rays from every pixel."""

import numpy as np
import pytest
from support.days import parts
from support.raycaster import RayCaster
from support.shapes import box, city, moved, sheet, torus_knot, turned

import umbra
from umbra.rays.depth import GROUND
from umbra.rays.hidden import find_hidden
from umbra.receivers import seen as seen_module
from umbra.study import StudyOptions, run_study, show_samples
from umbra.study import run as run_options

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-06-05", "start": "06:15", "end": "19:15", "every": "40min", "masks": True}
EDGE = 1e-6


@pytest.fixture(scope="module")
def block():
    """Make a tilted town, a roof seen from behind and below, a knot, and a wall with a hole."""
    back = sheet([(-14, -20, 1), (-14, -12, 6), (-6, -12, 6), (-6, -20, 1)])
    return parts(
        town=turned(city(3, seed=5, cell=11.0), 23), tower=box((-3, -30, 0), (2, -26, 25)),
        back=back, knot=moved(torus_knot(60, 8), (16, -22, 6)),
        wall=box((4, -24, 0), (12, -23.5, 5)), low=box((-20, -40, 0), (20, -38, 1)),
    )  # fmt: skip


def run(scene, **options):
    return umbra.shadow_study(scene, VIENNA, **{**DAY, **options})


@pytest.mark.parametrize("receivers", ["south", "203", "215/35", "30/80"])
def test_elevations_of_some_parts_are_what_rays_find(block, receivers, monkeypatch):
    options = {"receivers": receivers, "on": ["town", "back", "knot", "wall"], "size": (140, 90)}
    made = []
    make = seen_module.make_pixel_patches
    monkeypatch.setattr(
        seen_module, "make_pixel_patches", lambda *given: made.append(make(*given)) or made[-1]
    )
    counted = run_study(block, VIENNA, **{**DAY, **options}).to_dataset()
    monkeypatch.setattr(seen_module, "MANY_SUNS", 10**9)
    asked = run_study(block, VIENNA, **{**DAY, **options}).to_dataset()
    assert len(made) == 1
    is_counted = np.isfinite(made[0].graze).repeat(np.diff(made[0].first))
    assert is_counted.mean() > 0.5
    differ = np.argwhere(counted.in_shadow.values != asked.in_shadow.values)
    soup = block.triangles()
    rays, none = RayCaster(soup.vertices, soup.faces), np.zeros(len(soup.faces), bool)
    for step, row, col in differ:
        far = rays.distance_to_shadow_edges(
            counted.position.values[None, row, col] - block.origin,
            counted.normal.values[None, row, col], np.array([-1]),
            np.append(counted.sun_direction.values[step], 0.0), none,
        )  # fmt: skip
        assert far[0] <= EDGE
    assert len(differ) <= 20
    seen = np.isfinite(counted.shadow_hours.values)
    assert seen.sum() > 2000
    assert 0.1 < counted.in_shadow.values[:, seen].mean() < 0.9


def test_rays_count_few_suns_and_perspective_pictures(block, monkeypatch):
    monkeypatch.setattr(seen_module, "make_pixel_patches", None)
    run(block, receivers="south", on=["town"], every="3h", size=(40, 30))
    run(block, receivers="camera", on=["town"], eye=(0, -90, 40), target=(0, 0, 5), size=(40, 30))


@pytest.mark.parametrize("receivers", ["south", "215/35"])
@pytest.mark.parametrize("options", [{}, {"canopy": ["knot"]}, {"on": ["town", "wall"]}])
def test_hours_by_caster_are_what_rays_find(block, receivers, options, monkeypatch):
    options = {"receivers": receivers, "by": "part", "size": (100, 70), "masks": False, **options}
    counted = run(block, **options)
    monkeypatch.setattr(seen_module.ViewTile, "count_pieces", lambda *_: None)
    asked = run(block, **options)
    for name in ("cast_hours", "sole_hours"):
        same = np.isclose(counted[name], asked[name], atol=1e-5, equal_nan=True)
        assert (~same).sum() <= 6
        assert float(counted[name].sum()) > 0


def test_the_picture_of_surfaces_has_the_hours_of_their_nearest_samples(block, monkeypatch):
    times = {**DAY, "masks": False, "date": "2026-06-05,2026-12-05"}
    options = StudyOptions(receivers="215/35", size=(140, 90), **times)
    study = run_options(block, VIENNA, StudyOptions(receivers="surfaces", spacing=0.7, **times))
    with monkeypatch.context() as broken:
        broken.setattr(seen_module.ViewTile, "masks", None)  # no pixel is counted
        broken.setattr(seen_module.ViewTile, "make_counter", None)
        shown = show_samples(study, options)
    samples, tile = study.samples, shown.laid.tile
    surface = tile.sampled
    # Of samples that lie in no other body, as far as the view tells.
    toward = -np.asarray(tile.camera.axes()[2])[None]
    hidden = find_hidden(tile.tree, samples.points, samples.normals, toward)[0].astype(bool)
    hidden &= np.bincount(samples.surface, ~hidden)[samples.surface] > 0
    assert hidden.any()
    points = shown.laid.tile.places.points.reshape(*surface.shape, 3)
    seen = np.argwhere(surface >= 0)
    assert len(seen) > 1000
    for row, col in seen[:: len(seen) // 300]:
        own = np.flatnonzero((samples.surface == surface[row, col]) & ~hidden)
        away = np.linalg.norm(samples.points[own] - points[row, col], axis=1)
        nearest = own[away <= away.min() + 1e-6]
        assert shown.shadow_hours[row, col] in study.shadow_hours[nearest]
        for day in (0, 1):
            drawn = shown.more["shadow_hours_by_day"][1][day, row, col]
            assert drawn in study.more["shadow_hours_by_day"][1][day, nearest]
    counted = run_options(block, VIENNA, StudyOptions(receivers="215/35", size=(140, 90), **times))
    ground = counted.more["part"][1] == GROUND
    assert np.isfinite(shown.shadow_hours[ground]).all()
    far = np.abs(shown.shadow_hours - counted.shadow_hours)[ground]
    assert np.mean(far) < 0.25  # cells are not the pixels
