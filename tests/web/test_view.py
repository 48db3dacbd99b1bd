"""How the page is looked at: plans, sections, keys, themes, targets, saved pictures."""

import base64
from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from support.shapes import box
from support.web import SMALL

import umbra

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "scene.html"
    parts = [umbra.Part(name, "", umbra.Mesh(*box(low, high)), layer=layer)
             for name, layer, low, high in (("a", "old", (-5, -5, 0), (5, 5, 30)),
                                            ("b", "new", (20, -8, 0), (34, 8, 45)),
                                            ("c", "old", (-40, 20, 0), (-20, 30, 6)))]  # fmt: skip
    umbra.show(
        umbra.make_scene(parts, ground=0.0),
        VIENNA,
        date="2026-06-21",
        at="15:00",
        size=SMALL,
        out=path,
    )
    return path


@pytest.fixture
def live(page, written):
    page.resize(1000, 700)
    page.open(written, READY)
    return page


def settle(page):
    page.wait("umbra.waits === 0")


def test_from_above_is_a_plan_with_a_scale(live):
    live.ask("umbra.orbit.look(0, -89.9)")
    settle(live)
    tops = live.ask(
        "[0, 30].map((z) => umbra.stage.renderer.project([5, 5, z].map((v, k) => v -"
        "umbra.model.origin[k])))"
    )
    assert tops[0] == pytest.approx(tops[1])  # upright edges are points
    words = "umbra.stage.pen.fillText = (text) => said.push(text)"
    said = live.ask(f"(() => {{ const said = []; {words}; umbra.stage.draw(umbra.state);"
                    "delete umbra.stage.pen.fillText; return said; })()")  # fmt: skip
    assert any(text.endswith(" m") for text in said)
    spot = live.ask(  # a mark at the corner of a high roof is where the roof is
        "(() => { const position = [5, 5, 30].map((v, k) => v - umbra.model.origin[k]), marks = [];"
        "const { pen } = umbra.stage, draw = pen.arc; pen.arc = (...at) => marks.push(at);"
        "umbra.stage.draw({ ...umbra.state, place: { position, normal: [0, 0, 1], part: 0 } });"
        "pen.arc = draw; const { x, y } = umbra.stage.renderer.project(position);"
        "return Math.min(...marks.map(([a, b]) => Math.hypot(a - x, b - y))); })()"
    )
    assert spot < 1
    held = live.ask("umbra.stage.renderer.pick(200, 200).position")
    live.mouse("mousePressed", 200, 200, button="right", clickCount=1)
    live.mouse("mouseMoved", 260, 230, button="right", buttons=2)
    live.mouse("mouseReleased", 260, 230, button="right")
    settle(live)
    found = live.ask("umbra.stage.renderer.pick(260, 230).position")
    assert found[:2] == pytest.approx(held[:2], abs=0.05)


def test_first_views_and_those_from_above_are_filled_by_compass_and_path(page, tmp_path):
    low = umbra.make_scene(*box((0, 0, 0), (12, 12, 0.5)), ground=0.0)
    equator = umbra.Site(0.0, 0.0, "UTC")
    umbra.show(low, equator, date="2026-03-21", at="15:00", size=SMALL, out=tmp_path / "house.html")
    for width, height in ((1300, 600), (390, 844)):
        page.resize(width, height)
        page.open(tmp_path / "house.html", READY)
        for key in (None, "t"):
            if key:
                page.press(key)
                settle(page)
            seen = np.array(page.ask(
                "(() => { const {wide, high} = umbra.stage.size; return umbra.stage.renderer.lines"
                ".filter((one) => one.width === 2.5 || one.places.length === 121).flatMap((one) =>"
                "one.places).map((place) => { const { x, y } = umbra.stage.renderer.project(place);"
                "return [x / wide, y / high]; }); })()"
            ))  # fmt: skip
            assert (seen > 0).all()
            assert (seen < 1).all()
            filled = np.argmax(np.ptp(seen, axis=0))
            low, high = seen[:, filled].min(), seen[:, filled].max()
            assert high - low > 0.8
            assert abs(low + high - 1) < 0.08  # in the middle


def test_keys_work_wherever_the_focus_is_but_in_what_one_types(live):
    live.ask("document.querySelector('.views button').focus()")
    live.press("t")
    settle(live)
    assert live.ask("umbra.orbit.viewpoint.tilt") == pytest.approx(-89.9)
    live.ask("document.activeElement.blur()")
    live.press("1")
    settle(live)
    assert live.ask("umbra.orbit.viewpoint.tilt") == -20
    live.ask("document.querySelector('.timebar [type=text]').focus()")
    live.press("t")
    settle(live)
    assert live.ask("umbra.orbit.viewpoint.tilt") == -20


def test_a_section_turns_the_view_to_its_cut(live):
    for axis, look in (("level", (0, -89.9)), ("north", (180, -12)), ("east", (270, -12))):
        live.ask(f"(s => {{ s.value = '{axis}'; s.dispatchEvent(new Event('change')); }})"
                 "(document.querySelector('select[aria-label=Section]'))")  # fmt: skip
        settle(live)
        heading, tilt = live.ask("[umbra.state.viewpoint.heading, umbra.state.viewpoint.tilt]")
        assert (heading % 360, tilt) == pytest.approx(look)
        eye = live.ask("umbra.stage.renderer.camera.eye")
        plane = live.ask("umbra.plane")
        assert np.dot(plane[:3], eye) + plane[3] < 0  # on the side that is cut away


def test_a_picture_has_up_to_four_times_the_pixels(live):
    sizes = []
    for times in (1, 3):
        live.ask(
            "(async () => { const reader = new FileReader(), "
            f"blob = await umbra.shoot({times}); await new Promise((done) => "
            "{ reader.onload = done; reader.readAsDataURL(blob); });"
            "window.shot = reader.result; })()"
        )
        data = base64.b64decode(live.ask("window.shot").partition(",")[2])
        sizes.append(Image.open(BytesIO(data)).size)
    settle(live)
    assert sizes[1] == tuple(3 * side for side in sizes[0])
    live.wait(f"umbra.stage.canvas.width === {sizes[0][0]}")  # the page's own is as before


def test_the_theme_is_that_of_the_host(live):
    live.ask("document.body.dataset.jpThemeLight = 'false'")
    live.wait("umbra.root.dataset.theme === 'dark'")
    dark = live.ask("getComputedStyle(umbra.root).backgroundColor")
    live.ask("document.body.dataset.jpThemeLight = 'true'")
    live.wait("umbra.root.dataset.theme === 'light'")
    assert live.ask("getComputedStyle(umbra.root).backgroundColor") != dark


def test_objects_are_listed_by_layer_and_set_with_it(live):
    live.ask("document.querySelectorAll('.panel > details').forEach((e) => { e.open = true; })")
    live.wait("document.querySelectorAll('.things li').length >= 5")
    rows = live.ask("[...document.querySelectorAll('.things li')].map((e) => "
                    "e.querySelector('.label').firstChild.data)")  # fmt: skip
    assert rows[:5] == ["old", "a", "c", "new", "b"]
    # A layer folds, and its objects with it; the focus stays.
    live.ask("document.querySelector('.things .layer button').click()")
    assert live.ask("[...document.querySelectorAll('.things .label')].map((e) => "
                    "e.firstChild.data)") == ["old", "new", "b"]  # fmt: skip
    assert live.ask("document.activeElement.ariaExpanded") == "false"
    live.ask("(s => { s.value = 'off'; s.dispatchEvent(new Event('change')); })"
             "(document.querySelector('.things .layer select'))")  # fmt: skip
    settle(live)
    assert live.ask("[...umbra.after]") == [0, 1, 0]


def test_targets_on_a_phone_are_44_pixels(page, written):
    page.resize(390, 844, is_phone=True)
    page.open(written, READY)
    page.ask("document.querySelectorAll('.panel > details').forEach((e) => { e.open = true; });"
             "umbra.choose(190, 300)")  # fmt: skip
    settle(page)
    small = page.ask(
        "[...document.querySelectorAll('button, select, input, summary, [role=slider]')]"
        ".filter((e) => e.offsetParent && !e.closest('.hidden, .swipe')).map((e) => {"
        "const { width, height } = (e.closest('label') ?? e).getBoundingClientRect();"
        "return [e.outerHTML.slice(0, 90), Math.round(width), Math.round(height)]; })"
        ".filter(([, width, height]) => width < 40 || height < 44)"
    )
    assert small == []
    assert page.ask("document.documentElement.scrollWidth") <= 390
