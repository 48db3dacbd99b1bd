"""``umbra.render``, ``make_camera`` and ``show``: what the commands do, in Python."""

import importlib.util
import sys
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from support.model_files import save_obj
from support.shapes import sheet

import umbra
from umbra.cli import main
from umbra.methods import Softness

TABLE = sheet([(-1, -1, 4), (1, -1, 4), (1, 1, 4), (-1, 1, 4)])
VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")


@pytest.fixture
def scene(tmp_path):
    return umbra.read(save_obj(tmp_path / "table.obj", {"table": TABLE}))


@pytest.mark.parametrize("soft", [False, True])
def test_python_draws_what_the_command_draws(scene, tmp_path, soft):
    options = ["--soft", "wedges", "--light-size", "1"] if soft else []
    arguments = [
        "render", tmp_path / "table.obj", "--eye", "-5,-6,7", "--target", "0,0,2", "--size",
        "90x60", "--ground", "0", "--light", "1,2,9", "--light", "1,0,1,0", "--out",
        tmp_path / "a.png", "--arrays", tmp_path / "a.npz", *options,
    ]  # fmt: skip
    with pytest.raises(SystemExit, match="0"):
        main([*map(str, arguments)])
    camera = umbra.make_camera(scene, eye=(-5, -6, 7), target=(0, 0, 2), size=(90, 60))
    lights = [umbra.point_light((1, 2, 9)), (1, 0, 1, 0)]
    more = {"soft": "wedges", "light_size": 1} if soft else {}
    picture = umbra.render(scene, camera, lights, ground=0, arrays=True, **more)
    with np.load(tmp_path / "a.npz") as arrays:
        assert set(arrays) == set(picture.arrays())
        for name, array in picture.arrays().items():
            np.testing.assert_array_equal(arrays[name], array)
            assert arrays[name].dtype == array.dtype
    image = umbra.render(scene, camera, lights, ground=0, style="plain", **more)
    np.testing.assert_array_equal(image, np.asarray(Image.open(tmp_path / "a.png")))
    np.testing.assert_array_equal(image, picture.image)
    assert image.dtype == np.uint8


def test_a_scene_alone_is_seen_whole_in_some_light(scene):
    picture = umbra.render(scene, arrays=True)
    assert picture.image.shape == (768, 1024, 3)
    assert picture.lit[0][picture.is_seen].all()
    assert not picture.is_seen[[0, -1]].any()
    assert Image.open(BytesIO(picture._repr_png_())).size == (1024, 768)


@pytest.mark.parametrize(
    "lights", [(0, 0, 9, 1), [(0, 0, 9)], np.array([[0, 0, 9, 1.0]]), umbra.point_light((0, 0, 9))]
)
def test_lights_come_in_any_form(scene, lights):
    camera = umbra.make_camera(scene, size=(40, 30))
    picture = umbra.render(scene, camera, lights, ground=0, arrays=True)
    assert [tuple(light.position) for light in picture.lights] == [(0, 0, 9, 1)]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lights": [(1, 2)]}, r"a light is a Light or \(x, y, z, w\); got \(1, 2\)"),
        ({"lights": [(0, 0, 8, 2)]}, r"lights=\(0, 0, 8, 2\) has a W of 2; it is 1"),
        ({"camera": (0, 0, 9)}, r"camera is a tuple, not a Camera; give umbra.make_camera"),
        ({"method": "lengyel"}, "the cpu has no method 'lengyel'; it has auto"),
        ({"device": "tpu"}, "not one of auto, cpu, gl"),
        ({"soft": "fog"}, "samples, wedges, complexity, weng"),
        ({"light_size": 1}, "light_size= is for soft shadows; add soft='wedges'"),
        ({"soft": "wedges", "lights": [(0, 0, 9)]}, "give light_size="),
        ({"soft": "wedges", "light_size": (1, 2), "lights": [(0, 0, 9)]}, "2 radii for 1 lights"),
        ({"mask_scale": 2}, "give device='gl' and no soft="),
        ({"mask_scale": 3, "device": "gl"}, "mask_scale '3' is not one of 1, 2, 4"),
        ({"ground": "low"}, "ground is 'feet'"),
        ({"ground": np.nan}, "must be a finite number"),
        ({"threads": 0}, "threads must be at least 1"),
    ],
)
def test_slips_are_told_in_a_line(scene, options, words):
    with pytest.raises(umbra.InputError, match=words) as caught:
        umbra.render(scene, **options)
    assert "\n" not in str(caught.value)


def test_what_is_no_scene_is_told():
    for call in (umbra.render, umbra.show, umbra.make_camera):
        with pytest.raises(
            umbra.InputError, match=r"scene is a str, not a Scene; give umbra\.read"
        ):
            call("tower.glb")


def test_half_a_view_is_told(scene):
    with pytest.raises(umbra.InputError, match=r"both eye=\(X, Y, Z\) and target=") as caught:
        umbra.make_camera(scene, eye=(0, 0, 9))
    assert "both --eye X,Y,Z and --target X,Y,Z" in caught.value.for_shell()
    assert caught.value.option == "target"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"layer_gap": 0.5}, "layer_gap= is for scaled layers; add soft='weng'"),
        ({"layer_gap": 0, "soft": "weng"}, "layer_length=2.5 and layer_gap=0 do not make 1 to"),
        ({"light_samples": 16}, "light_samples= is for soft='samples' or soft='complexity'"),
        ({"light_samples": 16, "soft": "wedges"}, "light_samples= is for soft='samples'"),
        ({"light_samples": 5000, "soft": "samples"}, "at most 4,096 samples; got 5,000"),
        ({"light_samples": 0, "soft": "complexity"}, "light_samples must be at least 1"),
        ({"layer_length": "far"}, "layer_length is a number"),
        ({"light_size": ("big",), "soft": "weng"}, "light_size is a number"),
        ({"light_size": {}, "soft": "weng", "device": 1}, "not one of auto, cpu, gl"),
    ],
)
def test_slips_in_softness_are_told(scene, options, words):
    with pytest.raises(umbra.InputError, match=words) as caught:
        umbra.render(scene, **options)
    assert caught.value.option in {*options, "layer_length"}  # which is told with the gap


@pytest.mark.parametrize("soft", ["samples", "complexity"])
def test_samples_of_lights_are_so_many(scene, soft):
    camera = umbra.make_camera(
        scene, eye=(0, 0, 10), target=(0, 0, 0), up=(0, 1, 0), size=(100, 75)
    )
    more = {"ground": 0, "soft": soft, "light_size": 0.5, "arrays": True, "lights": (0, 0, 8, 1)}
    four = umbra.render(scene, camera, light_samples=4, **more).visibility[0]
    if soft == "samples":
        assert {*np.unique(four)} == {0, 0.25, 0.5, 0.75, 1}
    usual = Softness().samples if soft == "samples" else Softness().spots
    shown = [
        umbra.render(scene, camera, **more, **n).visibility[0]
        for n in ({}, {"light_samples": usual})
    ]
    np.testing.assert_array_equal(*shown)


def test_length_and_gap_of_layers_make_the_picture(scene):
    camera = umbra.make_camera(
        scene, eye=(0, 0, 10), target=(0, 0, 0), up=(0, 1, 0), size=(200, 150)
    )
    lights, more = (0, 0, 8, 1), {"ground": 0, "soft": "weng", "light_size": 0.5, "arrays": True}
    usual = umbra.render(scene, camera, lights, **more).visibility[0]
    two = umbra.render(scene, camera, lights, layer_length=4, layer_gap=2, **more).visibility[0]
    np.testing.assert_allclose(np.unique(two), [0, 1 / 3, 2 / 3, 1], atol=1e-6)
    assert len(np.unique(usual.round(5))) == 8  # six layers, the hard shadow and the light


def test_a_view_of_nothing_is_warned_of(scene):
    away = umbra.make_camera(scene, eye=(0, 0, 9), target=(0, 0, 20), up=(0, 1, 0), size=(8, 8))
    with pytest.warns(UserWarning, match=r"nothing is seen.*target=\(0, 0, 4\)") as caught:
        umbra.render(scene, away, (0, 0, 9))
    assert caught[0].filename == __file__


def test_a_small_models_near_plane_is_near():
    scene = umbra.make_scene(np.array(TABLE[0]) * 0.01, TABLE[1])
    assert umbra.make_camera(scene).near < 1e-4
    assert umbra.make_camera(scene, near=0.5).near == 0.5


@pytest.fixture
def notebook(monkeypatch):
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))


@pytest.mark.usefixtures("notebook")
def test_in_a_notebook_a_picture_is_shown(scene, tmp_path):
    size = (80, 60)
    picture = umbra.show(scene, VIENNA, date="2026-03-21", at="15:00", size=size, device="cpu")
    sun = umbra.sun_light(VIENNA, "2026-03-21", "15:00")
    np.testing.assert_allclose(picture.lights[0].position, sun.position, atol=1e-12)
    assert picture.position[..., 2].min() == pytest.approx(4, abs=0.01)  # just below the table
    later = umbra.show(scene, VIENNA, at="17:00", size=(80, 60), ground=0, out=tmp_path / "a.png")
    assert np.nanmin(later.position[..., 2]) == pytest.approx(0)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), later.image)
    bare = umbra.show(scene, size=(80, 60), ground=False, soft="wedges")
    assert bare.position[..., 2][bare.is_seen].min() == pytest.approx(4)
    assert bare.visibility.shape == (1, 60, 80)


@pytest.mark.usefixtures("notebook")
def test_without_anywidget_a_notebook_shows_a_picture(scene, monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "anywidget" else find(name)
    )
    assert isinstance(umbra.show(scene, VIENNA, size=(80, 60)), umbra.Picture)


@pytest.mark.usefixtures("notebook")
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"at": "15:00"}, "the site is not known.*give latitude= and longitude="),
        ({"site": "Vienna"}, "site is a str, not a Site"),
        ({"device": "tpu"}, "not one of cpu, gl"),
        ({"size": (8,)}, "size has 2 whole numbers"),
        ({"layer_gap": 0}, "layer_gap=0 do not make"),
        ({"mask_scale": 3}, "mask_scale '3' is not one of 1, 2, 4"),
        ({"no_cast": "tower"}, "no_cast='tower' matches no part"),
        ({"animation": 0}, "the scene has no animation"),
        ({"date": "2026-02-30"}, "2026-02-30"),
    ],
)
def test_slips_of_a_view_are_told(scene, options, words):
    with pytest.raises(umbra.InputError, match=words):
        umbra.show(scene, **options)


def test_without_a_display_the_picture_is_named(scene, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(umbra.UmbraError, match=r"umbra.render\(scene\)|needs"):
        umbra.show(scene)
