"""
McGuire and others (2003) run again: three cases, bytes of a triangle, frames against Lengyel's.

The paper has no table of times. What it claims are how triangles grow in each of three
cases (section 7), 6 bytes a triangle in place of 36, and frames "strictly faster" than by
Lengyel's algorithm; each is measured here.
"""

from dataclasses import dataclass
from typing import Any

from umbra.errors import UmbraError
from umbra_benchmarks.cases import DrawnTriangles, count_cases, find_growth
from umbra_benchmarks.method_frames import CONTENDERS, Viewed, draw_views
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)

__all__ = ["McGuire", "bench_mcguire"]

_PAPER_GROWTH = (("s", "s", "f"), ("s", "f", "f"))
"""Section 3: order of triangles in cases 1, 2, 3 by McGuire's algorithm and Lengyel's."""
_PAPER_BYTES = (6, 36)
"""Abstract and section 7: of a triangle as three indices of 16 bits, and as nine floats."""
_ALIKE = 0.03  # times nearer to each other than this say nothing


@dataclass(frozen=True)
class McGuire(BenchmarkReport):
    """
    What was counted and timed.

    Parameters
    ----------
    drawn : list of DrawnTriangles
        Triangles by case.
    views : list of Viewed
        Frames by method; empty without OpenGL.
    driver : str
        What drew, or why nothing did.
    is_software : bool
        Whether it drew on processors, so that their time is that of the frame.
    """

    drawn: list[DrawnTriangles]
    views: list[Viewed]
    driver: str
    is_software: bool

    def shapes(self) -> list[str]:
        """Name the shapes of the cases, each once."""
        return list(dict.fromkeys(row.shape for row in self.drawn))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("mcguire", driver=self.driver) | {
            "cases": [
                {
                    "shape": row.shape,
                    "faces": row.faces,
                    "silhouette_edges": row.silhouette,
                    "triangles": row.drawn,
                    "triangles_directional": row.directional,
                    "triangles_extruded_caps": row.extruded,
                    "placing_ms": [1e3 * seconds for seconds in row.placing],
                }
                for row in self.drawn
            ],
            "growth": {shape: find_growth(self.drawn, shape) for shape in self.shapes()},
            "paper_growth": {"mcguire": _PAPER_GROWTH[0], "lengyel": _PAPER_GROWTH[1]},
            "paper_bytes": {"indices": _PAPER_BYTES[0], "vertices": _PAPER_BYTES[1]},
            "views": [
                {
                    "scene": row.scene,
                    "view": row.view,
                    "faces": row.faces,
                    "points": row.points,
                    "cases": row.cases,
                    "bytes_per_triangle": _find_bytes(row),
                    "ms": {name: 1e3 * found.median for name, found in row.times.items()},
                    "min_ms": {name: 1e3 * found.least for name, found in row.times.items()},
                    "processor_ms": {
                        name: None if found.processor is None else 1e3 * found.processor
                        for name, found in row.times.items()
                    },
                    "triangles": row.triangles,
                    "index_bytes": row.n_bytes,
                    "lengyel_to_mcguire": row.ratio("lengyel"),
                    "lengyel_to_mcguire_cut": row.ratio("lengyel, cut", "mcguire, cut"),
                }
                for row in self.views
            ],
        }

    def to_table(self) -> str:
        """Return Markdown tables that can be read as they stand."""
        text = (
            f"umbra bench mcguire: {self.machine}, {self.driver}. Medians of "
            f"{self.run.repeat} runs in turn.{self.small}\n\n"
            "Triangles of one shadow volume in each case (the paper: in "
            f"the order of s, s and f; Lengyel's s, f, f):\n\n{self._lay_out_cases()}"
        )
        if not self.views:
            return text
        return (
            f"{text}\n\nBytes that travel for a triangle (the paper: {_PAPER_BYTES[0]} rather than "
            f"{_PAPER_BYTES[1]}):\n\n{self._lay_out_bytes()}\n\nFrames in ms, the fastest in "
            "brackets; ratios are of the fastest, which a busy machine disturbs least:\n\n"
            f"{self._lay_out_frames()}\n\n{self._judge()}"
        )

    def _lay_out_cases(self) -> str:
        table = lay_out_table(
            [
                "shape", "faces", "silhouette edges", "case 1", "case 2", "case 3",
                "directional 1, 2, 3", "extruded caps", "placed in ms 1, 2, 3",
            ],
            [
                [
                    row.shape,
                    f"{row.faces:,}",
                    f"{row.silhouette:,}",
                    *(f"{count:,}" for count in row.drawn),
                    "; ".join(f"{count:,}" for count in row.directional),
                    f"{row.extruded:,}",
                    "; ".join(f"{1e3 * seconds:.3g}" for seconds in row.placing),
                ]
                for row in self.drawn
            ],
        )  # fmt: skip
        growth = "\n".join(
            f"{shape}: triangles grow as the number of faces to the power of "
            + ", ".join(f"{power:.2f}" for power in find_growth(self.drawn, shape))
            + " in cases 1, 2, 3."
            for shape in self.shapes()
        )
        return f"{table}\n\n{growth}"

    def _lay_out_bytes(self) -> str:
        first = {row.scene: row for row in reversed(self.views)}
        return lay_out_table(
            ["scene", "casting triangles", "points", "bytes a triangle", "times fewer"],
            [
                [
                    name,
                    f"{row.faces:,}",
                    f"{row.points:,}",
                    f"{_find_bytes(row):g}",
                    f"{_PAPER_BYTES[1] / _find_bytes(row):g}",
                ]
                for name, row in reversed(first.items())
            ],
        )

    def _lay_out_frames(self) -> str:
        return lay_out_table(
            [
                "scene", "view", "cases 1, 2, 3", "triangles: mcguire, lengyel, z-fail",
                *CONTENDERS, "lengyel / mcguire", "of processor", "both cut", "of processor",
            ],
            [
                [
                    row.scene,
                    row.view,
                    ", ".join(f"{count}" for count in row.cases),
                    "; ".join(f"{row.triangles[name]:,}" for name in list(CONTENDERS)[:3]),
                    *(show_timing(row.times[name]) for name in CONTENDERS),
                    *(
                        f"{ratio(f'lengyel{cut}', f'mcguire{cut}'):.2f}"
                        for cut in ("", ", cut")
                        for ratio in (row.ratio, row.processor_ratio)
                    ),
                ]
                for row in self.views
            ],
        )  # fmt: skip

    def _judge(self) -> str:
        """Say in how many views the paper's claim holds, by what other work disturbs least."""
        ratios = [
            row.processor_ratio("lengyel") if self.is_software else row.ratio("lengyel")
            for row in self.views
        ]
        faster = sum(ratio > 1 + _ALIKE for ratio in ratios)
        slower = sum(ratio < 1 - _ALIKE for ratio in ratios)
        fewer = sum(row.triangles["mcguire"] < row.triangles["lengyel"] for row in self.views)
        return (
            f"As published, mcguire draws fewer triangles than lengyel in {fewer} of "
            f"{len(self.views)} views and is faster in {faster}, slower in {slower}, within "
            f"{100 * _ALIKE:g} % in {len(ratios) - faster - slower}"
            f"{' (of processor)' if self.is_software else ''}."
        )


def bench_mcguire(run: BenchmarkRun) -> McGuire:
    """Count triangles by case and, where there is OpenGL, draw frames by each method."""
    drawn = count_cases(run)
    try:
        driver, is_software, views = draw_views(run)
    except UmbraError as error:
        driver, is_software, views = f"no frames: {error}", False, []
        run.say(driver)
    return McGuire(run, drawn, views, driver, is_software)


def _find_bytes(row: Viewed) -> float:
    return row.n_bytes["mcguire"] / row.triangles["mcguire"]
