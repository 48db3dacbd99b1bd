"""Walls and roofs, sampled in their own planes."""

from typing import TYPE_CHECKING, Any

import numpy as np

from umbra.receivers.counted import Counted
from umbra.receivers.kind import SampleKind

if TYPE_CHECKING:
    from umbra.study import PointStudy

__all__ = ["SurfaceSamples"]


class SurfaceSamples(SampleKind):
    """Walls and roofs, sampled in their own planes."""

    name = "surfaces"
    follows_extent = False
    spot = "sample"
    formats = ("csv", "glb")
    tables = {  # noqa: RUF012  (a constant)
        "samples.csv": "sample", "surfaces.csv": "surface", "parts.csv": "part",
    }  # fmt: skip

    def describe_receivers(self, study: "PointStudy") -> str:
        """Say how many surfaces are sampled, and which side of them."""
        surfaces, parts = len(study.more["surface_part"][1]), len(study.more["part"][1])
        return (
            f"{surfaces:,} surface{'s' if surfaces > 1 else ''} of {parts:,} "
            f"part{'s' if parts > 1 else ''}: walls and roofs, on the side that their winding "
            "calls outward; what faces straight down never sees the sun and is left out"
        )

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Say how many samples there are, and how far apart."""
        return "Samples", (
            f"{len(study.shadow_hours):,}, {study.samples.spacing:g} m apart in their planes, each "
            "standing for an equal share of its surface; a surface too small for one has one in "
            "its middle"
        )

    def find_counted(self, study: "PointStudy") -> Counted:
        """Weigh each sample by the area that it stands for."""
        which = np.isfinite(study.shadow_hours)
        return Counted(which, np.asarray(study.more["area"][1]), "m²", "sampled surfaces")
