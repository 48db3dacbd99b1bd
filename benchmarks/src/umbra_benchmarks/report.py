"""What a benchmark says: rows of medians and ratios, for people and as JSON."""

import os
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from umbra.machine import count_cores
from umbra_benchmarks.measure import Timing

__all__ = [
    "BenchmarkReport",
    "BenchmarkRun",
    "Report",
    "Row",
    "SecondPeer",
    "describe_machine",
    "lay_out_table",
    "name_version",
    "show_timing",
]


@dataclass(frozen=True)
class BenchmarkRun:
    """
    How to run a benchmark: ``bench_NAME(run)`` of module ``NAME`` returns its report.

    Parameters
    ----------
    repeat : int
        Runs behind each median.
    quick : bool
        Whether to take small sizes, which only show that it runs.
    threads : int
        Threads of umbra's runs on more than one.
    peers : sequence of str, optional
        The peers to measure; by default all that are installed or named in ``pythons``.
    pythons : dict of Path
        Interpreters that have a peer's package, by the peer's name.
    pictures : Path, optional
        A folder for the pictures of each side.
    models : sequence of Path
        Files to measure besides the benchmark's own scenes.
    triangles : sequence of int
        For gpu: sizes of the only towns to measure.
    say : callable
        Told what is measured next, and what cannot be.
    """

    repeat: int
    quick: bool
    threads: int = 2
    peers: Sequence[str] | None = None
    pythons: Mapping[str, Path] = field(default_factory=dict)
    pictures: Path | None = None
    models: Sequence[Path] = ()
    triangles: Sequence[int] = ()
    say: Callable[[str], object] = lambda _: None


def describe_machine() -> str:
    """Name the processor and how many of its cores there are."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    cores = count_cores()
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{cores} {'core' if cores == 1 else 'cores'} of {name}{load}"


@dataclass(frozen=True)
class BenchmarkReport:
    """
    What the reports of all benchmarks share.

    Parameters
    ----------
    run : BenchmarkRun
    machine : str
        The processor and its load when the benchmark ended.
    """

    run: BenchmarkRun
    machine: str = field(default_factory=describe_machine, kw_only=True)

    def head(self, benchmark: str, **facts: Any) -> dict[str, Any]:
        """Return the first entries of the JSON object."""
        return {
            "benchmark": benchmark,
            "umbra": name_version("umbra-shadows"),
            "machine": self.machine,
            "repeat": self.run.repeat,
            "quick": self.run.quick,
            **facts,
        }

    @property
    def small(self) -> str:
        """A warning that the sizes are small, if they are."""
        return " Sizes are too small to mean anything (--quick)." if self.run.quick else ""


@dataclass(frozen=True)
class SecondPeer:
    """
    A second peer's time for the work of a row, on one thread.

    Parameters
    ----------
    name : str
    timing : Timing
    mark : float, optional
        The ratio to reach.
    differ : int
        Answers that differ from the first peer's.
    """

    name: str
    timing: Timing
    mark: float | None
    differ: int

    def to_dict(self, ours: Timing) -> dict[str, Any]:
        """Return numbers for programs, beside umbra's time; times in ms."""
        return {
            "second_peer": self.name,
            **self.timing.to_ms("second_"),
            "second_ratio": self.timing.median / ours.median,
            "second_ratio_of_minima": self.timing.least / ours.least,
            "second_mark": self.mark,
            "second_disagreements": self.differ,
        }

    def to_cells(self, ours: Timing) -> list[str]:
        """Return the cells of a row in a table: time, ratio, mark."""
        return [
            show_timing(self.timing),
            _round(self.timing.median / ours.median),
            "" if self.mark is None else f"{self.mark:g}",
        ]


@dataclass(frozen=True)
class Row:
    """
    One piece of work, done by umbra and a peer.

    Parameters
    ----------
    work : str
    ours, peer : Timing
        On one thread each.
    ours_threads : Timing
        umbra on more threads.
    mark : float, optional
        The ratio to reach.
    differ, of : int
        Answers that differ from the peer's, and how many were compared.
    facts : dict, optional
        More to say in JSON.
    second : SecondPeer, optional
        Another peer's time for the same work on one thread.
    """

    work: str
    ours: Timing
    peer: Timing
    ours_threads: Timing
    mark: float | None
    differ: int
    of: int
    facts: dict[str, Any] | None = None
    second: SecondPeer | None = None

    @property
    def ratio(self) -> float:
        """How many times longer the peer takes."""
        return self.peer.median / self.ours.median

    def to_dict(self) -> dict[str, Any]:
        """Return numbers for programs; times in ms."""
        return {
            "work": self.work,
            **self.ours.to_ms("ours_"),
            **self.ours_threads.to_ms("ours_threads_"),
            **self.peer.to_ms("peer_"),
            "ratio": self.ratio,
            "ratio_of_minima": self.peer.least / self.ours.least,
            "speed_up": self.ours.median / self.ours_threads.median,
            "mark": self.mark,
            "disagreements": self.differ,
            "compared": self.of,
            **(self.second.to_dict(self.ours) if self.second is not None else {}),
            **(self.facts or {}),
        }


@dataclass(frozen=True)
class Report(BenchmarkReport):
    """The result of a benchmark against one peer, ``peer`` being its name and version."""

    benchmark: str
    peer: str
    rows: Sequence[Row]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        rows = [row.to_dict() for row in self.rows]
        return self.head(self.benchmark, peer=self.peer, threads=self.run.threads, rows=rows)

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        mine = f"umbra {self.run.threads} threads"
        seconds = {row.second.name for row in self.rows if row.second is not None}
        head = [
            "work", "umbra ms (min)", f"{self.peer} ms (min)", "ratio", "of minima", "mark",
            *(cell for name in seconds for cell in (f"{name}, ms (min)", "ratio", "mark")),
            f"{mine} ms (min)", "speed-up", "differ",
        ]  # fmt: skip
        lines = [
            [
                row.work,
                show_timing(row.ours),
                show_timing(row.peer),
                _round(row.ratio),
                _round(row.peer.least / row.ours.least),
                "" if row.mark is None else f"{row.mark:g}",
                *(row.second.to_cells(row.ours) if row.second is not None else ()),
                show_timing(row.ours_threads),
                f"{row.ours.median / row.ours_threads.median:.2f}",
                f"{row.differ} of {row.of:,}",
            ]
            for row in self.rows
        ]
        return (
            f"umbra bench {self.benchmark}: {self.machine}. Medians of {self.run.repeat} "
            f"runs in turn, one thread on both sides unless said.{self.small}\n\n"
            f"{lay_out_table(head, lines)}"
        )


def lay_out_table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table with its columns aligned."""
    widths = [max(map(len, column)) for column in zip(head, *lines, strict=True)]
    rule = ["-" * width for width in widths]
    return "\n".join(
        "| "
        + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        + " |"
        for line in [head, rule, *lines]
    )


def name_version(package: str) -> str:
    """Return a package's version; 'unknown' where it has none."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def show_timing(timing: Timing) -> str:
    """Return a median and, in brackets, the least, in ms."""
    return f"{_round(1e3 * timing.median)} ({_round(1e3 * timing.least)})"


def _round(value: float) -> str:
    """Show three digits, and all before the point."""
    return f"{value:.3g}" if value < 100 else f"{value:,.0f}"
