"""Bad input gives one line and exit status 2, and takes nothing away."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support.command import SCRIPT, VIENNA
from support.forks import start_umbra
from support.model_files import save_city, save_glb, save_obj
from support.shapes import box, moved

from umbra.machine import FIRST_RUN
from umbra.receivers import layout

on_linux = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
TOWER = {"tower": box((-2, -2, 0), (2, 2, 12))}


def test_umbra_alone_and_wrong_commands(umbra_here):
    said = umbra_here("studdy")
    assert "did you mean 'study'?" in said.refusal()
    assert "rules, sky, study, view" in umbra_here("frobnicate").refusal()
    assert "there is no option '--frob' (see" in umbra_here("--frob").refusal()
    said = umbra_here("study", "x.obj", "--recievers", "top").refusal()
    assert "there is no option '--recievers'; did you mean '--receivers'?" in said


def test_what_is_missing_is_told_all_at_once(umbra_here):
    usage = "type umbra study FILE... --date DATE --out DIR (see"
    assert (
        f"FILE..., --date DATE and --out DIR are missing; {usage}" in umbra_here("study").refusal()
    )
    said = umbra_here("study", "a.obj", "--date", "2026-03-21").refusal()
    assert f"umbra: --out DIR is missing; {usage}" in said


def test_benchmarks_that_are_not_installed_are_a_line(umbra_here, monkeypatch):
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: ())
    for arguments in (["study", "--quick"], ["--help"], []):
        said = umbra_here("bench", *arguments).refusal()
        assert "pip install './benchmarks[embree]'" in said
        assert said.count("\n") == 1
    assert "bench" in umbra_here("--help").out


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("gone.obj", None, "no such file"),
        ("plan.dwg", b"AC1027", "plan.dwg"),
        ("empty.obj", b"", "is empty"),
        ("noise.glb", b"glTF\x02\0\0\0\xff\0\0\0junk", "noise.glb"),
        ("cut.city.json", b'{"type": "CityJSON", "version": "2.0", "CityOb', "cut.city.json"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles"),
        (
            "holes.obj",
            b"v 0 0 0\nv nan 0 0\nv 0 1 0\nv 0 0 inf\nf 1 2 3\nf 1 3 4\n",
            "not finite: 2 in all (first: vertex 1)",
        ),
        ("model.ifc", b"ISO-10303-21;\nHEADER;\n", "IFC"),
    ],
)
def test_files_that_cannot_be_read(study, umbra_here, keep, tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    said = study(files=[path])
    assert words in said.refusal()
    assert name in said.err
    assert study("--json", files=[path]).refusal() == said.err
    assert umbra_here("inspect", path, "--json").refusal() == said.err
    assert keep()


@pytest.mark.parametrize(
    ("options", "day", "words"),
    [
        (["--tz", "Europe/Wien"], "2026-09-18", "did you mean Europe/Vienna"),
        (["--lat", "91"], "2026-09-18", "outside -90 to 90"),
        (["--lat", "48,2"], "2026-09-18", "48,2"),
        (["--north", "nan"], "2026-09-18", "north"),
        ([], "18.09.2026", "YYYY-MM-DD"),
        ([], "2026-02-29", "February 2026 has 28 days"),
        (["--from", "02:30", "--to", "05:00"], "2026-03-29", "jumps from 02:00 to 03:00"),
        (["--from", "02:30", "--to", "05:00"], "2026-10-25", "02:30+02:00"),
        (["--from", "17:00", "--to", "09:00"], "2026-09-18", "not after the start"),
        (["--from", "9"], "2026-09-18", "HH:MM"),
        (["--every", "9h"], "2026-09-18", "give 8h or less"),
        (["--every", "0min"], "2026-09-18", "not longer than 0"),
        (["--every", "soon"], "2026-09-18", "15min"),
        (["--cast", "Wand*"], "2026-09-18", "the file has tower"),
        (["--no-cast", "Wand*"], "2026-09-18", "the file has tower"),
        (["--no-cast", "*"], "2026-09-18", "no part is left"),
        (["--extent", "0,0,5"], "2026-09-18", "XMIN,YMIN,XMAX,YMAX"),
        (["--extent", "5,0,0,5"], "2026-09-18", "XMIN < XMAX"),
        (["--size", "40"], "2026-09-18", "COLSxROWS"),
        (["--size", "40x40"], "2026-09-18", "not both"),
        (["--cell", "0"], "2026-09-18", "larger than 0"),
        (["--cell", "1e-9"], "2026-09-18", "would fit"),
        (["--ground", "inf"], "2026-09-18", "finite"),
        (["--receivers", "roofs"], "2026-09-18", "choose ground, top"),
        (["--threads", "0"], "2026-09-18", "--threads"),
        (["--device", "tpu"], "2026-09-18", "auto, cpu, gl"),
        (["--ever", "1h"], "2026-09-18", "--every"),
        (["--date"], "2026-09-18", "--date"),
    ],
)
def test_options_that_cannot_be(study, keep, options, day, words):
    assert words in study(*options, day=day).refusal()
    assert keep()


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--receivers", "points"], "needs --points FILE;"),
        (["--receivers", "points", "--points", "none.csv"], "none.csv"),
        (["--receivers", "surfaces"], "--spacing"),
        (["--rules", "none.yaml"], "none.yaml"),
        (["--options", "none.toml"], "none.toml"),
    ],
)
def test_slips_are_told_before_a_model_is_read(study, keep, monkeypatch, options, word):
    monkeypatch.setattr("umbra.readers.read", lambda *_, **__: pytest.fail("was read"))
    cell = "1" if "surfaces" in options else None
    assert word in study(*options, cell=cell).refusal()
    assert keep()


def test_all_files_are_there_before_one_is_read(study, tower, tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.readers._load", lambda *_: pytest.fail("was read"))
    gone = tmp_path / "gone.glb"
    assert f"{gone}: no such file" in study(files=[tower, f"proposed={gone}"]).refusal()
    assert f"{tmp_path}: is a folder" in study(files=[tower, tmp_path]).refusal()


@on_linux
def test_names_that_are_no_unicode(study, tower, tmp_path):
    odd = [tmp_path / os.fsdecode(name) for name in (b"t\xff 1.obj", b"o\xff")]
    shutil.copy(tower, odd[0])
    said = study("--json", files=[odd[0], tower], out=odd[1])
    assert said.status == 0, said
    with xr.open_dataset(odd[1] / "study.nc", engine="h5netcdf") as result:
        assert "t\ufffd 1.obj sha256" in result.attrs["source"]
        assert "t\ufffd 1.obj" in result.attrs["command"]
    assert json.loads(said.out)["files"][0] == str(odd[1] / "study.nc")
    picture = tmp_path / os.fsdecode(b"p\xff.png")
    command = [SCRIPT, "render", odd[0], "--size", "40x30", "--out", picture]
    for where in ({"LC_ALL": "C"}, {"PYTHONIOENCODING": "utf-8:strict"}):
        environment = {**os.environ, **where}
        done = subprocess.run(command, capture_output=True, check=False, env=environment)
        assert done.stdout == os.fsencode(picture) + b"\n", done.stderr


def test_no_site_says_which_options_to_give(study, keep):
    assert "--lat and --lon" in study(site=[]).refusal()
    line = study(site=["--lat", "48"]).refusal()
    assert "--lon" in line
    assert "--lat" not in line.partition("give")[2]
    assert keep()


def test_parts_are_listed_where_a_pattern_matches_none(study, tmp_path):
    meshes = {name: moved(TOWER["tower"], (9 * k, 0, 0)) for k, name in enumerate("abc")}
    path = save_city(tmp_path / "town.city.json", meshes)
    line = study("--cast", "Dach*", files=[path]).refusal()
    words = "RoofSurface, WallSurface, Building, a, b, c"
    assert f"--cast Dach* matches no part; the file has {words}" in line


def test_a_raster_too_large_names_a_cell_that_fits(study, keep, monkeypatch):
    monkeypatch.setattr(layout, "find_memory", lambda: 0.45e9)
    line = study("--extent", "-100,-100,100,100", cell="0.01").refusal()
    assert "20000x20000 cells needs" in line
    assert "this process may use 0.5 GB" in line or "this process may use 0.4 GB" in line
    assert keep()
    cell = line.partition("a cell of ")[2].partition(" m ")[0]
    assert study("--extent", "-100,-100,100,100", cell=cell).status == 0


def test_an_output_folder_that_cannot_be_written(study, tower):
    for out in (tower, tower / "deeper", tower / "deeper" / "still"):
        assert str(tower) in study(out=out).refusal()
    assert tower.read_text().startswith("g tower")


def test_a_failed_run_leaves_no_folder_behind(study, tmp_path):
    study("--cast", "Wand*", out=tmp_path / "new" / "folder").refusal()
    assert not (tmp_path / "new").exists()


def test_debug_shows_where(umbra_here):
    for arguments in (["--debug", "inspect", "none.obj"], ["inspect", "none.obj", "--debug"]):
        said = umbra_here(*arguments)
        assert said.status == 2
        assert "Traceback" in said.err
        assert said.err.splitlines()[-1].startswith("umbra: none.obj: no such file")


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (MemoryError(), 1, "out of memory"),
        (RuntimeError("kernel\nfell over"), 1, "RuntimeError: kernel fell over (--debug"),
        (KeyboardInterrupt(), 2, "interrupted"),
    ],
)
def test_failed_work_is_one_line_too(umbra_here, monkeypatch, tower, error, status, words):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr("umbra.readers.read", fail)
    said = umbra_here("inspect", tower)
    assert said.status == status
    assert words in said.err
    assert said.err.count("\n") == 1
    assert not said.out


# -- a run that is ended from outside ----------------------------------------------------


def children(pid):
    """Find the processes whose parent is one."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found.append(int(status.parent.name))
    return found


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.fixture
def long_run(tmp_path):
    """Start a study that takes minutes into a folder with results; give the process."""
    folder = tmp_path / "out"
    folder.mkdir()
    for name in ("study.nc", "hours.png", "profile.png"):
        (folder / name).write_text(f"old {name}")
    meshes = {
        f"{i} {j}": moved(TOWER["tower"], (9 * i, 9 * j, 0)) for i in range(20) for j in range(20)
    }
    model = save_obj(tmp_path / "town.obj", meshes)
    command = [
        "study", model, *VIENNA, "--date", "2026-09-18", "--every", "5s", "--size",
        "2500x2500", "--receivers", "top", "--out", folder,
    ]  # fmt: skip
    running = start_umbra(*command)
    try:
        # It works once the painter has loaded its modules, at the latest.
        until = time.monotonic() + 60
        while time.monotonic() < until and not children(running.pid):
            time.sleep(0.05)
        time.sleep(1.5)
        assert running.poll() is None, running.communicate()
        yield running, folder
    finally:
        running.kill()
        running.communicate()


def check_old_results(folder):
    for name in ("study.nc", "hours.png", "profile.png"):
        assert (folder / name).read_text() == f"old {name}"


def wait_until_gone(pids):
    until = time.monotonic() + 20
    while any(map(is_running, pids)) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(map(is_running, pids))


@on_linux
def test_ctrl_c_keeps_the_old_results_and_leaves_no_process(long_run):
    running, folder = long_run
    own = children(running.pid)
    assert own
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    # A kernel that is being compiled hears nothing, and is ended from outside.
    assert running.returncode in ({2, -signal.SIGTERM} if FIRST_RUN in err else {2})
    assert not out
    assert err.replace(f"umbra: {FIRST_RUN}\n", "").count("\n") == 1
    assert "interrupted" in err
    check_old_results(folder)
    assert sorted(path.name for path in folder.iterdir()) == [
        "hours.png", "profile.png", "study.nc",
    ]  # fmt: skip
    wait_until_gone(own)


@on_linux
def test_a_killed_run_keeps_the_old_results_and_the_next_run_sweeps_up(
    long_run, umbra_alone, tower
):
    running, folder = long_run
    own = children(running.pid)
    running.kill()
    running.communicate()
    check_old_results(folder)
    assert len(list(folder.glob(".umbra*"))) == 1
    wait_until_gone(own)
    day = ["--date", "2026-09-18", "--cell", "1"]
    said = umbra_alone("study", tower, *VIENNA, *day, "--out", folder)
    assert said.status == 0, said
    assert sorted(path.name for path in folder.iterdir()) == [
        "hours.png", "profile.png", "study.nc", "study.toml",
    ]  # fmt: skip
    assert (folder / "study.nc").read_bytes()[:4] == b"\x89HDF"


# -- the command as it is installed ------------------------------------------------------


def test_the_installed_command_from_a_glb_to_pictures(tmp_path):
    path = save_glb(tmp_path / "tower.glb", TOWER)
    done = subprocess.run(
        [SCRIPT, "study", path, *VIENNA, "--date", "2026-09-18", "--every", "1h", "--cell", "0.5",
         "--out", "results"], cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done
    assert done.stderr.splitlines()[-1].startswith("On 18 September 2026 ")
    assert "note: " not in done.stderr
    files = done.stdout.splitlines()
    names = ("study.nc", "hours.png", "profile.png", "study.toml")
    assert files == [f"results/{name}" for name in names]
    for name in files[1:3]:
        assert (tmp_path / name).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert (tmp_path / name).stat().st_size > 20_000


def run_on_a_terminal(command, folder, until=None):
    """Run with a terminal as error stream; interrupt once it shows ``until``."""
    import fcntl  # noqa: PLC0415
    import struct  # noqa: PLC0415
    import termios  # noqa: PLC0415

    screen, terminal = os.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 120, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color"}
    running = subprocess.Popen(
        list(map(str, command)), stdout=subprocess.PIPE, stderr=terminal, text=True, cwd=folder,
        env=environment,
    )  # fmt: skip
    os.close(terminal)
    shown = ""
    with suppress(OSError):  # which ends the reading of a terminal that no one writes to
        while more := os.read(screen, 65536).decode():
            shown += more
            if until and until in shown:
                running.send_signal(signal.SIGINT)
                until = None
    os.close(screen)
    return running.wait(60), running.stdout.read(), shown


@on_linux
def test_a_terminal_shows_stages_and_stdout_holds_results_only(tower, tmp_path):
    tower.write_text(f"mtllib none.mtl\n{tower.read_text()}")
    # By its name alone: a long path is cut to the line.
    command = [SCRIPT, "study", tower.name, *VIENNA, "--date", "2026-09-18", "--cell", "0.5",
               "--every", "1min", "--out", "results"]  # fmt: skip
    status, out, shown = run_on_a_terminal(command, tmp_path)
    assert status == 0, shown
    rest = shown
    stages = [f"reading {tower.name}", "note: ", "preparing", "counting shadows", " of 480 suns",
              "drawing and writing"]  # fmt: skip
    for what in stages:
        assert what in rest, (what, shown)
        rest = rest.partition(what)[2]
    _, _, answer = rest.rpartition("\x1b[2K")  # the bar is gone
    assert answer.startswith("On 18 September 2026 ")
    assert answer.count("\n") == 1
    assert "\x1b[?25l" not in shown  # and the cursor never was
    assert out.splitlines() == [
        f"results/{name}" for name in ("study.nc", "hours.png", "profile.png", "study.toml")
    ]
    status, out, shown = run_on_a_terminal([*command, "--quiet", "--no-pictures"], tmp_path)
    assert (status, out, shown) == (0, "", "")


@on_linux
@pytest.mark.parametrize("stage", ["reading", "preparing", "counting", "drawing"])
def test_ctrl_c_in_any_stage_clears_the_bar(tower, tmp_path, stage):
    command = [SCRIPT, "study", tower, *VIENNA, "--date", "2026", "--cell", "0.5", "--every",
               "5min", "--receivers", "top", "--out", "results"]  # fmt: skip
    status, out, shown = run_on_a_terminal(command, tmp_path, until=stage)
    assert status == 2, shown
    assert not out
    said = "umbra: interrupted; earlier results are unchanged\r\n"
    assert shown.endswith(f"\x1b[2K\r\n{said}")
    assert not (tmp_path / "results").exists()


def test_errors_of_the_installed_command(umbra_alone, tmp_path):
    said = umbra_alone("study", tmp_path / "none.obj", *VIENNA, "--date", "2026-09-18",
                       "--out", tmp_path / "o", "--json")  # fmt: skip
    assert "no such file" in said.refusal()


def test_python_m_umbra(tower):
    command = [sys.executable, "-m", "umbra", "inspect", str(tower), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["triangles"] == 12


@pytest.mark.skipif(os.name != "posix", reason="needs a pipe that closes early")
def test_a_reader_that_leaves_early_is_no_fault(tmp_path):
    path = save_obj(
        tmp_path / "many.obj",
        {f"part {k}": moved(TOWER["tower"], (9 * k, 0, 0)) for k in range(900)},
    )
    done = subprocess.run(
        f"'{SCRIPT}' inspect '{path}' --json | head -n 1",
        shell=True, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout == "{\n"
    assert not done.stderr


def test_notes_go_to_stderr_and_results_to_stdout(umbra_here, tmp_path):
    vertices = np.vstack([TOWER["tower"][0], [[5, 5, 0], [6, 5, 0]]])
    path = save_obj(tmp_path / "t.obj", {"tower": (vertices, TOWER["tower"][1])})
    with path.open("a") as file:
        file.write("f 9 10 9\n")
    said = umbra_here("inspect", path, "--json")
    assert said.status == 0
    assert json.loads(said.out)["triangles"] >= 12


def test_files_outside_a_models_folder_are_opened_only_when_typed(umbra_here, tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "red.mtl").write_text("newmtl red\nKd 1 0 0\n")
    model = save_obj(tmp_path / "models" / "tower.obj", TOWER)
    model.write_text("mtllib ../red.mtl\nusemtl red\n" + model.read_text())
    said = umbra_here("inspect", model, "--json").json()["notes"]
    assert "material library '../red.mtl' lies outside the model's folder" in said[0]
    assert "--allow-outside" in said[0]
    assert umbra_here("inspect", model, "--allow-outside", "--json").json()["notes"] == []
    options = tmp_path / "study.toml"
    options.write_text("allow-outside = true\n")
    said = umbra_here("study", model, "--options", options).refusal()
    assert "allow-outside is typed (--allow-outside), not taken from a file" in said
