"""
Counts in the exponents of a half-float target: doubling and halving lose no bit.

From 2^-8 it goes up 23 times and down 6 times without leaving the normal numbers, so that
volumes may come in any order, convex or not. What is lit is *equal* to the start.
"""

from umbra.gl.masks.method import DOUBLE, HALVE, Method

__all__ = ["METHOD"]

_START = 2.0**-8

METHOD = Method(
    name="half",
    format="rgba16f",
    write=True,
    start=_START,
    up=DOUBLE,
    down=HALVE,
    first="up",
    at_once=23,
    lit=(_START, _START),
    counts=True,
)
