"""The page of a live model, as people use it, in a real Chromium."""

import base64
import http.client
import itertools
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime
from io import BytesIO
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image
from support.shapes import box
from support.vision import contrast
from support.web import SMALL

import umbra
from umbra.errors import InputError
from umbra.window.view_file import from_json
from umbra.writers.live_study import clear_ground
from umbra.writers.pixels import NO_SUN, paint_shares

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
PLACE = np.array([1000.0, 340000.0, 20.0])
HOSTILE = '</script><img src=x onerror="document.title=1">'
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"
DETAILS = "document.querySelectorAll('.panel > details')"
OBJECTS, DISTANCES = (
    f"[...{DETAILS}].find((e) => e.firstChild.textContent.startsWith('{word}'))"
    for word in ("Objects", "Distances")
)
NOW = "[...document.querySelectorAll('.now-words')].map((e) => e.textContent)"


def block(name, low, high):
    vertices, faces = box(low, high)
    return umbra.Part(name, "building", umbra.Mesh(vertices + PLACE, faces))


def settle(page):
    page.wait("umbra.waits === 0")


def put(page, selector, value):
    """Type or slide a value."""
    page.ask(
        f"(() => {{ const e = document.querySelector(`{selector}`); e.value = '{value}';"
        "e.dispatchEvent(new Event(e.type == 'range' ? 'input' : 'change')); })()"
    )
    settle(page)


def wear(page, name, value):
    """Ask for a media feature."""
    page.send("Emulation.setEmulatedMedia", features=[{"name": name, "value": value}])


def place_at(x, y, z=0):
    """A level place of the quarter, in the page's coordinates."""
    return (
        f"{{position: [{x}, {y}, {z}].map((v, k) => v + {PLACE.tolist()}[k] - "
        "umbra.model.origin[k]), normal: [0, 0, 1], part: -1}"
    )


@pytest.fixture(scope="module")
def quarter():
    """Two towers and a low house, one with a hostile name, far from the origin."""
    return umbra.make_scene(
        [block("tower", (-5, -5, 0), (5, 5, 30)), block(HOSTILE, (30, -8, 0), (44, 8, 45)),
         block("house", (-40, 20, 0), (-20, 30, 6))],
        ground=20.0,
    )  # fmt: skip


@pytest.fixture(scope="module")
def written(quarter, tmp_path_factory):
    path = tmp_path_factory.mktemp("live") / "scene.html"
    umbra.show(quarter, VIENNA, date="2026-06-21", at="15:00", proposed="tower", out=path)
    return path


@pytest.fixture
def live(page, written):
    page.open(written, READY)
    return page


def test_the_page_is_small_whole_and_does_nothing_that_files_command(live, written):
    assert written.stat().st_size < 400_000
    assert live.ask("document.title") == "Scene"
    assert live.ask("document.images.length") == 0
    live.ask(f"{OBJECTS}.open = true")
    live.wait("document.querySelectorAll('.things .label').length")
    labels = "[...document.querySelectorAll('.things .label')]"
    assert live.ask(f"{labels}.map((e) => e.firstChild.data)") == ["tower", HOSTILE, "house"]
    policy = live.ask("document.querySelector('meta[http-equiv]').content")
    assert policy.startswith("default-src 'none'; script-src 'sha256-")


def test_time_and_date_follow_sliders_and_what_is_typed(live):
    def told():
        return live.ask("document.querySelector('.told').textContent")

    assert told().startswith("21 June 2026, 15:00 CEST")
    put(live, ".timebar [type=text]", "9.05")
    assert told().startswith("21 June 2026, 09:05 CEST")
    put(live, ".timebar [type=text]", "25:00")
    assert live.ask("document.querySelector('.timebar [type=text]').value") == "09:05"
    put(live, ".timebar [type=date]", "2026-12-21")
    assert told().startswith("21 December 2026, 09:05 CET")
    put(live, ".daytrack [type=range]", 720)
    path = umbra.find_sun(VIENNA, [np.datetime64("2026-12-21T11:00")])
    found = live.ask("[umbra.sun.altitude, umbra.sun.azimuth]")
    assert found == pytest.approx([path.altitude[0], path.azimuth[0]], abs=0.003)
    assert "sunrise 07:42, sunset 16:03" in told()
    put(live, ".timebar [aria-label='Day of the year']", 0)
    assert told().startswith("1 January 2026, 12:00 CET")


def test_clocks_are_of_the_site(live):
    when = datetime(2026, 6, 21, 13, tzinfo=UTC).timestamp() * 1000
    assert live.ask("umbra.daylight.instant(umbra.state)") == when


def test_a_day_and_a_year_play_without_jumps(live):
    wear(live, "prefers-reduced-motion", "no-preference")
    live.ask("umbra.set({minutes: 600}); window.seen = [];"
             "umbra.notify = (s) => seen.push([s.minutes, ...umbra.sun.direction]);"
             "document.querySelectorAll('button.play')[0].click()")  # fmt: skip
    live.wait("seen.length > 12")
    live.ask("document.querySelectorAll('button.play')[1].click(); window.year = seen.length")
    live.wait("seen.length > year + 12")
    live.ask("document.querySelectorAll('button.play')[1].click()")
    settle(live)
    seen, year = np.array(live.ask("seen")), live.ask("year")
    steps = np.diff(seen[:year, 0])
    assert steps.max() > 0
    assert (steps >= 0).all()
    assert steps.max() < 31  # half a second at most, at an hour a second
    assert (np.diff(seen[year + 1 :, 0]) == 0).all()
    turns = np.degrees(np.arccos(np.clip((seen[1:, 1:] * seen[:-1, 1:]).sum(1), -1, 1)))
    assert turns[year + 1 :].max() < 4
    assert turns[year + 1 :].sum() > 0


def test_from_sunset_a_day_goes_on_at_sunrise(live):
    wear(live, "prefers-reduced-motion", "no-preference")
    live.ask("umbra.set({minutes: 1258.9}); window.least = 1440;"
             "umbra.notify = (s) => { least = Math.min(least, s.minutes); };"
             "document.querySelector('button.play').click()")  # fmt: skip
    live.wait("least < 400")
    live.ask("document.querySelector('button.play').click()")
    assert live.ask("least") > 290  # the sun's centre rises at 04:57


def test_mouse_wheel_and_keys_move_the_view(live):
    def look():
        settle(live)
        return live.ask("umbra.state.viewpoint")

    def drag(button, held, *places):
        live.mouse("mousePressed", *places[0], button=button, clickCount=1)
        live.mouse("mouseMoved", *places[1], button=button, buttons=held)
        live.mouse("mouseReleased", *places[1], button=button)
        settle(live)

    def seen(x, y):
        return live.ask(f"umbra.stage.renderer.pick({x}, {y}).position")

    first = look()
    drag("left", 1, (400, 300), (430, 300))
    turned = look()
    assert (turned["heading"] - first["heading"]) % 360 == pytest.approx(9, abs=0.5)
    place = seen(400, 500)
    live.mouse("mouseWheel", 400, 500, deltaX=0, deltaY=-200)
    assert look()["distance"] == pytest.approx(turned["distance"] / np.exp(0.4), rel=0.01)
    assert seen(400, 500) == pytest.approx(place, abs=0.05)
    drag("right", 2, (400, 500), (350, 480))
    assert seen(350, 480) == pytest.approx(place, abs=0.05)  # what is held stays at the pointer
    live.ask("document.querySelector('canvas.model').focus()")
    live.press("t")
    assert look()["tilt"] == pytest.approx(-89.9)
    assert look()["heading"] == 0
    live.press("1")
    assert look()["tilt"] == -20
    live.press("ArrowDown")
    assert look()["tilt"] == -17
    live.press("Enter")
    assert live.ask("umbra.state.place") is not None


def test_a_pointer_means_the_same_place_in_coarser_frames(live):
    def seen(ratio):
        return live.ask(
            f"(() => {{ const r = umbra.stage.renderer; r.options.pixelRatio = {ratio}; r.draw();"
            "const { x, y } = r.project(r.pick(401, 333).position);"
            "return [r.canvas.height, ...r.pick(401, 333).position, x, y]; })()"
        )

    fine, coarse = seen(1), seen(0.53)
    assert coarse[0] < fine[0]
    assert coarse[1:4] == pytest.approx(fine[1:4], abs=0.05)  # half a pixel
    assert [*fine[4:], *coarse[4:]] == pytest.approx([401, 333, 401, 333], abs=0.3)


def test_where_pages_scroll_the_wheel_is_theirs_until_a_click(live):
    live.ask("umbra.orbit.options.takesWheel = false; umbra.stage.canvas.focus()")
    far = []
    for is_clicked in (False, True):
        if is_clicked:
            live.click(400, 500)
        live.mouse("mouseWheel", 400, 500, deltaX=0, deltaY=-200)
        settle(live)
        far.append(live.ask("umbra.state.viewpoint.distance"))
    assert far[1] == pytest.approx(far[0] / np.exp(0.4), rel=0.01)


def test_two_fingers_hold_the_ground_between_them(live):
    def touch(kind, *places):
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]
        live.send("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        settle(live)

    before = live.ask("umbra.state.viewpoint")
    place = live.ask("umbra.stage.renderer.pick(450, 560).position")
    touch("touchStart", (400, 560), (500, 560))
    touch("touchMove", (350, 560), (550, 560))
    after = live.ask("umbra.state.viewpoint")
    assert after["distance"] == pytest.approx(before["distance"] / 2, rel=0.02)
    assert live.ask("umbra.stage.renderer.pick(450, 560).position") == pytest.approx(place, abs=0.3)
    touch("touchEnd")


def test_a_chosen_place_has_the_hours_that_umbra_computes(live, quarter):
    places = [(-12.0, 9.0, 0.0), (20.0, 14.0, 0.0), (-30.0, 25.0, 6.0), (18.0, 0.0, 0.0)]
    for parts, no_cast in (("after", ()), ("before", "tower")):
        study = umbra.shadow_study(
            quarter, VIENNA, date="2026-06-21", start="04:00", end="22:00", exact=True,
            receivers="points", points=[[*row, 0, 0, 1] for row in places + PLACE],
            no_cast=no_cast,
        )  # fmt: skip
        wanted = np.asarray(study.sun_hours)
        spots = ", ".join(place_at(*row) for row in places)
        found = live.ask(
            f"[{spots}].map((one) => umbra.findSunlight(one, '2026-06-21', umbra.{parts}).hours)"
        )
        assert found == pytest.approx(wanted.tolist(), abs=5 / 3600)
        assert np.ptp(found) > 0.5


def test_a_place_tells_its_sun_and_who_casts_before_and_after(live):
    live.ask(f"umbra.set({{place: {place_at(2, 15)}, minutes: 13 * 60 + 30}})")
    settle(live)
    days = live.ask("[...document.querySelectorAll('.place .day')].map((e) => e.innerText)")
    assert [day.split()[0] for day in days] == ["Before", "After"]
    assert live.ask(NOW) == ["Now in the sun.", "Now in shadow of tower."]
    brief = live.ask("document.querySelector('.brief').textContent")
    assert re.fullmatch(
        r"Before: \d+ h( \d+ min)? of \d+ h \d+ min in the sun, \S+\. Now in the sun\. "
        r"After: \d+ h( \d+ min)? of \d+ h \d+ min in the sun, \S+\. Now in shadow of tower\.",
        brief,
    )  # fmt: skip
    wide = "document.querySelector('.brief').clientWidth"
    assert live.ask(wide) == 1  # beside the panel it is only read out
    live.resize(320, 640, is_phone=True)
    live.wait(f"{wide} > 200")
    live.ask("umbra.set({minutes: 30})")
    settle(live)
    assert set(live.ask(NOW)) == {"The sun is below the horizon."}
    live.ask(f"umbra.set({{minutes: 810, place: {{...{place_at(2, 15)}, normal: [0, 1, 0]}}}})")
    settle(live)
    assert live.ask(NOW)[0].startswith("Now in shadow: the surface is turned away")


def test_an_object_that_is_switched_off_casts_nothing(live):
    live.ask(f"umbra.set({{place: {place_at(2, 15)}, minutes: 13 * 60 + 30, compare: 'after'}})")
    live.ask(f"{OBJECTS}.open = true")
    live.wait("document.querySelectorAll('.things select').length")
    put(live, ".things select", "off")
    assert live.ask(NOW) == ["Now in the sun."]
    assert live.ask("[...umbra.after]") == [0, 1, 1]


def read_picture(page):
    """The PNG that one can save: lines and all, with its caption below."""
    page.ask("(async () => { const reader = new FileReader(), blob = await umbra.shoot();"
             "await new Promise((done) => { reader.onload = done; reader.readAsDataURL(blob); });"
             "window.shot = reader.result; })()")  # fmt: skip
    data = page.ask("window.shot").partition(",")[2]
    return np.asarray(Image.open(BytesIO(base64.b64decode(data))).convert("RGB"), int)[:-26]


def test_before_and_after_differ_by_the_proposal_in_one_picture(live):
    live.ask("umbra.set({compare: 'after', hasPath: false, hasCompass: false})")
    after = read_picture(live)
    live.ask("umbra.set({compare: 'before'})")
    before = read_picture(live)
    live.ask("umbra.set({compare: 'swipe', swipe: 0.5})")
    both = read_picture(live)
    middle = both.shape[1] // 2
    assert (after != before).any(axis=2).mean() > 0.005
    below = slice(40, None)  # of the labels
    assert (both[below, : middle - 2] == before[below, : middle - 2]).all()
    assert (both[below, middle + 2 :] == after[below, middle + 2 :]).all()
    assert (both[:, middle - 1 : middle + 1] == 255).all()  # they are parted, and named
    for labels, same in (
        (both[:36, middle - 110 : middle - 26], before[:36, middle - 110 : middle - 26]),
        (both[:36, middle + 26 : middle + 80], after[:36, middle + 26 : middle + 80]),
    ):
        assert ((labels.max(2) < 90) & (same.max(2) > 90)).sum() > 30
    live.ask("document.querySelector('[role=slider].swipe').focus()")
    live.press("ArrowLeft")
    assert live.ask("umbra.state.swipe") == pytest.approx(0.48)
    words = live.ask(  # from above, the line would run through N, S and 12
        "(() => { umbra.set({hasPath: true, hasCompass: true, swipe: 0.5});"
        "umbra.orbit.look(umbra.north, -89.9); const said = [], { pen, size } = umbra.stage;"
        "pen.fillText = (text, x) => said.push([text, x - size.wide / 2]);"
        "umbra.stage.draw(umbra.state); delete pen.fillText; return said; })()"
    )
    assert {"N", "S", "12"} <= {text for text, _ in words}
    assert min(abs(aside) for _, aside in words) >= 8


def test_shortcuts_work_while_a_slider_has_the_focus(live):
    live.ask("document.querySelector('input[type=range]').focus()")
    before = live.ask("umbra.state.viewpoint.distance")
    live.press("+")
    settle(live)
    assert live.ask("umbra.orbit.viewpoint.distance") < before
    minutes, heading = live.ask("[umbra.state.minutes, umbra.orbit.viewpoint.heading]")
    live.press("ArrowRight")  # the slider's own
    settle(live)
    assert live.ask("umbra.state.minutes") > minutes
    assert live.ask("umbra.orbit.viewpoint.heading") == heading
    live.press("t")
    settle(live)
    assert live.ask("umbra.orbit.viewpoint.tilt") == pytest.approx(-89.9)


def test_the_suns_path_is_whole_from_above(live):
    live.ask("umbra.set({compare: 'before', hasPath: false, hasCompass: false, minutes: 720})")
    live.ask("umbra.orbit.set({...umbra.orbit.viewpoint, heading: 0, tilt: -89.9})")
    settle(live)
    without = read_picture(live)
    live.ask("umbra.set({hasPath: true})")
    drawn = (read_picture(live) != without).any(axis=2)
    lines, view = live.ask(
        "[umbra.stage.renderer.lines.filter((one) => one.width === 2.5).map((one) => one.places),"
        " umbra.state.viewpoint]"
    )
    is_behind = live.ask(
        "umbra.stage.renderer.lines.find((one) => one.width === 2.5).places.map((place) =>"
        "umbra.model.trace(place, [0, 0, 1], { cast: umbra.before }).length > 0)"
    )
    rows, cols = drawn.shape
    (path,) = np.array(lines)
    scale = rows / 2 / np.tan(np.radians(view["fov"]) / 2) / view["distance"]
    x = cols / 2 + (path[:, 0] - view["target"][0]) * scale
    y = rows / 2 - (path[:, 1] - view["target"][1]) * scale
    seen = ~np.array(is_behind) & (x > 9) & (x < cols - 9) & (y > 9) & (y < rows - 9)
    assert seen.sum() > 60
    for col, row in np.rint(np.stack([x, y], 1)[seen]).astype(int):
        assert drawn[row - 6 : row + 7, col - 6 : col + 7].any()


def test_distances_and_sections_are_kept_by_a_link(live, written):
    live.ask("umbra.set({tool: 'measure'})")
    for x, y in ((300, 500), (600, 520)):
        live.click(x, y)
        settle(live)
    ends = live.ask("umbra.state.distances[0]")
    length = float(np.linalg.norm(np.subtract(*ends)))
    assert f"{length:.2f} m" in live.ask(f"{DISTANCES}.textContent")
    live.ask("umbra.set({section: {axis: 'level', at: 0.5, flipped: false}, minutes: 615})")
    live.ask("umbra.set({compare: 'before'})")
    live.wait("location.hash.includes('cut=level') && location.hash.includes('compare=before')")
    link = live.ask("location.hash")
    state = "(({section, compare, minutes}) => [section, compare, minutes])(umbra.state)"
    wanted = live.ask(state)
    live.send("Page.navigate", url="about:blank")
    live.wait("location.href == 'about:blank'")
    live.send("Page.navigate", url=written.as_uri() + link)
    live.wait(f"location.protocol == 'file:' && {READY}")
    assert live.ask(state) == wanted
    assert np.allclose(live.ask("umbra.state.distances[0]"), ends, atol=2e-3)
    low = live.ask("umbra.model.bounds[0][2]")
    assert live.ask("umbra.plane[3]") == pytest.approx(low + 22.5, abs=0.01)


def test_a_link_plays_the_day(page, written):
    page.send("Page.navigate", url="about:blank")
    page.send("Page.navigate", url=written.as_uri() + "#at=2026-06-21T600&play=day")
    page.wait("location.protocol == 'file:' && window.umbra?.state?.minutes > 600")
    assert page.ask("umbra.state.playing") == "day"
    page.ask("umbra.set({playing: null})")
    settle(page)


@pytest.mark.parametrize(
    "link",
    ["#look=1,2&at=x&play=night&p=99999999-0&cut=up&place=1,,,,,,9&far=1;2&r=1-999999999",
     "#look=0,0,0,0,0,-1,45&show=2&compare=x,9", "#" + "a=&" * 500],
)  # fmt: skip
def test_damaged_links_do_no_harm(page, written, link):
    page.resize(800, 600)
    page.send("Page.navigate", url=written.as_uri() + link)
    page.wait(f"location.protocol == 'file:' && {READY}")
    assert page.ask("[umbra.state.date, umbra.state.playing]") == ["2026-06-21", None]


def test_a_saved_view_opens_in_umbra(live):
    view = from_json(live.ask("umbra.describe()"))
    assert view.sun.minutes == 900
    assert view.viewpoint.heading == pytest.approx(live.ask("umbra.state.viewpoint.heading"))
    local = live.ask("umbra.state.viewpoint.target")
    assert np.allclose(view.viewpoint.target, np.add(local, live.ask("umbra.model.origin")))


@pytest.mark.parametrize("width", [320, 1280])
def test_nothing_is_wider_than_the_screen(page, written, width):
    page.resize(width, 640, is_phone=width < 500)
    page.open(written, READY)
    page.ask(f"{DETAILS}.forEach((e) => {{ e.open = true; }}); umbra.set({{compare: 'beside'}})")
    settle(page)
    assert page.ask("document.documentElement.scrollWidth") <= width
    wide = (
        "[...document.querySelectorAll('.frame *')].filter((e) => !e.closest('.hidden') && "
        "e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML.slice(0, 99))"
    )
    assert page.ask(wide) == []


def test_axe_finds_nothing(page, written):
    for width, schemes in ((1280, ("dark", "light")), (320, ("light",))):
        page.resize(width, 700)
        wear(page, "prefers-color-scheme", schemes[0])
        page.open(written, READY)
        page.ask(f"{DETAILS}.forEach((e) => {{ e.open = true; }}); umbra.choose(150, 150)")
        for scheme in schemes:
            wear(page, "prefers-color-scheme", scheme)
            settle(page)
            assert page.audit() == []


def test_a_browser_without_webgl_shows_a_picture(page, written):
    script = (
        "const give = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind) "
        "{ return kind == 'webgl2' ? null : give.call(this, kind); }"
    )
    page.send("Page.addScriptToEvaluateOnNewDocument", source=script)
    page.open(written, "document.documentElement.dataset.ready == 'no'")
    assert page.ask("document.querySelector('.missing img').naturalWidth") == 1280
    assert "WebGL" in page.ask("document.querySelector('[role=alert]').textContent")


def paint_hours(share):
    """Return the colour of a share of hours in shadow, (3,): that of no sun where it is all."""
    return np.array(NO_SUN) if share >= 1 - 1e-4 else paint_shares(share)


def test_hours_of_a_study_lie_on_the_ground_in_its_own_colours(page, quarter, tmp_path):
    study = umbra.shadow_study(quarter, VIENNA, date="2026-06-21", receivers="ground", cell=1.0)
    path = tmp_path / "hours.html"
    umbra.show(quarter, VIENNA, study=study, size=SMALL, out=path)
    page.open(path, READY)
    page.ask("umbra.set({hasPath: false, hasCompass: false, hasEdges: false})")
    page.ask("umbra.orbit.look(0, -89.9)")
    page.wait("umbra.stage.renderer.overlay !== null")
    shown = read_picture(page)
    seen = 0
    for column, row in itertools.product(range(100, 900, 90), range(100, 650, 90)):
        place = page.ask(f"umbra.stage.renderer.pick({column + 0.5}, {row + 0.5})")
        if place["part"] >= 0:
            continue
        x, y = (np.array(place["position"]) + page.ask("umbra.model.origin"))[:2]
        if not (study.x[0] < x < study.x[-1] and study.y[0] < y < study.y[-1]):
            continue
        share = float(study.shadow_hours.sel(x=x, y=y, method="nearest")) / study.result.up_hours
        np.testing.assert_allclose(shown[row, column], paint_hours(share) * 255, atol=8)
        seen += 1
    assert seen >= 10
    assert page.ask("document.querySelector('.ticks').innerText").split()[-1] == "8"
    assert page.ask("document.querySelector('.no-sun').innerText") == "no sun"
    page.ask("document.querySelector('.switch input').click()")
    page.wait("umbra.stage.renderer.overlay === null")
    view = umbra.shadow_study(quarter, VIENNA, date="2026-06-21", receivers="south", cell=2.0)
    with pytest.raises(umbra.InputError, match="receivers='ground', 'top', 'surfaces' or 'points'"):
        umbra.show(quarter, VIENNA, study=view, out=path)
    with pytest.raises(umbra.InputError, match="study= is a str, not a study"):
        umbra.show(quarter, VIENNA, study="hours", out=path)


def find_own(samples, place, normal):
    """Find the sample whose square holds a place, None near its rim or where there is none."""
    for s in np.flatnonzero(samples.surface_normal @ normal > 0.999):
        own = np.flatnonzero(samples.surface == s)
        away = (samples.points[own] - place) @ samples.surface_normal[s]
        flat = np.abs((samples.points[own] - place) @ samples.axes[s].T).max(1)
        if np.abs(away).min() < 0.01 and flat.min() < 0.45 * samples.spacing:
            return int(own[flat.argmin()])
    return None


def test_hours_lie_on_walls_and_roofs_in_their_own_colours(page, quarter, tmp_path):
    study = umbra.shadow_study(
        quarter, VIENNA, date="2026-06-21", receivers="surfaces", spacing=3.0
    )
    umbra.show(quarter, VIENNA, study=study, size=SMALL, out=tmp_path / "walls.html")
    page.open(tmp_path / "walls.html", READY)
    page.ask("umbra.set({hasPath: false, hasCompass: false, hasEdges: false})")
    page.wait("umbra.stage.renderer.overlay?.patches != null")
    samples, origin = study.result.samples, quarter.origin
    hours, seen = np.asarray(study.shadow_hours), set()
    for heading in (20, 200):
        page.ask(f"umbra.orbit.look({heading}, -30)")
        settle(page)
        shown = read_picture(page)
        for column, row in itertools.product(range(60, 900, 17), range(60, 650, 17)):
            hit = page.ask(f"umbra.stage.renderer.pick({column + 0.5}, {row + 0.5})")
            around = shown[row - 1 : row + 2, column - 1 : column + 2]
            if hit is None or hit["part"] < 0 or np.ptp(around, axis=(0, 1)).any():
                continue
            place = np.add(hit["position"], page.ask("umbra.model.origin")) - origin
            k = find_own(samples, place, hit["normal"])
            if k is not None:
                share = float(hours[k]) / study.result.up_hours
                np.testing.assert_allclose(shown[row, column], paint_hours(share) * 255, atol=8)
                seen.add(k)
    assert len(seen) > 40
    assert len({float(hours[k]) for k in seen}) > 4
    with pytest.raises(umbra.InputError, match="lie on another model, of 36 triangles"):
        umbra.show(umbra.make_scene(*box((0, 0, 0), (1, 1, 1))), VIENNA, study=study, out="x.html")


def test_hours_of_points_are_discs_and_those_behind_are_faint(page, quarter, tmp_path):
    points = np.array([[0, -6, 4, 0, -1, 0], [-30, 25, 7, 0, 0, 1], [0, 6, 4, 0, 1, 0]], float)
    points[:, :3] += PLACE
    study = umbra.shadow_study(
        quarter, VIENNA, date="2026-06-21", receivers="points", points=points
    )
    umbra.show(quarter, VIENNA, study=study, size=SMALL, out=tmp_path / "points.html")
    page.open(tmp_path / "points.html", READY)
    page.ask("umbra.set({hasPath: false, hasCompass: false}); umbra.orbit.look(0, -30)")
    page.wait("umbra.stage.renderer.overlay?.dots != null")
    settle(page)
    shown = read_picture(page)
    for k, is_seen in enumerate((True, True, False)):
        place = (points[k, :3] - page.ask("umbra.model.origin")).tolist()
        at = page.ask(f"umbra.stage.renderer.project({place})")
        ink = shown[round(at["y"]), round(at["x"])]
        share = float(study.shadow_hours[k]) / study.result.up_hours
        off = np.abs(ink - paint_hours(share) * 255).max()
        assert off <= 8 if is_seen else off > 20


GROUND = """Array.from({length: 400}, (_, k) => [11 + 44 * (k % 20), 9 + 30 * Math.floor(k / 20)])
  .flatMap(([x, y]) => {
    const {wide, high} = umbra.stage.size;
    const place = x < wide && y < high && umbra.stage.renderer.pick(x, y);
    if (!place || place.part >= 0) return [];
    umbra.state.place = place;
    const lit = umbra.isLit(true);
    umbra.state.place = null;
    return [[x, y, lit]];
  })"""
"""Pixels of level ground, and whether rays find it in the sun."""


def test_pages_of_scenes_without_a_site_set_the_sun_by_angles(page, quarter, tmp_path):
    umbra.show(quarter, size=SMALL, out=tmp_path / "bare.html")
    page.resize(900, 700)
    page.open(tmp_path / "bare.html", READY)
    put(page, ".timebar [type=number]", "90")
    direction = page.ask("umbra.sun.direction")
    assert direction[0] > 0.1
    assert abs(direction[1]) < 1e-9
    page.ask("umbra.set({hasPath: false, hasCompass: false, hasEdges: false})")
    for altitude in (0.5, 7):
        page.ask(f"umbra.set({{azimuth: 90, altitude: {altitude}}})")
        settle(page)
        seen = read_picture(page) / 255
        ground = page.ask(GROUND)
        lit, dark = (np.median([seen[y, x] for x, y, state in ground if state is is_lit], 0)
                     for is_lit in (True, False))  # fmt: skip
        assert contrast(lit, dark) >= 2.8


def test_pages_refuse_what_only_other_devices_know(quarter, tmp_path):
    out = tmp_path / "refused.html"
    for given in ({"soft": "wedges"}, {"method": "max"}, {"device": "cpu"}, {"mask_scale": 2},
                  {"detail": 2.0}, {"layer_gap": 0.3}):  # fmt: skip
        with pytest.raises(InputError, match=f"{next(iter(given))}= is for umbra's own devices"):
            umbra.show(quarter, out=out, **given)
    assert not out.exists()


def ask_server(url, path=None, **headers):
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    connection.request("GET", parts.path if path is None else path, headers=headers)
    return connection.getresponse()


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to one process")
def test_the_command_serves_the_page_to_its_address_alone(tmp_path):
    vertices, faces = box((0, 0, 0), (10, 10, 20))
    lines = ["v {} {} {}".format(*row) for row in vertices.tolist()]
    lines += ["f {} {} {}".format(*row) for row in (faces + 1).tolist()]
    file = tmp_path / "tower.obj"
    file.write_text("\n".join(lines))
    site = ["--lat", "48.2", "--lon", "16.37"]
    command = [sys.executable, "-m", "umbra", "view", str(file), *site, "--web"]
    lacking = {"DISPLAY", "WAYLAND_DISPLAY", "BROWSER"}
    clean = {name: value for name, value in os.environ.items() if name not in lacking}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=clean, **pipes) as served:
        url = served.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", url)
        page = ask_server(url)
        assert page.status == 200
        assert b"Content-Security-Policy" in page.read()
        assert page.headers["X-Frame-Options"] == "DENY"
        assert ask_server(url, "/").status == 404
        assert ask_server(url, urlsplit(url).path[:-2] + "x/").status == 404
        assert ask_server(url, Host="example.org").status == 404
        served.send_signal(signal.SIGINT)
        _, said = served.communicate(timeout=60)
    assert served.returncode == 0
    assert "Traceback" not in said


def test_a_model_that_lies_in_its_ground_shows_no_patches(page, tmp_path):
    slab = replace(umbra.make_scene(*box((-20, -15, -1), (20, 15, 0))), ground=0.0)
    study = umbra.shadow_study(slab, VIENNA, date="2026-06-21", receivers="ground", cell=1.0)
    shown = []
    for given, side in (({}, -1), ({"study": study}, 1)):
        umbra.show(slab, VIENNA, date="2026-06-21", size=SMALL, out=tmp_path / "slab.html", **given)
        page.resize(900, 600)
        page.open(tmp_path / "slab.html", READY)
        assert 0 < side * page.ask("umbra.config.ground") < 0.02
        page.ask("umbra.set({hasPath: false, hasCompass: false, hasEdges: false})")
        page.ask("umbra.orbit.look(30, -35)")
        settle(page)
        seen = read_picture(page)
        high, wide = seen.shape[:2]
        middle = seen[high // 2 - 20 : high // 2 + 20, wide // 2 - 60 : wide // 2 + 60]
        assert np.ptp(middle, axis=(0, 1)).max() <= 2
        shown.append(middle.mean((0, 1)))
    assert np.abs(shown[0] - shown[1]).max() > 20
    raised = replace(slab, ground=-0.5)
    assert clear_ground(raised, -0.5, is_above=False) == -0.5
