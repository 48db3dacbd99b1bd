"""
Sides of shadow volumes: the silhouette edges of each shell, once per multiplicity.

A whole mesh is searched by ``volume/silhouette.py``, a few of its shells here. Instances and lights
are equivalent, since each instance has the light in its own frame: a *row* is one instance under
one light, and all rows of a mesh are searched together.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.kernels import inlined, kernel
from umbra.volume.adjacency import Caster
from umbra.volume.silhouette import Silhouettes, find_silhouettes

if TYPE_CHECKING:
    from umbra.gl.volumes import BodyVolumes

__all__ = ["ShellSides", "find_ends", "make_shell_sides", "make_sides_alike"]

_FEW = 4  # a mesh is searched whole where at least one edge in _FEW is wanted


@dataclass(frozen=True, eq=False)
class ShellSides:
    """
    The sides of shells.

    Parameters
    ----------
    sides : (n,) int32
        ``edge << 1 | forward``: whether the side's edge runs as the edge of the caster does, in an
        instance that is not mirrored.
    starts, ends : (n_shells,) int64
        Shell k owns ``sides[starts[k]:ends[k]]``.
    """

    sides: NDArray[np.int32]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]

    @classmethod
    def none(cls, n_shells: int) -> "ShellSides":
        """Return shells without sides."""
        empty = np.zeros(n_shells, np.int64)
        return cls(np.zeros(0, np.int32), empty, empty)

    def join(self, other: "ShellSides", which: NDArray[np.bool_]) -> "ShellSides":
        """Return these sides, with those of other shells ``which`` (n_shells,)."""
        if not len(self.sides):
            return other
        first = len(self.sides)
        return ShellSides(
            np.concatenate([self.sides, other.sides]),
            np.where(which, other.starts + first, self.starts),
            np.where(which, other.ends + first, self.ends),
        )

    def keep(self, which: NDArray[np.bool_]) -> "ShellSides":
        """Return the sides of some shells (n_shells,) alone."""
        lengths = np.where(which, self.ends - self.starts, 0)
        ends = np.cumsum(lengths)
        sides = np.zeros(int(lengths.sum()), np.int32)
        _gather(self.sides, self.starts, lengths, sides)
        return ShellSides(sides, ends - lengths, ends)

    def list_points(
        self, body: Body, wanted: NDArray[np.bool_]
    ) -> tuple[NDArray[np.uint32], NDArray[np.intp]]:
        """
        List the sides of wanted shells (n_shells,) as triangles.

        Returns two triangles (n, 6) of vertex numbers each, wound outward, and the shell of each,
        ascending.
        """
        lengths = np.where(wanted, self.ends - self.starts, 0)
        corners = np.zeros((int(lengths.sum()), 6), np.uint32)
        shape = body.caster.edges, body.first, body.mirrored
        _list_corners(self.sides, self.starts, lengths, shape, corners)
        return corners, np.repeat(np.arange(len(lengths)), lengths)


@kernel
def _gather(sides, starts, lengths, gathered):
    """Copy the first sides of each shell, one shell after another."""
    n = 0
    for shell in range(starts.size):
        for i in range(starts[shell], starts[shell] + lengths[shell]):
            gathered[n] = sides[i]
            n += 1


@inlined
def find_ends(side, edges, first, is_mirrored):
    """
    Return the vertex numbers of a side's ends, as its triangles need them: the second one first.

    The instance's ``first`` point is given, and whether it is mirrored.
    """
    edge = np.uint64(side >> 1)
    tail, head = 2 * (first + edges[edge, 0]), 2 * (first + edges[edge, 1])
    is_ahead = ((side & 1) != 0) != is_mirrored
    return (head, tail) if is_ahead else (tail, head)


@kernel
def _list_corners(sides, starts, lengths, shape, corners):
    """Write the two triangles of each side of some shells."""
    edges, firsts, mirrored = shape
    n, n_shells = 0, starts.size // firsts.size
    for shell in range(starts.size):
        first, is_mirrored = firsts[shell // n_shells], mirrored[shell // n_shells]
        for i in range(starts[shell], starts[shell] + lengths[shell]):
            b, a = find_ends(sides[i], edges, first, is_mirrored)
            for k, corner in enumerate((b, a, a + 1, b, a + 1, b + 1)):
                corners[n, k] = corner
            n += 1


def make_shell_sides(volumes: "BodyVolumes", wanted: NDArray[np.bool_]) -> ShellSides:
    """Find the sides of wanted shells."""
    body, opened, held = volumes.body, volumes.opened, volumes.held
    shell_sides = ShellSides.none(len(wanted))
    rows = wanted.reshape(-1, body.n_shells)
    is_wanted = rows.any(1)
    # Nearly always no instance has open components.
    kinds = opened[:1] if (opened == opened[:1]).all() else np.unique(opened, axis=0)
    apart = np.bincount(held[:, 0], minlength=len(opened)) > 0
    for kind in kinds:
        alike = (opened == kind).all(1) & ~apart & is_wanted
        if alike.any():
            chosen = rows & alike[:, None]
            more = _find_sides(body, body.caster.opened(kind), volumes.lights, chosen)
            shell_sides = shell_sides.join(more, chosen.ravel())
    for instance in np.flatnonzero(apart & is_wanted).tolist():
        chosen = np.zeros_like(rows)
        chosen[instance] = rows[instance]
        caster = volumes.caster_of(instance).opened(opened[instance])
        shell_sides = shell_sides.join(
            _find_sides(body, caster, volumes.lights, chosen), chosen.ravel()
        )
    return shell_sides


def make_sides_alike(
    alike: list[tuple["BodyVolumes", NDArray[np.bool_]]],
) -> list[ShellSides]:
    """
    Find the sides of one body under several lights at once.

    Each light has its wanted shells (n_shells,); none are opened or held.
    """
    body = alike[0][0].body
    lights = np.concatenate([body_volumes.lights for body_volumes, _ in alike])
    rows = np.concatenate([shells for _, shells in alike]).reshape(-1, body.n_shells)
    shell_sides = _find_sides(body, body.caster, lights, rows)
    spans = zip(
        *(numbers.reshape(len(alike), -1) for numbers in (shell_sides.starts, shell_sides.ends)),
        strict=True,
    )
    # Each keeps its own: a lamp that stands still must not hold what others had long ago.
    return [
        ShellSides(shell_sides.sides, *span).keep(wanted)
        for (_, wanted), span in zip(alike, spans, strict=True)
    ]


def _find_sides(
    body: Body, caster: Caster, lights: NDArray[np.float64], wanted: NDArray[np.bool_]
) -> ShellSides:
    """Find the sides of the wanted shells (n_rows, n_shells) for the lights (n_rows, 4)."""
    starts, ends = np.zeros((2, *wanted.shape), np.int64)
    lists, n = [np.zeros(0, np.int32)], 0
    active = np.flatnonzero(wanted.any(1))
    shape = body.edge_shell, body.edge_starts
    for group, silhouettes in _find_silhouettes(body, caster, lights[active], wanted[active]):
        codes = silhouettes.codes
        if not _are_in_order(codes, silhouettes.starts):  # from a tree, or with faces seen edge-on
            owner = np.repeat(np.arange(len(silhouettes.starts) - 1), np.diff(silhouettes.starts))
            codes = codes[np.lexsort((codes[: len(owner)], owner))]
        sides = codes if caster.most == 1 else np.zeros(caster.most * len(codes), np.int32)
        more = _pack_sides(
            codes,
            silhouettes.starts,
            caster.weight,
            active[group],
            shape,
            wanted,
            n,
            starts,
            ends,
            sides,
        )
        lists.append(sides[:more])
        n += more
    sides = lists[-1] if len(lists) < 3 else np.concatenate(lists)
    return ShellSides(sides, starts.ravel(), ends.ravel())


def _find_silhouettes(
    body: Body, caster: Caster, lights: NDArray[np.float64], wanted: NDArray[np.bool_]
) -> Iterator[tuple[slice | NDArray[np.intp], Silhouettes]]:
    """Find the silhouettes of rows: of a whole mesh, or of wanted shells only."""
    n_edges = int((wanted @ np.diff(body.edge_starts)).sum())
    if n_edges * _FEW >= len(lights) * len(caster.edges):
        yield from find_silhouettes(caster, lights)  # perhaps by a tree, or by many threads
        return
    codes, starts = np.zeros(n_edges + 1, np.int32), np.zeros(len(lights) + 1, np.int64)
    is_flat = np.zeros(len(lights), np.bool_)
    _list_codes(
        wanted, body.face_starts, body.faces, body.edge_starts, caster.edge_faces, caster.turn,
        caster.planes, lights, bool(caster.is_closed.all()), codes, starts, is_flat,
    )  # fmt: skip
    yield slice(0, len(lights)), Silhouettes(codes, starts)
    flat = np.flatnonzero(is_flat)
    if len(flat):
        for which, silhouettes in find_silhouettes(caster, lights[flat]):
            yield flat[which], silhouettes


@kernel
def _list_codes(
    wanted, face_starts, faces, edge_starts, edge_faces, turn, planes, lights, all_closed, codes,
    starts, is_flat,
):  # fmt: skip
    """
    List the codes of the edges of wanted shells (n_lights, n_shells), light by light.

    Sums are bit-identical to those of ``find_lit``. Where a light sees a face exactly edge-on
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
                first, second = lit[edge_faces[edge, 0]], lit[edge_faces[edge, 1]]
                codes[n] = np.int32(edge) << 2 | first
                n += first ^ second ^ turn[edge]
        if is_flat[k]:
            n = starts[k]
        starts[k + 1] = n


@kernel
def _are_in_order(codes, starts):
    """Return whether the codes of each row are in the order of edges."""
    is_in_order = True
    for k in range(starts.size - 1):
        for i in range(starts[k] + 1, starts[k + 1]):
            is_in_order &= codes[i] > codes[i - 1]
    return is_in_order


@kernel
def _pack_sides(codes, code_starts, weight, rows, shape, wanted, first, starts, ends, sides):
    """
    Write the sides of the wanted shells (n_rows, n_shells); return their number.

    Codes are in the order of edges; where no multiplicity is above 1, ``sides`` may take their
    place. ``shape`` are the edges' shells and the shells' first edges. ``starts`` and ``ends``
    (n_rows, n_shells) count from ``first``, the place of the first side.
    """
    edge_shell, edge_starts = shape
    n = 0
    for k in range(rows.size):
        row, i, last = rows[k], code_starts[k], code_starts[k + 1]
        while i < last:
            shell = edge_shell[codes[i] >> 2]
            end = np.int32(edge_starts[shell + 1] << 2)
            if wanted[row, shell]:
                starts[row, shell] = first + n
                while i < last and codes[i] < end:
                    code = codes[i]
                    times = weight[code >> 2] >> (code >> 1 & 1)
                    # Wound as in the lit face for a positive multiplicity: the side runs the
                    # other way.
                    side = (code >> 1 & ~1) | ((times > 0) == ((code & 1) > 0))
                    for _ in range(abs(times)):
                        sides[n] = side
                        n += 1
                    i += 1
                ends[row, shell] = first + n
            while i < last and codes[i] < end:
                i += 1
    return n
