"""Meshes and parts: contents of a file, before any shadow."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, check_type, make_printable, show_count, show_value
from umbra.scene.material import Color, Image, Material
from umbra.scene.numbers import read_array

if TYPE_CHECKING:
    from umbra.scene.rig import RigBinding

__all__ = [
    "ADDED_GROUND", "ASSUMED", "ASSUMED_UNDER", "GIVEN", "Mesh", "Part", "change", "find_standing",
    "multiply_rows",
]  # fmt: skip

PLAIN = Material()
_ROWS = ("normals", "uv", "colors", "tangents", "uv2", "alpha")  # fields with a row for each vertex
ASSUMED, ASSUMED_UNDER, GIVEN = "AssumedGround", "AssumedGroundUnderBuildings", "GivenGround"
ADDED_GROUND = frozenset({ASSUMED, ASSUMED_UNDER, GIVEN})
"""Kinds of parts that are a ground beside the model: umbra's own, or of a file for it."""


T = TypeVar("T", "Mesh", "Part")


def change(record: T, **changes: object) -> T:
    """Return a mesh or part with other fields, which are known to be right: a city has 10^6."""
    made: T = object.__new__(type(record))
    put = object.__setattr__  # keeps attributes in the object, not in a dict of its own
    for name in record.__dataclass_fields__:
        put(made, name, changes[name] if name in changes else getattr(record, name))
    return made


@dataclass(frozen=True, eq=False)
class Mesh:
    """
    A triangle soup in its own frame.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
        Positions [m]. Several meshes may share one array.
    faces : (n_faces, 3) int32
        Vertex indices, counter-clockwise seen from outside.
    normals : (n_vertices, 3) float32, optional
        Unit normals for shading; shadows ignore them.
    uv : (n_vertices, 2) float32, optional
        Places in the material's texture; (0, 0) is the upper left corner.
    colors : (n_vertices, 3) float32, optional
        Linear RGB, multiplies the material's colour.
    tangents : (n_vertices, 4) float32, optional
        For normal maps: unit vectors along u, and 1 or -1, by which the product of normal and
        tangent points up in the image; all 0, or none, for those of each face.
    uv2 : (n_vertices, 2) float32, optional
        Places in the images of the material whose ``uv_set`` is 1.
    alpha : (n_vertices, 1) float32, optional
        Opacity, multiplies the texture's alpha; for materials with an ``alpha_mode`` that has one.

    Raises
    ------
    InputError
        If a face names a vertex that does not exist, or normals, uv, colors,
        tangents, uv2 or alpha are not one row for each vertex.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None
    uv: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None
    uv2: NDArray[np.float32] | None = None
    alpha: NDArray[np.float32] | None = None

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices):,} vertices, {len(self.faces):,} triangles)"

    def __post_init__(self) -> None:
        vertices = _make_rows("vertices", self.vertices, np.float64)
        faces = _make_rows("faces", self.faces, None)
        if faces.dtype.kind == "f" and (split := (faces != np.rint(faces)).any(1)).any():
            first = int(np.flatnonzero(split)[0])
            msg = (
                f"{int(split.sum())} of {len(faces)} faces name a vertex by a number that is not "
                f"whole (first: face {first}: {faces[first].tolist()}); count vertices from 0"
            )
            raise InputError(msg, face=first)
        # Before they are cast to int32, in which 2^40 would be 0.
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            wrong = (faces < 0) | (faces >= len(vertices))
            first = int(np.flatnonzero(wrong.any(1))[0])
            msg = (
                f"{int(wrong.any(1).sum())} of {len(faces)} faces name a vertex that does not "
                f"exist (first: face {first}); there are {len(vertices)} vertices: repair the faces"
            )
            raise InputError(msg, face=first)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", np.ascontiguousarray(faces, np.int32))
        for name, width in zip(_ROWS, (3, 2, 3, 4, 2, 1), strict=True):
            given = getattr(self, name)
            if given is None:
                continue
            array = read_array(name, given, np.float32)
            if array.shape != (len(vertices), width):
                msg = (
                    f"{name} of shape {array.shape} do not fit {len(vertices)} vertices; "
                    f"give ({len(vertices)}, {width})"
                )
                raise InputError(msg)
            object.__setattr__(self, name, array)

    def moved(
        self, vertices: NDArray[np.float64], normals: NDArray[np.floating] | None = None
    ) -> Mesh:
        """Return the same faces with other vertices (n, 3), and normals, which stay by default."""
        kept = self.normals if normals is None else normals
        if kept is not None or vertices.shape != self.vertices.shape:
            return replace(self, vertices=vertices, normals=kept)
        return change(self, vertices=np.ascontiguousarray(vertices, np.float64))

    def with_vertices(
        self, used: NDArray[np.intp], number: NDArray[np.int32], vertices: NDArray[np.float64]
    ) -> Mesh:
        """
        Return the same triangles on a subset of the vertices that includes all used ones.

        ``number`` (n_vertices,) is that of each vertex among the kept ones; the vertices
        (n_kept, 3) are those, and meshes that share an array go on sharing it.
        """
        rows = {n: getattr(self, n)[used] for n in _ROWS if getattr(self, n) is not None}
        return change(self, vertices=vertices, faces=number[self.faces], **rows)

    def find_uv(self, image: Image) -> NDArray[np.float32] | None:
        """Return the coordinates (n_vertices, 2) that place an image of the material."""
        return self.uv2 if image.uv_set else self.uv


@dataclass(frozen=True, eq=False)
class Part:
    """
    A named instance of a mesh.

    Parameters
    ----------
    name : str
        Its object: a building's id, an OBJ group, a glTF node.
    kind : str
        Type: ``WallSurface``, ``RoofSurface``, an OBJ or glTF material.
    mesh : Mesh
        Shared by every instance of it.
    transform : (4, 4) float64, optional
        From the mesh's frame to the scene's; None is the identity.
    material : Material, optional
    binding : RigBinding, optional
        Its animation, see `umbra.scene.making`.
    layer : str
        Its file or group of files: ``existing``, ``proposed``.
    tags : tuple of str
        Further words to choose it by: storey, type, material, its own name if ``name`` is
        the assembly's.

    Raises
    ------
    InputError
        If a name is no text, the mesh no `Mesh`, or the transform no (4, 4) numbers.
    """

    name: str
    kind: str
    mesh: Mesh
    transform: NDArray[np.float64] | None = None
    material: Material = field(default=PLAIN)
    binding: RigBinding | None = None
    layer: str = ""
    tags: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_type("mesh", self.mesh, Mesh)
        for word in ("name", "kind", "layer"):
            if not isinstance(getattr(self, word), str):
                msg = f"a part's {word} is text; got {show_value(getattr(self, word))}"
                raise InputError(msg)
            if "\0" in getattr(self, word):  # no text in a file may hold it: netCDF, SQLite, XML
                object.__setattr__(self, word, getattr(self, word).replace("\0", "\ufffd"))
        if any("\0" in tag for tag in self.tags):
            object.__setattr__(self, "tags", tuple(t.replace("\0", "\ufffd") for t in self.tags))
        if self.transform is not None:
            transform = read_array("transform", self.transform)
            if transform.shape != (4, 4):
                msg = f"a transform of shape {transform.shape} is no matrix; give (4, 4), or None"
                raise InputError(msg)
            object.__setattr__(self, "transform", transform)

    def __repr__(self) -> str:
        words = [repr(self.name)] + [word for word in (self.kind, self.layer) if word]
        return make_printable(f"Part({', '.join(words)}, {show_count(self.triangles, 'triangle')})")

    @property
    def full_name(self) -> str:
        """Its layer and its name, as in ``existing/Tower``; the name alone without a layer."""
        return f"{self.layer}/{self.name}" if self.layer else self.name

    def matches(self, pattern: str) -> bool:
        """
        Return whether a shell pattern matches its name, kind, layer, ``layer/name`` or a tag.

        Parameters
        ----------
        pattern : str
            Upper and lower case count.
        """
        words = (self.name, self.kind, self.layer, self.full_name, *self.tags)
        # An empty pattern, as of a variable that is not set, is not that of parts without a kind.
        return bool(pattern) and any(fnmatchcase(word, pattern) for word in words)

    @property
    def color(self) -> Color:
        """The material's diffuse reflectance, linear RGB in 0 to 1."""
        return self.material.color

    @property
    def is_transparent(self) -> bool:
        """Whether any of it is transparent, apart from holes."""
        material, mesh = self.material, self.mesh
        return material.is_transparent or (
            mesh.alpha is not None and material.alpha_mode == "blend"
        )

    @property
    def has_holes(self) -> bool:
        """Whether alpha may cut holes into it."""
        material, mesh = self.material, self.mesh
        return material.has_holes or (mesh.alpha is not None and material.alpha_mode == "mask")

    @property
    def transmits(self) -> bool:
        """Whether light passes through any of it; `InputError` if its texture cannot be decoded."""
        return self.is_transparent or self.has_holes

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.mesh.faces)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """
        Lowest and highest corner of its triangles, (2, 3) float64 [m].

        Relative to ``Scene.origin``; ``scene[name].bounds()`` is in the model's own
        coordinates.
        """
        vertices, faces = self.mesh.vertices, self.mesh.faces
        # Of many parts that share their vertices each uses few.
        used = vertices[find_used(vertices, faces) if faces.size > len(vertices) else faces.ravel()]
        if self.transform is not None:
            used = transform_points(self.transform, used)
        return find_box(used)


def _make_rows(name: str, given: Any, dtype: Any) -> NDArray[Any]:
    """Return rows of three numbers, (n, 3); the array itself if it is that."""
    rows = read_array(name, given, dtype)
    shape = np.shape(given)
    if rows.size % 3 or not shape or (len(shape) > 1 and shape[-1] != 3 and 0 not in shape):
        msg = f"{name} of shape {shape} are not three to a row; give (n, 3)"
        raise InputError(msg)
    # A reshape makes a new array object: keep the one that meshes share.
    return rows if rows.ndim == 2 and rows.shape[1] == 3 else rows.reshape(-1, 3)


def find_used(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Find which vertices a face uses, (n_vertices,)."""
    is_used = np.zeros(len(vertices), np.bool_)
    is_used[faces.ravel()] = True
    return is_used


def find_box(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find the lowest and highest corner, (2, 3); by columns: numpy folds rows of three slowly."""
    return np.array([[axis.min() for axis in points.T], [axis.max() for axis in points.T]])


def transform_points(transform: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """
    Move points by an affine transform.

    Parameters
    ----------
    transform : (4, 4) float64
    points : (n, 3) float64

    Returns
    -------
    moved : (n, 3) float64
    """
    matrix = np.asarray(transform, np.float64)
    return multiply_rows(np.asarray(points, np.float64), matrix[:3, :3].T) + matrix[:3, 3]


def multiply_rows(rows: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return ``rows @ matrix``, for many short rows, in blocks.

    BLAS makes a block in one thread. Waking the others for such a product takes ten times as
    long as the product, and keeps the cores busy that others could use.

    Parameters
    ----------
    rows : (n, k) float64
    matrix : (k, m) float64

    Returns
    -------
    products : (n, m) float64
    """
    products = np.zeros((len(rows), matrix.shape[1]))
    for first in range(0, len(rows), _BLOCK):
        block = slice(first, first + _BLOCK)
        products[block] = rows[block] @ matrix
    return products


_BLOCK = 1 << 14  # rows of at most 4 numbers for which BLAS takes one thread
_CELL = 2.0  # objects that share a cell may stand on one another [m]
_MOST = 1024  # cells along a side


def find_standing(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the objects (n,) with no other below them, from their bounding boxes (n, 2, 3) [m]."""
    if not len(boxes):
        return np.zeros(0, np.bool_)
    low, high = boxes[:, 0], boxes[:, 1]
    start = low[:, :2].min(0)
    cell = max(_CELL, float((high[:, :2].max(0) - start).max()) / _MOST)
    first = ((low[:, :2] - start) / cell).astype(np.intp)
    last = ((high[:, :2] - start) / cell).astype(np.intp) + 1
    lowest = np.full(tuple(last.max(0)), np.inf)
    windows = [(slice(a, c), slice(b, d)) for (a, b), (c, d) in zip(first, last)]
    for window, z in zip(windows, low[:, 2]):
        np.minimum(lowest[window], z, out=lowest[window])
    return np.array([lowest[w].min() > z - 1.0 for w, z in zip(windows, low[:, 2])], np.bool_)
