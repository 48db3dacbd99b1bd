"""
Shadow volumes split into batches, for methods with a limited count.

Any line meets the volume of a convex caster, or of a single polygon, in at most one front
and one back. A concave caster is kept whole if it has few enough casting faces, and otherwise
split into one volume per face. Volumes share a batch as long as no line can meet more
fronts, or backs, than the method supports.

Parallel rays all end in one point at infinity, where the far end of a z-fail volume cannot be
drawn: it is a full-window rectangle if the volume holds that point. So counts always start
from 0. (Roettger's near cap does the same at the rays' other end, where it differs between
pixels.)
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.gl.flags import CUT, DARK_CAP, LIGHT_CAPS, Z_FAILS
from umbra.gl.volume_plan import LIGHT_CAP, Z_FAIL, Z_PASS, Draw, VolumePlan
from umbra.gl.volumes import FAR, BodyVolumes

__all__ = ["VolumeBatch", "VolumePieces", "make_pieces"]

_Key = tuple[str, bool]
_Lists = dict[_Key, list[NDArray[np.uint32]]]


@dataclass(frozen=True)
class VolumeBatch:
    """
    Volumes counted together; no line meets more than ``weight`` fronts, or backs.

    ``ends`` of them hold the end of parallel rays.
    """

    draws: tuple[Draw, ...]
    weight: int
    ends: int = 0


@dataclass(frozen=True, eq=False)
class VolumePieces:
    """
    All volumes of a plan: batches, and the index list (n,) of their draws.

    The ``n_volumes`` include one for each polygon of ``n_split`` split casters.
    """

    batches: list[VolumeBatch]
    numbers: NDArray[np.uint32]
    n_volumes: int
    n_split: int

    @property
    def widest(self) -> int:
        """The largest weight of a batch."""
        return max((batch.weight for batch in self.batches), default=0)


@dataclass(eq=False)
class _Builder:
    """Collects volumes, and closes a batch before it exceeds the limit."""

    at_once: int
    batches: list[VolumeBatch] = field(default_factory=list)
    lists: list[NDArray[np.uint32]] = field(default_factory=lambda: [np.zeros(0, np.uint32)])
    place: int = 0
    n_volumes: int = 0
    n_split: int = 0
    _open: _Lists = field(default_factory=dict)
    _weight: int = 0
    _ends: int = 0

    def add(self, volume: dict[_Key, NDArray[np.uint32]], weight: int, ends: int) -> None:
        """Add the triangles of one volume, or of several with summed weight and ends."""
        if self._weight + weight > self.at_once:
            self.close()
        self._weight += weight
        self._ends += ends
        for key, numbers in volume.items():
            if numbers.size:
                self._open.setdefault(key, []).append(numbers.ravel())

    def close(self) -> None:
        """End the batch."""
        draws = []
        for (kind, is_cut), lists in self._open.items():
            count = sum(map(len, lists))
            draws.append(Draw(kind, is_cut, self.place, count))
            self.lists += lists
            self.place += count
        if draws:
            self.batches.append(VolumeBatch(tuple(draws), self._weight, self._ends))
        self._open, self._weight, self._ends = {}, 0, 0


def make_pieces(plan: VolumePlan, at_once: int, *, split: bool = True) -> VolumePieces:
    """
    Split the volumes of a plan by the method ``auto`` into batches no wider than ``at_once``.

    ``split`` divides wider casters into polygons; otherwise each is a batch by itself.
    """
    builder, offset = _Builder(at_once), 0
    assert plan.selection is not None
    for body_volumes in plan.volumes:
        _add_body(builder, body_volumes, plan, offset, split)
        offset += body_volumes.body.n_shells * len(body_volumes.body.groups)
    builder.close()
    return VolumePieces(
        builder.batches, np.concatenate(builder.lists), builder.n_volumes, builder.n_split
    )


def _add_body(
    builder: _Builder,
    body_volumes: BodyVolumes,
    plan: VolumePlan,
    offset: int,
    split: bool,
) -> None:
    """Add the selected volumes of one body."""
    selection, is_point = plan.selection, bool(plan.light[3])
    assert selection is not None
    n = body_volumes.body.n_shells * len(body_volumes.body.groups)
    drawn = slice(offset, offset + n)
    active = selection.sides[drawn]
    if not active.any():
        return
    cap, cap_shell = body_volumes.find_cap(active)
    cap_starts = np.searchsorted(cap_shell, np.arange(n + 1))
    sides, side_shell = body_volumes.list_sides(active)
    side_starts = np.searchsorted(side_shell, np.arange(n + 1))
    is_convex = _find_convex(body_volumes)
    for shell in np.flatnonzero(active).tolist():
        faces = cap[cap_starts[shell] : cap_starts[shell + 1]]
        if not len(faces):
            continue
        at = offset + shell
        flags = selection.flags[at]
        chosen = _Chosen(
            kind=Z_FAIL if flags & Z_FAILS else Z_PASS,
            is_cut=bool(flags & CUT),
            columns=6 if is_point or flags & CUT else 3,
            dark_cap=bool(flags & DARK_CAP),
            light_cap=bool(flags & LIGHT_CAPS),
        )
        weight = 1 if is_convex[shell] else len(faces)
        ends = np.zeros(len(faces), np.bool_)
        if chosen.kind == Z_FAIL and not chosen.is_cut:
            ends = _hold_end(body_volumes, plan, shell // body_volumes.body.n_shells, faces)
        if weight <= builder.at_once or not split:
            batch = sides[side_starts[shell] : side_starts[shell + 1]]
            builder.add(chosen.name(batch, faces), weight, int(ends.sum()))
            builder.n_volumes += 1
            continue
        builder.n_split += 1
        builder.n_volumes += len(faces)
        for first in range(0, len(faces), builder.at_once):
            span = slice(first, first + builder.at_once)
            batch = faces[span]
            builder.add(chosen.name(_make_sides(batch), batch), len(batch), int(ends[span].sum()))


@dataclass(frozen=True)
class _Chosen:
    """VolumeSelection and count method of one shell's volume."""

    kind: str
    is_cut: bool
    columns: int
    dark_cap: bool
    light_cap: bool

    def name(
        self, sides: NDArray[np.uint32], cap: NDArray[np.uint32]
    ) -> dict[_Key, NDArray[np.uint32]]:
        """Return the triangles by count method."""
        lists = [sides[:, : self.columns].reshape(-1, 3)]
        if self.dark_cap:
            lists.append(cap[:, ::-1] | FAR)
        triangles = {(self.kind, self.is_cut): np.concatenate(lists)}
        if self.light_cap:
            triangles[LIGHT_CAP, False] = cap
        return triangles


def _hold_end(
    body_volumes: BodyVolumes, plan: VolumePlan, instance: int, faces: NDArray[np.uint32]
) -> NDArray[np.bool_]:
    """Find the casting faces (n, 3) whose volumes hold the end of parallel rays."""
    camera, light = plan.projection.camera, body_volumes.lights[instance]
    if camera.is_perspective or light[3] == 0:
        return np.zeros(len(faces), np.bool_)
    body = body_volumes.body
    # The view may be tilted slightly: along its rays the pixel does not change.
    way = np.cross(*plan.projection.matrix[:2, :3])
    way *= np.sign(way @ camera.axes()[2])
    way = body.to_mesh(instance, np.append(way, 0.0))[:3]
    corners = body.caster.vertices[(faces >> np.uint32(1)).astype(np.int64) - body.first[instance]]
    a, b, c = np.moveaxis(corners - light[:3], 1, 0)
    # The ray from the light pierces a face if all its edges pass on the same side of it.
    sides = np.stack([np.cross(tail, head) @ way for tail, head in ((a, b), (b, c), (c, a))])
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.asarray(((sides > 0) == (volume > 0)).all(0) & (volume != 0))


def _make_sides(faces: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """
    Make the sides of faces' edges, (n_sides, 6), wound outward as in ``volumes.py``.

    An edge shared by two of the faces needs no side. For a face in another volume it makes
    the same two triangles with two corners exchanged: so both have the same depths to the
    last bit, unless clipped, and no light leaks between them.
    """
    a = faces.ravel()
    b = np.roll(faces, -1, axis=1).ravel()
    there, back = (first.astype(np.int64) << 32 | second for first, second in ((a, b), (b, a)))
    _, index, times = np.unique(there, return_inverse=True, return_counts=True)
    once = times[index.ravel()] == 1
    inner = once & np.isin(back, there[once])
    a, b = a[~inner], b[~inner]
    sides = np.stack([b, a, a | FAR, b, a | FAR, b | FAR], 1)
    other = np.stack([b, a, b | FAR, b | FAR, a, a | FAR], 1)
    return np.where((a < b)[:, None], sides, other)


def _find_convex(body_volumes: BodyVolumes) -> NDArray[np.bool_]:
    """Find the shells that are one convex component of which only lit faces cast."""
    body = body_volumes.body
    alone = np.bincount(body.component_shell, minlength=body.n_shells) == 1
    simple = body.is_convex & ~body_volumes.opened
    is_simple = np.zeros((len(body.groups), body.n_shells), np.bool_)
    is_simple[:, body.component_shell] = simple
    return (is_simple & alone).ravel()
