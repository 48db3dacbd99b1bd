"""Turned boxes with lamps on their faces, edges and corners, for every device."""

import numpy as np

from support.shapes import BOX_FACES, box
from umbra.scene import Camera, point_light

PLACES = ("corner", "edge", "diagonal", "face")

RIMS = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
        (0, 4), (1, 5), (2, 6), (3, 7)]  # fmt: skip


def turn_box(rng):
    """Make a box turned every way, above z = 0."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    vertices, faces = box((-1.5, -2, -1), (2.5, 1.7, 2.2))
    vertices = vertices @ (turn * np.sign(np.linalg.det(turn))).T
    return vertices + rng.uniform(-1, 1, 3) + [0, 0, 5], faces


def hang(rng, place, apart=0.0):
    """Make a box and hang a lamp so far from a place of it, anywhere around that place."""
    vertices, faces = turn_box(rng)
    if place == "corner":
        point = vertices[rng.integers(8)]
    elif place == "edge":
        a, b = vertices[list(RIMS[rng.integers(12)])]
        point = a + rng.uniform(0.1, 0.9) * (b - a)
    elif place == "diagonal":
        pair = 2 * rng.integers(6)
        a, b = vertices[sorted(set(BOX_FACES[pair]) & set(BOX_FACES[pair + 1]))]
        point = (a + b) / 2
    else:
        point = rng.dirichlet([1, 1, 1]) @ vertices[faces[rng.integers(12)]]
    aside = rng.normal(size=3)
    return (vertices, faces), point_light(point + apart * aside / np.linalg.norm(aside))


def look_at(seed, height=None, about=(0.0, 0.0, 0.0)):
    """Look at the box from somewhere above the ground."""
    eye = np.random.default_rng(seed + 1000).normal(size=3)
    eye[2] = abs(eye[2])
    eye = np.asarray(about) + (0, 0, 3) + 13 * eye / np.linalg.norm(eye)
    return Camera(eye, np.asarray(about) + (0, 0, 4), size=(28, 21), fov=60, height=height)
