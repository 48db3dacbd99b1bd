"""
Scenes from parts: unused vertices dropped, a local origin subtracted.

Parts and lights can be posed at a time of an animation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.scene.lights import Light
from umbra.scene.mesh import Mesh, Part, change
from umbra.scene.numbers import check_reach
from umbra.scene.rig import Animation, RigBinding
from umbra.scene.scene import Scene

__all__ = ["find_animations", "make_scene", "move_parts", "place_light", "place_part", "pose"]

Placed = tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]


def make_scene(
    parts: Iterable[Part] | Part | Mesh | ArrayLike,
    faces: ArrayLike | None = None,
    *,
    name: str = "mesh",
    **facts: Any,
) -> Scene:
    """
    Make a scene from parts or meshes, or from one triangle soup.

    Coordinates are the model's own; a local origin is subtracted, so that later arithmetic
    keeps its digits.

    Parameters
    ----------
    parts : Part, Mesh, an iterable of Part, or (n, 3) float64
        Parts, a mesh, or the vertices of one when ``faces`` is given; ``Scene.from_trimesh`` and
        ``Scene.from_pyvista`` take other libraries' meshes.
    faces : (m, 3) int, optional
    name : str
        Of the part that one mesh makes.
    **facts
        ``crs``, ``latitude``, ``longitude``, ``elevation``, ``is_ellipsoidal``, ``true_north``,
        ``ground``, ``sources``, ``notes``, ``lights``.

    Raises
    ------
    InputError
        If there is no triangle, or a used vertex is not finite or farther than 1e10 m from zero.
    """
    if faces is not None:
        parts = Mesh(parts, faces)  # type: ignore[arg-type]
    if isinstance(parts, Mesh):
        parts = Part(name, "", parts)
    if isinstance(parts, Part) or not isinstance(parts, Iterable):
        parts = (cast("Part", parts),)
    scene_parts = list(cast("Iterable[Part]", parts))
    other = next((item for item in scene_parts if not isinstance(item, Part)), None)
    if other is not None:
        msg = (
            f"a scene is made of parts, or of vertices and faces; got a {type(other).__name__} "
            "(umbra.read reads files, Scene.from_trimesh and Scene.from_pyvista take their meshes)"
        )
        raise InputError(msg)
    scene_parts = [part for part in scene_parts if part.triangles]
    if not scene_parts:
        msg = "there are no triangles; export the model with its surfaces"
        raise InputError(msg)
    bounds = Scene(tuple(scene_parts), np.zeros(3)).bounds()
    if not np.isfinite(bounds).all():
        _refuse_infinite(tuple(scene_parts))
    check_reach("coordinates", bounds, "it is damaged or in another unit, not in metres")
    scene_parts = _drop_unused(scene_parts)
    # Whole metres, so that adding the origin back restores the file's digits.
    far = np.abs(bounds).max(0) > 4 * np.ptp(bounds, axis=0) + 1000
    origin = np.where(far, np.floor(bounds.mean(0)), 0.0)
    if origin.any():
        return Scene(_shift(_drain(scene_parts), origin), origin, **facts)
    scene = Scene(tuple(scene_parts), origin, **facts)
    vars(scene)["_bounds"] = bounds
    return scene


def _drain(parts: list[Part]) -> Iterator[Part]:
    """Yield parts and remove them from the list, so that each can be freed once it was used."""
    parts.reverse()
    while parts:
        yield parts.pop()


def _refuse_infinite(parts: tuple[Part, ...]) -> None:
    """Name the first vertex that is not finite as the file counts it, with unused ones."""
    soup = Scene(parts, np.zeros(3)).triangles()
    finite = np.asarray(np.isfinite(soup.vertices).all(1))
    wrong = ~finite[soup.faces]
    face, corner = np.argwhere(wrong)[0]
    count = len(np.unique(soup.faces[wrong]))
    msg = (
        f"caster '{parts[soup.part[face]].name}' has vertices that are not finite: "
        f"{count} in all (first: vertex {soup.faces[face, corner]}); remove or repair them"
    )
    raise InputError(msg, count=count, vertex=int(soup.faces[face, corner]))


def _drop_unused(parts: list[Part]) -> list[Part]:
    """
    Drop unused vertices, so that only drawn vertices bound the model.

    A deforming mesh keeps them all: its shape has a row for each.
    """
    bends = {id(p.mesh.vertices) for p in parts if p.binding is not None and p.binding.shape}
    used: dict[int, NDArray[np.bool_]] = {}  # by vertex arrays, which parts share
    for part in parts:
        array = part.mesh.vertices
        if id(array) not in bends:
            if id(array) not in used:
                used[id(array)] = np.zeros(len(array), np.bool_)
            used[id(array)][part.mesh.faces.ravel()] = True
    wasteful = {key for key, is_used in used.items() if not is_used.all()}
    arrays = {
        id(part.mesh.vertices): part.mesh.vertices
        for part in parts
        if id(part.mesh.vertices) in wasteful
    }
    if not arrays:
        return parts
    # Once for each array: a city's parts share one, and there are many of them.
    indices = {key: np.flatnonzero(used[key]) for key in arrays}
    number = {key: np.cumsum(used[key], dtype=np.int32) - np.int32(1) for key in arrays}
    shorter = {key: array[indices[key]] for key, array in arrays.items()}
    meshes: dict[int, Mesh] = {}
    dropped = []
    for part in parts:
        mesh, key = part.mesh, id(part.mesh.vertices)
        if key in shorter and id(mesh) not in meshes:
            meshes[id(mesh)] = mesh.with_vertices(indices[key], number[key], shorter[key])
        dropped.append(change(part, mesh=meshes.get(id(mesh), mesh)))
    return dropped


def _shift(parts: Iterable[Part], origin: NDArray[np.float64]) -> tuple[Part, ...]:
    def place(part: Part) -> Part:
        transform, binding = np.array(part.transform), part.binding
        transform[:3, 3] -= origin
        if binding is not None:
            base = binding.base.copy()
            base[:3, 3] -= origin
            binding = replace(binding, base=base)
        return replace(part, transform=transform, binding=binding)

    return move_parts(parts, lambda vertices: vertices - origin, place)


def move_parts(
    parts: Iterable[Part],
    move: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    place: Callable[[Part], Part],
    turn: Callable[[NDArray[np.floating]], NDArray[np.floating]] | None = None,
) -> tuple[Part, ...]:
    """
    Move parts; shared vertices stay shared.

    ``move`` takes the vertices (n, 3) of parts without a transform, ``place`` the parts that have
    one, ``turn`` normals and tangents (n, 3), which stay by default.
    """
    arrays: dict[int, NDArray[np.float64]] = {}  # by ids of arrays that exist together at the start
    moved = []
    for part in parts:
        if part.transform is not None:
            moved.append(place(part))
            continue
        vertices, normals = part.mesh.vertices, part.mesh.normals
        if id(vertices) not in arrays:
            arrays[id(vertices)] = move(vertices)
        turned = turn(normals) if turn is not None and normals is not None else None
        mesh = part.mesh.moved(arrays[id(vertices)], turned)
        if turn is not None and mesh.tangents is not None:
            along = turn(mesh.tangents[:, :3])
            mesh = replace(mesh, tangents=np.column_stack([along, mesh.tangents[:, 3]]))
        moved.append(change(part, mesh=mesh))
    return tuple(moved)


def pose(scene: Scene, time: float, animation: int | str = 0) -> Scene:
    """
    Return a scene at a time of one of its animations.

    Parts keep their number and order. A rigid part keeps its mesh and gets a new
    ``transform``; a deforming one (a skin, morph targets) gets a new mesh with the same
    faces. All else keeps its place in the file.

    Parameters
    ----------
    scene : Scene
        As read, or posed before: poses replace each other.
    time : float
        Time [s], clamped to the animation.
    animation : int or str
        Its index in ``scene.animations``, or its name; ``all`` plays them together, for
        exporters that write one per object. If two move the same node, the later one wins.

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
    chosen = find_animations(scene, animation)
    rigs = {id(part.binding.rig): part.binding.rig for part in scene.parts if part.binding}
    rigs |= {id(light.binding.rig): light.binding.rig for light in scene.lights if light.binding}
    placed = {
        key: rig.place(
            tuple(
                track
                for animation in chosen
                if animation in rig.animations
                for track in animation.tracks
            ),
            time,
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
    """Return a part posed by a rig's nodes, as from `Rig.place`."""
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
    """Return a light at its node, along the node's -z."""
    matrix = places[binding.node]
    toward = matrix[:3, 2]
    if not light.is_point:
        return replace(light, position=np.append(toward, 0.0))
    if light.axis is not None:
        return replace(light, position=matrix[:, 3], axis=-toward, up=matrix[:3, 1])
    return replace(light, position=matrix[:, 3])


def find_animations(scene: Scene, animation: int | str) -> tuple[Animation, ...]:
    """Find what ``pose`` means by an animation: its number or name, or ``all``; raises as it."""
    animations = scene.animations
    if not animations:
        msg = "the scene has no animation; export the file with it, or leave the time out"
        raise InputError(msg)
    if isinstance(animation, str):
        for candidate in animations:
            if candidate.name == animation:
                return (candidate,)
        if animation == "all":
            return animations
        if not animation.isdecimal():
            names = ", ".join(f"'{candidate.name}'" for candidate in animations[:12])
            msg = f"there is no animation '{animation}'; the scene has {names}"
            raise InputError(msg, animation=animation)
    index = int(animation)
    if not 0 <= index < len(animations):
        msg = f"there is no animation {index}; the scene has {len(animations)}, counted from 0"
        raise InputError(msg, animation=index)
    return (animations[index],)
