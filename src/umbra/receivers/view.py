"""What is seen from infinitely far: elevations, and views from above."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["ElevationView", "ViewFromAbove"]


class ElevationView(ReceiverKind):
    """Facades, seen level from an azimuth."""

    name = "elevation"


class ViewFromAbove(ReceiverKind):
    """What is seen from an azimuth and looking down."""

    name = "view"
