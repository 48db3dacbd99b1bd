"""Slips that would give nonsense in silence: each is refused, and the remedy is one to type."""

import pytest
from support.command import VIENNA
from support.model_files import save_obj
from support.shapes import box

HOUSE = box((0, 0, 0), (4, 3, 2))
DAY = ["--date", "2026-03-21", "--every", "4h", *VIENNA]


@pytest.fixture
def model(tmp_path):
    tower = box((10, 0, 0), (13, 3, 9))
    return save_obj(tmp_path / "m.obj", {"House": HOUSE, "Tower": tower})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--receivers", "400"], ["between 0 and 360 degrees", "the same as 40?"]),
        (["--receivers", "-30/35"], ["between 0 and 360 degrees", "the same as 330?"]),
        (["--extent", "340000,0,340100,100"], ["340 km", "x 0 to 13, y 0 to 3"]),
        (["--under", "3h"], ["--proposed"]),
        (["--proposed", "tower"], ["did you mean 'Tower'?"]),
        (["--no-cast", "Huose"], ["did you mean 'House'?"]),
        (["--cell", "50 inches"], ["50cm"]),
        (["--cell", "abc"], ["metres"]),
        (["--lat", "48,2"], ["'48,2' is not a number, such as 48.2"]),
        (["--threads", "0"], ["0 is less than 1"]),
        (["--threads", "two"], ["'two' is not a whole number"]),
        (["--tiles"], ["--tiles needs a value before --out; write --tiles LENGTH --out"]),
    ],
)
def test_a_slip_in_a_study_is_named(umbra_here, tmp_path, model, options, words):
    said = umbra_here("study", model, *DAY, *options, "--out", tmp_path / "out")
    assert said.status == 2
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    for word in words:
        assert word in said.err
    assert not (tmp_path / "out").exists()


def test_an_extent_that_shadows_reach_is_taken(umbra_here, tmp_path, model):
    # The sun at 16:00 stands low in the south-west: the shadow falls north-east of the model.
    beside = ["--extent", "14,4,44,34", "--cell", "2"]
    said = umbra_here("study", model, *DAY, *beside, "--out", tmp_path / "out", "--json")
    assert said.json()["most_shadow_hours"] > 0


@pytest.mark.parametrize(
    ("text", "metres"), [("50cm", 0.5), ("500 mm", 0.5), ("1.5m", 1.5), ("5 ft", 1.524)]
)
def test_lengths_may_have_a_unit(umbra_here, tmp_path, model, text, metres):
    few = ["--extent", "0,0,30,30"]
    said = umbra_here("study", model, *DAY, *few, "--cell", text, "--out", tmp_path / "o", "--json")
    assert said.json()["cell"] == [metres, metres]


def draw(umbra_here, tmp_path, model, *options):
    size = ["--size", "80x60"]
    return umbra_here("render", model, *size, *options, "--out", tmp_path / "p.png", "--json")


def test_a_light_is_a_point_or_a_direction(umbra_here, tmp_path, model):
    said = draw(umbra_here, tmp_path, model, "--light", "1,2,3,2")
    assert said.status == 2
    assert "1 (a point) or 0 (a direction" in said.err


@pytest.mark.parametrize("metres", [1e-2, 0.1, 10, 1e4])
def test_a_model_of_any_size_is_seen_whole(umbra_here, tmp_path, metres):
    path = save_obj(tmp_path / "s.obj", {"cube": box((0, 0, 0), (metres,) * 3)})
    said = draw(umbra_here, tmp_path, path, "--no-ground")
    assert said.err == ""
    assert said.json()["pixels"] == pytest.approx(1662, abs=20)


def test_a_view_of_nothing_is_told(umbra_here, tmp_path, model):
    away = ["--eye", "0,-20,1", "--target", "0,-40,1"]
    said = draw(umbra_here, tmp_path, model, *away)
    assert said.status == 0
    assert "nothing is seen" in said.err
    assert "--target 6.5,1.5,4.5" in said.err
    assert draw(umbra_here, tmp_path, model, *away, "--ground", "0").err == ""


def test_a_near_plane_that_cuts_is_told(umbra_here, tmp_path, model):
    ahead = ["--eye", "2,-1,1", "--target", "2,5,1", "--no-ground"]
    said = draw(umbra_here, tmp_path, model, *ahead, "--near", "1.5")
    assert "cuts the model open in" in said.err
    assert draw(umbra_here, tmp_path, model, *ahead, "--near", "0.5").err == ""
    # What stands behind the eye is not cut.
    assert draw(umbra_here, tmp_path, model, *ahead).err == ""


def test_the_sun_lights_a_picture(umbra_here, tmp_path, model):
    import numpy as np  # noqa: PLC0415

    import umbra  # noqa: PLC0415

    arrays = tmp_path / "a.npz"
    sun = [*VIENNA, "--date", "2026-03-21", "--at", "15:00", "--arrays", arrays]
    assert draw(umbra_here, tmp_path, model, *sun).err == ""
    light = umbra.sun_light(umbra.Site(48.2, 16.37), "2026-03-21", "15:00")
    x, y, z, w = light.position
    assert w == 0
    # 14:58 by the sun: an hour angle of 44.5 degrees; cos 48.2 cos 44.5 is sin 28.4.
    assert np.degrees(np.arcsin(z)) == pytest.approx(28.6, abs=0.3)
    assert np.degrees(np.arctan2(x, y)) % 360 == pytest.approx(233, abs=1)
    lit = np.load(arrays)["lit"][0]
    words = ["--light", ",".join(map(str, light.position)), "--arrays", arrays]
    draw(umbra_here, tmp_path, model, *words)
    np.testing.assert_array_equal(np.load(arrays)["lit"][0], lit)
    assert lit.any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--date", "2026-03-21"], "--lat and --lon"),
        (["--at", "15:00"], "--date"),
        (["--lat", "48"], "--date and --at"),
        (["--date", "2026-03-21", "--at", "23:00", *VIENNA], "below the horizon"),
        (["--date", "2026-03-21", "--at", "15:00"], "--lat and --lon"),
        (["--date", "2026-03-21", "--at", "quarter to nine", *VIENNA], "HH:MM"),
    ],
)
def test_half_a_sun_is_refused(umbra_here, tmp_path, model, options, words):
    said = draw(umbra_here, tmp_path, model, *options)
    assert said.status == 2
    assert words in said.err
    assert not (tmp_path / "p.png").exists()


@pytest.mark.parametrize("name", ["page.txt", "shots"])
def test_what_a_view_writes_is_known_by_its_ending(umbra_here, model, name):
    said = umbra_here("view", model, *VIENNA, "--out", name)
    assert said.status == 2
    assert f"'{name}' would be a page or a screenshot" in said.err
