"""Views as records and as files."""

import datetime as dt
import json
import os
from dataclasses import replace

import numpy as np
import pytest

from umbra.errors import InputError
from umbra.methods import METHODS as BY_DEVICE
from umbra.methods import SOFT
from umbra.scene import Light, directional_light, make_scene, point_light, spot_light
from umbra.sun import Site
from umbra.window.daylight import Sun
from umbra.window.view_file import from_json, load_view, save_view, to_json
from umbra.window.view_state import SUN, Viewpoint, ViewState, make_view

METHODS = BY_DEVICE["gl"].hard
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
SIZE = (800, 600)


@pytest.fixture
def view():
    lights = (
        point_light((1, 2, 3), (1.0, 0.5, 0.25), range=7.0, attenuation=(1, 0.1, 0.02)),
        spot_light((0, 0, 9), (1, 0, 0), 30.0, inner_angle=20.0),
        directional_light((1, 1, 1)),
    )
    return ViewState(
        Viewpoint((1, 2, 3), 40, -10, 12, 35, 0.01, True),
        Sun(True, VIENNA, dt.date(2025, 12, 24), 611.5, 100, 20, False, (1, 0.9, 0.8)),
        lights, 1, "lengyel", "gl", frozenset({"edges", "counts"}), "weng", 1.5, 0.25,
    )  # fmt: skip


def test_a_file_gives_back_what_was_saved(view, tmp_path):
    save_view(tmp_path / "a.json", view)
    found = load_view(tmp_path / "a.json")
    assert replace(found, lights=()) == replace(view, lights=())
    for mine, its in zip(view.lights, found.lights, strict=True):
        for name in ("position", "color", "range", "attenuation", "half_angle", "inner_angle"):
            assert np.array_equal(getattr(mine, name), getattr(its, name)), name
    assert found.lights[1].axis == pytest.approx(view.lights[1].axis)
    assert to_json(found) == to_json(view)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"umbra_view": 9}, "not a view of version 1"),
        ({"viewpoint": {}}, "viewpoint has no 'target'"),
        ({"sun": {"minutes": "x"}}, "sun is wrong"),
        ({"lights": [{"position": [1, 2, 3, 1], "color": [1, -1, 1]}]}, r"lights\[0\] is wrong"),
        ({"overlays": ["fog"]}, "no overlay 'fog'"),
        ({"method": "guess"}, "no method 'guess'"),
        ({"device": "tpu"}, "no device 'tpu'"),
        ({"soft": "fog"}, "no soft shadows 'fog'"),
        ({"sun_radius": 90}, "lights of 90 degrees"),
        ({"lamp_radius": "x"}, "lamp_radius is wrong"),
        ({"layer_gap": 0}, "layer_gap=0 do not make"),
        ({"mask_scale": 3}, "a view has no mask_scale=3; it has 1, 2, 4"),
        ({"detail": -1.0}, "a view's detail is a number of pixels, 0 or more; got -1"),
        ({"mask_filter": "cubic"}, "a view has no mask_filter='cubic'; it has joint"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(view, tmp_path, change, message):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(to_json(view) | change))
    with pytest.raises(InputError, match=message) as caught:
        load_view(path)
    assert str(path) in str(caught.value)


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        load_view(tmp_path / "a.json")
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        load_view(tmp_path / "a.json")
    for wrong in ([], None, {}, {"umbra_view": 1}):
        with pytest.raises(InputError):
            from_json(wrong)


def test_numbers_that_are_none_are_refused(view):
    described = to_json(view)
    described["viewpoint"]["distance"] = float("nan")
    with pytest.raises(InputError, match="finite"):
        from_json(described)


def test_lights_come_and_go(view):
    more = view.add_light(point_light((0, 0, 1)))
    assert more.chosen == 3
    assert len(more.shining()) == 5
    assert list(more.shining()) == [SUN, 0, 1, 2, 3]
    moved = more.move_light(3, np.array([4.0, 5, 6]))
    assert moved.lights[3].position.tolist() == [4, 5, 6, 1]
    assert moved.lights[:3] == view.lights
    less = moved.remove_light(3).remove_light(0)
    assert less.lights == view.lights[1:]
    assert less.chosen == 1
    assert SUN not in less.remove_light(SUN).shining()
    empty = less.remove_light(0).remove_light(0)
    assert empty.chosen == SUN


def test_the_cpu_has_fewer_methods(view):
    assert view.choose_device("cpu").method == "auto"
    assert view.choose_method("z-fail").choose_device("cpu").method == "z-fail"
    methods = [view.method]
    while (view := view.next_method()).method not in methods:
        methods.append(view.method)
    assert set(methods) == set(METHODS)


def test_soft_shadows_go_round(view):
    found = [view.soft]
    while (view := view.next_soft()).soft not in found:
        found.append(view.soft)
    assert set(found) == {"none", *SOFT}
    assert view.choose_device("cpu").soft == view.soft
    sizes = [light.radius for light in view.size_lights()]
    degrees = np.tan(np.radians(1.5))
    assert sizes == pytest.approx([degrees, 0.25, 0.25, degrees])


def test_views_of_before_have_hard_shadows(view):
    described = to_json(view)
    for name in (
        "soft",
        "sun_radius",
        "lamp_radius",
        "layer_gap",
        "mask_scale",
        "mask_filter",
        "detail",
    ):
        del described[name]
    assert from_json(described).soft == "none"


def test_a_first_view_has_the_sun_at_three_or_a_light_from_the_left(tower):
    known = make_view(tower, SIZE, site=VIENNA)
    assert known.sun.clock() == "15:00"
    assert known.sun.light() is not None
    plain = make_view(tower, SIZE)
    right, up, forward = plain.viewpoint.axes() @ plain.sun.direction()
    assert right < -0.4
    assert up > 0.4
    assert forward < 0.2
    assert plain.chosen == SUN


def test_a_files_own_lights_come_before_the_sun(tower):
    lit = make_scene(tower.parts, lights=(Light(np.array([0, 0, 9, 1.0]), (50, 50, 50)),))
    view = make_view(lit, SIZE, site=VIENNA)
    assert list(view.shining()) == [0]
    asked = make_view(lit, SIZE, site=VIENNA, minutes=720)
    assert list(asked.shining()) == [SUN, 0]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no endless devices")
def test_an_endless_view_is_refused():
    with pytest.raises(InputError, match="larger than 10 MB"):
        load_view("/dev/zero")


def test_a_view_nested_too_deep_is_refused(tmp_path):
    (tmp_path / "a.json").write_text("[" * 200_000)
    with pytest.raises(InputError, match="not JSON"):
        load_view(tmp_path / "a.json")
