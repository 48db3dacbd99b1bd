"""
Kernels that list the triangles of selected shadow volumes, draw by draw.

A light may lie in the ground's plane: then sides of volumes do, too (``split_level``).
Such a side and the ground are one plane: the depth buffer cannot tell which is nearer. A point of
the ground is meant as the limit from the viewer's side, so these sides count as behind it. Nothing
else can be seen beyond them, since the ground has no end.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.flags import COARSE, CUT, DARK_CAP, DRAWS, FAN, LIGHT_CAPS, LOW, SIDES, Z_FAILS
from umbra.gl.sides import find_ends
from umbra.kernels import inlined, kernel
from umbra.scene.mesh import transform_points

__all__ = ["count_draws", "find_level_points", "is_level", "list_cap", "split_level", "write_draws"]


def is_level(light: NDArray[np.float64], ground: float | None) -> bool:
    """Return whether a light (4,) lies in the plane z = ``ground``, both in one frame."""
    return ground is not None and bool(light[2] == light[3] * ground)


def find_level_points(
    bodies: Sequence[Body], ground: float | None, n_points: int
) -> NDArray[np.bool_]:
    """Find the points (n_points,) of the geometry that lie in the plane z = ``ground``."""
    is_level = np.zeros(n_points, np.bool_)
    for body in bodies:
        for first, transform in zip(body.first, body.transforms, strict=True):
            heights = transform_points(transform, body.caster.vertices)[:, 2]
            is_level[first : first + len(heights)] = heights == ground
    return is_level


def split_level(
    lists: Sequence[NDArray[np.uint32]], is_level_point: NDArray[np.bool_]
) -> list[NDArray[np.uint32]]:
    """
    Take the sides in the plane out of the lists of `DRAWS`.

    Those counted behind the visible surface go to the light caps, which are always behind it.
    """
    split = list(lists)
    for index, (name, _) in enumerate(DRAWS):
        if name.startswith("sides"):
            triangles = split[index].reshape(-1, 3)
            inside = is_level_point[triangles >> np.uint32(1)].all(1)
            split[index] = triangles[~inside].ravel()
            if name == "sides_z_fail":
                split[_LIGHT_CAP] = np.concatenate([split[_LIGHT_CAP], triangles[inside].ravel()])
    return split


_LIGHT_CAP, _COARSE, _LOW = 6, 7, 11
"""Places in ``DRAWS`` of light caps, levels of detail, and volumes that begin low."""


def list_cap(
    body: Body,
    lights: NDArray[np.float64],
    is_closed: NDArray[np.bool_],
    held: NDArray[np.intp],
    wanted: NDArray[np.bool_],
) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
    """
    List the casting faces of wanted shells, turned to the light, and the shell of each.

    Parameters
    ----------
    body : Body
    lights : (n_instances, 4) float64
        In each instance's frame.
    is_closed : (n_instances, n_components) bool
        Whether only lit faces cast.
    held : (n, 2) int
        Instances and faces that cast nothing.
    wanted : (n_instances * n_shells,) bool

    Returns
    -------
    cap : (n, 3) uint32
        Vertex numbers.
    shells : (n,) int
        Ascending.
    """
    if not wanted.any():
        return np.zeros((0, 3), np.uint32), np.zeros(0, np.intp)
    caster = body.caster
    sizes = np.tile(np.diff(body.face_starts), len(lights))
    room = int(sizes[wanted].sum())
    cap, shells = np.zeros((room, 3), np.uint32), np.zeros(room, np.intp)
    n = _list_cap(
        wanted, body.face_starts, body.faces, caster.faces, caster.planes, caster.component,
        (lights, is_closed, body.first, body.mirrored), held, cap, shells,
    )  # fmt: skip
    return cap[:n], shells[:n]


@kernel
def _list_cap(wanted, face_starts, faces, corners, planes, component, instances, held, cap, shells):
    """Write the faces of ``list_cap``; return their number. Sums equal those of ``find_lit``."""
    lights, is_closed, first, mirrored = instances
    n, n_shells = 0, face_starts.size - 1
    for number in range(wanted.size):
        if not wanted[number]:
            continue
        instance, shell = number // n_shells, number % n_shells
        x, y, z, w = lights[instance]
        for i in range(face_starts[shell], face_starts[shell + 1]):
            face = faces[i]
            side = planes[0, face] * x + planes[1, face] * y + planes[2, face] * z
            side += planes[3, face] * w
            if not (side > 0.0 or (side < 0.0 and not is_closed[instance, component[face]])):
                continue
            is_held = False
            for k in range(held.shape[0]):
                is_held |= held[k, 0] == instance and held[k, 1] == face
            if is_held:
                continue
            turned = (side < 0.0) != mirrored[instance]
            for k in range(3):
                corner = corners[face, 2 - k if turned else k]
                cap[n, k] = 2 * (first[instance] + corner)
            shells[n] = number
            n += 1
    return n


@kernel
def _find_draw(flags):
    """Return the place in ``DRAWS`` of a volume's sides, of its dark cap, and of its light cap."""
    if flags & COARSE:
        draw = _COARSE + (2 if flags & CUT else 0) + (1 if flags & Z_FAILS else 0)
        return draw, draw, draw
    if flags & LOW:
        return _LOW, _LOW, _LIGHT_CAP
    first = 3 if flags & CUT else 0
    return first + (1 if flags & Z_FAILS else 0), first + 2, _LIGHT_CAP


@inlined
def _has_fan(flags):
    """Return whether a fan over the silhouette closes a volume."""
    return flags & LOW or (flags & DARK_CAP and flags & FAN)


@kernel
def count_draws(sides, shape, cap, flags, is_point, counts):
    """
    Count the vertex numbers of each of the `DRAWS` (n_draws,), of one body.

    ``sides`` are those of ``ShellSides``, ``shape`` the caster's edges and the instances' first
    points and whether they are mirrored, ``cap`` casting faces (n, 3) and their shells, ascending;
    ``flags`` are (n_shells,).
    """
    listed, starts, ends = sides
    edges, firsts, mirrored = shape
    n_shells = flags.size // firsts.size
    for shell in range(flags.size):
        bits = flags[shell]
        if not bits & SIDES:
            continue
        draw, dark, _ = _find_draw(bits)
        counts[draw] += (6 if is_point or bits & CUT else 3) * (ends[shell] - starts[shell])
        if _has_fan(bits):
            hub = np.int64(-1)
            first, is_mirrored = firsts[shell // n_shells], mirrored[shell // n_shells]
            for i in range(starts[shell], ends[shell]):
                b, a = find_ends(listed[i], edges, first, is_mirrored)
                hub = a if hub < 0 else hub
                counts[dark] += 3 if hub not in (a, b) else 0
    _, shells = cap
    for i in range(shells.size):
        bits = flags[shells[i]]
        _, dark, light = _find_draw(bits)
        counts[light] += 3 if bits & LIGHT_CAPS else 0
        counts[dark] += 3 if bits & DARK_CAP and not bits & FAN else 0


@inlined
def _add_triangle(numbers, position, a, b, c):
    """Write three vertex numbers; unsigned places need no test of their sign."""
    numbers[position], numbers[position + np.uint64(1)], numbers[position + np.uint64(2)] = a, b, c


@kernel
def write_draws(sides, shape, cap, flags, is_point, places, numbers):
    """
    Write the vertex numbers that ``count_draws`` counts, each draw from its place on.

    ``places`` (n_draws,) advance.
    """
    listed, starts, ends = sides
    edges, firsts, mirrored = shape
    n_shells = flags.size // firsts.size
    for shell in range(flags.size):
        bits = flags[shell]
        if not bits & SIDES:
            continue
        draw, dark, _ = _find_draw(bits)
        first, is_mirrored = firsts[shell // n_shells], mirrored[shell // n_shells]
        is_whole = is_point or bits & CUT
        position, columns = np.uint64(places[draw]), np.uint64(6 if is_whole else 3)
        for i in range(np.uint64(starts[shell]), np.uint64(ends[shell])):
            b, a = find_ends(listed[i], edges, first, is_mirrored)
            _add_triangle(numbers, position, b, a, a + 1)
            if is_whole:
                _add_triangle(numbers, position + np.uint64(3), b, a + 1, b + 1)
            position += columns
        places[draw] = position
        if _has_fan(bits):
            hub = np.int64(-1)
            for i in range(starts[shell], ends[shell]):
                b, a = find_ends(listed[i], edges, first, is_mirrored)
                hub = a if hub < 0 else hub
                if hub in (a, b):
                    continue
                if bits & LOW:  # where it begins, turned to the light
                    _add_triangle(numbers, np.uint64(places[dark]), hub, a, b)
                else:
                    _add_triangle(numbers, np.uint64(places[dark]), hub + 1, b + 1, a + 1)
                places[dark] += 3
    faces, shells = cap
    for i in range(shells.size):
        bits = flags[shells[i]]
        _, dark, light = _find_draw(bits)
        if bits & LIGHT_CAPS:
            a, b, c = faces[i]
            _add_triangle(numbers, np.uint64(places[light]), a, b, c)
            places[light] += 3
        if bits & DARK_CAP and not bits & FAN:  # at the far end, turned around
            a, b, c = faces[i]
            _add_triangle(numbers, np.uint64(places[dark]), c + 1, b + 1, a + 1)
            places[dark] += 3
