"""What a camera sees."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["CameraPicture"]


class CameraPicture(ReceiverKind):
    """What a camera sees."""

    name = "camera"
    has_scale = False
