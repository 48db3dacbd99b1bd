"""Scenes to measure with: towns of boxes, a smooth boulder, spheres; always the same."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.sun import Site, find_sun, make_steps

__all__ = [
    "Soup",
    "Spheres",
    "SquareModel",
    "make_ball",
    "make_boulder",
    "make_boxes",
    "make_spheres",
    "make_suns",
    "make_town",
]

Soup = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Vertices (n, 3) and faces (m, 3)."""
_CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1],
     [-1, 1, 1]], float,
)  # fmt: skip
_BOX = np.array(
    [
        [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
        [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
    ],
    np.int32,
)  # fmt: skip
"""Faces of a box: corners 0 to 3 go around its bottom, 4 to 7 above them."""


@dataclass(frozen=True, eq=False)
class SquareModel:
    """
    A mesh whose plan is a square with one corner at x = y = 0.

    Parameters
    ----------
    vertices : (n, 3) float64
        Whole float32 numbers, so that umbra and peers that hold float32 see one mesh [m].
    faces : (m, 3) int32
    side : float
        Of the square [m].
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    side: float


@dataclass(frozen=True, eq=False)
class Spheres:
    """
    Spheres above a ground plane z = 0, a camera, and a lamp that goes around above them.

    Parameters
    ----------
    vertices : (n, 3) float64
        Of one sphere about its own centre, which are its normals times ``radius`` [m].
    faces : (m, 3) int32
        Of one sphere, wound outward.
    centres : (k, 3) float64
    radius : float
        [m].
    half : float
        The ground reaches so far to all four sides of x = y = 0 [m].
    eye, target : tuple of float
    fov : float
        Vertical field of view of the square picture [degrees].
    path : (l, 3) float64
        Places of the lamp, one a frame, over and over.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    centres: NDArray[np.float64]
    radius: float
    half: float
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float
    path: NDArray[np.float64]

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON to a peer in another interpreter, one that may have no numpy."""
        return {
            "vertices": self.vertices.tolist(),
            "faces": self.faces.tolist(),
            "centres": self.centres.tolist(),
            "radius": self.radius,
            "half": self.half,
            "eye": self.eye,
            "target": self.target,
            "fov": self.fov,
        }


def make_town(boxes: int, side: float, seed: int) -> SquareModel:
    """
    Put boxes of any size and turn on a square, each in its own block.

    Parameters
    ----------
    boxes : int
        12 triangles each. They stand 1 m deep in the ground z = 0.
    side : float
        Of the square [m].
    seed : int
    """
    random = np.random.default_rng(seed)
    across = int(np.ceil(np.sqrt(boxes)))
    block = np.arange(boxes)
    plot = side / across
    half = random.uniform(0.175, 0.31, (boxes, 2)) * plot
    turn = random.uniform(0, np.pi, boxes)
    centre = (np.stack([block % across, block // across], 1) + 0.5) * plot
    centre += random.uniform(-0.05, 0.05, (boxes, 2)) * plot
    height = random.uniform(6, 40, boxes)
    x, y = (half[:, None] * [[-1, -1], [1, -1], [1, 1], [-1, 1]]).transpose(2, 0, 1)
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    vertices = np.zeros((boxes, 8, 3))
    vertices[:, :4, 0] = vertices[:, 4:, 0] = centre[:, :1] + x * cos - y * sin
    vertices[:, :4, 1] = vertices[:, 4:, 1] = centre[:, 1:] + x * sin + y * cos
    vertices[:, :4, 2] = -1.0
    vertices[:, 4:, 2] = height[:, None]
    faces = _BOX + 8 * block[:, None, None]
    return SquareModel(_round(vertices.reshape(-1, 3)), faces.reshape(-1, 3).astype(np.int32), side)


def make_boxes(
    centres: ArrayLike, half: ArrayLike, frame: NDArray[np.float64] | None = None
) -> Soup:
    """
    Make closed boxes.

    Parameters
    ----------
    centres, half : (n, 3) float64
        Centres, and half sizes along the boxes' axes [m].
    frame : (n, 3, 3) float64, optional
        Right-handed axes of each box in rows; x, y and z by default.
    """
    middle = np.asarray(centres, float)
    axes = np.broadcast_to(np.eye(3), (len(middle), 3, 3)) if frame is None else frame
    size = np.asarray(half, float)
    corners = np.einsum("kc,nc,nci->nki", _CORNERS, size, axes) + middle[:, None]
    faces = _BOX + 8 * np.arange(len(middle))[:, None, None]
    return corners.reshape(-1, 3), faces.reshape(-1, 3).astype(np.int32)


def make_ball(around: int, bands: int) -> Soup:
    """Make a closed ball of radius 1 in bands of latitude, 2 * around * (bands - 1) triangles."""
    # Rings of latitude between the two poles, which are the first and the last vertex.
    rings = bands - 1
    latitude = np.pi * np.arange(1, bands)[:, None] / bands
    longitude = 2 * np.pi * np.arange(around) / around
    round_ = np.stack(
        np.broadcast_arrays(
            np.sin(latitude) * np.cos(longitude),
            np.sin(latitude) * np.sin(longitude),
            np.cos(latitude),
        ),
        -1,
    ).reshape(-1, 3)
    vertices = np.concatenate([[[0.0, 0.0, 1.0]], round_, [[0.0, 0.0, -1.0]]])

    step = np.arange(around)
    right = (step + 1) % around
    last = len(vertices) - 1
    upper = 1 + around * np.arange(rings - 1)[:, None]
    a, b = upper + step, upper + right
    south = 1 + around * (rings - 1)
    faces = np.concatenate(
        [
            np.stack([np.zeros_like(step), 1 + step, 1 + right], -1),
            np.stack([a, a + around, b + around], -1).reshape(-1, 3),
            np.stack([a, b + around, b], -1).reshape(-1, 3),
            np.stack([np.full_like(step, last), south + right, south + step], -1),
        ]
    )
    return vertices, faces.astype(np.int32)


def make_boulder(splits: int, side: float = 500.0, seed: int = 3) -> SquareModel:
    """
    Make a smooth rock that floats over the middle of a square.

    Parameters
    ----------
    splits : int
        Each quarters the icosahedron's triangles: 20 * 4**splits in the end.
    side : float
        Of the square [m].
    seed : int
    """
    directions, faces = _split_icosahedron(splits)
    random = np.random.default_rng(seed)
    swell = np.ones(len(directions))
    for frequency, size in ((2, 0.05), (4, 0.03), (9, 0.015), (20, 0.005), (45, 0.0015)):
        for _ in range(6):
            way = random.normal(size=3)
            way /= np.linalg.norm(way)
            swell += size * np.sin(frequency * directions @ way + random.uniform(0, 2 * np.pi))
    vertices = directions * swell[:, None] * 0.14 * side + [side / 2, side / 2, 0.22 * side]
    return SquareModel(_round(vertices), faces, side)


def make_spheres(across: int = 10, around: int = 32, frames: int = 96) -> Spheres:
    """
    Make the peers' scene: by default 100 spheres of 960 triangles.

    Parameters
    ----------
    across : int
        Spheres in a row, and rows.
    around : int
        Triangles around a pole, even: around * (around - 2) in all.
    frames : int
        Of one round of the lamp.
    """
    vertices, faces = make_ball(around, around // 2)
    random = np.random.default_rng(4)
    place = 4.0 * (np.arange(across) - (across - 1) / 2)
    x, y = (axis.ravel() for axis in np.meshgrid(place, place))
    centres = np.column_stack([x, y, random.uniform(1.5, 4.0, across**2)])
    centres[:, :2] += random.uniform(-0.7, 0.7, (across**2, 2))
    angle = 2 * np.pi * np.arange(frames) / frames
    path = np.column_stack([11 * np.cos(angle), 11 * np.sin(angle), np.full(frames, 14.0)])
    return Spheres(
        _round(vertices), faces, _round(centres), 1.0, 40.0,
        (0.0, -42.0, 38.0), (0.0, -3.0, 0.0), 55.0, path,
    )  # fmt: skip


def make_suns() -> NDArray[np.float64]:
    """Return the sun over Vienna every 15 minutes from 09:00 to 17:00, (33, 3) float64."""
    site = Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
    steps = make_steps("2026-09-18", "09:00", "17:00", "15min", site.zone)
    return find_sun(site, steps.stamps).direction


def _round(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    return vertices.astype(np.float32).astype(np.float64)


def _split_icosahedron(splits: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Quarter an icosahedron's faces repeatedly, with new vertices on the unit sphere."""
    golden = (1 + np.sqrt(5)) / 2
    signs = np.array([[-1, 1], [1, 1], [-1, -1], [1, -1]])
    flat = np.column_stack([np.zeros(4), signs * [1, golden]])
    points = np.concatenate([np.roll(flat, shift, 1) for shift in (2, 0, 1)])
    points /= np.linalg.norm(points[0])
    faces = np.array(
        [
            [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11],
            [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
            [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9],
            [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
        ]
    )  # fmt: skip
    for _ in range(splits):
        pairs = np.stack([faces, np.roll(faces, -1, 1)], -1)
        low, high = pairs.min(-1), pairs.max(-1)
        keys, place = np.unique(low * len(points) + high, return_inverse=True)
        middles = points[keys // len(points)] + points[keys % len(points)]
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        a, b, c = faces.T
        ab, bc, ca = (place.reshape(-1, 3) + len(points)).T
        faces = np.concatenate(
            [
                np.stack(corners, 1)
                for corners in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
            ]
        )
        points = np.concatenate([points, middles])
    return points, faces.astype(np.int32)
