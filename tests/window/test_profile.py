"""The shadow profile in 3D: hours on all that is seen, and as a relief of the ground."""

import datetime as dt
from dataclasses import replace

import numpy as np
import pytest
from support.desk import Desk
from support.model_files import save_obj
from support.shapes import box, sheet

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.errors import InputError
from umbra.lights import Horizon
from umbra.rays.depth import NOTHING
from umbra.scene import Mesh, Part, directional_light, make_scene
from umbra.sun import find_sun, make_steps
from umbra.window.daylight import ProfilePeriod, find_daily_suns
from umbra.window.frame_profile import count_profile
from umbra.window.overlays import ASIDE, PALETTE
from umbra.window.view_file import from_json, to_json
from umbra.window.view_painter import ViewPainter
from umbra.window.view_state import make_view
from umbra.writers.pixels import shade_ramp

SIZE = (240, 180)
VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")


@pytest.fixture
def painter(device, tower):
    painter = ViewPainter(device, tower, 0.0)
    yield painter
    painter.release()


@pytest.fixture
def view(tower):
    return make_view(tower, SIZE, site=VIENNA, date=dt.date(2026, 3, 21))


@pytest.mark.parametrize(("start", "end", "every"), [(9, 17, 60), (5, 9.25, 30), (0, 24, 180)])
def test_suns_are_a_studys(start, end, every):
    suns = find_daily_suns(VIENNA, dt.date(2026, 3, 29), ProfilePeriod(60 * start, 60 * end, every))
    clock = [f"{int(hour):02}:{int(60 * (hour % 1)):02}" for hour in (start, end)]
    steps = make_steps("2026-03-29", *clock, f"{every}min", "Europe/Vienna")  # summer time begins
    path = find_sun(VIENNA, steps.instants)
    np.testing.assert_allclose(suns.hours, steps.hours[path.is_up], atol=1e-9)
    np.testing.assert_allclose(suns.directions, path.direction[path.is_up], atol=1e-9)
    assert suns.step == every / 60


def test_hours_on_every_surface_are_the_cpus(device, tower):
    wall = Part("wall", "", Mesh(*sheet([(7, -1, 0), (7, 3, 0), (7, 3, 4), (7, -1, 4)])))
    tower = make_scene([*tower.parts, wall])
    painter = ViewPainter(device, tower, 0.0)
    view = make_view(tower, SIZE, site=VIENNA, date=dt.date(2026, 3, 21))
    # What casts nothing is dark where it is turned from the sun, which no volume tells.
    view = replace(view.toggle("profile"), period=ProfilePeriod(540, 945, 60)).toggle_cast(2)
    suns = view.profile_suns()
    assert suns.hours.tolist() == [1, 1, 1, 1, 1, 1, 0.75]
    drawn = painter.draw(view, SIZE)
    assert drawn.period == 6.75
    assert "profile" in drawn.passes
    picture = painter.read() / 255
    counter, camera = FrameCounter(tower, [0, 1], 0.0), view.viewpoint.camera(SIZE)
    seen, frame = counter.see(camera)
    hours = np.zeros(frame.part.shape)
    for way, spent in zip(suns.directions, suns.hours, strict=True):
        light = directional_light(way)
        hours += spent * ~frame.lit(counter.count(seen, camera, light), light)
    is_seen = frame.part != NOTHING
    # The colours are those of a study's pictures, nearly unshaded: a wall's are read on the key.
    ramp = shade_ramp(len(PALETTE))
    place = hours / 6.75 * (len(ramp) - 1)
    pure = np.stack([np.interp(place, np.arange(len(ramp)), tint) for tint in ramp.T], -1)
    shade = 0.97 + 0.03 * frame.normal @ ASIDE
    expected = pure * shade[..., None]
    apart = np.abs(picture - expected).max(2)[is_seen]
    assert (apart > 0.01).mean() < 0.01
    assert len(np.unique(hours[is_seen])) > 8
    west = frame.part == 2
    assert west.sum() > 200
    assert hours[west].min() >= 3  # before noon the sun is behind it
    painter.release()


def test_the_relief_is_as_high_as_rays_say(tower, view):
    suns = replace(view, period=ProfilePeriod(540, 960, 60)).profile_suns()
    relief = count_profile(tower, range(2), 0.0, suns)
    grid = relief.grid
    places = np.stack([*np.meshgrid(grid.x, grid.y), np.zeros(relief.hours.shape)], -1)
    some = np.random.default_rng(3).choice(relief.hours.size, 4000, replace=False)
    points = places.reshape(-1, 3)[some] + tower.origin
    is_covered = umbra.count(tower, points, [(0, 0, 1)])[:, 0]
    hours = umbra.count(tower, points, suns.directions, weights=suns.hours)
    found = relief.hours.ravel()[some]
    assert ((found == -1) == is_covered).mean() > 0.999
    assert (np.abs(found - hours)[~is_covered] < 1e-6).mean() > 0.998
    assert found.max() >= 5
    assert relief.hours.max() * relief.lift <= 6 / 3 + 1e-6  # a third of the tower's height
    rim = np.concatenate([relief.hours[[0, -1]].ravel(), relief.hours[:, [0, -1]].ravel()])
    assert (rim == 0).all()  # the longest shadow is within


def test_the_land_lifts_the_relief_everywhere(painter, tower, view):
    """Its hours are added on all ground, and the scale and the colours go on with the sun up."""
    west = Horizon("west", "", np.array([0.0, 180, 200, 340]), np.array([0.0, 0, 20, 20]))
    period = ProfilePeriod(540, 1020, 60)
    view = replace(view, period=period)
    hidden = replace(view, sun=replace(view.sun, land=west))
    suns, plain = hidden.profile_suns(), view.profile_suns()
    assert suns.behind_land == plain.total - len(suns.hours) == 1
    relief = count_profile(tower, range(2), 0.0, suns)
    rim = np.concatenate([relief.hours[[0, -1]].ravel(), relief.hours[:, [0, -1]].ravel()])
    assert (rim == 1).all()
    assert relief.lift == count_profile(tower, range(2), 0.0, plain).lift
    # One painter, first without the land and then with it: the relief is counted again.
    lows = []
    for one in (view, hidden):
        drawn = painter.draw(one.toggle("profile").toggle("relief"), SIZE)
        assert drawn.period == plain.total
        hours = painter._relief[1].hours
        lows.append(hours[hours >= 0].min())
    assert lows == [0, 1]


def test_the_relief_stands_over_the_picture_and_behind_the_model(painter, tower, view):
    painter.draw(view, SIZE)
    plain = painter.read().astype(int)
    drawn = painter.draw(view.toggle("relief"), SIZE)
    assert drawn.period == 8
    changed = np.abs(painter.read() - plain).max(2) > 8
    part = FrameCounter(tower, ground=0.0).see(view.viewpoint.camera(SIZE))[1].part
    assert changed[part < 0].mean() > 0.02
    assert changed[part == 0].mean() < 0.5
    # It goes with what casts: the hut alone is 1 m high.
    lower = painter.draw(view.toggle("relief").toggle_cast(0), SIZE)
    assert lower.period == 8
    assert painter._relief[1].lift == pytest.approx(1 / 3 / 8)
    assert painter.draw(view.toggle("relief").choose_casters([], 2), SIZE).period == 8
    assert painter._relief[1] is None


def test_without_a_site_there_is_no_profile(painter, tower):
    view = make_view(tower, SIZE)
    painter.draw(view, SIZE)
    plain = painter.read()
    drawn = painter.draw(view.toggle("profile").toggle("relief"), SIZE)
    assert drawn.period == 0
    assert np.abs(painter.read().astype(int) - plain).max() <= 1  # the eye is still


def test_at_night_there_is_no_profile(painter, view):
    night = replace(view, period=ProfilePeriod(0, 120))
    assert night.profile_suns() is None
    assert painter.draw(night.toggle("profile").toggle("relief"), SIZE).period == 0


def test_a_period_is_saved_and_refused(view):
    late = replace(view, period=ProfilePeriod(600, 720, 15))
    assert from_json(to_json(late)).period == late.period
    with pytest.raises(InputError, match="begins before it ends"):
        ProfilePeriod(720, 600)
    described = to_json(late)
    described["period"]["every"] = 0
    with pytest.raises(InputError, match="the view's period is wrong"):
        from_json(described)


def test_keys_show_it_in_a_window(display, tmp_path):
    path = save_obj(tmp_path / "model.obj", {"tower": box((0, 0, 0), (2, 2, 6))})
    site = ("--lat", "48.2", "--lon", "16.37")
    with Desk(display, tmp_path, path.name, *site) as desk:
        desk.press("6", "7")
        assert desk.view().overlays == {"profile", "relief"}
        desk.press("6")
        assert desk.view().overlays == {"relief"}
        assert desk.close() == (0, "", "")
