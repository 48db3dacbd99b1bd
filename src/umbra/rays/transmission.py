"""
Light through triangles that are transparent or have holes in their texture.

Such triangles cast no shadow volume. Each one that a ray from a visible point to the light crosses
leaves this share of each colour:

    (1 - a) (1 - a (1 - c))

a is the opacity at the crossing and c the colour. In a hole a is 0. A crossing with a = 1 hides the
light and adds 1 to the shadow count, as any triangle of an open mesh does.

Both devices follow this rule: triangles are `Transmitters`, with a bounding volume hierarchy in
fixed traversal order; here in float64, in ``gl/shaders/transmission.glsl`` in float32. Texture
lookup is bilinear, without mipmaps. Each edge is tested from its lower to its higher corner, so
that a ray crosses only one of two triangles that share it; a ray exactly through an edge or a
corner counts as slightly offset. A triangle through the point or the lamp is not crossed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import kernel, run_shared
from umbra.machine import use_threads
from umbra.rays.cover import BLEND, BLOCK, HIGH, LEVELS, MASK, find_opacities, trace_light
from umbra.rays.face_tree import halve_boxes
from umbra.scene import Light, Material, Scene
from umbra.scene.material import WRAPS
from umbra.scene.mesh import transform_points

__all__ = ["POINTS", "Transmitters", "find_opaque", "make_transmitters"]

POINTS = 16
"""Sample points of an area light from which light is traced."""

TOUCH = 2.0**-40
"""Distance within which a point lies on a triangle's plane, relative to the largest coordinate."""

_ROW, _MATERIAL, _NODE = 32, 12, 8
_CORNERS, _FLAGS, _LOOK, _UV, _TINT = slice(0, 12), 3, 7, 12, 20
_KINDS = {"opaque": 0.0, "mask": MASK, "blend": BLEND}
_MARGIN = 1e-9  # margin of the boxes, relative to the largest coordinate


@dataclass(frozen=True, eq=False)
class Transmitters:
    """
    The triangles of a scene that transmit light, as both devices store them.

    Parameters
    ----------
    faces : (n,) int64
        Index in ``Scene.triangles`` of each row.
    rows : (n, 32) float64
        Corners a, b, c in the scene's frame (x, y, z at 0, 4, 8) [m]; at 3 which edges run from
        the higher to the lower corner (1: a b, 2: b c, 4: c a), at 7 the material; uv of the
        corners from 12 on, their tints and opacities from 20 on.
    nodes : (n_nodes, 8) float64
        Lowest corner, next node if the ray misses the box; highest corner, row of a leaf, or -1.
        Casters only.
    materials : (m, 12) float64
        Colour and opacity; 0, 1 for a mask or 2 for blending, a mask's cutoff [levels], first texel
        (multiples of 4096, and remainder); columns (0: no texture) and rows, wrap in u and v.
    texels : (k, 4) uint8
        Texels of all textures, sRGB with linear alpha.
    """

    faces: NDArray[np.int64]
    rows: NDArray[np.float64]
    nodes: NDArray[np.float64]
    materials: NDArray[np.float64]
    texels: NDArray[np.uint8]

    def trace(
        self,
        points: NDArray[np.float64],
        light: Light,
        origin: NDArray[np.float64],
        threads: int = 1,
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """
        Find the light that reaches points through the triangles.

        Parameters
        ----------
        points : (n, 3) float64
            In the model's own coordinates [m].
        light : Light
        origin : (3,) float64
            Origin of the scene.
        threads : int

        Returns
        -------
        left : (n, 3) float32
            Transmitted share of each colour.
        hidden : (n,) int32
            Number of triangles on the ray that hide the light.
        """
        left, hidden = np.ones((len(points), 3), np.float32), np.zeros(len(points), np.int32)
        position = light.local(origin)
        coarse = max(
            np.abs(values).max(initial=0.0)
            for values in (points, light.position[:3] * light.position[3], self.rows[:, _CORNERS])
        )
        use_threads(threads)
        run_shared(
            -(-len(points) // BLOCK), trace_light,
            np.ascontiguousarray(points - origin), position, TOUCH * float(coarse), self.nodes,
            self.rows, self.materials, self.texels, left, hidden,
        )  # fmt: skip
        return left, hidden

    def find_opacity(
        self, faces: NDArray[np.signedinteger], places: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """
        Find the opacity of visible points, (n,): 1 where the face (n,) does not transmit.

        ``places`` (n, 3) are in the scene's frame. A visible mask counts as no hole, whatever
        rounding finds at its rim.
        """
        rows, opacity = self.find_rows(faces), np.ones(len(faces))
        transmissive = np.flatnonzero(rows >= 0)
        opacity[transmissive] = find_opacities(
            rows[transmissive], places[transmissive], self.rows, self.materials, self.texels
        )
        return opacity

    def find_rows(self, faces: NDArray[np.signedinteger]) -> NDArray[np.intp]:
        """Find the rows of faces, numbered as in ``Scene.triangles``; -1 for opaque faces."""
        order = self._order
        position = np.searchsorted(self.faces, faces, sorter=order)
        row = order[np.minimum(position, len(order) - 1)]
        return np.where(self.faces[row] == faces, row, -1)

    @cached_property
    def corners(self) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Unique corners, (k, 3), and the corner indices of each triangle, (n, 3)."""
        every = self.rows[:, _CORNERS].reshape(-1, 4)[:, :3]
        places, which = np.unique(every, axis=0, return_inverse=True)
        return places, which.reshape(-1, 3).astype(np.int32)

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        return np.argsort(self.faces)


def make_transmitters(scene: Scene, casters: Sequence[int] | None = None) -> Transmitters | None:
    """
    Collect the triangles of a scene that transmit light; None if there are none.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int, optional
        Casting parts, all by default; other parts only transmit the view.

    Raises
    ------
    InputError
        If a texture cannot be decoded; the error names it.
    """
    parts = [k for k, part in enumerate(scene.parts) if part.transmits]
    if not parts:
        return None
    looks: dict[int, int] = {}
    kinds: list[Material] = []
    for index in parts:
        material = scene.parts[index].material
        if id(material) not in looks:
            looks[id(material)] = len(kinds)
            kinds.append(material)
    rows = np.concatenate([_make_rows(scene, index, looks) for index in parts])
    starts = np.cumsum([0] + [part.triangles for part in scene.parts])
    faces = np.concatenate([np.arange(starts[k], starts[k + 1]) for k in parts])
    chosen = set(range(len(scene.parts)) if casters is None else casters)
    casts = np.repeat([k in chosen for k in parts], [scene.parts[k].triangles for k in parts])
    corners = rows[casts, _CORNERS].reshape(-1, 3, 4)[..., :3]
    order, halves, children = halve_boxes(corners.min(1), corners.max(1))
    first = np.concatenate([np.flatnonzero(casts)[order], np.flatnonzero(~casts)])
    nodes = np.zeros((max(2 * len(corners) - 1, 0), _NODE))
    _line_up(halves, children, _MARGIN * (1.0 + np.abs(corners).max(initial=0.0)), nodes)
    materials, texels = _describe(kinds)
    return Transmitters(faces[first], rows[first], nodes, materials, texels)


def find_opaque(scene: Scene, casters: Sequence[int] | None = None) -> list[int] | None:
    """
    Find the parts among ``casters``, or all, that transmit no light.

    None if no part of the scene transmits; raises as ``make_transmitters``.
    """
    parts = range(len(scene.parts)) if casters is None else casters
    opaque = [index for index in parts if not scene.parts[index].transmits]
    return None if casters is None and len(opaque) == len(parts) else opaque


def _make_rows(scene: Scene, index: int, looks: dict[int, int]) -> NDArray[np.float64]:
    """Describe the triangles of a part, (n, 32)."""
    part = scene.parts[index]
    mesh, image = part.mesh, part.material.image
    vertices = mesh.vertices
    if part.transform is not None:
        vertices = transform_points(part.transform, vertices)
    rows = np.zeros((len(mesh.faces), _ROW))
    corners = vertices[mesh.faces]
    rows[:, _CORNERS].reshape(-1, 3, 4)[..., :3] = corners
    rows[:, _FLAGS] = sum(
        2**k * _is_after(corners[:, k], corners[:, (k + 1) % 3]) for k in range(3)
    )
    rows[:, _LOOK] = looks[id(part.material)]
    if mesh.uv is not None and image is not None:
        uv = np.nan_to_num(mesh.uv[mesh.faces].astype(np.float64), posinf=0.0, neginf=0.0)
        # Repeating coordinates are shifted near 0, where float32 resolves parts of a texel.
        whole = 2.0 * np.floor(uv.min(1, keepdims=True) / 2.0)
        uv -= np.where(np.array(image.wrap) == "clamp", 0.0, whole)
        rows[:, _UV : _UV + 6] = uv.reshape(-1, 6)
    tints = np.ones((len(corners), 3, 4))
    if mesh.colors is not None:
        tints[..., :3] = np.clip(mesh.colors[mesh.faces], 0.0, 1.0)
    if mesh.alpha is not None:
        tints[..., 3:] = np.clip(mesh.alpha[mesh.faces], 0.0, 1.0)
    rows[:, _TINT:] = tints.reshape(-1, 12)
    return rows


def _is_after(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether points come after others, by x, then y, then z."""
    x, y, z = ((first[:, k] > second[:, k], first[:, k] == second[:, k]) for k in range(3))
    return np.asarray(x[0] | (x[1] & (y[0] | (y[1] & z[0]))))


def _describe(kinds: Sequence[Material]) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Pack materials as rows, and their textures end to end."""
    materials = np.zeros((len(kinds), _MATERIAL))
    places: dict[int, int] = {}
    texels = [np.zeros((1, 4), np.uint8)]
    for row, material in zip(materials, kinds, strict=True):
        row[:4] = *material.color, material.opacity
        row[4:6] = _KINDS[material.alpha_mode], min(material.cutoff_level, 2.0 * LEVELS)
        image = material.image
        if image is None:
            continue
        if id(image) not in places:
            places[id(image)] = sum(map(len, texels))
            texels.append(image.pixels.reshape(-1, 4))
        row[6:8] = divmod(places[id(image)], HIGH)
        row[8:10] = image.pixels.shape[1::-1]
        row[10:12] = [WRAPS.index(how) for how in image.wrap]
    return materials, np.concatenate(texels)


@kernel
def _line_up(halves, children, margin, nodes):
    """Write a hierarchy's nodes in traversal order, each with its next node."""
    waiting = np.zeros(halves.shape[0] + 3, np.int64)  # nodes; -1 - index marks the end of a branch
    size = 1 if nodes.shape[0] > 0 else 0
    index = 0
    while size > 0:
        size -= 1
        node = waiting[size]
        if node < 0:
            nodes[-1 - node, 3] = index
            continue
        for axis in range(3):
            nodes[index, axis] = halves[node, axis] - margin
            nodes[index, 4 + axis] = halves[node, 3 + axis] + margin
        nodes[index, 7] = -1.0
        child = children[node]
        if child < 0:
            nodes[index, 7] = ~child
            nodes[index, 3] = index + 1
        else:
            waiting[size] = -1 - index
            waiting[size + 1] = child + 1
            waiting[size + 2] = child
            size += 3
        index += 1
