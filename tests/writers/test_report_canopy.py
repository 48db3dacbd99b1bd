"""Reports of studies with canopies: light that is weakened, in a real browser."""

import numpy as np
import pytest
from support.pages import FIGURES, INK, READY, expect, place_of, read_at, say, walk, words
from support.shapes import box, moved

from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.timeline import make_point_timeline, make_timeline
from umbra.sun import Site
from umbra.writers.picture_content import Plan
from umbra.writers.report import write_report

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
GARDEN = {
    "house": box((-6, -4, 0), (4, 6, 14)),
    "crown": moved(box((0, 0, 0), (8, 8, 5)), (-16, -8, 4)),
    "tree": moved(box((0, 0, 0), (4, 4, 6)), (6, -14, 3)),
}
POINTS = np.array([(-14, 3, 0.5), (-4, -8, 1), (8, 2, 1), (12, -6, 0.5), (-12, -4, 1)])
INKS = {"lit": (251, 248, 240), "dark": (118, 125, 149), "behind": (164, 189, 161)}
SEASON = {"transmissivity": "0.03:0.5", "leaf_on": "04-15..10-31"}


def make_study(receivers="ground", **options):
    parts = [Part(name, "", Mesh(*mesh)) for name, mesh in GARDEN.items()]
    scene = make_scene(parts, ground=0.0)
    chosen = {"date": "2026-06-21", "start": "04:00", "end": "21:00", "every": "30min",
              "receivers": receivers, "canopy": ["crown", "tree"], "masks": True, "spells": True,
              **SEASON} | options  # fmt: skip
    if receivers == "points":
        chosen["points"] = POINTS
    if receivers == "surfaces":
        chosen["spacing"] = 1.0
    if receivers in {"ground", "top"}:
        chosen = {"cell": 0.5, "extent": (-40, -25, 40, 35)} | chosen
    run = run_study
    return run(scene, VIENNA, **chosen)


def save(path, study, **more):
    if receives_points(study):
        nowhere = np.zeros(1)
        return path, write_report(path, study, Plan(nowhere, nowhere, title="Garden"))
    heights = (study.heights - study.ground).astype(np.float32) if study.is_plan else None
    plan = Plan(study.x, study.y, heights, title="Garden")
    return path, write_report(path, study, plan, [], **more)


def receives_points(study):
    return study.receivers in {"points", "surfaces"}


def find_behind(study):
    return np.asarray(study.more["under_canopy"][1])


def visit(page, study):
    """Point at places behind canopies for long and at others, and give each."""
    if study.receivers == "surfaces":
        yield from ((k,) for *_, k, _ in read_at(page, study, walk(page, 150)))
        return
    if study.receivers == "points":
        for k in range(len(POINTS)):
            page.ask(f"document.querySelector('tr[data-index=\"{k}\"] button').click()")
            yield (k,)
        return
    behind = np.nan_to_num(study.more["canopy_hours"][1])
    dark = np.nan_to_num(study.shadow_hours) > 1
    rng = np.random.default_rng(7)
    long = rng.permutation(np.argwhere(behind > 0.5 * behind.max()))
    for place in [*long[:6], *rng.permutation(np.argwhere(dark & (behind == 0)))[:2]]:
        page.mouse("mouseMoved", *place_of(page, study, *place))
        yield tuple(place)


def read_kinds(page):
    """Give what the lines say of each half hour, by their pieces' widths."""
    pieces = page.ask(
        "[...document.querySelectorAll('#line rect')]"
        ".map(r => [r.getAttribute('class'), Number(r.getAttribute('width'))])"
    )
    step = sum(width for _, width in pieces) / n_steps(page)
    return [kind for kind, width in pieces for _ in range(round(width / step))]


def n_steps(page):
    return page.ask("JSON.parse(document.getElementById('data').textContent).steps.up.length")


def expect_kinds(study, place):
    shadow = np.asarray(study.masks)[:, *place]
    kinds = np.where(shadow, "dark", np.where(find_behind(study)[:, *place], "behind", "lit"))
    return np.where(study.sun.is_up, kinds, "night").tolist()


@pytest.mark.parametrize("receivers", ["ground", "top", "south", "surfaces", "points"])
def test_what_is_read_behind_canopies_is_what_the_study_found(page, tmp_path, receivers):
    study = make_study(receivers)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    hours = []
    for place in visit(page, study):
        assert words(page, *FIGURES) == expect(study, *place), place
        hours.append(float(study.more["canopy_hours"][1][*place]))
        assert words(page, "behind") == [say(hours[-1])]
        assert words(page, "spells") == [str(study.more["sun_spells"][1][*place])]
        assert read_kinds(page) == expect_kinds(study, place)
    assert len(hours) >= 5
    assert max(hours) > 1
    assert words(page, "share") == ["behind canopies: 3 % of the sun"]
    assert not page.ask("document.getElementById('share').parentElement.hidden")


def test_the_picture_of_the_moment_and_the_legend_follow_the_date(page, tmp_path):
    dates = ["2026-03-21", "2026-06-21"]
    study = make_study(date=dates, start="10:00", end="16:00", every="1h")
    page.open(save(tmp_path / "report.html", study)[0], READY)
    page.ask("document.querySelector('input[value=shadow]').click()")
    tested = {"lit": 0, "dark": 0, "behind": 0}
    for k, share in enumerate(("50", "3")):
        page.ask(f"(s => {{ s.value = {k}; s.dispatchEvent(new Event('change')); }})(day)")
        assert words(page, "share") == [f"behind canopies: {share} % of the sun"]
        step = 6 * k + int(page.ask("document.getElementById('time').value"))
        kinds = np.where(
            study.masks[step], "dark", np.where(find_behind(study)[step], "behind", "lit")
        )
        for kind in tested:
            found = np.random.default_rng(k).permutation(np.argwhere(kinds == kind))
            for row, col in found[:60]:
                where = np.s_[max(row - 3, 0) : row + 4, max(col - 3, 0) : col + 4]
                if (kinds[where] != kind).any() or study.heights[where].max() > 0:
                    continue  # an edge, or a roof
                pixel = page.ask(INK.format(*place_of(page, study, row, col)))
                # What is drawn over the plan, such as its scale, is none of these.
                seen = [
                    name
                    for name, ink in INKS.items()
                    if np.abs(np.subtract(pixel[:3], ink)).max() < 4
                ]
                assert seen in ([kind], []), (kind, row, col, pixel)
                tested[kind] += len(seen)
    assert min(tested.values()) > 5


def test_a_date_on_which_canopies_weaken_nothing_has_none(page, tmp_path):
    study = make_study(
        date=["2026-03-21", "2026-06-21"], transmissivity="0.03:1", every="1h", cell=1.0
    )
    path, timeline = save(tmp_path / "report.html", study)
    first = study.period.day_of_step[timeline.which] == 0
    assert not timeline.behind[first].any()
    assert timeline.behind[~first].any()
    assert timeline.is_summed(study)
    page.open(path, READY)
    assert words(page, "share") == ["canopies weaken nothing on this date"]


def test_larger_cells_count_the_share_at_their_own_centres(page, tmp_path):
    study, coarse = make_study(cell=0.5), make_study(cell=1.0)
    path, timeline = save(
        tmp_path / "report.html", study, timeline=make_timeline(study, longest=80)
    )
    assert timeline.shape == coarse.shadow_hours.shape
    page.open(path, READY)
    for place in visit(page, coarse):
        assert words(page, *FIGURES) == expect(coarse, *place)


@pytest.mark.parametrize("receivers", ["surfaces", "points"])
def test_points_are_counted_again_where_no_instants_were_kept(receivers):
    study, again = make_study(receivers), make_study(receivers, masks=False)
    kept, counted = make_point_timeline(study), make_point_timeline(again)
    assert kept.is_summed(study)
    assert kept.behind.any()
    np.testing.assert_array_equal(kept.bits, counted.bits)
    np.testing.assert_array_equal(kept.behind, counted.behind)


def test_solved_hours_are_the_studys_own(page, tmp_path):
    study = make_study(exact=True, every="1h", cell=1.0)
    page.open(save(tmp_path / "report.html", study)[0], READY)
    behind = study.more["canopy_hours"][1]
    row, col = np.unravel_index(behind.argmax(), behind.shape)
    page.mouse("mouseMoved", *place_of(page, study, row, col))
    figures = (study.sun_hours, study.shadow_hours, behind)
    said = [say(float(hours[row, col])) for hours in figures]
    assert words(page, "in-sun", "in-shadow", "behind") == said


def test_what_was_assumed_of_canopies_is_said(page, tmp_path):
    text = save(tmp_path / "report.html", make_study(cell=2.0))[0].read_text()
    assert "2 parts: a receiver that only canopies shade" in text
    assert "3 % of the sun from 04-15 to 10-31 and 50 % on other dates" in text
    assert "36 of 36 triangles" in text
    bare, _ = save(
        tmp_path / "bare.html",
        make_study(cell=2.0, canopy=[], transmissivity=None, leaf_on=None),
    )
    assert "triangles, as the file has them, opaque<" in bare.read_text()
    page.open(bare, READY)
    shown = "[...document.querySelectorAll('.of-canopies')].some(e => e.offsetHeight > 0)"
    assert page.ask(shown) is False


def test_hours_of_a_date_are_drawn_with_their_share(page, tmp_path):
    dates = ["2026-03-21", "2026-06-21"]
    study = make_study(date=dates, start="10:00", end="16:00", every="1h")
    page.open(save(tmp_path / "report.html", study)[0], READY)
    ramp = page.ask("JSON.parse(document.getElementById('data').textContent).ramp")
    page.ask("document.querySelector('input[value=day]').click()")
    hours = np.asarray(study.more["shadow_hours_by_day"][1])
    behind = np.asarray(study.more["canopy_hours_by_day"][1])
    for k, key in enumerate(("PageUp", "PageDown")):
        page.press(key)
        tested = 0
        for row, col in np.random.default_rng(k).permutation(np.argwhere(behind[k] > 0.9)):
            near = hours[k][row - 2 : row + 3, col - 2 : col + 3]
            if np.ptp(near) or study.heights[row, col] > 0:
                continue
            pixel = page.ask(INK.format(*place_of(page, study, row, col)))
            at = round(float(hours[k][row, col]) / 6 * (len(ramp) - 1))
            assert pixel[:3] == pytest.approx(ramp[at], abs=2), (row, col)
            tested += 1
            if tested == 6:
                break
        assert tested == 6
