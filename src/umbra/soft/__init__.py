"""
Soft shadows: what share of a light with a size each visible point sees.

    area.py     the lights                                     AreaLight
    samples.py  many hard shadows averaged: the reference      visibility(...)
    wedges.py   hard count, corrected along silhouette edges   visibility(...)
    coverage.py its kernels: where to look, what part of the light an edge takes
    weng.py     scaled layers of the hard volume, stacked      visibility(...)

A method is a module with a function ``visibility(counter, view, frame, camera, light)``
that gives (rows, cols) float32: 1 is fully lit, 0 umbra, 1 where nothing is seen. The counter
is a ``FrameCounter``, view and frame are what it sees with the camera, the light is an
``AreaLight``. To add one, write it and name it in `umbra.methods.SOFT`.
"""

from collections.abc import Callable
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.methods import SOFT
from umbra.soft.area import SUN_RADIUS, AreaLight, ball_light, rectangle_light

__all__ = [
    "SUN_RADIUS",
    "AreaLight",
    "ball_light",
    "find_method",
    "rectangle_light",
]


def find_method(name: str) -> Callable[..., NDArray[np.float32]]:
    """Return a method's ``visibility`` by its name, loading only this one; `InputError` if none."""
    if name not in SOFT:
        msg = f"there is no method '{name}' for soft shadows; there are {', '.join(SOFT)}"
        raise InputError(msg, method=name)
    method: Callable[..., NDArray[np.float32]] = import_module(f"umbra.soft.{name}").visibility
    return method
