"""
The same counts in the screen's own colours: for framebuffers that have no alpha.

The scene is drawn after the mask, multiplied by it; until then only its depth is there.
"""

from dataclasses import replace

from umbra.gl.masks import alpha

__all__ = ["METHOD"]

METHOD = replace(alpha.METHOD, name="screen", write="rgb")
