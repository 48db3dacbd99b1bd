"""Masks of fewer pixels for frames, and on the command line."""

import numpy as np
import pytest
from support.model_files import save_obj
from support.shapes import box, city, sheet

from umbra.cli import main
from umbra.errors import InputError
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.masks.upsampling import find_shares, shrink, upsample
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, directional_light, make_scene, point_light


def test_a_smaller_picture_shows_the_same():
    camera = Camera((0, 0, 30), (1, 0, 0), size=(97, 50))
    for scale, size in ((1, (97, 50)), (2, (49, 25)), (4, (26, 13))):
        small = shrink(camera, scale)
        assert small.size == size
        assert (small.fov, small.height) == (camera.fov, camera.height)
        # Nothing of the large picture is left out to the sides.
        assert size[0] / size[1] >= 97 / 50 - 1e-12


@pytest.mark.parametrize("size", [(33, 32), (32, 32)])
def test_an_edge_lies_where_it_is_in_the_large_picture(device, size):
    # A table of 8 x 8 m, 4 m up; its shadow is 8 m to the east, one pixel a metre.
    table = sheet([(-4, -4, 4), (4, -4, 4), (4, 4, 4), (-4, 4, 4)])
    middle = 0.5 * (size[0] % 2)
    camera = Camera((middle, 0, 30), (middle, 0, 0), up=(0, 1, 0), size=size, height=32.0)
    sun = directional_light((-2, 0, 1))
    with GlFrameCounter(make_scene(*table), ground=0.0, device=device) as counter:
        view, frame = counter.see(camera)
        whole = counter.count(view, camera, sun)
        for kind in "bilinear", "joint":
            (share,) = find_shares(counter, frame, camera, [sun], scale=2, kind=kind)
            ground = frame.part == -2
            # By symmetry errors on both sides of an edge are alike: areas are kept.
            assert abs(share[ground].sum() - (whole == 0)[ground].sum()) <= 8
            assert ((share < 0.5) != (whole > 0))[ground].mean() < 0.06


@pytest.mark.parametrize("method", ["auto", "z-fail", "alpha", "screen", "max", "half"])
def test_between_pixels_of_one_surface_errors_are_less(device, method):
    camera = Camera((-30, -40, 45), (2, 2, 0), size=(160, 120))
    lamp = point_light((20, 22, 50))
    with GlFrameCounter(make_scene(*city(4)), ground=0.0, device=device) as counter:
        view, frame = counter.see(camera)
        whole = counter.count(view, camera, lamp) == 0
        seen = view.face != NOTHING
        for scale in 2, 4:
            error = {}
            for kind in "nearest", "bilinear", "joint":
                (share,) = find_shares(
                    counter, frame, camera, [lamp], method, scale=scale, kind=kind
                )
                assert share.shape == whole.shape
                error[kind] = np.abs(share - whole)[seen].mean()
            assert 0 < error["joint"] < 0.8 * error["nearest"]
            assert error["joint"] < 0.65 * error["bilinear"]


def test_a_filter_that_does_not_exist_is_refused(device):
    camera = Camera((0, 0, 30), (1, 0, 0), size=(8, 6))
    with GlFrameCounter(make_scene(*city(2)), ground=0.0, device=device) as counter:
        _, frame = counter.see(camera)
    with pytest.raises(InputError, match="there is no filter 'sharp'"):
        upsample(np.ones((6, 8), bool), frame, frame, camera, "sharp")


def test_the_command_line_scales_masks(device, tmp_path, capsys):
    path = save_obj(tmp_path / "box.obj", {"box": box((-1, -1, 0), (1, 1, 3))})
    view = ["--eye", "-5,-6,7", "--target", "0,0,2", "--size", "81x60", "--ground", "0"]
    found = {}
    for scale in "1", "2", "4":
        out = tmp_path / f"{scale}.npz"
        with pytest.raises(SystemExit) as ended:
            main(["render", str(path), *view, "--light", "6,-4,8", "--device", "gl",
                  "--method", "alpha", "--mask-scale", scale, "--arrays", str(out),
                  "--out", str(tmp_path / f"{scale}.png")])  # fmt: skip
        assert not ended.value.code, capsys.readouterr().err
        with np.load(out) as arrays:
            found[scale] = arrays["count"][0]
    assert set(np.unique(found["2"])) == {0, 1}
    differ = [(found[scale] != found["1"]).mean() for scale in ("2", "4")]
    assert 0 < differ[0] < differ[1] < 0.05
    with pytest.raises(SystemExit):
        main(["render", str(path), *view, "--mask-scale", "2", "--arrays", str(out)])
    assert "--mask-scale is for hard shadows on gl" in capsys.readouterr().err
