"""
Soft shadows on OpenGL: what share of each light reaches each pixel, as a picture.

    visibility.py  what a method is; the picture that it fills     Visibility, Stack
    samples.py     hard shadows of many points of a light, averaged
    wedges.py      the hard count, corrected along silhouette edges; keys.py: how far a pixel sees
    weng.py        scaled layers of the hard volume, stacked
    layers.py      what to draw of all layers of a light: one list of triangles
    growth.py      the points of casters that are enlarged, and which caster a pixel shows
    methods.py     the methods of one scene; which lights of a picture they are for

The hard volumes are the renderer's own. A light's visibility takes the stencil's place in
its light pass (``shading.py``). The answers are those of ``umbra.soft`` on the CPU.
"""

from umbra.gl.soft.methods import SoftLights, SoftMethods, Softness
from umbra.gl.soft.visibility import Visibility

__all__ = ["SoftLights", "SoftMethods", "Softness", "Visibility"]
