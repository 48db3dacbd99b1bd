"""Rigs: nodes that hang on one another, how they move in time, and what hangs on them."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from umbra.scene.shape import Shape

__all__ = ["Animation", "Binding", "Rig", "Track", "make_matrices"]

WAYS = ("step", "linear", "cubic")


@dataclass(frozen=True, eq=False)
class Track:
    """
    One property of one node over time, as a glTF channel.

    Parameters
    ----------
    node : int
    what : str
        ``translation``, ``rotation`` (a quaternion x, y, z, w), ``scale`` or ``weights``.
    times : (n,) float64
        Ascending [s].
    values : (n, width) float64
        For ``cubic`` (n, 3, width): tangent in, value, tangent out.
    way : {'step', 'linear', 'cubic'}
        Between two times: the first's value, the straight way (on the sphere for a
        rotation), or a Hermite spline.
    """

    node: int
    what: str
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    way: str = "linear"

    def find_value(self, time: float) -> NDArray[np.float64]:
        """
        Find the value at a time; before the first time the first, after the last the last.

        Parameters
        ----------
        time : float
            [s]

        Returns
        -------
        value : (width,) float64
            A rotation is of length 1.
        """
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
    """Give the quaternion at a share of the shorter way between two."""
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
    """
    The nodes of one file and their animations.

    Parameters
    ----------
    parent : (n,) int
        -1 for a root. Parents come before their children.
    translation, scale : (n, 3) float64
    rotation : (n, 4) float64
        Quaternions x, y, z, w.
    matrix : dict of int to (4, 4) float64
        Of nodes that have one instead; no track moves them.
    base : (4, 4) float64
        From the file's axes to the scene's, z up.
    animations : tuple of Animation
    """

    parent: NDArray[np.int64]
    translation: NDArray[np.float64]
    rotation: NDArray[np.float64]
    scale: NDArray[np.float64]
    matrix: dict[int, NDArray[np.float64]]
    base: NDArray[np.float64]
    animations: tuple[Animation, ...] = ()

    def place(
        self, tracks: tuple[Track, ...] = (), time: float = 0.0
    ) -> tuple[NDArray[np.float64], dict[int, NDArray[np.float64]]]:
        """
        Place the nodes at a time.

        Parameters
        ----------
        tracks : tuple of Track
            Of an animation; without them nodes stand where the file puts them.
        time : float
            [s]

        Returns
        -------
        places : (n, 4, 4) float64
            From each node's frame to the file's, z up.
        weights : dict of int to (n_targets,) float64
            Of morph targets, where a track moves them.
        """
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
class Binding:
    """
    How a part or a light hangs on a rig.

    Parameters
    ----------
    rig : Rig
    node : int
    base : (4, 4) float64
        From the file's frame, z up, to the scene's: the local origin's shift.
    shape : Shape, optional
        What bends; None for what moves as a whole.
    """

    rig: Rig
    node: int
    base: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    shape: Shape | None = None


def make_matrices(
    translation: NDArray[np.float64], rotation: NDArray[np.float64], scale: NDArray[np.float64]
) -> NDArray[np.float64]:
    """
    Make affine matrices that scale, then rotate, then translate.

    Parameters
    ----------
    translation, scale : (n, 3) float64
    rotation : (n, 4) float64
        Quaternions x, y, z, w of any length; 0 does not rotate.

    Returns
    -------
    matrices : (n, 4, 4) float64
    """
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
