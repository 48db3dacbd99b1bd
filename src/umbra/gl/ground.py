"""The endless ground plane, behind a model's own floors in the same plane."""

from collections.abc import Mapping
from dataclasses import replace

from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State

__all__ = ["RINGS", "draw_ground"]

RINGS = 28
"""Number of rings, ``RINGS`` in ``ground.vert.glsl``."""

_SURFACE = Pass(depth_test="less", depth_write=True, color_write=True)
# A floor's own triangles round differently: behind by a few steps of depth, they stay visible.
_STEPS, _STEPS_24_BITS = 8.0, 2.0  # 1e-6 of the distance; absolute with 24 bits


def draw_ground(
    state: State,
    program: Program,
    projection: Projection,
    ground: float,
    uniforms: Mapping[str, object],
    how: Pass = _SURFACE,
) -> None:
    """
    Draw the plane z = ``ground``, relative to the scene's origin [m].

    The program is of ``ground.vert.glsl`` with ``RINGS`` defined; ``uniforms`` are its others.
    Its depths are the same in every pass.
    """
    steps = _STEPS if projection.reverses_depth else _STEPS_24_BITS
    state.use(replace(how, polygon_offset=(0.0, steps)))
    height = float(ground - projection.eye[2])
    program.set(projection=projection.uniforms["projection"], height=height)
    program.set(**uniforms)
    program.draw(4 * RINGS * 6)
