"""
Soft shadows from scaled layers of the hard volume, after Weng, Daman and Rahim (2008).

The caster is enlarged in n steps perpendicular to the light's direction, and the shadows of all
steps are blended, the lightest and widest first, the hard shadow last. The result is a penumbra
outside the hard shadow, as wide at contact as far away, and equal for every light: it looks soft
but matches no real light.

The paper defines *length* and *gap* without units and scales about the light, which changes
nothing. Here (`docs/soft.md`) they are in tenths of the silhouette's radius: layer m is scaled by 1
+ m gap / 10 perpendicular to the line from the silhouette's centre to the light, for m = 1 ... n, n
= round(length / gap). This map fixes the light, so lit faces and silhouette stay: a layer is the
shadow volume of the mapped caster. The paper counts sides without caps, which misses shadows of
layers; here caps are counted.

An enlarged caster encloses part of its own lit faces, so no layer of a component falls on
that component: its shadow on itself stays hard.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.methods import Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import DepthBuffer
from umbra.scene import Camera, Light
from umbra.soft import AreaLight
from umbra.volume.adjacency import Caster, make_planes
from umbra.volume.silhouette import find_silhouettes

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = [
    "GAP",
    "LENGTH",
    "Layers",
    "find_growth",
    "find_layer_opacities",
    "find_visibility_by_layers",
    "part_components",
]

LENGTH = Softness.length
"""Extent of the widest layer [tenths of the silhouette's radius]."""
GAP = Softness.gap
"""Step between layers, in the same unit."""


def find_visibility_by_layers(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    *,
    length: float = LENGTH,
    gap: float = GAP,
) -> NDArray[np.float32]:
    """
    Find the share of light that the blended layers leave at each visible point, see `umbra.soft`.

    Only the light's centre matters; the paper recommends a ``length`` of 2 to 3 and a ``gap`` of
    0.3 to 0.5. `InputError` if they make no layer, or more than 1,000.
    """
    opacities = find_layer_opacities(Softness(length=length, gap=gap).layers)
    left = np.ones(frame.part.shape, np.float32)
    hard = counter.count(view, camera, light.light) != 0
    layers = Layers.of(counter, light.light)
    shown = _find_components(counter, view)
    for m in range(len(opacities) - 1, 0, -1):
        layer = layers.scaled(1 + m * gap / 10)
        within = np.zeros(left.shape, np.bool_)
        for chosen, receives in _pair_off(len(layer.is_closed), shown):
            layer_counter = counter.with_caster(_choose(layer, chosen))
            within |= receives & (layer_counter.count_undrawn(view, camera, light.light) != 0)
        left[within] *= np.float32(1.0 - opacities[m])
    left[hard] *= np.float32(1.0 - opacities[0])
    return left


def find_layer_opacities(n: int, darkness: float = 1.0) -> NDArray[np.float64]:
    """
    Find the opacities of the hard shadow and layers 1 to n that darken in even steps.

    The darkness below layer m shall be S_m = D (n + 1 - m) / (n + 1); blended over the wider ones,
    layer m must then have a_m = (S_m - S_{m+1}) / (1 - S_{m+1}) = D / (n + 1 - D (n - m)), D being
    the darkness of the hard shadow.
    """
    return darkness / (n + 1 - darkness * (n - np.arange(n + 1.0)))


@dataclass(frozen=True, eq=False)
class Layers:
    """
    A caster with the centres of its components' enlargement, shared by all layers.

    Components share no vertices. For each vertex, of its component: ``centers`` of the silhouette;
    ``axes``, unit vectors from there to the light, 0 if there is no silhouette; ``sunk``, an offset
    of a millionth of the radius away from the light, as a cap enlarged in its own plane must not
    lie in front of its original faces.
    """

    caster: Caster
    centers: NDArray[np.float64]
    axes: NDArray[np.float64]
    sunk: NDArray[np.float64]

    @classmethod
    def of(cls, counter: "VolumeCounts", light: Light) -> "Layers":
        """Prepare a counter's caster for a light."""
        caster, source = counter.caster, light.local(counter.scene.origin)
        centers, axes, radii = find_growth(caster, source, caster.vertices, source)
        parted, of_vertex = part_components(caster)
        sunk = -1e-6 * (radii[:, None] * axes)[of_vertex]
        return cls(parted, centers[of_vertex], axes[of_vertex], sunk)

    def scaled(self, factor: float) -> Caster:
        """Return the caster enlarged perpendicular to the direction to the light."""
        apart = self.caster.vertices - self.centers
        apart -= np.einsum("ij,ij->i", apart, self.axes)[:, None] * self.axes
        grows = (self.axes != 0).any(axis=1, keepdims=True)
        vertices = self.caster.vertices + np.where(grows, (factor - 1.0) * apart, 0.0) + self.sunk
        return replace(
            self.caster, vertices=vertices, planes=make_planes(vertices, self.caster.faces)
        )


def find_growth(
    caster: Caster,
    light: NDArray[np.float64],
    vertices: NDArray[np.float64],
    source: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """
    Find centre, axis and radius of the enlargement of each component.

    Parameters
    ----------
    caster : Caster
    light : (4,) float64
        In the caster's frame.
    vertices : (n_vertices, 3) float64
        The caster's vertices, in the frame of the enlargement [m].
    source : (4,) float64
        The light in that frame.

    Returns
    -------
    centers : (n_components, 3) float64
        Centres of the silhouettes, weighted by the edges' lengths.
    axes : (n_components, 3) float64
        Unit vectors from there to the light; 0 if there is no silhouette.
    radii : (n_components,) float64
        Greatest distance of a vertex from the centre [m].
    """
    n = len(caster.is_closed)
    ((_, silhouettes),) = find_silhouettes(caster, light[None])
    edges = silhouettes.codes[: silhouettes.starts[1]] >> 2
    component = caster.component[caster.edge_faces[edges, 0]]
    tails, heads = (vertices[caster.edges[edges, k]] for k in range(2))
    lengths = np.linalg.norm(heads - tails, axis=1)
    total = np.bincount(component, lengths, n)
    has_any = total > 0
    sums = [np.bincount(component, lengths * x, n) for x in ((tails + heads) / 2).T]
    centers = np.stack(sums, 1) / np.where(has_any, total, 1.0)[:, None]
    axes = source[:3] - source[3] * centers
    size = np.linalg.norm(axes, axis=1)
    axes *= (has_any / np.where(size > 0, size, 1.0))[:, None]
    radii = np.zeros(n)
    of_corner = np.repeat(caster.component, 3)
    apart = np.linalg.norm(vertices[caster.faces.ravel()] - centers[of_corner], axis=1)
    np.maximum.at(radii, of_corner, apart)
    return centers, axes, radii


def part_components(caster: Caster) -> tuple[Caster, NDArray[np.int64]]:
    """Duplicate vertices that components share; return also each vertex's component, ascending."""
    width = np.int64(len(caster.vertices))
    of_corner = np.repeat(caster.component.astype(np.int64), 3)
    keys, faces = np.unique(of_corner * width + caster.faces.ravel(), return_inverse=True)
    of_edge = caster.component[caster.edge_faces[:, 0]].astype(np.int64)
    edges = np.searchsorted(keys, of_edge[:, None] * width + caster.edges)
    parted = replace(
        caster,
        vertices=caster.vertices[keys % width],
        faces=faces.reshape(-1, 3).astype(np.int32),
        edges=edges.astype(np.int32),
    )
    return parted, keys // width


def _find_components(counter: "VolumeCounts", view: DepthBuffer) -> NDArray[np.int32]:
    """Return the visible component of each pixel, (rows, cols) int32; -1 for none."""
    caster, part = counter.caster, counter.triangles.part
    of_face = np.full(len(part), -1, np.int32)
    if counter.casters is None:
        of_face[caster.source] = caster.component
    else:
        faces = [np.flatnonzero(part == index) for index in counter.casters]
        of_face[np.concatenate(faces)[caster.source]] = caster.component
    return np.where(view.face >= 0, of_face[np.maximum(view.face, 0)], np.int32(-1))


def _pair_off(
    n: int, shown: NDArray[np.int32]
) -> Iterator[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
    """
    Partition components so that each casts on all others but never on itself.

    Two indices differ in some binary digit: components with a 0 there cast on components with a 1,
    and the reverse, for each digit in turn. Yields the casters (n,) and their receiving pixels.
    """
    numbers = np.arange(n)
    for digit in range(max((n - 1).bit_length(), 1)):
        for value in range(2):
            chosen = (numbers >> digit & 1) == value
            if chosen.any():
                yield chosen, (shown < 0) | ((shown >> digit & 1) != value)


def _choose(caster: Caster, chosen: NDArray[np.bool_]) -> Caster:
    """Return a caster of the chosen components."""
    if chosen.all():
        return caster
    faces = chosen[caster.component]
    edges = faces[caster.edge_faces[:, 0]]
    renumbered = np.cumsum(faces, dtype=np.int32) - np.int32(1)
    return replace(
        caster,
        faces=caster.faces[faces],
        source=caster.source[faces],
        planes=caster.planes[:, np.append(faces, True)],
        component=caster.component[faces],
        edges=caster.edges[edges],
        edge_faces=renumbered[caster.edge_faces[edges]],
        turn=caster.turn[edges],
        weight=caster.weight[edges],
    )
