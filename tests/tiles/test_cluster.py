"""Tiles counted by processes: the same bytes, with workers that end and a scheduler elsewhere."""

import os
import signal
import subprocess
import sys
import time

import pytest
from support.cities import DAY, read_store

import umbra
from umbra.tiles.cluster import ClusterEngine, open_engine

distributed = pytest.importorskip("distributed")
GIVEN = {**DAY, "receivers": "top", "cell": 2.0, "extent": (84950, 446950, 85520, 447290)}
TILES = {"tiles": 100}


@pytest.fixture(scope="module")
def whole(city, tmp_path_factory):
    """Return the bytes of a run in this process."""
    folder = tmp_path_factory.mktemp("serial")
    umbra.city_study(city, out=folder, **TILES, **GIVEN)
    return read_store(folder)


def test_four_processes_write_the_same_bytes(city, whole, tmp_path):
    seen = []
    umbra.city_study(
        city, out=tmp_path, workers=4, progress=lambda *n: seen.append(n), **TILES, **GIVEN
    )
    assert read_store(tmp_path) == whole
    assert seen == [(n, 24) for n in range(25)]


def test_a_killed_workers_tiles_are_counted_again(city, whole, tmp_path):
    with open_engine(workers=2) as engine:
        killed = []

        def kill_one(job, tiles):
            for outcome in engine(job, tiles):
                if not killed:
                    killed.append(engine.processes[0])
                    os.kill(killed[0], signal.SIGKILL)
                yield outcome

        umbra.city_study(city, out=tmp_path, engine=kill_one, **TILES, **GIVEN)
        now = set(engine.processes)
    assert killed
    assert not now & set(killed)
    assert read_store(tmp_path) == whole


def start(*words):
    """Start a program of Dask as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def test_a_scheduler_in_a_process_of_its_own_counts(city, whole, tmp_path):
    told = tmp_path / "scheduler.json"
    programs = [
        start("distributed.cli.dask_scheduler", "--port", "0", "--scheduler-file", str(told),
              "--dashboard-address", ":0"),
    ]  # fmt: skip
    try:
        deadline = time.monotonic() + 60
        while not told.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        programs += [
            start("distributed.cli.dask_worker", "--scheduler-file", str(told), "--nthreads", "2",
                  "--no-dashboard", "--local-directory", str(tmp_path / "worker"))
        ]  # fmt: skip
        out = tmp_path / "out"
        umbra.city_study(city, out=out, scheduler=str(told), **TILES, **GIVEN)
        assert read_store(out) == whole
    finally:
        for program in programs[::-1]:
            program.terminate()
            program.wait(30)


class _Blind:
    """A client whose only worker answers as it is told to."""

    cluster = None

    def __init__(self, answer):
        self.answer = answer

    def wait_for_workers(self, *_, **__):
        pass

    def run(self, *_, **__):
        return {"tcp://far": self.answer}


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (("0.0.1", True), "has umbra 0.0.1"),
        ((umbra.__version__, False), "does not see"),
        (ModuleNotFoundError("umbra"), "has no umbra"),
    ],
)
def test_workers_that_cannot_count_are_named(city, tmp_path, answer, told):
    with pytest.raises(umbra.InputError, match=f"worker tcp://far {told}"):
        umbra.city_study(city, out=tmp_path, engine=ClusterEngine(_Blind(answer)), **TILES, **GIVEN)


def test_a_scheduler_that_does_not_answer_is_named(city, tmp_path, monkeypatch):
    monkeypatch.setattr("umbra.tiles.cluster._WAIT", 1.0)
    with pytest.raises(umbra.InputError, match="no Dask scheduler answers") as caught:
        umbra.city_study(city, out=tmp_path, scheduler="tcp://127.0.0.1:9", **TILES, **GIVEN)
    assert caught.value.option == "scheduler"
    with pytest.raises(umbra.InputError, match="give one of them"):
        umbra.city_study(city, out=tmp_path, workers=2, scheduler="tcp://a:1", **TILES, **GIVEN)


ENDS = """
from umbra import InputError
from umbra.tiles.cluster import open_engine

for _ in range(2):
    try:
        with open_engine(None, "nowhere"):
            pass
    except InputError as error:
        print(error.option)
"""


def test_a_program_ends_after_a_scheduler_that_does_not_answer():
    run = [sys.executable, "-c", ENDS]
    done = subprocess.run(run, capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.split() == ["scheduler"] * 2
