"""
The part of a city that a window of receivers needs: what is seen there, and what casts there.

A caster's shadow lies where its box is swept away from the light. The reach follows from both boxes
and the light, and is never capped.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.kernels import kernel
from umbra.scene import Part, Scene, Triangles
from umbra.tiles.city_catalogue import Catalogue
from umbra.tiles.job import WorkerContext
from umbra.tiles.matched_parts import NOTHING
from umbra.volume.adjacency import Caster, make_caster

__all__ = [
    "MARGIN",
    "Neighbourhood",
    "PartScene",
    "Selection",
    "find_reaching",
    "make_tile_casters",
]

MARGIN = 0.01
"""Distance by which boxes are enlarged, far above rounding [m]."""
_LEVEL = 1e-6  # z of unit vectors below which steps to casters do not follow from heights


def find_reaching(
    boxes: NDArray[np.float64], target: NDArray[np.float64], lights: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find the boxes of casters whose shadows can meet a box of receivers.

    Parameters
    ----------
    boxes : (n, 2, 3) float64
        Lowest and highest corners [m].
    target : (2, 3) float64
        Box of the receivers, in the same frame [m].
    lights : (k, 3) or (k, 4) float64
        Unit directions toward lights; or homogeneous lights: w = 0 is a direction, w = 1 a lamp's
        position in the same frame [m].

    Returns
    -------
    reaches : (n,) bool
    """
    reaches = np.zeros(len(boxes), np.bool_)
    boxes = np.ascontiguousarray(boxes)
    is_sun = lights[:, 2] > _LEVEL
    if lights.shape[1] > 3:
        is_sun &= lights[:, 3] == 0
    suns, others = lights[is_sun], lights[~is_sun]
    slopes = np.ascontiguousarray(suns[:, :2] / suns[:, 2:3])
    if len(slopes):
        bounds = np.stack([slopes.min(0), slopes.max(0)])
        _find(boxes, target, slopes, bounds, reaches)
    if len(others):
        whole = np.zeros((len(others), 4))
        whole[:, : others.shape[1]] = others
        _find_any(boxes, target, whole, reaches)
    return reaches


@kernel
def _find_any(boxes, target, lights, reaches):
    """
    Add the boxes that rays from a box of receivers to any lights can meet.

    A ray is at p + s d from a receiver p, with d = the direction, s >= 0, or d = lamp - p, s <= 1.
    """
    for i in range(boxes.shape[0]):
        for k in range(lights.shape[0]):
            if reaches[i]:
                break
            w = lights[k, 3]
            low, high = 0.0, 1.0 if w > 0.0 else np.inf
            for axis in range(3):
                # Least and greatest p + s d are both linear in s.
                least, most = target[0, axis] - MARGIN, target[1, axis] + MARGIN
                down, up = lights[k, axis] - w * least, lights[k, axis] - w * most
                low, high = _cut_below(least - boxes[i, 1, axis], down, low, high)
                low, high = _cut_below(boxes[i, 0, axis] - most, -up, low, high)
            reaches[i] = low <= high


@partial(kernel, inline="always")
def _cut_below(start, slope, low, high):
    """Cut an interval of s to where start + s slope <= 0."""
    if slope > 0.0:
        return low, min(high, -start / slope)
    if slope < 0.0:
        return max(low, -start / slope), high
    return (low, high) if start <= 0.0 else (1.0, 0.0)


@kernel
def _find(boxes, target, slopes, bounds, reaches):
    for i in range(boxes.shape[0]):
        box = boxes[i]
        rise = box[1, 2] - target[0, 2] + MARGIN  # of the highest caster over the lowest receiver
        if rise < 0.0:
            continue
        least = max(box[0, 2] - target[1, 2] - MARGIN, 0.0)
        # Steps from receivers to casters, by axis.
        x0, x1 = box[0, 0] - target[1, 0] - MARGIN, box[1, 0] - target[0, 0] + MARGIN
        y0, y1 = box[0, 1] - target[1, 1] - MARGIN, box[1, 1] - target[0, 1] + MARGIN
        if not _meets(least, rise, bounds[0, 0], bounds[1, 0], x0, x1):
            continue
        if not _meets(least, rise, bounds[0, 1], bounds[1, 1], y0, y1):
            continue
        for s in range(slopes.shape[0]):
            low, high = _cut(slopes[s, 0], x0, x1, least, rise)
            low, high = _cut(slopes[s, 1], y0, y1, low, high)
            if low <= high:
                reaches[i] = True
                break


@partial(kernel, inline="always")
def _meets(least, rise, slope0, slope1, a, b):
    """Return whether steps of some slopes, up to a rise, meet an interval along an axis."""
    low = min(slope0 * least, slope0 * rise)
    high = max(slope1 * least, slope1 * rise)
    return low <= b and high >= a


@partial(kernel, inline="always")
def _cut(slope, a, b, low, high):
    """Cut an interval of heights to those at which a sun's step lies in [a, b] along an axis."""
    if slope == 0.0:
        return (low, high) if a <= 0.0 <= b else (1.0, 0.0)
    first, last = a / slope, b / slope
    if first > last:
        first, last = last, first
    # Quotients may round either way; the boxes' margin covers it.
    return max(low, first), min(high, last)


@dataclass(frozen=True)
class Selection:
    """
    Units of the city's files.

    Parameters
    ----------
    units : tuple of (int, (n,) int)
        Number of each file, and its units, ascending.
    """

    units: tuple[tuple[int, NDArray[np.intp]], ...]

    def __or__(self, other: "Selection") -> "Selection":
        joined = dict(self.units)
        for number, units in other.units:
            joined[number] = np.union1d(joined.get(number, np.zeros(0, np.intp)), units)
        return Selection(tuple(sorted(joined.items(), key=lambda item: item[0])))


@dataclass(frozen=True, eq=False)
class PartScene(Scene):
    """
    Some of a city's triangles as a scene, whose parts are numbers without meshes.

    Parameters
    ----------
    soup : Triangles
        In the run's local frame; parts are numbered in the order of the city's.
    group : (n_parts,) int32
        Object of each part.
    number : (n_parts, 2) int
        File and part of each.
    thing : (n_parts,) int
        Object of each in its file.
    box : (2, 3) float64
        Bounds of the whole city: rounding is judged by them, whatever is at hand [m].
    """

    soup: Triangles = None  # type: ignore[assignment]
    group: NDArray[np.int32] = None  # type: ignore[assignment]
    number: NDArray[np.intp] = None  # type: ignore[assignment]
    thing: NDArray[np.intp] = None  # type: ignore[assignment]
    box: NDArray[np.float64] = None  # type: ignore[assignment]

    def triangles(self, parts: Sequence[int] | None = None) -> Triangles:
        """Return the triangles of some parts, all by default, in the city's order."""
        if parts is None:
            return self.soup
        chosen = np.zeros(len(self.group), np.bool_)
        chosen[list(parts)] = True
        return self.pick(chosen)

    def pick(self, chosen: NDArray[np.bool_]) -> Triangles:
        """Return the triangles of the chosen parts, (n_parts,) bool."""
        soup = self.soup
        if chosen.all():
            return soup
        faces = np.flatnonzero(chosen[soup.part])
        return replace(soup, faces=soup.faces[faces], part=soup.part[faces])

    def groups(self) -> NDArray[np.int32]:
        """Return the object of each part."""
        return self.group

    def spread(self, find: Callable[[int], NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """Return, for each part, what is found for the parts of its file, by the file's number."""
        values = np.zeros(len(self.group), np.bool_)
        for file in np.unique(self.number[:, 0]).tolist():
            is_own = self.number[:, 0] == file
            values[is_own] = find(file)[self.number[is_own, 1]]
        return values

    def labels(self) -> list[str]:
        """Name each part's object, such that names sort in the order of files and objects."""
        return [
            f"{file:08}/{index:010}"
            for file, index in zip(self.number[:, 0].tolist(), self.thing.tolist(), strict=True)
        ]

    def with_words(self, catalogue: Catalogue) -> "PartScene":
        """Return the same with the parts' kinds, without meshes."""
        kinds = {file: catalogue.files[file].kinds_of_parts for file in set(self.number[:, 0])}
        parts = tuple(Part("", kinds[file][part], NOTHING) for file, part in self.number.tolist())
        return replace(self, parts=parts)

    def bounds(self) -> NDArray[np.float64]:
        """Return the bounds of the whole city in its own coordinates, (2, 3) [m]."""
        return self.box


class Neighbourhood:
    """
    Searches for what a box of receivers needs.

    Parameters
    ----------
    context : WorkerContext
    """

    def __init__(self, context: WorkerContext) -> None:
        self._context = context

    def find_seen(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> Selection:
        """Find the units whose plan meets a rectangle, (2,) each in the local frame [m]."""

        def meets(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
            inside = (boxes[:, 1, :2] >= low - MARGIN) & (boxes[:, 0, :2] <= high + MARGIN)
            return inside[:, 0] & inside[:, 1]

        return self._select(meets)

    def find_casting(self, box: NDArray[np.float64], lights: NDArray[np.float64]) -> Selection:
        """
        Find the units whose shadows of lights can meet a box (2, 3), all in the local frame.

        For the whole sky these are all units that rise above the box's floor.
        """
        if self._context.sees_whole_sky:
            return self._select(lambda boxes: boxes[:, 1, 2] > box[0, 2] - MARGIN)
        return self._select(lambda boxes: find_reaching(boxes, box, lights))

    def _select(self, test: Callable[[NDArray[np.float64]], NDArray[np.bool_]]) -> Selection:
        """Return the units whose boxes pass a test, of the files whose bounds do."""
        selected, context = [], self._context
        files = np.flatnonzero(test(context.boxes))
        for number in files.tolist():
            boxes = context.catalogue.files[number].geometry.boxes + context.shifts[number]
            units = np.flatnonzero(test(boxes))
            if len(units):
                selected.append((number, units))
        return Selection(tuple(selected))

    def find_bounds(self, selection: Selection) -> NDArray[np.float64]:
        """Return the bounds of some units, local frame, (2, 3) [m]."""
        boxes = np.concatenate(
            [boxes + self._context.shifts[number] for number, boxes in self._boxes(selection)]
        )
        return np.stack([boxes[:, 0].min(0), boxes[:, 1].max(0)])

    def find_heights(self, seen: Selection) -> tuple[float, float]:
        """Return the lowest and highest z of some units, local frame [m]; inf, -inf if none."""
        low, high = np.inf, -np.inf
        for number, boxes in self._boxes(seen):
            low = min(low, float(boxes[:, 0, 2].min()) + self._context.shifts[number, 2])
            high = max(high, float(boxes[:, 1, 2].max()) + self._context.shifts[number, 2])
        return low, high

    def count_faces(self, selection: Selection) -> int:
        """Return the number of faces of some units."""
        files = self._context.catalogue.files
        return sum(files[number].geometry.count_faces(units) for number, units in selection.units)

    def _boxes(self, selection: Selection) -> Iterator[tuple[int, NDArray[np.float64]]]:
        for number, units in selection.units:
            yield number, self._context.catalogue.files[number].geometry.boxes[units]

    def read(self, selection: Selection, which: str = "any") -> PartScene:
        """
        Read units into one scene, in the order of files, parts and faces.

        Parameters
        ----------
        selection : Selection
        which : {'any', 'casts', 'receives'}
            The parts whose faces are read.
        """
        context = self._context
        vertices, faces, parts, groups, numbers, objects = [], [], [], [], [], []
        points = n_groups = rows = 0
        for number, units in selection.units:
            geometry = context.catalogue.files[number].geometry
            chosen = geometry.find_faces(units)
            part = geometry.part[chosen]
            has_role = self._find_role(number, which)[part]
            chosen, part = chosen[has_role], part[has_role]
            if not len(chosen):
                continue
            corners = geometry.faces[chosen]
            used = np.unique(corners)
            vertices.append(geometry.vertices[used] + context.shifts[number])
            faces.append(np.searchsorted(used, corners).astype(np.int32) + np.int32(points))
            own, local = np.unique(part, return_inverse=True)
            parts.append(local.ravel().astype(np.int32) + np.int32(rows))
            groups.append(np.unique(geometry.object_of[own], return_inverse=True)[1] + n_groups)
            objects.append(geometry.object_of[own])
            numbers.append(np.stack([np.full(len(own), number), own], axis=1))
            points, rows = points + len(used), rows + len(own)
            n_groups = int(groups[-1].max()) + 1
        soup = Triangles(
            np.concatenate([np.zeros((0, 3)), *vertices]),
            np.concatenate([np.zeros((0, 3), np.int32), *faces]),
            np.concatenate([np.zeros(0, np.int32), *parts]),
        )
        frame = context.job.frame
        return PartScene(
            (), context.origin, soup=soup, box=np.array(frame.bounds),
            group=np.concatenate([np.zeros(0, np.int32), *groups]).astype(np.int32),
            number=np.concatenate([np.zeros((0, 2), np.intp), *numbers]),
            thing=np.concatenate([np.zeros(0, np.intp), *objects]),
        )  # fmt: skip

    def _find_role(self, number: int, which: str) -> NDArray[np.bool_]:
        roles = self._context.roles
        if which == "any":
            casts = roles.find_casting(number) | roles.find_former(number)
            return casts | roles.find_receiving(number)
        return (roles.find_casting if which == "casts" else roles.find_receiving)(number)


_ABYSS = -1e7  # z of the face that stands for no caster [m]


def make_tile_casters(
    context: WorkerContext, scene: PartScene
) -> tuple[Caster, Canopy | None, Triangles]:
    """
    Prepare the casters of a neighbourhood.

    Parameters
    ----------
    context : WorkerContext
    scene : PartScene
        As ``Neighbourhood.read`` returns it.

    Returns
    -------
    caster : Caster
        Canopies as if they were opaque.
    canopy : Canopy or None
        If the study has canopies.
    seen : Triangles
        All but canopies.
    """
    roles = context.roles
    casts = scene.spread(roles.find_casting)
    soup = scene.pick(casts)
    vertices, faces, group = soup.vertices, soup.faces, scene.group[soup.part]
    if not len(faces):  # a face below every receiver casts nothing
        vertices = np.array([[0.0, 0.0, _ABYSS], [1.0, 0.0, _ABYSS], [0.0, 1.0, _ABYSS]])
        faces, group = np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32)
    caster = make_caster(vertices, faces, group)
    gone = scene.spread(roles.find_replaced)
    if roles.season is None:
        return caster, None, scene.pick(~gone)
    crowns = scene.spread(roles.find_canopies)
    every, casting, solid, former = (
        tuple(np.flatnonzero(which).tolist())
        for which in (crowns & ~gone, crowns & casts, casts & ~crowns, crowns & gone)
    )
    return caster, Canopy(every, casting, solid, roles.season, former), scene.pick(~crowns & ~gone)
