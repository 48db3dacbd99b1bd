"""McGuire's cases, bytes and frames: that what is said was counted and timed."""

import json
from dataclasses import replace

import pytest
from support.bench import once, run_quick

from umbra.errors import UmbraError
from umbra_benchmarks import mcguire
from umbra_benchmarks.cases import DrawnTriangles, find_growth
from umbra_benchmarks.measure import Timing
from umbra_benchmarks.method_frames import CONTENDERS, Viewed
from umbra_benchmarks.report import BenchmarkRun


def run(*arguments):
    return run_quick("mcguire", *arguments, "--repeat", "1").stdout


@pytest.fixture
def no_opengl(monkeypatch):
    monkeypatch.setattr(mcguire, "bench_mcguire", once(mcguire.bench_mcguire))

    def refuse(_):
        msg = "there is no OpenGL here"
        raise UmbraError(msg)

    monkeypatch.setattr(mcguire, "draw_views", refuse)


@pytest.mark.usefixtures("no_opengl")
def test_cases_count_triangles():
    found = json.loads(run("--json"))
    assert found["benchmark"] == "mcguire"
    assert found["driver"] == "no frames: there is no OpenGL here"
    assert found["views"] == []
    assert [row["shape"] for row in found["cases"]] == ["ball", "ball", "boulder", "boulder"]
    for row in found["cases"]:
        edges, (one, two, three) = row["silhouette_edges"], row["triangles"]
        assert (one, two) == (2 * edges, 3 * edges)
        lit = three - two
        assert 0.2 * row["faces"] < lit < 0.5 * row["faces"]  # of a ball a near light sees less
        assert row["triangles_extruded_caps"] == one + 2 * lit
        near, same, capped = row["triangles_directional"]
        assert near == same < edges * 2
        assert 0.4 * row["faces"] < capped - same < 0.6 * row["faces"]
        assert len(row["placing_ms"]) == 3
    assert set(found["growth"]) == {"ball", "boulder"}
    assert found["paper_growth"] == {"mcguire": ["s", "s", "f"], "lengyel": ["s", "f", "f"]}
    text = run()
    assert "to the power of" in text
    assert "Frames" not in text


def test_growth_is_a_power():
    drawn = [
        DrawnTriangles(
            "ball", 100 * 4**k, 0, (20 * 2**k, 30 * 2**k, 50 * 4**k), (0, 0, 0), 0, (0, 0, 0)
        )
        for k in range(4)
    ]
    assert find_growth(drawn, "ball") == pytest.approx((0.5, 0.5, 1.0))


@pytest.mark.usefixtures("opengl")
def test_frames_are_drawn_in_every_case():
    found = json.loads(run("--json"))["views"]
    assert len(found) == 10
    assert {row["scene"] for row in found} == {"hall", "9 spheres", "boulder"}
    cases = [sum(row["cases"][k] for row in found) for k in range(3)]
    assert min(cases) >= 3
    for row in found:
        drawn, cases = row["triangles"], row["cases"]
        assert set(drawn) == set(row["ms"]) == set(CONTENDERS)
        assert row["bytes_per_triangle"] == 6
        for name, bytes_ in row["index_bytes"].items():
            assert bytes_ == 6 * drawn[name]
        # What culling leaves can only be less, and so can what cases do.
        assert drawn["mcguire, cut"] <= drawn["mcguire"] <= drawn["lengyel"] <= drawn["z-fail"]
        assert drawn["z-pass"] <= drawn["lengyel"]
        if row["scene"] == "boulder":  # one caster, and one light
            assert (drawn["lengyel"] == drawn["z-pass"]) == (cases == [1, 0, 0])
            assert (drawn["lengyel"] == drawn["z-fail"]) == (cases != [1, 0, 0])
            sides = drawn["z-pass"]
            assert drawn["mcguire"] == sides or cases[2] or drawn["mcguire"] <= 1.5 * sides
        assert row["lengyel_to_mcguire"] == pytest.approx(
            row["min_ms"]["lengyel"] / row["min_ms"]["mcguire"]
        )


def make_view(lengyel, triangles=10):
    times = {name: Timing(0.02, 0.01, 0.03) for name in CONTENDERS}
    times["lengyel"] = Timing(0.02, lengyel, 0.06)
    drawn = {**dict.fromkeys(CONTENDERS, 5), "lengyel": triangles}
    return Viewed("hall", "a view", 7, 9, (1, 2, 3), times, drawn, dict.fromkeys(CONTENDERS, 60))


def test_the_papers_claim_is_judged_by_view():
    views = [make_view(0.02), make_view(0.0102, 5), make_view(0.005), make_view(0.0101)]
    found = mcguire.McGuire(BenchmarkRun(3, False), [], views, "brush", False)
    text = found.to_table()
    assert "fewer triangles than lengyel in 3 of 4 views" in text
    assert "faster in 1, slower in 1, within 3 % in 2" in text
    assert "| hall  | 7                 | 9      | 12               | 3           |" in text
    assert "1, 2, 3" in text
    by_processor = replace(found, is_software=True).to_table()
    assert "faster in 4, slower in 0, within 3 % in 0 (of processor)" in by_processor
    assert "--quick" not in text
    assert "--quick" in replace(found, run=BenchmarkRun(3, quick=True)).to_table()
