"""
Walls and roofs, sampled in their own planes.

A surface is a set of coplanar triangles of one part, connected by edges. It is covered with
squares along its horizontal and upward axes; each square whose centre is on the surface
gives a sample, on the triangle that holds it. A surface that holds no centre has one
sample, at the centroid of its largest triangle. All samples of a surface represent equal
shares of its area.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.receivers.surface_samples import Samples, place_samples
from umbra.scene import Scene
from umbra.scene.derived import derive
from umbra.volume.adjacency import make_caster, weld_vertices
from umbra.volume.half_edges import find_roots

__all__ = ["LEVEL", "find_sources", "join_coplanar", "sample_surfaces"]

_COS = 1.0 - 1e-6  # triangles within 0.08 degrees are coplanar
LEVEL = 1e-6
"""Largest horizontal part of a unit normal of a level surface."""
_MOST = 50_000_000


def sample_surfaces(
    scene: Scene,
    spacing: float,
    on: Sequence[str] = (),
    parts: Sequence[int] | None = None,
    faces: NDArray[np.int32] | None = None,
) -> Samples:
    """
    Sample the surfaces of some parts.

    Outward sides follow the file's winding; closed components wound inward are reversed.
    Surfaces that face straight down never see the sun and are left out.

    Parameters
    ----------
    scene : Scene
    spacing : float
        Distance between samples [m].
    on : sequence of str
        Shell patterns of names, kinds, layers or tags; all parts by default.
    parts : sequence of int, optional
        Indices of the parts, instead of ``on``.
    faces : (n, 3) int32, optional
        Faces of the parts' triangles, wound outward; by default found of the whole scene.

    Raises
    ------
    InputError
        If the spacing is not above 0 or makes too many samples, a pattern matches no part,
        or no surface is left to sample.
    """
    if not 0 < spacing < np.inf:
        msg = f"the spacing must be larger than 0 m; got {spacing:g}"
        raise InputError(msg, spacing=spacing)
    parts = scene.select(on, option="on") if parts is None else parts
    soup = scene.triangles(parts)
    faces = _turn_outward(scene, parts) if faces is None else faces
    corners = soup.vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(double, 1e-300)[:, None]
    sampled = np.flatnonzero((double > 0) & (normals[:, 2] > -_COS))
    if not len(sampled):
        msg = "nothing is left to sample: all surfaces face straight down; choose others with on="
        raise InputError(msg, option="on")
    faces, normals, corners = faces[sampled], normals[sampled], corners[sampled]
    area, part = double[sampled] / 2, soup.part[sampled]
    owner, is_border = join_coplanar(weld_vertices(soup.vertices)[faces], normals, part)
    order = np.argsort(owner, kind="stable")
    owner, normals, corners, area = owner[order], normals[order], corners[order], area[order]
    first = np.flatnonzero(np.append(True, owner[1:] != owner[:-1]))
    surface_area = np.add.reduceat(area, first)
    expected = surface_area.sum() / spacing**2
    if expected > _MOST:
        least = float(np.sqrt(surface_area.sum() / _MOST))
        msg = (
            f"a spacing of {spacing:g} m makes {expected:.3g} samples of "
            f"{surface_area.sum():.4g} m2; give {least:.2g} m or more, or choose parts with on="
        )
        raise InputError(msg, option="on", spacing=spacing)
    largest = _find_largest(area, first)
    axes = _make_axes(normals[largest])
    flat = np.einsum("fij,fkj->fik", corners, axes[owner])  # (n, 3 corners, along and up)
    low = np.minimum.reduceat(flat.min(1), first, axis=0)
    high = np.maximum.reduceat(flat.max(1), first, axis=0)
    # Squares are centred on each surface.
    cells = np.maximum(np.ceil((high - low) / spacing - 1e-9), 1)
    start = (low + high) / 2 - (cells - 1) / 2 * spacing
    owner, is_border = owner.astype(np.int64), is_border[order]
    counts, nothing = np.zeros(len(owner), np.int64), np.zeros((0, 3))
    is_lone = np.zeros(len(first), np.bool_)
    place_samples(flat, owner, is_border, start, spacing, corners, counts, is_lone, 0, nothing)
    is_lone = np.add.reduceat(counts, first) == 0
    counts[largest[is_lone]] = 1
    return Samples(
        part=part[order][first].astype(np.int32),
        surface_area=surface_area,
        surface_normal=normals[largest],
        share=surface_area / np.add.reduceat(counts, first),
        corners=corners,
        flat=flat,
        is_border=is_border,
        face_normals=normals,
        owner=owner,
        source=find_sources(scene, soup.part)[sampled][order],
        first=np.append(0, np.cumsum(counts)),
        is_lone=is_lone,
        axes=axes,
        start=start,
        cells=cells.astype(np.int64),
        spacing=float(spacing),
        count=int(counts.sum()),
    )


def find_sources(scene: Scene, part: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the faces in ``scene.triangles()`` of the triangles of some whole parts."""
    first = np.cumsum([0, *(len(part.mesh.faces) for part in scene.parts)])
    _, begin, which = np.unique(part, return_index=True, return_inverse=True)
    sources: NDArray[np.int64] = first[part] + np.arange(len(part)) - begin[which]
    return sources


def _turn_outward(scene: Scene, parts: Sequence[int]) -> NDArray[np.int32]:
    """Return the parts' faces, with inward-wound closed components reversed."""
    soup = scene.triangles(parts)
    everything = derive(scene, "soup", None, scene.triangles)
    caster = derive(
        scene, "caster", tuple(range(len(scene.parts))),
        lambda: make_caster(
            everything.vertices, everything.faces, scene.groups()[everything.part]
        ),
    )  # fmt: skip
    inward = np.zeros(len(everything.faces), np.bool_)
    inward[caster.source] = (caster.is_closed & caster.is_inward)[caster.component]
    is_inward = inward[np.isin(everything.part, parts)]
    faces = soup.faces.copy()
    faces[is_inward] = faces[is_inward][:, ::-1]
    return faces


def join_coplanar(
    faces: NDArray[np.integer], normals: NDArray[np.float64], part: NDArray[np.int32]
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """
    Join faces of one part in one plane by their edges.

    Returns
    -------
    owner : (n,) int
        Surface of each face.
    is_border : (n, 3) bool
        Whether the edge from each corner to the next bounds its surface.
    """
    tail, head = faces.ravel(), np.roll(faces, -1, 1).ravel()
    face = np.repeat(np.arange(len(faces), dtype=np.int32), 3)
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    half = np.lexsort((high, low, part[face]))
    low, high, face = low[half], high[half], face[half]
    same = (low[1:] == low[:-1]) & (high[1:] == high[:-1]) & (part[face[1:]] == part[face[:-1]])
    first, second = face[:-1][same], face[1:][same]
    flat = np.einsum("ij,ij->i", normals[first], normals[second]) > _COS
    root = find_roots(first[flat], second[flat], len(faces))
    is_border = np.ones(3 * len(faces), np.bool_)
    is_border[half[:-1][same][flat]] = False
    is_border[half[1:][same][flat]] = False
    return np.unique(root, return_inverse=True)[1].ravel(), is_border.reshape(-1, 3)


def _find_largest(area: NDArray[np.float64], first: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the largest triangle of each run."""
    run = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(area))))
    order = np.lexsort((-area, run))
    return order[first]


def _make_axes(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return each surface's horizontal and upward axis, (n, 2, 3)."""
    along = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))], 1)
    length = np.linalg.norm(along, axis=1)
    level = length < LEVEL
    along[level] = (1.0, 0.0, 0.0)
    along /= np.where(level, 1.0, length)[:, None]
    return np.stack([along, np.cross(normals, along)], 1)
