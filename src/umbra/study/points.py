"""Studies of single points: samples of surfaces, and windows or sensors from a table."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patches import make_patches
from umbra.errors import InputError
from umbra.machine import find_memory, name_memory
from umbra.rays.face_tree import FaceTree
from umbra.rays.hidden import find_hidden
from umbra.receivers import KINDS, ReceiverKind
from umbra.scene import Scene
from umbra.study.masks import Masks
from umbra.study.model import Casting, prepare_casting
from umbra.study.period import Period, Refraction
from umbra.study.point_table import check_points
from umbra.study.receivers import Places
from umbra.study.result import Variables, make_dataset, time_variables
from umbra.study.setup import Progress, Setup
from umbra.study.surfaces import Samples, sample_surfaces
from umbra.sun import Site, SunPath
from umbra.volume.adjacency import Caster

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PointStudy", "run_point_study"]

CHUNK = 65_536
"""Points that are counted at a time."""
_CHUNK_OF_SURFACES = 2_097_152  # samples: each time every sun's silhouettes are found anew
_MANY_SUNS = 16  # that are worth laying surfaces out in patches; fewer are sooner asked by rays
DIMS = ("sample",)
_BYTES = 300  # held for each point: place, normal, hours, and copies on the way to the file


@dataclass(frozen=True, eq=False)
class PointTile:
    """
    Some points as receivers.

    Parameters
    ----------
    casting : Casting
    places : Places
    part : (n,) int
        Of each point; -1 for none.
    samples : Samples, optional
        How the points lie on surfaces, where they do.
    """

    casting: Casting
    places: Places
    part: NDArray[np.intp]
    samples: Samples | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of points."""
        return (len(self.places.points),)

    @property
    def tree(self) -> FaceTree:
        """What casts, for ways that start anywhere."""
        return self.casting.tree

    def make_counter(self) -> "PointTile | PatchCounter":
        """Make ready to count: surfaces by the rims of shadows, other points by rays."""
        if self.samples is None:
            return self
        casting = self.casting
        patches = make_patches(self.samples, casting.tree)
        return PatchCounter(patches, casting.caster, casting.tree, casting.threads)

    def masks(self, suns: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Tell for each sun which points are in shadow, cast or attached."""
        where = self.places
        return find_hidden(
            self.casting.tree, where.points, where.normals, suns, self.casting.threads
        )

    def add_steps(
        self,
        suns: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Count for each point how many suns leave it in shadow."""
        for first in range(0, len(suns), 64):
            some = suns[first : first + 64]
            steps += self.masks(some).sum(0, dtype=np.int32)
            progress(len(some))

    def find_cast(self, caster: Caster, suns: NDArray[np.float64]) -> tuple[Any, NDArray[np.uint8]]:
        """Find the shadows of one caster alone: where they can be, and the masks there."""
        return self.casting.find_cast(self.places, caster, suns)

    def with_casters(self, parts: Sequence[int] | None = None) -> "PointTile":
        """Give the same receivers with other parts casting; all but canopies by default."""
        casting = self.casting.solid if parts is None else self.casting.with_casters(parts)
        return replace(self, casting=casting)

    def find_parts(self) -> NDArray[np.intp]:
        """Give each point's part; -1 for none."""
        return self.part


@dataclass(frozen=True, eq=False)
class PointStudy:
    """
    Hours at single points.

    Parameters
    ----------
    period : Period
    shadow_hours : (n,) float32
    up_hours : float
        How long the sun was above the horizon [h].
    places : Places
        In the model's own coordinates.
    masks : (n_steps, n) Masks, optional
    facts : dict
        What the result's attributes say.
    model : Casting
        What cast.
    samples : Samples, optional
        How surfaces were laid out; none of points.
    more : dict
        Further arrays by name, each with its dimensions.
    """

    period: Period
    shadow_hours: NDArray[np.float32]
    up_hours: float
    places: Places
    masks: Masks | None
    facts: dict[str, object]
    model: Casting
    samples: Samples | None = None
    more: Variables = field(default_factory=dict)

    @property
    def site(self) -> Site:
        """Where it is."""
        return self.period.site

    @property
    def sun(self) -> SunPath:
        """The sun at the midpoints of all days' steps."""
        return self.period.sun

    @property
    def receivers(self) -> str:
        """What received the shadows: 'surfaces' or 'points'."""
        return str(self.facts["receivers"])

    @property
    def kind(self) -> ReceiverKind:
        """How such receivers are told, drawn and written."""
        return KINDS[self.receivers]

    @property
    def refraction(self) -> Refraction:
        """Where the sun was taken to stand: 'standard' or 'none'."""
        return self.period.refraction

    @property
    def sun_hours(self) -> NDArray[np.float32]:
        """Hours in the sun, (n,) float32."""
        return np.float32(self.up_hours) - self.shadow_hours

    def make_tiles(self) -> Iterator[tuple[slice, PointTile]]:
        """Give the receivers piece by piece, and where each piece lies among them."""
        origin = self.model.scene.origin
        part = np.full(len(self.shadow_hours), -1)
        if self.samples is not None:
            part = self.samples.part[self.samples.surface]
        places = Places(self.places.points - origin, self.places.normals)
        for at in range(0, len(part), CHUNK):
            some = slice(at, at + CHUNK)
            yield some, _make_tile(self.model, places, part, None, some)()

    def variables(self) -> Variables:
        """Give the arrays of ``study.nc`` by name, each with its dimensions."""
        return {
            **time_variables(self.period),
            "shadow_hours": (DIMS, self.shadow_hours),
            "sun_hours": (DIMS, self.sun_hours),
            "receiver_z": (DIMS, self.places.points[:, 2].copy()),
            "position": ((*DIMS, "xyz"), self.places.points),
            "normal": ((*DIMS, "xyz"), self.places.normals),
            **self.more,
        }

    def to_dataset(self) -> "xr.Dataset":
        """Give the result as a dataset, as ``study.nc`` reads back."""
        return make_dataset(self.variables(), self.facts)


def run_point_study(
    scene: Scene,
    site: Site,
    *,
    receivers: str = "surfaces",
    spacing: float = 0.5,
    on: Sequence[str] = (),
    points: ArrayLike | None = None,
    names: Sequence[str] = (),
    progress: Progress = lambda _done, _all: None,
    **options: Any,
) -> PointStudy:
    """
    Run a study of sampled surfaces or of given points; see ``shadow_study``.

    Parameters
    ----------
    scene : Scene
    site : Site
    receivers : {'surfaces', 'points'}
    spacing : float
        Between samples of surfaces [m].
    on : sequence of str
        Shell patterns of the parts that are sampled; all by default.
    points : (n, 3) or (n, 6) float
        In the model's own coordinates, with normals or without: a point without one is
        turned to every sun.
    names : sequence of str
        Of the points.
    progress : callable
        Told how many instants are done, and of how many.
    **options
        Of every study, see ``Setup.of``.
    """
    setup = Setup.of(scene, site, **options)
    origin = scene.origin
    canopy = setup.canopy
    casting = prepare_casting(scene, setup.casters, setup.threads, canopy)
    samples = None
    if receivers == "surfaces":
        left = None if canopy is None else canopy.find_receivers(scene, on)
        samples = sample_surfaces(scene, spacing, on, left)
    if samples is not None:
        places = Places(samples.points, samples.normals)
        part, area = samples.part[samples.surface], samples.area
        facts: dict[str, object] = {"spacing_m": float(spacing)}
    else:
        given = check_points(points)
        normals = given[:, 3:] if given.shape[1] == 6 else np.full((len(given), 3), np.nan)
        places = Places(given[:, :3] - origin, np.ascontiguousarray(normals))
        part, area = np.full(len(given), -1), np.ones(len(given))
        facts = {}
    kept = _BYTES + setup.bytes_kept + setup.bytes_of_masks
    if len(part) * kept > find_memory():
        msg = (
            f"{len(part):,} samples need {len(part) * kept / 1e9:.1f} GB and "
            f"{name_memory(find_memory())}; give a larger spacing=, or choose parts with on="
        )
        raise InputError(msg, samples=len(part))
    laid_out = samples if setup.period.sun.is_up.sum() >= _MANY_SUNS else None
    # Who casts is asked by rays, and holds a mask of each caster.
    chunk = CHUNK if laid_out is None or setup.asked.groups else _CHUNK_OF_SURFACES
    pieces = [slice(at, at + chunk) for at in range(0, len(places.points), chunk)]
    tiles = [(some, _make_tile(casting, places, part, laid_out, some)) for some in pieces]
    done = setup.count(casting, (len(places.points),), tiles, progress)
    ledger = done.ledger
    more = {**ledger.variables(DIMS), **done.answer.variables(DIMS, area)}
    study = PointStudy(
        setup.period,
        ledger.shadow_hours,
        ledger.up_hours,
        Places(places.points + origin, places.normals),
        ledger.masks,
        setup.describe(receivers, done.seconds, **facts),
        casting,
        samples,
        more,
    )
    if samples is not None:
        more |= _summarise(samples, study, scene, site)
    elif names:
        more["name"] = (DIMS, np.array(names))
    return study


def _make_tile(
    casting: Casting, places: Places, part: NDArray, samples: Samples | None, some: slice
) -> Callable[[], PointTile]:
    def make() -> PointTile:
        where = Places(places.points[some], places.normals[some])
        piece = None if samples is None else samples.piece(some)
        return PointTile(casting, where, part[some], piece)

    return make


def _summarise(samples: Samples, study: PointStudy, scene: Scene, site: Site) -> Variables:
    """Give the results of each surface and of each part."""
    labels, owner = np.unique(np.array(scene.labels())[samples.part], return_inverse=True)
    owner = owner.ravel()
    normal = samples.surface_normal
    turn = np.degrees(np.arctan2(normal[:, 0], normal[:, 1])) - site.true_north
    level = np.hypot(normal[:, 0], normal[:, 1]) < 1e-6
    one, part = ("surface",), ("part",)
    found: Variables = {
        "area": (DIMS, samples.area),
        "surface_of_sample": (DIMS, samples.surface),
        "surface_part": (one, owner.astype(np.int32)),
        "surface_kind": (one, np.array([scene.parts[p].kind for p in samples.part])),
        "surface_area": (one, samples.surface_area),
        "surface_azimuth": (one, np.where(level, np.nan, turn % 360)),
        "surface_tilt": (one, np.degrees(np.arccos(np.clip(normal[:, 2], -1, 1)))),
        "part": (part, labels),
    }
    by_day = study.more.get("sun_hours_by_day")
    for name, index, count in (
        ("surface", samples.surface, len(samples.part)),
        ("part", owner[samples.surface], len(labels)),
    ):
        total = np.bincount(index, samples.area, count)
        if name == "part":
            found["part_area"] = (part, total)

        def sum_up(
            sun: NDArray[np.float32], index: Any = index, count: int = count, total: Any = total
        ) -> dict[str, NDArray[np.float32]]:
            mean = np.bincount(index, samples.area * sun, count) / total
            least, most = np.full(count, np.inf), np.full(count, -np.inf)
            np.minimum.at(least, index, sun)
            np.maximum.at(most, index, sun)
            figures = {"mean": mean, "least": least, "most": most}
            return {k: figure.astype(np.float32) for k, figure in figures.items()}

        for which, figure in sum_up(study.sun_hours).items():
            found[f"{name}_{which}_sun_hours"] = ((name,), figure)
        if by_day is not None:
            each = [sum_up(sun) for sun in by_day[1]]
            for which in each[0]:
                values = np.array([day[which] for day in each])
                found[f"{name}_{which}_sun_hours_by_day"] = (("day", name), values)
    return found
