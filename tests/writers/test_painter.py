"""The painter's child draws what this process would, and never outlives it."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from functools import partial

import numpy as np
import pytest
from PIL import Image

from umbra.writers.hours import make_hours_sheet
from umbra.writers.painter import Painter
from umbra.writers.plan import DayMap, DayShadows, Plan
from umbra.writers.profile import make_profile_sheet

PLAN = Plan(np.arange(30.0), np.arange(20.0), title="Painted", roofs_cover=False)
HOURS = np.linspace(0, 8, 600).reshape(20, 30)
LABELS = ["09:00", "10:00", "11:00"]


def make_shadows():
    for i in range(3):
        yield 2 * i < HOURS


def read(path):
    with Image.open(path) as image:
        return np.asarray(image)


def is_running(pid):
    """Whether a process runs; a dead one that nobody has waited for does not."""
    try:
        os.kill(pid, 0)
        with open(f"/proc/{pid}/stat") as file:  # noqa: PTH123
            return file.read().rsplit(")", 1)[1].split()[0] not in {"Z", "X"}
    except (ProcessLookupError, FileNotFoundError):
        return False


def wait_until_gone(pid):
    for _ in range(400):
        if not is_running(pid):
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


def test_the_child_draws_the_same_pictures(tmp_path):
    with Painter() as painter:
        child = painter._child
        painter.draw_hours(tmp_path / "hours.png", PLAN, [DayMap(HOURS)], 8.0)
        painter.draw_profile(
            tmp_path / "profile.png", PLAN, [DayShadows(make_shadows(), LABELS)], zone="CEST"
        )
    assert child is not None
    assert painter._child is child  # it drew; nothing fell back to this process
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


class Remark:
    """Printed by the process that unpickles it, where it becomes None."""

    def __reduce__(self):
        return partial(print, flush=True), ("a library's remark",)


def test_what_the_child_prints_does_not_mix_with_its_answers(tmp_path):
    with Painter() as painter:
        child = painter._child
        painter.draw_hours(tmp_path / "hours.png", PLAN, [DayMap(HOURS)], 8.0, Remark()).result()
        painter.draw_hours(tmp_path / "more.png", PLAN, [DayMap(HOURS)], 8.0).result()
        assert painter._child is child  # it is still there, and it understood


def test_no_error_is_lost_at_the_end(tmp_path):
    with pytest.raises(ValueError, match="the plan is"):
        draw_wrong(tmp_path)


def leave_by(error, children):
    with Painter() as painter:
        children.append(painter._child)
        raise error


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_an_exception_ends_the_child(error):
    children = []
    with pytest.raises(error):
        leave_by(error, children)
    assert children[0].returncode == (1 if os.name == "nt" else -signal.SIGKILL)


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="reads /proc")  # noqa: PTH112
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_orphan_stays_when_the_parent_ends(end):
    script = """
    import time
    from umbra.writers.painter import Painter
    with Painter() as painter:
        print(painter._child.pid, flush=True)
        time.sleep(60)
    """
    parent = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, stderr=-1
    )
    pid = int(parent.stdout.readline())
    assert is_running(pid)
    parent.send_signal(end)
    parent.communicate()
    assert wait_until_gone(pid)


def test_neither_side_loads_more_than_it_needs():
    heavy = "{'numba', 'xarray', 'pandas', 'pyproj', 'h5py', 'scipy', 'trimesh'}"
    for modules, more in (
        ("umbra.writers.painter", "{'matplotlib'}"),
        ("umbra.writers.hours, umbra.writers.profile", "{'matplotlib.pyplot'}"),
    ):
        code = f"import sys, {modules}; print(({heavy} | {more}) & set(sys.modules))"
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert done.stdout == "set()\n"
