"""Whatever is topmost in the plan."""

from typing import TYPE_CHECKING

from umbra.receivers.kind import PlanKind

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["TopmostSurface"]


class TopmostSurface(PlanKind):
    """Whatever is topmost in the plan."""

    name = "top"
    has_roofs = True
    what_counts = "all that is seen from above"

    def describe_receivers(self, study: "Study") -> str:
        """Say what is topmost."""
        return f"whatever is topmost: roofs, terrain, and the ground at z = {study.ground:.6g} m"
