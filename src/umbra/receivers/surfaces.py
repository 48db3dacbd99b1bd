"""Walls and roofs, sampled in their own planes."""

from umbra.receivers.kind import ReceiverKind

__all__ = ["SampledSurfaces"]


class SampledSurfaces(ReceiverKind):
    """Walls and roofs, sampled in their own planes."""

    name = "surfaces"
    is_raster = False
