"""The current folder may be a stranger's: nothing that lies in it runs, or turns a result."""

import os
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from support.bench import borrow
from support.command import SCRIPT, VIENNA
from support.model_files import save_obj
from support.shapes import box

from umbra.calls.doctor import probe
from umbra.machine import HOME, make_command
from umbra.writers.painter import Painter

MODULES = sorted(
    name
    for name in {*sys.stdlib_module_names, *packages_distributions(), "umbra", "sitecustomize"}
    if name.isidentifier()
)
STUDY = ["study", "box.obj", *VIENNA, "--date", "2026-09-18", "--size", "24x24"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A current folder with a trap by the name of every module there is; give where they show."""
    folder, sprung = tmp_path / "strange", tmp_path / "sprung"
    folder.mkdir()
    for name in MODULES:
        trap = f"open({str(sprung)!r}, 'a').write({name!r} + ' ')\nraise SystemExit('trap')\n"
        (folder / f"{name}.py").write_text(trap)
    (folder / "matplotlibrc").write_bytes(b"text.usetex: True\nfont.size: \xff\n")
    (folder / ".numba_config.yaml").write_text(f"cache_dir: {sprung}\ndisable_jit: 1\n")
    save_obj(folder / "box.obj", {"box": box((0, 0, 0), (4, 4, 9))})
    monkeypatch.chdir(folder)
    return folder


def check_untouched(folder):
    sprung = folder.parent / "sprung"
    assert not sprung.is_dir(), "numba kept its cache where the folder said"
    assert not sprung.exists(), f"traps that sprang: {sprung.read_text()}"


@pytest.mark.parametrize(
    "command",
    [
        [*STUDY, "--out", "out", "--report", "--sheet", "--write", "csv"],
        ["render", "box.obj", "--size", "24x24", "--out", "box.png"],
        ["inspect", "box.obj", "--json"],
        ["doctor"],
    ],
    ids=lambda command: command[0],
)
def test_no_command_runs_what_lies_there(folder, command):
    done = subprocess.run([SCRIPT, *command], capture_output=True, text=True, check=False)
    assert (done.returncode, "trap" in done.stdout + done.stderr) == (0, False), done.stderr
    check_untouched(folder)


def test_settings_that_lie_there_change_no_picture(folder):
    for where in (folder, folder.parent):
        os.chdir(where)
        file = str(folder / "box.obj")
        done = subprocess.run(
            [SCRIPT, STUDY[0], file, *STUDY[2:], "--quiet", "--out", "out"],
            capture_output=True, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, b"")
    for name in ("hours.png", "profile.png"):
        one, two = (where / "out" / name for where in (folder, folder.parent))
        assert one.read_bytes() == two.read_bytes()


@pytest.mark.usefixtures("children")
def test_no_child_runs_what_lies_there(folder):
    sys.path.insert(0, "")  # as where Python is asked line by line
    try:
        with Painter() as painter:
            child = painter._child
            painter._submit(
                "umbra.writers.hours_map:make_hours_sheet", folder
            )  # which lacks its plan
            with pytest.raises(TypeError):
                painter.wait()
            assert painter._child is child
            painter._futures.clear()
        assert "trap" not in probe("egl").get("reason", "")
    finally:
        sys.path.remove("")  # this process, too, would look there for what it has not yet imported
    assert borrow("startup")._run("import json, signal; print(json.dumps(1))", []).text == "1\n"
    check_untouched(folder)


def test_no_peer_runs_what_lies_there(folder, tmp_path):
    script = tmp_path / "peer.py"
    script.write_text("import json, sys\nfor line in sys.stdin: print(line, end='', flush=True)\n")
    peer = borrow("peer")
    kind = peer.PeerKind("echo", "Echo", "json", "nothing", None, script)
    with peer.Child(kind, Path(sys.executable)) as child:
        assert child.ask(do="open") == {"do": "open"}
    check_untouched(folder)


def test_a_child_finds_this_umbra_wherever_it_lies(monkeypatch, tmp_path):
    """Installed or not, from its own folder and from one that only this process knows."""
    more = tmp_path / "more"
    more.mkdir()
    (more / "remembered.py").write_text("")
    monkeypatch.syspath_prepend(more)
    for where in (HOME.parent, HOME, more, tmp_path, Path(os.__file__).parent):
        monkeypatch.chdir(where)
        monkeypatch.setattr(sys, "path", ["", *sys.path])
        code = "import sys, json, umbra; print(umbra.__file__); print('' in sys.path)"
        done = subprocess.run(
            make_command(code), cwd=HOME, capture_output=True, text=True, check=True
        )
        assert done.stdout.split() == [str(HOME / "__init__.py"), "False"]
