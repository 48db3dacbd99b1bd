"""What is seen from infinitely far: elevations, and views from above."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["ElevationView", "ViewFromAbove"]


class ElevationView(ReceiverKind):
    """Facades, seen level from an azimuth."""

    name = "elevation"

    def is_asked(self, receivers: str) -> bool:
        """Tell whether a level direction is named."""
        return _find_tilt(receivers) == 0


class ViewFromAbove(ReceiverKind):
    """What is seen from an azimuth and looking down."""

    name = "view"

    def is_asked(self, receivers: str) -> bool:
        """Tell whether a direction that looks down is named."""
        return _find_tilt(receivers) > 0


def _find_tilt(receivers: str) -> float:
    """Read how far a view looks down [degrees]; refuse what is no direction."""
    from umbra.study.views import find_direction  # noqa: PLC0415  (it loads what counts)

    return find_direction(receivers)[1]
