"""The ground as a plane."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import PlanKind

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["GroundPlane"]


class GroundPlane(PlanKind):
    """The ground as a plane."""

    name = "ground"
    is_level = True
    lies_under_roofs = True
    what_counts = "open ground, not under buildings"

    def is_asked(self, receivers: str) -> bool:
        """Tell whether it is named; ``auto`` may turn out to be the other plan."""
        return receivers in {"ground", "auto"}

    def describe_receivers(self, study: "Study") -> str:
        """Say where the ground lies."""
        return f"the level ground at z = {study.ground:.6g} m, also under buildings"

    def find_open(self, study: "Study") -> NDArray[np.bool_]:
        """Tell which cells lie under no roof."""
        return study.heights <= study.ground + 1e-6
