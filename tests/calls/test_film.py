"""Films of a camera or a sun that moves."""

import datetime as dt
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence
from support.shapes import box

import umbra
from umbra.calls import film as film_calls
from umbra.calls.film_shots import FilmOptions, plan_shots
from umbra.calls.picture import draw_picture
from umbra.calls.picture_options import RenderOptions
from umbra.window.view_file import to_json
from umbra.window.view_state import Viewpoint, make_view
from umbra.writers.sun_rose import paste_rose

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
SIZE = (64, 48)
PLAIN = {"style": "plain", "samples": 1, "ground": 0.0, "rate": 5}


@pytest.fixture(scope="module")
def scene():
    return umbra.make_scene(*box((-2, -2, 0), (2, 2, 9)))


@pytest.fixture(scope="module")
def camera(scene):
    return umbra.make_camera(scene, view="bird", size=SIZE)


def test_a_turntable_begins_with_the_camera_s_own_picture(scene, camera, tmp_path):
    light = umbra.directional_light((0.3, -0.5, 0.8))
    out = umbra.film(scene, tmp_path / "turn.gif", camera, light, turntable="1s", **PLAIN)
    with Image.open(out) as film:
        frames = [np.array(one.convert("RGB"), int) for one in ImageSequence.Iterator(film)]
        assert film.info["duration"] == 200
        assert film.n_frames == 5
    assert len(frames) == 5
    options = RenderOptions(style="plain", samples=1, ground=0.0)
    still = draw_picture(scene, camera, [light], options, print, is_bare=False, is_filed=True).image
    assert np.abs(frames[0] - still).mean() < 3  # 256 colours
    assert all(np.abs(one - frames[0]).mean() > 3 for one in frames[1:])


def test_the_sun_goes_from_one_time_to_another(camera):
    options = FilmOptions(until="17:00", film="1s", rate=9)
    shots = plan_shots(options, camera, [], (VIENNA, "2026-03-21", "09:00"))
    for shot, clock in zip(shots, range(9, 18), strict=True):
        assert shot.camera is camera
        assert shot.caption == f"21 March 2026, {clock:02}:00 CET"
        wanted = umbra.sun_light(VIENNA, "2026-03-21", f"{clock:02}:00").position
        assert np.allclose(shot.lights[0].position, wanted)
        azimuth, altitude = np.radians(shot.sun)
        level = np.cos(altitude)
        toward = (np.sin(azimuth) * level, np.cos(azimuth) * level, np.sin(altitude))
        assert np.allclose(toward, wanted[:3])


def test_python_s_sun_has_the_command_s_times(scene, camera, tmp_path, monkeypatch):
    planned = []
    monkeypatch.setattr(film_calls, "write_film", lambda _out, _scene, shots, *_, **__:
                        planned.append(shots[0].caption))  # fmt: skip
    run = partial(
        umbra.film, scene, tmp_path / "a.gif", camera, site=VIENNA, turntable="1s", rate=5
    )
    with pytest.warns(UserWarning, match="afternoon, 15:05; at="):
        run(date=dt.date(2026, 3, 21))
    run(date="2026-03-21", at="15:05")
    run(date="2026-03-21", at="altitude:20")
    run(date="2026-03-21", time_of_day="afternoon")
    assert planned[0] == planned[1] == planned[3] == "21 March 2026, 15:05 CET"
    assert planned[2] != planned[0]
    with pytest.raises(umbra.InputError, match="date="):
        run(at="15:05")


@pytest.mark.parametrize(("north", "azimuth"), [(0.0, 90.0), (-90.0, 180.0), (30.0, 60.0)])
def test_a_compass_has_the_sun_where_it_stands_and_north_in_red(north, azimuth):
    frame = Image.new("RGB", (200, 200), "black")
    paste_rose(frame, (100, 100), 40, north, (azimuth, 45.0))
    assert frame.getpixel((120, 100)) == (242, 182, 50)  # to the right, half-way up
    x, y = 100 + 36 * np.sin(np.radians(north)), 100 - 36 * np.cos(np.radians(north))
    red, green, _ = frame.getpixel((round(x), round(y)))
    assert red > green + 60


def test_a_path_goes_through_saved_views(scene, camera, tmp_path):
    views = [Viewpoint((0.0, 0.0, 4.0), heading, -20.0, 30.0, 40.0) for heading in (0.0, 90.0)]
    state = make_view(scene, SIZE)
    saved = []
    for one in views:
        described = to_json(state)
        described["viewpoint"] = to_json(state)["viewpoint"] | {
            "target": one.target, "heading": one.heading, "tilt": one.tilt,
            "distance": one.distance, "fov": one.fov,
        }  # fmt: skip
        saved.append(described)
    path = tmp_path / "views.json"
    path.write_text(json.dumps(saved))
    shots = plan_shots(FilmOptions(path=path, rate=3), camera, [])
    assert len(shots) == 9  # a leg of 3 s
    for shot, view in ((shots[0], views[0]), (shots[-1], views[1])):
        assert np.allclose(shot.camera.eye, view.camera(SIZE).eye)
        assert shot.camera.size == SIZE


@pytest.mark.parametrize(
    ("asked", "option"),
    [({"turntable": "8s", "film": "4s"}, "turntable"), ({"film": "4s"}, "film"),
     ({"turntable": "1h"}, "turntable"), ({"turntable": "soon"}, "turntable"),
     ({"until": "17:00", "at": "15:00"}, "date"), ({"until": "17:00"}, "until"),
     ({"until": "23:00", "date": "2026-03-21", "at": "15:00"}, "until"),
     ({"until": "25:00", "date": "2026-03-21", "at": "15:00"}, "until"),
     ({"until": "17:00", "date": "2026-03-21", "at": "9"}, "at"),
     ({"path": "nowhere.json"}, "path"), ({"turntable": "1s", "rate": 60}, "rate"),
     ({"turntable": "1s", "rate": 500}, "rate"),
     ({"turntable": "1s", "transparent": True}, "transparent")],
)  # fmt: skip
def test_wrong_films_name_their_option(scene, camera, tmp_path, asked, option):
    out = tmp_path / "x.gif"
    with pytest.raises(umbra.InputError) as caught:
        umbra.film(scene, out, camera, site=VIENNA, **{**PLAIN, **asked})
    assert caught.value.option == option
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "text", ["{", "{}", "[]", "[{}, {}]", "[1, 2]", "[" * 5000, f"[{'1' * 5000}]", None]
)
def test_what_is_no_path_is_refused_in_a_line(camera, tmp_path, text):
    path = tmp_path / "views.json" if text else Path("/dev/zero")
    if text:
        path.write_text(text)
    with pytest.raises(umbra.InputError) as caught:
        plan_shots(FilmOptions(path=path), camera, [])
    assert caught.value.option == "path"
    assert text != "[]" or "views, and this has 0" in str(caught.value)


def test_a_path_of_too_many_frames_is_refused_not_cut():
    assert FilmOptions(path="a.json", rate=25).count_frames(80) == 6000
    with pytest.raises(umbra.InputError):
        FilmOptions(path="a.json", rate=25).count_frames(81)


def test_an_mp4_has_every_frame(scene, camera, tmp_path):
    av = pytest.importorskip("av")
    out = umbra.film(scene, tmp_path / "turn.mp4", camera, turntable="1s", **PLAIN)
    with av.open(str(out)) as film:
        stream = film.streams.video[0]
        assert (stream.width, stream.height) == SIZE
        assert sum(1 for _ in film.decode(stream)) == 5
    odd = umbra.make_camera(scene, size=(63, 48))
    with pytest.raises(umbra.InputError) as caught:
        umbra.film(scene, out, odd, turntable="1s", **PLAIN)
    assert caught.value.option == "size"


def test_a_gif_lasts_as_long_as_was_asked(scene, camera, tmp_path):
    out = umbra.film(scene, tmp_path / "x.gif", camera, turntable="1s", **{**PLAIN, "rate": 30})
    with Image.open(out) as film:
        paces = [one.info["duration"] for one in ImageSequence.Iterator(film)]
    assert (len(paces), sum(paces)) == (30, 1000)
