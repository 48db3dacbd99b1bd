"""Kernels that list the triangles of selected shadow volumes, draw by draw."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.flags import CUT, DARK_CAP, FAN, LIGHT_CAPS, SIDES, Z_FAILS

__all__ = ["count_draws", "list_cap", "write_draws"]

_LIGHT_CAP = 6  # place of light caps in ``DRAWS``


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
    """Return the place in ``DRAWS`` of a volume's sides, and of its dark cap."""
    first = 3 if flags & CUT else 0
    return first + (1 if flags & Z_FAILS else 0), first + 2


@njit(cache=True, nogil=True)
def count_draws(sides, side_shell, cap_shell, flags, is_point, counts):
    """
    Count the vertex numbers of each of the ``DRAWS`` (7,).

    ``side_shell`` and ``cap_shell`` are the shells of sides (n, 6) and casting faces, ascending;
    ``flags`` are (n_shells,).
    """
    hub = np.uint32(0)
    for i in range(side_shell.size):
        if i == 0 or side_shell[i] != side_shell[i - 1]:
            hub = sides[i, 2]
        mine = flags[side_shell[i]]
        if not mine & SIDES:
            continue
        draw, dark = _find_draw(mine)
        counts[draw] += 6 if is_point or mine & CUT else 3
        if mine & DARK_CAP and mine & FAN and hub != sides[i, 5] and hub != sides[i, 2]:
            counts[dark] += 3
    for i in range(cap_shell.size):
        mine = flags[cap_shell[i]]
        if mine & LIGHT_CAPS:
            counts[_LIGHT_CAP] += 3
        if mine & DARK_CAP and not mine & FAN:
            counts[_find_draw(mine)[1]] += 3


@njit(cache=True, nogil=True)
def write_draws(sides, side_shell, cap, cap_shell, flags, is_point, places, numbers):
    """Write what ``count_draws`` counts, each of the ``DRAWS`` from ``places`` (7,) on."""
    hub = np.uint32(0)
    for i in range(side_shell.size):
        if i == 0 or side_shell[i] != side_shell[i - 1]:
            hub = sides[i, 2]
        mine = flags[side_shell[i]]
        if not mine & SIDES:
            continue
        draw, dark = _find_draw(mine)
        columns = 6 if is_point or mine & CUT else 3
        place = places[draw]
        for k in range(columns):
            numbers[place + k] = sides[i, k]
        places[draw] += columns
        if mine & DARK_CAP and mine & FAN and hub != sides[i, 5] and hub != sides[i, 2]:
            place = places[dark]
            numbers[place], numbers[place + 1], numbers[place + 2] = hub, sides[i, 5], sides[i, 2]
            places[dark] += 3
    for i in range(cap_shell.size):
        mine = flags[cap_shell[i]]
        if mine & LIGHT_CAPS:
            place = places[_LIGHT_CAP]
            for k in range(3):
                numbers[place + k] = cap[i, k]
            places[_LIGHT_CAP] += 3
        if mine & DARK_CAP and not mine & FAN:
            dark = _find_draw(mine)[1]
            for k in range(3):
                numbers[places[dark] + k] = cap[i, 2 - k] | np.uint32(1)
            places[dark] += 3
