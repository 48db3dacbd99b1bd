"""
Shadow count of the eye: the faces between the eye and the light.

z-pass starts at the eye, so it needs the eye's shadow count. This anchor is counted once per view,
with the same lit flags as the volumes.

An eye exactly in a side of a volume has no single count: rays to the left and right of that side
differ. The anchor reports this, so that the eye can be moved by a negligible distance.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import inlined, kernel
from umbra.scene import Camera
from umbra.scene.derived import derive
from umbra.volume.adjacency import Caster

__all__ = [
    "BLOCK",
    "Anchor",
    "EyeCount",
    "FaceBlocks",
    "find_anchor",
    "find_around",
    "find_cut_open",
    "find_eye_count",
    "find_faces_before",
]

BLOCK = 64
"""Faces in a block."""


@dataclass(frozen=True, eq=False)
class FaceBlocks:
    """
    Bounding boxes of runs of 64 consecutive faces, which a caster sorts by position.

    Parameters
    ----------
    bounds : (n_blocks, 6) float64
        Lowest and highest corner.
    """

    bounds: NDArray[np.float64]

    @cached_property
    def largest(self) -> float:
        """Largest coordinate; 0 without faces."""
        return float(np.abs(self.bounds).max(initial=0.0))

    @classmethod
    def of(cls, caster: Caster) -> "FaceBlocks":
        """Bound a caster's faces; made once."""

        def bound() -> "FaceBlocks":
            return cls(_bound_blocks(caster.vertices, caster.faces))

        return derive(caster, "blocks", None, bound)


@kernel
def _bound_blocks(vertices, faces):
    """Return the lowest and highest corner of each run of faces."""
    bounds = np.empty(((faces.shape[0] + BLOCK - 1) // BLOCK, 6))
    bounds[:, :3] = np.inf
    bounds[:, 3:] = -np.inf
    for f in range(faces.shape[0]):
        for k in range(3):
            for axis in range(3):
                coordinate = vertices[faces[f, k], axis]
                bounds[f // BLOCK, axis] = min(bounds[f // BLOCK, axis], coordinate)
                bounds[f // BLOCK, axis + 3] = max(bounds[f // BLOCK, axis + 3], coordinate)
    return bounds


@dataclass(frozen=True, eq=False)
class Anchor:
    """
    Faces crossed between the eye and the light.

    Parameters
    ----------
    faces : (n,) int32
    is_lit : (n,) bool
        Which of them are lit.
    components : (n,) int32
        The component of each.
    n_components : int
        Of the caster.
    is_clean : bool
        Whether the ray neither passes an edge within rounding nor starts in a face: the eye is in
        no volume's side.
    """

    faces: NDArray[np.int32]
    is_lit: NDArray[np.bool_]
    components: NDArray[np.int32]
    n_components: int
    is_clean: bool

    def find_adding(self, is_closed: NDArray[np.bool_]) -> NDArray[np.int32]:
        """Return the component of each face that adds to the count, under each one's rule."""
        return self.components[self.is_lit | ~is_closed[self.components]]

    def count(self, is_closed: NDArray[np.bool_]) -> int:
        """Return the eye's shadow count under each component's rule."""
        return len(self.find_adding(is_closed))

    @property
    def enclosed(self) -> NDArray[np.bool_]:
        """Components with more winding at the light, where the closed rule could miss a shadow."""
        if self.is_lit.all():  # as nearly always
            return np.zeros(self.n_components, np.bool_)
        return self._wind() < 0

    @property
    def around(self) -> NDArray[np.bool_]:
        """Components that enclose either the light or the eye more often, (n_components,)."""
        return self._wind() != 0

    def _wind(self) -> NDArray[np.int32]:
        """Find each component's winding number at the eye minus that at the light."""
        winding = np.zeros(self.n_components, np.int32)
        np.add.at(winding, self.components, np.where(self.is_lit, 1, -1))
        return winding


def find_anchor(
    caster: Caster, blocks: FaceBlocks, eye: NDArray[np.float64], light: NDArray[np.float64]
) -> Anchor:
    """
    Find the faces between two homogeneous points.

    ``eye`` and ``light`` are (4,) float64 in the caster's frame; w = 0 is infinitely far.
    """
    n, is_clean = 0, True
    crossed = np.empty(len(caster.faces), np.int32)
    if eye[3] or light[3]:  # else both are beyond everything
        start, end = (eye, light) if eye[3] else (light, eye)
        n, is_clean = pierce(
            caster.vertices, caster.faces, caster.planes, blocks.bounds, start[:3],
            end[:3] - end[3] * start[:3], bool(end[3]), eye, light, crossed,
        )  # fmt: skip
    is_lit = crossed[:n] >= 0
    faces = np.where(is_lit, crossed[:n], ~crossed[:n])
    return Anchor(faces, is_lit, caster.component[faces], len(caster.is_closed), is_clean)


@kernel
def _side(a, b, start, way):
    """Return the side of the directed line on which the edge a to b passes (Pluecker)."""
    ax, ay, az = a[0] - start[0], a[1] - start[1], a[2] - start[2]
    bx, by, bz = b[0] - start[0], b[1] - start[1], b[2] - start[2]
    return (
        way[0] * (ay * bz - az * by) + way[1] * (az * bx - ax * bz) + way[2] * (ax * by - ay * bx)
    )


@inlined
def _misses(boxes, block, start, way, inverse, far):
    """Return whether the ray surely misses a box; in doubt it does not."""
    near = 0.0
    for k in range(3):
        low, high = boxes[block, k], boxes[block, k + 3]
        margin = 1e-9 * (1.0 + abs(low) + abs(high) + abs(start[k]))
        low -= margin + start[k]
        high += margin - start[k]
        if way[k] == 0.0:
            if low > 0.0 or high < 0.0:
                return True
        else:
            near = max(near, min(low * inverse[k], high * inverse[k]))
            far = min(far, max(low * inverse[k], high * inverse[k]))
    return near > far * (1.0 + 1e-9)


@kernel
def _lies_on(point, a, b, c, normal):
    """Return whether a point of a triangle's plane lies in the triangle, edges included."""
    for k in range(3):
        margin = 1e-9 * (abs(a[k]) + abs(b[k]) + abs(c[k]))
        low = min(a[k], min(b[k], c[k])) - margin
        high = max(a[k], max(b[k], c[k])) + margin
        if point[k] < low or point[k] > high:
            return False
    square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]
    for p, q in ((a, b), (b, c), (c, a)):
        ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        vx, vy, vz = point[0] - p[0], point[1] - p[1], point[2] - p[2]
        side = (
            normal[0] * (uy * vz - uz * vy)
            + normal[1] * (uz * vx - ux * vz)
            + normal[2] * (ux * vy - uy * vx)
        )
        if side < -1e-12 * square:
            return False
    return square > 0.0


@kernel
def pierce(vertices, faces, planes, boxes, start, way, finite, eye, light, crossed):
    """
    List the crossed faces, inverted (``~face``) if unlit; ``crossed`` has room for all faces.

    Returns their number, and False if the ray passes an edge or starts in a face, within rounding.
    """
    clean, n = True, 0
    end = light[:3] if eye[3] else eye[:3]
    inverse = np.zeros(3)
    for k in range(3):
        inverse[k] = 1.0 / way[k] if way[k] != 0.0 else 0.0
    far = 1.0 if finite else np.inf
    for block in range(boxes.shape[0]):
        if _misses(boxes, block, start, way, inverse, far):
            continue
        for f in range(block * BLOCK, min(faces.shape[0], block * BLOCK + BLOCK)):
            at_light = 0.0
            at_eye = 0.0
            size_eye = 0.0
            for k in range(4):
                at_light += planes[k, f] * light[k]
                at_eye += planes[k, f] * eye[k]
                size_eye += abs(planes[k, f] * eye[k])
            a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
            if eye[3] > 0.0 and abs(at_eye) <= 1e-12 * size_eye:
                clean = clean and not _lies_on(eye, a, b, c, planes[:, f])
            if not ((at_light > 0.0 and at_eye < 0.0) or (at_light < 0.0 and at_eye > 0.0)):
                continue
            flat = 0
            ahead = 0
            behind = 0
            positive = 0
            for k in range(3):
                i = faces[f, k]
                j = faces[f, (k + 1) % 3]
                # Both faces of an edge must agree on a tie: test it in one direction only.
                low, high = vertices[min(i, j)], vertices[max(i, j)]
                # Relative to the nearer end, which may lie almost on the edge.
                size = _size_of_side(low, high, start, way)
                side = _side(low, high, start, way)
                if finite:
                    other = _size_of_side(low, high, end, way)
                    if other < size:
                        size = other
                        side = _side(low, high, end, way)
                positive += (side >= 0.0) == (i < j)
                if abs(side) <= 1e-13 * size:
                    flat += 1
                elif (side > 0.0) == (i < j):
                    ahead += 1
                else:
                    behind += 1
            if flat > 0 and (ahead == 0 or behind == 0):
                clean = False
            if positive in (0, 3):
                crossed[n] = f if at_light > 0.0 else ~f
                n += 1
    return n, clean


@kernel
def _size_of_side(a, b, start, way):
    """Return the magnitude to which rounding in ``_side`` is relative."""
    apart_a = 0.0
    apart_b = 0.0
    length = 0.0
    for k in range(3):
        apart_a += (a[k] - start[k]) ** 2
        apart_b += (b[k] - start[k]) ** 2
        length += way[k] ** 2
    return np.sqrt(apart_a * apart_b * length)


UP = np.array([0.0, 0.0, 1.0])
_SKY = np.array([0.36, 0.48, 0.8, 0.0])  # a direction to infinity
_ALIKE = 1e-9  # tolerance: positions relative to their coordinates, directions as sines


@dataclass(frozen=True, eq=False)
class EyeCount:
    """
    Shadow count at the start of a view's rays, none of which starts in a volume's side.

    ``start`` and ``end`` are the counts where rays start and, in an orthographic view, end;
    ``along`` is 1 if rays start in the light, -1 if they run straight to it, else 0.
    """

    matrix: NDArray[np.float64]
    start: Anchor
    end: Anchor
    along: int


def find_eye_count(
    caster: Caster,
    blocks: FaceBlocks,
    camera: Camera,
    origin: NDArray[np.float64],
    light: NDArray[np.float64],
) -> EyeCount:
    """
    Find the shadow count of a camera, for a light (4,) in the caster's frame.

    An eye in the side of a volume is moved (or parallel rays tilted) until it is in none.
    """
    apex = camera.apex(origin)
    right, up, _ = camera.axes()
    size = 1.0 + max(np.abs(apex[:3]).max(), blocks.largest)
    for attempt in range(8):
        aside = 1e-10 * attempt * np.array([0.83, 0.56])
        if camera.height is None:
            step = size * (aside[0] * right + aside[1] * up) + 0.37 * size * aside[0] * UP
            matrix = camera.matrix(origin - step)
            start = end = find_anchor(caster, blocks, apex + np.append(step, 0.0), light)
        else:
            matrix = camera.matrix(origin)
            matrix[:2] += camera.size[1] / camera.height * np.outer([-1, 1] * aside, matrix[3])
            tilted = apex + np.append(aside[0] * right + aside[1] * up, 0.0)
            start, end = (find_anchor(caster, blocks, way, light) for way in (tilted, -tilted))
        if start.is_clean and end.is_clean:
            break
    return EyeCount(matrix, start, end, _compare(apex, light))


def find_faces_before(
    caster: Caster, blocks: FaceBlocks, camera: Camera, origin: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Find the casting faces in front of the near plane, at least in part: not drawn there."""
    forward = camera.axes()[2]
    at = (camera.eye - origin) @ forward
    in_front = _find_blocks_before(blocks.bounds, forward, at + camera.near)
    if not len(in_front):
        return in_front
    faces = (in_front[:, None] * BLOCK + np.arange(BLOCK)).ravel()
    faces = faces[faces < len(caster.faces)]
    depth = (caster.vertices[caster.faces[faces]] @ forward).min(1) - at
    return faces[depth < camera.near]


@kernel
def _find_blocks_before(bounds, forward, limit):
    """Find the boxes whose nearest corner lies before a plane across the view."""
    before = np.empty(bounds.shape[0], np.intp)
    n = 0
    for block in range(bounds.shape[0]):
        nearest = 0.0
        for k in range(3):
            nearest += forward[k] * bounds[block, k if forward[k] > 0.0 else k + 3]
        before[n] = block
        n += nearest < limit
    return before[:n].copy()


def find_around(
    caster: Caster, blocks: FaceBlocks, light: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Find the components that enclose a light, (4,) in the caster's frame."""
    return find_anchor(caster, blocks, _SKY, light).around


def find_cut_open(
    caster: Caster, blocks: FaceBlocks, near_faces: NDArray[np.intp], light: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """
    Find components, (n_components,) bool, cut by the near plane, where the closed rule may fail.

    Behind a clipped wall the winding number differs from the eye's. Lit faces alone still decide,
    unless the light is inside or the component is wound inward.
    """
    opened = np.zeros(len(caster.is_closed), np.bool_)
    if not len(near_faces):
        return opened
    opened[caster.component[near_faces]] = True
    return opened & (find_around(caster, blocks, light) | caster.is_inward)


def _compare(apex: NDArray[np.float64], light: NDArray[np.float64]) -> int:
    """Return 1 if rays start in the light, -1 if they run straight to it, else 0."""
    if apex[3] and light[3]:
        apart = np.abs(apex - light).max()
        return int(apart <= _ALIKE * (1.0 + np.abs(apex).max()))
    if apex[3] or light[3]:
        return 0
    a, b = (v[:3] / np.linalg.norm(v[:3]) for v in (apex, light))
    if np.linalg.norm(np.cross(a, b)) > _ALIKE:
        return 0
    return 1 if a @ b > 0 else -1
