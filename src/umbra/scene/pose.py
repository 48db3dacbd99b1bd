"""Scenes at a time: parts and lights where an animation puts them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.scene.lights import Light
from umbra.scene.mesh import Mesh, Part
from umbra.scene.rig import Animation, RigBinding
from umbra.scene.scene import Scene

__all__ = ["place_light", "place_part", "pose"]

Placed = tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]


def pose(scene: Scene, time: float, animation: int | str = 0) -> Scene:
    """
    Return a scene at a time of one of its animations.

    Parts keep their number and order. One that moves as a whole keeps its very mesh
    and gets another ``transform``; one that bends (a skin, morph targets) gets a mesh
    with the same faces. Whatever the animation does not move stands where the file
    puts it.

    Parameters
    ----------
    scene : Scene
        As read, or posed before: poses do not add up.
    time : float
        [s]; before the animation's beginning it stands as at its beginning, after its
        end as at its end.
    animation : int or str
        Its index in ``scene.animations``, or its name; ``all`` plays them together, as
        is meant where an exporter gives each thing its own. Where two move the same,
        the later one does.

    Returns
    -------
    scene : Scene

    Raises
    ------
    InputError
        If there is no such animation, or the time is not finite.
    """
    if not np.isfinite(time):
        msg = f"the time of a pose must be finite; got {time} s"
        raise InputError(msg, time=time)
    chosen = _find_animations(scene, animation)
    rigs = {id(part.binding.rig): part.binding.rig for part in scene.parts if part.binding}
    rigs |= {id(light.binding.rig): light.binding.rig for light in scene.lights if light.binding}
    placed = {
        key: rig.place(
            tuple(track for one in chosen if one in rig.animations for track in one.tracks), time
        )
        for key, rig in rigs.items()
    }
    bent: dict[tuple[int, int], Mesh] = {}  # parts that share a shape and a node share a mesh
    parts = [
        place_part(part, part.binding, placed[id(part.binding.rig)], bent) if part.binding else part
        for part in scene.parts
    ]
    lights = [
        place_light(light, light.binding, placed[id(light.binding.rig)][0])
        if light.binding
        else light
        for light in scene.lights
    ]
    return replace(scene, parts=tuple(parts), lights=tuple(lights))


def place_part(
    part: Part, binding: RigBinding, placed: Placed, bent: dict[tuple[int, int], Mesh]
) -> Part:
    """Return a part where a rig's nodes, as from `Rig.place`, put it."""
    places, weights = placed
    shape, mesh = binding.shape, part.mesh
    if shape is not None:
        moved = weights.get(binding.node)
        # Without a track and a skin all nodes show the same.
        key = id(shape), -1 if moved is None else binding.node
        if key not in bent:
            bent[key] = shape.pose(places, moved)
        mesh = bent[key]
    if shape is not None and shape.skin is not None:
        transform = binding.base  # a skin hangs on its joints, wherever its node is
    else:
        transform = binding.base @ places[binding.node]
    return replace(part, mesh=mesh, transform=transform)


def place_light(light: Light, binding: RigBinding, places: NDArray[np.float64]) -> Light:
    """Return a light where its node is: it shines along the node's -z."""
    place = places[binding.node]
    toward = place[:3, 2]
    if not light.is_point:
        return replace(light, position=np.append(toward, 0.0))
    if light.axis is not None:
        return replace(light, position=place[:, 3], axis=-toward, up=place[:3, 1])
    return replace(light, position=place[:, 3])


def _find_animations(scene: Scene, animation: int | str) -> tuple[Animation, ...]:
    found = scene.animations
    if not found:
        msg = "the scene has no animation; export the file with it, or leave the time out"
        raise InputError(msg)
    if isinstance(animation, str):
        for one in found:
            if one.name == animation:
                return (one,)
        if animation == "all":
            return found
        if not animation.isdecimal():
            names = ", ".join(f"'{one.name}'" for one in found[:12])
            msg = f"there is no animation '{animation}'; the scene has {names}"
            raise InputError(msg, animation=animation)
    index = int(animation)
    if not 0 <= index < len(found):
        msg = f"there is no animation {index}; the scene has {len(found)}, counted from 0"
        raise InputError(msg, animation=index)
    return (found[index],)
