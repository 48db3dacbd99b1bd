"""Every table of ``results.md`` by one commit on one machine: ``umbra bench all --out FILE``."""

import datetime as dt
import platform
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from umbra.errors import UmbraError
from umbra_benchmarks.report import BenchmarkReport, BenchmarkRun, describe_machine, name_version

__all__ = ["AllReports", "bench_all"]

_TABLES = {
    "study": "study",
    "walls": "walls",
    "frame": "frame",
    "silhouette": "silhouette",
    "startup": "startup",
    "tools": "tools",
    "gl_frame": "frame --device gl",
}
"""The modules of the tables, in their order, and how their benchmarks are called."""
_MARKED = ("tools",)
"""Tables that another page includes, between two marks."""


@dataclass(frozen=True)
class AllReports(BenchmarkReport):
    """
    The reports of all benchmarks.

    Parameters
    ----------
    commit : str
    date : date
    reports : dict of BenchmarkReport or str
        By their modules; a text says why there is none.
    """

    commit: str
    date: dt.date
    reports: Mapping[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("all", commit=self.commit, date=self.date.isoformat()) | {
            "reports": {
                name: {"failed": found} if isinstance(found, str) else found.to_dict()
                for name, found in self.reports.items()
            }
        }

    def to_table(self) -> str:
        """Return the page: a heading and a table for each benchmark."""
        head = (
            f"By `umbra bench all` on {self.date.isoformat()}, commit {self.commit}: "
            f"{self.machine} at the start, Python {platform.python_version()}, "
            f"umbra {name_version('umbra-shadows')}, numba {name_version('numba')}.{self.small}"
        )
        parts = ["# Last results", head]
        for name, found in self.reports.items():
            text = f"Not measured: {found}" if isinstance(found, str) else found.to_table()
            if name in _MARKED:
                text = f"<!-- {name} -->\n\n{text}\n\n<!-- end of {name} -->"
            parts += [f"## umbra bench {_TABLES[name]}", text]
        return "\n\n".join(parts) + "\n"


def bench_all(run: BenchmarkRun) -> AllReports:
    """Run the benchmark of every table in turn; one that cannot run says why in its place."""
    machine, reports = describe_machine(), {}
    for name, typed in _TABLES.items():
        run.say(f"umbra bench {typed}")
        try:
            reports[name] = getattr(import_module(f"umbra_benchmarks.{name}"), f"bench_{name}")(run)
        except UmbraError as error:
            reports[name] = error.for_shell()
            run.say(f"umbra bench {typed}: {reports[name]}")
    return AllReports(
        run, _find_commit(), dt.datetime.now(tz=dt.UTC).date(), reports, machine=machine
    )


def _find_commit() -> str:
    """Name the commit of the clone that is measured, and whether it was changed since."""
    try:
        found = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],
            cwd=Path(__file__).parent, capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return found.stdout.strip()
