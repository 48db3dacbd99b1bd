"""A scene: parts about a local origin, and its place on earth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, find_similar, fit_names, make_printable, show_count
from umbra.scene.exchange import Exchange
from umbra.scene.lights import Light
from umbra.scene.mesh import ADDED_GROUND, Part, find_box, find_used, transform_points
from umbra.scene.rig import Animation

__all__ = ["Scene", "Source", "Triangles"]


_MOST = 6  # parts that are listed
_WIDTH = 40  # letters of a name


@dataclass(frozen=True)
class Source:
    """
    A file that was read: its name and the SHA-256 of its bytes, in hex.

    ``is_companion``: a file that belongs to a named one and holds a piece of it. ``path`` and
    ``layer``: where it was read, and the layer of its parts. ``frame``: the matrix, row by row, by
    which a file's own coordinates were brought to their place, if they were. ``ground``: the height
    of the level ground in its own coordinates, if it states it [m]. ``moved``: by how much its
    layer was moved along x, y, z [m] and turned before [degrees], if the caller asked for it.
    """

    name: str
    sha256: str
    format: str
    is_companion: bool = False
    path: str = field(default="", compare=False, repr=False)
    layer: str = field(default="", compare=False, repr=False)
    frame: tuple[float, ...] = field(default=(), compare=False, repr=False)
    ground: float | None = field(default=None, compare=False, repr=False)
    moved: tuple[float, ...] = field(default=(), compare=False, repr=False)


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
        """Return the vertices that a face uses, each once, (n, 3)."""
        is_used = find_used(self.vertices, self.faces)
        return self.vertices if is_used.all() else self.vertices[is_used]


@dataclass(frozen=True, eq=False)
class Scene(Exchange):
    """
    The contents of a model file.

    Parameters
    ----------
    parts : tuple of Part
        In coordinates relative to ``origin``.
    origin : (3,) float64
        Add it to local coordinates to get the model's own [m].
    crs : str, optional
        Coordinate reference system of the model's own coordinates.
    latitude, longitude : float, optional
        Of the site, if the file states it [degrees].
    elevation : float, optional
        Of the site above the sea, if the file states it [m].
    is_ellipsoidal : bool
        Whether ``elevation`` is above the ellipsoid of WGS 84 instead, as geocentric files have it.
    true_north : float, optional
        Azimuth of true north in the model's plan, clockwise from +y [degrees].
    ground : float, optional
        Height of the level ground, if the file states it, in the model's own
        coordinates [m].
    site_doubt : str, optional
        Why the file's site is not known although the file states one: it states several,
        or one that cannot be.
    sources : tuple of Source
    notes : tuple of str
        Losses and assumptions of the reader, one line each.
    lights : tuple of Light
        The file's own, in the model's own coordinates.
    replaced : tuple of Part
        What a proposal among the parts replaces: it stands before the proposal alone.
    """

    parts: tuple[Part, ...]
    origin: NDArray[np.float64]
    crs: str | None = None
    latitude: float | None = None
    longitude: float | None = None
    elevation: float | None = None
    is_ellipsoidal: bool = False
    true_north: float | None = None
    ground: float | None = None
    site_doubt: str | None = None
    sources: tuple[Source, ...] = ()
    notes: tuple[str, ...] = ()
    lights: tuple[Light, ...] = ()
    replaced: tuple[Part, ...] = ()

    def __repr__(self) -> str:
        return _show(self)

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        return _show_as_html(self)

    def __len__(self) -> int:
        """Return the number of parts."""
        return len(self.parts)

    def __iter__(self) -> Iterator[Part]:
        """Iterate over the parts."""
        return iter(self.parts)

    def __getitem__(self, name: str) -> Scene:
        """
        Return the parts of one name as a scene, in the same place on earth.

        A building may have several: its walls, its roof. ``layer/name`` means those in a layer.
        """
        parts = tuple(part for part in self.parts if name in {part.name, part.full_name})
        if parts:
            return replace(self, parts=parts, lights=(), notes=())
        names = list(dict.fromkeys(part.name for part in self.parts))
        near = find_similar(str(name), names, 3)
        more = f" and {len(names) - 6} more" if len(names) > 6 else ""
        is_like = (
            f"the nearest are {', '.join(near)}"
            if near
            else (f"there are {', '.join(names[:6])}{more}")
        )
        msg = f"no part is called {name!r}; {is_like} (all are in scene.parts)"
        raise InputError(msg, name=name, names=names)

    @cached_property
    def whole(self) -> Scene:
        """The scene with what a proposal replaces, which follows its other parts."""
        if not self.replaced:
            return self
        return replace(self, parts=(*self.parts, *self.replaced), replaced=())

    @property
    def animations(self) -> tuple[Animation, ...]:
        """The file's animations: each has a name and a duration; `pose` plays them."""
        bound: tuple[Part | Light, ...] = (*self.parts, *self.lights)
        rigs = {id(light.binding.rig): light.binding.rig for light in bound if light.binding}
        return tuple(animation for rig in rigs.values() for animation in rig.animations)

    def triangles(self, parts: Sequence[int] | None = None) -> Triangles:
        """
        Flatten parts into one soup, with transformed instances.

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
            # A mirrored instance is inside out: reverse its winding.
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
        """Return a number for each part, (n_parts,) int32, the same for parts of one object."""
        numbers: dict[tuple[str, str], int] = {}
        keys = ((part.layer, part.name) for part in self.parts)
        return np.array([numbers.setdefault(key, len(numbers)) for key in keys], np.int32)

    def labels(self) -> list[str]:
        """
        Name the object of each part, with its layer where another layer has the name, too.

        Two buildings called ``1`` are ``existing/1`` and ``proposal/1``.
        """
        layers: dict[str, set[str]] = {}
        for part in self.parts:
            layers.setdefault(part.name, set()).add(part.layer)
        objects = {(part.layer, part.name): part for part in self.parts}
        shown = {
            key: part.full_name if len(layers[part.name]) > 1 else part.name
            for key, part in objects.items()
        }
        taken = Counter(shown.values())
        for key, label in shown.items():
            if taken[label] > 1:  # an object may be called as another is with its layer
                shown[key] = objects[key].full_name
        return [shown[part.layer, part.name] for part in self.parts]

    def bounds(self) -> NDArray[np.float64]:
        """
        Return the smallest box around the triangles.

        Returns
        -------
        bounds : (2, 3) float64
            Lowest and highest corner in the model's own coordinates [m]. Read only.
        """
        return self._bounds

    def model_bounds(self) -> NDArray[np.float64]:
        """Return the same without a ground that was added to the model, which goes far beyond."""
        own = self.list_own()
        return self._bounds if own is None else self._own_bounds

    def list_own(self) -> list[int] | None:
        """Return the parts without a ground that was added; None: all, as there is none."""
        own = [k for k, part in enumerate(self.parts) if part.kind not in ADDED_GROUND]
        return own if 0 < len(own) < len(self.parts) else None

    @cached_property
    def _own_bounds(self) -> NDArray[np.float64]:
        own = tuple(self.parts[k] for k in self.list_own() or ())
        return replace(self, parts=own).bounds()

    @cached_property
    def _bounds(self) -> NDArray[np.float64]:
        boxes = []
        shared: dict[int, tuple[NDArray[np.float64], NDArray[np.bool_]]] = {}
        for part in self.parts:
            vertices, faces = part.mesh.vertices, part.mesh.faces
            if part.transform is not None:
                if len(faces):
                    moved = transform_points(part.transform, vertices)
                    boxes.append(find_box(moved[find_used(vertices, faces)]))
                continue
            if id(vertices) not in shared:
                shared[id(vertices)] = vertices, np.zeros(len(vertices), np.bool_)
            shared[id(vertices)][1][faces.ravel()] = True
        for vertices, is_used in shared.values():
            if is_used.any():
                boxes.append(find_box(vertices if is_used.all() else vertices[is_used]))
        bounds = find_box(np.concatenate(boxes)) + self.origin
        bounds.setflags(write=False)
        return bounds

    def with_facts(self, **facts: Any) -> Scene:
        """Return the scene with other facts, all but its parts, origin and bounds."""
        scene = replace(self, **facts)
        if "_bounds" in vars(self):
            vars(scene)["_bounds"] = self._bounds
        return scene

    def select(
        self, cast: Sequence[str] = (), no_cast: Sequence[str] = (), *, option: str = "cast"
    ) -> list[int]:
        """
        Find the parts that cast shadows.

        Parameters
        ----------
        cast, no_cast : sequences of str
            Shell patterns of names, kinds, layers and tags. Without ``cast`` every part casts;
            ``no_cast`` then removes parts.
        option : str
            Option that ``cast`` comes from, for errors.

        Returns
        -------
        parts : list of int

        Raises
        ------
        InputError
            If a pattern matches no part.
        """

        def matches(pattern: str, name: str) -> set[int]:
            indices = {i for i, part in enumerate(self.parts) if part.matches(pattern)}
            if not indices:
                kinds = sorted({part.kind for part in self.parts if part.kind})
                names = sorted({part.name for part in self.parts})
                layers = sorted({part.layer for part in self.parts} - {""})
                tags = Counter(tag for part in self.parts for tag in part.tags)
                common = [tag for tag, count in tags.most_common(6) if count > 1]
                words = list(dict.fromkeys(layers + kinds + common + names))
                near = find_similar(pattern, words)
                shown = ", ".join(words[:12])
                more = len(words) - 12
                msg = (
                    f"{name}='{pattern}' matches no part; "
                    + (f"did you mean '{near[0]}'? " if near else "")
                    + f"the file has {shown}"
                    + (f" and {more} more" if more > 0 else "")
                    + " (umbra inspect lists them)"
                )
                raise InputError(msg, option=name, pattern=pattern, names=names, kinds=kinds)
            return indices

        chosen = set(range(len(self.parts)))
        if cast:
            chosen = set().union(*(matches(pattern, option) for pattern in cast))
        dropped = set().union(*(matches(pattern, "no_cast") for pattern in no_cast))
        return sorted(chosen - dropped)


def _show(scene: Scene) -> str:
    """Return a scene's size and its first parts as a table, ten lines at most."""
    listed = scene.parts[:_MOST]
    names = fit_names([make_printable(part.name) for part in listed], _WIDTH)
    kinds = fit_names([make_printable(part.kind) for part in listed], _WIDTH // 2)
    wide, wider = (max(map(len, [*column, "name"])) for column in (names, kinds))
    rows = [f"{'name':{wide}}  {'kind':{wider}}  triangles"]
    rows += [
        f"{name:{wide}}  {kind:{wider}}  {part.triangles:9,}"
        for name, kind, part in zip(names, kinds, listed, strict=True)
    ]
    return "\n".join([*_sum_up(scene), *rows, *_tell_more(scene)])


def _show_as_html(scene: Scene) -> str:
    """Return the same as HTML."""
    rows = "".join(
        f"<tr><td>{escape(make_printable(part.name))}</td>"
        f"<td>{escape(make_printable(part.kind))}</td>"
        f"<td style='text-align:right'>{part.triangles:,}</td></tr>"
        for part in scene.parts[:_MOST]
    )
    return (
        f"<p>{'<br>'.join(map(escape, _sum_up(scene)))}</p>"
        "<table><thead><tr><th>name</th><th>kind</th><th>triangles</th></tr></thead>"
        f"<tbody>{rows}</tbody></table><p>{'<br>'.join(map(escape, _tell_more(scene)))}</p>"
    )


def _sum_up(scene: Scene) -> list[str]:
    triangles = sum(part.triangles for part in scene.parts)
    head = f"Scene: {show_count(len(scene.parts), 'part')}, {show_count(triangles, 'triangle')}"
    if not scene.parts:
        return [head]
    low, high = scene.bounds()
    size = " x ".join(f"{length:.2f}" for length in np.subtract(high, low))
    corner = ", ".join(f"{value:.2f}" for value in low)
    crs = f" ({make_printable(scene.crs)[:60]})" if scene.crs else ""
    return [head, f"{size} m, from {corner}{crs}"]


def _tell_more(scene: Scene) -> list[str]:
    more = len(scene.parts) - _MOST
    return [f"and {more:,} more in scene.parts"] if more > 0 else []
