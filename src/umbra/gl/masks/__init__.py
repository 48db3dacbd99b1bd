"""
Shadow masks without a stencil (Roettger, Irion, Ertl 2002), and the stencil as one of them.

    Plan -> pieces -> painter -> a method's target -> three rectangles -> lit or not
            convex,   doubles
            at_once   and halves

A method is one ``Method`` in one file: where it counts, from which value, what a front and
a back do to it, and which rectangles leave 0 and 1. To add one, write that file and name
it in ``NAMES``.
"""

from umbra.gl.masks.method import Method
from umbra.gl.masks.registry import NAMES, find_method, make

__all__ = ["NAMES", "Method", "find_method", "make"]
