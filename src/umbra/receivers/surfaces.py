"""Walls and roofs, sampled in their own planes."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.counted import Counted
from umbra.receivers.kind import Request, SampleKind, Variables
from umbra.receivers.samples import LEVEL, Samples, sample_surfaces
from umbra.receivers.single import DIMS, SingleReceivers
from umbra.scene.places import Places

if TYPE_CHECKING:
    from umbra.study.result import Study

__all__ = ["SampledSurfaces", "SurfaceSamples"]


class SampledSurfaces(SampleKind):
    """Walls and roofs, sampled in their own planes."""

    name = "surfaces"
    follows_extent = False
    spot = "sample"
    formats = ("csv", "glb")
    tables = {  # noqa: RUF012  (a constant)
        "samples.csv": "sample", "surfaces.csv": "surface", "parts.csv": "part",
    }  # fmt: skip

    def lay_out(self, request: Request) -> "SurfaceSamples":
        """Sample the surfaces of all parts, or of those chosen."""
        on, spacing = request.options.on, request.options.spacing
        casting = request.prepare()
        left = None if request.canopy is None else request.canopy.find_receivers(request.scene, on)
        samples = sample_surfaces(request.scene, spacing, on, left)
        return SurfaceSamples(
            self, casting, samples.area.shape, DIMS, samples.area,
            local=Places(samples.points, samples.normals), part=samples.part[samples.surface],
            samples=samples,
        )  # fmt: skip

    def describe_receivers(self, study: "Study") -> str:
        """Describe the sampled surfaces, and their outward side."""
        surfaces, parts = len(study.more["surface_part"][1]), len(study.more["part"][1])
        return (
            f"{surfaces:,} surface{'s' if surfaces > 1 else ''} of {parts:,} "
            f"part{'s' if parts > 1 else ''}: walls and roofs, on their outward side by "
            "their winding; surfaces that face straight down get no sun and are left out"
        )

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Describe the number and spacing of samples."""
        return "Samples", (
            f"{len(study.shadow_hours):,}, {study.samples.spacing:g} m apart in their planes, each "
            "standing for an equal share of its surface; a surface too small for one has one in "
            "its middle"
        )

    def find_counted(self, study: "Study") -> Counted:
        """Weigh each sample by the area that it stands for."""
        which = np.isfinite(study.shadow_hours)
        return Counted(which, np.asarray(study.more["area"][1]), "m²", "sampled surfaces")


@dataclass(eq=False)
class SurfaceSamples(SingleReceivers):
    """Samples of surfaces, with results of each surface and each part."""

    samples: Samples = field(kw_only=True)

    def sum_up(self, study: "Study") -> Variables:
        """Return the results of each surface and of each part."""
        samples, scene = self.samples, self.casting.scene
        labels, owner = np.unique(np.array(scene.labels())[samples.part], return_inverse=True)
        owner = owner.ravel()
        normal = samples.surface_normal
        turn = np.degrees(np.arctan2(normal[:, 0], normal[:, 1])) - study.site.true_north
        level = np.hypot(normal[:, 0], normal[:, 1]) < LEVEL
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

            def weigh(
                sun: NDArray[np.float32], index: Any = index, count: int = count, total: Any = total
            ) -> dict[str, NDArray[np.float32]]:
                mean = np.bincount(index, samples.area * sun, count) / total
                least, most = np.full(count, np.inf), np.full(count, -np.inf)
                np.minimum.at(least, index, sun)
                np.maximum.at(most, index, sun)
                figures = {"mean": mean, "least": least, "most": most}
                return {k: figure.astype(np.float32) for k, figure in figures.items()}

            for which, figure in weigh(study.sun_hours).items():
                found[f"{name}_{which}_sun_hours"] = ((name,), figure)
            if by_day is not None:
                each = [weigh(sun) for sun in by_day[1]]
                for which in each[0]:
                    values = np.array([day[which] for day in each])
                    found[f"{name}_{which}_sun_hours_by_day"] = (("day", name), values)
        return found
