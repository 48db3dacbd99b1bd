"""``umbra render --soft``."""

import numpy as np
import pytest
from PIL import Image
from support.model_files import save_obj
from support.shapes import sheet

from umbra.methods import SOFT

# From 10 m above a table of 2 x 2 m at z = 4, straight down, 20 x 20 m on the floor.
ABOVE = ["--eye", "0,0,10", "--target", "0,0,0", "--up", "0,1,0", "--fov", "90"]
SMALL = [*ABOVE, "--size", "120x120", "--ground", "0"]


@pytest.fixture
def table(tmp_path):
    corners = [(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)]
    return save_obj(tmp_path / "table.obj", {"table": sheet(corners)})


@pytest.mark.parametrize("method", SOFT)
def test_visibility_stands_beside_the_hard_shadow(umbra_here, table, tmp_path, method):
    said = umbra_here(
        "render", table, *SMALL, "--light", "-4,0,8", "--light", "-1,0,1,0", "--soft", method,
        "--light-size", "1", "--light-size", "5", "--arrays", tmp_path / "a.npz",
        "--out", tmp_path / "a.png",
    )  # fmt: skip
    assert said.status == 0, said
    with np.load(tmp_path / "a.npz") as arrays:
        lit, visibility = arrays["lit"], arrays["visibility"]
    assert visibility.shape == (2, 120, 120)
    assert visibility.dtype == np.float32
    assert visibility.min() == 0
    assert visibility.max() == 1
    for hard, soft in zip(lit, visibility, strict=True):
        assert ((soft > 0) & (soft < 1)).sum() > 10
        assert (hard == (soft > 0.5)).mean() > 0.95


@pytest.mark.parametrize("method", SOFT)
def test_gl_gives_the_cpus_visibility(umbra_here, table, tmp_path, method):
    found = []
    for device in ("cpu", "gl"):
        said = umbra_here(
            "render", table, *SMALL, "--light", "-4,0,8", "--soft", method, "--light-size", "1",
            "--light", "1,2,9", "--device", device, "--arrays", tmp_path / "a.npz",
        )  # fmt: skip
        assert said.status == 0, said
        with np.load(tmp_path / "a.npz") as arrays:
            found.append(arrays["visibility"])
    assert ((found[0] > 0) & (found[0] < 1)).sum() > 200
    assert (np.abs(found[0] - found[1]) > 0.02).mean() < 0.001


def test_a_soft_picture_has_shades_between(umbra_here, table, tmp_path):
    shades = {}
    for name, options in (("hard", []), ("soft", ["--soft", "wedges", "--light-size", "1"])):
        path = tmp_path / f"{name}.png"
        said = umbra_here(
            "render",
            table,
            *SMALL,
            "--light",
            "-4,0,8",
            "--style",
            "plain",
            *options,
            "--out",
            path,
        )
        assert said.status == 0, said
        with Image.open(path) as picture:
            shades[name] = np.asarray(picture.convert("L")).astype(int)
    # Some pixels are lighter than the hard shadow, some darker than its light, by many shades.
    off = shades["soft"] - shades["hard"]
    assert 100 < (off != 0).sum() < off.size / 4
    assert len(set(off[off > 0])) > 5
    assert len(set(off[off < 0])) > 5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--light", "0,0,8", "--soft", "wedges"], "give --light-size"),
        (["--light", "0,0,8", "--light-size", "1"], "add --soft wedges"),
        (["--light", "0,0,8", "--soft", "wedges", "--light-size", "0"], "above 0; got 0"),
        (["--light", "0,0,8,0", "--soft", "wedges", "--light-size", "50"], "below 45 degrees"),
        (
            ["--light", "0,0,8", "--soft", "wedges", "--light-size", "1", "--light-size", "2"],
            "--light-size has 2 radii for 1 light",
        ),
        (["--light", "0,0,8,0", "--soft", "fog"], "wedges"),
    ],
)
def test_what_does_not_go_together_is_refused(umbra_here, table, tmp_path, options, words):
    said = umbra_here("render", table, *SMALL, *options, "--out", tmp_path / "a.png")
    assert words in said.refusal()
    assert not (tmp_path / "a.png").exists()


def test_a_direction_is_the_sun_unless_said_otherwise(umbra_here, table, tmp_path):
    found = []
    for size in ([], ["--light-size", "0.2665"]):
        said = umbra_here(
            "render", table, *SMALL, "--light", "-1,0,2,0", "--soft", "wedges", *size,
            "--arrays", tmp_path / "a.npz",
        )  # fmt: skip
        assert said.status == 0, said
        with np.load(tmp_path / "a.npz") as arrays:
            found.append(arrays["visibility"])
    np.testing.assert_array_equal(*found)
