"""Points from a table, such as windows and sensors."""

from typing import TYPE_CHECKING, Any

import numpy as np

from umbra.receivers.counted import Counted
from umbra.receivers.kind import SampleKind

if TYPE_CHECKING:
    from umbra.study import PointStudy

__all__ = ["GivenPoints"]


class GivenPoints(SampleKind):
    """Points from a table, such as windows and sensors."""

    name = "points"
    belongs_to_parts = False
    spot = "point"
    formats = ("csv", "geojson", "gpkg")
    tables = {"points.csv": "sample"}  # noqa: RUF012  (a constant)

    def describe_receivers(self, study: "PointStudy") -> str:
        """Say whose points they are."""
        return "the points that were given"

    def describe_places(self, study: Any) -> tuple[str, str]:
        """Say how many points there are, and how many of them have a normal."""
        count = len(study.shadow_hours)
        free = int(np.isnan(study.places.normals).any(1).sum())
        words = f"{count:,}, {count - free:,} with a normal" if free else f"{count:,}, with normals"
        return "Points", words + ("; the others are turned to every sun" if free else "")

    def find_counted(self, study: "PointStudy") -> Counted:
        """Count each point once."""
        which = np.isfinite(study.shadow_hours)
        return Counted(which, np.ones(which.shape), "points", "points")
