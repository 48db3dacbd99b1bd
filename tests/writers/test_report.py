"""The report, in a real browser: what it shows is what the study found."""

import re

import numpy as np
import pytest
from support.pages import FIGURES, INK, READY, expect, place_of, say, words
from support.shapes import box, moved

import umbra
from umbra.lights import make_period
from umbra.scene import Mesh, Part, Source, make_scene
from umbra.study import run_study
from umbra.study.timeline import make_timeline, thin
from umbra.sun import Site
from umbra.writers.picture_content import Plan
from umbra.writers.pixels import NO_SUN, write_png
from umbra.writers.report import Table, write_report

HOUSES = {
    "house": box((-6, -4, 0), (4, 6, 14)),
    "shed": moved(box((0, 0, 0), (6, 3, 4)), (14, -9, 0)),
    "bar": moved(box((0, 0, 0), (3, 3, 25)), (-20, -12, 0)),
}
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
NASTY = "<b>Haus</b> & \"Söhne\" </script><script>document.title='broken'</script> {{data}}"


def make_study(**options):
    scene = make_scene([Part(name, "", Mesh(*mesh)) for name, mesh in HOUSES.items()])
    chosen = {"date": "2026-09-18", "start": "06:00", "end": "20:00", "every": "30min",
              "cell": 0.5, "extent": (-40, -25, 40, 45), "masks": True} | options  # fmt: skip
    return run_study(scene, VIENNA, **chosen)


def make_plan(study, title="Houses"):
    heights = None
    if study.is_plan:
        heights = (study.heights - study.ground).astype(np.float32)
    return Plan(study.x, study.y, heights, title=title, place="Vienna", date="18 September")


def save(path, study, title="Houses", **more):
    picture = path.with_name("sheet.png")
    write_png(picture, np.full((40, 60, 3), 200, np.uint8))
    timeline = write_report(path, study, make_plan(study, title), [("Hours", picture)], **more)
    return path, timeline


@pytest.fixture(scope="module")
def study():
    return make_study()


def test_axe_finds_nothing(page, study, tmp_path):
    path, _ = save(tmp_path / "report.html", study, "")  # a model without a name
    for width, scheme in ((1280, "dark"), (320, "light")):
        page.resize(width, 700)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        page.send("Emulation.setEmulatedMedia", features=features)
        page.open(path, READY)
        assert page.audit() == []


def test_what_a_reader_hovers_is_what_the_study_found(page, study, tmp_path):
    path, timeline = save(tmp_path / "report.html", study)
    assert timeline.is_study
    page.open(path, READY)
    rng = np.random.default_rng(5)
    rows, cols = study.shadow_hours.shape
    cells = [(rng.integers(rows), rng.integers(cols)) for _ in range(25)]
    # And some that matter: under the house, and where shadow comes and goes.
    busy = np.abs(np.diff(np.asarray(study.masks).astype(int), axis=0)).sum(0)
    cells += [(rows // 3, cols // 2), *np.argwhere(busy == busy.max())[:3]]
    seen = set()
    for row, col in cells:
        page.mouse("mouseMoved", *place_of(page, study, row, col))
        assert words(page, *FIGURES) == expect(study, row, col), (row, col)
        x, y = (float(v.replace("\u2212", "-")) for v in
                re.findall(r"[\u2212\d.]+", words(page, "where")[0])[:2])  # fmt: skip
        assert (x, y) == pytest.approx((study.x[col], study.y[row]), abs=0.051)
        seen.add(tuple(words(page, "in-sun", "spells")))
    assert len(seen) > 8


def test_a_click_keeps_the_point_and_keys_move_it(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    page.click(*place_of(page, study, 90, 60))
    page.mouse("mouseMoved", *place_of(page, study, 20, 10))
    assert words(page, *FIGURES) == expect(study, 20, 10)
    page.mouse("mouseMoved", 5, 5)
    assert words(page, *FIGURES) == expect(study, 90, 60)
    page.press("ArrowUp")
    page.press("ArrowRight", modifiers=8)
    assert words(page, *FIGURES) == expect(study, 91, 70)


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_a_click_draws_the_sky_of_the_point(page, tmp_path, receivers):
    study = make_study(receivers=receivers, cell=2.0, every="2h")
    without = save(tmp_path / "report.html", study, obstructing=[0, 1])[0]
    page.open(without, READY)
    assert page.ask("document.querySelectorAll('#sky svg').length") == 0
    where = "document.querySelector('#sky code')?.textContent"
    for x, y in ((-19.0, -5.0), (9.0, -3.0), (0.0, 1.0)):
        row, col = np.abs(study.y - y).argmin(), np.abs(study.x - x).argmin()
        page.click(*place_of(page, study, row, col))
        page.wait(f"{where}?.includes('--at {study.x[col]:.3f},{study.y[row]:.3f}')")
        factor = page.ask("document.querySelector('#sky dd').textContent")
        z = study.ground if receivers == "ground" else np.asarray(study.heights)[row, col]
        own = (study.x[col], study.y[row], z + 1e-4)
        exact = umbra.sky_view(study.model.scene, own, no_cast=["bar"])
        assert float(factor) == pytest.approx(exact.sky_view_factor, abs=0.0015)
    page.ask("document.querySelector('#sky button').click()")
    page.wait("document.querySelector('#sky dialog').open")
    assert page.audit() == []
    page.press("Escape")
    page.wait("!document.querySelector('#sky dialog').open")


def test_the_slider_moves_the_shadows(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    rows, cols = study.shadow_hours.shape
    tested = 0
    for step in (3, 9, 16, 22):
        page.ask(
            f"(s => {{ s.value = {step}; s.dispatchEvent(new Event('input')); }})"
            "(document.getElementById('time'))"
        )
        clock = study.steps.labels()
        assert words(page, "clock")[0] == f"{clock[step]}\u2013{clock[step + 1]} CEST"
        altitude = float(re.search(r"sun ([\d.]+)°", words(page, "sun")[0])[1])
        assert altitude == pytest.approx(study.sun.altitude[step], abs=0.051)
        for row, col in np.random.default_rng(step).integers((8, 8), (rows - 8, cols - 8), (40, 2)):
            near = study.masks[step][row - 3 : row + 4, col - 3 : col + 4]
            high = study.heights[row - 3 : row + 4, col - 3 : col + 4]
            pixel = page.ask(INK.format(*place_of(page, study, row, col)))
            if np.ptp(near) or high.max() > 0 or pixel[0] not in {251, 118, 117, 119}:
                continue  # an edge, a roof, or what is drawn over the plan
            assert (pixel[0] < 200) == bool(near[0, 0]), (step, row, col, pixel)
            tested += 1
    assert tested > 60
    page.press("End")
    assert words(page, "clock")[0].startswith("19:30\u201320:00")
    assert words(page, "sun") == ["the sun is below the horizon"]
    page.press("Home")
    page.press("ArrowRight")
    assert words(page, "clock")[0].startswith("06:30")
    page.press(" ")
    page.wait("document.getElementById('time').value > 4")
    page.press(" ")
    held = page.ask("document.getElementById('time').value")
    assert (
        page.ask(
            "new Promise(r => setTimeout(() => r(document.getElementById('time').value), 300))"
        )
        == held
    )


def test_hours_are_drawn_in_their_colours(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    page.ask("document.querySelector('input[value=hours]').click()")
    assert words(page, "key-high") == [say(study.up_hours)]
    assert not page.ask("document.getElementById('key').hidden")
    assert page.ask("document.querySelector('.key .no-sun').innerText") == "no sun"
    swatch = page.ask("getComputedStyle(document.getElementById('no-sun')).backgroundColor")
    assert swatch == f"rgb{tuple(round(255 * v) for v in NO_SUN)}"


def test_a_place_without_any_sun_has_the_colour_of_its_swatch(page, tmp_path):
    noon = make_study(date="2026-12-21", start="11:30", end="12:30", every="10min")
    page.open(save(tmp_path / "report.html", noon)[0], READY)
    page.ask("document.querySelector('input[value=hours]').click()")
    dark = (noon.shadow_hours >= noon.up_hours) & (np.asarray(noon.heights) <= 0)
    inner = np.lib.stride_tricks.sliding_window_view(dark, (9, 9)).all((-1, -2))
    row, col = np.argwhere(inner)[0] + 4
    pixel = page.ask(INK.format(*place_of(page, noon, row, col)))
    assert pixel[:3] == [round(255 * v) for v in NO_SUN]


@pytest.mark.parametrize(("width", "height"), [(390, 844), (320, 640), (820, 1180), (1280, 900)])
def test_nothing_is_wider_than_the_window(page, study, tmp_path, width, height):
    page.resize(width, height, is_phone=width < 800)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    assert page.ask("document.documentElement.scrollWidth") <= width
    box = page.ask(
        "(r => [r.width, r.height])(document.getElementById('map').getBoundingClientRect())"
    )
    assert box[0] > 0.5 * min(width, 600)
    assert box[0] / box[1] == pytest.approx(80 / 70, rel=0.01)


def test_names_cannot_break_the_page(page, study, tmp_path):
    table = Table(NASTY, ("what", "h"), [(NASTY, 1.5), ("pass: well", 2.0)], note=NASTY)
    path, _ = save(tmp_path / "report.html", study, NASTY, tables=[table], notes=[NASTY])
    page.open(path, READY)
    assert page.ask("document.querySelector('h1').textContent") == NASTY
    assert page.ask("document.title") == f"{NASTY}: shadow study"
    assert page.ask("document.querySelectorAll('td.pass').length") == 1
    assert page.ask("document.querySelector('td.number').textContent") == "1.5"


def test_only_the_page_s_own_script_runs(page, study, tmp_path):
    table = Table(NASTY, ("what",), [(NASTY,)])
    path, _ = save(tmp_path / "report.html", study, NASTY, tables=[table], notes=[NASTY])
    page.open(path, READY)
    policy = page.ask("document.querySelector('meta[http-equiv]').content")
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert set(rules) == {
        "default-src", "script-src", "style-src", "img-src", "base-uri", "form-action",
    }  # fmt: skip
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'none'"
    assert rules["img-src"] == "data:"
    for kind in ("script-src", "style-src"):
        assert re.fullmatch(r"'sha256-[\w+/]{43}='", rules[kind])
    # What a hole in the page would let in does nothing.
    page.ask(
        "for (const html of ['<img src=x onerror=\"window.ran=1\">',"
        "'<svg onload=\"window.ran=2\">',"
        "'<iframe srcdoc=\"<script>parent.ran=3</script>\"></iframe>',"
        "'<object data=\"data:text/html,x\"></object>', '<base href=\"https://example.org/\">',"
        "'<style>body { color: rgb(1, 2, 3) !important }</style>'])"
        "document.body.insertAdjacentHTML('beforeend', html);"
        "document.body.append(Object.assign(document.createElement('script'), {text: 'ran = 4'}))"
    )
    page.ask("new Promise(done => setTimeout(done, 200))")
    assert page.ask("window.ran === undefined")
    assert page.ask("getComputedStyle(document.body).color") != "rgb(1, 2, 3)"
    assert page.ask("document.baseURI").startswith("file:")
    refused = [event["entry"]["text"] for event in page.named("Log.entryAdded")]
    for rule in ("script-src", "style-src", "base-uri"):
        assert any(rule in text for text in refused), rule
    assert page.ask("document.title") == f"{NASTY}: shadow study"
    page.events.clear()  # refused as they had to be


def test_a_night_and_a_plan_of_tops(page, tmp_path):
    night = make_study(start="22:00", end="24:00")
    page.open(save(tmp_path / "night.html", night)[0], READY)
    assert words(page, "in-sun", "first", "spells") == ["0 h", "none", "0"]
    told = page.ask("document.querySelector('.summary').textContent")
    assert told == "with the sun up, in these hoursnever"
    top = make_study(receivers="top", every="2h")
    page.open(save(tmp_path / "top.html", top)[0], READY)
    page.mouse("mouseMoved", *place_of(page, top, 50, 78))
    assert "14.0 m above the ground" in words(page, "where")[0]
    assert words(page, *FIGURES) == expect(top, 50, 78)


def test_a_large_study_is_shown_in_larger_cells_and_says_so(study, tmp_path):
    path = tmp_path / "report.html"
    coarse = make_timeline(study, longest=40)
    assert coarse.shape == (35, 40)
    assert not coarse.is_study
    save(path, study, timeline=coarse)
    told = f"the study has {len(study.x):,} x {len(study.y):,} of {study.grid.dx:.3g} m"
    assert f"counted anew at their own centres; {told}" in path.read_text()
    fine = make_study(cell=0.05, every="2h", masks=False)
    assert max(make_timeline(fine).shape) <= 800


def test_masks_of_the_timeline_are_those_of_the_study(study):
    timeline = make_timeline(study)
    np.testing.assert_array_equal(timeline.masks(0, len(study.masks)), np.asarray(study.masks) > 0)
    np.testing.assert_allclose(timeline.x, study.x)


def test_what_was_assumed_is_said(study, tmp_path):
    path, _ = save(
        tmp_path / "report.html", study, casters=["--no-cast shed"], notes=["2 left out"]
    )
    text = path.read_text()
    for words_ in (
        "Europe/Vienna: CEST (UTC+02:00)", "in force: times are clock times", "refraction",
        "along the plan&#x27;s y axis", "--no-cast shed", "28 of 30 min", "2 left out",
        "judged at their midpoints", "0.9 %",
    ):  # fmt: skip
        assert words_ in text, words_
    assert "http:" not in text.replace("http://www.w3.org", "")
    assert "https:" not in text


def test_before_and_after_are_those_of_two_studies(page, tmp_path):
    both = make_study(proposed=["bar"], under="10h", by="part")
    scene = make_scene([Part(n, "", Mesh(*m)) for n, m in HOUSES.items() if n != "bar"])
    before = run_study(
        scene, VIENNA, date="2026-09-18", start="06:00", end="20:00", every="30min", cell=0.5,
        extent=(-40, -25, 40, 45),
    )  # fmt: skip
    page.open(save(tmp_path / "report.html", both)[0], READY)
    titles = page.ask("[...document.querySelectorAll('h2')].map(h => h.textContent)")
    assert titles[1:5] == [
        "Before and after", "Who loses sun", "Who casts the shadow", "Area in the sun",
    ]  # fmt: skip
    rows = page.ask(
        "[...document.querySelectorAll('table')[0].querySelectorAll('tbody tr')]"
        ".map(r => [...r.children].map(c => c.textContent))"
    )
    figures = {row[0]: [float(v.replace(",", "").replace("\u2212", "-")) for v in row[1:]]
               for row in rows}  # fmt: skip
    is_open = both.heights <= both.ground
    sun = [before.sun_hours[is_open], both.sun_hours[is_open]]
    expected = [float(hours.mean()) for hours in sun]
    expected.append(round(expected[1], 2) - round(expected[0], 2))  # as the two are printed
    assert figures["mean sun [h]"] == pytest.approx(expected, abs=0.0051)
    areas = [np.count_nonzero(hours >= 10 - 1e-3) * 0.25 for hours in sun]
    areas.append(areas[1] - areas[0])
    assert figures["at least 10 h of sun [m²]"] == pytest.approx(areas, abs=1.01)
    assert areas[2] < 0


def test_days_have_a_row_each(page, tmp_path):
    days = make_study(date=["2026-03-21", "2026-06-21"], start="10:00", end="16:00")
    page.open(save(tmp_path / "report.html", days)[0], READY)
    page.mouse("mouseMoved", *place_of(page, days, 60, 100))
    by_day = np.asarray(days.masks)[:, 60, 100].reshape(2, 12).sum(1) / 2
    assert by_day[0] > by_day[1]
    assert words(page, "in-shadow") == [say(float(by_day[0]))]
    rows = page.ask("[...document.querySelectorAll('#line text')].map(t => t.textContent)")
    assert rows[:2] == ["21 Mar", "21 Jun"]
    page.press("Home")
    assert words(page, "clock") == ["21 March, 10:00\u201310:30 CET"]
    page.press("End")
    assert words(page, "clock") == ["21 March, 15:30\u201316:00 CET"]
    page.press("ArrowRight")
    assert words(page, "clock") == ["21 March, 15:30\u201316:00 CET"]


def test_a_place_tells_the_chosen_date_and_a_sum_only_when_asked(page, tmp_path):
    days = make_study(date=["2026-03-21", "2026-06-21"], start="10:00", end="16:00")
    page.open(save(tmp_path / "report.html", days)[0], READY)
    page.click(*place_of(page, days, 60, 100))
    lit = (1 - np.asarray(days.masks)[:, 60, 100]).reshape(2, 12)
    assert lit[0].sum() != lit[1].sum()
    label = "document.getElementById('in-sun').closest('div').innerText.split('\\n')"
    page.ask("document.activeElement.blur()")
    for key, of_date, day in zip(("PageUp", "PageDown"), lit, days.period.days, strict=True):
        page.press(key)
        told = f"{say(of_date.sum() / 2)} of 6 h"  # as sheets say it
        assert page.ask(label) == [f"sun on {day.day} {day:%b}", told]
        starts = np.diff(of_date.astype(int), prepend=0) == 1
        assert words(page, "in-sun", "spells") == [say(of_date.sum() / 2), str(starts.sum())]
        assert "2026" not in "".join(words(page, "first", "last", "spell-list"))
    page.ask("document.querySelector('input[value=hours]').click()")
    assert page.ask(label) == ["sun, sum of 2 dates", f"{say(lit.sum() / 2)} of 12 h"]
    assert words(page, "in-sun", "in-shadow") == [say(lit.sum() / 2), say((24 - lit.sum()) / 2)]
    assert words(page, "sum") == [", sum of 2 dates"]
    page.ask("document.querySelector('input[value=shadow]').click()")
    assert words(page, "in-sun") == [say(lit[1].sum() / 2)]


def test_a_date_is_chosen_beside_the_slider(page, tmp_path):
    days = make_study(date=["2026-03-21", "2026-06-21"], start="10:00", end="16:00")
    page.open(save(tmp_path / "report.html", days)[0], READY)
    page.ask("(s => { s.value = 3; s.dispatchEvent(new Event('input')); })(time)")
    page.ask("(s => { s.value = 1; s.dispatchEvent(new Event('change')); })(day)")
    # The same clock time on the other date, and its own sun.
    assert words(page, "clock") == ["21 June, 11:30\u201312:00 CEST"]
    altitude = float(re.search(r"sun ([\d.]+)°", words(page, "sun")[0])[1])
    assert altitude == pytest.approx(days.sun.altitude[15], abs=0.051)
    page.ask("document.activeElement.blur()")
    page.press("End")
    assert words(page, "clock") == ["21 June, 15:30\u201316:00 CEST"]
    page.press("PageUp")
    assert words(page, "clock") == ["21 March, 15:30\u201316:00 CET"]
    assert page.ask("[...day.options].map(o => o.text)") == ["21 March", "21 June"]
    # Hours of one date: each colour is that of the date's own hours.
    page.ask("document.querySelector('input[value=day]').click()")
    page.press("PageDown")
    assert words(page, "key-high") == ["6 h"]
    by_day = np.asarray(days.more["shadow_hours_by_day"][1])
    ramp = page.ask("JSON.parse(document.getElementById('data').textContent).ramp")
    tested = 0
    for k, key in enumerate(("PageUp", "PageDown")):
        page.press(key)
        for row, col in ((20, 30), (60, 100), (75, 82), (120, 20), (100, 130)):
            near = by_day[k][row - 2 : row + 3, col - 2 : col + 3]
            if np.ptp(near) or days.heights[row, col] > 0:
                continue
            spot = place_of(page, days, row, col)
            pixel = page.ask(INK.format(*spot))
            expected = ramp[round(float(by_day[k][row, col]) / 6 * (len(ramp) - 1))]
            assert pixel[:3] == pytest.approx(expected, abs=2)
            tested += 1
    assert tested > 4
    assert page.ask("day.hidden") is False


def test_one_date_has_no_chooser(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    assert page.ask("getComputedStyle(day).display") == "none"
    assert page.ask("getComputedStyle(document.querySelector('label.of-days')).display") == "none"


@pytest.mark.parametrize("receivers", ["south", "camera"])
def test_views_are_read_like_plans(page, tmp_path, receivers):
    options = {"extent": None, "every": "1h"}
    if receivers == "camera":
        options |= {"cell": None, "size": (120, 90), "eye": (0, -80, 60), "target": (0, 0, 0)}
    view = make_study(receivers=receivers, **options)
    path, timeline = save(tmp_path / "report.html", view)
    assert timeline.is_study
    page.open(path, READY)
    is_seen = np.isfinite(view.shadow_hours)
    rng = np.random.default_rng(3)
    seen, unseen = rng.permutation(np.argwhere(is_seen)), np.argwhere(~is_seen)
    shaded = rng.permutation(np.argwhere(np.nan_to_num(view.shadow_hours) > 1))
    some = [*seen[:8], *shaded[:6]]
    for row, col in some:
        page.mouse("mouseMoved", *place_of(page, view, row, col))
        assert words(page, *FIGURES) == expect(view, row, col)
    assert len({view.shadow_hours[row, col] for row, col in some}) > 2
    assert len(unseen) == 0 or receivers == "south"
    if len(unseen):
        page.mouse("mouseMoved", *place_of(page, view, *unseen[len(unseen) // 2]))
        assert words(page, "where")[0].endswith(": nothing is seen here")
        assert words(page, "in-sun", "first", "spells") == ["0 h", "none", "0"]
    text = path.read_text()
    assert ("level and orthographic" if receivers == "south" else "50° high") in text


def test_where_nothing_receives_nothing_is_read(page, tmp_path):
    x, y = np.meshgrid(np.arange(21.0), np.arange(16.0))
    hill = np.stack([x, y, 3 * np.exp(-((x - 10) ** 2 + (y - 8) ** 2) / 9)], -1).reshape(-1, 3)
    at = np.arange(15 * 21).reshape(15, 21)[:, :20].ravel()
    faces = np.concatenate([[(k, k + 1, k + 22), (k, k + 22, k + 21)] for k in at])
    terrain = make_scene(
        [Part("hill", "Raster", Mesh(hill, faces.astype(np.int32)))],
        sources=(Source("hill.tif", "0" * 64, "GeoTIFF"),),
    )
    study = run_study(
        terrain, VIENNA, date="2026-09-18", every="2h", receivers="top", cell=0.5, masks=True,
        extent=(-5, -5, 25, 20),
    )  # fmt: skip
    path, timeline = save(tmp_path / "report.html", study)
    assert (np.isnan(timeline.surface) == np.isnan(study.shadow_hours)).all()
    assert np.isnan(timeline.surface).any()
    page.open(path, READY)
    page.mouse("mouseMoved", *place_of(page, study, 3, 3))
    assert words(page, "where")[0].endswith(": nothing receives here")
    assert words(page, "in-sun", "in-shadow", "first") == ["0 h", "0 h", "none"]
    page.mouse("mouseMoved", *place_of(page, study, 22, 28))
    assert words(page, *FIGURES) == expect(study, 22, 28)


def test_of_very_many_days_some_are_shown_whole(page, tmp_path):
    year = make_study(date="2026", every="1h", cell=4, masks=True)
    path, timeline = save(tmp_path / "report.html", year)
    assert timeline.strides == (2, 1)
    assert not timeline.is_study
    page.open(path, READY)
    # It is said where nobody can miss it, and how to see another date.
    notice = page.ask("document.querySelector('#through > .notice:not([hidden])').innerText")
    assert notice.startswith("The picture moves through 183 of the study's 365 dates, one in 2")
    assert "For another date run the study" in notice
    page.ask("document.querySelector('input[value=hours]').click()")
    page.mouse("mouseMoved", *place_of(page, year, 9, 11))
    mine = np.isin(year.period.day_of_step, np.arange(0, 365, 2)) & year.sun.is_up
    mask = np.asarray(year.masks)[:, 9, 11]
    # Hours are those of the whole year, spells those of the days that are shown.
    assert words(page, "in-shadow") == [say(float(mask.sum()))]
    assert words(page, "in-sun") == [say(float((1 - mask[year.sun.is_up]).sum()))]
    starts = np.diff(np.concatenate([[0], mine & (mask == 0)]).astype(int)) == 1
    assert words(page, "spells") == [str(int(starts.sum()))]


def test_of_very_many_steps_some_stand_for_all(tmp_path):
    day = make_study(every="10s", cell=4, masks=False)
    _, timeline = save(tmp_path / "report.html", day)
    assert timeline.strides == (1, 2)
    np.testing.assert_array_equal(timeline.last, timeline.which + 1)


@pytest.mark.parametrize(
    ("date", "every", "strides"),
    [
        ("2026-*-21", "15min", (1, 1)),
        ("2026-*-21", "5min", (1, 1)),
        ("2026-*-21", "1min", (1, 3)),
        (["2026-*-07", "2026-*-21"], "5min", (1, 2)),
        ("2026-01-01..2026-02-20", "15min", (1, 1)),
        ("2026", "15min", (6, 1)),
        ("2026", "5min", (6, 3)),
    ],
)
def test_dates_that_are_asked_are_shown_before_all_their_instants(date, every, strides):
    period = make_period(date, "00:00", "24:00", every, VIENNA)
    which, last, found = thin(period, 3000)
    assert found == strides
    assert np.count_nonzero(period.sun.is_up[which]) <= 3000
    days = period.day_of_step
    assert sorted(set(days[which])) == list(range(0, len(period.days), strides[0]))
    np.testing.assert_array_equal(days[which], days[last])
    ends = np.append(last[:-1] + 1, 0)[: len(which) - 1]
    same = days[which][1:] == days[which][:-1]
    np.testing.assert_array_equal(ends[same], which[1:][same])


def test_few_dates_are_all_shown_however_many_samples_there_are():
    period = make_period("2026-*-21", "00:00", "24:00", "15min", VIENNA)
    which, _, strides = thin(period, 160)
    assert strides == (1, 4)
    assert set(period.day_of_step[which]) == set(range(12))


def test_a_tap_keeps_a_point_on_a_phone(page, study, tmp_path):
    page.resize(390, 844, is_phone=True, dot=3)
    page.send("Emulation.setTouchEmulationEnabled", enabled=True)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    x, y = place_of(page, study, 70, 30)
    page.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
    page.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    page.wait("document.getElementById('where').textContent.startsWith('x \u221224.')")
    assert words(page, *FIGURES) == expect(study, 70, 30)


def test_the_live_model_is_made_when_it_is_asked_for(page, tmp_path):
    scene = umbra.make_scene(*box((0, 0, 0), (10, 10, 20)), ground=0.0)
    site = umbra.Site(48.2, 16.37, "Europe/Vienna")
    study = umbra.shadow_study(scene, site, date="2026-06-21", receivers="ground", cell=2.0)
    study.report(tmp_path / "report.html")
    page.open(tmp_path / "report.html", "document.documentElement.dataset.ready")
    assert page.ask("document.querySelectorAll('#live canvas').length") == 0
    page.ask("document.getElementById('live-show').click()")
    page.wait("document.getElementById('live').dataset.ready")
    assert page.ask("document.getElementById('live').dataset.ready") == "yes"
    assert page.ask("document.querySelector('#live .told').textContent").startswith("21 June 2026")
    assert page.ask("document.querySelector('#live .ticks').textContent") == "02468"
