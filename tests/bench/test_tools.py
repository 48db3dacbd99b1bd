"""The tools of the trade beside umbra: the exact answer, the harness, and who is absent."""

import json
import sys
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from click.testing import CliRunner
from support.bench import run_quick
from support.raycaster import RayCaster
from support.shapes import box, soup

from umbra.cli.main import main
from umbra.scene.grid import Grid
from umbra_benchmarks import tools
from umbra_benchmarks.command import TOOLS as NAMES
from umbra_benchmarks.command import command
from umbra_benchmarks.exact import find_exact
from umbra_benchmarks.tools import TOOLS

SOUTH_AT_45 = np.array([[0.0, -1.0, 1.0]]) / np.sqrt(2)

# A tool that says all is in the sun, at suns that are a degree too low.
SUNNY = f"""
import os, sys
sys.path.insert(0, {str(TOOLS["umep"].script.parent)!r})
import numpy as np
from block import PeerSeconds, serve_tool

class Sunny:
    name = "Sunny 3"
    def __init__(self, block):
        self.block = block
        azimuth, altitude = np.radians(block.find_angles())
        level, up = np.cos(altitude - np.pi / 180), np.sin(altitude - np.pi / 180)
        self.suns = np.stack([level * np.sin(azimuth), level * np.cos(azimuth), up], -1)
        assert block.instants[0] == np.datetime64("2026-09-18T07:00")
        assert block.hours * len(block.instants) == 8.25
        assert (block.vertices.reshape(-1, 8, 3)[:, :4, 2] == -1).all()
        self.runs = 0
    def run(self):
        self.runs += 1
        os.write(1, b"noise")
        return PeerSeconds(0.25 * self.runs, 0.5 * self.runs)
    def find_masks(self):
        return np.zeros((len(self.suns), *self.block.heights.shape), bool)

serve_tool(Sunny)
"""


@pytest.fixture
def sunny(monkeypatch, tmp_path):
    """Have one peer, which pretends."""
    script = tmp_path / "sunny.py"
    script.write_text(SUNNY)
    monkeypatch.setattr("umbra_benchmarks.peer.find_spec", lambda _: None)
    monkeypatch.setitem(TOOLS, "ladybug", replace(TOOLS["ladybug"], script=script))
    return ["--peer-python", f"ladybug={sys.executable}"]


def run(*arguments):
    return run_quick("tools", *arguments)


def test_a_box_and_its_shadow_by_hand():
    vertices, faces = box((4, 4, -1), (6, 6, 10))
    grid = Grid(0.5, 0.5, 1.0, 1.0, 20, 20)
    is_open = np.ones((20, 20), bool)
    is_open[4:6, 4:6] = False
    exact = find_exact(vertices[faces], SOUTH_AT_45, grid, is_open, 0.25)
    want = np.zeros((1, 20, 20), bool)
    want[0, 4:16, 4:6] = True  # its plan, and 10 m to the north of it
    assert (exact.masks == want).all()
    # Half a diagonal is 0.71 m: rows 3 and 4, 15 and 16, columns 3 to 6 lie that near.
    near = np.zeros((1, 20, 20), bool)
    near[0, 3:17, 3:7] = True
    corners = np.zeros_like(near)
    corners[0, [[3], [16]], [3, 6]] = True  # that far to the last digit: either is right
    assert ((exact.near == near) | corners).all()

    assert exact.judge(want).of == 396
    assert (exact.judge(want).wrong, exact.judge(want).near) == (0, 0)
    answer = want.copy()
    answer[0, 10, 3:5] ^= True  # beside the edge
    answer[0, 10, 15] = True  # far from it
    answer[0, 4, 4] = False  # not open ground
    found = exact.judge(answer)
    assert (found.wrong, found.near) == (1, 2)
    assert found.mean_hours == pytest.approx(3 * 0.25 / 396)
    assert found.most_hours == 0.25


def test_the_exact_answer_is_a_plain_ray_casters():
    rng = np.random.default_rng(4)
    vertices, faces = soup(rng, n=60, low=-1.0)
    grid = Grid(-11.7, -12.3, 0.73, 0.69, 33, 35)
    suns = np.array([[0.3, -0.4, 0.5], [-0.8, 0.1, 0.3], [0.0, 0.0, 1.0]])
    exact = find_exact(vertices[faces], suns, grid, np.ones((35, 33), bool), 1.0)
    x, y = np.meshgrid(grid.x, grid.y)
    points = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3)
    rays = RayCaster(vertices, faces)
    own, above = np.full(len(points), -1), np.array([0, 0, 1.0, 0])
    for sun, mask in zip(suns, exact.masks, strict=True):
        pierced = rays.count(points, own, above, np.append(sun, 0.0), np.zeros(len(faces), bool))
        assert 0.05 < pierced.any.mean() < 0.95
        assert (mask.ravel() == pierced.any).all()


def test_umbra_alone_is_never_wrong(monkeypatch):
    monkeypatch.setattr("umbra_benchmarks.peer.find_spec", lambda _: None)
    result = run("--json", "--repeat", "1")
    found = json.loads(result.stdout)
    assert (found["benchmark"], found["cells"], found["suns"]) == ("tools", 64**2, 33)
    assert [row["peer"] for row in found["rows"]] == ["ground", "top"]
    for row in found["rows"]:
        assert row["wrong"] == row["near_edges"] == row["max_error_hours"] == 0
        assert row["whole_ms"] > row["ms"] > 0
        assert row["compared"] > 1e5
    assert set(found["missing"]) == set(NAMES)
    for kind in TOOLS.values():
        assert kind.install in result.stderr
        assert f"--peer-python {kind.name}=PATH" in result.stderr


def test_whole_studies_have_the_instants_that_are_judged():
    ours = tools._Ours(tools.make_town(4, 60.0, 2), 40)
    scene = tools.make_scene(ours.model.vertices, ours.model.faces)
    for receivers, sweep in (("ground", ours.ground), ("top", ours.top)):
        study = ours.study(scene, receivers)
        assert np.allclose(study.sun_direction, ours.suns, atol=1e-9)
        hours = 0.25 * sweep.masks(ours.suns).astype(bool).sum(0)
        assert np.allclose(study.shadow_hours, hours, atol=1e-6)


def test_a_peer_is_timed_and_judged(sunny):
    found = json.loads(run("--json", "--repeat", "3", *sunny).stdout)
    ours, _, peer = found["rows"]
    assert (peer["peer"], peer["name"], peer["mark"], peer["runs"]) == (
        "ladybug",
        "Sunny 3",
        100,
        3,
    )
    # The first run does not count: 0.5, 0.75 and 1 s are left.
    assert (peer["ms"], peer["min_ms"]) == (750, 500)
    assert (peer["whole_ms"], peer["whole_min_ms"]) == (1500, 1000)
    assert peer["ratio"] == pytest.approx(750 / ours["ms"])
    assert peer["ratio_of_whole"] == pytest.approx(1500 / ours["whole_ms"])
    assert peer["sun_error_deg"] == pytest.approx(1.0, abs=1e-4)
    assert peer["wrong"] > 20 * peer["near_edges"] ** 0.5 > 0
    share = (peer["wrong"] + peer["near_edges"]) / peer["compared"]
    assert peer["mean_error_hours"] == pytest.approx(8.25 * share)
    assert "ladybug" not in found["missing"]


def test_what_takes_a_minute_runs_once(sunny, monkeypatch):
    monkeypatch.setattr(tools, "_ENOUGH", 0.4)
    found = json.loads(run("--json", "--repeat", "2", *sunny).stdout)
    assert found["rows"][2]["runs"] == 1
    assert found["rows"][2]["ms"] == 250
    assert found["rows"][0]["runs"] == 2


def test_a_table_is_for_people(sunny):
    text = run("--repeat", "1", *sunny).stdout
    lines = [line for line in text.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in lines}) == 1
    assert len(lines) == 2 * (2 + 3)
    assert "| Sunny 3 " in lines[4]
    assert " 100 " in lines[4]
    assert "too small to mean anything" in text
    assert "Not measured: UMEP; pip install umep, and name it with --peer-python umep=" in text


def test_a_peer_that_is_asked_for_must_be_there(monkeypatch, capsys):
    monkeypatch.setattr("umbra_benchmarks.peer.find_spec", lambda _: None)
    with pytest.raises(SystemExit) as ended:
        main(["bench", "tools", "--quick", "--peer", "solweig"])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert "pip install solweig" in error
    assert len(error.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["tools", "--peer", "ogre"], "the peer ogre is for frame --device gl"),
        (["frame", "--device", "gl", "--peer", "umep"], "the peer umep is for tools"),
        (["study", "--peer-python", "umep=x"], "the peer umep is for tools"),
        (["study", "--peer", "none"], "--peer is for frame --device gl and tools"),
        (["tools", "--device", "gl"], "tools has no gl device"),
        (["tools", "--pictures", "x"], "--pictures is for frame --device gl"),
    ],
)
def test_options_that_do_not_fit_are_refused(arguments, part):
    result = CliRunner().invoke(command, arguments)
    assert result.exit_code == 2
    assert part in result.output


@pytest.mark.parametrize("name", NAMES)
def test_a_real_peer_answers(name):
    if find_spec(TOOLS[name].module) is None:
        pytest.skip(f"{TOOLS[name].title} is not installed ({TOOLS[name].install})")
    row = json.loads(run("--json", "--repeat", "1", "--peer", name).stdout)["rows"][2]
    assert row["peer"] == name
    assert row["ratio"] > 1
    assert row["wrong"] < 0.01 * row["compared"]
    assert row["near_edges"] < 0.1 * row["compared"]
