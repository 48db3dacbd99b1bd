"""A results folder holds one whole run, old or new, whatever happens to the new one."""

import errno
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import pytest

from umbra.errors import InputError
from umbra.writers import results
from umbra.writers.results import replace_results

NAMES = ("study.nc", "hours.png")


def put(folder, text):
    for name in NAMES:
        (folder / name).write_text(text)


def fail_half_way(folder, error):
    with replace_results(folder) as unfinished:
        put(unfinished, "half")
        raise error


def held(folder):
    return {
        str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()
    }


def start(folder, code):
    """Start a run in a process of its own; it says 'ready' when ``code`` has been done."""
    script = f"""
    import sys, time
    from pathlib import Path
    from umbra.writers.results import replace_results
    with replace_results({str(folder)!r}) as unfinished:
        {code}
        print("ready", flush=True)
        sys.stdin.readline()
    """
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


WRITE_HALF = "(unfinished / 'study.nc').write_text('half')"


def test_a_first_run_makes_the_folder_with_its_parents(tmp_path):
    folder = tmp_path / "deep" / "er" / "out"
    with replace_results(folder) as unfinished:
        put(unfinished, "new")
        (unfinished / "frames").mkdir()
        (unfinished / "frames" / "0.png").write_text("new")
    assert held(folder) == {"study.nc": "new", "hours.png": "new", "frames/0.png": "new"}
    assert {p.name for p in folder.iterdir()} == {*NAMES, "frames"}


def test_results_appear_all_at_once_and_leave_the_users_files(tmp_path):
    put(tmp_path, "old")
    (tmp_path / "notes.txt").write_text("mine")
    with replace_results(tmp_path) as unfinished:
        put(unfinished, "new")
        assert unfinished.parent == tmp_path  # one file system, so that a rename is enough
        assert (tmp_path / "study.nc").read_text() == "old"
    assert held(tmp_path) == {"study.nc": "new", "hours.png": "new", "notes.txt": "mine"}


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_an_exception_keeps_the_old_results(tmp_path, error):
    put(tmp_path, "old")
    with pytest.raises(error):
        fail_half_way(tmp_path, error)
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "old")
    assert len(list(tmp_path.iterdir())) == 2


def test_a_failed_first_run_leaves_no_folder(tmp_path):
    with pytest.raises(RuntimeError):
        fail_half_way(tmp_path / "a" / "b", RuntimeError)
    assert not list(tmp_path.iterdir())


def test_a_killed_run_leaves_the_old_results_and_is_swept_up(tmp_path):
    put(tmp_path, "old")
    run = start(tmp_path, WRITE_HALF)
    assert run.stdout.readline() == "ready\n"
    run.kill()
    run.communicate()
    left = [p for p in tmp_path.iterdir() if p.is_dir()]
    assert len(left) == 1  # nobody could remove it
    assert {name: (tmp_path / name).read_text() for name in NAMES} == dict.fromkeys(NAMES, "old")

    with replace_results(tmp_path) as unfinished:
        assert not left[0].exists()
        put(unfinished, "new")
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "new")


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to one process")
def test_ctrl_c_keeps_the_old_results(tmp_path):
    put(tmp_path, "old")
    run = start(tmp_path, WRITE_HALF)
    run.stdout.readline()
    run.send_signal(signal.SIGINT)
    run.communicate()
    assert run.returncode != 0
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "old")


def test_a_live_run_is_left_alone(tmp_path):
    run = start(tmp_path, "(unfinished / 'study.nc').write_text('other run')")
    assert run.stdout.readline() == "ready\n"
    with replace_results(tmp_path) as unfinished:
        (unfinished / "hours.png").write_text("this run")
    assert (tmp_path / "hours.png").read_text() == "this run"
    run.communicate("go on\n")
    assert run.returncode == 0
    assert held(tmp_path) == {"hours.png": "this run", "study.nc": "other run"}


def test_a_folder_left_half_removed_is_swept_up(tmp_path):
    (tmp_path / f"{results.PREFIX}x").mkdir()
    with replace_results(tmp_path):
        assert len(list(tmp_path.iterdir())) == 1
    assert not list(tmp_path.iterdir())


def test_a_file_in_the_folders_place_is_refused_at_once(tmp_path):
    (tmp_path / "out").write_text("mine")
    for folder, what in (("out", "is a file, not a folder"), ("out/deeper", "not a directory")):
        folder = tmp_path / folder  # noqa: PLW2901
        with pytest.raises(InputError, match=what) as caught, replace_results(folder):
            pytest.fail("the work began")
        assert "\n" not in str(caught.value)
        assert str(folder) in str(caught.value)
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize(
    ("number", "reason"), [(errno.EACCES, "permission"), (errno.EROFS, "read-only")]
)
def test_a_folder_that_cannot_be_written_is_refused_at_once(tmp_path, monkeypatch, number, reason):
    def refuse(**_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(tempfile, "mkdtemp", refuse)
    with (
        pytest.raises(InputError, match=f"{reason}.*name a folder"),
        replace_results(tmp_path / "out"),
    ):
        pytest.fail("the work began")


def test_a_folder_that_can_never_be_made_does_not_hang(tmp_path, monkeypatch):
    def vanish(*_, **__):
        raise FileNotFoundError(errno.ENOENT, "no such file or directory")

    monkeypatch.setattr(Path, "mkdir", vanish)
    with pytest.raises(InputError, match="cannot write"), replace_results(tmp_path / "out"):
        pytest.fail("the work began")


def test_a_folder_in_a_results_place_stops_all_moves(tmp_path):
    put(tmp_path, "old")
    (tmp_path / "study.nc").unlink()
    (tmp_path / "study.nc").mkdir()
    with (
        pytest.raises(InputError, match=r"study\.nc.*remove or rename"),
        replace_results(tmp_path) as unfinished,
    ):
        put(unfinished, "new")
    assert held(tmp_path) == {"hours.png": "old"}


def test_ctrl_c_during_the_moves_waits_for_them(tmp_path, monkeypatch):
    put(tmp_path, "old")
    rename = Path.replace

    def interrupt(self, target):
        signal.raise_signal(signal.SIGINT)
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt), replace_results(tmp_path) as unfinished:
        put(unfinished, "new")
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "new")
