"""Frames against peers in other processes: the harness, with peers that only pretend."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from umbra.cli.main import main
from umbra.errors import InputError, UmbraError
from umbra.scene import Camera
from umbra.volume.adjacency import make_caster
from umbra_benchmarks import gl_frame, peer
from umbra_benchmarks.command import PEERS as NAMES
from umbra_benchmarks.command import command
from umbra_benchmarks.measure import Spent
from umbra_benchmarks.peer import PEERS, Peer, find_python
from umbra_benchmarks.scenes import make_spheres

# It speaks the protocol by itself, prints where only answers belong when it ends, and
# notes each place of the lamp that it is asked for.
FAKE = """
import json, sys
notes = open(__file__ + ".notes", "a")
for line in sys.stdin:
    request = json.loads(line)
    if request["do"] == "open":
        assert len(request["scene"]["centres"]) == 9
        answer = {"name": "Fake 1.0", "driver": "pencil"}
    elif request["do"] == "render":
        print(request["lights"], file=notes, flush=True)
        answer = {"seconds": 0.25, "processor_seconds": 0.3}
    else:
        open(request["path"], "wb").write(b"picture")
        answer = {}
    print(json.dumps(answer), flush=True)
"""


class FakeOurs:
    """Umbra's side without OpenGL."""

    driver = "brush"
    is_software = True
    asked = None  # a list for each test

    def __init__(self, scene, size):
        assert size == 64

    def time(self, lights, *, shadows=True, moves_eye=False):
        if shadows and not moves_eye:
            self.asked.append(lights)
        return Spent(0.05, 0.06) if shadows else Spent(0.03, 0.04)

    def time_calls(self, lights):
        assert len(lights) > 1
        seconds = 0.002 if (lights[0] != lights[1]).any() else 0.001
        return Spent(seconds, seconds)

    def save(self, light, path):
        path.write_bytes(b"ours")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


@pytest.fixture
def pretend(monkeypatch, tmp_path):
    """Put pretenders in all places; give the folder of their scripts."""
    monkeypatch.setattr(FakeOurs, "asked", [])
    monkeypatch.setattr(gl_frame, "OursGl", FakeOurs)
    for name, kind in list(PEERS.items()):
        script = tmp_path / f"{name}.py"
        script.write_text(FAKE)
        monkeypatch.setitem(PEERS, name, replace(kind, script=script))
    return tmp_path


def run(*arguments):
    pythons = [word for name in NAMES for word in ("--peer-python", f"{name}={sys.executable}")]
    call = ["frame", "--device", "gl", "--quick", "--repeat", "3", *pythons, *arguments]
    result = CliRunner().invoke(command, call)
    assert result.exception is None, result.output
    return result


def test_one_object_has_all_figures(pretend):
    found = json.loads(run("--json").stdout)
    assert (found["benchmark"], found["device"]) == ("frame", "gl")
    assert (found["repeat"], found["frames"], found["quick"]) == (3, 2, True)
    assert found["machine"]
    (row,) = found["rows"]
    assert row["pixels"] == 64**2
    assert row["driver"] == "brush"
    assert row["ours_ms"] == row["ours_min_ms"] == pytest.approx(50)
    assert row["ours_processor_ms"] == pytest.approx(60)
    assert row["no_shadows_ms"] == pytest.approx(30)
    assert row["shadows_ms"] == pytest.approx(20)
    assert row["calls_ms"] == pytest.approx(2)
    assert row["still_calls_ms"] == pytest.approx(1)
    assert row["still_calls_mark_ms"] == pytest.approx(0.5)
    ogre, workbench = row["peers"]
    assert (ogre["peer"], ogre["mark"]) == ("ogre", 2)
    assert (workbench["peer"], workbench["mark"]) == ("workbench", 5)
    for each in (ogre, workbench):
        assert (each["name"], each["driver"]) == ("Fake 1.0", "pencil")
        assert each["ms"] == each["min_ms"] == pytest.approx(250)
        assert each["ratio"] == each["ratio_of_minima"] == pytest.approx(5)
        assert each["processor_ms"] == pytest.approx(300)
        assert each["ratio_of_processor"] == pytest.approx(5)


def test_all_sides_draw_the_same_places_of_the_lamp(pretend):
    run("--json")
    asked = np.array(FakeOurs.asked)
    assert asked.shape == (1 + 3, 2, 3)  # a turn that does not count, then three
    path = make_spheres(3, 8, 12).path
    assert np.array_equal(asked.reshape(-1, 3), path[:8])
    for name in NAMES:
        notes = (pretend / f"{name}.py.notes").read_text().splitlines()
        assert np.allclose([json.loads(line) for line in notes], asked)


def test_a_peer_that_is_missing_is_told_of_and_the_others_measured(pretend, monkeypatch):
    monkeypatch.setattr(peer, "find_spec", lambda _: None)
    call = ["frame", "--device", "gl", "--quick", "--repeat", "3"]
    only = [*call, "--peer-python", f"workbench={sys.executable}"]
    result = CliRunner().invoke(command, only)
    assert result.exception is None, result.output
    told = "OGRE is not installed and not measured; pip install 'ogre-python"
    assert told in result.stderr
    assert told in result.stdout.splitlines()[-1]
    assert result.stdout.count("Fake 1.0") == 1
    found = json.loads(CliRunner().invoke(command, [*call, "--json"]).stdout)
    assert [each["peer"] for each in found["missing"]] == ["ogre", "workbench"]
    assert found["rows"][0]["peers"] == []


def test_a_table_is_for_people(pretend):
    text = run().stdout
    assert "too small to mean anything" in text
    assert "brush, pencil" in text
    lines = [line for line in text.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in lines}) == 1
    assert len(lines) == 2 + 6 + 2 * 2


def test_pictures_are_saved(pretend, tmp_path):
    run("--pictures", str(tmp_path / "pictures"))
    saved = {path.name for path in (tmp_path / "pictures").iterdir()}
    assert saved == {"umbra_64.png", "ogre_64.png", "workbench_64.png"}


def test_peers_can_be_chosen(pretend):
    (row,) = json.loads(run("--json", "--peer", "workbench").stdout)["rows"]
    assert [each["peer"] for each in row["peers"]] == ["workbench"]
    (row,) = json.loads(run("--json", "--peer", "none").stdout)["rows"]
    assert row["peers"] == []


@pytest.mark.parametrize(("name", "package"), [("ogre", "ogre-python"), ("workbench", "bpy")])
def test_a_missing_peer_is_named_with_its_remedy(name, package, monkeypatch, capsys):
    monkeypatch.setattr(peer, "find_spec", lambda _: None)
    with pytest.raises(SystemExit) as ended:
        main(["bench", "frame", "--device", "gl", "--quick", "--peer", name])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert f"pip install {package}" in error or f"pip install '{package}" in error
    assert f"--peer-python {name}=PATH" in error
    assert len(error.strip().splitlines()) == 1


def test_a_peer_that_can_be_imported_is_found(monkeypatch):
    monkeypatch.setattr(peer, "find_spec", lambda module: module == "bpy" or None)
    assert str(find_python(PEERS["workbench"], {})) == sys.executable
    with pytest.raises(InputError, match="OGRE, which is not installed"):
        find_python(PEERS["ogre"], {})


def test_an_interpreter_that_is_none_is_named(tmp_path):
    with pytest.raises(InputError, match="there is no interpreter at that path"):
        find_python(PEERS["ogre"], {"ogre": tmp_path / "python"})
    with pytest.raises(InputError, match="there is no interpreter at that path"):
        find_python(PEERS["ogre"], {"ogre": tmp_path})


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["study", "--device", "gl"], "study has no gl device"),
        (["frame", "--peer", "ogre"], "the peer ogre is for frame --device gl"),
        (["frame", "--device", "gl", "--peer-python", "gimp=x"], "give PEER=PATH"),
        (["frame", "--device", "gl", "--peer-python", "ogre"], "give PEER=PATH"),
    ],
)
def test_options_that_do_not_fit_are_refused(arguments, part):
    result = CliRunner().invoke(command, arguments)
    assert result.exit_code == 2
    assert part in result.output


@pytest.mark.parametrize(
    ("script", "part"),
    [
        ("import sys; sys.exit('the display is gone')", "the display is gone"),
        ("import os; os._exit(3)", "exit status 3"),
        ("raise ModuleNotFoundError(\"No module named 'Ogre'\")", "pip install 'ogre-python"),
        ('input(); print(\'{"error": "RuntimeError: no stencil"}\')', "no stencil"),
        ("input(); print('hello')", "answers 'hello', which is no JSON"),
    ],
)
def test_a_peer_that_fails_says_why(script, part, tmp_path):
    path = tmp_path / "fails.py"
    path.write_text(script)
    kind = replace(PEERS["ogre"], script=path)
    with pytest.raises(UmbraError, match=f"OGRE .*{part}"):
        Peer(kind, sys.executable, make_spheres(3, 8, 12), 64)


def test_a_peer_that_hangs_is_given_up(tmp_path, monkeypatch):
    path = tmp_path / "hangs.py"
    path.write_text("import time; time.sleep(600)")
    monkeypatch.setattr(peer, "_PATIENCE", 0.5)
    with pytest.raises(UmbraError, match="ended while it was measured"):
        Peer(replace(PEERS["ogre"], script=path), sys.executable, make_spheres(3, 8, 12), 64)


def test_the_other_side_of_the_pipe(tmp_path):
    script = tmp_path / "square.py"
    script.write_text(
        f"""
import os, sys
sys.path.insert(0, {str(PEERS["ogre"].script.parent)!r})
from serve import serve

class Square:
    name, driver = "Square 2", "chalk"
    def __init__(self, scene, size):
        self.size = size
    def render(self, light):
        print("noise")          # a library's, in Python
        os.write(1, b"noise")   # and below it
        if light[2] < 0:
            raise ValueError("below the ground")
    def save(self, light, path):
        open(path, "w").write(str(self.size))

serve(Square)
"""
    )
    with Peer(replace(PEERS["ogre"], script=script), sys.executable, make_spheres(), 7) as square:
        assert (square.name, square.driver) == ("Square 2", "chalk")
        assert min(square.render([(0, 0, 1), (0, 0, 2)])) >= 0
        square.save((0, 0, 1), tmp_path / "picture")
        assert (tmp_path / "picture").read_text() == "7"
        with pytest.raises(UmbraError, match="ValueError: below the ground"):
            square.render([(0, 0, -1)])
        assert min(square.render([(0, 0, 1)])) >= 0


def test_the_peers_scene_is_as_said():
    scene = make_spheres()
    assert scene.faces.shape == (960, 3)
    assert scene.centres.shape == (100, 3)
    assert make_caster(scene.vertices, scene.faces).is_closed.all()
    a, b, c = (scene.vertices[scene.faces[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", a + b + c, np.cross(b - a, c - a)) > 0).all()
    assert np.allclose(np.linalg.norm(scene.vertices, axis=1), scene.radius)
    # Above the ground and below the lamp, apart, and all of them in the picture.
    assert (scene.centres[:, 2] > scene.radius).all()
    assert scene.centres[:, 2].max() + scene.radius < scene.path[:, 2].min()
    apart = np.linalg.norm(scene.centres[:, None] - scene.centres, axis=2)
    assert (apart[~np.eye(100, dtype=bool)] > 2 * scene.radius).all()
    camera = Camera(np.array(scene.eye), np.array(scene.target), size=(512, 512), fov=scene.fov)
    right, up, forward = camera.axes()
    way = scene.centres - scene.eye
    reach = (way @ forward - scene.radius) * np.tan(np.radians(scene.fov) / 2)
    for axis in (right, up):
        assert (np.abs(way @ axis) + scene.radius < reach).all()


@pytest.mark.usefixtures("opengl")
def test_umbra_draws_the_peers_scene(tmp_path):
    from umbra_benchmarks.ours_gl import OursGl  # noqa: PLC0415

    scene = make_spheres(3, 8, 12)
    with OursGl(scene, 64) as ours:
        assert ours.driver
        assert min(ours.time(scene.path[:2])) > 0
        assert min(ours.time(scene.path[:2], shadows=False)) > 0
        assert min(ours.time_calls(scene.path[:3])) > 0
        ours.save(scene.path[0], tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 100
