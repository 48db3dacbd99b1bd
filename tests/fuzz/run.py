"""
Damage files for a given time, read them, and keep what gives neither a scene nor an error.

``make fuzz SECONDS=600``, or ``python tests/fuzz/run.py --seconds 600``. A child reads them, with
a bounded memory and processor time for each. What fails is kept under a name that says seed,
number and the file that it was made of; the same ``--seed`` makes the same files again.
"""

import argparse
import contextlib
import importlib
import json
import math
import os
import random
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from fuzz.bombs import BOMBS, are_there, read_alone
from fuzz.mutate import mutate
from fuzz.seeds import make_seeds

MEMORY = 1_500_000_000  # [byte] above what the packages take
SILENT = 120  # [s] after which a child that waits for something is ended
SLOW = (".3dm", ".gpkg", ".ifc", ".laz", ".parquet", ".shp", ".tif")
SLOW_SHARE = 0.01  # of all files: each of these costs a process, hundreds of others


def judge(path: Path) -> str:
    """Read a file and use what it holds; '' or 'refused' are right, all else is a failure."""
    import umbra  # noqa: PLC0415 - in the child, before memory is bounded
    from umbra.volume.inspection import inspect_scene  # noqa: PLC0415

    try:
        scene = umbra.read(path)
        for part in scene.parts[:20]:
            if part.material.image is not None:
                with contextlib.suppress(umbra.InputError):
                    _ = part.material.image.pixels
        if sum(part.triangles for part in scene.parts) < 5000 and len(scene.parts) < 200:
            inspect_scene(scene)
        if scene.animations:
            umbra.pose(scene, 0.5)
    except umbra.InputError as error:
        message = str(error)
        if isinstance(error.__cause__, MemoryError):
            return f"MemoryError behind: {message[:200]}"
        if "\n" in message or len(message) > 800:
            return f"InputError of {len(message)} characters: {message[:200]!r}"
        if re.search(r"\b[A-Z]\w+Error\b", message):
            return f"InputError that names a Python error: {message[:200]}"
        return "refused"
    return ""


def damage(seeds: dict[str, bytes], seed: int, number: int) -> tuple[str, bytes]:
    """Give the n-th damaged file and the name of what it was made of."""
    dice = random.Random(f"{seed} {number}")
    is_slow = dice.random() < SLOW_SHARE
    names = [name for name in seeds if name.endswith(SLOW) == is_slow]
    name = dice.choice(names or list(seeds))
    return name, mutate(seeds[name], list(seeds.values()), dice)


def read_all(seed: int, first: int, folder: Path, target: str, limit: float) -> None:
    """Read damaged files one after another, and say so line by line, until ended."""
    module, _, function = target.partition(":")
    check = getattr(importlib.import_module(module), function)
    seeds = make_seeds(folder)
    warnings.simplefilter("ignore")
    for name, data in seeds.items():  # whole files load all packages, and are right
        (folder / name).write_bytes(data)
        found = check(folder / name)
        if found:
            print(json.dumps([-1, f"the whole file {name}: {found}"]), flush=True)  # noqa: T201
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, held + MEMORY))
    number = first
    while True:
        name, data = damage(seeds, seed, number)
        path = folder / name
        path.write_bytes(data)
        print(json.dumps([number, None]), flush=True)  # noqa: T201
        signal.setitimer(signal.ITIMER_PROF, limit)  # its signal ends even what is deaf to all
        try:
            found = check(path)
        except BaseException as error:  # noqa: BLE001 - a leak of any kind is what is looked for
            last = traceback.extract_tb(error.__traceback__)[-1]
            found = f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"
        signal.setitimer(signal.ITIMER_PROF, 0)
        path.write_bytes(seeds[name])
        print(json.dumps([number, found]), flush=True)  # noqa: T201
        number += 1


class Child:
    """A process that reads damaged files from the n-th on."""

    def __init__(self, seed: int, first: int, folder: Path, target: str, limit: float) -> None:
        command = [sys.executable, __file__, "--child", "--seed", str(seed), "--first", str(first)]
        self._process = subprocess.Popen(
            [*command, "--folder", str(folder), "--target", target, "--limit", str(limit)],
            stdout=subprocess.PIPE,
            stderr=(folder / "stderr").open("wb"),
            env={**os.environ, "UMBRA_CACHE": str(folder / "cache"), "NUMBA_NUM_THREADS": "1"},
        )
        self._folder, self._limit = folder, limit
        self._rest = b""

    def hear(self, until: float) -> list[tuple[int, str | None]] | None:
        """Give what it said; None when it has ended or is silent for too long."""
        out = self._process.stdout
        assert out is not None
        wait = min(until - time.monotonic(), SILENT)
        if not select.select([out], [], [], max(wait, 0))[0]:
            return [] if time.monotonic() >= until else None
        data = os.read(out.fileno(), 1 << 16)
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [tuple(json.loads(line)) for line in lines] if data else None

    def kill(self) -> None:
        """End it: the time is over."""
        self._process.kill()
        self._process.wait()

    def end(self) -> str:
        """End it, and say how it ended."""
        status = self._process.poll()
        if status is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                status = self._process.wait(1)
        if status is None:
            self.kill()
            return f"said nothing for {SILENT} s"
        if status == -signal.SIGPROF:
            return f"took more than {self._limit:g} s of processor time"
        said = (self._folder / "stderr").read_text(errors="replace")[-300:]
        return f"ended the process ({status}): {' '.join(said.split())}"


def fuzz(given: argparse.Namespace) -> int:
    """Run children until the time is over or all are read; give the number of failures."""
    seed, keep = given.seed, given.keep
    until = time.monotonic() + given.seconds
    counts: Counter[str] = Counter()
    failures: dict[int, str] = {}
    first = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        while time.monotonic() < until and first < given.count:
            child = Child(seed, first, folder, given.target, given.limit)
            number = None
            while time.monotonic() < until and (number is None or number < given.count):
                heard = child.hear(until)
                if heard is None:
                    failures[first - 1 if number is None else number] = child.end()
                    break
                for number, found in heard:
                    if found is None:
                        continue
                    counts[found or "read"] += found in {"", "refused"}
                    if found not in {"", "refused"}:
                        failures[number] = found
            else:
                child.kill()
            first = (first if number is None else number) + 1
        keep.mkdir(parents=True, exist_ok=True)
        seeds = make_seeds(folder)
        for number, found in failures.items():
            name, data = damage(seeds, seed, number) if number >= 0 else ("whole", b"")
            path = keep / f"{seed}-{number}-{name}"
            path.write_bytes(data)
            print(f"{path}: {found}")  # noqa: T201
    tried = counts["read"] + counts["refused"] + len(failures)
    print(  # noqa: T201
        f"{tried} damaged files (seed {seed}): {counts['read']} read, {counts['refused']} refused, "
        f"{len(failures)} failed" + (f"; kept in {keep}" if failures else "")
    )
    return len(failures)


def read_bombs(keep: Path) -> int:
    """Read the files that ask for too much; keep those that get it, and give their number."""
    failures = 0
    keep.mkdir(parents=True, exist_ok=True)
    for what, (make, packages, word) in BOMBS.items():
        if not are_there(packages):
            continue
        folder = keep / f"bomb-{make.__name__.removeprefix('make_')}"
        folder.mkdir(exist_ok=True)
        path = make(folder)
        size, reading = path.stat().st_size, read_alone(path)
        fault = reading.find_fault(word)
        told = f"{reading.seconds:.1f} s, {reading.memory / 1e6:.0f} MB"
        print(f"{what} ({size:,} bytes): {fault or told}", flush=True)  # noqa: T201
        failures += bool(fault)
        if not fault:
            shutil.rmtree(folder)
    return failures


def main() -> int:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--count", type=float, default=math.inf, help="Files at most.")
    parser.add_argument("--limit", type=float, default=10, help="Processor time for a file [s].")
    parser.add_argument("--target", default="fuzz.run:judge", help=argparse.SUPPRESS)
    parser.add_argument("--bombs", action="store_true", help="First read those of bombs.py.")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--first", type=int, default=0, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        read_all(given.seed, given.first, given.folder, given.target, given.limit)
        return 0
    return min((read_bombs(given.keep) if given.bombs else 0) + fuzz(given), 1)


if __name__ == "__main__":
    sys.exit(main())
