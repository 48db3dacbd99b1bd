"""
Shadow masks without a stencil (Roettger, Irion, Ertl 2002), and the stencil as one of them.

    Plan -> pieces -> painter -> a method's target -> three rectangles -> lit or not
            convex,   doubles
            at_once   and halves

A method is one ``Method``: where it counts, from which value, what a front and a back do to
it, and which rectangles leave 0 and 1. To add one, write its record and list it in ``MASKS``,
both in ``methods.py``.
"""

from umbra.gl.masks.methods import MASKS, Method

__all__ = ["MASKS", "Method"]
