"""A report begins with its answer, and with the map that shows it."""

import re

import numpy as np
import pytest
from support.pages import INK, READY, place_of
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.writers.folder.summary import tell_answers
from umbra.writers.picture_content import Plan
from umbra.writers.report import Table, write_report
from umbra.writers.report.markup import make_answers

VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")


@pytest.fixture(scope="module")
def study():
    scene = make_scene([
        Part("old", "", Mesh(*box((-30, 20, 0), (-10, 40, 12)))),
        Part("Tower", "", Mesh(*box((-8, -8, 0), (8, 8, 40)))),
    ])  # fmt: skip
    return run_study(
        scene, VIENNA, date="2026-03-21", every="1h", cell=1.0, extent=(-70, -20, 70, 80),
        proposed=["Tower"],
    )  # fmt: skip


@pytest.fixture(scope="module")
def report(study, tmp_path_factory):
    path = tmp_path_factory.mktemp("answer") / "report.html"
    heights = (study.heights - study.ground).astype(np.float32)
    plan = Plan(study.x, study.y, heights, title="Block", place="Vienna", date="21 March 2026")
    verdicts = Table("Sun: 1 of 1 fail", ("where", "verdict"), [("bench", "fail")])
    write_report(
        path, study, plan, tables=[verdicts], show="sun",
        answers=tell_answers(study, ["Tower"]), proposed=["Tower"],
    )  # fmt: skip
    return path


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
def test_the_first_screen_has_outcome_answer_date_and_map(page, study, report, width, height):
    page.resize(width, height, is_phone=width < 800)
    page.open(report, READY)
    answers = page.ask("[...document.querySelectorAll('.answer')].map(a => a.textContent)")
    told = tell_answers(study, ["Tower"], effect_first=True)
    assert [answer.replace("\N{NO-BREAK SPACE}", " ") for answer in answers] == [
        "Sun: 1 of 1 fail", *told
    ]  # fmt: skip
    assert not re.search(r"\d (h|min|m²|ha|%)", "".join(answers))
    assert page.ask("document.querySelector('.answer').classList.contains('fail')")
    for what in (".lead", "header .answer:last-of-type", "#map"):
        bottom = page.ask(f"document.querySelector('{what}').getBoundingClientRect().bottom")
        assert bottom <= height, what
    assert page.ask("document.querySelector('input[name=mode]:checked').value") == "lost"
    titles = page.ask("[...document.querySelectorAll('h2')].map(h => h.textContent)")
    assert titles.index("Sun: 1 of 1 fail") == 1  # before all figures


def test_figures_stand_beside_a_narrow_map_whose_slider_is_in_view(page, report):
    page.resize(1180, 840)
    page.open(report, READY)
    page.ask("scrollTo(0, 0)")
    corner = "document.querySelector('{}').getBoundingClientRect().{}"
    end, begin = (page.ask(corner.format(*of)) for of in (("#map", "right"), ("#where", "left")))
    assert end < 790  # 808 is as wide as it may be
    assert begin - end == pytest.approx(28, abs=3)
    assert page.ask(corner.format("#time", "bottom")) <= 840


def test_the_map_has_the_hours_lost_in_their_colours_until_the_sun_is_moved(page, study, report):
    page.open(report, READY)
    page.ask("document.querySelector('[data-zoom=\"0\"]').click()")
    lost = np.nan_to_num(np.asarray(study.more["hours_lost"][1]))
    ramp = page.ask("JSON.parse(document.getElementById('data').textContent).change_ramp.slice(64)")
    newly = np.asarray(study.more["newly_under"][1]) > 0
    tested = set()
    for row, col in np.random.default_rng(2).permutation(np.argwhere(~newly))[:400]:
        near = np.s_[max(row - 2, 0) : row + 3, max(col - 2, 0) : col + 3]
        if np.ptp(lost[near]) or newly[near].any() or (study.heights[near] > study.ground).any():
            continue
        if not (15 < row < 80 and 15 < col < 110) or lost[row, col] in tested:
            continue
        pixel = page.ask(INK.format(*place_of(page, study, row, col)))
        share = lost[row, col] / lost.max()
        assert pixel[:3] == pytest.approx(ramp[round(share * (len(ramp) - 1))], abs=2)
        tested.add(lost[row, col])
    assert len(tested) > 3
    page.ask("(s => { s.value = 3; s.dispatchEvent(new Event('input')); })(time)")
    assert page.ask("document.querySelector('input[name=mode]:checked').value") == "shadow"


def test_three_moments_of_the_day_lead_to_their_shadows(page, report):
    page.open(report, READY)
    names = page.ask("[...moments.children].map((one) => one.textContent)")
    assert names == ["09:00\u201310:00", "12:00\u201313:00", "15:00\u201316:00"]
    pixels = page.ask(
        "Promise.all([...moments.querySelectorAll('img')].map((one) => one.decode().then(() => {"
        "const c = document.createElement('canvas'); c.width = 48; c.height = 32;"
        "const p = c.getContext('2d'); p.drawImage(one, 0, 0, 48, 32);"
        "return [...p.getImageData(0, 0, 48, 32).data].join(); })))"
    )
    assert len(set(pixels)) == 3
    page.ask("moments.children[2].click()")
    assert page.ask("document.querySelector('input[name=mode]:checked').value") == "shadow"
    assert page.ask("clock.textContent").startswith("15:00")
    pressed = "[...moments.children].map((one) => one.getAttribute('aria-pressed'))"
    assert page.ask(pressed) == ["false", "false", "true"]


@pytest.mark.parametrize(
    ("dates", "by_day", "first", "mode"),
    [
        (["2026-06-21", "2026-12-21", "2026-03-21"], True, "21 December", "lost"),
        (["2026-06-21", "2026-12-21", "2026-03-21"], False, "21 March", "lost"),
        (["2026-06-21", "2026-12-21"], True, "21 December", "day"),
        (["2026-06-21", "2026-12-21"], False, "21 June", "hours"),
    ],
)
def test_several_dates_begin_with_that_of_the_first_sentence(
    page, study, tmp_path, dates, by_day, first, mode
):
    proposed = ["Tower"] if mode == "lost" else []
    found = run_study(
        study.model.scene, VIENNA, date=dates, every="2h", cell=4.0, extent=(-70, -20, 70, 80),
        proposed=proposed, by_day=by_day,
    )  # fmt: skip
    heights = (found.heights - found.ground).astype(np.float32)
    answers = tell_answers(found, proposed, effect_first=True)
    assert ("21 December 2026" in answers[0]) == by_day
    path = tmp_path / "report.html"
    plan = Plan(found.x, found.y, heights)
    write_report(path, found, plan, show="sun", answers=answers, proposed=proposed)
    page.open(path, READY)
    assert page.ask("document.querySelector('input[name=mode]:checked').value") == mode
    chosen = page.ask("document.getElementById('day').selectedOptions[0].text")
    assert chosen == first
    words = page.ask("document.querySelector('input[name=mode]:checked').parentElement.innerText")
    assert ("sum of" in words) != by_day


@pytest.mark.parametrize(
    ("verdicts", "outcome"),
    [(["pass"], "pass"), (["pass", "unknown"], ""), (["pass", "unknown", "fail"], "fail")],
)
def test_an_unknown_verdict_has_not_the_colour_of_a_pass(verdicts, outcome):
    table = Table("A rule", ("name", "verdict"), [("garden", word) for word in verdicts])
    first, _ = make_answers([table], [])
    assert first == f'<p class="{f"answer {outcome}".strip()}">A rule</p>'
