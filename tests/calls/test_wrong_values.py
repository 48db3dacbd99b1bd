"""No exception but umbra's own leaves a public function, whatever value it gets."""

import datetime as dt
import inspect
import warnings
from pathlib import Path

import numpy as np
import pytest
from support.model_files import save_obj
from support.shapes import box
from support.sweeps import sample_pairs

import umbra
from umbra.soft import ball_light, rectangle_light

TOWER = umbra.Mesh(*box((0, 0, 0), (4, 4, 5)))
PART = umbra.Part("tower", "", TOWER)
SCENE = umbra.make_scene(PART)
SITE = umbra.Site(48, 16, "UTC")
CAMERA = umbra.make_camera(SCENE, size=(12, 9))
LAMP, SUN = umbra.point_light((6, -3, 9)), umbra.directional_light((1, 2, 3))

WRONG = [
    None, True, False, -1, 0, 1, 2.5, float("nan"), float("inf"), 1e300, 2**70, "", "x", "\x00",
    "a\nb", b"x", (), (1, 2), (1, "a"), [[1], [1, 2]], {}, {"a": 1}, object(), 1j, [None], [{}],
    np.zeros((0, 3)), np.zeros((2, 2)), np.array("x"), np.array(None), dt.date(2026, 1, 1),
    Path("x"), range(3), [float("nan")] * 3, [1e300] * 3, ["a"] * 3, {1, 2}, SCENE, SITE, CAMERA,
    LAMP, TOWER, int,
]  # fmt: skip
MANY = 9  # parameters, of which each takes a quarter of these values in turn


def _defaults(function, **given):
    """Give the values of a function's parameters: its defaults, or those given."""
    kinds = inspect.signature(function).parameters.values()
    named = [one for one in kinds if one.kind not in {one.VAR_KEYWORD, one.VAR_POSITIONAL}]
    return {one.name: given.get(one.name, one.default) for one in named}


def _read(path, **options):
    return umbra.read(path, **options)


_SIDES = {"center": (0, 0, 1), "edge_u": (1, 0, 0), "edge_v": (0, 1, 0)}
_NOON = {"date": "2026-03-21", "time": "12:00"}
_STUDY = {"site": SITE, "date": "2026-03-21", "every": "4h", "size": (6, 6), "device": "cpu"}
CALLS = {
    "make_scene": (umbra.make_scene, {"parts": TOWER.vertices, "faces": TOWER.faces, "name": "a"}),
    "mesh": (umbra.Mesh, _defaults(umbra.Mesh, vertices=TOWER.vertices, faces=TOWER.faces)),
    "part": (
        lambda **given: umbra.make_scene(umbra.Part(**given)),
        {"name": "a", "kind": "", "mesh": TOWER, "transform": None, "layer": ""},
    ),
    "material": (umbra.Material, {"color": (1, 1, 1), "opacity": 1.0, "roughness": None}),
    "image": (umbra.make_image, _defaults(umbra.make_image, pixels=np.ones((2, 2, 4), np.uint8))),
    "point": (umbra.point_light, {"position": (1, 2, 3), "color": (1, 1, 1), "range": 5.0}),
    "direction": (umbra.directional_light, {"toward": (1, 2, 3), "color": (1, 1, 1)}),
    "spot": (
        umbra.spot_light,
        {"position": (1, 2, 3), "target": (0, 0, 0), "half_angle": 30, "inner_angle": 10},
    ),
    "area": (umbra.area_light, {**_SIDES, "n": 4, "color": (1, 1, 1)}),
    "volume": (umbra.volume_light, {**_SIDES, "edge_w": (0, 0, 1), "n": 4}),
    "sphere": (umbra.sphere_light, {"center": (0, 0, 1), "radius": 1, "n": 4}),
    "ball": (ball_light, {"light": LAMP, "radius": 1.0}),
    "rectangle": (rectangle_light, {"light": LAMP, "edge_u": (1, 0, 0), "edge_v": (0, 1, 0)}),
    "light": (umbra.Light, _defaults(umbra.Light, position=(1, 2, 3, 1))),
    "site": (umbra.Site, {"latitude": 48, "longitude": 16, "zone": "UTC", "elevation": 0}),
    "find_site": (umbra.find_site, {"scene": SCENE, "latitude": 48, "longitude": 16}),
    "find_sun": (umbra.find_sun, {"site": SITE, "instants": dt.datetime(2026, 3, 21, 12)}),
    "sun_light": (umbra.sun_light, {"site": SITE, **_NOON}),
    "camera": (umbra.make_camera, _defaults(umbra.make_camera, scene=SCENE, size=(12, 9))),
    "bare camera": (umbra.Camera, _defaults(umbra.Camera, eye=(20, 20, 20), target=(0, 0, 0))),
    "count": (
        umbra.count,
        _defaults(umbra.count, scene=SCENE, receivers=[[5, 5, 0]], directions=[[1, 2, 3]]),
    ),
    "count_shadows": (
        umbra.count_shadows,
        _defaults(umbra.count_shadows, scene=SCENE, camera=CAMERA, light=LAMP),
    ),
    "render": (
        umbra.render,
        _defaults(umbra.render, scene=SCENE, camera=CAMERA, lights=[SUN]) | {"device": "cpu"},
    ),
    "compare": (umbra.compare, {"before": None, "after": None, "under": "2h"}),
    "read": (_read, {"path": None, **_defaults(umbra.read)}),
    "study": (umbra.shadow_study, _defaults(umbra.shadow_study, scene=SCENE) | _STUDY),
    "points": (
        umbra.shadow_study,
        {"scene": SCENE, **_STUDY, "size": None, "receivers": "points", "points": [[9, 9, 1]],
         "names": ()},
    ),
    "write": (
        lambda study, folder, **options: study.write(folder, **options),
        {"study": None, "folder": "out", "pictures": False, "report": False,
         "sheet": False, "paper": "a3", "logo": None, "rules": None, "show": None, "at": (),
         "title": None, "subtitle": None},
    ),
    "city": (
        umbra.city_study,
        {"files": None, "site": SITE, "out": "city", "tiles": 50, "memory": None,
         "min_altitude": None, "reading": None, "scheduler": None, "date": "2026-03-21",
         "every": "4h", "cell": 2.0, "device": "cpu", "receivers": "ground"},
    ),
    "surfaces": (
        umbra.shadow_study,
        {"scene": SCENE, **_STUDY, "size": None, "receivers": "surfaces", "spacing": 2, "on": ()},
    ),
}  # fmt: skip


@pytest.fixture
def whole(tmp_path, monkeypatch, request):
    """Give a function and values that it takes."""
    monkeypatch.chdir(tmp_path)
    function, given = CALLS[request.param]
    given = dict(given)
    if request.param in {"read", "city"}:
        model = save_obj(tmp_path / "tower.obj", {"tower": (TOWER.vertices, TOWER.faces)})
        given["path" if request.param == "read" else "files"] = model
    if request.param == "write":
        given["study"] = umbra.shadow_study(SCENE, **_STUDY)
    if request.param == "compare":
        given["before"] = given["after"] = umbra.shadow_study(SCENE, **_STUDY)
    function(**given)
    return function, given


@pytest.mark.parametrize("whole", CALLS, indirect=True)
def test_a_wrong_value_is_refused_in_a_line_or_taken(whole):
    function, given = whole
    names, refused = [name for name in given if name != "study"], 0
    for name, value in sample_pairs(names, WRONG, 4 if len(names) > MANY else 1):
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            warnings.simplefilter("ignore", UserWarning)
            try:
                function(**{**given, name: value})
            except umbra.UmbraError as error:
                refused += 1
                told = str(error)
                assert "\n" not in told, (name, value)
                assert len(told) <= 500, (name, value)
                assert "object at 0x" not in told, (name, value)
    assert refused > len(given)


@pytest.mark.parametrize("name", ["engine", "progress"])
def test_what_a_city_calls_is_a_function(tmp_path, name):
    with pytest.raises(umbra.InputError) as caught:
        umbra.city_study("a.obj", out=tmp_path / "out", date="2026-03-21", **{name: 3})
    assert caught.value.option == name


def test_messages_are_one_line_whatever_they_name():
    assert str(umbra.InputError("column 'a\nb' \r\n\n  is twice")) == "column 'a b' is twice"
