"""glTF's lights (KHR_lights_punctual), in the file's own units: candela and lux."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.gltf_buffers import find_item
from umbra.scene import Light
from umbra.scene.pose import place_light
from umbra.scene.rig import Binding, Rig

__all__ = ["read_lights"]

EXTENSION = "KHR_lights_punctual"


def read_lights(
    tree: dict[str, Any], node: dict[str, Any], rig: Rig, slot: int, places: NDArray[np.float64]
) -> list[Light]:
    """
    Read the light at a node, if it has one.

    Points and spots weaken with the square of the distance.

    Parameters
    ----------
    tree, node : dict
        glTF JSON.
    rig : Rig
    slot : int
        The node's place in the rig.
    places : (n, 4, 4) float64
        Of the rig's nodes.

    Returns
    -------
    lights : list of Light
        One or none.

    Raises
    ------
    InputError
        If it is not there, or of no kind that is known.
    """
    link = node.get("extensions", {}).get(EXTENSION)
    if link is None:
        return []
    number = link["light"]
    given = find_item(tree.get("extensions", {}).get(EXTENSION, {}), "lights", number, EXTENSION)
    strength = max(float(given.get("intensity", 1.0)), 0.0)
    red, green, blue = (strength * max(float(v), 0.0) for v in given.get("color", (1, 1, 1)))
    color, kind = (red, green, blue), given.get("type")
    reach = float(given.get("range", np.inf))
    square = (0.0, 0.0, 1.0)
    if kind == "directional":
        light = Light(np.array([0, 0, 1.0, 0]), color)
    elif kind == "point":
        light = Light(np.array([0, 0, 0, 1.0]), color, range=reach, attenuation=square)
    elif kind == "spot":
        cone = given.get("spot", {})
        outer = min(np.degrees(float(cone.get("outerConeAngle", np.pi / 4))), 90.0)
        inner = min(np.degrees(float(cone.get("innerConeAngle", 0.0))), outer)
        light = Light(
            np.array([0, 0, 0, 1.0]),
            color,
            np.array([0, 0, -1.0]),
            float(outer),
            float(inner),
            reach,
            square,
        )
    else:
        msg = f"{EXTENSION}: light {number} is of the kind {kind!r}; export it again"
        raise InputError(msg)
    binding = Binding(rig, slot)
    placed = place_light(light, binding, places)
    return [replace(placed, binding=binding) if rig.animations else placed]
