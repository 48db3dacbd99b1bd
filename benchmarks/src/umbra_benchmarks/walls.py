"""Walls and roofs: umbra counts patch by patch; Embree asks every sample for each sun."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import umbra
from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patches import make_patches
from umbra.rays.face_tree import make_face_tree
from umbra.receivers.samples import sample_surfaces
from umbra.scene import Scene, make_scene
from umbra.volume.adjacency import make_caster
from umbra_benchmarks.embree import OFFSET, Embree
from umbra_benchmarks.measure import counted, run_in_turn, timed
from umbra_benchmarks.packets import PACKETS, EmbreePackets, sort_along_curve
from umbra_benchmarks.report import BenchmarkRun, Report, Row, SecondPeer, name_version
from umbra_benchmarks.scenes import SquareModel, make_suns, make_town

__all__ = ["bench_walls", "make_low_suns"]

_PIECE = 2_097_152  # samples that are counted at a time, as in a study
_KEPT = 256_000_000  # memory for silhouettes that pieces share [byte], as in a study
_ASKED = 200_000  # samples of which Embree is asked, in runs of neighbours
_RUNS = 20
_PACKETS_MARKS = {"vienna_lod2": 4.0, "delft": 1.0}  # by model, every 0.5 m
_LOW_MARKS = {"delft": 2.0}
_AT_ONCE = 8  # suns whose masks are compared at a time


@dataclass(frozen=True)
class _Case:
    """A scene's walls and roofs, sampled so many metres apart, under the suns of a day or low."""

    name: str
    scene: Scene
    spacing: float
    is_low: bool = False
    mark: float | None = None  # against embreex
    packets_mark: float | None = None


def bench_walls(run: BenchmarkRun) -> Report:
    """
    Measure shadows on all walls and roofs of generated towns, and of the models that are named.

    What a study prepares once (adjacency, trees, samples, patches) is done before the clock
    starts; silhouettes and their bins are not. Embree is asked for an even choice of 200,000
    samples at most, its time taken for all. On one thread both sides' time of the processor
    counts; on more umbra's by the clock.
    """
    return Report(
        run, "walls", f"embreex {name_version('embreex')}",
        [_measure(case, run) for case in _find_cases(run)],
    )  # fmt: skip


def make_low_suns() -> NDArray[np.float64]:
    """Return suns 0.01 to 7 degrees high all around, (55, 3) float64."""
    around = np.radians([0, 45, 90, 100, 135, 180, 200, 225, 270, 300, 359])
    azimuth, up = (axis.ravel() for axis in np.meshgrid(around, np.radians([0.01, 0.2, 1, 3, 7])))
    flat = np.cos(up)
    return np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(up)], 1)


def _find_cases(run: BenchmarkRun) -> Iterator[_Case]:
    if run.quick:
        yield _Case("town of 10 boxes", _make(make_town(10, 90.0, 1)), 1.0)
        return
    town = _make(make_town(300, 500.0, 1))
    yield _Case("town of 300 boxes", town, 0.5)
    yield _Case("town of 300 boxes", town, 0.25)
    yield _Case("city of 8,333 boxes", _make(make_town(8333, 2500.0, 2)), 1.0, mark=25.0)
    for path in run.models:
        scene = umbra.read(path)
        model = path.name.partition(".")[0]
        yield _Case(path.name, scene, 0.5, packets_mark=_PACKETS_MARKS.get(model))
        yield _Case(path.name, scene, 0.25)
        yield _Case(path.name, scene, 0.5, is_low=True, mark=_LOW_MARKS.get(model))


def _make(model: SquareModel) -> Scene:
    return make_scene(model.vertices, model.faces)


def _measure(case: _Case, run: BenchmarkRun) -> Row:
    suns = make_low_suns() if case.is_low else make_suns()
    samples = sample_surfaces(case.scene, case.spacing)
    count = len(samples.points)
    work = f"{case.name}, {case.spacing:g} m, {len(suns)} {'low ' if case.is_low else ''}suns"
    run.say(f"{work}: {count:,} samples")
    soup = case.scene.triangles()
    caster = make_caster(soup.vertices, soup.faces, case.scene.groups()[soup.part])
    tree = make_face_tree(caster, float(np.abs(case.scene.origin).max()))
    patches = [make_patches(samples.piece(piece), tree) for piece in _cut(count)]
    binner = EdgeBinner(caster, _KEPT)
    alone = _Walls([PatchCounter(some, binner, tree) for some in patches], binner)
    together = _Walls([PatchCounter(some, binner, tree, run.threads) for some in patches], binner)
    chosen = _choose(count)
    rays = _Rays(
        Embree(soup.vertices, soup.faces), EmbreePackets(soup.vertices, soup.faces),
        samples.points[chosen], samples.normals[chosen], suns,
    )  # fmt: skip
    share = len(chosen) / count
    timings = run_in_turn(
        {
            "ours": counted(lambda: alone.count(suns)),
            "threads": timed(lambda: together.count(suns)),
            "peer": lambda: sum(seconds for *_, seconds in rays.ask()) / share,
            "packets": lambda: sum(seconds for *_, seconds in rays.ask_packets()) / share,
        },
        run.repeat,
    )
    differ, of = _count_differences(alone, rays, chosen)
    facts = {"suns": len(suns), "samples": count, "asked": len(chosen)}
    packets = SecondPeer(
        PACKETS, timings["packets"], case.packets_mark, rays.count_packets_differences()
    )
    return Row(
        work, timings["ours"], timings["peer"], timings["threads"], case.mark, differ, of,
        facts, packets,
    )  # fmt: skip


def _cut(count: int) -> list[slice]:
    return [slice(at, min(at + _PIECE, count)) for at in range(0, count, _PIECE)]


@dataclass(frozen=True, eq=False)
class _Walls:
    """umbra's side: counters of samples, piece by piece."""

    counters: list[PatchCounter]
    binner: EdgeBinner

    def count(self, suns: NDArray[np.float64]) -> None:
        """Count the suns that leave each sample in shadow; find their silhouettes first."""
        self.binner.forget()
        once = np.ones((len(suns), 1), np.int32)
        for counter in self.counters:
            counter.add_weights(suns, once, np.zeros((1, counter.size), np.int32))

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Tell which samples are in shadow."""
        return np.concatenate([counter.masks(suns) for counter in self.counters], 1)


@dataclass(frozen=True, eq=False)
class _Rays:
    """Embree's side: one ray from each sample that faces the sun."""

    embree: Embree
    packets: EmbreePackets
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    suns: NDArray[np.float64]

    def ask(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.bool_], float]]:
        """Return for each sun the samples that face it, which are hidden, and Embree's seconds."""
        starts = (self.points + OFFSET * self.normals).astype(np.float32)
        directions = np.zeros_like(starts)
        # For all suns at once: a product's other threads go on for a while, which would count.
        for sun, is_facing in zip(self.suns, self.suns @ self.normals.T > 0, strict=True):
            facing = np.flatnonzero(is_facing)
            from_here, along = starts[facing], directions[: len(facing)]
            along[:] = sun
            begun = time.process_time()
            found = self.embree.find_occluded(from_here, along)
            seconds = time.process_time() - begun
            yield facing, found == 0, seconds

    def ask_packets(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.bool_], float]]:
        """Do the same with 16 rays a call, of samples that are neighbours."""
        order = sort_along_curve(self.points)
        starts = (self.points + OFFSET * self.normals).astype(np.float32)
        for sun, is_facing in zip(self.suns, self.suns @ self.normals.T > 0, strict=True):
            facing = order[is_facing[order]]
            from_here, along = starts[facing], sun[None].astype(np.float32)
            begun = time.process_time()
            is_hidden = self.packets.find_occluded(from_here, along)
            seconds = time.process_time() - begun
            yield facing, is_hidden, seconds

    def count_packets_differences(self) -> int:
        """Count the packets' answers that differ from embreex's."""
        differ = 0
        hidden = np.zeros(len(self.points), np.bool_)
        for (facing, is_hidden, _), (ordered, is_packed, _) in zip(
            self.ask(), self.ask_packets(), strict=True
        ):
            hidden[facing] = is_hidden
            differ += int((hidden[ordered] != is_packed).sum())
        return differ


def _choose(count: int) -> NDArray[np.intp]:
    """Choose samples, in runs of neighbours that lie evenly among all."""
    if count <= _ASKED:
        return np.arange(count)
    length = _ASKED // _RUNS
    begins = np.linspace(0, count - length, _RUNS).astype(np.intp)
    return (begins[:, None] + np.arange(length)).ravel()


def _count_differences(walls: _Walls, rays: _Rays, chosen: NDArray[np.intp]) -> tuple[int, int]:
    """Count the answers that differ, and all where a sample faces the sun."""
    differ = compared = 0
    answers = rays.ask()
    for first in range(0, len(rays.suns), _AT_ONCE):
        for mask in walls.masks(rays.suns[first : first + _AT_ONCE]):
            facing, hidden, _ = next(answers)
            differ += int((hidden != (mask[chosen][facing] != 0)).sum())
            compared += len(facing)
    return differ, compared
