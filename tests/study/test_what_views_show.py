"""Views: canopies before what is seen, ground below what is seen from above, and what counts."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.shapes import box

from umbra.rays.depth import GROUND
from umbra.scene import Mesh, Part, make_scene
from umbra.study import StudyOptions, make_preview, run, run_study, show_samples
from umbra.sun import Site
from umbra.writers.folder import Outputs
from umbra.writers.folder.captions import describe

SITE = Site(48.2, 16.37, "Europe/Vienna")
SHAPES = {"house": box((0, 10, 0), (20, 14, 6)), "tree": box((4, 2, 1), (8, 6, 4))}


def make_study(kind="", **options):
    kinds = {"tree": kind}
    parts = [Part(name, kinds.get(name, ""), Mesh(*mesh)) for name, mesh in SHAPES.items()]
    chosen = {"date": "2026-06-21", "start": "10:00", "end": "14:00", "every": "1h"} | options
    return run_study(make_scene(parts), SITE, **chosen)


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_a_plan_knows_where_canopies_hang(receivers):
    study = make_study(receivers=receivers, canopy=["tree"], extent=(-4, -4, 24, 20), cell=1)
    found = make_preview(study).find_canopies()
    x, y = np.meshgrid(study.x, study.y)
    np.testing.assert_array_equal(found, (x > 4) & (x < 8) & (y > 2) & (y < 6))


def test_an_elevation_knows_what_canopies_stand_before_it():
    study = make_study(receivers="south", canopy=["tree"], extent=(-2, 0, 22, 8), cell=0.5)
    found = make_preview(study).find_canopies()
    x, z = np.meshgrid(study.x, study.y)
    np.testing.assert_array_equal(found, (x > 4) & (x < 8) & (z > 1) & (z < 4))
    behind = make_study(receivers="north", canopy=["tree"], extent=(-22, 0, 2, 8), cell=0.5)
    assert not make_preview(behind).find_canopies().any()  # the house hides it


def test_without_canopies_there_are_none():
    assert not make_preview(make_study(receivers="215/35")).find_canopies().any()


def test_a_view_from_above_has_ground_with_hours_that_do_not_count():
    study = make_study(receivers="180/30", cell=0.25)
    part = study.more["part"][1]
    assert (part == GROUND).any()
    assert np.isfinite(study.shadow_hours).all()
    ground = study.shadow_hours[part == GROUND]
    assert ground.min() == 0
    assert ground.max() > 0.5  # the tree's shadow
    z = study.more["position"][1][..., 2]
    np.testing.assert_allclose(z[part == GROUND], 0, atol=1e-9)
    counted = study.kind.find_counted(study)
    np.testing.assert_array_equal(counted.which, part >= 0)


def test_ground_that_a_model_brings_is_all_there_is():
    study = make_study(kind="TINRelief", receivers="180/30", cell=0.25)
    assert not (study.more["part"][1] == GROUND).any()


def test_the_sky_has_no_hours_and_counts_nowhere():
    study = make_study(receivers="camera", eye=(10, -20, 1.7), target=(10, 10, 4), size=(80, 60))
    sky = study.more["part"][1] == -1
    assert sky.any()
    np.testing.assert_array_equal(np.isnan(study.shadow_hours), sky)
    np.testing.assert_array_equal(np.isnan(study.sun_hours), sky)


def test_an_elevation_looks_through_the_proposed_at_what_loses_sun_behind_it():
    study = make_study(
        receivers="south", proposed=["tree"], extent=(-2, 0, 22, 8), cell=0.5, date="2026-01-05"
    )
    x, z = np.meshgrid(study.x, study.y)
    before = make_preview(study).find_cells([1])
    np.testing.assert_array_equal(before, (x > 4) & (x < 8) & (z > 1) & (z < 4))
    house = (x > 0) & (x < 20) & (z < 6)
    np.testing.assert_array_equal(np.isfinite(study.more["hours_lost"][1]), house)
    assert study.more["neighbour_area"][1] == pytest.approx([120])  # all of the house's wall
    alone = make_study(receivers="south", proposed=["tree"], on=["tree"], cell=0.5)
    assert set(np.unique(alone.more["part"][1])) == {-1, 1}


def test_a_view_judges_no_ground_below_the_proposed():
    study = make_study(receivers="215/35", proposed=["tree"], cell=0.25)
    lost, place = study.more["hours_lost"][1], study.more["position"][1]
    x, y, z = np.moveaxis(place, -1, 0)
    below = (x > 4) & (x < 8) & (y > 2) & (y < 6)
    assert (z[below] == 0).any()
    np.testing.assert_array_equal(np.isnan(lost), below)


def make_picture(**options):
    """Run the study of which the picture of surfaces is drawn."""
    parts = [Part(name, "", Mesh(*mesh)) for name, mesh in SHAPES.items()]
    day = {"date": "2026-06-21", "start": "10:00", "end": "14:00", "every": "1h", "cell": 0.25}
    chosen = StudyOptions(receivers="180/30", **day, **options)
    scene, found = make_scene(parts), chosen.ask_hours("surfaces", on=chosen.on, spacing=0.25)
    return show_samples(run(scene, SITE, found), chosen)


def test_the_picture_of_surfaces_shows_all_with_the_hours_of_those_asked_for():
    study, whole = make_picture(on=["house"]), make_picture()
    part, has_hours = study.more["part"][1], np.isfinite(study.shadow_hours)
    assert {0, 1, GROUND} <= set(np.unique(part))  # the tree before the house is drawn
    np.testing.assert_array_equal(has_hours, part == 0)
    preview = make_preview(study)
    assert (preview.heights == 1).all()  # nothing of it is sky
    assert not preview.shadows[:, preview.nothing].any()
    # Hours are those of the whole picture, which is larger, as the tree counts.
    hours = [one.shadow_hours[one.more["part"][1] == 0] for one in (study, whole)]
    assert hours[0].mean() == pytest.approx(hours[1].mean(), abs=0.01)
    assert study.shadow_hours.shape < whole.shadow_hours.shape


def test_asked_parts_are_drawn_even_where_others_are_looked_through():
    study = make_picture(on=["house", "tree"], canopy=["tree"])
    np.testing.assert_array_equal(np.isfinite(study.shadow_hours), study.more["part"][1] == 0)
    new = make_picture(on=["tree"], proposed=["tree"])
    np.testing.assert_array_equal(np.isfinite(new.shadow_hours), new.more["part"][1] == 1)
    assert (new.more["part"][1] == 0).any()


def test_the_picture_of_surfaces_says_whose_hours_it_shows():
    parts = [Part(name, "", Mesh(*mesh)) for name, mesh in SHAPES.items()]
    options = StudyOptions(date="2026-06-21", every="1h", receivers="180/30", cell=0.5, on=["tree"])
    found = options.ask_hours("surfaces", on=options.on, spacing=0.5)
    study = show_samples(run(make_scene(parts), SITE, found), options)
    job = SimpleNamespace(scene=study.model.scene, study=study, options=options, outputs=Outputs())
    plan = describe(job, make_preview(study), range(1))
    assert "hours of tree alone" in plan.note
    assert plan.nothing_name == "not asked"
    np.testing.assert_array_equal(plan.nothing, study.more["part"][1] != 1)


def test_a_ground_through_feet_is_not_of_the_model():
    """On a slope the ground is a mesh of its own, which a view from above shows, too."""
    houses = [
        Part(f"house {k}", "", Mesh(*box((12 * k, 0, 3 * k), (12 * k + 6, 6, 3 * k + 6))))
        for k in range(4)
    ]
    study = run_study(
        make_scene(houses), SITE, date="2026-03-21", start="11:00", end="13:00", every="1h",
        receivers="180/40", cell=0.5,
    )  # fmt: skip
    part = study.more["part"][1]
    assert set(np.unique(part[part != -1])) <= {GROUND, 0, 1, 2, 3}
    assert (part == GROUND).any()


@pytest.mark.parametrize(
    ("extent", "is_cut"), [((-30, -30, 50, 50), False), ((-9, -9, 50, 50), True)]
)
def test_ground_near_buildings_is_named_with_the_frame_that_cuts_it(extent, is_cut):
    study = make_study(receivers="ground", extent=extent, cell=1)
    what = study.kind.find_counted(study).what
    assert ("in the frame" in what) == is_cut
