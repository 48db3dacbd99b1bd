"""Styles of pictures: ground, sky, lines, caption and alpha; arrays stay what they were."""

import re
from importlib.resources import files

import numpy as np
import pytest
from PIL import Image
from support.model_files import save_obj
from support.shapes import box, sheet
from support.vision import contrast

import umbra
from umbra.calls.finish import write_caption
from umbra.calls.lines import LineFinder
from umbra.calls.openness import (
    find_openness,
    find_sky_directions,
    follow_openness,
    smooth_openness,
)
from umbra.calls.picture import draw_picture
from umbra.calls.picture_options import RenderOptions
from umbra.cpu.shade import encode_srgb
from umbra.devices import find_device
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.scene import Material, Mesh, Part, make_scene
from umbra.scene.camera import fit_camera
from umbra.scene.exposure import HORIZON, find_exposure
from umbra.scene.pale import BRIGHTEST, PAPER, RISE, STUDIO, expose_suns
from umbra.writers.typeface import note_missing

SIZE = (80, 60)
SUN = umbra.directional_light((-0.5, -0.4, 0.8))


def make_tower(**looks):
    vertices, faces = box((-3, -3, 0), (3, 3, 8))
    mesh, material = Mesh(vertices, faces), Material(**looks)
    return make_scene([Part("tower", "building", mesh, material=material)])


def see(scene, camera, ground, count=64):
    frames = find_device("cpu").open_frames(scene, ground, casters=None, threads=1, warn=print)
    with frames as counter:
        view, frame = counter.see(camera)
        return view, frame, find_openness(counter, view, frame, camera, count)


def test_arrays_do_not_depend_on_the_style():
    scene = make_tower()
    camera = umbra.make_camera(scene, size=SIZE)
    plain, *others = (
        umbra.render(scene, camera, SUN, arrays=True, style=style)
        for style in ("plain", "auto", "architectural")
    )
    assert not plain.is_seen.all()  # no style adds a ground to arrays
    for other in others:
        for name, array in plain.arrays().items():
            np.testing.assert_array_equal(other.arrays()[name], array)
    np.testing.assert_array_equal(others[0].image, plain.image)
    assert (others[1].image != plain.image).any()


def test_the_sun_has_its_penumbra_in_pictures_but_not_in_arrays_nor_at_lamps():
    vertices, faces = box((-60, -60, -1), (60, 60, 0))
    scene = make_scene([*make_tower().parts, Part("yard", "", Mesh(vertices, faces))])
    low = umbra.directional_light((-1, 0, 0.15))  # a shadow of 53 m, blurred by half a metre
    camera = umbra.make_camera(scene, view="plan", size=(160, 160))
    drawn = {soft: umbra.render(scene, camera, low, soft=soft, samples=1, style="material")
             for soft in (None, "complexity", "none")}  # fmt: skip
    np.testing.assert_array_equal(drawn[None], drawn["complexity"])
    assert (drawn[None] != drawn["none"]).any()
    arrays = umbra.render(scene, camera, low, arrays=True, style="material")
    assert arrays.visibility is None
    lamp = umbra.point_light((-20, 0, 9))
    by_lamp = {soft: umbra.render(scene, camera, lamp, soft=soft, samples=1, style="material")
               for soft in (None, "none")}  # fmt: skip
    np.testing.assert_array_equal(by_lamp[None], by_lamp["none"])


def test_a_street_is_seen_from_above_its_ground():
    vertices, faces = box((-3, -3, 0), (3, 3, 6))
    houses = [
        Part(f"house {k}", "Building", Mesh(vertices + (6 * (k % 2), 12 * k, -2 * k), faces))
        for k in range(9)  # they stand on a hillside that falls to the north
    ]
    scene = make_scene(houses)
    x, y, z = umbra.make_camera(scene, view="street", size=SIZE).eye
    down = umbra.make_camera(scene, eye=(x, y, 90), target=(x, y, 0), up=(0, 1, 0), size=(3, 3))
    below = umbra.render(scene, down, SUN, ground="feet", arrays=True).position[1, 1, 2]
    assert -16 < below == pytest.approx(z - 1.7, abs=0.1)
    assert umbra.make_camera(make_scene(houses[:1]), view="street").eye[2] == pytest.approx(1.7)


def test_a_ground_is_drawn_and_told_where_the_model_has_none():
    scene, told = make_tower(), []
    camera = umbra.make_camera(scene, size=SIZE)
    seen = {}
    for ground in (None, False, -2.0):
        options = RenderOptions(ground=ground, samples=1)
        picture = draw_picture(
            scene, camera, [SUN], options, print, is_bare=False, tell=told.append
        )
        seen[ground] = picture.position[..., 2]
    assert [line.split(";")[1] for line in told] == [
        " one is drawn at z = 0 m, as a study would assume"
    ]
    assert np.nanmin(seen[None]) == pytest.approx(0, abs=1e-9)
    assert np.isnan(seen[False]).any()
    assert np.nanmin(seen[-2.0]) == pytest.approx(-2, abs=1e-9)


def test_a_model_with_terrain_gets_no_ground():
    vertices, faces = sheet([(-20, -20, 1), (20, -20, 2), (20, 20, 3), (-20, 20, 2)])
    land = Part("land", "TINRelief", Mesh(vertices, faces))
    scene, told = make_scene([*make_tower().parts, land]), []
    camera = umbra.make_camera(scene, size=SIZE)
    draw_picture(
        scene, camera, [SUN], RenderOptions(samples=1), print, is_bare=False, tell=told.append
    )
    assert told == []


def test_textured_and_glossy_models_keep_their_colours():
    glossy = make_tower(color=(0.9, 0.1, 0.1), roughness=0.5)
    camera = umbra.make_camera(glossy, size=SIZE)
    auto, material, pale = (
        umbra.render(glossy, camera, SUN, style=style)
        for style in ("auto", "material", "architectural")
    )
    np.testing.assert_array_equal(auto, material)
    assert (pale != material).any()


def test_sky_directions_are_even_over_the_sky():
    toward = find_sky_directions(64)
    np.testing.assert_allclose(np.linalg.norm(toward, axis=1), 1.0)
    assert toward[:, 2].min() >= 0.1
    # Evenly over the sky: heights are even from a tenth to the zenith.
    assert np.diff(toward[:, 2]) == pytest.approx(-0.9 / 64)
    np.testing.assert_allclose(toward[:, :2].mean(0), 0.0, atol=0.03)


def test_openness_is_the_share_of_the_sky_over_a_wall():
    """Beside a long wall of height h at distance d, a level surface sees (1 + cos a) / 2."""
    high, away = 10.0, 4.0
    vertices, faces = box((-500, 0, 0), (500, 1, high))
    scene = make_scene([Part("wall", "", Mesh(vertices, faces))])
    camera = umbra.Camera((0, -away, 30), (0, -away, 0), (0, 1, 0), size=(5, 5), height=1.0)
    _, frame, openness = see(scene, camera, 0.0)
    assert (frame.part == GROUND).all()
    angle = np.arctan2(high, away)
    assert openness[2, 2] == pytest.approx((1 + np.cos(angle)) / 2, abs=0.04)


def test_openness_is_smooth_on_faces_and_sharp_between_them():
    scene = make_tower()
    camera = umbra.make_camera(scene, size=(400, 300))
    _, frame, few = see(scene, camera, 0.0, 48)
    _, _, many = see(scene, camera, 0.0, 600)
    on_ground = frame.part == GROUND
    # Each of the 48 shadows has an edge of a fiftieth on the ground.
    step = np.abs(np.diff(few, axis=1))[on_ground[:, 1:] & on_ground[:, :-1]]
    assert np.quantile(step, 0.99) < 0.008
    assert np.abs(few - many)[on_ground].mean() < 0.0075
    is_lit = np.where(on_ground, np.float32(0.25), np.float32(1))
    kept = smooth_openness(is_lit, frame.position, np.nan_to_num(frame.normal))
    np.testing.assert_array_equal(kept, is_lit)


def test_openness_of_the_open_is_whole_and_of_another_face_a_neighbours():
    scene = make_tower()
    camera = umbra.make_camera(scene, size=SIZE)
    view, frame, openness = see(scene, camera, None)
    top = frame.normal[..., 2] > 0.9
    assert (openness[top] == 1).all()
    face = view.face.copy()
    row, col = np.argwhere((view.face[1:] != view.face[:-1]) & (view.face[1:] != NOTHING))[0]
    face[row, col] = view.face[row + 1, col]
    marked = openness.copy()
    marked[view.face == face[row, col]] = 0.25
    found = follow_openness(marked, view, DepthBuffer(view.key, face))
    assert found[row, col] == np.float32(0.25)
    found[row, col] = marked[row, col]
    np.testing.assert_array_equal(found, marked)


@pytest.mark.parametrize("height", [None, 14.0])
def test_lines_run_along_outlines_and_creases_but_not_along_diagonals(height):
    scene = make_tower()
    camera = umbra.make_camera(scene, size=(160, 120), height=height)
    view, frame, _ = see(scene, camera, None)
    ink = LineFinder(scene).find(view, camera)
    is_model = frame.part >= 0
    edge = np.zeros_like(is_model)
    edge[:, 1:] |= is_model[:, 1:] & ~is_model[:, :-1]
    assert (ink[edge] == 1).all()
    assert (ink[~is_model] == 0).all()
    inner = is_model & (ink > 0) & (ink < 1)
    assert inner.any()  # creases
    # Each face of the box is two triangles; where only these differ, there is nothing.
    same = np.abs((frame.normal[:, 1:] * frame.normal[:, :-1]).sum(-1)) > 0.99
    differ = (view.face[:, 1:] != view.face[:, :-1]) & same
    assert differ.any()
    quiet = differ & (ink[:, 1:] == 0) & (ink[:, :-1] == 0)
    assert quiet.sum() > 0.7 * differ.sum()  # but where a crease runs by


def test_what_is_transparent_has_alpha_and_its_own_colour():
    scene = make_tower(color=(0.8, 0.1, 0.1))
    camera = umbra.make_camera(scene, size=SIZE)
    image = umbra.render(scene, camera, SUN, transparent=True, style="plain")
    seen = umbra.render(scene, camera, SUN, arrays=True).is_seen
    assert image.shape == (60, 80, 4)
    alpha = image[..., 3]
    assert (alpha[[0, -1]] == 0).all()
    assert set(np.unique(alpha[seen])) > {255}  # whole inside, in part along the edge
    partly = (alpha > 0) & (alpha < 255)
    assert partly.any()
    red, green, _, _ = image[partly].T.astype(int)
    assert (red > 2 * green).all()  # nothing of the background's colour


def test_a_caption_stands_at_the_foot_and_is_never_cut():
    image = np.full((200, 300, 3), 128, np.uint8)
    written = write_caption(image, "2026-03-21 15:00 CET")
    rows, cols = np.nonzero((written != image).any(-1))
    assert rows.min() > 170
    assert cols.min() < 20
    long = write_caption(image, "word " * 14)
    assert np.nonzero((long != image).any(-1))[1].max() < 299


def test_letters_that_pictures_lack_are_told():
    assert note_missing("21 März · 15:00 Ωμέγα, Москва") == ""
    assert "has \U000f0001 \U000f0002 of the caption" in note_missing(
        "é\U000f0001\U000f0002\U000f0001"
    )


@pytest.mark.parametrize("size", [(160, 120), (120, 160)])
@pytest.mark.parametrize("fov", [20.0, 70.0])
def test_the_default_camera_fills_the_picture_but_for_a_margin(fov, size):
    scene = make_scene([Part("slab", "", Mesh(*box((100, 200, 5), (180, 215, 9))))])
    picture = umbra.render(
        scene, umbra.make_camera(scene, size=size, fov=fov), SUN, arrays=True, samples=1
    )
    rows, cols = np.nonzero(picture.is_seen)
    left, right = cols.min(), size[0] - 1 - cols.max()
    top, bottom = rows.min(), size[1] - 1 - rows.max()
    assert abs(left - right) <= 2
    assert abs(top - bottom) <= 2
    assert min(left / size[0], top / size[1]) == pytest.approx(0.06, abs=0.015)


def test_an_orthographic_camera_is_centred():
    scene = make_tower()
    camera = fit_camera(umbra.Camera((50, -80, 60), (9, 9, 9), size=SIZE, height=20.0),
                        scene.triangles().vertices + scene.origin)  # fmt: skip
    rows, cols = np.nonzero(umbra.render(scene, camera, SUN, arrays=True, samples=1).is_seen)
    assert abs(rows.min() - (59 - rows.max())) <= 1
    assert abs(cols.min() - (79 - cols.max())) <= 1


def test_the_sky_is_even_at_the_horizon_and_the_ground_fades_into_it():
    scene = make_tower()
    camera = umbra.Camera((0, -40, 3), (0, 0, 3), size=SIZE)
    image = umbra.render(scene, camera, SUN, style="material", samples=1)
    above, below = image[28, 2].astype(int), image[31, 2].astype(int)
    assert np.abs(above - below).max() <= 3
    horizon = 255 * (1.055 * np.array(HORIZON) ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(below, horizon, atol=3)
    assert (image[0, 2] < above).all()  # deeper above


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--height", "20", "--fov", "30"], "--fov is the angle of a perspective view"),
        (["--style", "nice"], "architectural"),
    ],
)
def test_what_does_not_go_together_is_refused(options, words, tmp_path, capsys):
    from umbra.cli.main import main  # noqa: PLC0415

    path = save_obj(tmp_path / "tower.obj", {"tower": box((-3, -3, 0), (3, 3, 8))})
    with pytest.raises(SystemExit, match="2"):
        main(["render", str(path), *options, "--out", str(tmp_path / "a.png")])
    assert words in capsys.readouterr().err


def test_the_command_writes_the_suns_time_and_tells_the_ground(tmp_path, capsys):
    from umbra.cli.main import main  # noqa: PLC0415

    path = save_obj(tmp_path / "tower.obj", {"tower": box((-3, -3, 0), (3, 3, 8))})
    pictures = {}
    runs = {"told": [], "other": ["--caption", "x"], "bare": ["--no-ground"],
            "plain": ["--style", "plain"]}  # fmt: skip
    for name, more in runs.items():
        out = tmp_path / f"{name}.png"
        with pytest.raises(SystemExit, match="0"):
            main([
                "render", str(path), "--axis-up", "z", "--size", "400x300",
                "--lat", "48.2", "--lon", "16.37", "--tz", "Europe/Vienna", "--date", "2026-03-21",
                "--at", "15:00", "--out", str(out), "--samples", "1", *more,
            ])  # fmt: skip
        told = capsys.readouterr().err
        assert ("one is drawn at z = 0 m" in told) == (name != "bare")
        pictures[name] = np.asarray(Image.open(out)).astype(int)
    foot = np.s_[280:, :250]
    assert (pictures["told"][foot] < 80).any()
    assert (pictures["told"][foot] != pictures["other"][foot]).any()

    scene = umbra.read(path, up="z")
    camera = umbra.make_camera(scene, size=(400, 300))
    sun = umbra.sun_light(umbra.Site(48.2, 16.37, "Europe/Vienna"), "2026-03-21", "15:00")
    seen = umbra.render(scene, camera, sun, arrays=True, ground=0.0)
    on_ground = seen.position[..., 2] == 0.0
    on_ground[foot] = False
    lit = seen.lit[0]
    bright, dark = (pictures["plain"][on_ground & mask].mean() for mask in (lit, ~lit))
    assert bright > 1.4 * dark  # the shadow falls on the ground of a file
    image = umbra.render(scene, camera, sun, style="plain", samples=1)
    bare = umbra.render(scene, camera, sun, style="plain", samples=1, ground=False)
    np.testing.assert_array_equal(image, bare)  # and Python's image has none


def test_lamps_alone_shine_at_night_and_it_is_told():
    scene, told, images = make_tower(), [], {}
    camera = umbra.make_camera(scene, eye=(25, -30, 6), target=(0, 0, 6), size=SIZE)
    lamp = umbra.point_light((9, -12, 6))
    for name, lights, style in [
        ("night", [lamp], "architectural"), ("day", [lamp, SUN], "architectural"),
        ("plain", [lamp], "plain"),
    ]:  # fmt: skip
        options = RenderOptions(style=style, ground=0.0)
        picture = draw_picture(
            scene, camera, lights, options, print, is_bare=False, tell=told.append
        )
        images[name] = picture.image.astype(int)
    assert told == [line for line in told if "lamps shine alone" in line]
    assert len(told) == 1
    sky = {name: image[2].mean() for name, image in images.items()}
    assert sky["night"] < 60
    assert min(sky["day"], sky["plain"]) > 180
    lit, dark = picture.lit[0], picture.is_seen & ~picture.lit[0]
    night = images["night"].mean(-1)
    assert night[dark].mean() < 75
    assert night[lit].max() > 110


def test_a_drawing_of_lamps_alone_has_the_sky_of_the_picture():
    pytest.importorskip("pyclipr")
    scene = make_tower()
    with pytest.warns(UserWarning, match="a lamp's light"):
        skies = [
            umbra.draw_vectors(
                scene, None, umbra.point_light((9, -12, 6)), shadows=shadows
            ).page.sky
            for shadows in ("solid", "hatched")
        ]
    night, day = (max(max(color) for _, color in sky) for sky in skies)
    assert night < 60
    assert day > 180


@pytest.mark.parametrize("rise", [0.03, 0.12, 0.3, 0.55, 0.9])
def test_shadows_on_paper_are_blue_grey_and_stand_out_at_every_time_of_day(rise):
    level = np.sqrt(1 - rise**2)
    sun = umbra.directional_light((-0.8 * level, -0.6 * level, rise))
    camera = umbra.make_camera(make_tower(), size=SIZE, view="plan")
    options = RenderOptions(samples=1, style="architectural")
    found = draw_picture(make_tower(), camera, [sun], options, print, is_bare=False)
    image = found.image / 255
    ground = (np.abs(found.position[..., 2]) < 1e-6) & (
        np.hypot(*(np.moveaxis(found.position[..., :2], -1, 0))) < 9
    )
    lit, dark = (np.median(image[ground & state], 0) for state in (found.lit[0], ~found.lit[0]))
    assert contrast(lit, dark) >= 2.8
    assert lit[0] >= lit[2]
    assert dark[2] > dark[0] + 0.02


ALTITUDES = (0.1, 1, 3, 7, 12, 20, 45, 90)


def make_sun(altitude):
    """Return a sun in the east, and as pictures expose it."""
    rise = np.sin(np.radians(altitude))
    sun = umbra.directional_light((np.sqrt(1 - rise**2), 0, rise))
    return sun, *expose_suns([sun])


def find_sunlight(sun, cosine):
    return find_exposure(1) * cosine * sun.find_bend(cosine) * np.array(sun.color)


def test_shadows_on_level_ground_stand_out_by_one_law_in_pictures_and_windows():
    for altitude in ALTITUDES:
        _, sun = make_sun(altitude)
        sunlight = find_sunlight(sun, np.sin(np.radians(altitude)))
        lit, dark = (
            encode_srgb(np.array(PAPER) * (STUDIO.from_above + light)) / 255
            for light in (sunlight, 0)
        )
        assert contrast(lit, dark) >= 2.8


def test_level_ground_takes_as_much_of_every_low_sun_and_no_wall_more_than_of_one_at_25_degrees():
    facing = find_sunlight(make_sun(25)[1], 1.0)
    level = find_sunlight(make_sun(40)[1], np.sin(np.radians(40)))
    for altitude in ALTITUDES:
        _, sun = make_sun(altitude)
        assert (find_sunlight(sun, 1.0) <= facing * (1 + 1e-12)).all()
        if np.sin(np.radians(altitude)) < RISE:
            ground = find_sunlight(sun, np.sin(np.radians(altitude)))
            np.testing.assert_allclose(ground, level, rtol=1e-6)


def test_pictures_and_the_live_page_expose_by_one_law():
    script = (files("umbra.web") / "stage.js").read_text()
    numbers = {name: float(n) for name, n in re.findall(r"\b([A-Z]+) = ([0-9.]+)[,;]", script)}
    assert (numbers["RISE"], numbers["BRIGHTEST"]) == (RISE, BRIGHTEST)


def test_a_wall_before_a_sun_of_three_degrees_is_not_white():
    tower = make_tower(color=(0.8, 0.8, 0.8))
    camera = umbra.Camera((30, 0, 4), (0, 0, 4), size=(40, 30), fov=20)
    sun, _ = make_sun(3)
    options = RenderOptions(samples=1, style="architectural")
    image = draw_picture(tower, camera, [sun], options, print, is_bare=False).image
    wall = image[15, 20]
    assert wall.min() > 200
    assert wall.max() < 250
