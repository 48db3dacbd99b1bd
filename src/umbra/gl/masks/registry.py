"""The methods by their names."""

from collections.abc import Callable
from importlib import import_module

from umbra.gl.context import Device
from umbra.gl.geometry import Geometry
from umbra.gl.masks.counter import MaskCounter
from umbra.gl.masks.method import Method

__all__ = ["NAMES", "find_method", "make"]

NAMES = {"alpha": "alpha", "screen": "screen", "max": "maximum", "half": "half"}
"""Each method's file."""


def find_method(name: str) -> Method:
    """
    Find a method.

    Parameters
    ----------
    name : str
        Of ``NAMES``.

    Returns
    -------
    method : Method
    """
    found: Method = import_module(f"umbra.gl.masks.{NAMES[name]}").METHOD
    return found


def make(
    name: str,
    device: Device,
    geometry: Geometry,
    warn: Callable[[str], object] = lambda _: None,
) -> MaskCounter:
    """
    Make the counter of a method.

    Parameters
    ----------
    name : str
        Of ``NAMES``.
    device : Device
    geometry : Geometry
    warn : callable
        Told, in a line, where the method may be wrong.

    Returns
    -------
    counter : MaskCounter
    """
    return MaskCounter(device, geometry, find_method(name), warn=warn)
