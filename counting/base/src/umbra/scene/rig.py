"""Rigs: hierarchies of nodes, their animations, and the meshes that they deform."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.scene.mesh import Mesh

__all__ = ["Animation", "Rig", "RigBinding", "Shape", "Skin", "Track", "make_matrices"]

WAYS = ("step", "linear", "cubic")


@dataclass(frozen=True, eq=False)
class Skin:
    """The joints of a skin."""

    joints: NDArray[np.int64]  # (n_joints,): nodes of the rig
    # (n_joints, 4, 4): from the mesh's frame to each joint's, as bound
    inverse_bind: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Shape:
    """
    A deforming mesh.

    Each posed vertex depends only on its own numbers, rounded alike, so that coincident
    vertices stay coincident and the posed mesh stays closed.
    """

    rest: Mesh  # unposed
    weights: NDArray[np.float64]  # (n_targets,): of the morph targets where no track moves them
    # (n_targets, n_vertices, 3): offsets of the vertices by each morph target at weight 1
    offsets: NDArray[np.float32] | None = None
    normal_offsets: NDArray[np.float32] | None = None  # (n_targets, n_vertices, 3)
    skin: Skin | None = None
    joints: NDArray[np.integer] | None = None  # (n_vertices, n_influences): rows of ``skin.joints``
    # (n_vertices, n_influences): each vertex's sum to 1
    influences: NDArray[np.float64] | None = None

    def pose(self, places: NDArray[np.float64], weights: NDArray[np.float64] | None = None) -> Mesh:
        """Deform the mesh by the nodes' matrices (n, 4, 4); ``rest`` itself if undeformed."""
        weights = self.weights if weights is None else weights
        vertices = self.rest.vertices
        normals: NDArray[np.floating] | None = self.rest.normals
        if self.offsets is not None:
            for index in np.flatnonzero(weights):
                vertices = vertices + weights[index] * self.offsets[index].astype(np.float64)
                if normals is not None and self.normal_offsets is not None:
                    normals = normals + weights[index] * self.normal_offsets[index]
        if self.skin is not None and self.joints is not None and self.influences is not None:
            from umbra.scene.skinning import move_skin  # noqa: PLC0415 - numba, where a mesh bends

            pulls = places[self.skin.joints] @ self.skin.inverse_bind
            vertices, normals = move_skin(pulls, self.joints, self.influences, vertices, normals)
        elif normals is not None and normals is not self.rest.normals:
            normals = _unit(normals)
        if vertices is self.rest.vertices and normals is self.rest.normals:
            return self.rest
        return self.rest.moved(vertices, normals)


@dataclass(frozen=True, eq=False)
class Track:
    """One property of one node over time, as a glTF channel."""

    node: int
    what: str  # ``translation``, ``rotation`` (a quaternion x, y, z, w), ``scale`` or ``weights``
    times: NDArray[np.float64]  # (n,): ascending [s]
    # (n, width): for ``cubic`` (n, 3, width): tangent in, value, tangent out
    values: NDArray[np.float64]
    # of WAYS, between two times: the first's value, the straight way (on
    # the sphere for a rotation), or a Hermite spline
    way: str = "linear"

    def find_value(self, time: float) -> NDArray[np.float64]:
        """Find the value (width,) at a time [s]; a rotation is of length 1."""
        after = int(np.searchsorted(self.times, time, "right"))
        first, second = max(after - 1, 0), min(after, len(self.times) - 1)
        span = self.times[second] - self.times[first]
        value = self._between(first, second, span, time)
        if self.what == "rotation":
            return value / max(float(np.linalg.norm(value)), np.finfo(np.float64).tiny)
        return value

    def _between(self, first: int, second: int, span: float, time: float) -> NDArray[np.float64]:
        values = self.values if self.way != "cubic" else self.values[:, 1]
        if self.way == "step" or span <= 0:
            return values[first]
        share = (time - self.times[first]) / span
        if self.way == "cubic":
            # glTF 2.0, appendix C; tangents are per second.
            out, into = span * self.values[first, 2], span * self.values[second, 0]
            square, cube = share**2, share**3
            return (
                (2 * cube - 3 * square + 1) * values[first]
                + (cube - 2 * square + share) * out
                + (3 * square - 2 * cube) * values[second]
                + (cube - square) * into
            )
        if self.what == "rotation":
            return _turn_between(values[first], values[second], share)
        return values[first] + share * (values[second] - values[first])


def _turn_between(
    first: NDArray[np.float64], second: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    """Return the quaternion at a share of the shorter way between two."""
    cosine = float(first @ second)
    if cosine < 0:  # the same rotation, on the near side
        second, cosine = -second, -cosine
    if cosine > 1 - 1e-9:  # so near that a chord is as good as an arc
        return first + share * (second - first)
    angle = np.arccos(cosine)
    return np.sin((1 - share) * angle) * first + np.sin(share * angle) * second


@dataclass(frozen=True, eq=False)
class Animation:
    """
    Tracks that play together.

    Parameters
    ----------
    name : str
    tracks : tuple of Track
    duration : float
        The last time of any track [s].
    """

    name: str
    tracks: tuple[Track, ...]
    duration: float = field(init=False)

    def __post_init__(self) -> None:
        last = max((float(track.times[-1]) for track in self.tracks), default=0.0)
        object.__setattr__(self, "duration", last)


@dataclass(frozen=True, eq=False)
class Rig:
    """The nodes of one file and their animations."""

    parent: NDArray[np.int64]  # (n,): -1 for a root. Parents come before their children
    translation: NDArray[np.float64]  # (n, 3)
    rotation: NDArray[np.float64]  # (n, 4): quaternions x, y, z, w
    scale: NDArray[np.float64]  # (n, 3)
    matrix: dict[int, NDArray[np.float64]]  # of nodes that have one instead; no track moves them
    base: NDArray[np.float64]  # (4, 4): from the file's axes to the scene's, z up
    animations: tuple[Animation, ...] = ()

    def place(
        self, tracks: tuple[Track, ...] = (), time: float = 0.0
    ) -> tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]:
        """Place the nodes at a time [s] of tracks: matrices (n, 4, 4), morph weights by node."""
        moved = {
            "translation": self.translation.copy(),
            "rotation": self.rotation.copy(),
            "scale": self.scale.copy(),
        }
        weights: dict[int, NDArray[np.float64]] = {}
        for track in tracks:
            value = track.find_value(time)
            if track.what == "weights":
                weights[track.node] = value
            else:
                moved[track.what][track.node] = value
        places = make_matrices(moved["translation"], moved["rotation"], moved["scale"])
        for node, matrix in self.matrix.items():
            places[node] = matrix
        for node, parent in enumerate(self.parent.tolist()):
            places[node] = (places[parent] if parent >= 0 else self.base) @ places[node]
        return places, weights


@dataclass(frozen=True, eq=False)
class RigBinding:
    """Attachment of a part or a light to a node of a rig."""

    rig: Rig
    node: int
    # (4, 4): from the file's frame, z up, to the scene's: the local origin's shift
    base: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    shape: Shape | None = None  # of a mesh that bends; None if it moves as a whole


def make_matrices(
    translation: NDArray[np.float64], rotation: NDArray[np.float64], scale: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Make matrices (n, 4, 4) that scale, then rotate (by x, y, z, w of any length), then move."""
    x, y, z, w = rotation.T
    norm = x * x + y * y + z * z + w * w
    s = np.where(norm > 0, 2 / np.where(norm > 0, norm, 1.0), 0.0)
    rows = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    matrices = np.zeros((len(translation), 4, 4))
    matrices[:, :3, :3] = np.moveaxis(np.array(rows), -1, 0) * scale[:, None, :]
    matrices[:, :3, 3] = translation
    matrices[:, 3, 3] = 1.0
    return matrices


def _unit(normals: NDArray[np.floating]) -> NDArray[np.floating]:
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(length > 0, length, 1.0)
