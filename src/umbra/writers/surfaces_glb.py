"""
Sampled surfaces as texture pictures, and as GLB with these textures.

A picture assigns a sample to each square of each surface.
"""

import io
import os
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from umbra.study import Study
from umbra.writers.glb import Glb, list_corners, turn_y_up
from umbra.writers.pixels import shade_ramp

__all__ = [
    "FacadeLayout", "FacadeSamples", "draw_facades", "find_places", "lay_out_facades",
    "write_surfaces_glb",
]  # fmt: skip

MOST_SQUARES = 1_000_000
"""Of all surfaces together; finer samples are not all shown."""
LARGEST = 4096
"""Largest side of a texture that all viewers support [pixel]."""
_RIM = 1  # pixels around each surface, of its own colours, for viewers that blend
_GREY = (0.80, 0.80, 0.80, 1.0)  # of unsampled surfaces


class FacadeSamples(Protocol):
    """Fields of ``umbra.receivers.surface_samples.Samples``; see there."""

    @property
    def points(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def surface(self) -> NDArray[np.int32]: ...  # noqa: D102
    @property
    def corners(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def owner(self) -> NDArray[np.int64]: ...  # noqa: D102
    @property
    def axes(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def start(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def cells(self) -> NDArray[np.int64]: ...  # noqa: D102
    @property
    def spacing(self) -> float: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class FacadeLayout:
    """A grid of squares on each surface, and the sample shown in each."""

    side: NDArray[np.float64]  # (n_surfaces,) of a surface's squares [m]
    # (n_surfaces, 2) squares along the surface's horizontal and upward axes
    shape: NDArray[np.int64]
    first: NDArray[np.int64]  # (n_surfaces,) first square of each surface in ``sample``
    # (n_squares,) row after row upward; a square without a sample shows the nearest one
    sample: NDArray[np.int64]

    @property
    def is_whole(self) -> bool:
        """Whether no square is larger than the samples' spacing."""
        return bool((self.side == self.side.min()).all())


def lay_out_facades(samples: FacadeSamples, most: int = MOST_SQUARES) -> FacadeLayout:
    """Lay out every surface in its own plane, in at most ``most`` squares altogether."""
    surfaces = len(samples.cells)
    times = np.ones(surfaces, np.int64)
    # A ragged surface in a large box takes far more squares than it has samples.
    counts = np.bincount(samples.surface, minlength=surfaces)
    while True:
        shape = -(-samples.cells // times[:, None])
        squares = shape.prod(1)
        if squares.sum() <= most or not (squares > 4).any():
            break
        wide = squares > 16 * counts + 64
        times[wide if wide.any() else squares > 4] *= 2
    first = np.cumsum([0, *squares])[:-1]
    axes, points = samples.axes[samples.surface], samples.points
    flat = np.einsum("nj,nkj->nk", points, axes) - samples.start[samples.surface]
    position = np.rint(flat / samples.spacing).astype(np.int64) // times[samples.surface, None]
    col, row = np.clip(position, 0, shape[samples.surface] - 1).T
    table = np.full(int(squares.sum()), -1, np.int64)
    square = first[samples.surface] + row * shape[samples.surface, 0] + col
    table[square[::-1]] = np.arange(len(points))[::-1]  # of several the first
    empty = np.flatnonzero(table < 0)
    if len(empty):
        from scipy.ndimage import distance_transform_edt  # noqa: PLC0415 - 0.4 s

    for surface in np.unique(np.searchsorted(first, empty, side="right") - 1):
        span = slice(first[surface], first[surface] + squares[surface])
        own = table[span].reshape(shape[surface, 1], shape[surface, 0])
        nearest = distance_transform_edt(own < 0, return_distances=False, return_indices=True)
        table[span] = own[tuple(nearest)].ravel()
    return FacadeLayout(times * np.float64(samples.spacing), shape, first, table)


def write_surfaces_glb(
    path: str | os.PathLike[str], study: Study, most_hours: float | None = None
) -> None:
    """
    Write the sampled parts, a node each, coloured by hours in shadow; the rest is grey.

    Where several files share a scale, ``most_hours`` is its end [h].
    """
    samples = study.samples
    assert samples is not None
    most = study.up_hours if most_hours is None else most_hours
    scene, soup = study.model.scene, study.model.soup
    layout = lay_out_facades(samples, MOST_SQUARES)
    picture, corner, scale = draw_facades(layout, study.shadow_hours / max(most, 1e-9))
    middle = np.round(scene.bounds().mean(0)) - scene.origin
    middle[2] = scene.bounds()[0, 2] - scene.origin[2]
    glb = Glb.of_study(study, scene.origin + middle, most)
    stream = io.BytesIO()
    picture.save(stream, "PNG", compress_level=6)
    texture = {"index": glb.add_texture(stream.getvalue())}
    colored = glb.add_material(lit=False, baseColorTexture=texture)
    flat = find_places(samples, layout)
    size = np.array(picture.size)
    where = (corner[samples.owner][:, None] + scale * flat) / size
    names = np.asarray(study.more["part"][1])
    owner = np.asarray(study.more["surface_part"][1])[samples.owner]
    for k, name in enumerate(names.tolist()):
        is_own = owner == k
        points = turn_y_up((samples.corners[is_own] - middle).reshape(-1, 3))
        if len(points):
            glb.add_mesh(
                name, list_corners(points), colored, _tell(study, k), POSITION=points,
                TEXCOORD_0=np.ascontiguousarray(where[is_own].reshape(-1, 2), "<f4"),
            )  # fmt: skip
    rest = soup.vertices[soup.faces[~np.isin(soup.part, samples.part)]]
    if len(rest):
        points = turn_y_up((rest - middle).reshape(-1, 3))
        grey = glb.add_material(baseColorFactor=_GREY)
        glb.add_mesh("not sampled", list_corners(points), grey, POSITION=points)
    glb.write(path)


def _tell(study: Study, part: int) -> dict[str, object]:
    """Return a part's figures."""
    keys = ("area", "mean_sun_hours", "least_sun_hours", "most_sun_hours")
    return {key: round(float(study.more[f"part_{key}"][1][part]), 3) for key in keys}


def find_places(samples: FacadeSamples, layout: FacadeLayout) -> NDArray[np.float64]:
    """Return each corner's position in its surface's squares, (n_triangles, 3, 2)."""
    axes = samples.axes[samples.owner]
    flat = np.einsum("fij,fkj->fik", samples.corners, axes)
    flat -= (samples.start - samples.spacing / 2)[samples.owner][:, None]
    flat /= layout.side[samples.owner][:, None, None]
    return np.clip(flat, 0, layout.shape[samples.owner][:, None])


def draw_facades(
    layout: FacadeLayout, shares: NDArray[np.floating], scales: tuple[int, ...] = (4, 2, 1)
) -> tuple[Image.Image, NDArray[np.int64], int]:
    """
    Lay all surfaces side by side into one picture, with its colours of ``hours.png``.

    A square is as many pixels long as the first of ``scales`` whose picture viewers support.
    Returns it, the pixel (x, y) at which each surface's first square begins, rows running down,
    and how many pixels a square is long.
    """
    for scale in scales:
        corner, size = _arrange(layout.shape * scale + 2 * _RIM)
        if max(size) <= LARGEST:
            break
    pixels = np.zeros((size[1], size[0]), np.uint8)
    shade = np.clip(np.nan_to_num(shares) * 255 + 0.5, 0, 255).astype(np.uint8)
    for surface, (cols, rows) in enumerate(layout.shape.tolist()):
        first = layout.first[surface]
        own = shade[layout.sample[first : first + cols * rows]].reshape(rows, cols)
        x, y = corner[surface]
        drawn = np.pad(own.repeat(scale, 0).repeat(scale, 1), _RIM, mode="edge")
        pixels[y : y + drawn.shape[0], x : x + drawn.shape[1]] = drawn
    picture = Image.fromarray(pixels, "P")
    picture.putpalette(np.rint(shade_ramp() * 255).astype(np.uint8).tobytes())
    return picture, corner + _RIM, scale


def _arrange(sizes: NDArray[np.int64]) -> tuple[NDArray[np.int64], tuple[int, int]]:
    """Put rectangles on shelves, the highest first; return their corners and the picture's size."""
    wide = int(max(sizes[:, 0].max(), np.ceil(np.sqrt(sizes.prod(1).sum()) * 1.02)))
    corner = np.zeros_like(sizes)
    x = y = high = 0
    for k in np.argsort(-sizes[:, 1], kind="stable").tolist():
        if x + sizes[k, 0] > wide:
            x, y, high = 0, y + high, 0
        corner[k] = x, y
        x, high = x + int(sizes[k, 0]), max(high, int(sizes[k, 1]))
    return corner, (wide, y + high)
