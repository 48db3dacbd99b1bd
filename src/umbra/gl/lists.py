"""Kernels that list the triangles of selected shadow volumes, draw by draw."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.flags import COARSE, CUT, DARK_CAP, FAN, LIGHT_CAPS, SIDES, Z_FAILS

__all__ = ["add_draws", "append_draws", "list_cap"]

_LIGHT_CAP, _COARSE = 6, 7  # places in ``DRAWS`` of light caps, and of levels of detail


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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _find_draw(flags):
    """Return the place in ``DRAWS`` of a volume's sides, of its dark cap, and of its light cap."""
    if flags & COARSE:
        draw = _COARSE + (2 if flags & CUT else 0) + (1 if flags & Z_FAILS else 0)
        return draw, draw, draw
    first = 3 if flags & CUT else 0
    return first + (1 if flags & Z_FAILS else 0), first + 2, _LIGHT_CAP


@njit(cache=True, nogil=True)
def add_draws(sides, side_shell, cap, cap_shell, flags, is_point, counts, places, numbers):
    """
    Count the vertex numbers of each of the ``DRAWS`` (7,), and write them into ``numbers``.

    ``side_shell`` and ``cap_shell`` are the shells of sides (n, 6) and casting faces (n, 3),
    ascending; ``flags`` are (n_shells,). Each draw is written from its own of ``places`` (7,) on,
    which advance; with empty ``numbers`` it is only counted.
    """
    hub = np.uint32(0)
    writes = numbers.size > 0
    for i in range(side_shell.size):
        if i == 0 or side_shell[i] != side_shell[i - 1]:
            hub = sides[i, 2]
        mine = flags[side_shell[i]]
        if not mine & SIDES:
            continue
        draw, dark, _ = _find_draw(mine)
        columns = 6 if is_point or mine & CUT else 3
        if writes:
            place = places[draw]
            for k in range(columns):
                numbers[place + k] = sides[i, k]
            places[draw] += columns
        counts[draw] += columns
        if mine & DARK_CAP and mine & FAN and hub != sides[i, 5] and hub != sides[i, 2]:
            if writes:
                place = places[dark]
                numbers[place] = hub
                numbers[place + 1] = sides[i, 5]
                numbers[place + 2] = sides[i, 2]
                places[dark] += 3
            counts[dark] += 3
    for i in range(cap_shell.size):
        mine = flags[cap_shell[i]]
        if mine & LIGHT_CAPS:
            _add_face(cap[i], False, _find_draw(mine)[2], writes, counts, places, numbers)
        if mine & DARK_CAP and not mine & FAN:
            _add_face(cap[i], True, _find_draw(mine)[1], writes, counts, places, numbers)


@njit(cache=True, nogil=True)
def _add_face(face, is_far, draw, writes, counts, places, numbers):
    """Count a casting face in a draw, and write it or, turned around, its far end."""
    counts[draw] += 3
    if writes:
        for k in range(3):
            number = face[2 - k] | np.uint32(1) if is_far else face[k]
            numbers[places[draw] + k] = number
        places[draw] += 3


@njit(cache=True, nogil=True)
def append_draws(sides, side_shell, cap, cap_shell, flags, is_point, numbers, end, counts):
    """
    Write the triangles of one body into ``numbers`` from ``end`` on, draw by draw.

    ``counts`` (7,) become the vertex numbers of each draw; there must be room for 9 of each side
    and 6 of each casting face.
    """
    counts[:] = 0
    places = np.zeros(counts.size, np.int64)
    add_draws(sides, side_shell, cap, cap_shell, flags, is_point, counts, places, numbers[:0])
    for draw in range(counts.size):
        places[draw] = end
        end += counts[draw]
    add_draws(
        sides, side_shell, cap, cap_shell, flags, is_point, np.zeros_like(counts), places, numbers
    )
