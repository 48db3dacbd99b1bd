"""What a whole ``umbra study`` costs besides counting: start, files, memory."""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import UmbraError
from umbra.machine import HOME, make_command
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
)
from umbra_benchmarks.scenes import SquareModel, make_town

__all__ = ["Startup", "bench_startup", "run_study", "write_obj"]

_STUDY = "from umbra.cli import main; main(sys.argv[1:])"
_READ = """
import time
from umbra.readers import read
begun = time.perf_counter()
scene = read(sys.argv[1])
print(time.perf_counter() - begun)
"""
# A process's peak is at first that of the process that started it, here a small one.
_WATCH = """
import os, subprocess, sys, time
begun = time.perf_counter()
_, status, used = os.wait4(subprocess.Popen(sys.argv[1:]).pid, 0)
seconds = time.perf_counter() - begun
print()
print(os.waitstatus_to_exitcode(status), seconds, used.ru_utime + used.ru_stime, used.ru_maxrss)
"""


@dataclass(frozen=True)
class Startup(BenchmarkReport):
    """
    The medians of whole processes with warm caches.

    Parameters
    ----------
    study_seconds, cpu_seconds : float
        Wall time and processor time of ``umbra study`` from start to exit [s].
    read_seconds : float
        Reading the file [s].
    count_seconds : float
        Counting, as the study itself says [s].
    peak_bytes : int
        Most memory of the largest process of a study of ``large``² cells.
    read_bytes : int
        Most memory of a process that reads the file and ends.
    large : int
    """

    study_seconds: float
    cpu_seconds: float
    read_seconds: float
    count_seconds: float
    peak_bytes: int
    read_bytes: int
    large: int

    @property
    def rest_seconds(self) -> float:
        """What is spent outside reading and counting [s]."""
        return self.study_seconds - self.read_seconds - self.count_seconds

    @property
    def above_bytes(self) -> int:
        """Memory above what the mesh itself needs."""
        return self.peak_bytes - self.read_bytes

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("startup") | {
            "study_seconds": self.study_seconds,
            "study_cpu_seconds": self.cpu_seconds,
            "read_seconds": self.read_seconds,
            "count_seconds": self.count_seconds,
            "rest_seconds": self.rest_seconds,
            "rest_mark_seconds": 1.5,
            "cells_a_side": self.large,
            "peak_bytes": self.peak_bytes,
            "read_bytes": self.read_bytes,
            "above_mesh_bytes": self.above_bytes,
            "above_mesh_mark_bytes": 1_500_000_000,
        }

    def to_table(self) -> str:
        """Return it in words."""
        lines = [
            ["umbra study, start to exit", f"{self.study_seconds:.2f} s", ""],
            ["... outside reading and counting", f"{self.rest_seconds:.2f} s", "1.5 s"],
            ["... on the processors", f"{self.cpu_seconds:.2f} s", ""],
            [f"memory above the mesh, {self.large}²", f"{self.above_bytes / 1e9:.2f} GB", "1.5 GB"],
        ]
        return (
            f"umbra bench startup: {self.machine}. A town of 300 boxes, whole processes.\n\n"
            + lay_out_table(["what", "figure", "mark"], lines)
        )


def bench_startup(run: BenchmarkRun) -> Startup:
    """
    Run ``umbra study`` as a user does, and measure its time and memory.

    Raises
    ------
    UmbraError
        If a study fails.
    """
    large = 128 if run.quick else 2048
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "town.obj"
        write_obj(path, make_town(30 if run.quick else 300, 500.0, 1))
        fixed = ["study", str(path), "--lat", "48.2", "--lon", "16.37", "--tz", "Europe/Vienna",
                 "--date", "2026-09-18", "--extent", "0,0,500,500", "--ground", "0", "--up", "z",
                 "--receivers", "top", "--json", "--out", str(Path(folder) / "out")]  # fmt: skip
        small = [*fixed, "--size", "64x64" if run.quick else "512x512"]
        _run(_STUDY, small)  # compiles, where that was not done before
        studies, busy, reads, counts = [], [], [], []
        for _ in range(run.repeat):
            study = _run(_STUDY, small)
            studies.append(study.seconds)
            busy.append(study.cpu_seconds)
            counts.append(json.loads(study.text)["count_seconds"])
            reader = _run(_READ, [str(path)])
            reads.append(float(reader.text))
        peak = _run(_STUDY, [*fixed, "--size", f"{large}x{large}"]).peak_bytes
    return Startup(
        run,
        study_seconds=float(np.median(studies)),
        cpu_seconds=float(np.median(busy)),
        read_seconds=float(np.median(reads)),
        count_seconds=float(np.median(counts)),
        peak_bytes=peak,
        read_bytes=reader.peak_bytes,
        large=large,
    )


@dataclass(frozen=True)
class _Process:
    seconds: float
    cpu_seconds: float
    peak_bytes: int
    text: str


def run_study(arguments: list[str]) -> _Process:
    """Run ``umbra study`` into a folder of its own, which is dropped."""
    with tempfile.TemporaryDirectory() as folder:
        return _run(_STUDY, ["study", *arguments, "--out", str(Path(folder) / "out")])


def _run(program: str, arguments: list[str]) -> _Process:
    """Run Python in a process of its own and see what it takes."""
    # Compiled modules are kept, as they are by default: else Python compiles all anew each time.
    variables = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    watched = [sys.executable, "-I", "-c", _WATCH, *make_command(program, *arguments)]
    done = subprocess.run(
        watched, cwd=HOME, capture_output=True, text=True, env=variables, check=True
    )
    text, told = done.stdout.rstrip("\n").rsplit("\n", 1)
    status, seconds, busy, peak = (float(word) for word in told.split())
    if status:
        msg = f"umbra {arguments[0]} failed: {done.stderr.strip().splitlines()[-1]}"
        raise UmbraError(msg)
    return _Process(seconds, busy, int(peak) * (1 if sys.platform == "darwin" else 1024), text)


def write_obj(path: Path, model: SquareModel) -> None:
    """Write a model as an OBJ file."""
    with path.open("w") as file:
        np.savetxt(file, model.vertices, "v %.9g %.9g %.9g")
        np.savetxt(file, model.faces + 1, "f %d %d %d")
