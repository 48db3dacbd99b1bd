"""Framebuffers of other programs, in which umbra counts if they can hold what it needs."""

import numpy as np

from umbra.errors import UmbraError
from umbra.gl.context import Device
from umbra.gl.plan import STENCIL_MOST, VolumePlan

__all__ = ["check_counting"]


def check_counting(device: Device, plan: VolumePlan) -> None:
    """Raise `UmbraError` if the framebuffer in use lacks depth or stencil for a plan's counts."""
    is_default = not device.gl.integers(0x8CA6)[0]
    # The default framebuffer's attachments have other names.
    depth = _count_bits(device, 0x1801 if is_default else 0x8D00, 0x8216)
    stencil = _count_bits(device, 0x1802 if is_default else 0x8D20, 0x8217)
    if stencil < 8 or not depth:
        msg = (
            f"the framebuffer has {depth} bits of depth and {stencil} of stencil, and counting "
            "needs depth and 8 bits; attach a depth-stencil buffer, or draw into umbra's own Target"
        )
        raise UmbraError(msg, bits=stencil, depth=depth)
    if plan.statistics.counts_in == "float":
        most = plan.statistics.deepest
        msg = (
            f"up to {most:,} volumes may overlap, and another program's framebuffer counts "
            f"{STENCIL_MOST}; draw into umbra's own Target"
        )
        raise UmbraError(msg, most=most)


def _count_bits(device: Device, place: int, size: int) -> int:
    """Query the size of an attachment of the framebuffer in use, 0 if there is none [bits]."""
    kind, bits = np.zeros(1, np.int32), np.zeros(1, np.int32)
    for name, found in ((0x8CD0, kind), (size, bits)):
        if name == 0x8CD0 or kind[0]:
            device.gl.GetFramebufferAttachmentParameteriv(0x8CA9, place, name, found.ctypes.data)
    return int(bits[0])
