"""
Points as receivers: samples of walls and roofs, or given points.

Given points are windows, sensors or places in a garden, read from tables.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.casters.casting import Casting
from umbra.errors import InputError, show_count
from umbra.kernels import kernel
from umbra.readers.csv_rows import read_rows
from umbra.receivers.counted import Counted
from umbra.receivers.kind import DIMS, ReceiverKind, Request, SampleKind, Variables
from umbra.receivers.on_demand import OnDemand
from umbra.receivers.placed import PlacedKind, PlacedSamples
from umbra.receivers.samples import LEVEL, sample_surfaces
from umbra.receivers.single import SingleReceivers, is_kept
from umbra.receivers.surface_samples import SampledPlaces, Samples
from umbra.scene import Scene
from umbra.scene.derived import derive
from umbra.scene.numbers import read_array

__all__ = [
    "GivenPoints",
    "SampledSurfaces",
    "SurfaceSamples",
    "check_points",
    "read_points",
]

_LARGEST = 200_000_000  # [byte]; millions of points
_COLUMNS = ("x", "y", "z", "nx", "ny", "nz")


class SampledSurfaces(SampleKind):
    """Walls and roofs, sampled in their own planes."""

    name = "surfaces"
    noun = "walls and roofs"
    spot = "sample"
    formats = ("csv", "glb", "3dtiles", "solids", "geoparquet", "cityjson")
    tables = {  # noqa: RUF012  (a constant)
        "samples.csv": "sample", "surfaces.csv": "surface", "parts.csv": "part",
    }  # fmt: skip

    def lay_out(self, request: Request) -> "SurfaceSamples":
        """Sample the surfaces of all or of chosen parts."""
        on, spacing = request.options.on, request.options.spacing
        casting = request.prepare()
        scene = request.scene
        left = None if request.canopy is None else request.canopy.find_receivers(scene, on)
        own = scene.list_own()
        if own is not None and not on:  # a ground that was added is sampled where it is asked for
            left = own if left is None else sorted({*left} & {*own})
        samples = derive(
            scene, "samples", (spacing, tuple(on), None if left is None else tuple(left)),
            lambda: sample_surfaces(scene, spacing, on, left), most=1, fits=is_kept,
        )  # fmt: skip
        return SurfaceSamples.of(self, casting, samples)

    def tell_count(self, study: Any) -> str:
        """Describe the spacing of samples."""
        return f"samples {study.samples.spacing:g} m apart"

    def describe_receivers(self, study: Any) -> str:
        """Describe the sampled surfaces, and their outward side."""
        surfaces, parts = len(study.more["surface_part"][1]), len(study.more["part"][1])
        return (
            f"{show_count(surfaces, 'surface')} of {show_count(parts, 'part')}: walls and roofs, "
            "on their outward side by their winding; surfaces that face straight down get no sun "
            "and are left out"
        )

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number and spacing of samples."""
        return "Samples", (
            f"{len(study.shadow_hours):,}, {study.samples.spacing:g} m apart in their planes, each "
            "standing for an equal share of its surface; a surface too small for one has one in "
            "its middle"
        )

    def find_counted(self, study: Any) -> Counted:
        """Weight each sample by its area."""
        which = np.isfinite(study.shadow_hours)
        return Counted(which, np.asarray(study.more["area"][1]), "m²", "sampled surfaces")


@dataclass(eq=False, kw_only=True)
class SurfaceSamples(SingleReceivers):
    """Samples of surfaces, with results of each surface and each part."""

    samples: Samples

    @classmethod
    def of(cls, kind: ReceiverKind, casting: Casting, samples: Samples) -> "SurfaceSamples":
        """Return samples as receivers; what each has is found when it is asked for."""
        shape = (samples.count,)
        area: Any = OnDemand(shape, np.float64, lambda: samples.area)
        part: Any = OnDemand(shape, np.int32, lambda: samples.part[samples.surface])
        return cls(
            kind, casting, shape, DIMS, area, local=SampledPlaces(samples), part=part,
            samples=samples,
        )  # fmt: skip

    def variables(self) -> Variables:
        """Return the position and normal of each."""
        samples, origin, shape = self.samples, self.casting.scene.origin, self.shape
        z: Any = OnDemand(shape, np.float64, lambda: samples.points[:, 2] + origin[2])
        position: Any = OnDemand((*shape, 3), np.float64, lambda: samples.points + origin)
        normal: Any = OnDemand((*shape, 3), np.float64, lambda: samples.normals)
        axes = (*DIMS, "xyz")
        return {"receiver_z": (DIMS, z), "position": (axes, position), "normal": (axes, normal)}

    def sum_up(self, study: Any) -> Variables:
        """Return the results of each surface and of each part."""
        samples, scene = self.samples, self.casting.scene
        labels, owner = np.unique(np.array(scene.labels())[samples.part], return_inverse=True)
        owner = owner.ravel()
        normal = samples.surface_normal
        turn = np.degrees(np.arctan2(normal[:, 0], normal[:, 1])) - study.true_north
        level = np.hypot(normal[:, 0], normal[:, 1]) < LEVEL
        dims, part, area = ("surface",), ("part",), cast("Any", self.area)
        surface: Any = OnDemand(self.shape, np.int32, lambda: np.array(samples.surface))
        variables: Variables = {
            "area": (DIMS, area),
            "surface_of_sample": (DIMS, surface),
            "surface_part": (dims, owner.astype(np.int32)),
            "surface_kind": (dims, np.array([scene.parts[p].kind for p in samples.part])),
            # A copy: the samples stay with the scene, and results may be written to.
            "surface_area": (dims, samples.surface_area.copy()),
            "surface_azimuth": (dims, np.where(level, np.nan, turn % 360)),
            "surface_tilt": (dims, np.degrees(np.arccos(np.clip(normal[:, 2], -1, 1)))),
            "part": (part, labels),
        }
        first = samples.surface_first

        def weigh(values: ArrayLike) -> list[NDArray[np.float64]]:
            nothing = [0.0, 0.0, np.inf, -np.inf]
            sums = [np.tile(nothing, (count, 1)) for count in (len(first) - 1, len(labels))]
            _weigh(first, owner, samples.share, np.asarray(values, np.float64), *sums)
            return sums

        measured = {
            quantity.name: study.more[quantity.name][1]
            for quantity in study.quantities
            if not quantity.per
        }
        if study.has_hours:
            measured["sun_hours"] = study.sun_hours
        results = {name: weigh(values) for name, values in measured.items()}
        (_, whole), *_ = results.values() or [weigh(np.zeros(samples.count))]
        by_day = study.more.get("sun_hours_by_day")
        days = [] if by_day is None else [weigh(sun) for sun in by_day[1]]
        for k, name in enumerate(("surface", "part")):
            if name == "part":
                variables["part_area"] = (part, whole[:, 0].copy())
            for what, sums in results.items():
                for which, figure in _tell_figures(sums[k]).items():
                    variables[f"{name}_{which}_{what}"] = ((name,), figure)
            if days:
                of_days = [_tell_figures(sums[k]) for sums in days]
                for which in of_days[0]:
                    values = np.array([day[which] for day in of_days])
                    variables[f"{name}_{which}_sun_hours_by_day"] = (("day", name), values)
        return variables


def _tell_figures(sums: NDArray[np.float64]) -> dict[str, NDArray[np.float32]]:
    """Return mean, least and most of the sums that ``_weigh`` finds."""
    area, total, least, most = sums.T
    figures = {"mean": total / area, "least": least, "most": most}
    return {name: figure.astype(np.float32) for name, figure in figures.items()}


@kernel
def _weigh(first, part, share, values, of_surface, of_part):
    """
    Add up the area of samples and their values times the area, and find the least and most value.

    ``first`` (n + 1,) is the first sample of each surface, ``part`` (n,) its part, ``share`` (n,)
    the area of its samples. ``of_surface`` and ``of_part`` have these four as columns.
    """
    for s in range(part.size):
        for sums in (of_surface[s], of_part[part[s]]):
            for k in range(first[s], first[s + 1]):
                v = values[k]
                sums[0] += share[s]
                sums[1] += share[s] * v
                if v < sums[2] or np.isnan(v):
                    sums[2] = v
                if v > sums[3] or np.isnan(v):
                    sums[3] = v


class GivenPoints(PlacedKind):
    """Points from a table, such as windows and sensors."""

    name = "points"
    far_remedy = "give them in its own coordinates, whose bounds umbra inspect prints"

    def place(self, scene: Scene, options: Any) -> PlacedSamples:
        """Return the points, with or without normals."""
        given = check_points(options.points)
        normals = given[:, 3:] if given.shape[1] == 6 else None
        return PlacedSamples(given[:, :3], normals, names=options.names or ())

    def describe_receivers(self, study: Any) -> str:
        """Describe the points."""
        return "the given points"


def read_points(path: str | Path) -> tuple[NDArray[np.float64], list[str]]:
    """
    Read points from a table of comma-separated values.

    Parameters
    ----------
    path : path
        Columns x, y, z, or x, y, z, nx, ny, nz, in this order; with a header line in any
        order, among other columns; ``name`` names the points.

    Returns
    -------
    points : (n, 3) or (n, 6) float64
    names : list of str
        Empty if there are none.

    Raises
    ------
    InputError
        If the file cannot be read, or a value is not a number.
    """
    rows = read_rows(Path(path), "points", "comma-separated x,y,z", _LARGEST, path=path)
    if not rows:
        msg = f"{path}: there are no points; give lines of x,y,z or x,y,z,nx,ny,nz"
        raise InputError(msg, path=path)
    head = [word.strip().lower() for word in rows[0][1]]
    label = None
    if {"x", "y", "z"} <= set(head):
        rows = rows[1:]
        wanted = [name for name in _COLUMNS if name in head]
        if len(wanted) not in {3, 6}:
            msg = f"{path}: a normal needs all of nx, ny, nz; its columns are {', '.join(head)}"
            raise InputError(msg, path=path)
        places = [head.index(name) for name in wanted]
        label = head.index("name") if "name" in head else None
    else:
        places = list(range(6 if len(head) >= 6 else 3))
    points = []
    for line, row in rows:
        try:
            points.append([float(row[index].replace(",", ".")) for index in places])
        except (ValueError, IndexError):
            msg = (
                f"{path}: line {line} has not {len(places)} numbers ({','.join(row)[:60]}); "
                "give x,y,z or x,y,z,nx,ny,nz"
            )
            raise InputError(msg, path=path, line=line) from None
    names = [row[label].strip() for _, row in rows] if label is not None else []
    return check_points(points), names


def check_points(points: ArrayLike | None) -> NDArray[np.float64]:
    """Return points as an array, with unit normals."""
    given = np.array(read_array("points", [] if points is None else points))
    if given.ndim != 2 or given.shape[1] not in {3, 6} or not len(given):
        msg = "receivers 'points' need points (n, 3) or with normals (n, 6); give points="
        raise InputError(msg, option="points")
    wrong = ~np.isfinite(given).all(1)
    if given.shape[1] == 6:
        length = np.linalg.norm(given[:, 3:], axis=1)
        wrong |= length == 0
        given[:, 3:] /= np.where(length > 0, length, 1.0)[:, None]
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        msg = (
            f"{int(wrong.sum())} points are not finite or have a normal of length 0 "
            f"(first: point {first + 1}); correct or remove them"
        )
        raise InputError(msg, point=first)
    return given
