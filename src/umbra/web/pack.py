"""
A scene as one compressed block of bytes, for the renderer in the browser.

Positions are whole multiples of a power of two, within 2^24 of them: float32 holds them exactly,
so that the card, the page's float64 rays and umbra see the same geometry. `quantise` returns that
geometry as a scene. Adjacency is that of ``umbra.volume``: for each pair of faces (a, b) the edge
as face a winds it, and whether b winds it the same way. With c = +1 for a lit face, and 0 or (in
an open component) -1 for an unlit one, the edge's multiplicity is c(a) + c(b) if b winds it the
same way, else c(a) - c(b); a border has no b.

The block is deflated: a header as JSON and streams of integers, which are differences of neighbours
in planes of bytes, so that they compress to a few bytes for each face. ``model.js`` reads it.
"""

import json
import struct
import zlib
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.lights import Horizon
from umbra.scene import Part, Scene
from umbra.scene.mesh import ADDED_GROUND, Mesh, transform_points
from umbra.scene.pale import PAPER
from umbra.sun import Site
from umbra.volume.adjacency import Caster, make_caster

__all__ = ["pack_model", "quantise"]

VERSION = 3
FINEST = 13  # 2^-13 m, an eighth of a millimetre
_BITS = 24  # of float32
_SMOOTH = 511  # steps of an octahedral normal to each side


def quantise(scene: Scene) -> Scene:
    """
    Return the scene that the browser draws: positions rounded to a power of two, no instances.

    The step is 2^-13 m, or the finest with which the model's extent is 2^24 steps. The origin is a
    whole number of metres near the model's middle. Each part has its own mesh without texture.
    """
    soup = scene.triangles()
    if not len(soup.faces):
        msg = "the scene has no triangles; there is nothing to draw"
        raise InputError(msg)
    low, high = scene.bounds() - scene.origin
    middle = np.round((low + high) / 2)
    reach = float(np.maximum(high - middle, middle - low).max())
    step = _find_step(reach)
    parts = []
    shared: dict[int, NDArray[np.float64]] = {}  # vertex arrays that parts share stay shared
    for part in scene.parts:
        mesh = part.mesh
        vertices, normals, faces = mesh.vertices, mesh.normals, mesh.faces
        if part.transform is not None:
            vertices = transform_points(part.transform, vertices)
            turn = np.linalg.inv(part.transform[:3, :3]).T
            normals = None if normals is None else normals @ turn
            if np.linalg.det(part.transform[:3, :3]) < 0:
                faces = faces[:, ::-1]
            rounded = _round(vertices - middle, step)
        elif id(vertices) in shared:
            rounded = shared[id(vertices)]
        else:
            rounded = shared[id(vertices)] = _round(vertices - middle, step)
        parts.append(replace(part, mesh=Mesh(rounded, faces, normals), transform=None))
    return replace(scene, parts=tuple(parts), origin=scene.origin + middle)


def _round(vertices: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Round to whole multiples of a step."""
    rounded: NDArray[np.float64] = np.round(vertices / step) * step
    return rounded


def _find_step(reach: float) -> float:
    """Return the finest power of two of which 2^24 reach as far [m]."""
    if not np.isfinite(reach):
        msg = "the scene has vertices that are not finite; repair the file"
        raise InputError(msg)
    needed = int(np.ceil(np.log2(max(reach, 1e-9)))) - _BITS + 1
    return float(2.0 ** max(needed, -FINEST))


def pack_model(
    scene: Scene, site: Site | None = None, surface: NDArray[np.integer] | None = None,
    land: Horizon | None = None,
) -> bytes:  # fmt: skip
    """
    Pack a scene for the renderer in the browser.

    Parameters
    ----------
    scene : Scene
        Its geometry is packed as `quantise` returns it.
    site : Site, optional
        Place on earth, for the sun.
    surface : (n_faces,) int, optional
        Surface of a study's samples of each face of ``scene.triangles()``; -1 is none.
    land : Horizon, optional
        Land far away, which hides the sun and the sky.

    Returns
    -------
    block : bytes
        What ``unpackModel`` of ``model.js`` takes.

    Raises
    ------
    InputError
        If the scene has no triangles.
    """
    rounded = quantise(scene)
    soup = rounded.triangles()
    caster = make_caster(soup.vertices, soup.faces, rounded.groups()[soup.part])
    if not len(caster.faces):
        msg = "every triangle of the scene has two equal corners; there is nothing to draw"
        raise InputError(msg)
    shells = _find_shells(caster)
    order = np.argsort(shells, kind="stable")
    vertex, faces = _renumber(caster.faces[order])
    step = _find_step(float(np.abs(soup.vertices).max()))
    places = np.round(soup.vertices[vertex] / step).astype(np.int64)
    streams = _Streams()
    streams.add("places", places, places=True)
    highest = np.maximum.accumulate(np.append(-1, faces.ravel()))[:-1]
    streams.add("corners", highest + 1 - faces.ravel())
    streams.add("part", soup.part[caster.source[order]], differences=True)
    streams.add("shell", shells[order], differences=True)
    streams.add("component", caster.component[order], differences=True)
    streams.add("closed", caster.is_closed)
    _add_edges(streams, caster, order)
    if any(part.mesh.normals is not None for part in rounded.parts):
        streams.add("normals", _find_normals(rounded, caster.source[order]))
    if surface is not None:
        streams.add("surface", surface[caster.source[order]] + 1, differences=True)
    head = {
        "version": VERSION,
        "step": step,
        "origin": rounded.origin.tolist(),
        "ground": None if scene.ground is None else scene.ground - float(rounded.origin[2]),
        "site": None if site is None else _describe_site(site, land),
        "parts": [
            [part.name, part.kind, part.layer, label, _find_color(part), part.material.opacity]
            for part, label in zip(rounded.parts, rounded.labels(), strict=True)
        ],
        "streams": streams.heads,
    }
    text = json.dumps(head, separators=(",", ":")).encode()
    return zlib.compress(struct.pack("<I", len(text)) + text + b"".join(streams.bodies), 9)


def _find_color(part: Part) -> list[float]:
    """Return the colour of a part, linear RGB: paper for an added ground, as in pictures."""
    return list(PAPER if part.kind in ADDED_GROUND else part.color)


def _describe_site(site: Site, land: Horizon | None) -> dict[str, object]:
    """Return a site as the page's sun needs it."""
    return {
        "latitude": site.latitude,
        "longitude": site.longitude,
        "zone": site.zone,
        "trueNorth": site.true_north,
        "elevation": site.elevation,
        "land": None
        if land is None
        else {
            "azimuth": land.azimuth.round(3).tolist(),
            "elevation": land.elevation.round(3).tolist(),
        },
    }


@dataclass
class _Streams:
    """Integer arrays as planes of bytes."""

    heads: list[list[object]] = field(default_factory=list)  # name, count, bytes, differences
    bodies: list[bytes] = field(default_factory=list)

    def add(
        self, name: str, values: NDArray, *, differences: bool = False, places: bool = False
    ) -> None:
        """Add an array; as differences of neighbours, of rows for ``places`` (n, 3)."""
        rows = np.asarray(values).astype(np.int64)
        if places:
            rows = np.diff(rows, axis=0, prepend=0).T
        elif differences:
            rows = np.diff(rows, prepend=0)
        rows = rows.ravel()
        folded = ((rows << 1) ^ (rows >> 63)).astype(np.uint32)  # small and unsigned
        width = max(1, (int(folded.max(initial=0)).bit_length() + 7) // 8)
        planes = folded.view(np.uint8).reshape(-1, 4).T[:width]
        self.heads.append([name, len(rows), width, differences or places])
        self.bodies.append(np.ascontiguousarray(planes).tobytes())


def _find_shells(caster: Caster) -> NDArray[np.int32]:
    """Find the shell of each face, (n_faces,): components that share a pair of faces are one."""
    n = len(caster.is_closed)
    a, b = caster.component[caster.edge_faces].T
    shell = np.arange(n)
    if (a != b).any():
        from scipy.sparse import coo_array  # noqa: PLC0415 - 0.1 s, and most models need none
        from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

        pairs = coo_array((np.ones(len(a)), (a, b)), (n, n))
        shell = connected_components(pairs, directed=False)[1]
    shells = shell[caster.component]
    # In the order of their first faces, which lie along a curve: neighbours stay neighbours.
    first = np.unique(shells, return_index=True)[1]
    rank = np.zeros(n, np.int32)
    rank[shells[np.sort(first)]] = np.arange(len(first))
    return rank[shells]


def _renumber(faces: NDArray[np.int32]) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """Order vertices as faces first use them; return their old numbers, and the new faces."""
    used, first, inverse = np.unique(faces.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.zeros(len(used), np.int64)
    rank[order] = np.arange(len(used))
    renumbered: NDArray[np.int64] = rank[np.asarray(inverse)].reshape(faces.shape)
    return used[order].astype(np.intp), renumbered


def _add_edges(streams: _Streams, caster: Caster, order: NDArray[np.intp]) -> None:
    """
    Add the pairs of faces in the order of their shells.

    An edge is a corner of its first face a, 3 a + k: it runs from there to the next corner. With it
    go the step from a to b in the list of faces, and 0 if b winds the edge the other way, 1 if the
    same way, 2 if there is no b.
    """
    position = np.argsort(order)
    a, b = caster.edge_faces.T
    tail = np.where(caster.weight > 0, caster.edges[:, 0], caster.edges[:, 1])
    corner = (caster.faces[a] == tail[:, None]).argmax(1)
    kind = np.where(a == b, 2, np.where(caster.turn, 1, 0))
    half = 3 * position[a] + corner
    by = np.argsort(half, kind="stable")
    streams.add("edge", half[by], differences=True)
    streams.add("across", (position[b] - position[a])[by])
    streams.add("pair", kind[by])


def _find_normals(scene: Scene, source: NDArray[np.int32]) -> NDArray[np.int64]:
    """
    Find the octahedral normals of all corners, (n_faces, 3, 2), in steps.

    Corners without one, which take the face's, are out of range.
    """
    rows = []
    for part in scene.parts:
        given = part.mesh.normals
        if given is None:
            rows.append(np.full((len(part.mesh.faces), 3, 2), _SMOOTH + 1))
            continue
        used = given[part.mesh.faces].reshape(-1, 3)  # of an array that parts may share
        size = np.abs(used).sum(1, keepdims=True)
        flat = used / np.where(size > 0, size, 1.0)
        folded = (1.0 - np.abs(flat[:, [1, 0]])) * np.where(flat[:, :2] >= 0, 1.0, -1.0)
        steps = np.round(_SMOOTH * np.where(flat[:, 2:] < 0, folded, flat[:, :2])).astype(np.int64)
        rows.append(steps.reshape(-1, 3, 2))
    return np.concatenate(rows)[source]
