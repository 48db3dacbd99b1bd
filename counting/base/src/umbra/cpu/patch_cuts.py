"""Intersections of casting faces with the plane of a patch, and faces close to it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umbra.kernels import borrowing, inlined, kernel
from umbra.rays.face_tree import DEEPEST, FaceTree
from umbra.rays.lanes import LANES

__all__ = ["cut_patch_edge", "find_cuts"]

_CLEAR = 1e-4  # faces farther than this outside a patch are ignored [squares and m]


class _Found(NamedTuple):
    """
    Cuts and marks, as in ``Patches``, and work arrays.

    Parameters
    ----------
    start, cuts, face, mark_start, marks, far
        ``cuts`` to ``far`` have no rows while they are counted.
    stack : (DEEPEST,) int32
        Stack for searches in the tree.
    near : (n_faces,) int32
        Faces near a patch.
    polygon, part : (8, 3) float64
        A face in the patch's frame, and its part close to the plane.
    """

    start: NDArray[np.int64]
    cuts: NDArray[np.float64]
    face: NDArray[np.int32]
    mark_start: NDArray[np.int64]
    marks: NDArray[np.int64]
    far: NDArray[np.float64]
    stack: NDArray[np.int32]
    near: NDArray[np.int32]
    polygon: NDArray[np.float64]
    part: NDArray[np.float64]


def find_cuts(
    frame: NDArray[np.float64],
    place: NDArray[np.float64],
    size: NDArray[np.int64],
    tau: NDArray[np.float64],
    graze: NDArray[np.float64],
    cell: NDArray[np.int64],
    before: NDArray[np.int32],
    own: NDArray[np.int64],
    corners: NDArray[np.float64],
    spacing: float,
    tree: FaceTree,
) -> tuple[NDArray, ...]:
    """
    Find where casting faces pass through patches, and the samples near almost coplanar faces.

    Parameters
    ----------
    frame, place, size, tau, graze, cell, before
        See ``Patches``.
    own : (n, 2) int64
        First triangle and end of each patch's surface.
    corners : (n_triangles, 9) float64
        Corners of these triangles.
    spacing : float
        [m]
    tree : FaceTree

    Returns
    -------
    cut_start, cuts, cut_face, mark_start, marks, mark_far
        See ``Patches``.
    """
    totals = (0, 0)
    for _ in range(2):  # they are counted, then written
        found = _Found(
            np.zeros(len(frame) + 1, np.int64), np.zeros((totals[0], 4)),
            np.zeros(totals[0], np.int32), np.zeros(len(frame) + 1, np.int64),
            np.zeros(totals[1], np.int64), np.zeros(totals[1]),
            np.zeros(DEEPEST, np.int32), np.zeros(len(tree.ids), np.int32),
            np.zeros((8, 3)), np.zeros((8, 3)),
        )  # fmt: skip
        totals = _find(
            frame, place, size, tau, graze, cell, before, own, corners, spacing, tree, found
        )
    start, cuts, face, mark_start, marks, far = found[:6]
    # Each sample once, with its nearest face; nearest first within a patch.
    n = _thin(mark_start, marks, far, np.full(marks.max(initial=0) + 1, np.inf))
    marks, far = marks[:n], far[:n]
    order = np.lexsort((marks, far, np.repeat(np.arange(len(frame)), np.diff(mark_start))))
    return start, cuts, face, mark_start, marks[order], far[order]


@kernel
def _thin(start, marks, far, nearest):
    """Keep each mark of a patch once, with its least distance; return the number of all."""
    n = 0
    end = start[0]
    for i in range(start.size - 1):
        first, end = end, start[i + 1]
        for q in range(first, end):
            nearest[marks[q]] = min(nearest[marks[q]], far[q])
        start[i] = n
        for q in range(first, end):
            k = marks[q]
            if nearest[k] < np.inf:
                marks[n], far[n] = k, nearest[k]
                nearest[k] = np.inf
                n += 1
    start[start.size - 1] = n
    return n


@inlined
def cut_patch_edge(ua, va, ha, ub, vb, hb, is_first):
    """Find where an edge passes through the plane, computed from its lower vertex."""
    if not is_first:
        ua, va, ha, ub, vb, hb = ub, vb, hb, ua, va, ha
    if hb == 0.0:
        return ub, vb
    if ha == 0.0:
        return ua, va
    t = ha / (ha - hb)
    return ua + t * (ub - ua), va + t * (vb - va)


@borrowing
def _is_own(c, corners, t0, t1):
    """Return whether a face belongs to the patch's own surface."""
    for t in range(t0, t1):
        same = 0
        for k in range(3):
            for m in range(3):
                if (
                    c[3 * k] == corners[t, 3 * m]
                    and c[3 * k + 1] == corners[t, 3 * m + 1]
                    and c[3 * k + 2] == corners[t, 3 * m + 2]
                ):
                    same += 1
                    break
        if same == 3:
            return True
    return False


@borrowing
def _clip(poly, n, sign, limit, out):
    """Clip a polygon of (u, v, h) to sign * h <= limit; return its number of corners."""
    m = 0
    for k in range(n):
        j = (k + 1) % n
        a = limit - sign * poly[k, 2]
        b = limit - sign * poly[j, 2]
        if a >= 0.0:
            for q in range(3):
                out[m, q] = poly[k, q]
            m += 1
        if (a >= 0.0) != (b >= 0.0):
            t = a / (a - b)
            for q in range(3):
                out[m, q] = poly[k, q] + t * (poly[j, q] - poly[k, q])
            m += 1
    return m


@borrowing
def _mark(poly, n, reach, spacing, size, before, marks, mark_far, total):
    """Mark the samples over a polygon or within reach [m]; return the new total."""
    beside = reach / spacing + 1e-6
    area = 0.0
    u0, u1, v0, v1 = np.inf, -np.inf, np.inf, -np.inf
    for q in range(n):
        r = (q + 1) % n
        area += poly[q, 0] * poly[r, 1] - poly[q, 1] * poly[r, 0]
        u0, u1 = min(u0, poly[q, 0]), max(u1, poly[q, 0])
        v0, v1 = min(v0, poly[q, 1]), max(v1, poly[q, 1])
    turn = 1.0 if area > 0.0 else -1.0
    # A face perpendicular to the plane has almost no area there: a line between two corners.
    one, two, length = 0, 0, 0.0
    for q in range(n):
        for j in range(q):
            eu, ev = poly[j, 0] - poly[q, 0], poly[j, 1] - poly[q, 1]
            if eu * eu + ev * ev > length:
                one, two, length = q, j, eu * eu + ev * ev
    is_line = abs(area) <= 1e-4 * np.sqrt(length) * beside
    eu, ev = poly[two, 0] - poly[one, 0], poly[two, 1] - poly[one, 1]
    cols, rows = size[0], size[1]
    c0 = np.int64(np.ceil(min(max(u0 - beside, 0.0), np.float64(cols))))
    c1 = np.int64(np.floor(max(min(u1 + beside, cols - 1.0), -1.0)))
    r0 = np.int64(np.ceil(min(max(v0 - beside, 0.0), np.float64(rows))))
    r1 = np.int64(np.floor(max(min(v1 + beside, rows - 1.0), -1.0)))
    for c in range(c0, c1 + 1):
        for r in range(r0, r1 + 1):
            at = c * rows + r
            if before[at + 1] == before[at]:
                continue
            if is_line:
                t = ((c - poly[one, 0]) * eu + (r - poly[one, 1]) * ev) / max(length, 1e-300)
                t = min(max(t, 0.0), 1.0)
                far = np.hypot(poly[one, 0] + t * eu - c, poly[one, 1] + t * ev - r)
            else:
                far = 0.0
                for q in range(n):
                    j = (q + 1) % n
                    du, dv = poly[j, 0] - poly[q, 0], poly[j, 1] - poly[q, 1]
                    side = np.sqrt(du * du + dv * dv)
                    if side > 1e-6:
                        out = turn * (du * (r - poly[q, 1]) - dv * (c - poly[q, 0]))
                        far = max(far, -out / side)
            far = max(0.0, far * spacing - 1e-6)
            if far <= reach:
                if marks.size:
                    marks[total] = before[at]
                    mark_far[total] = far
                total += 1
    return total


@borrowing
def _list_near(p, w, top, f, t, reach, tree, work):
    """List the faces near a patch, its place ``p`` and frame ``f``; return their number."""
    n = 0
    margin = _CLEAR + 2.0 * t + reach
    work.stack[0] = 0
    waiting = 1
    while waiting > 0:
        waiting -= 1
        node = work.stack[waiting]
        for lane in range(LANES):
            meets = True
            middle, half = f[11], margin
            for k in range(3):
                a, b = tree.boxes[node, k, lane], tree.boxes[node, 3 + k, lane]
                low = p[k] + min(p[3 + k] * w, 0.0) + min(p[6 + k] * top, 0.0) - margin
                high = p[k] + max(p[3 + k] * w, 0.0) + max(p[6 + k] * top, 0.0) + margin
                meets = meets and a <= high and b >= low
                middle += 0.5 * f[8 + k] * (b + a)
                half += 0.5 * abs(f[8 + k]) * (b - a)
            if not meets or abs(middle) > half:
                continue
            child = tree.links[node, lane]
            if child >= 0:
                work.stack[waiting] = child
                waiting += 1
            else:
                work.near[n] = ~child
                n += 1
    return n


@kernel
def _find(
    frame, place, size, tau, graze, cell, before, own, own_corners, spacing, tree, found
):  # fmt: skip
    """Count the cuts and marks of all patches, and write them if there is room for any."""
    corners, ids, normals = tree.corners, tree.ids, tree.normals
    start, mark_start, poly = found.start, found.mark_start, found.polygon
    total, total_marks = 0, 0
    for i in range(frame.shape[0]):
        start[i], mark_start[i] = total, total_marks
        if graze[i] == np.inf:
            continue
        f, t = frame[i], tau[i]
        w, top = size[i, 0] - 1.0, size[i, 1] - 1.0
        reach = 2.0 * t / graze[i]  # error of a shadow's rim beside a face
        for q in range(_list_near(place[i], w, top, f, t, reach, tree, found)):
            g = found.near[q]
            above = 0
            within = t < 1.5e-6  # samples of a thick patch lie off its plane
            for k in range(3):
                x, y, z = corners[g, 3 * k], corners[g, 3 * k + 1], corners[g, 3 * k + 2]
                for j in range(3):
                    poly[k, j] = f[4 * j] * x + f[4 * j + 1] * y + f[4 * j + 2] * z + f[4 * j + 3]
                above += poly[k, 2] > t
                within = within and abs(poly[k, 2]) <= 0.25 * normals[g, 3]
            if 0 < above < 3:
                u0 = v0 = u1 = v1 = 0.0
                for k in range(3):
                    j = (k + 1) % 3
                    h = 0.0 if abs(poly[k, 2]) <= t else poly[k, 2]
                    next_h = 0.0 if abs(poly[j, 2]) <= t else poly[j, 2]
                    if (h > 0.0) == (next_h > 0.0):
                        continue
                    cu, cv = cut_patch_edge(
                        poly[k, 0], poly[k, 1], h, poly[j, 0], poly[j, 1], next_h,
                        ids[g, k] < ids[g, j],
                    )  # fmt: skip
                    if h > 0.0:
                        u0, v0 = cu, cv  # the face's boundary goes below here
                    else:
                        u1, v1 = cu, cv
                far = _CLEAR + reach / spacing
                if not (
                    (u0 == u1 and v0 == v1)
                    or max(u0, u1) < -far or min(u0, u1) > w + far
                    or max(v0, v1) < -far or min(v0, v1) > top + far
                ):  # fmt: skip
                    if found.face.size:
                        cut = found.cuts[total]
                        cut[0], cut[1], cut[2], cut[3] = u0, v0, u1, v1
                        found.face[total] = g
                    total += 1
            if within:
                continue
            m = _clip(poly, 3, 1.0, 2.0 * t, found.part)
            m = _clip(found.part, m, -1.0, 2.0 * t, poly) if m else 0
            # Flat, too: a face of the surface itself that no such sun can light from behind.
            slope = abs(f[8] * normals[g, 0] + f[9] * normals[g, 1] + f[10] * normals[g, 2])
            is_flat = slope > 1.0 - graze[i] * graze[i] / 7.9
            if m and not (is_flat and _is_own(corners[g], own_corners, own[i, 0], own[i, 1])):
                total_marks = _mark(
                    poly, m, reach, spacing, size[i], before[cell[i] : cell[i + 1]],
                    found.marks, found.far, total_marks,
                )  # fmt: skip
    start[-1], mark_start[-1] = total, total_marks
    return total, total_marks
