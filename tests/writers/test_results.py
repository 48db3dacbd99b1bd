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
from umbra.folders import unfinished_folder
from umbra.folders.atomic import KEPT, replace_results
from umbra.folders.unfinished_folder import LOCK, PREFIX, SEAL

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
    from umbra.folders.atomic import replace_results
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


def test_a_second_run_is_refused_while_the_first_lives(tmp_path):
    run = start(tmp_path, "(unfinished / 'study.nc').write_text('first run')")
    assert run.stdout.readline() == "ready\n"
    message = rf"another run \(process {run.pid}\) writes into '{tmp_path}'; wait for its end, or"
    with pytest.raises(InputError, match=message), replace_results(tmp_path):
        pytest.fail("both ran")
    run.communicate("go on\n")
    assert run.returncode == 0
    assert held(tmp_path) == {"study.nc": "first run"}
    with replace_results(tmp_path) as unfinished:
        put(unfinished, "second")
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "second")


def test_a_run_in_the_same_process_is_refused_too(tmp_path):
    with replace_results(tmp_path) as unfinished:
        put(unfinished, "first")
        with pytest.raises(InputError, match=f"process {os.getpid()}"), replace_results(tmp_path):
            pytest.fail("both ran")
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "first")


def test_without_locks_a_run_says_so_and_goes_on(tmp_path, monkeypatch):
    said = []
    monkeypatch.setattr(unfinished_folder, "take_lock", lambda _file: None)
    (tmp_path / f"{PREFIX}x").mkdir()  # of a run that may live, or not
    (tmp_path / f"{PREFIX}x" / LOCK).write_text("12 elsewhere\n")
    with replace_results(tmp_path, said.append) as unfinished:
        put(unfinished, "new")
    assert (tmp_path / NAMES[0]).read_text() == "new"
    assert len(said) == 1
    assert "has no locks" in said[0]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (b"12 elsewhere\n", "another run (process 12 on elsewhere)"),
        (b"\x1b[2J", "another run"), (b"", "another run"),
    ],
)  # fmt: skip
def test_a_lock_file_that_names_nobody_is_told_plainly(tmp_path, text, name):
    (tmp_path / LOCK).write_bytes(text)
    refusal = str(unfinished_folder.make_refusal(tmp_path / LOCK, tmp_path))
    assert refusal.startswith(f"{name} writes into")


def test_a_folder_left_half_removed_is_swept_up(tmp_path):
    (tmp_path / f"{PREFIX}x").mkdir()
    (tmp_path / f"{PREFIX}y").mkdir()
    (tmp_path / f"{PREFIX}y" / "half.nc").write_text("half")  # its lock went first
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


def test_ctrl_c_during_the_moves_waits_for_them_and_tells_the_truth(tmp_path, monkeypatch):
    put(tmp_path, "old")
    rename = Path.replace

    def interrupt(self, target):
        signal.raise_signal(signal.SIGINT)
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", interrupt)
    with (
        pytest.raises(KeyboardInterrupt, match=r"the new results in '.*' are complete"),
        replace_results(tmp_path) as unfinished,
    ):
        put(unfinished, "new")
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "new")
    with pytest.raises(KeyboardInterrupt, match=KEPT):
        fail_half_way(tmp_path, KeyboardInterrupt())


STEPS = """
import os, sys
from umbra.folders.atomic import replace_results
folder, at, number = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
steps = None

def watch(event, _):
    global steps
    if steps is not None and event.partition(".")[0] in {"os", "open", "shutil", "fcntl"}:
        steps += 1
        if steps == at:
            os.kill(os.getpid(), number)

sys.addaudithook(watch)  # it hears of every call to the system before it is made
with replace_results(folder) as unfinished:
    for name in ("study.nc", "hours.png"):
        (unfinished / name).write_text("new")
    steps = 0
print(steps)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows ends a process for any signal")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_kill_at_any_step_of_the_moves_mixes_no_results(tmp_path, number):
    found = set()
    for at in range(1, 200):
        folder = tmp_path / str(at)
        folder.mkdir()
        put(folder, "old")
        done = subprocess.run(
            [sys.executable, "-c", STEPS, folder, str(at), str(int(number))],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.stdout:
            break
        assert done.returncode == -number, done.stderr
        if number != signal.SIGKILL:
            texts = {(folder / name).read_text() for name in NAMES}
            assert len(texts) == 1, f"mixed by a signal at step {at}"
            word = KEPT if texts == {"old"} else "the new results in"
            assert number == signal.SIGTERM or word in done.stderr.splitlines()[-1]
        with replace_results(folder):
            pass  # whatever the next run makes
        texts = held(folder)
        assert len(texts) == 2, texts
        assert len(set(texts.values())) == 1, f"mixed by a kill at step {at}"
        assert {p.name for p in folder.iterdir()} == set(NAMES)
        found |= set(texts.values())
    assert at > 10
    assert found == {"old", "new"}


def test_of_runs_that_begin_at_once_no_two_write(tmp_path):
    code = """
    import sys
    from umbra.errors import InputError
    from umbra.folders.atomic import replace_results
    sys.stdin.readline()
    try:
        with replace_results(sys.argv[1]) as unfinished:
            for n in range(5):
                (unfinished / f"{n}{sys.argv[2]}.nc").write_text("")
            print("wrote", flush=True)
            sys.stdin.readline()
    except InputError as error:
        print(error, flush=True)
    """
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(code), tmp_path, name],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for name in "abcd"
    ]  # fmt: skip
    for run in runs:
        run.stdin.write("go\n")
        run.stdin.flush()
    said = [run.stdout.readline() for run in runs]
    for run in runs:
        run.communicate("go\n")
    assert said.count("wrote\n") == 1
    assert sum("writes into" in line for line in said) == 3
    assert len(held(tmp_path)) == 5


def test_a_run_that_was_killed_in_its_moves_never_overwrites_a_later_one(tmp_path):
    """The one killed is finished first."""
    for at in range(1, 200):
        with replace_results(tmp_path) as clean:  # after the last one that was killed
            put(clean, "old")
        subprocess.run(
            [sys.executable, "-c", STEPS, tmp_path, str(at), str(int(signal.SIGKILL))],
            capture_output=True, check=False,
        )  # fmt: skip
        if {(tmp_path / name).read_text() for name in NAMES} == {"old", "new"}:
            break
    else:
        pytest.fail("no kill came between the renames")
    with replace_results(tmp_path) as unfinished:
        put(unfinished, "later")
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "later")
    with replace_results(tmp_path):
        pass
    assert held(tmp_path) == dict.fromkeys(sorted(NAMES), "later")


@pytest.fixture
def elsewhere(tmp_path):
    """A folder that no run into ``out`` may touch."""
    folder = tmp_path / "elsewhere"
    (folder / "deep").mkdir(parents=True)
    (folder / "out").mkdir()
    for name in ("thesis.txt", LOCK, "deep/data.csv"):
        (folder / name).write_text("mine")
    return folder


def test_links_in_the_folder_lead_no_removal_elsewhere(tmp_path, elsewhere):
    out, kept = tmp_path / "out", held(elsewhere)
    out.mkdir()
    (out / f"{PREFIX}x").symlink_to(elsewhere)
    killed = out / f"{PREFIX}y"
    killed.mkdir()
    (killed / LOCK).write_text("")
    (killed / "frames").symlink_to(elsewhere)
    (killed / "study.nc").symlink_to(elsewhere / "thesis.txt")
    (out / f"{PREFIX}z").mkdir()
    (out / f"{PREFIX}z" / LOCK).symlink_to(elsewhere / LOCK)
    os.mkfifo(out / "pipe")
    (out / "study.nc").symlink_to(elsewhere / "thesis.txt")
    for _ in range(2):
        with replace_results(out) as unfinished:
            put(unfinished, "new")
        assert held(elsewhere) == kept
        assert not killed.exists()
    assert (out / "study.nc").read_text() == "new"
    assert not (out / "study.nc").is_symlink()
    (out / "frames").symlink_to(elsewhere / "deep")
    with pytest.raises(InputError, match=r"frames' is not a folder.*remove or rename"):
        put_deep(out)
    assert held(elsewhere) == kept


def put_deep(folder):
    with replace_results(folder) as unfinished:
        (unfinished / "frames").mkdir()
        (unfinished / "frames" / "data.csv").write_text("new")


def test_a_seal_that_another_hand_wrote_moves_nothing(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    planted = tmp_path / f"{PREFIX}x"
    planted.mkdir()
    for name, text in ((LOCK, ""), (SEAL, "64769 131"), ("thesis.txt", "theirs")):
        (planted / name).write_text(text)
    with replace_results(tmp_path):
        pass
    assert held(tmp_path) == {"thesis.txt": "mine"}


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="takes root to chown")
def test_another_users_folder_is_left_alone(tmp_path):
    theirs = tmp_path / f"{PREFIX}x"
    theirs.mkdir()
    (theirs / LOCK).write_text("")
    os.chown(theirs, 12345, 12345)
    with replace_results(tmp_path):
        pass
    assert (theirs / LOCK).exists()


@pytest.mark.parametrize("name", ["n" * 256, "nul\0l"])
def test_a_folder_whose_name_cannot_be_is_refused_in_a_line(tmp_path, name):
    with (
        pytest.raises(InputError, match=r"cannot write to the output folder.*name a folder"),
        replace_results(tmp_path / name),
    ):
        pytest.fail("the work began")
    assert not list(tmp_path.iterdir())
