"""
Software depth buffer in float64: the visible face of each pixel.

Triangles are rasterised in homogeneous coordinates, without clipping: a pixel (x, y) is inside
where the three edge functions of (x, y, 1) are not negative, also when corners lie behind the eye.
Both faces of an edge compute the same line (a cross product changes only its sign), and bounds are
rounded up on both sides: every pixel centre belongs to exactly one of two faces that share an edge.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, kernel, run_shared, take_next
from umbra.machine import use_threads
from umbra.rays.cover import find_cover
from umbra.rays.transmission import Transmitters
from umbra.scene.mesh import multiply_rows

__all__ = [
    "GROUND",
    "NOTHING",
    "STRIPE",
    "DepthBuffer",
    "add_ground",
    "add_transmitting",
    "bound",
    "find_ground_keys",
    "rasterise_depth",
]

NOTHING = -1
GROUND = -2
STRIPE = 16
"""Rows per block of a thread."""
_EDGE_ON = 1e-300  # determinant of a plane through the eye
_BEHIND = 1e-9  # of its depth key the ground is behind a model's own floor in its plane
_LEVEL = 1e-12  # sine of parallel rays to a plane: less is the rounding of the camera's axes


@dataclass(frozen=True, eq=False)
class DepthBuffer:
    """
    The visible surface.

    Parameters
    ----------
    key : (rows, cols) float64
        Depth key as in ``Camera.matrix``; the far limit where nothing is seen.
    face : (rows, cols) int32
        Index of the visible face, ``NOTHING`` or ``GROUND``.
    """

    key: NDArray[np.float64]
    face: NDArray[np.int32]
    before: "DepthBuffer | None" = None


def rasterise_depth(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    matrix: NDArray[np.float64],
    size: tuple[int, int],
    key_range: tuple[float, float] = (-np.inf, np.inf),
    threads: int = 1,
    corner: tuple[int, int] = (0, 0),
) -> DepthBuffer:
    """
    Find the nearest face at each pixel centre; of equally near faces, the first.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
    faces : (n_faces, 3) int32
    matrix : (4, 4) float64
        To (X, Y, W, K), as in ``Camera.matrix``.
    size : (int, int)
        Columns and rows.
    key_range : (float, float)
        Keys of the far and near limits; faces outside are invisible.
    threads : int
    corner : (int, int)
        Column and row of the first pixel.

    Returns
    -------
    view : DepthBuffer
    """
    cols, rows = size
    view = DepthBuffer(
        np.full((rows, cols), key_range[0]), np.full((rows, cols), NOTHING, np.int32)
    )
    points = multiply_rows(vertices, matrix[:, :3].T) + matrix[:, 3]
    use_threads(threads)
    limits = key_range[1], threads, corner, None
    run_shared(threads, _rasterise, points, faces, view.key, view.face, *limits)
    return view


def add_transmitting(
    view: DepthBuffer,
    transmitters: Transmitters,
    matrix: NDArray[np.float64],
    near: float = np.inf,
    before: DepthBuffer | None = None,
    threads: int = 1,
) -> DepthBuffer:
    """
    Draw the nearest transmitting triangles, except in their holes, into a view.

    Parameters
    ----------
    view : DepthBuffer
        View of the opaque faces.
    transmitters : Transmitters
    matrix : (4, 4) float64
        As in ``rasterise_depth``.
    near : float
        Key of the near limit.
    before : DepthBuffer, optional
        Layer in front: only triangles behind it are drawn, and none where it is empty.
    threads : int

    Returns
    -------
    view : DepthBuffer
        A new buffer; faces are numbered as in ``Scene.triangles``.
    """
    corners, faces = transmitters.corners
    face, t = view.face, transmitters
    # A model's own floor in the ground's plane stays visible: rounding would speckle it.
    limit = np.where(face == GROUND, view.key - _BEHIND * np.abs(view.key), view.key)
    behind, nearer = view.key, np.full(limit.shape, np.inf)
    if before is not None:
        is_clear, nearer = before.face != NOTHING, before.key
        limit, behind = np.where(is_clear, limit, np.inf), np.where(is_clear, behind, np.inf)
        face = np.where(is_clear, face, NOTHING)
    row = np.full(face.shape, NOTHING, np.int32)
    use_threads(threads)
    points = corners @ matrix[:, :3].T + matrix[:, 3]
    skin = nearer, t.rows, t.materials, t.texels
    run_shared(threads, _rasterise, points, faces, limit, row, near, threads, (0, 0), skin)
    key = np.where(row == NOTHING, behind, limit)
    face = np.where(row == NOTHING, face, t.faces[row].astype(np.int32)).astype(np.int32)
    return DepthBuffer(key, face, before)


def add_ground(
    view: DepthBuffer,
    matrix: NDArray[np.float64],
    height: float,
    key_range: tuple[float, float] = (-np.inf, np.inf),
) -> None:
    """Draw the plane z = height, in the frame of ``matrix``, into the view, in place."""
    slope = find_ground_keys(matrix, height)
    if slope is not None:
        run_shared(len(view.key), _draw_ground, slope, key_range[1], view.key, view.face)


def find_ground_keys(matrix: NDArray[np.float64], height: float) -> NDArray[np.float64] | None:
    """
    Find the depth keys of the plane z = height, (3,): a x + b y + c at the pixel (x, y).

    None if the plane is seen edge-on: through the eye, or along parallel rays. ``matrix`` is that
    of a camera, ``height`` in its frame.
    """
    # The key is affine in the picture: two points of the plane at infinity and a finite one tell.
    points = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, height, 1]], np.float64) @ matrix.T
    is_parallel = not matrix[2, :3].any()
    scale = float(np.prod(np.linalg.norm(matrix[:2, :3], axis=1))) if is_parallel else 0.0
    if abs(np.linalg.det(points[:, :3])) <= max(_EDGE_ON, _LEVEL * scale):
        return None
    return np.linalg.solve(points[:, :3], points[:, 3]).astype(np.float64)


@partial(kernel, boundscheck=False)
def _draw_ground(slope, near, key, face, taken):
    """Draw the ground, of affine keys, where it is nearer than what is seen."""
    while True:
        r = take_next(taken)
        if r >= key.shape[0]:
            return
        at = slope[1] * r + slope[2]
        for c in range(key.shape[1]):
            value = slope[0] * c + at
            # A model's own floor in this plane stays visible: rounding would speckle it.
            is_nearer = (value - _BEHIND * abs(value) > key[r, c]) & (value <= near)
            key[r, c] = value if is_nearer else key[r, c]
            face[r, c] = GROUND if is_nearer else face[r, c]


@kernel
def bound(a, b, c, sign, left, right, rows):
    """
    Turn the half plane sign * (a x + b y + c) >= 0 into a bound on a pixel row.

    Writes x >= p + q y into ``left``, or x < p + q y into ``right`` (each (p, q)),
    or narrows ``rows`` (first, end) if the line is horizontal.
    """
    if a * sign > 0.0:
        left[0] = -c / a
        left[1] = -b / a
    elif a * sign < 0.0:
        right[0] = -c / a
        right[1] = -b / a
    elif b != 0.0:
        y = np.ceil(-c / b)
        if b * sign > 0.0:
            rows[0] = max(rows[0], y)
        else:
            rows[1] = min(rows[1], y)
    elif c * sign < 0.0:
        rows[1] = rows[0]


# Corners and edges are passed as rows of one array: slices would cost more than the arithmetic.


@borrowing
def _cross(p, i, j, line, k):
    """Write the line through corners i and j into row k."""
    line[k, 0] = p[i, 1] * p[j, 2] - p[i, 2] * p[j, 1]
    line[k, 1] = p[i, 2] * p[j, 0] - p[i, 0] * p[j, 2]
    line[k, 2] = p[i, 0] * p[j, 1] - p[i, 1] * p[j, 0]


@borrowing
def _key_plane(p, det, out):
    """Find K on a triangle's plane as a linear functional of (X, Y, W)."""
    du = p[1, 3] - p[0, 3]
    dv = p[2, 3] - p[0, 3]
    for k in range(3):
        i = (k + 1) % 3
        j = (k + 2) % 3
        ui = p[1, i] - p[0, i]
        uj = p[1, j] - p[0, j]
        vi = p[2, i] - p[0, i]
        vj = p[2, j] - p[0, j]
        n = ui * vj - uj * vi
        a = vi * p[0, j] - vj * p[0, i]
        b = p[0, i] * uj - p[0, j] * ui
        out[k] = (p[0, 3] * n + du * a + dv * b) / det


@borrowing
def _place_edge(p, i, j, line, k, sign, edge, span):
    """
    Set up a triangle's edge from corner i to j for scan conversion.

    Writes its first corner, slope dx/dy, second corner and whether it bounds the left (1) or the
    right (-1) of the face into row k of ``edge``; a horizontal edge (0) narrows ``span`` instead.
    """
    a = line[k, 0]
    b = line[k, 1]
    c = line[k, 2]
    sure = p[i, 2] > 0.0 and p[j, 2] > 0.0  # else a corner is behind the eye
    if a == 0.0:
        edge[k, 0] = edge[k, 1] = edge[k, 2] = edge[k, 3] = edge[k, 5] = 0.0
        edge[k, 4] = np.nan
        if b == 0.0:
            span[1] = span[0] if c * sign < 0.0 else span[1]
            return
        y = np.ceil(p[i, 1] / p[i, 2] if sure else -c / b)
        if b * sign > 0.0:
            span[0] = max(span[0], y)
        else:
            span[1] = min(span[1], y)
        return
    edge[k, 2] = -b / a
    edge[k, 5] = 1.0 if a * sign > 0.0 else -1.0
    if sure:
        edge[k, 0] = p[i, 0] / p[i, 2]
        edge[k, 1] = p[i, 1] / p[i, 2]
        edge[k, 3] = p[j, 0] / p[j, 2]
        edge[k, 4] = p[j, 1] / p[j, 2]
    else:
        edge[k, 0] = -c / a
        edge[k, 1] = 0.0
        edge[k, 4] = np.nan


@kernel
def _is_there(skin, f, line, r, c, key, color):
    """Return whether a pixel sees a face, given by its edges' lines: behind ``before``, no hole."""
    before, rows, materials, texels = skin
    if key >= before[r, c]:
        return False
    w0 = line[0, 0] * c + line[0, 1] * r + line[0, 2]
    w1 = line[1, 0] * c + line[1, 1] * r + line[1, 2]
    w2 = line[2, 0] * c + line[2, 1] * r + line[2, 2]
    total = w0 + w1 + w2
    if total == 0.0:
        return False
    w0, w1, w2 = w0 / total, w1 / total, w2 / total
    return find_cover(f, w0, w1, w2, rows, materials, texels, color) > 0.0


@partial(kernel, boundscheck=False)
def _rasterise(points, faces, key, face, near, threads, corner, skin, taken):
    """Draw faces; faces with a skin (see ``add_transmitting``) except in its holes."""
    col, row = corner
    west, south = np.float64(col), np.float64(row)
    east, north = np.float64(col + key.shape[1]), np.float64(row + key.shape[0])
    while True:
        t = take_next(taken)
        if t >= threads:
            return
        color = np.empty(3)
        p = np.empty((3, 4))
        line = np.empty((3, 3))
        edge = np.empty((3, 6))
        slope = np.empty(3)
        span = np.empty(2)
        for f in range(faces.shape[0]):
            low = least = np.inf
            high = most = -np.inf
            behind = 0
            for k in range(3):
                for j in range(4):
                    p[k, j] = points[faces[f, k], j]
                if p[k, 2] > 0.0:
                    x = p[k, 0] / p[k, 2]
                    y = p[k, 1] / p[k, 2]
                    least = min(least, x)
                    most = max(most, x)
                    low = min(low, y)
                    high = max(high, y)
                else:
                    behind += 1
            if behind == 3:
                continue
            if behind > 0:
                low, least = south, west
                high, most = north, east
            span[0] = np.ceil(min(max(low, south), north))
            span[1] = min(np.floor(min(max(high, south - 1.0), north)) + 1.0, north)
            if span[0] >= span[1]:
                continue
            # Small faces often lie between the centres of pixels, by more than rounding.
            slack = 1e-6 + 1e-9 * (abs(least) + abs(most))
            if np.ceil(least - slack) > most + slack:
                continue
            for k in range(3):
                _cross(p, (k + 1) % 3, (k + 2) % 3, line, k)
            det = p[0, 0] * line[0, 0] + p[0, 1] * line[0, 1] + p[0, 2] * line[0, 2]
            if det == 0.0:
                continue
            sign = 1.0 if det > 0.0 else -1.0
            # Lines that nearly coincide may cross anywhere: stay near the corners. One column of
            # margin, since rounding may put a line just past its own corner, where the neighbouring
            # face begins.
            least = min(max(np.floor(least) - 1.0, west), east)
            most = min(max(np.ceil(most) + 1.0, west), east)
            for k in range(3):
                # The corner with the lower index comes first: both faces compute the same edge.
                i = (k + 1) % 3
                j = (k + 2) % 3
                if faces[f, i] > faces[f, j]:
                    i, j = j, i
                _place_edge(p, i, j, line, k, sign, edge, span)
            _key_plane(p, det, slope)
            for r in range(np.int64(span[0]), np.int64(span[1])):
                if (r // STRIPE) % threads != t:
                    continue
                y = np.float64(r)
                x0 = least
                x1 = most
                for k in range(3):
                    # Edges pass exactly through their corners: all edges of a corner agree.
                    x = edge[k, 0] + (y - edge[k, 1]) * edge[k, 2]
                    if y == edge[k, 4]:
                        x = edge[k, 3]
                    if edge[k, 5] > 0.0:
                        x0 = max(x0, x)
                    elif edge[k, 5] < 0.0:
                        x1 = min(x1, x)
                at = slope[1] * y + slope[2]
                for c in range(
                    np.int64(np.ceil(x0)),
                    np.int64(np.ceil(max(x1, x0))),
                ):
                    value = at + slope[0] * c
                    i, j = r - row, c - col
                    if value > key[i, j] and value <= near:
                        if skin is not None and not _is_there(skin, f, line, r, c, value, color):
                            continue
                        key[i, j] = value
                        face[i, j] = f
