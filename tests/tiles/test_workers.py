"""Workers of this machine: no doors to others, as many as it can serve, none left behind."""

import json
import os
import signal
import socket
import subprocess
import time

import pytest
from support.cities import DAY, read_store
from support.forks import run_umbra, start_python
from support.sockets import find_doors, find_family, on_linux, run_as_nobody

import umbra
from umbra.errors import InputError
from umbra.tiles import city_options
from umbra.tiles.city_options import CityOptions
from umbra.tiles.cluster import open_engine

GIVEN = {**DAY, "receivers": "top", "cell": 2.0, "extent": (84950, 446950, 85520, 447290)}
LONG = {**GIVEN, "cell": 0.1, "every": "1min"}


def test_listening_sockets_are_seen():
    before = find_doors([os.getpid()])
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert set(find_doors([os.getpid()])) - set(before) == {port}


@on_linux
def test_workers_listen_on_nothing_and_other_users_reach_none_of_their_pipes(city, tmp_path):
    doors, others, families = [], [], []
    before = find_doors([os.getpid()])
    older = find_family(os.getpid())[1:]  # such as the browser of other tests

    def watch(job, tiles):
        for outcome in engine(job, tiles):
            family = set(find_family(os.getpid())).difference(*map(find_family, older))
            assert family >= {os.getpid(), *engine.processes}
            families.append(len(engine.processes))
            doors.extend(find_doors(family))
            if not others:
                others.extend(run_as_nobody(lambda: try_pipes(engine.processes)))
            yield outcome

    with open_engine(workers=2) as engine:
        umbra.city_study(city, out=tmp_path, engine=watch, tiles=100, **GIVEN)
    assert families == [2] * 24
    assert set(doors) == set(before)
    assert others == ["PermissionError"] * 2 * 3


def try_pipes(processes):
    """Yield how opening each worker's pipes and its memory ends."""
    for process in processes:
        for name in ("fd/0", "fd/1", "mem"):
            try:
                os.close(os.open(f"/proc/{process}/{name}", os.O_RDWR))
            except OSError as error:
                yield type(error).__name__
            else:
                yield "opened"


@pytest.mark.parametrize(
    ("cores", "memory", "most"), [(2, "64GB", 4), (16, "8GB", 8), (1, "64GB", 2)]
)
def test_workers_are_bounded_by_cores_and_by_memory(monkeypatch, cores, memory, most):
    monkeypatch.setattr(city_options, "count_cores", lambda: cores)
    monkeypatch.setattr(city_options, "find_memory", lambda: 64 * 2.0**30)
    assert CityOptions(tiles="1km", memory=memory, workers=most).workers == most
    for workers in (most + 1, 100_000, 10**30):
        with pytest.raises(InputError, match=f"give at most {most}") as caught:
            CityOptions(tiles="1km", memory=memory, workers=workers)
        assert caught.value.option == "workers"


def test_too_many_workers_are_refused_before_any_starts(city, tmp_path, monkeypatch):
    monkeypatch.setattr(subprocess, "Popen", None)
    with pytest.raises(InputError, match="workers=100000") as caught:
        umbra.city_study(city, out=tmp_path / "out", workers=100_000, tiles=100, **GIVEN)
    assert caught.value.option == "workers"
    assert not (tmp_path / "out").exists()


FAILING = """
import umbra.tiles.workers as workers
from umbra.errors import InputError
count_tile = workers.count_tile
def count(job, tile):
    if tile.number < 3:
        raise [ValueError("no luck"), InputError("no cells"), MemoryError()][tile.number]
    return count_tile(job, tile)
workers.count_tile = count
workers.serve_tiles()
"""


def test_errors_of_tiles_come_back_in_words(city, tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.tiles.workers._CODE", FAILING)
    with pytest.raises(umbra.UmbraError, match="3 of 24 tiles failed"):
        umbra.city_study(city, out=tmp_path, workers=2, tiles=100, **GIVEN)
    failed = json.loads((tmp_path / "failed.json").read_text())
    reasons = {one["tile"]: one["reason"] for one in failed}
    assert reasons == {0: "ValueError: no luck", 1: "no cells", 2: "MemoryError: "}
    assert len(list((tmp_path / "tiles").glob("*.json"))) == 21


def test_a_worker_that_always_ends_fails_its_tiles(city, tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.tiles.workers._CODE", "import os; os._exit(3)")
    with pytest.raises(umbra.UmbraError, match=r"24 of 24 tiles failed .*ended 3 times"):
        umbra.city_study(city, out=tmp_path, workers=2, tiles=100, **GIVEN)


RUN = """
import json, sys, umbra
files, out, options = json.loads(sys.argv[1])
umbra.city_study(files, out=out, tiles=100, workers=2, **options)
"""


def begin_long_run(city, folder):
    """Start a run of long tiles; return it and its workers once two tiles are done."""
    given = json.dumps([[str(path) for path in city], str(folder), LONG])
    run = start_python("-c", RUN, given)
    while count_marks(folder) < 2 and run.poll() is None:
        time.sleep(0.02)
    workers = find_family(run.pid)[1:]
    assert len(workers) == 2
    return run, workers


def count_marks(folder):
    return len(list((folder / "tiles").glob("*.json")))


def find_time(pid):
    """Return the processor time of a process [s]; 0 if it has ended."""
    try:
        with open(f"/proc/{pid}/stat") as file:  # noqa: PTH123
            fields = file.read().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return 0.0 if fields[0] == "Z" else sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def wait_for_end(pids, seconds):
    until = time.monotonic() + seconds
    while any(map(find_time, pids)) and time.monotonic() < until:
        time.sleep(0.02)
    return [pid for pid in pids if find_time(pid)]


@on_linux
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_run_in_the_midst_of_a_tile(city, tmp_path, end):
    run, workers = begin_long_run(city, tmp_path / "out")
    run.send_signal(end)
    assert wait_for_end([run.pid, *workers], 20) == []
    assert count_marks(tmp_path / "out") < 24
    assert run.communicate()[1].count("Traceback") == (end == signal.SIGINT)


def test_the_command_counts_with_workers_as_without(city, tmp_path):
    words = [
        *map(str, city), "--date", "2026-12-21", "--from", "10:00", "--to", "12:00", "--every",
        "1h", "--cell", "4", "--receivers", "top", "--tiles", "200m", "--no-pictures", "--quiet",
    ]  # fmt: skip
    for name, more in (("one", []), ("two", ["--workers", "2"])):
        run_umbra("study", *words, "--out", tmp_path / name, *more, check=True)
    assert read_store(tmp_path / "one") == read_store(tmp_path / "two")
    refused = run_umbra("study", *words, "--out", tmp_path / "none", "--workers", "100000")
    assert refused.returncode == 2
    assert refused.stderr.startswith("umbra: --workers 100000 ")
    assert refused.stderr.count("\n") == 1
