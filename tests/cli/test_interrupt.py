"""Ctrl-C ends a command in time, also where a library is deaf to it; results stay whole."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from contextlib import suppress
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from fuzz.bombs import make_endless, save_footprints
from support.command import SCRIPT, VIENNA
from support.forks import run_umbra, start_python, start_umbra
from support.gml_files import building as gml_building
from support.gml_files import city as gml_city
from support.model_files import save_city, save_obj
from support.shapes import box

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows has no fork")

INTERRUPTED = {2, -signal.SIGTERM}
"""How a command ends: by itself, or deaf by the process that stands by."""
DEAF = 100  # [s] that a library hears nothing, far more than the time out of the tests
IN_TIME = 60  # [s]; two on a machine that does nothing else

# One instruction of Python's, as a call of a library that does not come back.
SPIN = """
import itertools, collections, sys

def spin(*_):
    print("deaf", file=sys.stderr, flush=True)
    collections.deque(itertools.repeat(0, 10**11), maxlen=0)

"""


def interrupt(start, command, until):
    """Send SIGINT to a command when ``until(process)`` is true; return it, ended."""
    with start(*command) as run:
        try:
            until(run)
            assert run.poll() is None, "it ended before it was interrupted"
            run.send_signal(signal.SIGINT)
            out, err = run.communicate(timeout=IN_TIME)
        finally:
            run.kill()
    assert "Traceback" not in err
    return run.returncode, out, err


def spend(run, seconds):
    """Wait until a command and its reading child have taken so much processor time from now."""
    begun = find_used(run.pid)
    while run.poll() is None and find_used(run.pid) < begun + seconds:
        time.sleep(0.01)


def find_used(pid):
    """Return the processor time of a process and its children [s]; elsewhere the clock's."""
    if sys.platform != "linux":
        return time.monotonic()
    used = 0
    with suppress(OSError):
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        for process in (pid, *children):
            with suppress(OSError):
                fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
                used += int(fields[11]) + int(fields[12])
    return used / os.sysconf("SC_CLK_TCK")


def run_deaf(folder, patch, *arguments):
    """Interrupt the command line once a function of it has said that it is deaf."""
    script = folder / "deaf.py"
    last = f"sys.argv = {['umbra', *map(str, arguments)]!r}\nfrom umbra.cli import main\nmain()\n"
    script.write_text(SPIN + textwrap.dedent(patch) + last)

    def until(run):
        for line in run.stderr:
            if line == "deaf\n":
                break
        if "spin" in patch:
            spend(run, 0.3)  # until it is at work

    return interrupt(start_python, [script], until)


@pytest.fixture
def house(tmp_path):
    return save_obj(tmp_path / "house.obj", {"house": box((0, 0, 0), (3, 3, 3))})


def test_a_reader_that_is_deaf_is_ended(tmp_path, house):
    patch = "import umbra.readers\numbra.readers.load_reader = lambda kind: spin\n"
    status, out, err = run_deaf(tmp_path, patch, "inspect", house)
    assert status == -signal.SIGTERM
    assert not out
    assert err == "umbra: interrupted\n"


def test_a_writer_that_is_deaf_is_ended_and_leaves_the_earlier_results(tmp_path, house):
    out = tmp_path / "out"
    command = ["study", house, *VIENNA, "--date", "2026-03-21", "--cell", "1", "--no-pictures",
               "--out", out]  # fmt: skip
    run_umbra(*command, check=True)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    patch = """
    import umbra.writers.output_formats as formats
    from dataclasses import replace
    formats.FORMATS["csv"] = replace(formats.FORMATS["csv"], write=spin)
    """
    status, *_ = run_deaf(tmp_path, patch, *command, "--write", "csv")
    assert status == -signal.SIGTERM
    after = {path.name: path.read_bytes() for path in out.iterdir() if path.is_file()}
    assert after == before
    run_umbra(*command, check=True)
    assert {path.name for path in out.iterdir()} == set(before)


def test_one_that_listens_cleans_up_by_itself(tmp_path, house):
    out = tmp_path / "out"
    patch = """
    import time, umbra.writers.output_formats as formats
    from dataclasses import replace

    def wait(*_):
        print("deaf", file=sys.stderr, flush=True)
        try:
            time.sleep(100)
        finally:
            time.sleep(2)  # as on a machine too busy to let it end sooner

    formats.FORMATS["csv"] = replace(formats.FORMATS["csv"], write=wait)
    """
    command = ["study", house, *VIENNA, "--date", "2026-03-21", "--cell", "1", "--no-pictures",
               "--out", out]  # fmt: skip
    status, _, err = run_deaf(tmp_path, patch, *command, "--write", "csv")
    assert status == 2
    assert "interrupted" in err
    assert not out.exists()


def test_nothing_stands_by_when_a_command_has_ended(tmp_path, house):
    with subprocess.Popen([str(SCRIPT), "inspect", str(house)], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, start_new_session=True) as run:  # fmt: skip
        run.communicate(timeout=100)  # comes back when nobody holds the streams
    with pytest.raises(ProcessLookupError):
        os.killpg(run.pid, 0)


def save_many_obj(folder):
    path = save_obj(folder / "many.obj", {"a": box((0, 0, 0), (3, 3, 3))})
    lines = path.read_text().splitlines()
    vertices = [line for line in lines if line[0] == "v"]
    faces = [
        "f " + " ".join(str(int(n) - len(vertices) - 1) for n in line.split()[1:])
        for line in lines
        if line[0] == "f"
    ]
    path.write_text("\n".join([*vertices, *faces, ""]) * 90_000)
    return path


def save_many_buildings(folder):
    path = save_city(folder / "town.city.json", {"house": box((0, 0, 0), (3, 3, 3))})
    tree = json.loads(path.read_text())
    (house,) = tree["CityObjects"].values()
    tree["CityObjects"] = {f"house {n}": house for n in range(36_000)}
    path.write_text(json.dumps(tree))
    return path


def save_many_members(folder):
    path = folder / "town.gml"
    path.write_text(gml_city(*[gml_building()] * 15_000))
    return path


def save_many_squares(folder):
    square = [[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]]
    one = {"type": "Feature", "properties": {"height": 9.0},
           "geometry": {"type": "Polygon", "coordinates": square}}  # fmt: skip
    path = folder / "squares.geojson"
    text = ",".join([json.dumps(one)] * 180_000)
    path.write_text('{"type": "FeatureCollection", "features": [' + text + "]}")
    return path


def save_many_footprints(folder):
    pytest.importorskip("pyogrio")
    return save_footprints(folder / "many.gpkg", height=np.full(60_000, 9.0))


def save_large_raster(folder):
    rasterio = pytest.importorskip("rasterio")
    heights = np.random.default_rng(0).uniform(0, 9, (2400, 2400)).astype(np.float32)
    path = folder / "land.tif"
    with rasterio.open(path, "w", driver="GTiff", width=2400, height=2400, count=1,
                       dtype="float32", compress="deflate", crs="EPSG:25832",
                       transform=rasterio.Affine(1, 0, 0, 0, -1, 0)) as file:  # fmt: skip
        file.write(heights, 1)
    return path


def save_many_points(folder):
    laspy = pytest.importorskip("laspy")
    pytest.importorskip("lazrs")
    cloud = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    cloud.header.scales = [0.01] * 3
    cloud.x, cloud.y, cloud.z = np.random.default_rng(0).uniform(0, 900, (3, 3_600_000))
    cloud.write(folder / "points.laz")
    return folder / "points.laz"


def save_many_meshes(folder):
    import rhino3dm as rhino  # noqa: PLC0415 - an extra

    file, mesh = rhino.File3dm(), rhino.Mesh()
    for corner in ((0, 0, 0), (3, 0, 0), (0, 3, 0)):
        mesh.Vertices.Add(*corner)
    mesh.Faces.AddFace(0, 1, 2)
    for _ in range(12_000):
        file.Objects.AddMesh(mesh)
    file.Write(str(folder / "meshes.3dm"), 7)
    return folder / "meshes.3dm"


def save_with(maker, package):
    def save(folder):
        pytest.importorskip(package)
        return maker(folder)

    return save


FAMILIES = {
    "OBJ": save_many_obj,
    "CityJSON": save_many_buildings,
    "CityGML": save_with(save_many_members, "lxml"),
    "GeoJSON": save_many_squares,
    "GeoPackage": save_many_footprints,
    "GeoTIFF": save_large_raster,
    "LAZ": save_many_points,
    "Rhino": save_with(save_many_meshes, "rhino3dm"),
    "IFC": save_with(make_endless, "ifcopenshell"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="processor time is looked up as on Linux")
@pytest.mark.parametrize(("family", "seconds"), [*zip(FAMILIES, cycle([0.6, 1.0]))])
def test_ctrl_c_ends_every_reader(tmp_path_factory, family, seconds):
    folder = tmp_path_factory.getbasetemp() / family
    folder.mkdir(exist_ok=True)
    (path, *_) = [*folder.iterdir()] or [FAMILIES[family](folder)]
    command = ["inspect", path, "--no-cache"]
    status, out, err = interrupt(start_umbra, command, partial(spend, seconds=seconds))
    assert status in INTERRUPTED
    assert not out
    assert err.splitlines()[-1].startswith("umbra: interrupted")


def test_while_modules_load_it_ends_at_once_without_their_stack():
    told = """
    import signal, sys

    class Interrupting:
        def find_spec(self, name, *_):
            if name == "umbra.cli.terminal":
                signal.raise_signal(signal.SIGINT)

    sys.meta_path.insert(0, Interrupting())
    import umbra.cli
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(told)],
        capture_output=True, text=True, timeout=IN_TIME, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
