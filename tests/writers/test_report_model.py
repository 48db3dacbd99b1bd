"""Reports of walls, roofs and points, in a real browser: a model that turns and is read."""

import json

import numpy as np
import pytest
from support.pages import (
    AROUND,
    FIGURES,
    READY,
    RECT,
    expect,
    find_sample,
    read_at,
    say,
    walk,
    words,
)
from support.shapes import box, moved, turned
from support.sweeps import reduce_count

from umbra.receivers.samples import sample_surfaces
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.timeline import make_point_timeline
from umbra.sun import Site
from umbra.writers.picture_content import Plan
from umbra.writers.report import Table, write_report
from umbra.writers.surfaces_glb import lay_out_facades

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
HOUSES = {
    "house": turned(box((-6, -4, 0), (4, 6, 14)), 25),
    "shed": moved(box((0, 0, 0), (6, 3, 4)), (14, -9, 0)),
    "bar": moved(box((0, 0, 0), (3, 3, 25)), (-20, -12, 0)),
}
POINTS = [(0, -9, 1, 0, -1, 0), (-10, 8, 0.5, 0, 0, 1), (17, -10, 2, 0, -1, 0), (8, 9, 3)]
NAMES = ["kitchen, S", "garden", "<i>window</i>", ""]
SCAN = """(() => {
  const map = document.getElementById("map"), box = map.getBoundingClientRect(), found = {};
  const point = (type, x, y) => {
    map.dispatchEvent(new PointerEvent(type, {clientX: x, clientY: y, pointerType: "mouse"}));
    return document.getElementById("where").textContent.split(";")[0];
  };
  const kept = point("pointerleave", 0, 0);
  for (let x = Math.ceil(box.left); x < box.right; x += 7)
    for (let y = Math.ceil(box.top); y < box.bottom; y += 7) {
      const name = point("pointermove", x, y);
      if (name !== kept) (found[name] ??= []).push([x, y]);
    }
  return found;
})()"""


def make_study(**options):
    parts = [Part(name, "Wall", Mesh(*mesh)) for name, mesh in HOUSES.items()]
    scene = make_scene(parts, ground=0.0)
    chosen = {"date": "2026-09-18", "start": "06:00", "end": "20:00", "every": "30min",
              "masks": True, "receivers": "surfaces"} | options  # fmt: skip
    if chosen["receivers"] == "surfaces":
        chosen = {"spacing": 1.0} | chosen
    return run_study(scene, VIENNA, **chosen)


def make_points(**options):
    points = np.array([(*p, *[np.nan] * (6 - len(p))) for p in POINTS])[:, :3]
    return make_study(receivers="points", points=points, names=NAMES, **options)


def save(path, study, **more):
    nowhere = np.zeros(1)
    plan = Plan(nowhere, nowhere, title="Houses", place="Vienna", date="18 September")
    return path, write_report(path, study, plan, **more)


@pytest.fixture(scope="module")
def study():
    return make_study()


def press_button(page, name):
    page.ask(f"document.querySelector('[data-view={json.dumps(name)}]').click()")


def show_mode(page, mode):
    page.ask(f"document.querySelector('input[value={mode}]').click()")


def test_what_a_reader_hovers_is_what_the_study_found(page, study, tmp_path):
    path, _ = save(tmp_path / "report.html", study)
    page.open(path, READY)
    seen = set()
    for _, _, k, said in read_at(page, study, walk(page, reduce_count(450, 2))):
        assert words(page, *FIGURES) == expect(study, k)
        surface = study.samples.surface[k]
        assert said.startswith(list(HOUSES)[study.samples.part[surface]] + ": Wall, ")
        seen.add(k)
    assert len(seen) > 12
    assert len({float(study.shadow_hours[k]) for k in seen}) > 6


def test_from_above_each_pixel_shows_its_own_place_on_top(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    press_button(page, "above")
    found = [
        (x, y, k) for x, y, k, _ in read_at(page, study, walk(page, reduce_count(450, 2), seed=3))
    ]
    assert len(found) > 7
    at = np.array([(x, y) for x, y, _ in found])
    which = np.array([k for *_, k in found])
    places = study.places.points[which]
    # One scale and no turn: pixels are metres, north up.
    scale = np.polyfit(at[:, 0], places[:, 0], 1)
    assert scale[0] > 0
    assert np.abs(np.polyval(scale, at[:, 0]) - places[:, 0]).max() < 0.75
    up = np.polyfit(at[:, 1], places[:, 1], 1)
    assert up[0] == pytest.approx(-scale[0], rel=0.05)
    assert (study.places.normals[which][:, 2] > 0.99).all()


def test_seen_from_the_sun_nothing_is_in_shadow(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    show_mode(page, "shadow")
    read = 0
    for step in (6, 13, 20):
        page.ask(f"(s => {{ s.value = {step}; s.dispatchEvent(new Event('input')); }})(time)")
        press_button(page, "sun")
        for *_, k, _ in read_at(page, study, walk(page, reduce_count(120, 2), seed=step)):
            # A sample on a square's far side may be hidden by a hair: allow for its square.
            square = np.abs(study.places.points - study.places.points[k]).max(1) < 1.5
            assert (np.asarray(study.masks[step])[square] == 0).any()
            read += np.asarray(study.masks[step])[k] == 0
    assert read > 10


@pytest.mark.parametrize("mode", ["hours", "shadow"])
def test_colours_are_those_of_the_samples(page, study, tmp_path, mode):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    show_mode(page, mode)
    step = 7
    page.ask(f"(s => {{ s.value = {step}; s.dispatchEvent(new Event('input')); }})(time)")
    ramp = page.ask("JSON.parse(document.getElementById('data').textContent).ramp")
    page.mouse("mouseMoved", 5, 5)
    spots = walk(page, reduce_count(450, 2), seed=7)
    inks = [np.reshape(page.ask(AROUND.format(x, y)), (9, 4)) for x, y in spots]
    tested = set()
    for (x, y), around in zip(spots, inks):
        ink = around[4].tolist()
        if ink[:3] == [255, 255, 255] or ink[0] > 180 > ink[1] or np.ptp(around, axis=0).any():
            continue  # the paper, the ring, or a border, where a pixel shows several samples
        for _, _, k, _ in read_at(page, study, [(x, y)]):
            is_dark = bool(study.masks[step][k])
            expected = ramp[round(float(study.shadow_hours[k]) / study.up_hours * 127)]
            off = np.abs(np.subtract(ink[:3], expected)).max()
            if mode == "hours":
                assert off <= 2
                tested.add(tuple(expected))
            else:
                assert (ink[2] > ink[0]) == is_dark
                tested.add((k, is_dark))
    assert len(tested) > (5 if mode == "hours" else 12)
    if mode == "shadow":
        assert {dark for _, dark in tested} == {True, False}


def test_the_model_turns_by_mouse_and_keys(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    shot = "document.getElementById('map').toDataURL()"
    shots = [page.ask(shot)]
    spots = walk(page, 1)
    left, top, wide, high = page.ask(RECT)
    x, y = left + wide / 2, top + high / 2
    page.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
    page.mouse("mouseMoved", x + 60, y + 20, button="left", buttons=1)
    page.mouse("mouseReleased", x + 60, y + 20, button="left", clickCount=1)
    page.ask("new Promise(done => setTimeout(done, 400))")
    shots.append(page.ask(shot))
    page.ask("document.getElementById('map').focus()")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        page.press(key)
        shots.append(page.ask(shot))
    press_button(page, "larger")
    page.ask("new Promise(done => setTimeout(done, 400))")
    shots.append(page.ask(shot))
    assert len(set(shots)) == len(shots)
    assert len(spots) == 1


def rows_of(page, title):
    section = (
        f"[...document.querySelectorAll('section')].find(s => s.innerText.startsWith('{title}'))"
    )
    cells = "[...r.cells].map(c => c.textContent)"
    return page.ask(f"[...{section}.querySelectorAll('tbody tr')].map(r => {cells})"), section


def test_tables_list_sort_filter_and_lead_to_the_model(page, study, tmp_path):
    page.open(save(tmp_path / "report.html", study)[0], READY)
    parts, _ = rows_of(page, "Part by part")
    more = {
        name: np.asarray(array) for name, (_, array) in study.more.items() if name != "in_shadow"
    }
    assert [row[0] for row in parts] == more["part"].tolist()
    for k, row in enumerate(parts):
        assert float(row[1].replace(",", "")) == pytest.approx(
            float(more["part_area"][k]), abs=0.06
        )
        for cell, name in zip(row[3:6], ("mean", "least", "most")):
            assert float(cell) == pytest.approx(more[f"part_{name}_sun_hours"][k], abs=0.0051)
    listed, section = rows_of(page, "Surface by surface")
    assert len(listed) == len(more["surface_area"])
    # A click on a heading sorts by numbers, another turns the order about.
    head = f"{section}.querySelectorAll('thead button')[5]"
    for order in (-1, 1):
        page.ask(head + ".click()")
        means = [float(row[5]) for row in rows_of(page, "Surface by surface")[0]]
        assert means == sorted(means, reverse=order < 0)
        assert len(set(means)) > 5
    typed = "(f => { f.value = 'shed'; f.dispatchEvent(new Event('input')); })"
    page.ask(f"{typed}({section}.querySelector('input'))")
    kept, _ = rows_of(page, "Surface by surface")
    assert {row[0] for row in kept} == {"shed"}
    assert len(kept) == 5
    page.ask(f"{section}.querySelectorAll('tbody tr')[2].querySelector('button').click()")
    k, said = find_sample(page, study)
    assert said.startswith("shed: ")
    mine = study.samples.surface == study.samples.surface[k]
    assert float(kept[2][5]) == pytest.approx(np.average(study.sun_hours[mine]), abs=0.0051)
    assert study.shadow_hours[k] == study.shadow_hours[mine].max()


def test_points_are_marked_named_and_read(page, tmp_path):
    study = make_points(spells=True)
    path, _ = save(tmp_path / "report.html", study)
    page.open(path, READY)
    rows, _ = rows_of(page, "Point by point")
    assert [row[0] for row in rows] == [*NAMES[:3], "point 4"]
    for k, row in enumerate(rows):
        assert float(row[4]) == pytest.approx(float(study.sun_hours[k]), abs=0.0051)
        page.ask(f"document.querySelectorAll('tr[data-kind=point] button')[{k}].click()")
        name = words(page, "where")[0].partition(";")[0]
        assert name == row[0]
        assert words(page, *FIGURES) == expect(study, k)
        assert [row[6], row[7]] == expect(study, k)[2:4]
    # A marker that is pointed at is read; elsewhere the last one is, which was clicked. The page
    # itself looks where the others are, all over the plan; then a mouse goes there.
    press_button(page, "above")
    press_button(page, "whole")
    walk(page, 1)
    found = page.ask(SCAN)
    assert set(found) == {row[0] for row in rows[:-1]}
    for name, spots in found.items():
        page.mouse("mouseMoved", *spots[len(spots) // 2])
        assert words(page, "where")[0].partition(";")[0] == name


def test_rules_proposals_and_casters_are_told_of_surfaces(page, tmp_path):
    study = make_study(proposed=["bar"], under="6h", by="part", masks=False)
    verdicts = Table("A rule: 1 of 1 fail", ("where", "verdict"), [("shed", "fail")])
    page.open(save(tmp_path / "report.html", study, tables=[verdicts])[0], READY)
    titles = page.ask("[...document.querySelectorAll('h2')].map(h => h.textContent)")
    assert titles[1:8] == [
        "A rule: 1 of 1 fail", "Part by part", "Surface by surface", "Before and after",
        "Who loses sun", "Who casts the shadow", "Area in the sun",
    ]  # fmt: skip
    before, _ = rows_of(page, "Before and after")
    area, lost = (np.asarray(study.more[name][1]) for name in ("area", "hours_lost"))
    both = np.isfinite(lost)
    after = np.average(study.sun_hours[both], weights=area[both])
    gone = np.average(lost[both], weights=area[both])
    figures = [float(v.replace("\u2212", "-")) for v in before[0][1:]]
    assert figures == pytest.approx([after + gone, after, -gone], abs=0.0051)
    assert gone > 0.01


def test_what_was_assumed_is_said(study, tmp_path):
    text = save(tmp_path / "r.html", study, casters=["--no-cast shed"])[0].read_text()
    for said in (
        "at each sample and step", "1 m apart in their planes", "walls and roofs, on their outward",
        "Europe/Vienna: CEST (UTC+02:00)", "--no-cast shed", "This picture shows all",
    ):  # fmt: skip
        assert said in text, said
    assert "https:" not in text
    text = save(tmp_path / "p.html", make_points())[0].read_text()
    assert "at each point and step" in text
    assert "faces the sun at all times" in text


def test_hours_are_the_study_s_own_when_instants_are_solved(page, tmp_path):
    study = make_study(exact=True, masks=False, every="1h", spacing=3.0)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    for _, _, k, _ in read_at(page, study, walk(page, reduce_count(120, 2))):
        assert words(page, "in-shadow") == [say(float(study.shadow_hours[k]))]
    assert "solved to 1 s" in page.ask("document.body.textContent")


def test_masks_that_were_not_kept_are_counted_again(study):
    again = make_study(masks=False)
    kept, counted = make_point_timeline(study), make_point_timeline(again)
    np.testing.assert_array_equal(kept.bits, counted.bits)
    assert kept.bits.any()
    assert kept.is_summed(study)


def test_instants_are_thinned_until_they_fit_and_it_is_said(page, tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.study.timeline.MOST_BYTES", 3000)
    study = make_study(date="2026-*-21")
    path, instants = save(tmp_path / "report.html", study)
    days, steps = instants.strides
    assert days * steps > 1
    assert instants.bits[study.sun.is_up[instants.which]].nbytes <= 6000
    assert "12 dates, one in" if days > 1 else "Of a day's steps one in" in path.read_text()
    page.open(path, READY)
    # Of several dates it begins with what its first sentence is of: without days, their sum.
    assert page.ask("document.querySelector('input[name=mode]:checked').value") == "hours"
    assert words(page, "sum") == [", sum of 12 dates"]
    for _, _, k, _ in read_at(page, study, walk(page, reduce_count(120, 2))):
        assert words(page, "in-shadow") == [say(float(study.shadow_hours[k]))]


@pytest.mark.parametrize(("width", "height"), [(390, 844), (820, 1180)])
def test_nothing_is_wider_than_the_window(page, study, tmp_path, width, height):
    page.resize(width, height, is_phone=width < 800)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    assert page.ask("document.documentElement.scrollWidth") <= width


def test_every_square_shows_a_sample_of_its_surface():
    roof = make_scene(*turned((np.array([(0, 0, 0), (9, 0, 0), (0, 7, 3.0)]), [[0, 1, 2]]), 20))
    samples = sample_surfaces(roof, 0.5)
    whole = lay_out_facades(samples)
    assert whole.is_whole
    assert set(whole.sample) == set(range(len(samples.points)))
    axes = samples.axes[0]
    for square, k in enumerate(whole.sample):
        row, col = divmod(square, whole.shape[0, 0])
        centre = samples.start[0] + np.array([col, row]) * 0.5
        flat = samples.points @ axes.T
        apart = np.linalg.norm(flat - centre, axis=1)
        assert apart[k] == pytest.approx(apart.min(), abs=1e-9)
    coarse = lay_out_facades(samples, most=20)
    assert len(coarse.sample) <= 20
    assert not (coarse.side == 0.5).all()


def test_a_tap_keeps_a_sample_on_a_phone(page, study, tmp_path):
    page.resize(390, 844, is_phone=True, dot=3)
    page.send("Emulation.setTouchEmulationEnabled", enabled=True)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    kept = {words(page, "where")[0]}
    for x, y in walk(page, 150):
        page.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        page.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        said = words(page, "where")[0]
        if said not in kept:
            k, _ = find_sample(page, study)
            assert words(page, *FIGURES) == expect(study, k)
            kept.add(said)
    assert len(kept) > 3
