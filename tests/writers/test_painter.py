"""The painter's children draw what this process would, and never outlive it."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import umbra.writers.painter as painting
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.painter import Painter
from umbra.writers.picture_content import DayMap, DayShadows, Plan
from umbra.writers.profile import make_profile_sheet

pytestmark = pytest.mark.usefixtures("children")

PLAN = Plan(np.arange(30.0), np.arange(20.0), title="Painted", roofs_cover=False)
HOURS = np.linspace(0, 8, 600).reshape(20, 30)
LABELS = ["09:00", "10:00", "11:00"]


def make_shadows():
    for i in range(3):
        yield 2 * i < HOURS


def read(path):
    with Image.open(path) as image:
        return np.asarray(image)


def wait_for(is_so):
    for _ in range(400):
        if is_so():
            return True
        time.sleep(0.05)
    return False


def check_pictures(folder):
    make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0).save(folder / "hours_here.png")
    make_profile_sheet(PLAN, [DayShadows(make_shadows(), LABELS)], "CEST").save(
        folder / "profile_here.png"
    )
    for name in ("hours", "profile"):
        np.testing.assert_array_equal(
            read(folder / f"{name}.png"), read(folder / f"{name}_here.png")
        )


@pytest.fixture
def _draws_elsewhere(monkeypatch):
    def refuse(*_):
        msg = "drawn here"
        raise AssertionError(msg)

    monkeypatch.setattr(painting, "_run", refuse)


@pytest.mark.usefixtures("_draws_elsewhere")
@pytest.mark.parametrize("cores", [1, 3])
def test_the_children_draw_the_same_pictures(tmp_path, monkeypatch, cores):
    monkeypatch.setattr(painting, "count_cores", lambda: cores)
    with Painter() as painter:
        child = painter._child
        painter.draw_hours(tmp_path / "hours.png", PLAN, [DayMap(HOURS)], 8.0)
        painter.draw_profile(
            tmp_path / "profile.png", PLAN, [DayShadows(make_shadows(), LABELS)], zone="CEST"
        )
    assert child.returncode == 0
    check_pictures(tmp_path)


def test_without_a_process_it_draws_here(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise OSError

    monkeypatch.setattr(subprocess, "Popen", refuse)
    with Painter() as painter:
        painter.draw_hours(tmp_path / "hours.png", PLAN, [DayMap(HOURS)], 8.0)
        painter.draw_profile(
            tmp_path / "profile.png", PLAN, [DayShadows(make_shadows(), LABELS)], zone="CEST"
        )
    check_pictures(tmp_path)


def test_a_child_that_dies_is_replaced_by_this_process(tmp_path):
    with Painter() as painter:
        painter._child.kill()
        painter._child.wait()
        painter.draw_hours(tmp_path / "hours.png", PLAN, [DayMap(HOURS)], 8.0)
        painter.draw_profile(
            tmp_path / "profile.png", PLAN, [DayShadows(make_shadows(), LABELS)], zone="CEST"
        )
    check_pictures(tmp_path)


def test_an_error_in_the_child_is_raised_here(tmp_path):
    with Painter() as painter:
        wrong = painter.draw_hours(tmp_path / "wrong.png", PLAN, [DayMap(HOURS[:3])], 8.0)
        good = painter.draw_hours(tmp_path / "good.png", PLAN, [DayMap(HOURS)], 8.0)
        with pytest.raises(ValueError, match="the plan is"):
            wrong.result()
        good.result()
        painter._futures.remove(wrong)
    assert (tmp_path / "good.png").exists()


def draw_wrong(folder):
    with Painter() as painter:
        painter.draw_hours(folder / "wrong.png", PLAN, [DayMap(HOURS[:3])], 8.0)


def find_group(leader):
    """Return the processes of a group, its leader among them."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            pid, rest = stat.parent.name, stat.read_text().rsplit(")", 1)[1].split()
            if int(rest[2]) == leader and rest[0] not in {"Z", "X"}:
                found.append(int(pid))
    return sorted(found)


class Meeting:
    """Waits, where it is unpickled, until another one is being unpickled, too."""

    def __init__(self, mine, other):
        self.files = str(mine), str(other)

    def __reduce__(self):
        mine, other = self.files
        code = (
            f"open({mine!r}, 'w').close()\n"
            "import os, time\n"
            "end = time.monotonic() + 60\n"
            f"while not os.path.exists({other!r}):\n"
            "    assert time.monotonic() < end, 'alone'\n"
            "    time.sleep(0.01)\n"
        )
        return exec, (code,)


@pytest.mark.skipif(sys.platform != "linux", reason="forks are made on Linux alone")
def test_pictures_are_drawn_together(tmp_path, monkeypatch):
    monkeypatch.setattr(painting, "count_cores", lambda: 2)
    one, two = tmp_path / "one", tmp_path / "two"
    with Painter() as painter:
        for mine, other in ((one, two), (two, one)):
            painter.draw_hours(
                mine.with_suffix(".png"), PLAN, [DayMap(HOURS)], 8.0, Meeting(mine, other)
            )
    assert one.with_suffix(".png").exists()
    assert two.with_suffix(".png").exists()


def test_the_pictures_that_are_done_are_counted(tmp_path):
    told = []
    with Painter(advance=lambda done, of: told.append((done, of))) as painter:
        for name in ("a", "b"):
            painter.draw_hours(tmp_path / f"{name}.png", PLAN, [DayMap(HOURS)], 8.0)
    assert told == [(0, 2), (1, 2)]


class Remark:
    """Printed by the process that unpickles it, where it becomes None."""

    def __reduce__(self):
        return partial(print, flush=True), ("a library's remark",)


@pytest.mark.usefixtures("_draws_elsewhere")
def test_what_the_child_prints_does_not_mix_with_its_answers(tmp_path):
    with Painter() as painter:
        painter.draw_hours(tmp_path / "hours.png", PLAN, [DayMap(HOURS)], 8.0, Remark()).result()
        painter.draw_hours(tmp_path / "more.png", PLAN, [DayMap(HOURS)], 8.0).result()


def test_no_error_is_lost_at_the_end(tmp_path):
    with pytest.raises(ValueError, match="the plan is"):
        draw_wrong(tmp_path)


def leave_by(error, children, folder):
    with Painter() as painter:
        children.append(painter._child)
        painter.draw_hours(folder / "a.png", PLAN, [DayMap(HOURS)], 8.0).result()  # forks are made
        raise error


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_an_exception_ends_the_children(tmp_path, error):
    children = []
    with pytest.raises(error):
        leave_by(error, children, tmp_path)
    assert find_group(children[0].pid) == []
    assert children[0].returncode == (1 if os.name == "nt" else -signal.SIGKILL)


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="reads /proc")  # noqa: PTH112
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_orphan_stays_when_the_parent_ends(end):
    script = """
    import time
    import umbra.writers.painter as painting
    painting.count_cores = lambda: 3
    with painting.Painter() as painter:
        print(painter._child.pid, flush=True)
        time.sleep(60)
    """
    parent = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, stderr=-1
    )
    pid = int(parent.stdout.readline())
    assert wait_for(lambda: len(find_group(pid)) == (3 if sys.platform == "linux" else 1))
    parent.send_signal(end)
    parent.communicate()
    assert wait_for(lambda: find_group(pid) == [])


def test_neither_side_loads_more_than_it_needs():
    heavy = "{'numba', 'xarray', 'pandas', 'pyproj', 'h5py', 'scipy', 'trimesh'}"
    for modules, more in (
        ("umbra.writers.painter", "{'matplotlib'}"),
        ("umbra.writers.hours_map, umbra.writers.profile", "{'matplotlib.pyplot'}"),
    ):
        code = f"import sys, {modules}; print(({heavy} | {more}) & set(sys.modules))"
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert done.stdout == "set()\n"
