"""The ground as a plane."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["GroundPlane"]


class GroundPlane(ReceiverKind):
    """The ground as a plane."""

    name = "ground"
    is_plan = True

    def is_asked(self, receivers: str) -> bool:
        """Tell whether it is named; ``auto`` may turn out to be the other plan."""
        return receivers in {"ground", "auto"}
