"""Scenes from parts: unused vertices dropped, a local origin subtracted."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.scene.mesh import Mesh, Part
from umbra.scene.scene import Scene

__all__ = ["make_scene", "move_parts"]


def make_scene(
    parts: Sequence[Part] | ArrayLike,
    faces: ArrayLike | None = None,
    *,
    name: str = "mesh",
    **facts: Any,
) -> Scene:
    """
    Make a scene from parts, or from one triangle soup.

    Coordinates are the model's own; a local origin is chosen and subtracted, so
    that nothing far from zero loses digits later.

    Parameters
    ----------
    parts : sequence of Part, or (n, 3) float64
        Parts, or the vertices of one mesh when ``faces`` is given.
    faces : (m, 3) int, optional
    name : str
        Of the one part, when ``faces`` is given.
    **facts
        ``crs``, ``latitude``, ``longitude``, ``elevation``, ``true_north``, ``ground``,
        ``sources``, ``notes``, ``lights``.

    Raises
    ------
    InputError
        If there is no triangle, or a used vertex is not finite.
    """
    if faces is not None:
        given: tuple[Part, ...] = (Part(name, "", Mesh(np.asarray(parts), np.asarray(faces))),)
    else:
        given = tuple(cast("Sequence[Part]", parts))
        other = next((one for one in given if not isinstance(one, Part)), None)
        if other is not None:
            msg = (
                f"a scene is made of parts, or of vertices and faces; got a {type(other).__name__} "
                "(umbra.read reads files)"
            )
            raise InputError(msg)
    kept = tuple(part for part in given if part.triangles)
    if not kept:
        msg = "there are no triangles; export the model with its surfaces"
        raise InputError(msg)
    scene = Scene(_drop_unused(kept), np.zeros(3))
    if not np.isfinite(scene.bounds()).all():
        _refuse_infinite(kept)
    kept = scene.parts
    bounds = scene.bounds()
    # Whole metres, so that adding the origin back gives the file's own digits.
    far = np.abs(bounds).max(0) > 4 * np.ptp(bounds, axis=0) + 1000
    origin = np.where(far, np.floor(bounds.mean(0)), 0.0)
    if origin.any():
        kept = _shift(kept, origin)
    return replace(scene, parts=kept, origin=origin, **facts)


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


def _drop_unused(parts: tuple[Part, ...]) -> tuple[Part, ...]:
    """
    Leave out the vertices that no face uses, so that only what is drawn counts as the model.

    A mesh that bends keeps its own: its shape has rows for each of them.
    """
    bends = {id(p.mesh.vertices) for p in parts if p.binding is not None and p.binding.shape}
    used: dict[int, NDArray[np.bool_]] = {}  # by vertex arrays, which parts share
    for part in parts:
        array = part.mesh.vertices
        if id(array) not in bends:
            is_used = used.setdefault(id(array), np.zeros(len(array), np.bool_))
            is_used[part.mesh.faces.ravel()] = True
    arrays = {
        id(part.mesh.vertices): part.mesh.vertices
        for part in parts
        if not used.get(id(part.mesh.vertices), np.ones(1, np.bool_)).all()
    }
    if not arrays:
        return parts
    shorter = {key: array[used[key]] for key, array in arrays.items()}
    meshes: dict[int, Mesh] = {}
    dropped = []
    for part in parts:
        mesh, key = part.mesh, id(part.mesh.vertices)
        if key in shorter and id(mesh) not in meshes:
            meshes[id(mesh)] = mesh.with_vertices(used[key], shorter[key])
        dropped.append(replace(part, mesh=meshes.get(id(mesh), mesh)))
    return tuple(dropped)


def _shift(parts: tuple[Part, ...], origin: NDArray[np.float64]) -> tuple[Part, ...]:
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
    parts: Sequence[Part],
    move: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    place: Callable[[Part], Part],
    turn: Callable[[NDArray[np.floating]], NDArray[np.floating]] | None = None,
) -> tuple[Part, ...]:
    """
    Move parts; those that share vertices go on sharing them.

    Parameters
    ----------
    parts : sequence of Part
    move : function of (n, 3) float64 -> (n, 3) float64
        Of the vertices of parts without a transform.
    place : function of Part -> Part
        Of parts that have one.
    turn : function of (n, 3) float32 -> (n, 3) float, optional
        Of normals; they stay by default.
    """
    arrays: dict[int, NDArray[np.float64]] = {}
    moved = []
    for part in parts:
        if part.transform is not None:
            moved.append(place(part))
            continue
        vertices, normals = part.mesh.vertices, part.mesh.normals
        if id(vertices) not in arrays:
            arrays[id(vertices)] = move(vertices)
        turned = turn(normals) if turn is not None and normals is not None else None
        moved.append(replace(part, mesh=part.mesh.moved(arrays[id(vertices)], turned)))
    return tuple(moved)
