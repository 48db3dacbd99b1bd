"""
Soft shadows on OpenGL: what share of each light reaches each pixel, as a picture.

    methods.py     what a method is; samples; the methods of one scene, and for which lights
    wedges.py      the hard count, corrected along silhouette edges; depth keys
    weng.py        scaled layers of the hard volume, stacked
    layers.py      what to draw of all layers of a light: one list of triangles
    growth.py      the points of casters that are enlarged, and which caster a pixel shows

The hard volumes are the renderer's own. A light's visibility takes the stencil's place in
its light pass (``shading.py``). The answers are those of ``umbra.soft`` on the CPU.
"""

from umbra.gl.soft.methods import SoftLights, SoftMethods, Softness, Visibility

__all__ = ["SoftLights", "SoftMethods", "Softness", "Visibility"]
