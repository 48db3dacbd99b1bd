"""The runner of damaged files: its files are the same each time, and it sees every fault."""

import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from fuzz.mutate import mutate
from fuzz.run import damage
from fuzz.seeds import make_seeds

HERE = Path(__file__).parent
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="limits are those of Linux")


@pytest.fixture(scope="module")
def seeds(tmp_path_factory):
    return make_seeds(tmp_path_factory.mktemp("seeds"))


def test_a_seed_gives_the_same_files_each_time(seeds, tmp_path):
    assert make_seeds(tmp_path) == seeds
    again = [damage(seeds, 3, number) for number in range(200)]
    assert again == [damage(seeds, 3, number) for number in range(200)]
    assert len({data for _, data in again}) > 190
    assert {name for name, _ in again} > {"dancer.glb", "small-a.obj", "town.city.json"}


def test_few_files_are_ifc_as_each_costs_a_process(seeds):
    names = Counter(damage(seeds, 0, number)[0] for number in range(1000))
    assert 1 <= names["house.ifc"] <= 10 or "house.ifc" not in seeds
    assert set(names) == set(seeds)


def test_a_file_of_any_bytes_can_be_damaged():
    dice = random.Random(1)
    for data in (b"", b"{", b"glTF", b"[[[[", b"{}", b"0", bytes(range(256))):
        for _ in range(50):
            assert isinstance(mutate(data, [data, b"other"], dice), bytes)


@on_linux
def test_the_runner_names_leaks_crashes_and_what_never_ends(tmp_path):
    command = [sys.executable, str(HERE / "run.py"), "--seconds", "300", "--count", "18"]
    done = subprocess.run(
        [*command, "--limit", "0.5", "--keep", str(tmp_path), "--target", "fuzz.planted:judge"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    assert "AttributeError: planted (planted.py:" in done.stdout
    assert "ended the process (-11)" in done.stdout
    assert "took more than 0.5 s of processor time" in done.stdout
    kept = [line.split(": ")[0] for line in done.stdout.splitlines()[:-1]]
    assert all(Path(name).exists() for name in kept)
