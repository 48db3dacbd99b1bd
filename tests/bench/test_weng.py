"""The table of soft shadows: that it says what it measured, and how errors are counted."""

import numpy as np
import pytest
from PIL import Image
from support.bench import run_both

from umbra.volume.adjacency import make_caster
from umbra_benchmarks.scenes import make_ball
from umbra_benchmarks.weng import find_errors


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Give where the figures are saved."""
    return tmp_path_factory.mktemp("weng")


@pytest.fixture(scope="module")
def measured(folder):
    """Give what was measured once, as JSON and as tables."""
    return run_both("weng", "--threads", "1", "--pictures", str(folder))


def test_one_object_says_times_and_errors(measured):
    found, _ = measured
    assert (found["benchmark"], found["samples"], found["quick"]) == ("weng", 1024, True)
    assert [row["faces"] for row in found["rows"]] == [12, 48]
    for row in found["rows"]:
        assert row["wedges_to_weng"] == pytest.approx(row["wedges_ms"] / row["weng_ms"])
        assert 0 < row["hard_ms"] < row["samples_ms"]
        for where in ("floor", "everywhere"):
            wedges, weng, hard = (row[where][name] for name in ("wedges", "weng", "hard"))
            assert wedges["l1"] <= wedges["rms"] <= wedges["most"] <= 1
            assert abs(wedges["bias"]) <= wedges["l1"]
            assert min(wedges["pixels"], weng["pixels"], hard["pixels"]) > 100
            # Wedges are nearly exact; layers outside the hard shadow only darken.
            assert wedges["l1"] < 0.002
            assert 0.001 < row[where]["samples"]["l1"] < 0.006
            assert row[where]["complexity"]["l1"] < 0.001
            assert weng["l1"] > 0.1
            assert weng["bias"] < 0
        if found["gl_device"] is None:
            assert row["gl_ms"] == {}
        else:
            assert list(row["gl_ms"]) == ["hard", "samples", "wedges", "complexity", "weng"]
            assert 0 < row["gl_ms"]["hard"] < row["gl_ms"]["samples"]
    assert "fig. 16" in found["rows"][0]["paper"]
    assert found["rows"][1]["paper"] is None


def test_a_table_is_for_people(measured):
    _, text = measured
    assert "too small to mean anything" in text
    lines = [line for line in text.splitlines() if line.startswith("|")]
    rows, grid = lines[:4], lines[4:]
    assert len({line.count("|") for line in rows}) == 1
    assert len({line.count("|") for line in grid}) == 1
    assert (len(grid), grid[0].count("gap")) == (2 + 5, 4)


def test_figure_15_is_a_grid_of_lengths_and_gaps(measured, folder):
    cells = measured[0]["figure_15"]
    assert [(cell["length"], cell["gap"]) for cell in cells[:5]] == [
        (1, 0.1), (1, 0.3), (1, 0.5), (1, 1.0), (2, 0.1),
    ]  # fmt: skip
    assert [cell["layers"] for cell in cells[8:12]] == [30, 10, 6, 3]
    # A cube: 6 edges of the silhouette are 12 triangles of sides, 3 lit faces twice 6 of caps.
    assert [cell["triangles"] for cell in cells[8:12]] == [24 * n for n in (31, 11, 7, 4)]
    by_length = [
        np.mean([cell["floor"]["l1"] for cell in cells[4 * k : 4 * k + 4]]) for k in range(5)
    ]
    assert sorted(by_length) == by_length
    with Image.open(folder / "weng_figure_16.png") as sheet:
        cube = np.array(sheet, np.float64).reshape(3, 72, 2, 96)[:, :, 0]
        hard, layers, by_wedges = cube.mean((1, 2))
        assert layers < by_wedges - 1 < hard  # layers add to the hard shadow and take nothing
    with Image.open(folder / "weng_figure_15.png") as sheet:
        assert sheet.size == (4 * 96, 5 * 72)
        shades = np.array(sheet)
    # Denser gaps have more shades.
    counts = [len(np.unique(shades[168:216, 96 * k : 96 * k + 96])) for k in range(4)]
    assert counts == sorted(counts, reverse=True)


def test_errors_are_counted_where_either_is_in_penumbra():
    truth = np.array([0, 0.5, 1, 1, 0.25, 0.5], np.float32)[None]
    found = np.array([0, 0.5, 1, 0.5, 1.0, 0.0], np.float32)[None]
    where = np.ones_like(truth, bool)
    errors = find_errors(found, truth, where)
    assert errors.pixels == 4
    assert errors.l1 == pytest.approx((0 + 0.5 + 0.75 + 0.5) / 4)
    assert errors.bias == pytest.approx((0 - 0.5 + 0.75 - 0.5) / 4)
    assert errors.rms == pytest.approx(np.sqrt((0.25 + 0.5625 + 0.25) / 4))
    assert errors.most == 0.75
    assert find_errors(found, truth, ~where).pixels == 0


@pytest.mark.parametrize("around", [(8, 4), (25, 11)])
def test_balls_are_closed_and_wound_outward(around):
    vertices, faces = make_ball(*around)
    assert len(faces) == 2 * around[0] * (around[1] - 1)
    assert make_caster(vertices, faces).is_closed.all()
    a, b, c = ((vertices - (0, 0, 1.6))[faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert 0.5 * 4.19 < volume < 4.19
