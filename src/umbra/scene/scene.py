"""A scene: parts about a local origin, and what the file says of its place on earth."""

import difflib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError
from umbra.scene.exchange import Exchange
from umbra.scene.lights import Light
from umbra.scene.mesh import Mesh, Part, transform_points
from umbra.scene.rig import Animation
from umbra.scene.summary import show_scene, show_scene_as_html

__all__ = ["Scene", "Source", "Triangles", "make_scene"]


@dataclass(frozen=True)
class Source:
    """
    A file that was read: its name and the SHA-256 of its bytes, in hex.

    ``is_companion``: it was not named, but lies beside one that was and holds a piece of it.
    """

    name: str
    sha256: str
    format: str
    is_companion: bool = False


@dataclass(frozen=True, eq=False)
class Triangles:
    """
    All triangles of some parts in one soup, in the scene's local frame.

    Parameters
    ----------
    vertices : (n_vertices, 3) float64
    faces : (n_faces, 3) int32
    part : (n_faces,) int32
        Index of each face's part in ``Scene.parts``.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    part: NDArray[np.int32]

    def find_corners(self) -> NDArray[np.float64]:
        """Give the vertices that a face uses, each once, (n, 3): what a pose bends has more."""
        is_used = np.zeros(len(self.vertices), np.bool_)
        is_used[self.faces.ravel()] = True
        return self.vertices if is_used.all() else self.vertices[is_used]


@dataclass(frozen=True, eq=False)
class Scene(Exchange):
    """
    What a file holds.

    Parameters
    ----------
    parts : tuple of Part
        In coordinates relative to ``origin``.
    origin : (3,) float64
        Add it to local coordinates to get the model's own [m].
    crs : str, optional
        Coordinate reference system of the model's own coordinates.
    latitude, longitude : float, optional
        Of the site, if the file says so [degrees].
    elevation : float, optional
        Of the site above the sea, if the file says so [m].
    true_north : float, optional
        Azimuth of true north in the model's plan, clockwise from +y [degrees].
    ground : float, optional
        Height of the level ground, if the file says so, in the model's own
        coordinates [m].
    sources : tuple of Source
    notes : tuple of str
        What a reader left out or could not tell, one line each.
    lights : tuple of Light
        The file's own, in the model's own coordinates.
    """

    parts: tuple[Part, ...]
    origin: NDArray[np.float64]
    crs: str | None = None
    latitude: float | None = None
    longitude: float | None = None
    elevation: float | None = None
    true_north: float | None = None
    ground: float | None = None
    sources: tuple[Source, ...] = ()
    notes: tuple[str, ...] = ()
    lights: tuple[Light, ...] = ()

    def __repr__(self) -> str:
        return show_scene(self)

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        return show_scene_as_html(self)

    def __len__(self) -> int:
        """Give the number of parts."""
        return len(self.parts)

    def __iter__(self) -> Iterator[Part]:
        """Go through the parts."""
        return iter(self.parts)

    def __getitem__(self, name: str) -> "Scene":
        """
        Give the parts of one name as a scene, in the same place on earth.

        A building may have several: its walls, its roof. ``layer/name`` means those of a layer.
        """
        parts = tuple(part for part in self.parts if name in {part.name, part.full_name})
        if parts:
            return replace(self, parts=parts, lights=(), notes=())
        names = list(dict.fromkeys(part.name for part in self.parts))
        near = difflib.get_close_matches(str(name), names, n=3)
        more = f" and {len(names) - 6} more" if len(names) > 6 else ""
        is_like = (
            f"the nearest are {', '.join(near)}"
            if near
            else (f"there are {', '.join(names[:6])}{more}")
        )
        msg = f"no part is called {name!r}; {is_like} (all are in scene.parts)"
        raise InputError(msg, name=name, names=names)

    @property
    def animations(self) -> tuple[Animation, ...]:
        """The file's animations: each has a name and a duration; `pose` plays them."""
        things: tuple[Part | Light, ...] = (*self.parts, *self.lights)
        rigs = {id(thing.binding.rig): thing.binding.rig for thing in things if thing.binding}
        return tuple(animation for rig in rigs.values() for animation in rig.animations)

    def triangles(self, parts: Sequence[int] | None = None) -> Triangles:
        """
        Flatten parts into one soup; instances are moved into place.

        Parameters
        ----------
        parts : sequence of int, optional
            Indices into ``self.parts``; all by default.

        Returns
        -------
        triangles : Triangles
        """
        vertices: list[NDArray[np.float64]] = []
        faces: list[NDArray[np.int32]] = []
        owners: list[int] = []
        offsets: dict[int, int] = {}  # of vertex arrays that parts share
        count = 0
        for index in range(len(self.parts)) if parts is None else parts:
            part = self.parts[index]
            array = part.mesh.vertices
            if part.transform is not None:
                vertices.append(transform_points(part.transform, array))
                offset, count = count, count + len(array)
            elif id(array) in offsets:
                offset = offsets[id(array)]
            else:
                vertices.append(array)
                offset, count = count, count + len(array)
                offsets[id(array)] = offset
            turned = part.transform is not None and np.linalg.det(part.transform[:3, :3]) < 0
            # A mirrored instance shows its back: wind it the other way.
            faces.append((part.mesh.faces[:, ::-1] if turned else part.mesh.faces) + offset)
            owners.append(index)
        if not faces:
            return Triangles(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32))
        lengths = [len(f) for f in faces]
        return Triangles(
            np.concatenate(vertices),
            np.concatenate(faces).astype(np.int32, copy=False),
            np.repeat(np.array(owners, np.int32), lengths),
        )

    def groups(self) -> NDArray[np.int32]:
        """Give a number to each name in a layer: parts of one thing share it, (n_parts,) int32."""
        numbers: dict[tuple[str, str], int] = {}
        keys = ((part.layer, part.name) for part in self.parts)
        return np.array([numbers.setdefault(key, len(numbers)) for key in keys], np.int32)

    def labels(self) -> list[str]:
        """
        Tell what thing each part is of: its name, behind its layer where another has it too.

        Two buildings called ``1`` are ``existing/1`` and ``proposal/1``.
        """
        layers: dict[str, set[str]] = {}
        for part in self.parts:
            layers.setdefault(part.name, set()).add(part.layer)
        return [p.full_name if len(layers[p.name]) > 1 else p.name for p in self.parts]

    def bounds(self) -> NDArray[np.float64]:
        """
        Give the smallest box around the triangles.

        Returns
        -------
        bounds : (2, 3) float64
            Lowest and highest corner in the model's own coordinates [m]. Not to be
            written to.
        """
        return self._bounds

    @cached_property
    def _bounds(self) -> NDArray[np.float64]:
        # Column by column: numpy folds rows of three ten times slower.
        axes = self.triangles().find_corners().T
        bounds = np.array([[a.min() for a in axes], [a.max() for a in axes]]) + self.origin
        bounds.setflags(write=False)
        return bounds

    def select(self, cast: Sequence[str] = (), no_cast: Sequence[str] = ()) -> list[int]:
        """
        Find the parts that cast shadows.

        Parameters
        ----------
        cast, no_cast : sequences of str
            Shell patterns against names, kinds, layers and tags. Without ``cast`` every part
            casts; ``no_cast`` then takes parts away.

        Returns
        -------
        parts : list of int

        Raises
        ------
        InputError
            If a pattern matches no part.
        """

        def matches(pattern: str) -> set[int]:
            found = {i for i, part in enumerate(self.parts) if part.matches(pattern)}
            if not found:
                kinds = sorted({part.kind for part in self.parts if part.kind})
                names = sorted({part.name for part in self.parts})
                layers = sorted({part.layer for part in self.parts} - {""})
                tags = Counter(tag for part in self.parts for tag in part.tags)
                common = [tag for tag, count in tags.most_common(6) if count > 1]
                words = list(dict.fromkeys(layers + kinds + common + names))
                near = _find_alike(pattern, words)
                shown = ", ".join(words[:12])
                more = len(words) - 12
                msg = (
                    f"'{pattern}' matches no part; "
                    + (f"did you mean '{near}'? " if near else "")
                    + f"the file has {shown}"
                    + (f" and {more} more" if more > 0 else "")
                    + " (umbra inspect lists them)"
                )
                raise InputError(msg, pattern=pattern, names=names, kinds=kinds)
            return found

        chosen = set().union(*map(matches, cast)) if cast else set(range(len(self.parts)))
        dropped = set().union(*map(matches, no_cast))
        return sorted(chosen - dropped)


def _find_alike(pattern: str, words: Sequence[str]) -> str | None:
    """Find the word that somebody most likely meant; case counts in names, not in slips."""
    folded = {word.casefold(): word for word in reversed(words)}
    near = difflib.get_close_matches(pattern.casefold(), folded, n=1)
    return folded[near[0]] if near else None


def make_scene(
    parts: Sequence[Part] | ArrayLike,
    faces: ArrayLike | None = None,
    *,
    name: str = "mesh",
    **facts: Any,
) -> Scene:
    """
    Make a scene from parts, or from one triangle soup.

    Coordinates are the model's own; a local origin is chosen and subtracted, so
    that nothing far from zero loses digits later.

    Parameters
    ----------
    parts : sequence of Part, or (n, 3) float64
        Parts, or the vertices of one mesh when ``faces`` is given.
    faces : (m, 3) int, optional
    name : str
        Of the one part, when ``faces`` is given.
    **facts
        ``crs``, ``latitude``, ``longitude``, ``elevation``, ``true_north``, ``ground``,
        ``sources``, ``notes``, ``lights``.

    Raises
    ------
    InputError
        If there is no triangle, or a used vertex is not finite.
    """
    if faces is not None:
        given: tuple[Part, ...] = (Part(name, "", Mesh(np.asarray(parts), np.asarray(faces))),)
    else:
        given = tuple(cast("Sequence[Part]", parts))
        other = next((one for one in given if not isinstance(one, Part)), None)
        if other is not None:
            msg = (
                f"a scene is made of parts, or of vertices and faces; got a {type(other).__name__} "
                "(umbra.read reads files)"
            )
            raise InputError(msg)
    kept = tuple(part for part in given if part.triangles)
    if not kept:
        msg = "there are no triangles; export the model with its surfaces"
        raise InputError(msg)
    scene = Scene(_drop_unused(kept), np.zeros(3))
    if not np.isfinite(scene.bounds()).all():
        _refuse_infinite(kept)
    kept = scene.parts
    bounds = scene.bounds()
    # Whole metres, so that adding the origin back gives the file's own digits.
    far = np.abs(bounds).max(0) > 4 * np.ptp(bounds, axis=0) + 1000
    origin = np.where(far, np.floor(bounds.mean(0)), 0.0)
    if origin.any():
        kept = _shift(kept, origin)
    return replace(scene, parts=kept, origin=origin, **facts)


def _refuse_infinite(parts: tuple[Part, ...]) -> None:
    """Name the first vertex that is not finite as the file counts it, with unused ones."""
    soup = Scene(parts, np.zeros(3)).triangles()
    finite = np.asarray(np.isfinite(soup.vertices).all(1))
    wrong = ~finite[soup.faces]
    face, corner = np.argwhere(wrong)[0]
    count = len(np.unique(soup.faces[wrong]))
    msg = (
        f"caster '{parts[soup.part[face]].name}' has vertices that are not finite: "
        f"{count} in all (first: vertex {soup.faces[face, corner]}); remove or repair them"
    )
    raise InputError(msg, count=count, vertex=int(soup.faces[face, corner]))


def _drop_unused(parts: tuple[Part, ...]) -> tuple[Part, ...]:
    """
    Leave out the vertices that no face uses, so that only what is drawn counts as the model.

    A mesh that bends keeps its own: its shape has rows for each of them.
    """
    bends = {id(p.mesh.vertices) for p in parts if p.binding is not None and p.binding.shape}
    used: dict[int, NDArray[np.bool_]] = {}  # by vertex arrays, which parts share
    for part in parts:
        array = part.mesh.vertices
        if id(array) not in bends:
            is_used = used.setdefault(id(array), np.zeros(len(array), np.bool_))
            is_used[part.mesh.faces.ravel()] = True
    arrays = {
        id(part.mesh.vertices): part.mesh.vertices
        for part in parts
        if not used.get(id(part.mesh.vertices), np.ones(1, np.bool_)).all()
    }
    if not arrays:
        return parts
    shorter = {key: array[used[key]] for key, array in arrays.items()}
    meshes: dict[int, Mesh] = {}
    dropped = []
    for part in parts:
        mesh, key = part.mesh, id(part.mesh.vertices)
        if key in shorter and id(mesh) not in meshes:
            meshes[id(mesh)] = mesh.with_vertices(used[key], shorter[key])
        dropped.append(replace(part, mesh=meshes.get(id(mesh), mesh)))
    return tuple(dropped)


def _shift(parts: tuple[Part, ...], origin: NDArray[np.float64]) -> tuple[Part, ...]:
    arrays: dict[int, NDArray[np.float64]] = {}
    moved = []
    for part in parts:
        if part.transform is not None:
            transform, binding = part.transform.copy(), part.binding
            transform[:3, 3] -= origin
            if binding is not None:
                base = binding.base.copy()
                base[:3, 3] -= origin
                binding = replace(binding, base=base)
            moved.append(replace(part, transform=transform, binding=binding))
            continue
        array = part.mesh.vertices
        if id(array) not in arrays:
            arrays[id(array)] = array - origin
        moved.append(replace(part, mesh=part.mesh.moved(arrays[id(array)])))
    return tuple(moved)
