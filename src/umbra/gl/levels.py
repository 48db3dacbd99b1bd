"""
Levels of detail of casters: coarser meshes on the same points, for shadows of few pixels.

The corners of faces in one cell of a grid are put together at one of them. That moves a chain of
faces, so that its boundary stays closed: edges shrink to points, or cancel. If no corner moves by
more than b, a way to the light that passes the caster's silhouette at more than b, and does not
begin within b of the caster, meets the coarser mesh exactly if it meets the caster.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.bodies import Body, make_level_body
from umbra.kernels import kernel
from umbra.volume.bounds import throw_box

__all__ = ["DetailLevel", "LevelTable", "choose_levels", "make_levels"]

_FIRST = 2.0  # size of the finest cells, in the median edge's lengths
_FEWER = 0.6  # largest share of the next finer level's faces
_MOST = 8
_OUTLINE = 3.0  # triangles of a silhouette's sides, for the root of the number of faces
NONE = -1
"""A level at which nothing is left of a shell."""


@dataclass(frozen=True, eq=False)
class DetailLevel:
    """
    A coarser mesh of a body.

    Parameters
    ----------
    body : Body, optional
        None if nothing is left of any shell.
    shells : (n,) int
        The body's shell that each of this level's replaces.
    moves : (n_shells,) float64
        How far a corner of each of the body's shells moves at most, in the mesh's frame [m];
        infinite where the level has none for it.
    """

    body: Body | None
    shells: NDArray[np.intp]
    moves: NDArray[np.float64]


def make_levels(body: Body) -> list[DetailLevel]:
    """
    Make the levels of a body, from fine to coarse, each with at most 0.6 of the faces.

    A shell is left out of levels that draw no less than itself.
    """
    shell = np.zeros(len(body.caster.faces), np.int32)
    shell[body.faces] = np.repeat(np.arange(body.n_shells), np.diff(body.face_starts))
    ends = body.caster.vertices[body.caster.edges]
    cell = _FIRST * float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
    largest = float((body.bounds[:, 1] - body.bounds[:, 0]).max())
    levels: list[DetailLevel] = []
    left = len(body.caster.faces)
    while cell < 2.0 * largest and len(levels) < _MOST:
        faces, moves = cluster(body, shell, cell)
        whole = (faces != np.roll(faces, 1, axis=1)).all(1)
        moves[~_is_cheaper(body, np.bincount(shell[whole], minlength=body.n_shells))] = np.inf
        whole &= np.isfinite(moves)[shell]
        if np.isfinite(moves).any() and whole.sum() <= _FEWER * left:
            made, shells, merged = make_level_body(body, faces[whole], shell[whole])
            moves[merged] = np.inf
            levels.append(DetailLevel(made, shells, moves))
            left = int(whole.sum())
        cell *= 2.0
    return levels


def _is_cheaper(body: Body, faces: NDArray[np.intp]) -> NDArray[np.bool_]:
    """
    Find the shells of which a level with so many faces draws less than the body's silhouette.

    Levels are in no depth buffer: half of the faces are drawn as their light cap. A silhouette
    has some 1.5 edges, two triangles each, for the root of the number of faces.
    """
    fine = np.diff(body.face_starts)
    return np.asarray(0.5 * faces + _OUTLINE * np.sqrt(faces) < _OUTLINE * np.sqrt(fine))


def cluster(
    body: Body, shell: NDArray[np.int32], cell: float
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """
    Put the corners of each shell in one cell of a grid together, at that nearest to their mean.

    Returns the faces (n_faces, 3) with the corners moved, and how far any moves in each shell.
    """
    caster = body.caster
    corners, owners = caster.faces.ravel(), np.repeat(shell, 3).astype(np.int64)
    points = caster.vertices[corners]
    cells = np.floor((points - points.min(0)) / cell).astype(np.int64)
    size = cells.max(0) + 1
    key = ((owners * size[0] + cells[:, 0]) * size[1] + cells[:, 1]) * size[2] + cells[:, 2]
    _, which, counts = np.unique(key, return_inverse=True, return_counts=True)
    which = which.ravel()
    means = np.stack([np.bincount(which, points[:, k]) / counts for k in range(3)], 1)
    apart = ((points - means[which]) ** 2).sum(1)
    order = np.lexsort((corners, apart, which))
    nearest = corners[order[np.cumsum(counts) - counts]]
    moved = nearest[which]
    moves = np.zeros(body.n_shells)
    np.maximum.at(moves, owners, np.linalg.norm(caster.vertices[moved] - points, axis=1))
    return moved.reshape(-1, 3).astype(np.int32), moves


@dataclass(frozen=True, eq=False)
class LevelTable:
    """
    Levels of all shells of a scene.

    Parameters
    ----------
    chain : (n_levels, n_fine) int
        The shell that replaces each at each level, from fine to coarse; ``NONE`` where nothing is
        left.
    moves : (n_levels, n_fine) float64
        How far any corner moves at most [m]; infinite where there is no level.
    is_coarse : (n_shells,) bool
        Of all shells, fine ones first.
    """

    chain: NDArray[np.intp]
    moves: NDArray[np.float64]
    is_coarse: NDArray[np.bool_]

    @classmethod
    def of(cls, bodies: Sequence[Body], levels: Sequence[Sequence[DetailLevel]]) -> "LevelTable":
        """
        Return the levels of bodies, numbered.

        Their shells follow those of all bodies: level after level of the first body, then of the
        next; bodies without any shell are left out.
        """
        counts = [body.n_shells * len(body.groups) for body in bodies]
        depth = max((len(details) for details in levels), default=0)
        fine, total = sum(counts), sum(counts)
        chain = np.full((depth, fine), NONE, np.intp)
        moves = np.full((depth, fine), np.inf)
        first = 0
        for body, count, details in zip(bodies, counts, levels, strict=True):
            n = len(body.groups)
            stretches = np.linalg.norm(body.transforms[:, :3, :3], 2, axis=(1, 2))
            for row, level in enumerate(details):
                moves[row, first : first + count] = np.outer(stretches, level.moves).ravel()
                places = first + np.arange(n)[:, None] * body.n_shells + level.shells
                chain[row, places.ravel()] = total + np.arange(places.size)
                total += places.size
            first += count
        return cls(chain, moves, np.arange(total) >= fine)


@kernel
def choose_levels(
    bounds, lights, reaches, floor, eye, pixel, detail, chain, moves, flags, case, undecided
):
    """
    Keep one level of each shell under each light: the coarsest whose shadow is off by few pixels.

    Parameters
    ----------
    bounds : (n_shells, 2, 3) float64
    lights : (n_lights, 4) float64
    reaches : (n_lights,) float64
    floor : float
        NaN if volumes are not cut.
    eye : (3,) float64
    pixel : (float, float)
        Size of a pixel: in metres, and more for each metre of distance.
    detail : (n_lights,) float64
        By how many pixels a shadow may be off.
    chain, moves
        Of a `LevelTable`.
    flags, case, undecided : (n_lights, n_shells)
        Changed: 0 where another level casts.
    """
    points = np.zeros((16, 4))
    largest = 0.0
    for k in range(lights.shape[0]):
        for i in range(chain.shape[1]):
            chosen = -1
            if flags[k, i]:
                allowed = _find_allowed(
                    bounds[i], lights[k], reaches[k], floor, eye, pixel, detail[k], points
                )
                for row in range(chain.shape[0]):
                    if moves[row, i] <= allowed:
                        chosen = row
            for row in range(chain.shape[0]):
                coarse = chain[row, i]
                if coarse >= 0 and row != chosen:
                    flags[k, coarse], case[k, coarse], undecided[k, coarse] = 0, 0, False
            if chosen >= 0:
                largest = max(largest, moves[chosen, i])
                flags[k, i], case[k, i], undecided[k, i] = 0, 0, False
    return largest


@kernel
def _find_allowed(box, light, reach, floor, eye, pixel, detail, points):
    """Return how far a corner of what is in a box may move, for a shadow off by few pixels [m]."""
    throw_box(box, light, floor, reach, points)
    near = 0.0  # distance of the eye from the volume's bounds, squared
    farthest = 0.0  # of a point of the volume from the lamp, squared
    for axis in range(3):
        low, high = np.inf, -np.inf
        for i in range(16):
            if points[i, 3] > 0.0:
                low, high = min(low, points[i, axis]), max(high, points[i, axis])
            elif points[i, axis] > 0.0:
                high = np.inf
            elif points[i, axis] < 0.0:
                low = -np.inf
        near += max(low - eye[axis], eye[axis] - high, 0.0) ** 2
        farthest += max(abs(low - light[axis]), abs(high - light[axis])) ** 2
    near, grows = np.sqrt(near), 1.0
    size = pixel[0] + pixel[1] * near
    if light[3] > 0.0:
        apart = beside = 0.0
        for axis in range(3):
            apart += max(box[0, axis] - light[axis], light[axis] - box[1, axis], 0.0) ** 2
            beside += (eye[axis] - light[axis]) ** 2
        if apart == 0.0:
            return -1.0
        # A shadow grows with the distance r from the lamp, and pixels with that from the eye, which
        # is at least r less the eye's own from the lamp.
        reached = min(np.sqrt(farthest), reach)
        if pixel[1] > 0.0:
            reached = min(reached, near + np.sqrt(beside))
        grows = max(reached / np.sqrt(apart), 1.0)
    return detail * size / grows if size > 0.0 else -1.0
