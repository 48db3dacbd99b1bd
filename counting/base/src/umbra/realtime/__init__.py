"""
The engine for other programs: pictures with shadows, and shadow volumes in a caller's stencil.

    Renderer        draws a scene, into a texture of its own or into the caller's framebuffer
    ShadowVolumes   counts shadows in the caller's stencil, by the caller's own depth
    VolumePlanner   plans volumes as arrays, for any graphics API

The first two work in a context of their own or in a `moderngl.Context` that the caller gives, whose
OpenGL state every call gives back. Matrices are numpy arrays (4, 4) for column vectors. Studies do
not import this package; it builds on ``umbra.gl`` alone.
"""

from umbra.gl.matrices import DEPTHS
from umbra.gl.plan_arrays import PlannedVolumes, VolumePass
from umbra.gl.visible_faces import PickedPoint
from umbra.realtime.renderer import Renderer
from umbra.realtime.shadow_volumes import ShadowCount, ShadowVolumes
from umbra.realtime.volume_planner import VolumePlanner

__all__ = [
    "DEPTHS", "PickedPoint", "PlannedVolumes", "Renderer", "ShadowCount", "ShadowVolumes",
    "VolumePass", "VolumePlanner",
]  # fmt: skip
