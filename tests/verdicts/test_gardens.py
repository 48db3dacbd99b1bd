"""Rules of gardens beside walls of known height, solved by hand."""

import numpy as np
import pytest
from support.shapes import box
from verdicts.scenes import LONDON, find_lit, find_suns, hand_hours, judge, make_model, rectangle

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.writers.proof.rows import list_brief

GARDEN = {"garden": rectangle(-10, 0.0, 10, 10)}


def wall(height):
    """Return a long wall whose north face is the garden's south edge."""
    return ((-1000, -1, 0), (1000, 0, height))


def hand_share(boxes, least=2.0):
    """Return the share of the garden's depth with so many hours: the wall is the same for all x."""
    depths = (np.arange(400) + 0.5) / 40
    hours = [hand_hours(boxes, (0, y, 0), LONDON, "2026-03-21") for y in depths]
    return 100 * float(np.mean(np.array(hours) >= least - 1e-4))


@pytest.mark.parametrize(("height", "verdict"), [(3.0, "pass"), (6.0, "fail")])
def test_bre_gardens_by_the_shadow_of_a_wall(height, verdict):
    boxes = {"wall": wall(height)}
    expected = hand_share(boxes)
    (finding,) = judge(
        make_model(boxes, proposed=("wall",)), "bre-209-gardens", areas=GARDEN
    ).findings
    outcome = finding.outcome
    assert (finding.verdict, finding.where, outcome.unit, outcome.limit) == (
        verdict, "garden", "%", 50,
    )  # fmt: skip
    assert outcome.value == pytest.approx(expected, abs=0.5 + outcome.off)
    assert outcome.margin == pytest.approx(outcome.value - 50)
    assert outcome.before == pytest.approx(100)
    assert 0 < outcome.off < 10
    # At the equinoxes a wall along the parallel has one shadow all day, h / tan(90 - latitude).
    assert expected == pytest.approx(100 - 10 * height / np.tan(np.radians(38.9)), abs=4)


def test_bre_gardens_by_the_ratio_to_before():
    boxes = {"old": ((-1000, -1, 0), (1000, -0.0, 5.6)), "new": ((-1000, -1, 5.6), (1000, 0, 6.2))}
    (finding,) = judge(
        make_model(boxes, proposed=("new",)), "bre-209-gardens", areas=GARDEN
    ).findings
    before, after = hand_share({"old": boxes["old"]}), hand_share(boxes)
    assert after < 50
    share, ratio = finding.outcome.parts
    assert (share.verdict, finding.verdict) == ("fail", ratio.verdict)
    assert ratio.value == pytest.approx(after / before, abs=0.03)
    assert ratio.verdict == ("pass" if after / before >= 0.8 else "fail")


def test_bre_gardens_where_a_wall_replaces_another():
    """Before there is the taller wall alone, and after the lower one."""
    boxes = {"old": wall(6.6), "new": wall(6.2)}
    scene = make_scene([Part(n, "", Mesh(*box(*b))) for n, b in boxes.items()])
    found = umbra.prove(
        scene, LONDON, "bre-209-gardens", areas=GARDEN, proposed="new", replace="old", ground=0.0,
        year=2026,
    )  # fmt: skip
    before, after = (hand_share({"wall": one}) for one in (wall(6.6), wall(6.2)))
    share, ratio = found.verdicts[0].findings[0].outcome.parts
    assert share.value == pytest.approx(after, abs=0.5 + share.off)
    assert ratio.value == pytest.approx(after / before, abs=0.05)
    assert ratio.verdict == found.verdict == "pass"
    assert any("replaces old" in note for note in found.notes)


def test_without_a_proposal_the_ratio_is_unknown_and_overrides_nothing_that_passes():
    needed = judge(make_model({"wall": wall(6.0)}), "bre-209-gardens", areas=GARDEN)
    assert needed.verdict == "unknown"
    assert "proposed=" in needed.findings[0].outcome.needs
    assert judge(make_model({"wall": wall(3.0)}), "bre-209-gardens", areas=GARDEN).verdict == "pass"


def test_without_areas_it_is_unknown_and_says_what_to_give():
    verdict = judge(make_model({"wall": wall(6.0)}), "bre-209-gardens")
    assert verdict.verdict == "unknown"
    assert "areas=" in verdict.findings[0].outcome.needs


TOWER = {"tower": ((-6, -6, 0), (6, 6, 40))}


def test_zurich_counts_the_shadow_of_the_proposal_alone():
    other = {"other": ((-100, 55, 0), (100, 56, 60))}  # shades all of the land, and does not count
    land = {"near": rectangle(-2, 38, 2, 42), "far": rectangle(70, 90, 74, 94)}
    model = make_model(TOWER | other, proposed=("tower",))
    verdict = judge(model, "zurich-abv", areas=land)
    assert len(verdict.findings) == 4
    for finding in verdict.findings:
        middle = land[finding.where].centroid
        date = str(finding.outcome.date)
        # Standard time; London's is local in winter.
        directions, hours, _, _ = find_suns(LONDON, date, "08:00", "17:00", "10min")
        most = max(
            float(hours[~find_lit(TOWER.values(), np.array([x, y, 0.0]), directions)].sum())
            for x in middle.x + np.linspace(-1.95, 1.95, 14)
            for y in middle.y + np.linspace(-1.95, 1.95, 14)
        )
        assert finding.outcome.value == pytest.approx(most, abs=1 / 6 + 0.01), finding.where
        assert finding.verdict == ("pass" if finding.outcome.value <= 3 else "fail")


def test_zurich_does_not_apply_to_low_buildings():
    model = make_model({"house": ((-6, -6, 0), (6, 6, 24))}, proposed=("house",))
    verdict = judge(model, "zurich-abv", areas={"land": rectangle(-2, 7, 2, 9)})
    assert verdict.verdict == "pass"
    assert "24.0 m" in verdict.findings[0].outcome.needs


OLD = {"old": ((-1000, -1, 0), (1000, 0, 5.6))}


def find_ratio(new):
    """Return the outcomes of the share and of the ratio to before, with one more building."""
    model = make_model(OLD | {"new": new}, proposed=("new",))
    (finding,) = judge(model, "bre-209-gardens", areas=GARDEN).findings
    return finding.outcome.parts


def test_a_ratio_is_sure_where_nothing_changes():
    share, ratio = find_ratio(((900, 500, 0), (901, 501, 1)))
    assert share.off > 1  # of what is before and after alike
    assert (ratio.value, ratio.off, ratio.is_close) == (1.0, 0.0, False)
    assert ratio.before == ratio.after == share.value


def test_a_ratio_may_be_off_by_what_the_proposal_changes():
    tower = ((-10.5, 0, 0), (-10.0, 10, 30))  # at the garden's west end
    _, ratio = find_ratio(tower)
    spots = [(x, y, 0.0) for x in -10 + (np.arange(50) + 0.5) / 2.5
             for y in (np.arange(25) + 0.5) / 2.5]  # fmt: skip
    directions, hours, _, _ = find_suns(LONDON, "2026-03-21", "00:00", "24:00", "2min")

    def share_of(boxes):
        lit = [find_lit(boxes.values(), np.array(spot), directions) for spot in spots]
        return np.mean(np.array(lit) @ hours >= 2 - 1e-4)

    expected = share_of(OLD | {"new": tower}) / share_of(OLD)
    assert ratio.value != pytest.approx(expected, abs=0.01)
    assert abs(ratio.value - expected) <= ratio.off < 0.1


def test_a_most_that_is_just_met_is_told_as_a_most():
    """Of a proposal that takes nothing from a garden."""
    model = make_model({"new": ((40, 40, 0), (41, 41, 1))}, proposed=("new",))
    verdict = judge(model, "nyc-ceqr", areas={"park": rectangle(0, -20, 10, -10)})
    assert {row[2][0] for row in list_brief(verdict) if row[3] == "pass"} == {"≤"}
