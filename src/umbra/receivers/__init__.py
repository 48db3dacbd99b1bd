"""
Receivers: what shadows fall on in a study, one file a kind.

Names of kinds are compared here and nowhere else: whoever asks what kind receivers are gives
the kind a method instead.
"""

from umbra.receivers.camera import CameraPicture
from umbra.receivers.ground import GroundPlane
from umbra.receivers.kind import ReceiverKind
from umbra.receivers.points import GivenPoints
from umbra.receivers.surfaces import SampledSurfaces
from umbra.receivers.top import TopmostSurface
from umbra.receivers.view import ElevationView, ViewFromAbove

__all__ = ["KINDS", "ReceiverKind"]

KINDS: dict[str, ReceiverKind] = {
    kind.name: kind
    for kind in (
        GroundPlane(), TopmostSurface(), ElevationView(), ViewFromAbove(), CameraPicture(),
        SampledSurfaces(), GivenPoints(),
    )
}  # fmt: skip
"""Every kind by the name that results say."""
