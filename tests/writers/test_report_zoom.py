"""Plans that zoom, and what a report is on paper, to who listens, and in forced colours."""

import re

import numpy as np
import pytest
from support.pages import FIGURES, INK, READY, RECT, expect, place_of, words
from writers.test_report import make_study, save

from umbra.writers.report.markup import Pin, Table

CELL = "document.getElementById('where').textContent"


@pytest.fixture(scope="module")
def study():
    return make_study(every="1h")


@pytest.fixture
def plan(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    page.ask("document.getElementById('map').scrollIntoView({block: 'center'})")
    return page


def find_place(page):
    said = words(page, "where")[0].replace("\u2212", "-")
    return np.array([float(v) for v in re.search(r"x (\S+), y (\S+) m", said).groups()])


def look(page, x, y):
    page.mouse("mouseMoved", x, y)
    return find_place(page)


def measure(page):
    """Give metres per pixel, by two places that are read."""
    left, top, wide, high = page.ask(RECT)
    a, b = (look(page, left + wide * f, top + high * f) for f in (0.25, 0.75))
    return (b - a) / (0.5 * wide, -0.5 * high)


def wheel(page, x, y, delta, modifiers=0):
    page.mouse("mouseWheel", x, y, deltaX=0, deltaY=delta, modifiers=modifiers)


def test_ctrl_and_wheel_enlarge_about_the_pointer(plan, study):
    left, top, wide, high = plan.ask(RECT)
    x, y = left + 0.3 * wide, top + 0.6 * high
    before, scale = look(plan, x, y), measure(plan)
    wheel(plan, x, y, -300, modifiers=2)
    plan.wait("document.getElementById('map').classList.contains('zoomed')")
    assert look(plan, x, y) == pytest.approx(before, abs=0.51)
    times = scale / measure(plan)
    assert times == pytest.approx(np.exp(1.2), rel=0.05)
    # What is read there is still what the study found.
    for fx, fy in ((0.2, 0.3), (0.5, 0.5), (0.8, 0.7)):
        place = look(plan, left + fx * wide, top + fy * high)
        row, col = (int(np.abs(axis - v).argmin()) for axis, v in
                    zip((study.y, study.x), place[::-1]))  # fmt: skip
        assert words(plan, *FIGURES) == expect(study, row, col)


def test_a_wheel_turns_the_page_until_the_picture_is_in_use(plan):
    left, top, wide, high = plan.ask(RECT)
    x, y = left + wide / 2, top + high / 2
    is_zoomed = "document.getElementById('map').classList.contains('zoomed')"
    was = plan.ask("scrollY")
    wheel(plan, x, y, 120)
    plan.wait(f"scrollY > {was}")
    assert not plan.ask(is_zoomed)
    plan.ask("document.getElementById('map').scrollIntoView({block: 'center'})")
    plan.click(x, y)
    wheel(plan, x, y, -120)
    plan.wait(is_zoomed)
    at = plan.ask("scrollY")
    # All the way back, the page turns again.
    wheel(plan, x, y, 2000)
    plan.wait(f"!{is_zoomed}")
    assert plan.ask("scrollY") == at
    wheel(plan, x, y, 120)
    plan.wait(f"scrollY > {at}")


def test_keys_and_buttons_zoom_and_the_picture_follows_the_place(plan):
    whole = measure(plan)
    plan.ask("document.getElementById('map').focus()")
    plan.press("+")
    plan.press("+")
    assert whole / measure(plan) == pytest.approx(2.25, rel=0.03)
    left, top, _, high = plan.ask(RECT)
    was = look(plan, left + 2, top + high / 2)[0]
    plan.mouse("mouseMoved", 5, 5)
    for _ in range(9):
        plan.press("ArrowLeft", modifiers=8)
    place = find_place(plan)
    left, top, _, high = plan.ask(RECT)
    edge = look(plan, left + 2, top + high / 2)[0]
    assert edge <= place[0] < was  # it is in sight, and was not
    plan.press("-")
    assert whole / measure(plan) == pytest.approx(1.5, rel=0.03)
    plan.press("0")
    assert measure(plan) == pytest.approx(whole)
    for name, times in (("+", 1.5), ("+", 2.25), ("-", 1.5), ("0", 1)):
        plan.ask(f"document.querySelector('[data-zoom=\"{name}\"]').click()")
        assert whole / measure(plan) == pytest.approx(times, rel=0.03)


def test_what_is_enlarged_is_dragged_and_a_drag_keeps_no_place(plan):
    plan.ask("document.querySelector('[data-zoom=\"+\"]').click()")
    plan.ask("document.querySelector('[data-zoom=\"+\"]').click()")
    left, top, wide, high = plan.ask(RECT)
    x, y = left + wide / 2, top + high / 2
    plan.mouse("mouseMoved", 5, 5)
    kept = words(plan, "where")
    before = look(plan, x, y)
    plan.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
    plan.mouse("mouseMoved", x + 30, y + 20, button="left", buttons=1)
    plan.mouse("mouseMoved", x + 90, y + 40, button="left", buttons=1)
    plan.mouse("mouseReleased", x + 90, y + 40, button="left", clickCount=1)
    assert look(plan, x + 90, y + 40) == pytest.approx(before, abs=0.51)
    plan.mouse("mouseMoved", 5, 5)
    assert words(plan, "where") == kept


def test_two_fingers_enlarge(page, study, tmp_path):
    page.resize(390, 844, is_phone=True, dot=2)
    page.send("Emulation.setTouchEmulationEnabled", enabled=True)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    x, y = place_of(page, study, 70, 80)
    scale = 70 / page.ask(RECT)[3]

    def touch(kind, *apart):
        points = [{"x": x + side * d, "y": y, "id": k} for d in apart for k, side in
                  enumerate((-1, 1))]  # fmt: skip
        page.send("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    touch("touchStart", 20)
    for apart in (25, 30, 40, 50, 60):
        touch("touchMove", apart)
    touch("touchEnd")
    assert page.ask("document.getElementById('map').classList.contains('zoomed')")
    left, top, wide, high = page.ask(RECT)
    places = []
    for f in (0.3, 0.7):
        page.send("Input.dispatchTouchEvent", type="touchStart",
                  touchPoints=[{"x": left + wide / 2, "y": top + high * f}])  # fmt: skip
        page.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        places.append(find_place(page))
    assert scale / ((places[0] - places[1])[1] / (0.4 * high)) == pytest.approx(3, rel=0.15)


def test_a_move_is_told_in_one_short_line_and_a_step_in_none(plan):
    live = (
        "[...document.querySelectorAll('#stage [aria-live], #stage [role=status], #stage output')]"
        ".filter(e => e.getAttribute('aria-live') !== 'off').map(e => e.id)"
    )
    assert plan.ask(live) == ["said", "sky-way"]  # what the sky's own pointer is at
    plan.mouse("mouseMoved", *plan.ask(RECT)[:2])
    plan.ask("document.getElementById('map').focus()")
    for _ in range(5):
        plan.press("ArrowRight")
    plan.wait("document.getElementById('said').textContent")
    said = words(plan, "said")[0]
    assert len(said) < 100
    plan.mouse("mouseMoved", 5, 5)
    sun, of_up, shadow, where = words(plan, "in-sun", "of-up", "in-shadow", "where")
    assert said == f"{where}: {sun} of sun{of_up}, {shadow} of shadow"
    plan.ask("document.activeElement.blur()")
    plan.press("ArrowRight")
    plan.ask("new Promise(done => setTimeout(done, 700))")
    assert words(plan, "said") == [said]


@pytest.mark.parametrize("extent", [(-40, -25, 40, 45), (-30, -100, 30, 100)])
def test_on_paper_nothing_lies_over_anything(page, tmp_path, extent):
    study = make_study(date=["2026-03-21", "2026-06-21"], every="2h", extent=extent, cell=2)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    page.send("Emulation.setEmulatedMedia", media="print")
    page.resize(718, 1000)  # an A4 page within its margins
    page.ask("dispatchEvent(new Event('beforeprint'))")
    page.wait("document.getElementById('paper').complete")
    boxes = page.ask(
        "['clock', 'sun', 'paper', 'where', 'in-sun', 'longest', 'line', 'spell-list'].map(id => "
        "(r => [r.left, r.top, r.right, r.bottom])(document.getElementById(id)"
        ".getBoundingClientRect()))"
    )
    for k, (left, top, right, bottom) in enumerate(boxes):
        assert right > left
        assert bottom > top
        assert right <= 718.5
        for other in boxes[k + 1 :]:
            apart = (other[0] >= right - 1, other[2] <= left + 1, other[1] >= bottom - 1,
                     other[3] <= top + 1)  # fmt: skip
            assert any(apart), (k, other)
    left, top, right, bottom = boxes[2]
    rows, cols = study.shadow_hours.shape
    assert (right - left) / (bottom - top) == pytest.approx(cols / rows, rel=0.02)
    assert bottom - top < 520  # with room for its words on the same page
    shown = "[...document.querySelectorAll('.modes span')].filter(s => s.offsetWidth)"
    assert page.ask(f"{shown}.map(s => s.textContent)") == ["Hours in shadow, this date"]
    assert page.ask("document.getElementById('paper').naturalWidth") > 1.5 * (right - left)


def test_a_clock_with_its_date_keeps_to_a_narrow_page(page, tmp_path):
    study = make_study(date=["2026-03-21", "2026-06-21"], every="2h", cell=2)
    page.resize(320, 640, is_phone=True)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    right = "document.getElementById('{}').getBoundingClientRect().right"
    assert page.ask(right.replace("{}", "clock")) <= page.ask(right.replace("{}", "stage")) + 0.5
    reach = (
        "(r => (r.selectNodeContents(document.getElementById('clock')), r.getBoundingClientRect()"
        ".right))(document.createRange())"
    )
    assert page.ask(reach) <= page.ask(right.replace("{}", "stage")) + 0.5


def test_places_of_verdicts_are_pinned_and_a_line_leads_there(page, study, tmp_path):
    pins = [Pin("bench", 20.0, 20.0, True), Pin("<b>swing", -1.0, 1.0, False, "inside house")]
    verdicts = Table(
        "Rules: 1 of 3 fail", ("check", "where", "verdict"),
        [("area", "open ground", "pass"), ("a", "bench", "pass"), ("b", "<b>swing", "fail")],
        kind="place", index=[None, 0, 1], link=1, pins=pins,
    )  # fmt: skip
    page.open(save(tmp_path / "report.html", study, tables=[verdicts])[0], READY)
    for _ in range(4):
        page.ask("document.querySelector('[data-zoom=\"+\"]').click()")
    rows = page.ask("document.querySelectorAll('tbody tr[data-kind=place]').length")
    assert rows == 2
    heads = {}
    for k, pin in enumerate(pins):
        page.ask(f"document.querySelectorAll('tr[data-kind=place] button')[{k}].click()")
        said = words(page, "where")[0]
        assert said.startswith(f"{pin.name}, {pin.standing}: x" if pin.standing else "bench: x")
        assert find_place(page) == pytest.approx((pin.x, pin.y), abs=0.51)
        # It stands in the middle of the enlarged picture, its head above it.
        left, top, wide, high = page.ask(RECT)
        x, y = left + wide / 2, top + high / 2
        page.mouse("mouseMoved", x + 3, y - 2)
        assert words(page, "where")[0] == said
        heads[pin.passes] = page.ask(INK.format(x + 6, y - 20))[:3]
        page.mouse("mouseMoved", 5, 5)
    assert heads[True][1] > heads[True][0] + 40  # green
    assert heads[False][0] > heads[False][1] + 40  # red


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_in_forced_colours_play_and_the_choice_are_seen(plan, scheme, tmp_path):
    features = [("forced-colors", "active"), ("prefers-color-scheme", scheme)]
    plan.send("Emulation.setEmulatedMedia",
              features=[{"name": n, "value": v} for n, v in features])  # fmt: skip
    style = (
        "(e => (s => [s.fill, s.color, s.backgroundColor, s.borderTopWidth])(getComputedStyle(e)))"
        "(document.querySelector('{}'))"
    )

    def ask(selector):
        return plan.ask(style.replace("{}", selector))

    fill, paper = ask("#play svg")[0], ask("#play")[2]
    assert contrast(fill, paper) > 4.5
    assert ask("#play")[3] == "2px"
    _, color, background, _ = ask(".modes :checked + span")
    assert contrast(color, background) > 3
    assert background != ask(".modes :not(:checked) + span")[2]
    lit, dark = (ask(f".legend i.{name}")[2] for name in ("lit", "dark"))
    assert contrast(lit, dark) > 1.5


def contrast(*colors):
    """Compare luminances as WCAG 2 does."""
    light = []
    for color in colors:
        srgb = np.array([float(v) for v in re.findall(r"[\d.]+", color)[:3]]) / 255
        linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
        light.append(float(linear @ (0.2126, 0.7152, 0.0722)))
    return (max(light) + 0.05) / (min(light) + 0.05)


def test_the_pixels_of_an_enlarged_plan_are_those_of_its_cells(plan, study):
    plan.ask("document.querySelector('input[value=shadow]').click()")
    for _ in range(5):
        plan.ask("document.querySelector('[data-zoom=\"+\"]').click()")
    tested = set()
    left, top, wide, high = plan.ask(RECT)
    step = int(plan.ask("document.getElementById('time').value"))
    for fx, fy in np.random.default_rng(2).uniform(0.1, 0.9, (60, 2)):
        x, y = left + fx * wide, top + fy * high
        place = look(plan, x, y)
        row, col = (int(np.abs(axis - v).argmin()) for axis, v in
                    zip((study.y, study.x), place[::-1]))  # fmt: skip
        plan.mouse("mouseMoved", 5, 5)
        pixel = plan.ask(INK.format(x, y))
        if study.heights[row, col] > 0 or pixel[0] not in {251, 118, 117, 119}:
            continue
        assert (pixel[0] < 200) == bool(study.masks[step][row, col])
        tested.add(pixel[0] < 200)
    assert tested == {True, False}


WIDE = "[...document.querySelectorAll('.wide, #line')].filter((box) => box.getClientRects().length)"


def test_paper_loses_no_column_and_shows_no_empty_model(page, tmp_path):
    dates = ["2026-03-21", "2026-06-21"]
    both = make_study(date=dates, every="1h", receivers="top", proposed=["bar"], by="part")
    page.open(save(tmp_path / "report.html", both)[0], READY)
    page.ask("document.getElementById('live-show').click()")
    page.wait("document.getElementById('live').dataset.ready")
    page.send("Emulation.setEmulatedMedia", media="print")
    page.resize(688, 1000)  # A4 with Chromium's margins [CSS pixel]
    over = f"{WIDE}.map((box) => box.scrollWidth - Math.min(box.clientWidth, innerWidth))"
    assert max(page.ask(over)) <= 1
    ends = f"{WIDE}.map((box) => Math.max(...[...box.querySelectorAll('th, td')]"
    assert max(page.ask(f"{ends}.map((cell) => cell.getBoundingClientRect().right), 0))")) <= 688
    assert page.ask(f"{WIDE}.map((box) => getComputedStyle(box).overflowX)").count("auto") == 0
    headings = page.ask(
        "[...document.querySelectorAll('h2')].filter((h) => h.getClientRects().length)"
        ".map((h) => h.textContent)"
    )
    assert "Before and after" in headings
    assert "The live model" not in headings
    page.send("Emulation.setEmulatedMedia", media="screen")


@pytest.mark.parametrize("dates", [["2026-03-21"], ["2026-03-21", "2026-12-21"]])
def test_a_phone_shows_what_changed(page, tmp_path, dates):
    both = make_study(date=dates, every="1h", receivers="top", proposed=["bar"])
    page.resize(390, 844, is_phone=True)
    page.open(save(tmp_path / "report.html", both)[0], READY)
    right = page.ask(
        "[...document.querySelectorAll('th')].filter((h) => h.textContent.startsWith('change'))"
        ".map((h) => h.getBoundingClientRect().right)"
    )
    assert len(right) == 1
    assert right[0] <= 390
