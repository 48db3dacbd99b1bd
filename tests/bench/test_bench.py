"""Every benchmark runs and says what it measured; how fast it was is not judged here."""

import json
import sys
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner
from support.bench import borrow, once, run_both, run_quick
from support.chromium import find_chromium

from umbra.cli.main import main
from umbra.errors import UmbraError
from umbra.volume.adjacency import make_caster
from umbra_benchmarks.command import command
from umbra_benchmarks.growth import fit_exponent
from umbra_benchmarks.measure import run_in_turn
from umbra_benchmarks.scenes import make_boulder, make_suns, make_town


@cache
def run(*arguments):
    return run_quick(*arguments, "--repeat", "1")


@pytest.mark.parametrize("name", ["study", "walls", "frame", "silhouette"])
def test_a_benchmark_prints_one_object(name):
    if name != "silhouette":
        pytest.importorskip("embreex")
    found, _ = run_both(name, "--threads", "1")
    assert found["benchmark"] == name
    assert found["threads"] == 1
    assert found["quick"] is True
    assert found["peer"]
    assert found["machine"]
    assert found["rows"]
    for row in found["rows"]:
        assert row["ratio"] == pytest.approx(row["peer_ms"] / row["ours_ms"])
        assert row["ratio_of_minima"] == pytest.approx(row["peer_min_ms"] / row["ours_min_ms"])
        assert row["speed_up"] == pytest.approx(row["ours_ms"] / row["ours_threads_ms"])
        assert row["ours_min_ms"] <= row["ours_ms"]
        assert row["peer_min_ms"] <= row["peer_ms"]
        assert row["compared"] > 0
        # Shadow edges may differ by Embree's float32; a wrong scene would differ everywhere.
        assert row["disagreements"] <= 1e-3 * row["compared"]
        if name == "silhouette":
            assert row["disagreements"] == 0
        else:
            assert row["second_ratio"] == pytest.approx(row["second_ms"] / row["ours_ms"])
            assert row["second_disagreements"] <= 1e-3 * row["compared"]


def test_whole_studies_are_measured_beside_a_script():
    pytest.importorskip("embreex")
    pytest.importorskip("trimesh")
    found, text = run_both("study", "--threads", "1")
    assert "call, another date" in text
    (whole,) = found["wholes"]
    assert whole["work"] == "town, 120 triangles, 64\u00b2"
    assert whole["differ"] <= 0.01 * whole["cells"]
    assert whole["ratios"]["first"] == pytest.approx(whole["peer_ms"] / whole["first_ms"])


def test_a_table_is_for_people():
    _, text = run_both("silhouette", "--threads", "1")
    assert "too small to mean anything" in text
    lines = [line for line in text.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in lines}) == 1
    assert len(lines) == 2 + 2 * 5


@pytest.mark.usefixtures("opengl")
def test_growth_finds_exponents():
    found = json.loads(run("growth", "--json").stdout)
    axes = {axis["axis"]: axis for axis in found["axes"]}
    assert list(axes) == ["triangles", "lights", "pixels", "stacked volumes"]
    assert axes["triangles"]["numbers"] == [12 * 25, 12 * 100]
    for axis in axes.values():
        assert len(axis["numbers"]) == len(axis["calls_min_ms"]) == len(axis["frames_min_ms"])
        assert min(axis["calls_min_ms"] + axis["frames_min_ms"]) > 0
        assert np.isfinite([axis["calls_exponent"], axis["frames_exponent"]]).all()


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_an_exponent_is_that_of_the_cost(power):
    numbers = [1, 10, 30, 200]
    assert fit_exponent(numbers, [3.0 * n**power for n in numbers]) == pytest.approx(power)


@pytest.mark.usefixtures("opengl")
def test_gpu_draws_towns_of_any_size_where_there_is_the_memory():
    given = ("gpu", "--json", "--triangles")
    (row,) = json.loads(run(*given, "12000").stdout)["frames"]
    assert (row["triangles"], row["lights"]) == (12_000, 1)
    assert row["volumes"] > 5_000
    with pytest.raises(UmbraError, match=r"400000\.3 GB") as caught:
        CliRunner().invoke(command, [*given, str(10**12)], catch_exceptions=False)
    assert caught.value.option == "triangles"


@pytest.mark.usefixtures("opengl")
def test_gpu_times_passes_and_compares_counts():
    found = json.loads(run("gpu", "--json").stdout)
    assert set(found["features"]) == {"depth bounds", "timer queries", "reversed depth"}
    sizes = {(row["lights"], row["samples"]) for row in found["frames"]}
    assert sizes >= {(1, 1), (3, 1), (1, 4), (1, 8)}
    for row in found["frames"]:
        assert row["triangles"] in {12 * 25, 20 * 1280 + 2}
        assert row["calls_ms"] > 0
        assert 0 < row["frame_min_ms"] <= row["frame_ms"]
        assert row["passes_ms"]["surfaces"] > 0
        assert row["passes_ms"]["shadows"] > 0
    volumes = [row["volumes"] for row in found["frames"] if row["triangles"] > 12 * 25]
    assert volumes == sorted(volumes, reverse=True)
    assert len(found["counts"]) == 6
    deepest = {(row["scene"], row["light"]): row["deepest"] for row in found["counts"]}
    assert deepest["300 plates", "sun"] == 300
    assert {row["counts_in"] for row in found["counts"]} == {"stencil", "float"}
    for row in found["counts"]:
        assert row["differ"] <= 0.02 * row["compared"]
        assert row["compared"] > 100
    (skin,) = found["skins"]
    assert skin["triangles"] == 320
    assert skin["sides"] > 20
    # Of faces that the light sees edge-on within float32.
    assert skin["differ"] <= 2
    for name in ("processor", "upload", "device"):
        assert 0 < skin[f"{name}_min_ms"] <= skin[f"{name}_ms"]


@pytest.mark.usefixtures("opengl")
def test_motion_measures_each_scene():
    found = json.loads(run("motion", "--json").stdout)
    assert found["driver"]
    assert len(found["rows"]) == 11
    for row in found["rows"]:
        assert 0 < row["calls_min_ms"] <= row["calls_ms"]
        assert row["frame_ms"] > 0
        assert row["volumes"] > 0
        assert (row["move_ms"] is None) == (
            "turn" not in row["work"] and "bends" not in row["work"]
        )


def test_web_measures_frames_and_names_npm_where_it_is_missing(monkeypatch, tmp_path):
    if find_chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    found = json.loads(run("web", "--peer", "none", "--json").stdout)
    assert found["triangles"] == 480
    assert set(found["frames"]) == {"ours", "ours_moving", "ours_coarser"}
    for side in found["frames"].values():
        assert side["wall"] > side["script"] > 0
        assert side["busy"] is None or side["busy"] > 0
    monkeypatch.setenv("UMBRA_CACHE", str(tmp_path))
    monkeypatch.setattr("umbra_benchmarks.web.shutil.which", lambda _: None)
    with pytest.raises(UmbraError, match="npm is missing, which fetches"):
        CliRunner().invoke(command, ["web", "--quick"], catch_exceptions=False)


def test_startup_measures_whole_processes():
    found = json.loads(run("startup", "--json").stdout)
    # Counting takes a compiler and rasters; and neither is the memory of the tests' own process.
    assert found["peak_bytes"] > found["read_bytes"] + 2e7 > 3e7
    assert found["above_mesh_bytes"] == found["peak_bytes"] - found["read_bytes"]
    rest = found["study_seconds"] - found["read_seconds"] - found["count_seconds"]
    assert found["rest_seconds"] == pytest.approx(rest)
    assert rest > 0


def test_a_missing_peer_is_named_with_its_remedy(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    with pytest.raises(SystemExit) as ended:
        main(["bench", "study", "--quick"])
    assert ended.value.code == 2
    assert "pip install 'umbra-benchmarks[embree]'" in capsys.readouterr().err


def test_a_missing_name_is_told(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["bench"])
    assert ended.value.code == 2
    assert "NAME is missing; type umbra bench NAME" in capsys.readouterr().err


def test_contenders_run_in_turn_after_a_warm_up():
    order = []

    def contender(name, *seconds):
        left = list(seconds)

        def work():
            order.append(name)
            return left.pop(0)

        return work

    timings = run_in_turn({"a": contender("a", 99, 3, 1, 8), "b": contender("b", 99, 5, 7, 6)}, 3)
    assert "".join(order) == "ab" * 4
    assert (timings["a"].median, timings["a"].least) == (3, 1)
    assert (timings["b"].median, timings["b"].least) == (6, 5)


@pytest.mark.parametrize(
    "model", [make_town(12, 100.0, 5), make_boulder(2)], ids=["town", "boulder"]
)
def test_scenes_are_closed_and_wound_outward(model):
    a, b, c = (model.vertices[model.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a - a.mean(0), np.cross(b - a, c - a)).sum() > 0
    assert make_caster(model.vertices, model.faces).is_closed.all()
    assert (model.vertices[:, :2].min(0) > 0).all()
    assert (model.vertices[:, :2].max(0) < model.side).all()
    assert (model.vertices == model.vertices.astype(np.float32)).all()


def test_sizes_are_as_said():
    assert len(make_town(300, 500.0, 1).faces) == 3600
    assert len(make_boulder(3).faces) == 1280
    suns = make_suns()
    assert suns.shape == (33, 3)
    assert np.allclose(np.linalg.norm(suns, axis=1), 1)
    assert suns[0, 0] > 0.8  # in the east at nine
    assert suns[32, 0] < -0.8


def test_every_table_is_written_by_one_command(tmp_path, monkeypatch):
    def fail(_):
        msg = "embreex is missing; install it"
        raise UmbraError(msg)

    silhouette = borrow("silhouette")
    monkeypatch.setattr(silhouette, "bench_silhouette", once(silhouette.bench_silhouette))
    tables = {name: name for name in ("silhouette", "frame", "tools")}
    monkeypatch.setattr("umbra_benchmarks.all._TABLES", tables)
    monkeypatch.setattr("umbra_benchmarks.frame.bench_frame", fail)
    monkeypatch.setattr("umbra_benchmarks.tools.bench_tools", fail)
    page = tmp_path / "results.md"
    page.write_text("old")
    assert run("all", "--out", str(page)).stdout == f"{page}\n"
    text = page.read_text()
    assert text.startswith("# Last results\n\nBy `umbra bench all` on 20")
    assert "## umbra bench silhouette\n\numbra bench silhouette: " in text
    assert "## umbra bench frame\n\nNot measured: embreex is missing; install it\n" in text
    assert "<!-- tools -->\n\nNot measured: " in text
    assert text.endswith("<!-- end of tools -->\n")
    found = json.loads(run("all", "--json").stdout)
    assert found["reports"]["frame"] == {"failed": "embreex is missing; install it"}
    assert found["reports"]["silhouette"]["rows"]


def test_only_all_writes_a_page(tmp_path):
    result = CliRunner().invoke(command, ["frame", "--out", str(tmp_path / "results.md")])
    assert result.exit_code == 2
    assert "--out is for all" in result.output
