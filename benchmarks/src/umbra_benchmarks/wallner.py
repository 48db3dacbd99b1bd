"""
Wallner's tables 1 and 2 (2008): silhouettes by brute force, from a hextree, and from other trees.

The paper's scenes are not published, so others of their kind and size stand for them;
models of one's own can be measured beside them.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel
from umbra.machine import use_threads
from umbra.scene import Scene
from umbra.volume.adjacency import Caster, make_caster
from umbra.volume.dual_tree import make_dual_tree
from umbra.volume.duals import Tree
from umbra.volume.silhouette import find_silhouettes
from umbra_benchmarks.hextree import make_hextree, make_hough_tree
from umbra_benchmarks.measure import Timing, counted, run_in_turn
from umbra_benchmarks.report import (
    BenchmarkReport,
    BenchmarkRun,
    lay_out_table,
    show_timing,
)
from umbra_benchmarks.scenes import SquareModel, make_boulder, make_suns, make_town
from umbra_benchmarks.towers import make_lattice_tower, make_office_tower
from umbra_benchmarks.wallner_pictures import draw_figure_5, draw_figure_6

__all__ = ["Searched", "Wallner", "bench_wallner"]

_TREES: dict[str, Callable[[Caster], Tree]] = {
    "hextree": make_hextree,
    "hough": make_hough_tree,
    "tree": make_dual_tree,
}
_WAYS = ("as printed", "brute", *_TREES)


class Printed(NamedTuple):
    """What the paper prints of a scene: tables 1 and 2, on a Pentium 4 with 3.4 GHz."""

    scene: str
    faces: int
    brute: float  # [ms]
    hextree: float  # [ms]

    @property
    def ratio(self) -> float:
        """How many times as long brute force takes."""
        return self.brute / self.hextree


EIFFEL = Printed("Eiffel Tower", 11_155, 4.584, 4.236)
AREA = Printed("Industry Area", 13_585, 7.299, 5.799)
SHELL = Printed("Uniqua Building, part", 147_296, 44.486, 39.331)
WHOLE = Printed("Uniqua Building", 182_038, 58.666, 48.872)


@dataclass(frozen=True)
class Searched:
    """
    One caster.

    Parameters
    ----------
    scene : str
    printed : Printed, optional
        The paper's scene that it stands for.
    faces, edges : int
    silhouette : float
        Edges of a sun's silhouette, the mean.
    times : dict of Timing
        Of the processor, by way, for one sun asked alone: ``as printed`` is brute force that
        takes the products of both faces for every edge, ``brute`` ours, which takes each
        face's once. ``64 at once`` is ours, of one sun among all of a day.
    tested : dict of float
        By tree: edges that are looked at for a sun, the mean.
    build : dict of float
        By tree, of the processor [s].
    n_bytes : dict of int
        By tree, in memory.
    differ : int
        Edges that are not brute force's, over all suns and ways.
    """

    scene: str
    printed: Printed | None
    faces: int
    edges: int
    silhouette: float
    times: dict[str, Timing]
    tested: dict[str, float]
    build: dict[str, float]
    n_bytes: dict[str, int]
    differ: int

    def ratio(self, brute: str, way: str) -> float:
        """How many times as long one kind of brute force takes as another way, at their best."""
        return self.times[brute].least / self.times[way].least


@dataclass(frozen=True)
class Wallner(BenchmarkReport):
    """
    Both tables as measured.

    Parameters
    ----------
    rows : list of Searched
    suns : int
        Searched for in each run.
    """

    rows: list[Searched]
    suns: int

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object."""
        return self.head("wallner", suns=self.suns) | {
            "rows": [
                {
                    "scene": row.scene,
                    "faces": row.faces,
                    "edges": row.edges,
                    "silhouette_edges": row.silhouette,
                    "ms": {way: 1e3 * found.median for way, found in row.times.items()},
                    "min_ms": {way: 1e3 * found.least for way, found in row.times.items()},
                    "printed_brute_to_hextree": row.ratio("as printed", "hextree"),
                    "brute_to": {way: row.ratio("brute", way) for way in _TREES},
                    "tested_edges": row.tested,
                    "build_ms": {way: 1e3 * taken for way, taken in row.build.items()},
                    "bytes": row.n_bytes,
                    "disagreements": row.differ,
                    "paper": None
                    if row.printed is None
                    else {**row.printed._asdict(), "brute_to_hextree": row.printed.ratio},
                }
                for row in self.rows
            ],
        }

    def to_table(self) -> str:
        """Return Markdown tables that can be read as they stand."""
        times = lay_out_table(
            [
                "casters", "triangles", "brute as printed ms", "ours ms",
                *(f"{way} ms" for way in _TREES),
                "printed / hextree", "paper's", *(f"ours / {way}" for way in _TREES),
                "64 at once ms",
                "paper's scene: triangles, brute force ms, hextree ms",
            ],
            [
                [
                    row.scene,
                    f"{row.faces:,}",
                    *(show_timing(row.times[way]) for way in _WAYS),
                    f"{row.ratio('as printed', 'hextree'):.2f}",
                    "" if row.printed is None else f"{row.printed.ratio:.2f}",
                    *(f"{row.ratio('brute', way):.2f}" for way in _TREES),
                    show_timing(row.times["64 at once"]),
                    _show(row.printed),
                ]
                for row in self.rows
            ],
        )  # fmt: skip
        edges = lay_out_table(
            [
                "casters", "edges", "in the silhouette", *(f"{way} tests" for way in _TREES),
                *(f"{way} built ms" for way in _TREES), *(f"{way} MB" for way in _TREES),
            ],
            [
                [
                    row.scene,
                    f"{row.edges:,}",
                    _share(row.silhouette, row.edges),
                    *(_share(row.tested[way], row.edges) for way in _TREES),
                    *(f"{1e3 * row.build[way]:.3g}" for way in _TREES),
                    *(f"{1e-6 * row.n_bytes[way]:.3g}" for way in _TREES),
                ]
                for row in self.rows
            ],
        )  # fmt: skip
        differ = sum(row.differ for row in self.rows)
        return (
            f"umbra bench wallner: {self.machine}. Silhouettes of {self.suns} suns, one at a "
            f"time on one thread: ms of the processor for one, medians of {self.run.repeat} runs "
            "in turn, the fastest in brackets; ratios are of the fastest, which a busy machine "
            f"disturbs least.{self.small}\n\n{times}\n\n{edges}\n\n"
            f"{differ} edges differ from brute force."
        )


def bench_wallner(run: BenchmarkRun) -> Wallner:
    """
    Measure brute force, the paper's hextree (depth 4), Hough space and the tree of boxes, in turn.

    The suns are those over Vienna on 18 September from 09:00 to 17:00, as in the paper's
    figure 7. Adjacency and trees are built before the clock starts. Parts of the first of the
    run's models, with as many triangles as the paper's industry area, replace its boxes. Its
    figures 5 and 6 are drawn where pictures are asked for.

    Raises
    ------
    InputError
        If a model cannot be read.
    UmbraError
        If there is no OpenGL for pictures.
    """
    import umbra  # noqa: PLC0415

    scenes = [(path.name, umbra.read(path)) for path in run.models]
    if not scenes:
        run.say("boxes stand for the paper's industry area; name a real city with --model FILE")
    suns = np.append(make_suns(), np.zeros((33, 1)), 1)[:: 16 if run.quick else 1]
    rows = []
    for name, printed, make in _list_casters(scenes, run.quick):
        run.say(name)
        rows.append(_measure(name, printed, make(), suns, run.repeat))
    if run.pictures is not None:
        run.say("figures 5 and 6")
        run.pictures.mkdir(parents=True, exist_ok=True)
        size = (96, 72) if run.quick else (640, 480)
        draw_figure_5(size).save(run.pictures / "wallner_figure_5.png")
        draw_figure_6(size).save(run.pictures / "wallner_figure_6.png")
    return Wallner(run, rows, len(suns))


def _list_casters(
    scenes: Sequence[tuple[str, Scene]], quick: bool
) -> list[tuple[str, Printed | None, Callable[[], Caster]]]:
    """List what is measured, with the paper's scene that it stands for."""
    area: tuple[str, Callable[[], Caster]]
    if scenes:
        area = f"some of {scenes[0][0]}", lambda: _take(scenes[0][1], AREA.faces)
    else:
        area = "town of 1,132 boxes", lambda: _join(make_town(1132, 500.0, 1))
    listed: list[tuple[str, Printed | None, Callable[[], Caster]]] = [
        ("lattice tower", EIFFEL, lambda: _join(make_lattice_tower())),
        (area[0], AREA, area[1]),
    ]
    if not quick:
        tower = make_office_tower()
        listed += [
            ("office tower, shell", SHELL, lambda: _join(tower.shell)),
            ("office tower, whole", WHOLE, lambda: _join(tower.whole)),
            ("smooth boulder", None, lambda: _join(make_boulder(7))),
        ]
    listed += [(name, None, lambda scene=scene: _take(scene)) for name, scene in scenes]  # type: ignore[misc]
    return listed


def _join(model: SquareModel) -> Caster:
    return make_caster(model.vertices, model.faces)


def _take(scene: Scene, most: float = np.inf) -> Caster:
    """Make a caster of a scene's first parts, up to a number of triangles."""
    ends = np.cumsum([len(part.mesh.faces) for part in scene.parts])
    soup = scene.triangles(range(int(np.searchsorted(ends, most, "right"))))
    return make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])


def _measure(
    name: str, printed: Printed | None, caster: Caster, suns: NDArray[np.float64], repeat: int
) -> Searched:
    use_threads(1)
    build: dict[str, float] = {}
    trees: dict[str, Tree] = {}
    for way, make in _TREES.items():
        make(caster)  # compiles
        begun = time.process_time()
        trees[way] = make(caster)
        build[way] = time.process_time() - begun
    searches = {way: _make_search(caster, trees.get(way, way)) for way in _WAYS}
    contenders = {way: counted(partial(_ask_all, search, suns)) for way, search in searches.items()}
    contenders["64 at once"] = counted(lambda: list(find_silhouettes(caster, suns, "brute")))
    times = {way: found.divide(len(suns)) for way, found in run_in_turn(contenders, repeat).items()}
    codes = {way: [search(sun) for sun in suns] for way, search in searches.items()}
    tested = {
        way: float(np.mean([tree.count_tested(sun) or len(caster.edges) for sun in suns]))
        for way, tree in trees.items()
    }
    return Searched(
        scene=name,
        printed=printed,
        faces=len(caster.faces),
        edges=len(caster.edges),
        silhouette=float(np.mean([len(found) for found in codes["brute"]])),
        times=times,
        tested=tested,
        build=build,
        n_bytes={way: tree.n_bytes for way, tree in trees.items()},
        differ=sum(
            len(np.setxor1d(mine, theirs))
            for way in _WAYS
            for mine, theirs in zip(codes[way], codes["brute"], strict=True)
        ),
    )


def _make_search(
    caster: Caster, way: str | Tree
) -> Callable[[NDArray[np.float64]], NDArray[np.int32]]:
    """Make what finds the silhouette of one sun, as codes."""
    if way == "as printed":
        room = np.zeros(len(caster.edges) + 1, np.int32)

        def search(sun: NDArray[np.float64]) -> NDArray[np.int32]:
            n = _ask_as_printed(caster.planes, caster.edge_faces, caster.turn, sun, room)
            return room[:n].copy()
    else:

        def search(sun: NDArray[np.float64]) -> NDArray[np.int32]:
            ((_, found),) = find_silhouettes(caster, sun[None], way)
            return found.codes[: found.starts[1]].copy()

    return search


def _ask_all(
    search: Callable[[NDArray[np.float64]], NDArray[np.int32]], suns: NDArray[np.float64]
) -> None:
    for sun in suns:
        search(sun)


@partial(kernel, boundscheck=False)
def _ask_as_printed(planes, edge_faces, turn, light, codes):
    """Loop through all edges and take the products of both triangles (Wallner, section 4)."""
    n = 0
    for edge in range(edge_faces.shape[0]):
        a, b = edge_faces[edge, 0], edge_faces[edge, 1]
        one = (
            planes[0, a] * light[0] + planes[1, a] * light[1]
            + planes[2, a] * light[2] + planes[3, a] * light[3]
        )  # fmt: skip
        two = (
            planes[0, b] * light[0] + planes[1, b] * light[1]
            + planes[2, b] * light[2] + planes[3, b] * light[3]
        )  # fmt: skip
        codes[n] = edge << 2 | (one > 0)
        n += (one > 0) ^ (two > 0) ^ turn[edge]
    return n


def _show(printed: Printed | None) -> str:
    if printed is None:
        return ""
    return f"{printed.scene}: {printed.faces:,}, {printed.brute:g}, {printed.hextree:g}"


def _share(some: float, of: int) -> str:
    """Return a number of edges, and what share of all it is."""
    return f"{some:,.0f} ({100 * some / of:.3g} %)"
