"""What is seen from infinitely far: elevations, and views from above."""

from typing import TYPE_CHECKING

from umbra.receivers.kind import ReceiverKind

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["ElevationView", "ViewFromAbove"]


class ElevationView(ReceiverKind):
    """Facades, seen level from an azimuth."""

    name = "elevation"

    def is_asked(self, receivers: str) -> bool:
        """Tell whether a level direction is named."""
        return _find_tilt(receivers) == 0

    def describe_receivers(self, study: "Study") -> str:
        """Say from where the model is seen."""
        facts = study.facts
        azimuth, tilt = facts["view_azimuth_deg"], facts.get("view_tilt_deg")
        words = f"what is seen from azimuth {azimuth:g}°, clockwise from true north"
        return f"{words}, looking down {tilt:g}°" if tilt else f"{words}, level and orthographic"


class ViewFromAbove(ElevationView):
    """What is seen from an azimuth and looking down."""

    name = "view"

    def is_asked(self, receivers: str) -> bool:
        """Tell whether a direction that looks down is named."""
        return _find_tilt(receivers) > 0


def _find_tilt(receivers: str) -> float:
    """Read how far a view looks down [degrees]; refuse what is no direction."""
    from umbra.study.views import find_direction  # noqa: PLC0415  (it loads what counts)

    return find_direction(receivers)[1]
