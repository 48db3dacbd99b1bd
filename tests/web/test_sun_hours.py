"""Hours of sun in the page: counts of its volumes are umbra's, and follow the interval."""

import base64
from itertools import pairwise

import numpy as np
import pytest
from support.shapes import box
from support.web import describe_camera

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.ground.choice import find_ground
from umbra.rays.depth import GROUND, NOTHING
from umbra.scene import Camera, directional_light, make_scene
from umbra.web.pack import quantise

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"
SIZE = (160, 120)
CAMERAS = {
    "bird": Camera((60, -90, 70), (5, 5, 5), size=SIZE),
    "plan": Camera((5, 5, 90), (5, 5, 0), up=(0, 1, 0), size=SIZE, height=110.0),
    "street": Camera((-30, -35, 3), (10, 10, 8), size=SIZE),
}
WHOLE = "umbra.waits === 0 && umbra.sunHours.isWhole"


@pytest.fixture(scope="module")
def town():
    """Two towers, a low house and a plate in the air, on level ground."""
    parts = (("a", (-5, -5, 0), (5, 5, 30)), ("b", (20, -8, 0), (34, 8, 45)),
             ("c", (-40, 20, 0), (-20, 30, 6)),
             ("plate", (-20, -30, 9), (0, -15, 9.5)))  # fmt: skip
    return make_scene(
        [umbra.Part(name, "", umbra.Mesh(*box(low, high))) for name, low, high in parts], ground=0.0
    )


def find_suns(date, start, end):
    """Return the suns at the middles of quarters of an hour, by UTC, (n, 3)."""
    begin = np.datetime64(f"{date}T{start}") + np.timedelta64(450, "s")
    instants = np.arange(begin, np.datetime64(f"{date}T{end}"), np.timedelta64(15, "m"))
    return np.asarray(umbra.find_sun(VIENNA, instants).direction)


def count_masks(picture, suns, ratio=1):
    """Count in the browser how many of these suns reach each pixel, -1 where nothing is seen."""
    text = picture.page.ask(
        f"(() => {{ const m = new SunMasks(picture, false), suns = {suns.tolist()};"
        f"m.begin({ratio}, suns); suns.forEach((_, k) => m.count(k));"
        "m.sum(suns.map((_, k) => k)); const {width, height} = m.sheet;"
        "return encode(m.read(0, 0, width, height)); })()"
    )
    cols, rows = (int(side * ratio) for side in SIZE)
    return np.frombuffer(base64.b64decode(text), np.int16).reshape(rows, cols)[::-1]


def spread(differs):
    """Return where a pixel or one of its eight neighbours is marked."""
    wide = np.pad(differs, 1)
    return np.any([wide[1 + a : wide.shape[0] - 1 + a, 1 + b : wide.shape[1] - 1 + b]
                   for a in (-1, 0, 1) for b in (-1, 0, 1)], axis=0)  # fmt: skip


def find_edges(image):
    """Return the pixels that differ from a neighbour."""
    edges = np.zeros(image.shape, bool)
    edges[1:] |= image[1:] != image[:-1]
    edges[:, 1:] |= image[:, 1:] != image[:, :-1]
    return spread(edges)


def bound_hours(rounded, camera, suns, ground):
    """Return umbra's view, and how many suns reach each pixel at least and at most."""
    counter = FrameCounter(rounded, ground=ground)
    view, _ = counter.see(camera)
    soup = rounded.triangles()
    a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
    normals = np.concatenate([np.cross(b - a, c - a), [(0, 0, 1)]])  # the last is the ground's
    normal = normals[np.where(view.face == GROUND, len(normals) - 1, np.maximum(view.face, 0))]
    is_facing = normal @ suns.T > 0  # (rows, cols, suns)
    least, most = np.zeros((2, *view.face.shape), int)
    for k, sun in enumerate(suns):
        is_lit = (counter.count(view, camera, directional_light(sun)) == 0) & is_facing[..., k]
        is_edge = find_edges(is_lit)
        least += is_lit & ~is_edge
        most += is_lit | is_edge
    return view, least, most


@pytest.mark.parametrize("name", CAMERAS)
def test_hours_of_32_instants_are_umbras_at_each_pixel(picture, town, name):
    camera, rounded = CAMERAS[name], quantise(town)
    suns = find_suns("2026-03-21", "08:00", "16:00")
    assert len(suns) == 32
    picture.load(town, SIZE, samples=1)
    picture.set("camera", describe_camera(camera, rounded))
    picture.set("ground", float(-rounded.origin[2]))
    found = count_masks(picture, suns)
    view, least, most = bound_hours(rounded, camera, suns, ground=0.0)
    is_inside = ~find_edges(view.face) & (view.face != NOTHING)
    assert ((found == -1) == (view.face == NOTHING)).mean() > 0.99
    assert ((least <= found) & (found <= most))[is_inside].all()
    is_sure = is_inside & (least == most)
    assert is_sure.mean() > 0.4
    assert is_inside.mean() > 0.6
    assert len(np.unique(found[is_inside])) > 15


def test_a_ground_seen_from_above_leaves_sides_out_and_no_shadow(picture):
    # Houses on a slope, and the ground that umbra assumes: it steps beneath each of them.
    rng = np.random.default_rng(3)
    houses = [box((x, y, z := 0.3 * x + rng.uniform(-2, 2)), (x + 8, y + 6, z + rng.uniform(4, 12)))
              for x in range(-40, 41, 16) for y in range(-40, 41, 16)]  # fmt: skip
    slope = make_scene([umbra.Part(f"{k}", "Building", umbra.Mesh(*house))
                        for k, house in enumerate(houses)])  # fmt: skip
    scene = find_ground(slope, "feet").scene
    rounded, suns = quantise(scene), find_suns("2026-03-21", "06:00", "14:00")
    picture.load(scene, SIZE, samples=1)
    size = "picture.findStage({}).shadows.draws.reduce((sum, {size}) => sum + size, 0)"
    shares = []
    for camera in (
        Camera((40, -90, 60), (0, 0, 3), size=SIZE), Camera((-60, -60, 2), (0, 0, 3), size=SIZE),
        Camera((0, 0, 90), (0, 0, 0), up=(0, 1, 0), size=SIZE, height=90.0),
    ):  # fmt: skip
        picture.page.ask("model.assumedGround = null; picture.begin()")
        picture.set("camera", describe_camera(camera, rounded))
        found, some = count_masks(picture, suns), picture.page.ask(size)
        picture.page.ask("model.assumedGround = {ground: null}; picture.begin()")
        whole = count_masks(picture, suns)
        shares.append(some / picture.page.ask(size))
        few = suns[::4]
        view, least, most = bound_hours(rounded, camera, few, ground=None)
        part = rounded.triangles().part[np.maximum(view.face, 0)]
        is_inside = ~find_edges(np.where(view.face == NOTHING, -1, part)) & (view.face != NOTHING)
        picture.page.ask("model.assumedGround = null; picture.begin()")
        count_masks(picture, suns[-1:])
        assert picture.page.ask(size) == some  # whatever sun was before
        counted = count_masks(picture, few)
        assert ((least <= counted) & (counted <= most))[is_inside].mean() > 0.999
        assert (is_inside & (least == most)).mean() > 0.2
        assert (found == whole).mean() > 0.999
    over, low, plan = shares
    assert max(over, plan) < 0.5
    assert low == 1  # this eye may see what is below the ground's top


def test_two_faces_in_one_place_count_once(picture):
    wall = make_scene(*box((0, 0, 0), (10, 10, 10)))
    twice = umbra.make_scene([wall.parts[0], wall.parts[0]], ground=0.0)
    rounded = quantise(twice)
    picture.load(twice, SIZE, samples=1)
    picture.set("camera", describe_camera(Camera((5, 5, 40), (5, 5, 0), up=(0, 1, 0), size=SIZE,
                                                 height=7.0), rounded))  # fmt: skip
    assert (count_masks(picture, np.array([[0.1, 0.1, 1.0]])) == 1).all()
    assert (count_masks(picture, np.tile([[0.1, 0.1, 1.0]], (40, 1))) == 40).all()


@pytest.fixture(scope="module")
def written(town, tmp_path_factory):
    path = tmp_path_factory.mktemp("hours") / "scene.html"
    umbra.show(town, VIENNA, date="2026-06-21", at="15:00", out=path)
    return path


@pytest.fixture
def live(page, written):
    page.resize(1000, 760)
    page.open(written, READY)
    page.ask("umbra.set({hasSunHours: true})")
    page.wait(WHOLE)
    return page


def test_hours_at_a_place_are_those_of_a_study(live, town):
    spots = [(x, y) for x in range(120, 640, 65) for y in range(180, 520, 55)]
    picks = [live.ask(f"umbra.stage.renderer.pick({x + 0.5}, {y + 0.5})") for x, y in spots]
    hours = [live.ask(f"umbra.sunHours.read({x}, {y})") for x, y in spots]
    points = [[*np.add(pick["position"], live.ask("umbra.model.origin")), *pick["normal"]]
              for pick in picks]  # fmt: skip
    study = umbra.shadow_study(town, VIENNA, date="2026-06-21", receivers="points", points=points)
    off = np.abs(np.array(hours) - np.asarray(study.sun_hours))
    assert (off < 1e-6).mean() > 0.9  # others lie within a pixel of an edge
    assert off.max() <= 0.25
    assert len(set(hours)) > 6


def test_an_interval_changes_by_keys_and_pointer_without_new_volumes(live):
    live.wait("umbra.sunHours.masks.fine.isCounted.every(Boolean)")  # the day's rest, too
    live.ask("umbra.sunHours.masks.fine.count = () => { throw new Error('counted again'); }")
    whole = live.ask("umbra.sunHours.read(60, 500)")
    assert whole == 8
    handle = "document.querySelector('.end[aria-label$=\"{}\"]')"
    live.ask(f"{handle.format('until')}.focus()")
    live.press("PageDown")
    live.press("ArrowLeft")
    live.wait(WHOLE)
    assert live.ask("umbra.state.interval") == [540, 945]
    assert live.ask("umbra.sunHours.read(60, 500)") == 6.75
    at = live.ask(f"(r => [r.left + r.width / 2, r.top + 10])({handle.format('from')}"
                  ".getBoundingClientRect())")  # fmt: skip
    day = live.ask("document.querySelector('.interval').clientWidth")
    live.mouse("mousePressed", *at, button="left", clickCount=1)
    live.mouse("mouseMoved", at[0] + day / 24, at[1], button="left", buttons=1)
    live.mouse("mouseReleased", at[0] + day / 24, at[1], button="left")
    live.wait(WHOLE)
    assert live.ask("umbra.state.interval") == [600, 945]
    assert live.ask("umbra.sunHours.read(60, 500)") == 5.75
    live.wait("location.hash.includes('hours=600,945')")


def test_any_date_is_counted_in_part_then_in_full_and_coarsely_in_motion(live):
    for at_rest, date in ((True, "2026-09-21"), (False, "2026-12-21")):
        is_whole, is_part, width = live.ask(
            "(() => { const hours = umbra.sunHours; hours.costs = {coarse: 50, fine: 50};"
            f"hours.changed = {'-Infinity' if at_rest else 'Infinity'};"  # never or now
            f"umbra.set({{date: '{date}', interval: [0, 1440]}}); umbra.stage.draw(umbra.state);"
            "const {isWhole, layer, wanted} = hours;"
            "return [isWhole, layer.most < wanted.length, layer.masks.sheet.width]; })()"
        )
        assert (is_whole, is_part) == (False, True)
        assert (width == 670) == at_rest
    live.wait(WHOLE)
    assert live.ask("umbra.sunHours.layer.masks.sheet.width") == 670
    study = umbra.shadow_study(
        make_scene(*box((500, 500, 0), (501, 501, 1))), VIENNA, date="2026-12-21",
        start="00:00", end="24:00", receivers="points", points=[[0, 0, 0, 0, 0, 1]],
    )  # fmt: skip
    assert live.ask("umbra.sunHours.most") == pytest.approx(float(study.sun_hours[0]))
    live.ask("umbra.sunHours.changed = Infinity;"
             "umbra.set({date: '2026-07-01', interval: [0, 60]})")  # fmt: skip
    live.wait(WHOLE)  # of a night, with nothing to count
    assert live.ask("umbra.sunHours.most") == 0


def test_a_batch_of_instants_that_seems_to_cost_nothing_costs_half_the_last(live):
    # Two batches are seen to end at one look: the second seems to cost nothing.
    count = """(async () => {
      const hours = umbra.sunHours, {fine} = hours.masks, {gl} = umbra.stage.renderer.device;
      const costs = [], {fenceSync, clientWaitSync} = gl;
      fine.count = (k) => { fine.isCounted[k] = 1; };
      gl.fenceSync = (...x) => { costs.push(hours.costs.fine); return fenceSync.apply(gl, x); };
      gl.clientWaitSync = () => gl.ALREADY_SIGNALED;
      const begun = Date.now();
      umbra.set({date: DATE});
      hours.costs.fine = 50;
      while (!fine.isCounted.every(Boolean) || !hours.isWhole) {
        if (Date.now() - begun > 20000) break;
        await new Promise((done) => setTimeout(done, 5));
      }
      Object.assign(gl, {fenceSync, clientWaitSync});
      return costs;
    })()"""
    # On a busy machine the page may draw coarsely meanwhile, and begin anew with other masks.
    for day in range(1, 6):
        costs = live.ask(count.replace("DATE", f"'2026-05-0{day}'"))
        if len(costs) >= 4:
            break
    assert len(costs) >= 4
    # Two batches may end between two that are asked for.
    assert all(after >= before / 4 for before, after in pairwise(costs)), costs


def test_the_key_of_hours_covers_no_wind_beside_a_place_on_a_phone(live):
    live.resize(390, 844, is_phone=True)
    live.ask("umbra.set({hasCompass: true})")
    live.ask("umbra.choose(200, 250)")
    live.ask("umbra.set({viewpoint: {...umbra.state.viewpoint, tilt: -55}})")
    live.wait("umbra.waits === 0 && umbra.sunHours.isWhole && umbra.state.place !== null")
    winds, [left, top, wide, high] = live.ask("""(() => {
      const {pen} = umbra.stage, {fillText, rect} = pen, winds = [];
      let key = null;
      pen.fillText = (text, x, y) => { if (/^[NESW]{1,2}$/.test(text)) winds.push([x, y]); };
      pen.rect = (...sides) => { key = sides; };
      umbra.stage.draw(umbra.state);
      Object.assign(pen, {fillText, rect});
      return [winds, key];
    })()""")
    assert len(winds) >= 5
    assert not any(left < x < left + wide and top < y < top + high for x, y in winds)
    sentence = live.ask("(r => r.bottom)(document.querySelector('.brief').getBoundingClientRect())")
    assert top >= sentence


def test_the_pointer_tells_hours_and_the_key_names_interval_and_clock(live):
    live.mouse("mouseMoved", 60, 500)
    live.wait("!document.querySelector('.tip').hidden")
    assert live.ask("document.querySelector('.tip').textContent") == "8 h 00 min of sun"
    live.mouse("mouseMoved", 900, 500)  # beside the picture
    live.wait("document.querySelector('.tip').hidden")
    words = live.ask(
        "(() => { const said = [], pen = umbra.stage.pen, fill = pen.fillText;"
        "pen.fillText = (text) => said.push(text); umbra.stage.draw(umbra.state);"
        "pen.fillText = fill; return said; })()"
    )
    when = "09:00\u201317:00"
    assert {"Hours of sun, 21 June 2026", f"{when} CEST · steps of 15 min", "8 h"} <= set(words)
    live.ask("umbra.choose(60, 500)")
    live.wait("umbra.waits === 0")
    assert live.ask("document.querySelector('.within').textContent").startswith(f"{when}: 8 h")
    live.ask("umbra.set({hasSunHours: false, date: '2026-05-01'})")
    live.wait("umbra.waits === 0")
    assert live.ask("umbra.stage.renderer.hours") is None
    # A pointer at the button counts the first instants, which a click shows.
    button = live.ask("(r => [r.left + 9, r.top + 9])"
                      "(document.querySelector('.counts').getBoundingClientRect())")  # fmt: skip
    live.mouse("mouseMoved", *button)
    live.wait("umbra.sunHours.masks.fine.isCounted.filter(Boolean).length >= 4")
    assert live.ask("umbra.sunHours.layer") is None
    live.ask("umbra.sunHours.masks.fine.begin = () => { throw new Error('begun again'); }")
    live.mouse("mousePressed", *button, button="left", clickCount=1)
    live.mouse("mouseReleased", *button, button="left", clickCount=1)
    live.wait(WHOLE)
    assert live.ask("umbra.sunHours.layer.most") == 32
