"""Whatever is topmost in the plan."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["TopmostSurface"]


class TopmostSurface(ReceiverKind):
    """Whatever is topmost in the plan."""

    name = "top"
    is_plan = True
