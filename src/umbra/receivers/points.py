"""Points from a table, such as windows and sensors."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["GivenPoints"]


class GivenPoints(ReceiverKind):
    """Points from a table, such as windows and sensors."""

    name = "points"
    is_raster = False
