"""Small models, made by hand, and measures of what a reader made of them."""

from collections import Counter

import numpy as np
import pytest
from support.model_files import DATA

from umbra import InputError

# A box of 2 x 3 x 4 m: vertices and outward faces.
BOX_VERTICES = [
    [0, 0, 0],
    [2, 0, 0],
    [2, 3, 0],
    [0, 3, 0],
    [0, 0, 4],
    [2, 0, 4],
    [2, 3, 4],
    [0, 3, 4],
]
BOX_FACES = [
    [3, 2, 1, 0],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
]


class Measures:
    """Area, volume and boundary of a scene's triangles, in its own coordinates."""

    @staticmethod
    def corners(scene, parts=None):
        soup = scene.triangles(parts)
        return soup.vertices[soup.faces] + scene.origin

    @classmethod
    def area(cls, scene, parts=None):
        a, b, c = cls.corners(scene, parts).transpose(1, 0, 2)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    @classmethod
    def volume(cls, scene, parts=None):
        a, b, c = cls.corners(scene, parts).transpose(1, 0, 2)
        middle = a.mean(0)
        return float(np.einsum("ij,ij->i", a - middle, np.cross(b - middle, c - middle)).sum() / 6)

    @staticmethod
    def open_edges(scene, parts=None):
        """Edges whose signed incidences do not sum to 0, by place."""
        soup = scene.triangles(parts)
        return open_edges(soup.vertices, soup.faces)


def open_edges(vertices, faces):
    sums = Counter()
    for corners in np.asarray(vertices)[np.asarray(faces)].tolist():
        for k in range(3):
            a, b = tuple(corners[k - 1]), tuple(corners[k])
            if a != b:
                sums[min(a, b), max(a, b)] += 1 if a < b else -1
    return [edge for edge, count in sums.items() if count]


@pytest.fixture
def measure():
    return Measures


@pytest.fixture
def find_open_edges():
    return open_edges


@pytest.fixture
def box():
    """Vertices and quads of a box of 2 x 3 x 4 m."""
    return [list(v) for v in BOX_VERTICES], [list(f) for f in BOX_FACES]


@pytest.fixture
def refuse():
    """Check that a call is refused, and the facts that its error carries; return the message."""

    def check(call, *args, facts, **options):
        with pytest.raises(InputError) as caught:
            call(*args, **options)
        assert {name: caught.value.data.get(name) for name in facts} == facts
        assert "\n" not in str(caught.value)
        return str(caught.value)

    return check


@pytest.fixture
def real_file():
    def find(name):
        path = DATA / name
        if not path.exists():
            pytest.skip(f"the real model {name} is not in ../shared/data")
        return path

    return find
