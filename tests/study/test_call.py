"""Slips in a call from Python are told by name, with the remedy."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.receivers import REGISTRY
from umbra.receivers.kind import SampleKind
from umbra.study import StudyOptions

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
SMALL = {"date": "2026-03-21", "every": "2h", "extent": (-5, -5, 5, 5), "cell": 1}


@pytest.fixture(scope="module")
def scene():
    return umbra.make_scene(*box((-1, -1, 0), (1, 1, 3)), name="tower")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"date": None}, "a study needs a date"),
        ({"recievers": "top"}, "no option 'recievers'; did you mean 'receivers'"),
        ({"qqq": 1}, "there are date, start, end"),
        ({"spacing": 1.0}, "spacing= is not for receivers='auto', which takes extent="),
        ({"receivers": "points", "points": [[0, 0, 1]]}, "extent= is not for receivers='points'"),
        ({"cell": "1"}, "cell is a number; got '1'"),
        ({"threads": 1.5}, "threads is a whole number"),
        ({"extent": (0, 0, 1)}, "extent has 4 numbers"),
        ({"extent": "0,0,1,1"}, "extent has 4 numbers"),
        ({"size": 3, "cell": None}, "size has 2 whole numbers"),
        ({"cast": "wall"}, "'wall' matches no part; the file has tower"),
    ],
)
def test_slips_in_the_options(scene, options, words):
    given = {name: v for name, v in {**SMALL, **options}.items() if v is not None}
    with pytest.raises(umbra.InputError, match=words):
        umbra.shadow_study(scene, SITE, **given)


def test_what_is_meant_is_taken(scene):
    plain = umbra.shadow_study(scene, SITE, **SMALL)
    one = umbra.shadow_study(scene, SITE, **SMALL, cast="tower")
    np.testing.assert_array_equal(plain.shadow_hours, one.shadow_hours)
    numbers = {**SMALL, "cell": np.float32(1), "extent": np.array(SMALL["extent"])}
    two = umbra.shadow_study(scene, SITE, **numbers)
    np.testing.assert_array_equal(plain.shadow_hours, two.shadow_hours)
    south = umbra.shadow_study(scene, SITE, date="2026-03-21", every="2h", receivers=180, cell=1)
    assert south.attrs["view_azimuth_deg"] == 180


def test_slips_in_what_is_studied(scene):
    with pytest.raises(umbra.InputError, match=r"scene is a str, not a Scene; give umbra.read"):
        umbra.shadow_study("a.obj", SITE, **SMALL)
    with pytest.raises(umbra.InputError, match="site is a tuple, not a Site"):
        umbra.shadow_study(scene, (48.2, 16.37), **SMALL)


def test_a_record_of_options_has_one_form():
    options = StudyOptions(date=2026, cast="wall", extent=np.array([0, 0, 1, 1.5]), receivers=180)
    assert (options.date, options.cast, options.receivers) == ("2026", ("wall",), "180")
    assert options.extent == (0, 0, 1, 1.5)
    camera = StudyOptions(date="2026-03-21", receivers="camera", eye=(0, 0, 1), target=(0, 9, 1),
                          who="a")  # fmt: skip
    assert camera.attributes["eye"] == (0, 0, 1)
    assert "spacing_m" not in camera.attributes
    surfaces = camera.ask_hours("surfaces", spacing=0.25)
    assert (surfaces.eye, surfaces.who, surfaces.spacing) == (None, (), 0.25)


class Sensors(SampleKind):
    name = "sensors"


def test_a_further_kind_of_receivers_is_named_in_messages(monkeypatch):
    point = EntryPoint("sensors", f"{__name__}:Sensors", REGISTRY.group)
    monkeypatch.setitem(vars(REGISTRY), "added", {"sensors": (point,)})
    StudyOptions(date="2026-03-21", receivers="sensors")
    with pytest.raises(umbra.InputError, match=r"choose ground, top, camera, .*, sensors, an elev"):
        StudyOptions(date="2026-03-21", receivers="sensor")
    with pytest.raises(umbra.InputError, match="cell= is not for receivers='sensors'; leave it"):
        StudyOptions(date="2026-03-21", receivers="sensors", cell=1.0)


def test_a_table_of_points_is_read(tmp_path):
    table = tmp_path / "points.csv"
    table.write_text("name,x,y,z\nbalcony,1,2,3\n")
    options = StudyOptions(date="2026-03-21", receivers="points", points=table)
    np.testing.assert_array_equal(options.points, [[1, 2, 3]])
    assert options.names == ("balcony",)


def test_slips_in_a_frame(scene):
    camera = umbra.Camera((9, 9, 9), (0, 0, 0), size=(8, 8))
    light = umbra.point_light((5, 0, 9))
    for arguments, words in (
        (("a.obj", camera, light), "scene is a str, not a Scene"),
        ((scene, None, light), "camera is a NoneType, not a Camera"),
        ((scene, camera, (5, 0, 9)), "light is a tuple, not a Light; give umbra.point_light"),
    ):
        with pytest.raises(umbra.InputError, match=words):
            umbra.count_shadows(*arguments)
    with pytest.raises(umbra.InputError, match="finite"):
        umbra.count_shadows(scene, camera, light, ground=float("nan"))
    with pytest.raises(umbra.InputError, match="camera's eye needs three"):
        umbra.Camera("1,2,3", (0, 0, 0))


def test_slips_in_what_a_scene_is_made_of():
    for make, words in (
        (lambda: umbra.make_scene("a.obj"), "made of parts.*got a str"),
        (lambda: umbra.make_scene(np.zeros((3, 2)), [[0, 1, 2]]), r"vertices of shape \(3, 2\)"),
        (lambda: umbra.Mesh(np.zeros((4, 3)), [[0, 1, 2, 3]]), r"faces of shape \(1, 4\)"),
        (lambda: umbra.read(["a.obj"]), r"got a list \(unpack lists: \*files\)"),
    ):
        with pytest.raises(umbra.InputError, match=words):
            make()


def test_months_without_a_day_are_warned_of(recwarn):
    scene = umbra.make_scene(*box((0, 0, 0), (2, 2, 3)))
    how = {"every": "4h", "cell": 2.0}
    umbra.shadow_study(scene, umbra.Site(48.2, 16.37), date="2026-*-31", **how)
    assert "left out are February, April, June, September, November" in str(recwarn.pop().message)
    umbra.shadow_study(scene, umbra.Site(48.2, 16.37), date="2026-*-21", **how)
    assert not recwarn
