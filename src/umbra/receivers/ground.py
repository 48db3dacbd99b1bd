"""The ground as a plane."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.level import Level, has_terrain
from umbra.receivers.plan import PlaneTile, PlanKind, PlanRaster
from umbra.scene import Scene

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["GroundPlane"]

_LEVEL = 1e-6  # m above the ground that are rounding


class GroundPlane(PlanKind):
    """The plane z = ground, also under buildings."""

    name = "ground"
    is_level = True
    lies_under_roofs = True
    what_counts = "open ground, not under buildings"
    tile = PlaneTile

    def choose_level(self, assumed: Level) -> float:
        """Choose the height at which the middle one of the model's buildings stands."""
        return assumed.middle

    def find_receiver_z(self, laid: PlanRaster) -> NDArray[np.float64]:
        """Return the ground's height everywhere."""
        return np.full(laid.shape, laid.ground)

    def describe_level(
        self, scene: Scene, level: float, assumed: Level | None, bare: float
    ) -> dict[str, object]:
        """Tell that a model's own ground is not shown, or that its buildings stand unevenly."""
        if has_terrain(scene):
            told = (
                f"the model brings ground of its own, of which a plane at z = {level:.6g} m shows "
                "nothing; receivers='top' shows the shadows on it"
            )
            return {"assumption": told}
        return {} if assumed is None else assumed.describe(level)

    def describe_receivers(self, study: "Study") -> str:
        """Describe the ground plane."""
        return f"the level ground at z = {study.ground:.6g} m, including under buildings"

    def find_open(self, study: "Study") -> NDArray[np.bool_]:
        """Tell which cells lie under no roof."""
        return study.heights <= study.ground + _LEVEL
