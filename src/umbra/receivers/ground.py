"""The ground as a plane."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["GroundPlane"]


class GroundPlane(ReceiverKind):
    """The ground as a plane."""

    name = "ground"
    is_plan = True
