"""
Counts downward from 1, in alpha: fronts halve first, backs double, and the maximum ends it.

What is lit has never been above 1, so nothing is clamped that is not lit: this counts up to
8 exactly, and needs one rectangle of 1/2 under the maximum equation to attenuate.
"""

from umbra.gl.masks.method import DOUBLE, HALVE, Method, Step

__all__ = ["METHOD"]

METHOD = Method(
    name="max",
    format="rgba8",
    write="alpha",
    start=1.0,
    up=HALVE,
    down=DOUBLE,
    first="up",
    at_once=7,
    lit=(0.75, 1.0),
    # Shadow is 1/2 at most: inverted and doubled it is 1, and light still 0.
    black=(Step("invert", 1.0), DOUBLE, Step("invert", 1.0)),
    attenuated=(Step("max", 0.5),),
)
