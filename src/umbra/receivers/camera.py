"""What a camera sees."""

from typing import TYPE_CHECKING

import numpy as np

from umbra.receivers.kind import ReceiverKind

if TYPE_CHECKING:
    from umbra.study import Study

__all__ = ["CameraPicture"]


class CameraPicture(ReceiverKind):
    """What a camera sees."""

    name = "camera"
    has_scale = False
    formats = ()

    def describe_receivers(self, study: "Study") -> str:
        """Say from where and how the camera looks."""
        facts = study.facts
        eye, target = (
            ", ".join(f"{float(v):g}" for v in np.asarray(facts[name]).ravel())
            for name in ("eye", "target")
        )
        return f"what is seen from {eye} toward {target}, {facts['fov_deg']:g}° high"

    def find_counted(self, study: "Study") -> None:
        """Count none: a pixel has no area."""
