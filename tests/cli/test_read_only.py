"""Commands where no folder but the results' may be written to, as in a read-only container."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.model_files import save_obj
from support.shapes import box

import umbra

_MASKED = ("/tmp", "/var/tmp", "/usr/tmp")


def run_read_only(given, masked, *command):
    """Run a command with ``given`` at /mnt, without a home, and with unwritable folders."""
    steps = [f"mount --bind {given} /mnt"]
    steps += [f"mount -t tmpfs -o ro none {one}" for one in masked if Path(one).is_dir()]
    steps += ["cd /proc", 'exec "$@"']
    within = ["unshare", "--map-root-user", "--mount", "sh", "-c", " && ".join(steps), "sh"]
    # The home is a file: no folder can be made in it, by whomever.
    env = {"PATH": os.defpath, "HOME": "/etc/passwd"}
    env["PYTHONPATH"] = str(Path(umbra.__file__).parents[1])
    return subprocess.run(
        [*within, *map(str, command)], env=env, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip


@pytest.fixture
def model(tmp_path):
    """A model in a folder that stays writable."""
    if shutil.which("unshare") is None:
        pytest.skip("unshare is not installed")
    if run_read_only(tmp_path, _MASKED, "true").returncode:
        pytest.skip("this user may mount nothing, not even in a namespace")
    return save_obj(tmp_path / "house.obj", {"house": box((0, 0, 0), (4, 4, 5))})


def test_a_study_with_pictures_runs_without_a_home_and_temporary_folders(model, tmp_path):
    done = run_read_only(
        tmp_path, _MASKED, sys.executable, "-P", "-m", "umbra", "study", "/mnt/house.obj",
        "--lat", "48", "--lon", "16", "--date", "2026-03-21", "--every", "4h", "--size", "12x12",
        "--device", "cpu", "--out", "/mnt/out",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "mkdir" not in done.stderr  # of matplotlib
    assert (tmp_path / "out" / "hours.png").exists()
    assert not list(Path("/dev/shm").glob("umbra-kernels-*"))


def test_pictures_without_any_folder_are_refused_in_a_line(model, tmp_path):
    code = """
import umbra, tempfile
umbra.make_scene
try:
    import umbra.writers.hours_map
except umbra.UmbraError as error:
    print(error)
"""
    done = run_read_only(tmp_path, (*_MASKED, "/dev/shm"), sys.executable, "-P", "-c", code)
    assert done.returncode == 0, done.stderr
    assert "MPLCONFIGDIR" in done.stdout
    assert done.stdout.count("\n") == 1
