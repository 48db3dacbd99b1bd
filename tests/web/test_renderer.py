"""Pictures of the renderer in the browser: what is lit, parts, picks, lost contexts."""

import base64
from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box
from support.web import describe_camera, describe_light

from umbra.cpu.frame import FrameCounter
from umbra.rays.depth import GROUND
from umbra.scene import Camera, Mesh, Part, directional_light, make_scene, point_light
from umbra.scene.scene import Scene
from umbra.web.pack import quantise

SIZE = (96, 80)
CAMERA = Camera((20, -25, 14), (0, 0, 3), size=SIZE)
SUN = directional_light((0.4, 0.3, 0.7))


@pytest.fixture
def scene():
    """A box on the ground and a plate that floats above it, as two parts."""
    parts = (("box", (-3, -3, 0), (3, 3, 6)), ("plate", (-6, 4, 8), (6, 9, 8.5)))
    return Scene(
        tuple(Part(name, "", Mesh(*box(low, high))) for name, low, high in parts), np.zeros(3)
    )


def load(picture, scene, light=SUN):
    """Show a scene on the ground without edges, in one sample; return the picture."""
    rounded = quantise(scene)
    picture.load(scene, SIZE, samples=1, style={"edges": False})
    picture.set("camera", describe_camera(CAMERA, rounded))
    picture.set("lights", [describe_light(light, rounded)])
    picture.set("ground", float(-rounded.origin[2]))
    return picture


@pytest.fixture
def shown(picture, scene):
    return load(picture, scene)


def read_pixels(picture):
    """Draw, and give the picture, (rows, cols, 4) uint8."""
    cols, rows = SIZE
    text = picture.page.ask(
        f"(() => {{ picture.draw(); const gl = picture.device.gl; "
        f"const found = new Uint8Array(4 * {cols * rows}); "
        f"gl.readPixels(0, 0, {cols}, {rows}, gl.RGBA, gl.UNSIGNED_BYTE, found); "
        "return encode(found); })()"
    )
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(rows, cols, 4)[::-1]


def test_the_ground_is_dark_exactly_where_the_count_is_not_0(shown, scene):
    counts = shown.count(times=1)
    red = read_pixels(shown)[..., 0].astype(int)
    view, _ = FrameCounter(quantise(scene), ground=0.0).see(CAMERA)
    on_ground = view.face == GROUND
    on_ground[:30] = False  # farther off it fades into the horizon
    # Pixels at the foot of the box may be either's.
    on_ground[1:-1, 1:-1] &= on_ground[:-2, 1:-1] & on_ground[2:, 1:-1]
    on_ground[1:-1, 1:-1] &= on_ground[1:-1, :-2] & on_ground[1:-1, 2:]
    dark, lit = red[on_ground & (counts > 0)], red[on_ground & (counts == 0)]
    assert len(dark) > 20
    assert len(lit) > 200
    assert dark.max() + 30 < lit.min()


@pytest.mark.parametrize("rise", [4.0, -4.0])
@pytest.mark.parametrize("side", [-2.0, 0.0, 2.0])
@pytest.mark.parametrize("light", [SUN, point_light((14, -2, 8))])
def test_a_light_above_reaches_the_ground_as_seen_from_above_alone(shown, scene, rise, side, light):
    """An orthographic view has no place: its eye may lie above a ground that is seen from below."""
    rounded = quantise(scene)
    camera = Camera((12, -10, side), (12, 0, side + rise), size=SIZE, height=8)
    shown.set("camera", describe_camera(camera, rounded))
    shown.set("lights", [describe_light(light, rounded)])
    lit = read_pixels(shown)[..., :3].astype(int)
    shown.set("lights", [describe_light(directional_light((0, 0, -1)), rounded)])
    from_below = read_pixels(shown)[..., :3].astype(int)
    at = 4 if rise < 0 else -4, SIZE[0] // 2  # rays that begin on the side from which they come
    assert (lit[at] > from_below[at]).all() == (rise < 0)
    assert (lit[at] < from_below[at]).all() == (rise > 0)


def test_a_part_that_is_off_neither_casts_nor_shows(shown):
    everything = shown.count()
    shown.page.ask("picture.setParts([1, 0])")
    alone = shown.count()
    shown.page.ask("picture.setParts([1, 0], [1, 1])")
    ghost = read_pixels(shown)
    shown.page.ask("picture.setParts([0, 0])")
    assert not shown.count().any()
    empty = read_pixels(shown)
    assert np.count_nonzero(everything) > np.count_nonzero(alone) > 0
    assert np.any(ghost != empty)
    shown.page.ask("picture.setParts([0, 1], [1, 0])")  # an unseen plate still casts
    assert shown.count().any()


def test_a_roof_is_dark_where_something_shades_it(shown, scene):
    shown.set("lights", [describe_light(directional_light((0.4, 0.9, 0.7)), quantise(scene))])
    assert (read_at(shown, 0, 2.2, 6) + 30 < read_at(shown, 0, -2, 6)).all()


def test_volumes_are_listed_anew_when_the_eye_comes_into_one(shown, scene):
    camera = Camera((-6, 3, 0.5), (0, 3, 0.2), size=SIZE)  # in the shadow of the plate
    outside = shown.count(times=1)
    shown.set("camera", describe_camera(camera, quantise(scene)))
    inside = shown.count(times=1)
    counter = FrameCounter(quantise(scene), ground=0.0)
    view, _ = counter.see(camera)
    expected = counter.count(view, camera, SUN)
    assert np.count_nonzero(inside != expected) < 0.01 * inside.size
    assert np.count_nonzero(inside) > np.count_nonzero(outside) + 100


def test_a_pick_finds_part_place_and_normal(shown):
    shown.draw()
    spot = shown.page.ask(
        "picture.project([-model.origin[0], -model.origin[1], 6 - model.origin[2]])"
    )
    hit = shown.page.ask(f"picture.pick({spot['x']}, {spot['y']})")
    assert hit["part"] == 0
    assert hit["normal"] == [0, 0, 1]
    place = np.add(hit["position"], shown.page.ask("model.origin"))
    assert place == pytest.approx([0, 0, 6], abs=1e-6)
    ground = shown.page.ask("picture.pick(5, 75)")
    assert ground["part"] == -1


def read_at(picture, x, y, z):
    """Give the pixel that shows a place of the scene."""
    place = (np.array([x, y, z]) - picture.page.ask("model.origin")).tolist()
    pixels = read_pixels(picture)
    at = picture.page.ask(f"picture.project({place})")
    return pixels[round(at["y"]), round(at["x"]), :3].astype(int)


def test_a_section_fills_what_it_cuts_of_solids(shown):
    level = 3.0 - shown.page.ask("model.origin[2]")
    shown.set("clip", [0, 0, -1, level])
    solid = read_at(shown, 0, 0, 3)
    assert np.abs(solid - [59, 62, 71]).max() <= 3
    # The plate is cut away whole, and with it what it would fill.
    assert read_at(shown, 0, 6.5, 3).min() > 90
    shown.set("clip", [0, 0, 1, -level])  # from above, what stays hides the cut
    assert np.abs(read_at(shown, 0, 0, 6) - solid).max() > 60
    shown.set("clip", None)


def test_glass_is_seen_through_and_casts_as_before(picture, scene):
    found, inks = [], []
    for opacity in (1.0, 0.3):
        box_part, plate = scene.parts
        glass = replace(plate, material=replace(plate.material, opacity=opacity))
        load(picture, replace(scene, parts=(box_part, glass)))
        found.append(picture.count())
        inks.append((read_at(picture, 3, 6.5, 8.5), read_at(picture, 6, -6, 0)))
    assert np.array_equal(*found)
    assert np.count_nonzero(found[0]) > 100
    assert np.abs(inks[0][0] - inks[1][0]).max() > 10  # the plate
    assert np.abs(inks[0][1] - inks[1][1]).max() == 0  # the ground in the sun


@pytest.mark.parametrize("light", [SUN, point_light((0, 0, 9))])
def test_a_sheet_is_lit_alike_whichever_way_it_is_wound(picture, light):
    corners = np.array([(-4, -4, 5), (4, -4, 5), (4, 4, 5), (-4, 4, 5)], float)
    inks = []
    for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 2, 1], [0, 3, 2]]):
        load(picture, make_scene(corners, np.array(faces)), light)
        inks.append(read_at(picture, 0, 0, 5))
    assert np.abs(inks[0] - inks[1]).max() <= 1
    assert inks[0].min() > 150


def test_a_lost_context_is_restored_and_draws_the_same(shown):
    before = read_pixels(shown)
    events = shown.page.ask(
        """new Promise((done) => {
          const lost = picture.device.gl.getExtension('WEBGL_lose_context');
          const said = [];
          picture.onlost = () => { said.push('lost'); picture.draw(); setTimeout(() => lost.restoreContext(), 0); };
          picture.onrestored = () => { said.push('restored'); done(said); };
          lost.loseContext();
        })"""  # noqa: E501
    )
    assert events == ["lost", "restored"]
    assert np.array_equal(read_pixels(shown), before)
    shown.page.events.clear()  # Chromium warns of a lost context


def test_without_webgl2_the_error_has_a_name(shown):
    found = shown.page.ask(
        """(() => {
          const canvas = document.createElement('canvas');
          canvas.getContext('2d');
          try { new Renderer(canvas, model); return 'no error'; }
          catch (error) { return error.constructor.name + ': ' + error.message; }
        })()"""
    )
    assert found.startswith("WebGLMissing: this browser gives no WebGL2")


def test_more_lights_add_up_and_a_lamp_reaches_its_range(shown):
    lamp = "{position: [-10, -10, 5], range: 6}"
    direction = "{direction: [0.4, 0.3, 0.7]}"
    shown.page.ask(f"picture.lights = [{direction}]")
    one = read_pixels(shown).astype(int)
    shown.page.ask("picture.lights = []")
    night = read_pixels(shown).astype(int)
    shown.page.ask(f"picture.lights = [{direction}, {lamp}]")
    both = read_pixels(shown).astype(int)
    assert (one >= night).all()
    assert (one > night).any()
    assert (both[..., 0] != one[..., 0]).any()
