"""
Frames on the gl device: the peers' scene, drawn by umbra and by renderers that are peers.

A hundred spheres of 960 triangles above a ground plane, one lamp that moves with each
frame, light added where no shadow volume is counted. Each side draws the same places of
the lamp in its turn, and waits for each frame to be finished.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra_benchmarks.measure import Spent, Timing, run_in_turn
from umbra_benchmarks.ours_gl import OursGl
from umbra_benchmarks.peer import PEERS, Peer, PeerKind, find_peers
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)
from umbra_benchmarks.scenes import Spheres, make_spheres

__all__ = ["CALLS_MARK", "GlReport", "GlRow", "PeerTiming", "bench_gl_frame"]

CALLS_MARK = 0.5e-3
"""A frame in which nothing moved is to cost this processor time before it is drawn [s]."""
_SIZES = (512, 1024)
_FRAMES = 10  # of a turn
_PICTURED = 8  # the place of the lamp in saved pictures: beside the spheres, shadows long


@dataclass(frozen=True)
class PeerTiming:
    """The time of a peer, its product and version, and the driver that drew for it."""

    kind: PeerKind
    name: str
    driver: str
    timing: Timing


@dataclass(frozen=True)
class GlRow:
    """
    One size of picture.

    Parameters
    ----------
    work : str
    size : int
        Pixels a side.
    driver : str
        What drew for umbra.
    ours, no_shadows, eye_moving : Timing
        A frame while the eye stands still; one without shadows; one while the eye moves as well.
    moving, still : Timing
        umbra's frame less all drawing, with the lamp moving and standing.
    peers : sequence of PeerTiming
    """

    work: str
    size: int
    driver: str
    ours: Timing
    no_shadows: Timing
    eye_moving: Timing
    moving: Timing
    still: Timing
    peers: Sequence[PeerTiming]

    @property
    def shadows(self) -> float:
        """What shadows add to a frame [s]."""
        return self.ours.median - self.no_shadows.median

    def compare(self, peer: PeerTiming, ours: Timing | None = None) -> dict[str, float]:
        """Return how many times longer a peer takes than a frame, in three ways."""
        theirs, ours = peer.timing, ours or self.ours
        return {
            "ratio": theirs.median / ours.median,
            "ratio_of_minima": theirs.least / ours.least,
            "ratio_of_processor": (theirs.processor or np.nan) / (ours.processor or np.nan),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return numbers for programs; times in ms."""
        named = {
            "ours": self.ours, "no_shadows": self.no_shadows, "eye_moving": self.eye_moving,
            "calls": self.moving, "still_calls": self.still,
        }  # fmt: skip
        times: dict[str, float] = {}
        for name, timing in named.items():
            times |= {f"{name}_{key}": value for key, value in _in_ms(timing).items()}
        return {
            "work": self.work,
            "pixels": self.size**2,
            "driver": self.driver,
            **times,
            "shadows_ms": 1e3 * self.shadows,
            "still_calls_mark_ms": 1e3 * CALLS_MARK,
            "peers": [
                {
                    "peer": peer.kind.name,
                    "name": peer.name,
                    "driver": peer.driver,
                    **_in_ms(peer.timing),
                    **self.compare(peer),
                    "ratio_eye_moving": self.compare(peer, self.eye_moving)["ratio"],
                    "mark": peer.kind.mark,
                }
                for peer in self.peers
            ],
        }


@dataclass(frozen=True)
class GlReport(BenchmarkReport):
    """
    The benchmark's result.

    Parameters
    ----------
    frames : int
        Frames in a turn, whose mean counts.
    rows : sequence of GlRow
    missing : sequence of PeerKind
        Peers that are not installed, and so not measured.
    """

    frames: int
    rows: Sequence[GlRow]
    missing: Sequence[PeerKind] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head(
            "frame",
            device="gl",
            frames=self.frames,
            rows=[row.to_dict() for row in self.rows],
            missing=[{"peer": kind.name, "install": kind.install} for kind in self.missing],
        )

    def to_table(self) -> str:
        """Return a Markdown table that can be read as it stands."""
        head = ["work", "who", "ms (min)", "processor ms", "times umbra", "of minima",
                "of processor", "mark"]  # fmt: skip
        lines: list[list[str]] = []
        for row in self.rows:
            scene = f"below {1e3 * row.no_shadows.median:.3g} ms" if row.size >= 1024 else ""
            calls = f"below {1e3 * CALLS_MARK:g} ms"
            for work, who, timing, mark in (
                (row.work, "umbra", row.ours, ""),
                ("", "... the eye moving, too", row.eye_moving, ""),
                ("", "... without shadows", row.no_shadows, ""),
                ("", "... calls alone, lamp moving", row.moving, ""),
                ("", "... calls alone, lamp standing", row.still, calls),
            ):
                lines.append([work, who, *_show(timing), "", "", "", mark])
            alone = ["", "... shadows alone", f"{1e3 * row.shadows:.3g}"]
            lines.insert(-2, [*alone, "", "", "", "", scene])
            for peer in row.peers:
                ratios = [f"{ratio:.2f}" for ratio in row.compare(peer).values()]
                mark = "" if peer.kind.mark is None else f"{peer.kind.mark:g}"
                lines.append(["", peer.name, *_show(peer.timing), *ratios, mark])
                ratios = [f"{ratio:.2f}" for ratio in row.compare(peer, row.eye_moving).values()]
                lines.append(["", "... to umbra with the eye moving", "", "", *ratios, ""])
        drivers = {row.driver for row in self.rows}
        drivers |= {peer.driver for row in self.rows for peer in row.peers}
        return (
            f"umbra bench frame --device gl: {self.machine}; {', '.join(sorted(drivers))}. "
            f"Medians of {self.run.repeat} turns of {self.frames} frames, each finished."
            f"{self.small}\n\n{lay_out_table(head, lines)}"
            + "".join(f"\n\n{_explain_missing(kind)}." for kind in self.missing)
        )


def _in_ms(timing: Timing) -> dict[str, float]:
    return timing.to_ms() | {"processor_ms": 1e3 * (timing.processor or 0.0)}


def _show(timing: Timing) -> list[str]:
    return [show_timing(timing), f"{1e3 * (timing.processor or 0.0):.3g}"]


def _explain_missing(kind: PeerKind) -> str:
    return (
        f"{kind.title} is not installed and not measured; {kind.install} and name it with "
        f"--peer-python {kind.name}=PATH"
    )


def bench_gl_frame(run: BenchmarkRun) -> GlReport:
    """
    Measure frames against renderers in processes of their own.

    Raises
    ------
    InputError
        If no interpreter has the package of a peer that was asked for.
    UmbraError
        If there is no OpenGL, or a peer fails.
    """
    found, missing = find_peers(PEERS, run)
    for kind in missing:
        run.say(_explain_missing(kind))
    scene = make_spheres(3, 8, 12) if run.quick else make_spheres()
    frames = 2 if run.quick else _FRAMES
    balls, faces = len(scene.centres), len(scene.faces)
    if run.pictures is not None:
        run.pictures.mkdir(parents=True, exist_ok=True)
    rows = []
    for size in (64,) if run.quick else _SIZES:
        work = f"{balls} spheres of {faces} triangles, {size}²"
        run.say(work)
        rows.append(_compare(work, scene, size, found, run, frames))
    return GlReport(run, frames, rows, missing)


def _compare(
    work: str,
    scene: Spheres,
    size: int,
    found: Mapping[PeerKind, Path],
    run: BenchmarkRun,
    frames: int,
) -> GlRow:
    with ExitStack() as stack:
        ours = stack.enter_context(OursGl(scene, size))
        peers = [
            stack.enter_context(Peer(kind, python, scene, size)) for kind, python in found.items()
        ]
        turns = {
            "ours": _Turns(scene.path, frames, ours.time),
            "no_shadows": _Turns(scene.path, frames, lambda way: ours.time(way, shadows=False)),
            "eye_moving": _Turns(scene.path, frames, lambda way: ours.time(way, moves_eye=True)),
            "moving": _Turns(scene.path, frames, ours.time_calls),
            "still": _Turns(scene.path[:1], frames, ours.time_calls),
            **{peer.kind.name: _Turns(scene.path, frames, peer.render) for peer in peers},
        }
        timings = {
            name: replace(timing, processor=turns[name].processor)
            for name, timing in run_in_turn(turns, run.repeat).items()
        }
        if run.pictures is not None:
            place = scene.path[_PICTURED]
            ours.save(place, run.pictures / f"umbra_{size}.png")
            for peer in peers:
                peer.save(place, run.pictures / f"{peer.kind.name}_{size}.png")
        return GlRow(
            work, size, ours.driver,
            timings["ours"], timings["no_shadows"], timings["eye_moving"],
            timings["moving"], timings["still"],
            [PeerTiming(p.kind, p.name, p.driver, timings[p.kind.name]) for p in peers],
        )  # fmt: skip


@dataclass(eq=False)
class _Turns:
    """Draws the next places of the lamp in each turn: the same ones on all sides."""

    path: NDArray[np.float64]
    frames: int
    draw: Callable[[Any], Spent]
    _spent: list[Spent] = field(default_factory=list)

    def __call__(self) -> float:
        place = self.frames * len(self._spent) + np.arange(self.frames)
        self._spent.append(self.draw(self.path[place % len(self.path)]))
        return self._spent[-1].wall

    @property
    def processor(self) -> float:
        """The median of a frame's processor time [s], the first turn not counted."""
        return float(np.median([spent.processor for spent in self._spent[1:]]))
