"""``--time``: animated files as they stand at one time; and a file's own lights."""

import numpy as np
import pytest
from support.gltf_files import Document
from support.shapes import box

VIEW = ["--eye", "0,0,20", "--target", "0,0,0", "--up", "0,1,0", "--height", "16"]


@pytest.fixture
def lift(tmp_path):
    """A cube of 1 m that rises from 0 to 4 m in 2 s, or slides 3 m east in 1 s; a lamp."""
    document = Document()
    vertices, faces = box((-0.5, -0.5, 0), (0.5, 0.5, 1))
    primitive = {
        "attributes": {
            "POSITION": document.accessor((vertices[:, [0, 2, 1]] * (1, 1, -1)).astype("f4"))
        },
        "indices": document.accessor(np.asarray(faces, "u2").ravel()),
    }
    cube = document.node(mesh=document.mesh(primitive), name="cube")
    document.tree["animations"] = [
        {
            "name": name,
            "samplers": [
                {
                    "input": document.accessor(np.array([0, end], "f4")),
                    "output": document.accessor(np.array([[0, 0, 0], way], "f4")),
                }
            ],
            "channels": [{"sampler": 0, "target": {"node": cube, "path": "translation"}}],
        }
        for name, end, way in (("rise", 2, [0, 4, 0]), ("slide", 1, [3, 0, 0]))
    ]
    lamp = {"type": "point", "intensity": 5000, "range": 100}
    document.tree["extensions"] = {"KHR_lights_punctual": {"lights": [lamp]}}
    document.node(translation=[0, 12, 0], extensions={"KHR_lights_punctual": {"light": 0}})
    path = tmp_path / "lift.glb"
    path.write_bytes(document.glb())
    return path


def test_inspect_tells_animations_lights_and_a_posed_size(umbra_here, lift):
    said = umbra_here("inspect", lift, "--json").json()
    assert said["animations"] == [
        {"name": "rise", "duration": 2.0},
        {"name": "slide", "duration": 1.0},
    ]
    assert said["lights"] == 1
    assert said["bounds"] == [[-0.5, -0.5, 0], [0.5, 0.5, 1]]
    said = umbra_here("inspect", lift, "--time", "1.5", "--json").json()
    assert said["bounds"] == [[-0.5, -0.5, 3], [0.5, 0.5, 4]]
    for name in ("slide", "1"):
        said = umbra_here("inspect", lift, "--time", "9", "--animation", name, "--json").json()
        assert said["bounds"] == [[2.5, -0.5, 0], [3.5, 0.5, 1]]
    text = umbra_here("inspect", lift).out
    assert "animation 1: 'slide', 1 s (--time poses it)" in text
    assert "1 light of its own" in text


def test_render_poses_and_takes_the_files_own_lights(umbra_here, lift, tmp_path):
    def render(*options):
        out = ["--arrays", tmp_path / "a.npz", "--out", tmp_path / "a.png"]
        said = umbra_here(
            "render", lift, *VIEW, "--size", "160x160", "--ground", "0", *out, *options
        )
        assert said.status == 0, said
        with np.load(tmp_path / "a.npz") as arrays:
            return dict(arrays)

    # From 12 m the cube's top, at 4 + 1 m, throws 12 / 7 of itself on the ground: 1.71 m,
    # on 18 pixels' centres a side.
    arrays = render("--time", "2")
    assert arrays["count"].shape == (1, 160, 160)
    top = np.abs(arrays["position"][..., 2] - 5) < 1e-6
    assert top.sum() == 100  # 10 x 10 pixels of 0.1 m
    shadow = (arrays["count"][0] > 0) & ~top
    assert shadow.sum() == 18**2 - 10**2
    given = render("--time", "2", "--light", "0,0,12")
    np.testing.assert_array_equal(arrays["count"], given["count"])
    assert render("--light", "0,0,12", "--light", "1,1,1,0")["count"].shape[0] == 2
    # Without a time the cube stands on the ground.
    assert np.nanmax(render()["position"][..., 2]) == pytest.approx(1)


def test_study_poses(umbra_here, no_pictures, lift, tmp_path):
    def study(*options):
        said = umbra_here(
            "study", lift, "--lat", "48", "--lon", "16", "--date", "2026-06-21", "--from", "12:00",
            "--to", "13:00", "--every", "1h", "--ground", "0", "--extent=-1,-1,1,1",
            "--size", "20x20", "--out", tmp_path / "out", "--json", *options,
        )  # fmt: skip
        assert said.status == 0, said
        return said.json()["mean_shadow_hours"]

    # At rest the cube covers a quarter of the plan; 4 m up its shadow falls elsewhere.
    assert study() > 0.2
    assert study("--time", "2") < 0.2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--time", "1", "--animation", "jump"], "no animation 'jump'; the scene has 'rise'"),
        (["--time", "nan"], "must be finite"),
        (["--animation", "rise"], "give --time S too"),
    ],
)
def test_wrong_times_are_refused_in_one_line(umbra_here, lift, options, words):
    assert words in umbra_here("inspect", lift, *options).refusal()


def test_a_file_that_does_not_move_is_said_to(umbra_here, tower):
    assert "no animation" in umbra_here("inspect", tower, "--time", "1").refusal()
