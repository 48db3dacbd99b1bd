"""
Counts in the destination's alpha: 1/4 is lit, fronts double it, backs halve it.

As printed, fronts come first; at 1 they are clamped and the count is lost, which two
fronts and a back of one volume turn into light. Backs first need room below instead, and
8 bits have room for six of them: the value becomes min(1, s 2^(fronts - backs)).
"""

from dataclasses import replace

from umbra.gl.masks.method import DOUBLE, HALVE, Method, Step

__all__ = ["METHOD", "PRINTED"]

INVERT = Step("invert", 1.0)

METHOD = Method(
    name="alpha",
    format="rgba8",
    write="alpha",
    start=0.25,
    up=DOUBLE,
    down=HALVE,
    first="down",
    at_once=6,
    lit=(0.75, 1.0),
    # Clamped to 1/4 -> 1/2 and 1, then 1/2 and 0; the figure's last "/2" must double.
    black=(DOUBLE, INVERT, DOUBLE),
    attenuated=(DOUBLE, INVERT, Step("add", 0.5)),
)

PRINTED = replace(METHOD, name="alpha, fronts first", first="up", at_once=1)
"""The order of the paper: one convex volume at a time."""
