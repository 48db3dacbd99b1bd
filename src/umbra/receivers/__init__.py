"""
Receivers: what shadows fall on in a study, one file a kind.

Names of kinds are compared here and nowhere else: whoever asks what kind receivers are gives
the kind a method instead.
"""

from umbra.receivers.camera import CameraPicture
from umbra.receivers.ground import GroundPlane
from umbra.receivers.kind import ReceiverKind
from umbra.receivers.points import GivenPoints
from umbra.receivers.surfaces import SurfaceSamples
from umbra.receivers.top import TopmostSurface
from umbra.receivers.view import ElevationView, ViewFromAbove

__all__ = ["KINDS", "ReceiverKind", "find_kind"]

KINDS: dict[str, ReceiverKind] = {
    kind.name: kind
    for kind in (
        GroundPlane(), TopmostSurface(), CameraPicture(), SurfaceSamples(), GivenPoints(),
        ElevationView(), ViewFromAbove(),  # these refuse what names none
    )
}  # fmt: skip
"""Every kind by the name that results say."""


def find_kind(receivers: str) -> ReceiverKind:
    """
    Find the kind that a study's option names; of ``auto``, some plan.

    Raises
    ------
    InputError
        If it names none.
    """
    return next(kind for kind in KINDS.values() if kind.is_asked(receivers))
