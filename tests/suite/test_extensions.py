"""Packages beside umbra: the five examples, installed, and packages that are broken."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.forks import run_python, run_umbra

import umbra
from umbra.cli import main
from umbra.machine import FIRST_RUN

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "extensions"
MOST_LINES = {"openness": 60, "tops": 80, "brute": 120, "raw": 40, "listing": 40}
HOUSE = """
v 0 0 0\nv 8 0 0\nv 8 6 0\nv 0 6 0\nv 0 0 7\nv 8 0 7\nv 8 6 7\nv 0 6 7
o house
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Install the examples into a folder of their own."""
    folder = tmp_path_factory.mktemp("installed")
    packages = [str(EXAMPLES / name) for name in MOST_LINES]
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation"]
    done = subprocess.run(
        [*pip, "--target", str(folder), *packages], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def house(tmp_path):
    path = tmp_path / "house.obj"
    path.write_text(HOUSE)
    return path


def run(folder, *words):
    """Run the command with the packages in a folder installed."""
    told = {**os.environ, "PYTHONPATH": str(folder)}
    return run_umbra(*words, env=told)


def run_here(*words):
    """Run the command in this process, which has no packages."""
    with pytest.raises(SystemExit) as ended:
        main(list(map(str, words)))
    assert not ended.value.code


def study(folder, house, out, *words):
    done = run(folder, "study", house, "--out", out, "--up", "z", "--json", *words)
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(out / "study.nc") as data:
        return data.load(), json.loads(done.stdout), done.stderr


@pytest.mark.parametrize("name", MOST_LINES)
def test_an_example_is_one_file_of_few_lines(name):
    (code,) = (EXAMPLES / name).glob("umbra_*.py")
    assert len(code.read_text("utf-8").splitlines()) <= MOST_LINES[name]


def test_no_source_of_umbra_names_an_example():
    words = [f"umbra_{name}" for name in MOST_LINES] + ['"openness"', "Openness"]
    for path in (ROOT / "src").rglob("*.py"):
        text = path.read_text("utf-8")
        assert not [word for word in words if word in text], path


def check_openness(data, told, folder):
    """A measure of a package has its variable, its figures and its map."""
    values = data.openness.values
    assert data.openness.attrs["units"] == "1"
    assert "solid angle" in data.openness.attrs["long_name"]
    assert np.nanmin(values) >= 0
    assert np.nanmax(values) <= 1
    assert (folder / "openness.png").stat().st_size > 5000
    assert 0 < told["measures"]["openness"]["mean"] < 1


@pytest.mark.parametrize("receivers", ["top", "215/35"])
def test_a_measure_of_a_package_has_its_variable_and_its_map(installed, house, tmp_path, receivers):
    """Of ground and surfaces the report's study shows it, below."""
    data, told, _ = study(
        installed, house, tmp_path, "--measure", "openness", "--receivers", receivers,
        "--cell", "1",
    )  # fmt: skip
    check_openness(data, told, tmp_path)


def test_the_law_of_a_wall(installed, house, tmp_path):
    """Before a wall of infinite length and height half of the upper half is free."""
    points = tmp_path / "points.csv"
    points.write_text("4,-0.001,0.001,0,-1,0\n4,3,7.001,0,0,1\n400,3,0.01,0,0,1\n")
    data, *_ = study(
        installed, house, tmp_path / "out", "--measure", "openness", "--receivers", "points",
        "--points", points,
    )  # fmt: skip
    assert data.openness.values == pytest.approx([0.5, 1, 1], abs=2e-3)


def test_tiles_measure_as_one_piece(installed, house, tmp_path):
    whole, *_ = study(
        installed, house, tmp_path / "whole", "--measure", "openness", "--receivers", "ground",
        "--cell", "1", "--extent=-8,-8,24,24", "--ground", "0",
    )  # fmt: skip
    done = run(
        installed, "study", house, "--out", tmp_path / "tiles", "--measure", "openness",
        "--receivers", "ground", "--cell", "1", "--extent=-8,-8,24,24", "--ground", "0",
        "--tiles", "8m", "--up", "z", "--report",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    tiles = xr.open_zarr(tmp_path / "tiles" / "study.zarr", zarr_format=3, chunks=None)
    assert np.array_equal(tiles.openness.values, whole.openness.values, equal_nan=True)
    assert (tmp_path / "tiles" / "openness.png").exists()
    report = (tmp_path / "tiles" / "report.html").read_text("utf-8")
    (_, (_, mean, least, most)), _ = find_section(report, "Measures")
    is_house = ((whole.x > 0) & (whole.x < 8) & (whole.y > 0) & (whole.y < 6)).transpose("y", "x")
    assert float(least) == pytest.approx(whole.openness.values[~is_house].min(), abs=1e-3)
    assert float(least) < float(mean) < float(most) <= 1
    assert report.count("data:image/png") == 1


def test_samples_a_reader_and_an_output_of_packages(installed, tmp_path):
    data, _, _ = study(
        installed, EXAMPLES / "raw" / "wall.raw", tmp_path / "out", "--receivers", "tops",
        "--measure", "sky_view_factor", "--write", "listing",
    )  # fmt: skip
    assert data.position.dims == ("sample", "xyz")
    assert data.normal.values.tolist() == [[0, 0, 1]]
    assert data.position.values[0, 2] == pytest.approx(8.1)
    assert data.attrs["receivers"] == "tops"
    assert "sky_view_factor [1]: 1" in (tmp_path / "out" / "listing.txt").read_text()


@pytest.mark.parametrize(
    ("receivers", "more"),
    [("ground", ["--cell", "1"]), ("top", ["--cell", "1"]), ("surfaces", ["--spacing", "1"])],
)
def test_a_device_of_a_package_counts_as_the_cpu(installed, house, tmp_path, receivers, more):
    common = ["--receivers", receivers, *more, "--date", "2026-03-21", "--every", "2h",
              "--lat", "48", "--lon", "16", "--no-pictures"]  # fmt: skip
    mine, *_ = study(installed, house, tmp_path / "one", *common, "--device", "brute")
    run_here("study", house, "--out", tmp_path / "two", "--up", "z", *common)
    with xr.open_dataset(tmp_path / "two" / "study.nc") as data:
        other = data.load()
    assert (mine.attrs["device"], other.attrs["device"]) == ("brute", "cpu")
    assert np.array_equal(mine.shadow_hours.values, other.shadow_hours.values, equal_nan=True)


def test_what_a_device_cannot_count_the_default_does(installed, house, tmp_path):
    data, _, said = study(
        installed, house, tmp_path / "out", "--date", "2026-03-21", "--every", "2h", "--lat", "48",
        "--lon", "16", "--no-pictures", "--device", "gl", "--receivers", "surfaces",
    )  # fmt: skip
    assert data.attrs["device"] == "cpu"
    (line,) = [line for line in said.splitlines() if "device" in line]
    assert "gl" in line
    assert "cpu" in line


def test_a_device_of_a_package_counts_pictures(installed, house, tmp_path):
    words = {}
    for device in ("brute", "cpu"):
        words[device] = [
            "render", house, "--axis-up", "z", "--eye", "30,-20,25", "--target", "4,3,2",
            "--light", "1,2,3,0", "--ground", "0", "--size", "80x60", "--device", device,
            "--out", tmp_path / f"{device}.png", "--arrays", tmp_path / f"{device}.npz",
        ]  # fmt: skip
    done = run(installed, *words["brute"])
    assert done.returncode == 0, done.stderr
    run_here(*words["cpu"])
    brute, cpu = (np.load(tmp_path / f"{device}.npz")["lit"] for device in words)
    assert np.array_equal(brute, cpu)


def test_the_help_names_what_is_installed(installed):
    text = " ".join(run(installed, "study", "--help").stdout.split())
    for name in ("openness", "tops", "brute", "listing"):
        assert name in text


def write_package(folder, name, group, entry, code, requires="umbra-shadows"):
    """Write a package as pip leaves it."""
    (folder / f"{name}.py").write_text(code)
    about = folder / f"{name}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\nRequires-Dist: {requires}\n"
    )
    (about / "entry_points.txt").write_text(f"[umbra.{group}]\n{entry}\n")


GOOD = """
from umbra.extending import Lights, Measure
class Zenith(Measure):
    name, unit, long_name = "zenith", "1", "whether the zenith is free"
    def make_lights(self, asked):
        return Lights.of(__import__("numpy").array([[0.0, 0.0, 1.0]]))
"""
BROKEN = {
    "import": "import nowhere_to_be_found\n",
    "syntax": "def (:\n",
    "kind": "Zenith = 3\n",
    "words": GOOD.replace("name, unit, long_name =", "name, unit, title ="),
}
LATE = {  # they load, and fail once they are asked
    "lights": GOOD.replace("return Lights", "raise KeyError('gone')\n        return Lights"),
    "shape": GOOD + "    def derive(self, sums, asked):\n        return [sums[0, 0]]\n",
    "check": GOOD + "    def check(self, options):\n        return options.nothing\n",
    "derive": GOOD + "    def derive(self, sums, asked):\n        return 1 / 0\n",
}


ASK = """
import sys, umbra
scene = umbra.read(sys.argv[1], up="z")
for name in sys.argv[2:]:
    try:
        umbra.shadow_study(scene, receivers="ground", cell=2, measure=name)
    except umbra.UmbraError as error:
        print(name, name in str(error), len(str(error).splitlines()))
"""


def test_broken_packages_are_refused_in_a_line_each(house, tmp_path):
    broken = BROKEN | LATE
    for how, code in broken.items():
        own = code.replace('"zenith"', f'"{how}"')
        write_package(tmp_path, f"p_{how}", "measures", f"{how} = p_{how}:Zenith", own)
    told = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = run_python("-c", ASK, house, *broken, env=told, check=True)
    assert done.stdout.splitlines() == [f"{how} True 1" for how in broken]


@pytest.mark.parametrize("how", ["import", "derive"])
def test_a_broken_package_costs_one_line(house, tmp_path, how):
    write_package(tmp_path, "broken", "measures", "zenith = broken:Zenith", (BROKEN | LATE)[how])
    done = run(
        tmp_path, "study", house, "--up", "z", "--receivers", "ground", "--cell", "2",
        "--no-pictures", "--measure", "zenith", "--out", tmp_path / "a",
    )  # fmt: skip
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert [line for line in done.stderr.splitlines() if "zenith" in line]
    assert not (tmp_path / "a" / "study.nc").exists()


def test_broken_packages_keep_no_study_from_being_made(house, tmp_path):
    for how, code in BROKEN.items():
        write_package(tmp_path, how, "measures", f"{how} = {how}:Zenith", code)
    done = run(
        tmp_path, "study", house, "--up", "z", "--receivers", "ground", "--cell", "2",
        "--no-pictures", "--measure", "sky_view_factor", "--sky-directions", "50", "--out",
        tmp_path / "out",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_a_package_that_needs_a_newer_umbra_is_told(house, tmp_path):
    write_package(tmp_path, "later", "measures", "zenith = later:Zenith", GOOD, "umbra-shadows>=99")
    asked = "--measure", "zenith", "--no-pictures"
    done = run(tmp_path, "study", house, *asked, "--out", tmp_path / "a")
    assert done.returncode == 2
    assert ">=99" in done.stderr
    assert umbra.__version__ in done.stderr


def test_of_two_packages_of_one_name_the_first_is_used(house, tmp_path):
    write_package(tmp_path, "alpha", "measures", "zenith = alpha:Zenith", GOOD)
    other = GOOD.replace("whether the zenith is free", "another")
    write_package(tmp_path, "beta", "measures", "zenith = beta:Zenith", other)
    data, _, said = study(
        tmp_path, house, tmp_path / "a", "--measure", "zenith", "--receivers", "ground",
        "--cell", "2", "--no-pictures",
    )  # fmt: skip
    assert data.zenith.attrs["long_name"] == "whether the zenith is free"
    (line,) = [line for line in said.splitlines() if "beta" in line]
    assert "alpha" in line
    assert set(np.unique(data.zenith.values)) == {0.0, 1.0}


OUTPUT = """
from umbra.extending import Output
class Half(Output):
    def write(self, study, folder):
        (folder / "half.txt").write_text("begun")
        raise KeyError("gone")
class Liar(Output):
    def write(self, study, folder):
        return ["nothing.txt"]
class Good(Output):
    def write(self, study, folder):
        (folder / "good.txt").write_text("done")
        return ["good.txt"]
"""


def test_an_output_that_fails_keeps_nothing_else_from_being_written(house, tmp_path):
    entries = "half = outs:Half\nliar = outs:Liar\ngood = outs:Good"
    write_package(tmp_path, "outs", "outputs", entries, OUTPUT)
    out = tmp_path / "out"
    done = run(
        tmp_path, "study", house, "--up", "z", "--receivers", "ground", "--cell", "2", "--measure",
        "sky_view_factor", "--sky-directions", "50", "--write", "half,liar,good,csv", "--out", out,
        "--json",
    )  # fmt: skip
    assert done.returncode == 2
    said = done.stderr.replace(f"umbra: {FIRST_RUN}\n", "").splitlines()
    (last,) = [line for line in said if line.startswith("umbra:")]
    assert "half" in last
    assert "gone" in last
    assert [line for line in done.stderr.splitlines() if "liar" in line and "nothing.txt" in line]
    names = {path.name for path in out.iterdir()}
    assert {"study.nc", "sky_view_factor.png", "good.txt", "cells.csv", "study.toml"} <= names
    assert not {"half.txt", "nothing.txt"} & names
    assert {Path(name).name for name in json.loads(done.stdout)["files"]} <= names


WRITE = """
import sys, umbra
scene = umbra.read(sys.argv[1], up="z")
study = umbra.shadow_study(scene, receivers="ground", cell=2, measure="sky_view_factor",
                           sky_directions=50)
try:
    study.write(sys.argv[2], "half", "good", pictures=False)
except umbra.InputError as error:
    print(error.option, error.format)
"""


def test_python_is_told_of_a_failed_output_when_all_is_written(house, tmp_path):
    write_package(tmp_path, "outs", "outputs", "half = outs:Half\ngood = outs:Good", OUTPUT)
    told = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = run_python("-c", WRITE, house, tmp_path / "out", env=told, check=True)
    assert done.stdout.split() == ["write", "half"]
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"study.nc", "good.txt"}


READER = """
from umbra.extending import Mesh, Part, Reader
class Tri(Reader):
    title = "one triangle"
    def read(self, data, path):
        corners = [(0, 0, 0), (4, 0, 0), (0, 4, 3)]
        return [Part("tri", "building", Mesh(corners, [(0, 1, 2)]))]
"""


@pytest.mark.parametrize("command", ["inspect", "render"])
def test_a_name_given_twice_is_told_wherever_it_is_asked(tmp_path, command):
    for name in ("alpha", "beta"):
        write_package(tmp_path, name, "readers", f"tri = {name}:Tri", READER)
    model = tmp_path / "model.tri"
    model.write_text("x")
    more = ["--out", tmp_path / "a.png", "--size", "32x24"] if command == "render" else []
    done = run(tmp_path, command, model, *more)
    assert done.returncode == 0, done.stderr
    lines = (done.stdout + done.stderr).splitlines()
    (line,) = [line for line in lines if "beta" in line]
    assert "alpha" in line


def test_words_are_those_of_the_studys_own_measures(house):
    """Another study of the process names nothing."""
    scene = umbra.read(house, up="z")
    asked = {"receivers": "ground", "cell": 4, "sky_directions": 50}
    study = umbra.shadow_study(scene, measure="sky_view_factor", **asked)
    other = umbra.shadow_study(scene, measure="sky_component", **asked)
    own = study.dataset.sky_view_factor.attrs
    assert own["units"] == "1"
    from umbra.study.attributes import find_attributes  # noqa: PLC0415

    assert find_attributes("sky_view_factor", 1, other.result.quantities) == {}
    assert find_attributes("sky_view_factor", 1, study.result.quantities) == own


PAIR = HOUSE + "".join(
    f"v {x + 12} {y} {2 * z}\n" for x, y, z in
    [(0, 0, 0), (8, 0, 0), (8, 6, 0), (0, 6, 0), (0, 0, 7), (8, 0, 7), (8, 6, 7), (0, 6, 7)]
) + """o tower
f 9 12 11 10\nf 13 14 15 16\nf 9 10 14 13\nf 10 11 15 14\nf 11 12 16 15\nf 12 9 13 16
"""  # fmt: skip


def find_section(report, words):
    """Return the rows of the report's table of a measure, and the number of its pictures."""
    (section,) = [part for part in report.split("<section") if f"<h2>{words}" in part]
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", section, re.DOTALL)
    cells = [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row, re.DOTALL) for row in rows]
    text = [[re.sub(r"<[^>]+>", "", cell) for cell in row] for row in cells]
    return text, section.count("<figure>")


@pytest.mark.parametrize(
    ("receivers", "more"), [("ground", ["--cell", "2"]), ("surfaces", ["--spacing", "3"])]
)
def test_the_report_shows_a_measure_of_a_package(installed, tmp_path, receivers, more):
    model = tmp_path / "pair.obj"
    model.write_text(PAIR)
    data, told, _ = study(
        installed, model, tmp_path / "out", "--measure", "sun_hours,openness", "--receivers",
        receivers, *more, "--proposed", "tower", "--report", "--date", "2026-03-21", "--every",
        "3h", "--lat", "48", "--lon", "16",
    )  # fmt: skip
    check_openness(data, told, tmp_path / "out")
    (heads, *rows), pictures = find_section(
        (tmp_path / "out" / "report.html").read_text("utf-8"), "Free share"
    )
    assert pictures == 1 + (tmp_path / "out" / "openness_lost.png").exists()
    assert len(heads) == 8
    figures = told["measures"]["openness"]
    lost = data.openness_lost.values
    assert figures["most_lost"] == pytest.approx(np.nanmax(lost))
    assert float(rows[0][6]) == pytest.approx(np.nanmax(lost), abs=2e-3)
    assert float(rows[0][4]) - float(rows[0][5]) == pytest.approx(float(rows[0][1]), abs=2e-3)
    if receivers == "surfaces":
        named = {row[0]: row for row in rows[1:]}
        assert set(named) == {"house", "tower"}
        parts = dict(zip(data.part.values, data.part_mean_openness.values, strict=True))
        assert float(named["house"][1]) == pytest.approx(parts["house"], abs=1e-3)
        assert named["tower"][4:] == [""] * 4  # it is not there before


KIND = """
from umbra.extending import PlacedKind, PlacedSamples
class Steps(PlacedKind):
    name, noun, spot = "steps", "steps of the path", "step"
    def place(self, scene, options):
        return PlacedSamples([(-3.0, k, 1.0) for k in range(4)], areas=[2.0] * 4)
"""


def test_a_kind_says_its_own_noun(house, tmp_path):
    write_package(tmp_path, "walk", "receivers", "steps = walk:Steps", KIND)
    study(
        tmp_path, house, tmp_path / "out", "--receivers", "steps", "--report", "--no-pictures",
        "--measure", "sun_hours,sky_view_factor", "--sky-directions", "50", "--date", "2026-03-21",
        "--every", "3h", "--lat", "48", "--lon", "16",
    )  # fmt: skip
    report = (tmp_path / "out" / "report.html").read_text("utf-8")
    (heads, *rows), _ = find_section(report, "Step by step")
    assert heads[0] == "step"
    assert [row[0] for row in rows] == ["step 1", "step 2", "step 3", "step 4"]
    (_, whole, *_), _ = find_section(report, "Sky view factor")
    assert whole[0] == "8 m² of steps of the path"


def test_a_dot_before_an_ending_is_no_part_of_its_name(tmp_path):
    write_package(tmp_path, "dotted", "readers", ".TRI = dotted:Tri", READER)
    model = tmp_path / "model.tri"
    model.write_text("x")
    done = run(tmp_path, "inspect", model, "--json")
    assert json.loads(done.stdout)["vertices"] == 3
    assert ".tri" in run(tmp_path, "inspect", "--help").stdout
    other = tmp_path / "model.unknown"
    other.write_text("x")
    assert ".tri" in run(tmp_path, "inspect", other).stderr


@pytest.mark.parametrize(
    "returned", ["[Mesh(corners, [(0, 1, 2)])]", "Mesh(corners, [(0, 1, 2)])", "None"]
)
def test_a_reader_that_returns_no_parts_is_at_fault_itself(tmp_path, returned):
    head, _, _ = READER.partition("        return")
    write_package(
        tmp_path, "meshes", "readers", "tri = meshes:Tri", f"{head}        return {returned}\n"
    )
    model = tmp_path / "model.tri"
    model.write_text("x")
    done = run(tmp_path, "inspect", model)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "'meshes'" in line
    assert "damaged" not in line


def test_the_doctor_lists_packages(tmp_path):
    write_package(tmp_path, "alpha", "measures", "zenith = alpha:Zenith", GOOD)
    write_package(tmp_path, "beta", "measures", "zenith = beta:Zenith", GOOD)
    write_package(tmp_path, "broken", "outputs", "gone = broken:Gone", BROKEN["import"])
    write_package(tmp_path, "later", "readers", ".tri = later:Tri", READER, "umbra-shadows>=99")
    write_package(tmp_path, "own", "readers", "obj = own:Tri", READER)
    added = json.loads(run(tmp_path, "doctor", "--json").stdout)["added"]
    assert {(one["package"], one["what"], one["name"], bool(one["reason"])) for one in added} == {
        ("alpha", "measure", "zenith", False), ("beta", "measure", "zenith", True),
        ("broken", "output", "gone", True), ("later", "reader", "tri", True),
        ("own", "reader", "obj", True),
    }  # fmt: skip
    assert {one["version"] for one in added} == {"1.0"}
    text = run(tmp_path, "doctor").stdout
    assert all(one["reason"] in text for one in added)


COUNTING = """
import numpy as np
from umbra.extending import PointDevice
class Dark(PointDevice):
    name, title = "dark", "dark"
    def find_hidden(self, triangles, points, normals, lights):
        print("asked", len(lights))
        return np.zeros((len(lights), len(points)), bool)
"""


def test_a_device_is_asked_once_for_all_directions_of_the_sky(house, tmp_path):
    write_package(tmp_path, "dark", "devices", "dark = dark:Dark", COUNTING)
    done = run(
        tmp_path, "render", house, "--axis-up", "z", "--size", "60x40", "--light", "1,2,3,0",
        "--style", "architectural", "--device", "dark", "--out", tmp_path / "a.png",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    asked = [int(line.split()[1]) for line in done.stdout.splitlines() if line.startswith("asked")]
    assert sorted(asked) == [1, 48]
