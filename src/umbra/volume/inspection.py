"""What a mesh is: closed or not and why, where its bad edges are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.scene import Scene
from umbra.volume.adjacency import make_caster
from umbra.volume.weld import weld_vertices

__all__ = ["Inspection", "PartReport", "inspect_scene"]


@dataclass(frozen=True)
class PartReport:
    """
    What a part is, among all triangles of its scene.

    ``closed``: only its lit faces cast (each belongs to a closed component).
    ``border_edges`` have one face, ``nonmanifold_edges`` more than two, and
    ``inconsistent_edges`` two that run along it the same way. Edges are counted once
    for each part that they touch, wherever their other faces belong.
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
    """
    What a scene is.

    Parameters
    ----------
    parts : list of PartReport
    total : PartReport
        Of all parts together; each edge counts once.
    vertices : int
        Places that triangles use, after welding.
    first_bad_edge : (2, 3) float64, optional
        Ends of the first edge that keeps the scene from being closed, in the
        model's own coordinates [m].
    """

    parts: list[PartReport]
    total: PartReport
    vertices: int
    first_bad_edge: NDArray[np.float64] | None


def inspect_scene(scene: Scene) -> Inspection:
    """
    Find out what the triangles of a scene make.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    inspection : Inspection
    """
    soup = scene.triangles()
    n_parts = len(scene.parts)
    caster = make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])
    is_open = np.zeros(len(soup.faces), np.bool_)
    is_open[caster.source[~caster.face_is_closed]] = True

    faces = weld_vertices(soup.vertices)[soup.faces]
    a, b, c = (soup.vertices[faces[:, k]] for k in range(3))
    # Zero area to the last digit of the coordinates, not to a tolerance.
    degenerate = np.asarray(~np.cross(b - a, c - a).any(1))
    _, first, times = np.unique(np.sort(faces, 1), axis=0, return_index=True, return_counts=True)
    duplicate = np.ones(len(faces), np.bool_)
    duplicate[first] = False

    whole = (faces != np.roll(faces, 1, 1)).all(1)
    tail, head = faces[whole].ravel(), np.roll(faces[whole], -1, 1).ravel()
    part = np.repeat(soup.part[whole], 3)
    ends, edge, n_faces = np.unique(
        np.stack([np.minimum(tail, head), np.maximum(tail, head)], 1),
        axis=0, return_inverse=True, return_counts=True,
    )  # fmt: skip
    edge = edge.ravel()
    sums = np.zeros(len(ends), np.int64)
    np.add.at(sums, edge, np.where(tail < head, 1, -1))
    kinds: list[NDArray[np.bool_]] = [n_faces == 1, n_faces > 2, (n_faces == 2) & (sums != 0)]
    touched = np.unique(np.stack([edge, part], 1), axis=0)

    def per_part(values: NDArray, owner: NDArray) -> NDArray[np.int64]:
        return np.bincount(owner[values], minlength=n_parts)

    columns = [
        np.bincount(soup.part, minlength=n_parts),
        per_part(is_open, soup.part),
        *(per_part(kind[touched[:, 0]], touched[:, 1]) for kind in kinds),
        per_part(degenerate, soup.part),
        per_part(duplicate, soup.part),
    ]
    reports = [
        PartReport(part.name, part.kind, int(row[0]), not row[1], *(int(n) for n in row[2:]))
        for part, row in zip(scene.parts, np.stack(columns, 1), strict=True)
    ]
    counts = [int(kind.sum()) for kind in (*kinds, degenerate)] + [int((times - 1).sum())]
    total = PartReport("all", "", len(faces), not is_open.any(), *counts)
    bad = np.flatnonzero(sums)
    corner = soup.vertices[ends[bad[0]]] + scene.origin if len(bad) else None
    return Inspection(reports, total, len(np.unique(faces)), corner)
