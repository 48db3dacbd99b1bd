"""
Soft shadows from scaled layers of the hard volume, after Weng, Daman and Rahim (2008).

The caster is enlarged in n steps across the way to the light, and the shadows of all
steps are laid over one another, the lightest and widest first, the hard shadow last. A
penumbra outside the hard shadow comes out, as wide at contact as far away, and of the
same width for every light: it looks soft, and is no light's shadow.

The paper gives *length* and *gap* without units and scales about the light, which
changes nothing. Here (`docs/soft.md`) they count tenths of the silhouette's radius: layer
m is enlarged 1 + m gap / 10 times across the way from the silhouette's centre to the
light, for m = 1 ... n, n = round(length / gap). Such a map leaves the light where it is,
so lit faces and silhouette stay: a layer is the shadow volume of the mapped caster. The
paper's own counting, sides without caps, misses shadows of layers; caps are counted.

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
    from umbra.cpu.frame import FrameCounter

__all__ = [
    "GAP",
    "LENGTH",
    "Layers",
    "find_growth",
    "find_opacities",
    "part_components",
    "visibility",
]

LENGTH = Softness.length
"""How far the widest layer goes [tenths of the silhouette's radius]."""
GAP = Softness.gap
"""From each layer to the next, in the same unit."""


def visibility(
    counter: "FrameCounter",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    *,
    length: float = LENGTH,
    gap: float = GAP,
) -> NDArray[np.float32]:
    """
    Find how much light the stacked layers leave to each visible point, see `umbra.soft`.

    Only the light's middle matters; of ``length`` and ``gap`` the paper recommends 2 to 3, and 0.3
    to 0.5. `InputError` if they make no layer, or more than 1,000.
    """
    opacities = find_opacities(Softness(length=length, gap=gap).layers)
    left = np.ones(frame.part.shape, np.float32)
    hard = counter.count(view, camera, light.light) != 0
    layers = Layers.of(counter, light.light)
    shown = _find_components(counter, view)
    for m in range(len(opacities) - 1, 0, -1):
        layer = layers.scaled(1 + m * gap / 10)
        within = np.zeros(left.shape, np.bool_)
        for chosen, receives in _pair_off(len(layer.is_closed), shown):
            some = counter.with_caster(_choose(layer, chosen))
            within |= receives & (some.count_undrawn(view, camera, light.light) != 0)
        left[within] *= np.float32(1.0 - opacities[m])
    left[hard] *= np.float32(1.0 - opacities[0])
    return left


def find_opacities(n: int, darkness: float = 1.0) -> NDArray[np.float64]:
    """
    Find how much the hard shadow and layers 1 to n darken, so that the stack does evenly.

    The darkness below layer m is to be S_m = D (n + 1 - m) / (n + 1); laid over the wider
    ones, layer m must then take a_m = (S_m - S_{m+1}) / (1 - S_{m+1})
    = D / (n + 1 - D (n - m)), D being that of the hard shadow.
    """
    return darkness / (n + 1 - darkness * (n - np.arange(n + 1.0)))


@dataclass(frozen=True, eq=False)
class Layers:
    """
    A caster with the centres about which its components grow, kept for all layers.

    Components share no vertices. For each vertex, of its component: ``centers`` of the
    silhouette; ``axes``, the unit way from there to the light, 0 where there is no silhouette to
    grow; ``sunk``, a millionth of the radius away from the light, as a cap that grows in its own
    plane must not lie before the faces that it comes from.
    """

    caster: Caster
    centers: NDArray[np.float64]
    axes: NDArray[np.float64]
    sunk: NDArray[np.float64]

    @classmethod
    def of(cls, counter: "FrameCounter", light: Light) -> "Layers":
        """Prepare the casters of a counter for a light."""
        caster, place = counter.caster, light.local(counter.scene.origin)
        centers, axes, radii = find_growth(caster, place, caster.vertices, place)
        parted, of_vertex = part_components(caster)
        sunk = -1e-6 * (radii[:, None] * axes)[of_vertex]
        return cls(parted, centers[of_vertex], axes[of_vertex], sunk)

    def scaled(self, factor: float) -> Caster:
        """Return the caster enlarged across the way to the light."""
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
    place: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """
    Find how each component of a caster grows.

    Parameters
    ----------
    caster : Caster
    light : (4,) float64
        In the caster's frame.
    vertices : (n_vertices, 3) float64
        The caster's, in the frame in which it is to grow [m].
    place : (4,) float64
        The light in that frame.

    Returns
    -------
    centers : (n_components, 3) float64
        Of the silhouettes, weighted by the edges' lengths.
    axes : (n_components, 3) float64
        The unit way from there to the light; 0 where there is no silhouette to grow.
    radii : (n_components,) float64
        How far a vertex is from the centre at most [m].
    """
    n = len(caster.is_closed)
    ((_, found),) = find_silhouettes(caster, light[None])
    edges = found.codes[: found.starts[1]] >> 2
    component = caster.component[caster.edge_faces[edges, 0]]
    one, two = (vertices[caster.edges[edges, k]] for k in range(2))
    lengths = np.linalg.norm(two - one, axis=1)
    total = np.bincount(component, lengths, n)
    has_any = total > 0
    sums = [np.bincount(component, lengths * x, n) for x in ((one + two) / 2).T]
    centers = np.stack(sums, 1) / np.where(has_any, total, 1.0)[:, None]
    axes = place[:3] - place[3] * centers
    size = np.linalg.norm(axes, axis=1)
    axes *= (has_any / np.where(size > 0, size, 1.0))[:, None]
    radii = np.zeros(n)
    of_corner = np.repeat(caster.component, 3)
    apart = np.linalg.norm(vertices[caster.faces.ravel()] - centers[of_corner], axis=1)
    np.maximum.at(radii, of_corner, apart)
    return centers, axes, radii


def part_components(caster: Caster) -> tuple[Caster, NDArray[np.int64]]:
    """Give each component vertices of its own; return those components too, ascending by vertex."""
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


def _find_components(counter: "FrameCounter", view: DepthBuffer) -> NDArray[np.int32]:
    """Return the component that each pixel shows, (rows, cols) int32; -1 for none."""
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
    Divide components so that each casts on all others but never on itself.

    Two numbers differ in some binary digit: those with a 0 there cast on those with a 1,
    and the reverse, for each digit in turn. Yields the casters (n,), and their pixels.
    """
    numbers = np.arange(n)
    for digit in range(max((n - 1).bit_length(), 1)):
        for value in range(2):
            chosen = (numbers >> digit & 1) == value
            if chosen.any():
                yield chosen, (shown < 0) | ((shown >> digit & 1) != value)


def _choose(caster: Caster, chosen: NDArray[np.bool_]) -> Caster:
    """Keep some of a caster's components."""
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
