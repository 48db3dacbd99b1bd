"""The topmost surface of a plan."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.kind import Request
from umbra.receivers.level import Level, has_terrain
from umbra.receivers.plan import PlanKind, PlanRaster, TopmostTile
from umbra.scene import Scene

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["TopmostSurface"]


class TopmostSurface(PlanKind):
    """Roofs, terrain, and the assumed ground where nothing of the model lies."""

    name = "top"
    has_roofs = True
    what_counts = "all that is seen from above"
    tile = TopmostTile

    def has_end(self, request: Request, *, is_assumed: bool) -> bool:
        """Tell whether the model's own terrain ends, with no ground that anyone named beyond."""
        return is_assumed and has_terrain(request.scene)

    def find_receiver_z(self, laid: PlanRaster) -> NDArray[np.float64]:
        """Return the height of the topmost surface."""
        return laid.heights

    def describe_level(
        self, scene: Scene, level: float, assumed: Level | None, bare: float
    ) -> dict[str, object]:
        """Tell where the ground is assumed, or that the model's buildings stand unevenly."""
        if assumed is None:
            return {}
        if bare > 0:
            told = (
                f"nothing of the model lies under {100 * bare:.3g} % of the plan; there the ground "
                f"is assumed level at z = {level:.6g} m, where the lowest of its things stands "
                "(ground=)"
            )
            return {"assumption": told, "assumed_ground_share": float(bare)}
        return assumed.describe(level)

    def describe_receivers(self, study: "Study") -> str:
        """Describe the topmost surface."""
        return f"the topmost surface: roofs, terrain, and the ground at z = {study.ground:.6g} m"
