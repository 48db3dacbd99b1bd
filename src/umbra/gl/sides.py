"""
Sides of shadow volumes: two triangles of vertex numbers for each silhouette edge.

A whole mesh under one light uses ``volume/silhouette.py``. Selected shells of many instances or
lights are searched in one call, shell by shell: instances and lights are equivalent, since each
instance has the light in its own frame.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import Silhouettes, find_silhouettes

if TYPE_CHECKING:
    from umbra.gl.volumes import BodyVolumes

__all__ = ["make_sides", "make_sides_alike"]

_FEW = 4  # a mesh is searched whole where at least one edge in _FEW is wanted


def make_sides(
    volumes: "BodyVolumes", wanted: NDArray[np.bool_]
) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
    """Find the silhouettes of wanted shells; return their sides, and the shell of each."""
    body, opened, held = volumes.body, volumes.opened, volumes.held
    sides: list[NDArray[np.uint32]] = [np.zeros((0, 6), np.uint32)]
    shells: list[NDArray[np.intp]] = [np.zeros(0, np.intp)]
    asked = wanted.reshape(-1, body.n_shells).any(1)
    # Nearly always no instance has open components.
    kinds = opened[:1] if (opened == opened[:1]).all() else np.unique(opened, axis=0)
    apart = np.bincount(held[:, 0], minlength=len(opened)) > 0
    for kind in kinds:
        alike = np.flatnonzero((opened == kind).all(1) & ~apart & asked)
        if len(alike):
            _add_sides(volumes, body.caster.opened(kind), alike, wanted, sides, shells)
    for instance in np.flatnonzero(apart & asked):
        caster = volumes.caster_of(int(instance)).opened(opened[instance])
        _add_sides(volumes, caster, np.array([instance]), wanted, sides, shells)
    return np.concatenate(sides), np.concatenate(shells)


def _add_sides(
    volumes: "BodyVolumes",
    caster: Caster,
    alike: NDArray[np.intp],
    wanted: NDArray[np.bool_],
    sides: list[NDArray[np.uint32]],
    shells: list[NDArray[np.intp]],
) -> None:
    """Append the sides of wanted shells of some instances, and their shells, to lists."""
    body = volumes.body
    for which, found in _find_silhouettes(volumes, caster, alike, wanted):
        n = _count_sides(found.codes, found.starts, caster.weight)
        side, shell = np.zeros((n, 6), np.uint32), np.zeros(n, np.intp)
        n = _write_sides(
            found.codes, found.starts, caster.edges, caster.weight, alike[which], body.first,
            body.mirrored, body.edge_shell, body.n_shells, wanted, side, shell,
        )  # fmt: skip
        sides.append(side[:n])
        shells.append(shell[:n])


def _find_silhouettes(
    volumes: "BodyVolumes", caster: Caster, alike: NDArray[np.intp], wanted: NDArray[np.bool_]
) -> Iterator[tuple[slice | NDArray[np.intp], Silhouettes]]:
    """Find the silhouettes of instances: of a whole mesh, or of wanted shells only."""
    body, lights = volumes.body, volumes.lights[alike]
    mine = wanted.reshape(-1, body.n_shells)[alike]
    n_edges = int((mine @ np.diff(body.edge_starts)).sum())
    if len(alike) == 1 and n_edges * _FEW >= len(caster.edges):
        yield from find_silhouettes(caster, lights)  # perhaps by a tree, or by many threads
        return
    silhouettes, is_flat = _ask_shells(body, caster, mine, lights)
    yield slice(0, len(alike)), silhouettes
    flat = np.flatnonzero(is_flat)
    if len(flat):
        for which, found in find_silhouettes(caster, lights[flat]):
            yield flat[which], found


def _ask_shells(
    body: Body, caster: Caster, wanted: NDArray[np.bool_], lights: NDArray[np.float64]
) -> tuple[Silhouettes, NDArray[np.bool_]]:
    """
    Find the silhouettes of wanted shells (n_lights, n_shells) for lights (n_lights, 4).

    Returns for each light also whether it sees a face edge-on: then it has no silhouette here.
    """
    n_edges = int((wanted @ np.diff(body.edge_starts)).sum())
    codes, starts = np.zeros(n_edges + 1, np.int32), np.zeros(len(lights) + 1, np.int64)
    is_flat = np.zeros(len(lights), np.bool_)
    _list_codes(
        wanted, body.face_starts, body.faces, body.edge_starts, caster.edge_faces, caster.turn,
        caster.planes, lights, bool(caster.is_closed.all()), codes, starts, is_flat,
    )  # fmt: skip
    return Silhouettes(codes, starts), is_flat


@njit(cache=True, nogil=True)
def _list_codes(
    wanted, face_starts, faces, edge_starts, edge_faces, turn, planes, lights, all_closed, codes,
    starts, is_flat,
):  # fmt: skip
    """
    List the codes of the edges of wanted shells (n_lights, n_shells), light by light.

    Sums equal those of ``find_lit`` to the last bit. Where a light sees a face exactly edge-on
    and not ``all_closed``, ``is_flat`` is set and nothing listed: open faces need more care.
    """
    n = 0
    lit = np.zeros(planes.shape[1], np.uint8)
    for k in range(lights.shape[0]):
        x, y, z, w = lights[k, 0], lights[k, 1], lights[k, 2], lights[k, 3]
        for shell in range(wanted.shape[1]):
            if not wanted[k, shell]:
                continue
            for i in range(face_starts[shell], face_starts[shell + 1]):
                face = faces[i]
                side = planes[0, face] * x + planes[1, face] * y + planes[2, face] * z
                side += planes[3, face] * w
                lit[face] = side > 0.0
                is_flat[k] |= side == 0.0 and not all_closed
            for edge in range(edge_starts[shell], edge_starts[shell + 1]):
                one, two = lit[edge_faces[edge, 0]], lit[edge_faces[edge, 1]]
                codes[n] = np.int32(edge) << 2 | one
                n += one ^ two ^ turn[edge]
        if is_flat[k]:
            n = starts[k]
        starts[k + 1] = n


@njit(cache=True, nogil=True)
def _count_sides(codes, starts, weight):
    """Count the sides of silhouette edges, by multiplicity."""
    n = 0
    for i in range(starts[0], starts[-1]):
        n += abs(np.int64(weight[codes[i] >> 2]) >> (codes[i] >> 1 & 1))
    return n


@njit(cache=True, nogil=True)
def _write_sides(
    codes, starts, edges, weight, instances, first, mirrored, edge_shell, n_shells, wanted, sides,
    shells,
):  # fmt: skip
    """Write two triangles and the shell for each side of a wanted shell; return their number."""
    n = 0
    for k in range(instances.size):
        instance = instances[k]
        for i in range(starts[k], starts[k + 1]):
            code = codes[i]
            edge = code >> 2
            owner = instance * n_shells + edge_shell[edge]
            if not wanted[owner]:
                continue
            # Wound as in the lit face for a positive multiplicity: the side runs the other way.
            times = np.int64(weight[edge]) >> (code >> 1 & 1)
            forward = ((times > 0) == ((code & 1) > 0)) != mirrored[instance]
            a = np.uint32(2 * (first[instance] + edges[edge, 0 if forward else 1]))
            b = np.uint32(2 * (first[instance] + edges[edge, 1 if forward else 0]))
            for _ in range(abs(times)):
                sides[n, 0] = b
                sides[n, 1] = a
                sides[n, 2] = a + 1
                sides[n, 3] = b
                sides[n, 4] = a + 1
                sides[n, 5] = b + 1
                shells[n] = owner
                n += 1
    return n


def make_sides_alike(
    alike: list[tuple["BodyVolumes", NDArray[np.bool_]]],
) -> list[tuple[NDArray[np.uint32], NDArray[np.intp]] | None]:
    """
    Make the sides of one body under several lights at once.

    Each light has its wanted shells (n_shells,); none are opened or held. Returns sides and shells
    as ``make_sides``, or None for a light that sees a face edge-on.
    """
    body = alike[0][0].body
    n = len(alike)
    wanted = np.concatenate([mine for _, mine in alike])
    lights = np.concatenate([each.lights for each, _ in alike])
    rows = wanted.reshape(-1, body.n_shells)
    found, is_flat = _ask_shells(body, body.caster, rows, lights)
    length = _count_sides(found.codes, found.starts, body.caster.weight)
    sides, shells = np.zeros((length, 6), np.uint32), np.zeros(length, np.intp)
    _write_sides(
        found.codes, found.starts, body.caster.edges, body.caster.weight, np.arange(len(rows)),
        np.tile(body.first, n), np.tile(body.mirrored, n), body.edge_shell, body.n_shells, wanted,
        sides, shells,
    )  # fmt: skip
    step = len(wanted) // n
    ends = np.searchsorted(shells, step * np.arange(n + 1)).tolist()
    flat = np.logical_or.reduce(is_flat.reshape(n, -1), 1).tolist()
    spans = [slice(first, end) for first, end in pairwise(ends)]
    return [
        None if flat[k] else (sides[span], shells[span] - step * k) for k, span in enumerate(spans)
    ]
