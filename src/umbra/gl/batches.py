"""
Batches of faces by material, with closed components apart for back-face culling.

Order in which a mesh's faces are drawn: neighbours together, so that their vertices are shared.

A device keeps the last vertices that it has placed. Where a file lists faces far from one
another in turn, as subdivided surfaces do, nearly every corner of every face is placed again.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body
from umbra.gl.geometry import is_mirrored
from umbra.kernels import kernel
from umbra.scene import Material, Mesh, Part, Scene
from umbra.scene.material import MORE_IMAGES
from umbra.scene.mesh import transform_points
from umbra.volume.adjacency import sort_along_curve

__all__ = ["IMAGES", "Batch", "FaceBatches", "count_placed", "find_draw_order", "find_solid_faces"]

_KEPT = 256  # vertices that llvmpipe keeps, by the last digits of their numbers; cards keep fewer
_FEW = 500  # faces that hardly leave such a store
_GOOD = 0.7  # vertices to place for each face: a closed surface of well-ordered faces takes 0.5
_GAIN = 0.9


def find_draw_order(scene: Scene) -> NDArray[np.intp]:
    """Order the faces of ``scene.triangles()`` part by part, (n_faces,); as in the file if good."""
    known: dict[int, NDArray[np.intp] | None] = {}
    counts = [part.triangles for part in scene.parts]
    order = np.arange(sum(counts))
    first = 0
    for part, count in zip(scene.parts, counts, strict=True):
        if count > _FEW:
            if id(part.mesh.faces) not in known:
                known[id(part.mesh.faces)] = _find_better(part.mesh)
            better = known[id(part.mesh.faces)]
            if better is not None:
                order[first : first + count] = first + better
        first += count
    return order


def _find_better(mesh: Mesh) -> NDArray[np.intp] | None:
    """Find a better order of a mesh's faces; None if the file's is as good."""
    faces = mesh.faces
    least, best = _GAIN * count_placed(faces), None
    if least <= _GAIN * _GOOD * len(faces):
        return None
    by_number = np.argsort(faces.min(1), kind="stable")
    along_curve = sort_along_curve(mesh.vertices[faces].mean(1))
    for order in (by_number, along_curve):
        placed = count_placed(faces[order])
        if placed < least:
            least, best = placed, order
    return best


@kernel
def count_placed(faces):
    """Count the vertices that a device with a small store places for faces (n, 3) in order."""
    cache = np.full(_KEPT, -1, np.int64)
    placed = 0
    for face in range(faces.shape[0]):
        for corner in range(3):
            vertex = np.int64(faces[face, corner])
            if cache[vertex % _KEPT] != vertex:
                cache[vertex % _KEPT] = vertex
                placed += 1
    return placed


_OPEN, _SOLID, _SOUND = range(3)
IMAGES = dict(zip(MORE_IMAGES, ("GLOSS", "BUMPS", "GLOW", "OPENINGS"), strict=True))
"""Names in ``surface.frag.glsl`` of a material's images."""


@dataclass(frozen=True, eq=False)
class Batch:
    """
    Faces of one material, drawn together.

    Parameters
    ----------
    first, count : int
        Range in the list of faces.
    material : Material
    has : tuple of str
        Attributes of the faces, as defines of ``surface.frag.glsl``: no others are fetched.
    is_solid : bool
        Outward faces of closed components, whose backs are never seen from outside.
    is_transparent : bool
        Drawn in layers.
    is_sound : bool
        Solid, with outward normals at all corners: no pixel need check them.
    """

    first: int
    count: int
    material: Material
    has: tuple[str, ...]
    is_transparent: bool
    is_solid: bool
    is_sound: bool


class FaceBatches:
    """
    Faces grouped by material, and in each group by what is known of their sides.

    Parameters
    ----------
    scene : Scene
    is_solid : (n_faces,) bool, optional
        From ``find_solid_faces``; no face is solid by default.
    """

    def __init__(self, scene: Scene, is_solid: NDArray[np.bool_] | None = None) -> None:
        self._kinds: list[tuple[Material, tuple[str, ...], bool]] = []
        numbers: dict[tuple, int] = {}
        batch_of_part = []
        for part in scene.parts:
            material, has = part.material, _list_carried(part)
            key = (_describe(material), has)
            batch_of_part.append(numbers.setdefault(key, len(numbers)))
            if len(self._kinds) < len(numbers):
                self._kinds.append((material, has, part.is_transparent))
        counts = np.array([part.triangles for part in scene.parts], np.intp)
        self._starts = np.append(0, np.cumsum(counts))
        self._group = np.repeat(3 * np.array(batch_of_part, np.int32), counts)
        self._drawn = find_draw_order(scene)
        self._bodies = np.full(self._starts[-1], _OPEN, np.int8)
        if is_solid is not None:
            self.classify(scene, is_solid)

    def classify(
        self, scene: Scene, is_solid: NDArray[np.bool_], bent: Iterable[int] | None = None
    ) -> bool:
        """
        Classify faces as open, solid, or solid with sound normals; return whether any changed.

        ``bent`` are the parts that may have changed; all by default.
        """
        known: dict[tuple, NDArray[np.bool_]] = {}
        has_changed = False
        for index in range(len(scene.parts)) if bent is None else bent:
            part = scene.parts[index]
            rows = slice(self._starts[index], self._starts[index + 1])
            kinds = np.where(is_solid[rows], _SOLID, _OPEN).astype(np.int8)
            if part.mesh.normals is not None and not is_mirrored(part.transform) and kinds.any():
                turn = b"" if part.transform is None else part.transform[:3, :3].tobytes()
                key = (id(part.mesh), turn)
                if key not in known:
                    known[key] = _find_sound(part)
                kinds[is_solid[rows] & known[key]] = _SOUND
            has_changed = has_changed or not np.array_equal(self._bodies[rows], kinds)
            self._bodies[rows] = kinds
        return has_changed

    def sort(self) -> tuple[NDArray[np.intp], list[Batch]]:
        """
        Sort the faces.

        Returns their order (n_faces,), batch after batch and as in ``find_draw_order``, as indices
        into ``scene.triangles()``, and the batches.
        """
        batch = self._group + self._bodies
        order = self._drawn[np.argsort(batch[self._drawn], kind="stable")]
        starts = np.searchsorted(batch[order], np.arange(3 * len(self._kinds) + 1)).tolist()
        batches = []
        for number, (first, end) in enumerate(pairwise(starts)):
            if first == end:
                continue
            body = number % 3
            solid, sound = body != _OPEN, body == _SOUND
            batches.append(Batch(first, end - first, *self._kinds[number // 3], solid, sound))
        return order, batches


def _list_carried(part: Part) -> tuple[str, ...]:
    """List the attributes of a part's faces, as defines of ``surface.frag.glsl``."""
    mesh, material = part.mesh, part.material
    has_bumps = (
        material.normal_image is not None and mesh.find_uv(material.normal_image) is not None
    )
    carried = {
        "HAS_NORMALS": mesh.normals is not None,
        "HAS_UV": bool(material.images),
        "HAS_UV2": any(image.uv_set for image in material.images),
        "HAS_IMAGE": material.image is not None,
        "IS_GLOSSY": material.roughness is not None and not material.is_unlit,
        "HAS_TANGENTS": mesh.tangents is not None and has_bumps,
        "HAS_TINTS": mesh.colors is not None or mesh.alpha is not None,
        "HAS_ALPHA": mesh.alpha is not None,
        "IS_UNLIT": material.is_unlit,
        "IS_GLOWING": any(material.emission),
        "IS_MASK": material.alpha_mode == "mask",
        "IS_BLEND": material.alpha_mode == "blend",
    }
    for field, name in IMAGES.items():
        image = getattr(material, field)
        if image is not None and (has_bumps or field != "normal_image"):
            carried[f"HAS_{name}"] = True
    return tuple(name for name, is_carried in carried.items() if is_carried)


def _find_sound(part: Part) -> NDArray[np.bool_]:
    """Find the faces whose three normals all point to the front."""
    mesh = part.mesh
    assert mesh.normals is not None
    vertices, normals = mesh.vertices, mesh.normals
    if part.transform is not None:
        vertices = transform_points(part.transform, vertices)
        x, y, z = part.transform[:3, :3]
        normals = normals @ np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)]).T
    a, b, c = vertices[mesh.faces].transpose(1, 0, 2)
    outward = np.cross(b - a, c - a)
    lean = np.einsum("ij,ikj->ik", outward, normals[mesh.faces])
    return np.asarray((lean > 0).all(1))


def _describe(material: Material) -> tuple:
    """Return the key by which materials are drawn together."""
    return (
        material.color, id(material.image), material.opacity, material.emission,
        material.is_unlit, material.alpha_mode, material.alpha_cutoff,
        material.roughness, material.metallic, material.normal_scale, material.occlusion,
        *(id(getattr(material, name)) for name in MORE_IMAGES),
    )  # fmt: skip


def find_solid_faces(
    scene: Scene, bodies: Sequence[Body], casters: Sequence[int] | None = None
) -> NDArray[np.bool_]:
    """
    Find the outward faces of closed components, whose backs are never seen from outside.

    Returns (n_faces,) bool in the order of ``scene.triangles()``; False for non-casters.
    """
    chosen = set(range(len(scene.parts)) if casters is None else casters)
    counts = np.array([part.triangles for part in scene.parts])
    starts = np.cumsum(counts) - counts
    solid = np.zeros(counts.sum(), np.bool_)
    for body in bodies:
        caster = body.caster
        for group in body.groups:
            indices = [index for index in group.parts if index in chosen]
            # The caster's faces are those of the group's parts, one part after another.
            faces = np.concatenate([starts[i] + np.arange(counts[i]) for i in indices])
            solid[faces[caster.source]] = (caster.is_closed & ~body.is_inward)[caster.component]
    return solid
