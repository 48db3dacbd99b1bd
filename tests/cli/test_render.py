"""``umbra render``: pictures and arrays."""

import json

import numpy as np
import pytest
from matplotlib.image import imread
from support.model_files import save_obj
from support.shapes import box, rewound, sheet

# From 10 m above a table of 2 x 2 m at z = 4, straight down; north is up in the picture.
ABOVE = ["--eye", "0,0,10", "--target", "0,0,0", "--up", "0,1,0", "--fov", "90"]
SKEWED = ["--eye", "-5,-6,7", "--target", "0,0,2"]


@pytest.fixture
def table(tmp_path):
    corners = [(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)]
    return save_obj(tmp_path / "table.obj", {"table": sheet(corners)})


@pytest.fixture
def render(umbra_here, table, tmp_path):
    def run(*options, files=None):
        where = ["--out", tmp_path / "a.png", "--arrays", tmp_path / "a.npz"]
        said = umbra_here("render", *(files or [table]), *where, *options)
        assert said.status == 0, said
        with np.load(tmp_path / "a.npz") as arrays:
            return said, dict(arrays)

    return run


def test_arrays_of_a_scene_that_is_solved_by_hand(render, tmp_path):
    # The picture is 20 x 20 m on the ground in 200 pixels: 0.1 m each. A sun at 45 degrees in
    # the south-west (toward -x, -y) moves the table's shadow by 4 m to +x and +y in all.
    said, arrays = render(
        *ABOVE, "--size", "200x200", "--ground", "0", "--light", "-1,0,1,0", "--light", "0,0,8",
    )  # fmt: skip
    assert set(arrays) == {"position", "normal", "count", "lit"}
    assert arrays["position"].shape == arrays["normal"].shape == (200, 200, 3)
    assert arrays["count"].shape == arrays["lit"].shape == (2, 200, 200)
    assert arrays["position"].dtype == np.float64
    assert arrays["normal"].dtype.kind == "f"
    assert arrays["count"].dtype == np.int32
    assert arrays["lit"].dtype == np.bool_
    position, count, lit = arrays["position"], arrays["count"], arrays["lit"]
    # Pixel centres, row 0 at the top: the first pixel is the north-west corner.
    np.testing.assert_allclose(position[0, 0], [-9.95, 9.95, 0], atol=1e-9)
    np.testing.assert_allclose(position[199, 0], [-9.95, -9.95, 0], atol=1e-9)
    np.testing.assert_allclose(position[0, 199], [9.95, 9.95, 0], atol=1e-9)
    # The table, at 6 m from the eye, covers what 10/6 of it covers on the ground.
    is_table = position[..., 2] > 1
    np.testing.assert_allclose(position[is_table][:, 2], 4, atol=1e-12)
    rays = position[..., :2] * np.where(is_table, 10 / 6, 1)[..., None]
    np.testing.assert_array_equal(is_table, (np.abs(rays) < 10 / 6).all(-1))
    np.testing.assert_array_equal(arrays["normal"], np.broadcast_to([0, 0, 1.0], (200, 200, 3)))
    # The sun moves the shadow 4 m east; the lamp, 4 m over the table, doubles it.
    x, y = position[..., 0], position[..., 1]
    sun = ~is_table & (np.abs(x - 4) < 1) & (np.abs(y) < 1)
    lamp = ~is_table & (np.abs(x) < 2) & (np.abs(y) < 2)
    np.testing.assert_array_equal(count, np.stack([sun, lamp]))
    np.testing.assert_array_equal(lit, count == 0)
    assert sun.sum() == 400
    assert said.out.splitlines() == [str(tmp_path / "a.png"), str(tmp_path / "a.npz")]
    assert not said.err


def test_nothing_is_nan_zero_and_unlit(render):
    _, arrays = render(*ABOVE, "--size", "64x48", "--light", "0,0,1,0")
    nothing = np.isnan(arrays["position"]).any(-1)
    assert 0 < nothing.sum() < nothing.size
    assert np.isnan(arrays["position"][nothing]).all()
    assert np.isnan(arrays["normal"][nothing]).all()
    assert not arrays["count"][0][nothing].any()
    assert not arrays["lit"][0][nothing].any()
    assert arrays["lit"][0][~nothing].all()


def test_normals_are_on_the_side_that_is_seen(render, tmp_path):
    meshes = {"box": rewound(box((-1, -1, 0), (1, 1, 3)), [2, 3, 8])}
    path = save_obj(tmp_path / "box.obj", meshes)
    _, arrays = render(*SKEWED, "--size", "80x60", "--light", "-3,-9,9", files=[path])
    seen = ~np.isnan(arrays["position"]).any(-1)
    toward = np.array([-5, -6, 7]) - arrays["position"][seen]
    normal = arrays["normal"][seen]
    assert (np.einsum("ij,ij->i", normal, toward) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-12)
    sides = {tuple(n) for n in np.rint(normal).tolist()}
    assert sides == {(0, 0, 1), (-1, 0, 0), (0, -1, 0)}


def test_lit_means_no_shadow_and_turned_to_the_light(render, tmp_path):
    path = save_obj(tmp_path / "box.obj", {"box": box((-1, -1, 0), (1, 1, 3))})
    light = np.array([6.0, -4.0, 8.0])
    _, arrays = render(
        *SKEWED, "--size", "160x120", "--ground", "0", "--light", "6,-4,8", files=[path]
    )
    seen = ~np.isnan(arrays["position"]).any(-1)
    way = light - np.nan_to_num(arrays["position"])
    facing = np.einsum("ijk,ijk->ij", np.nan_to_num(arrays["normal"]), way) > 0
    count, lit = arrays["count"][0], arrays["lit"][0]
    np.testing.assert_array_equal(lit, seen & facing & (count == 0))
    west = seen & (arrays["normal"][..., 0] == -1)  # turned from the light, however it counts
    assert west.sum() > 100
    assert not lit[west].any()
    ground = seen & (np.abs(arrays["position"][..., 2]) < 1e-9)
    assert set(np.unique(count[ground])) == {0, 1}


def test_picture_is_darker_in_shadow_and_has_row_0_at_the_top(render, tmp_path):
    _, arrays = render(*ABOVE, "--size", "200x160", "--ground", "0", "--light", "0,-1,1,0")
    picture = imread(tmp_path / "a.png")[..., :3].mean(-1)
    assert picture.shape == (160, 200)
    ground = arrays["position"][..., 2] == 0
    shadow = ground & (arrays["count"][0] == 1)
    assert shadow[:80].any()  # the sun in the south casts to the north, up in the picture
    assert not shadow[90:].any()
    assert picture[shadow].max() < picture[ground & ~shadow].min()


def test_lights_count_one_by_one_spots_last(render):
    said, arrays = render(
        *ABOVE, "--size", "100x100", "--ground", "0", "--spot", "5,5,5,5,5,0,30",
        "--light", "0,0,8", "--light", "1,1,1,0", "--json",
    )  # fmt: skip
    assert arrays["count"].shape[0] == 3
    lit, position = arrays["lit"][2], arrays["position"]
    ground = position[..., 2] == 0
    apart = np.hypot(position[..., 0] - 5, position[..., 1] - 5)
    cone = ground & (apart < 5 * np.tan(np.radians(30)))
    np.testing.assert_array_equal(lit & ground, cone & (arrays["count"][2] == 0))
    found = said.json()
    assert found["pixels"] == 10_000
    assert found["deepest_count"] == [1, 1, 0]
    np.testing.assert_allclose(found["lit_share"], arrays["lit"].mean((1, 2)))


def test_orthographic_pictures_have_parallel_rays(render):
    _, arrays = render(
        "--eye", "0,0,10", "--target", "0,0,0", "--up", "0,1,0", "--height", "12",
        "--size", "120x120", "--ground", "0", "--light", "-1,0,1,0",
    )  # fmt: skip
    np.testing.assert_allclose(arrays["position"][0, 0, :2], [-5.95, 5.95], atol=1e-9)
    is_table = arrays["position"][..., 2] > 1
    assert is_table.sum() == 400
    assert (arrays["count"][0] == 1).sum() == 400


@pytest.mark.parametrize("method", ["auto", "z-pass", "z-fail"])
def test_methods_agree_where_all_are_right(render, method):
    _, arrays = render(
        *ABOVE, "--size", "100x100", "--ground", "0", "--light", "-1,0,1,0", "--method", method
    )
    assert (arrays["count"][0] == 1).sum() == 100


def test_z_pass_says_where_it_is_wrong_and_still_draws(render):
    # The eye under the table stands in the shadow of a lamp above it.
    view = ["--eye", "0,-0.5,2", "--target", "0,9,0", "--size", "80x60", "--ground", "0"]
    said, right = render(*view, "--light", "0,0,8")
    assert not said.err
    said, wrong = render(*view, "--light", "0,0,8", "--method", "z-pass")
    assert "z-pass is wrong for this view" in said.err
    assert said.err.count("\n") == 1
    assert (wrong["count"] != right["count"]).any()
    said, _ = render(*view, "--light", "0,0,8", "--method", "z-pass", "--quiet")
    assert (said.out, said.err) == ("", "")
    said, same = render(*view, "--light", "0,0,8", "--method", "z-fail")
    assert not said.err
    np.testing.assert_array_equal(same["count"], right["count"])


def test_json_is_one_object(render, tmp_path):
    said, _ = render(*SKEWED, "--size", "32x24", "--light", "1,1,9", "--json")
    assert said.json()["files"] == [str(tmp_path / "a.png"), str(tmp_path / "a.npz")]


def test_threads_change_nothing(render):
    options = [*SKEWED, "--size", "120x90", "--ground", "0", "--light", "6,-4,8"]
    _, one = render(*options, "--threads", "1")
    _, two = render(*options, "--threads", "2")
    for name, array in one.items():
        np.testing.assert_array_equal(two[name], array)


def test_without_a_view_and_a_light_the_whole_model_is_seen_and_lit(render):
    _, arrays = render("--size", "80x60")
    seen = ~np.isnan(arrays["position"][..., 0])
    assert 0.02 < seen.mean() < 0.9
    assert not np.concatenate([seen[[0, -1]].ravel(), seen[:, [0, -1]].ravel()]).any()
    assert arrays["lit"][0][seen].all()


@pytest.mark.parametrize("half", [["--eye", "0,-9,5"], ["--target", "0,0,0"]])
def test_half_a_view_is_refused(umbra_here, table, tmp_path, half):
    said = umbra_here("render", table, *half, "--out", tmp_path / "a.png")
    assert "both --eye X,Y,Z and --target X,Y,Z" in said.refusal()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--light", "0,0,8"], "nothing to write"),
        (["--out", "a.jpg", "--light", "0,0,8"], "name it a.png"),
        (["--out", "a.png", "--light", "0,8"], "X,Y,Z"),
        (["--out", "a.png", "--light", "0,0,nan"], "X,Y,Z"),
        (["--out", "a.png", "--light", "0,0,0,0"], "--light 0,0,0,0: "),
        (["--out", "a.png", "--light", "0,0,8,-1"], "--light 0,0,8,-1 has a W of -1; it is 1 (a"),
        (["--out", "a.png", "--light", "0,0,8", "--method", "alpha"], "auto, z-pass, z-fail"),
        (["--out", "a.png", "--light", "0,0,8", "--method", "lengyel"], "auto, z-pass, z-fail"),
        (
            ["--out", "a.png", "--light", "0,0,8", "--device", "gl", "--method", "fast"],
            "lengyel, mcguire",
        ),
        (["--out", "a.png", "--light", "0,0,8", "--size", "0x4"], "COLSxROWS"),
        (["--out", "a.png", "--light", "0,0,8", "--size", "999999x999999"], "would fit"),
        (["--out", "a.png", "--light", "0,0,8", "--near", "0"], "--near must lie"),
        (
            ["--out", "a.png", "--light", "0,0,8", "--fov", "180"],
            "--fov, must lie between 0 and 180",
        ),
        (["--out", "a.png", "--light", "0,0,8", "--up", "0,0,1", "--eye", "0,0,9"], "looks along"),
        (["--out", "a.png", "--light", "0,0,8", "--up", "z"], "the file's own axis is --axis-up"),
        (["--out", "a.png", "--spot", "0,0,8,0,0,8,20"], "--spot 0,0,8,0,0,8,20: a spot light"),
        (["--arrays", "table.obj"], "'table.obj' would be arrays of NumPy; name it table.npz"),
        (["--out", "a.png", "--arrays", "a.png"], "would be arrays of NumPy; name it a.npz"),
        (["--out", "table.obj/a.png", "--light", "0,0,8"], "not a folder"),
    ],
)
def test_wrong_options_are_refused_in_one_line(
    umbra_here, table, tmp_path, monkeypatch, options, words
):
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    view = ["--eye", "0,-9,5", "--target", "0,0,0"]
    assert words in umbra_here("render", table, *view, *options).refusal()
    assert sorted(tmp_path.iterdir()) == before


def test_a_failed_render_keeps_the_old_picture(render, umbra_here, tmp_path):
    render(*SKEWED, "--size", "32x24", "--light", "1,1,9")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    said = umbra_here(
        "render", tmp_path / "none.obj", *SKEWED, "--light", "1,1,9",
        "--out", tmp_path / "a.png", "--arrays", tmp_path / "a.npz",
    )  # fmt: skip
    assert "no such file" in said.refusal()
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_film_is_written_or_said_why_not(umbra_here, table, tmp_path):
    out = tmp_path / "turn.gif"
    small = ["--size", "32x24", "--samples", "1", "--style", "plain", "--rate", "4"]
    said = umbra_here("render", table, "--turntable", "1s", *small, "--out", out, "--json")
    assert said.status == 0
    assert json.loads(said.out) == {"files": [str(out)], "frames": 4, "seconds": 1.0}
    for wrong in (
        ["--turntable", "1s", "--out", tmp_path / "a.png"],
        ["--out", tmp_path / "a.mp4"],
        ["--turntable", "1s", "--out", out, "--arrays", tmp_path / "a.npz"],
    ):
        said = umbra_here("render", table, *small, *wrong)
        assert said.status == 2
        assert not (tmp_path / "a.png").exists()
