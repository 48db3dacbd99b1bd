"""Inspection of meshes: whether they are closed, and their bad edges."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Scene
from umbra.volume.adjacency import find_components, find_whole, make_planes, weld_vertices
from umbra.volume.half_edges import HalfEdges, sort

__all__ = ["Inspection", "PartReport", "describe_scene", "inspect_scene"]


@dataclass(frozen=True)
class PartReport:
    """
    Properties of a part, among all triangles of its scene.

    ``closed``: only its lit faces cast (each belongs to a closed component). ``border_edges`` have
    one face, ``nonmanifold_edges`` more than two, and ``inconsistent_edges`` two faces of the same
    direction. Edges count once for each part that they touch, whatever part their other faces
    belong to.
    """

    name: str
    kind: str
    triangles: int
    closed: bool
    border_edges: int
    nonmanifold_edges: int
    inconsistent_edges: int
    degenerate_triangles: int
    duplicate_triangles: int


@dataclass(frozen=True, eq=False)
class Inspection:
    """Inspection of a scene."""

    parts: list[PartReport]
    total: PartReport  # of all parts; each edge counts once
    vertices: int  # number of vertices in use, after welding
    # (2, 3) ends of the first edge that makes the scene open, in the model's frame [m]
    first_bad_edge: NDArray[np.float64] | None


def inspect_scene(scene: Scene) -> Inspection:
    """Inspect how the triangles of a scene and of its parts meet."""
    soup = scene.triangles()
    n_parts = len(scene.parts)
    faces = weld_vertices(soup.vertices).take(soup.faces)
    whole = find_whole(faces)
    half = HalfEdges.of(faces.take(whole, axis=0))
    part = soup.part[whole]
    component, is_closed = find_components(half, scene.groups()[part])
    is_open = np.zeros(len(faces), np.bool_)
    is_open[whole] = ~is_closed[component]
    # Exactly zero area, without a tolerance.
    degenerate = np.asarray(~make_planes(soup.vertices, faces)[:3, :-1].any(0))
    is_used = np.zeros(len(soup.vertices), np.bool_)
    is_used[faces] = True
    duplicate = _find_repeated(np.sort(faces, 1))

    starts = np.flatnonzero(half.start)
    n_faces = np.diff(starts, append=len(half.face))
    sums = np.add.reduceat(half.sign, starts, dtype=np.int32) if len(starts) else np.zeros(0)
    kinds: list[NDArray[np.bool_]] = [n_faces == 1, n_faces > 2, (n_faces == 2) & (sums != 0)]
    is_bad = (n_faces != 2) | (sums != 0)
    owner = part[half.face[np.repeat(is_bad, n_faces)]]
    bad = np.flatnonzero(is_bad)
    both = np.unique(np.repeat(bad, n_faces[bad]) * n_parts + owner)
    touched, touching = np.divmod(both, n_parts)

    def per_part(values: NDArray, owner: NDArray) -> NDArray[np.int64]:
        return np.bincount(owner[values], minlength=n_parts)

    columns = [
        np.bincount(soup.part, minlength=n_parts),
        per_part(is_open, soup.part),
        *(per_part(kind[touched], touching) for kind in kinds),
        per_part(degenerate, soup.part),
        per_part(duplicate, soup.part),
    ]
    reports = [
        PartReport(part.name, part.kind, row[0], not row[1], *row[2:])
        for part, row in zip(scene.parts, np.stack(columns, 1).tolist(), strict=True)
    ]
    counts = [int(kind.sum()) for kind in (*kinds, degenerate)] + [int(duplicate.sum())]
    total = PartReport("all", "", len(faces), not is_open.any(), *counts)
    corner = None
    if sums.any():
        ends = divmod(int(half.key[starts[np.flatnonzero(sums)[0]]]), 1 << 32)
        corner = soup.vertices[list(ends)] + scene.origin
    return Inspection(reports, total, int(is_used.sum()), corner)


def _find_repeated(rows: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return whether rows of three numbers repeat an earlier row."""
    order = np.arange(len(rows), dtype=np.int32)
    for column in np.ascontiguousarray(rows.T):
        order = sort(column, order)  # stable: the first of equal rows remains first
    ordered = rows.take(order, axis=0)
    repeated = np.zeros(len(rows), np.bool_)
    repeated[order[1:]] = (ordered[1:] == ordered[:-1]).all(1)
    return repeated


def describe_scene(scene: Scene, inspection: Inspection) -> dict[str, Any]:
    """Describe a scene, its place and its triangles, as ``umbra inspect --json`` prints it."""
    total = {
        name: value
        for name, value in vars(inspection.total).items()
        if name not in {"name", "kind"}
    }
    formats = (source.format for source in scene.sources if not source.is_companion)
    return {
        "format": ", ".join(dict.fromkeys(formats)),
        "parts": [
            {**vars(report), "layer": part.layer, "tags": list(part.tags)}
            for report, part in zip(inspection.parts, scene.parts, strict=True)
        ],
        "vertices": inspection.vertices,
        "triangles": total.pop("triangles"),
        "bounds": scene.bounds().tolist(),
        **total,
        "first_bad_edge": None
        if inspection.first_bad_edge is None
        else inspection.first_bad_edge.tolist(),
        "crs": scene.crs,
        "latitude": scene.latitude,
        "longitude": scene.longitude,
        "elevation": scene.elevation,
        "is_ellipsoidal": scene.is_ellipsoidal,
        "true_north_deg": scene.true_north,
        "ground": scene.ground,
        "layers": list(dict.fromkeys(part.layer for part in scene.parts if part.layer)),
        "animations": [
            {"name": animation.name, "duration": animation.duration}
            for animation in scene.animations
        ],
        "lights": len(scene.lights),
        "notes": list(scene.notes),
    }
