"""What memory there is: the least of the machine's, the control groups' and the process's own."""

import math
import os
import subprocess
import sys

import pytest

from umbra import machine
from umbra.machine import find_memory, name_memory

PHYSICAL = machine._find_physical()


@pytest.fixture
def groups(tmp_path, monkeypatch):
    """Control groups of the test's own: give files, and this process's line in /proc."""
    monkeypatch.setattr(machine, "_FOLDERS", tmp_path)
    monkeypatch.setattr(machine, "_GROUPS", tmp_path / "cgroup")

    def make(line, files):
        machine._find_group_limit.cache_clear()
        (tmp_path / "cgroup").write_text(line)
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(f"{text}\n")
        return machine._find_group_limit()

    yield make
    machine._find_group_limit.cache_clear()


def test_memory_is_found_where_the_system_does_not_tell_its_pages(monkeypatch):
    pytest.importorskip("psutil")
    monkeypatch.delattr(os, "sysconf")
    assert machine._find_physical() == PHYSICAL


def test_without_a_group_the_machine_is_the_limit(groups):
    assert groups("", {}) == math.inf
    assert find_memory() <= PHYSICAL
    assert groups("0::/user.slice\n", {"user.slice/memory.max": "max"}) == math.inf


def test_a_group_of_version_2_counts_and_each_that_holds_it(groups):
    line = "0::/user.slice/job_7/step\n"
    assert groups(line, {"user.slice/job_7/step/memory.max": 3e8}) == 3e8
    assert groups(line, {"user.slice/job_7/memory.max": 2e8}) == 2e8
    assert groups(line, {"memory.max": 1e8}) == 1e8  # a container's own root
    assert find_memory() == 1e8
    assert groups(line, {"unified/user.slice/memory.max": 5e7}) == 5e7


def test_a_group_of_version_1_counts_and_each_that_holds_it(groups):
    line = "9:name=systemd:/\n4:cpu,cpuacct:/a\n3:memory:/slurm/job_7\n0::/\n"
    assert groups(line, {"memory/memory.limit_in_bytes": 9223372036854771712}) > 9e18
    assert groups(line, {"memory/slurm/memory.limit_in_bytes": 4e8}) == 4e8
    assert groups(line, {"memory/slurm/job_7/memory.limit_in_bytes": 2e8}) == 2e8
    # In a container the path may be the host's, which is not there.
    line = "3:memory:/docker/0123\n"
    assert groups(line, {"memory/memory.limit_in_bytes": 1e8}) == 1e8


def test_words_tell_the_machine_from_a_limit():
    assert name_memory(PHYSICAL).startswith("this machine has ")
    assert name_memory(1.04e9) == "this process may use 1.0 GB"


@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
@pytest.mark.parametrize("name", ["RLIMIT_AS", "RLIMIT_DATA"])
def test_the_process_own_limits_count(name):
    code = f"""
    import resource, numpy as np
    from umbra.machine import find_memory
    resource.setrlimit(resource.{name}, (3_000_000_000,) * 2)
    held = find_memory()
    print(held)
    np.ones(int(0.9 * held) - 200_000_000, np.uint8)  # it is true
    """
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(map(str.strip, code.splitlines()))],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert 1e9 < float(done.stdout) <= 3e9


LOAD = """
import sys
from umbra.machine import load_compiler
load_compiler()
assert "numba" in sys.modules and "scipy.linalg" not in sys.modules
import numba
assert numba.njit(lambda n: n + 1)(1) == 2
import scipy.linalg
assert scipy.linalg.det([[2.0]]) == 2
load_compiler()  # of what is loaded nothing is taken away
assert sys.modules["scipy.linalg"] is scipy.linalg
"""


def test_the_compiler_loads_without_linear_algebra_which_can_be_loaded_later():
    subprocess.run([sys.executable, "-c", LOAD], check=True)


KERNELS = """
import numpy as np
from numba import njit, prange

@njit(cache=True)
def square(values):
    made = np.empty_like(values)
    for k in range(len(values)):
        made[k] = values[k] ** 2
    return made

@njit(cache=True, parallel=True)
def add(values):
    total = 0.0
    for k in prange(len(values)):
        total += values[k]
    return total
"""
USE = """
import sys
from umbra.machine import load_compiler
load_compiler()
import kernels, numba, numpy as np
print(kernels.add(kernels.square(np.arange(4.0))))
print({"numba.np.linalg", "scipy.linalg"} & sys.modules.keys() != set())
assert numba.njit(lambda n: np.linalg.det(np.eye(n)))(2) == 1  # now the compiler is needed
"""


def test_kernels_of_another_release_are_dropped_once(tmp_path, monkeypatch):
    monkeypatch.setattr(machine, "HOME", tmp_path)
    (tmp_path / "version.py").write_text("")
    deep = tmp_path / "cpu" / "__pycache__"
    deep.mkdir(parents=True)
    kernels = [deep / "a.nbi", deep / "a.1.nbc"]

    def compile_all():
        for one in (*kernels, deep / "a.pyc"):
            one.write_bytes(b"x")

    for release in ("1.0.0", "1.0.1"):
        monkeypatch.setattr(machine, "__version__", release)
        compile_all()
        machine._drop_older_kernels()
        assert not any(one.exists() for one in kernels)
        compile_all()
        machine._drop_older_kernels()  # they are this release's own
        assert all(one.exists() for one in kernels)
    os.utime(tmp_path / "version.py", (1, 1))  # installed again
    machine._drop_older_kernels()
    assert not any(one.exists() for one in kernels)
    assert (deep / "a.pyc").exists()


FIRST = """
import numpy as np
from umbra.volume.half_edges import sort
import umbra.kernels
for _ in range(2):
    print(sort(np.array([2, 1], np.int32), np.arange(2, dtype=np.int32)))
"""


def test_a_session_of_python_tells_once_that_it_compiles(tmp_path):
    told = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    lines = [
        subprocess.run(
            [sys.executable, "-c", FIRST], env=told, capture_output=True, text=True, check=True
        ).stderr.splitlines()
        for _ in range(2)
    ]
    assert lines == [[f"umbra: {machine.FIRST_RUN}"], []]


def test_compiled_kernels_load_without_what_the_compiler_knows(tmp_path):
    (tmp_path / "kernels.py").write_text(KERNELS)
    told = [
        subprocess.run(
            [sys.executable, "-c", USE], cwd=tmp_path, capture_output=True, text=True, check=True
        ).stdout
        for _ in range(2)
    ]
    assert told == ["14.0\nTrue\n", "14.0\nFalse\n"]
