"""What is said of a ground that was assumed."""

import pytest
from support.model_files import save_obj
from support.shapes import box


@pytest.fixture
def hillside(tmp_path):
    boxes = {f"h{k}": box((20 * k, 0, 5 * k), (20 * k + 8, 9, 5 * k + 6)) for k in range(5)}
    return save_obj(tmp_path / "hill.obj", boxes)


def test_a_study_of_a_hillside_says_what_it_assumes(study, hillside):
    said = study(files=[hillside])
    assert said.status == 0
    assert "through the feet of 5 buildings" in said.err
    assert said.err.count("\n") == 1
    said = study("--ground", "level", files=[hillside])
    assert "level at z = 10 m; 5 objects stand at 0 to 20 m" in said.err
    assert said.err.count("\n") == 1
    for options in (["--ground", "10"], ["--quiet"]):
        assert study(*options, files=[hillside]).err == ""


def test_ground_that_the_model_does_not_bring_is_named(study, tmp_path):
    path = save_obj(tmp_path / "h.obj", {"house": box((0, 0, 0), (10, 10, 6))})
    half = ["--receivers", "top", "--extent", "-10,0,10,10", "--cell", "1", "--json"]
    said = study(*half, files=[path])
    assert said.json()["assumed_ground_share"] == 0.5
    # The roof is in the sun all day; the ground, in shadow for a part of it, is in no mean.
    assert said.json()["mean_shadow_hours"] == 0
    assert "nothing of the model lies under 50 % of the plan" in said.err
    assert "z = 0 m" in said.err
    told = study(*half, "--ground", "0", files=[path])
    assert told.err == ""
    assert told.json()["mean_shadow_hours"] > 0


def test_a_base_that_is_not_zero_is_told_where_ground_is_assumed(study, tmp_path):
    """A cellar or a foundation below the ground makes all shadows longer than they are."""
    path = save_obj(tmp_path / "h.obj", {"house": box((0, 0, -1.5), (10, 10, 6))})
    said = study(files=[path])
    assert "the ground is assumed level at z = -1.5 m, the base of the model" in said.err
    for options in (["--ground", "-1.5"], ["--quiet"]):
        assert study(*options, files=[path]).err == ""
    level = save_obj(tmp_path / "level.obj", {"house": box((0, 0, 0), (10, 10, 6))})
    assert study(files=[level]).err == ""


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_a_ground_that_misses_the_model_is_told(study, tmp_path, receivers):
    """A city at 171 m on --ground 0 throws its shadows from the air."""
    path = save_obj(tmp_path / "h.obj", {"house": box((0, 0, 171), (10, 10, 180))})
    place = ["--receivers", receivers, "--extent", "-20,-20,30,30"]
    for ground, where in (("0", "171 m below the model"), ("180", "above the whole model")):
        said = study(*place, "--ground", ground, files=[path])
        assert f"lies {where}, which reaches from z = 171 to 180 m; --ground is" in said.err
    assert study(*place, "--ground", "170", files=[path]).err == ""
