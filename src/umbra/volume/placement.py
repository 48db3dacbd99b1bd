"""
The faces of a shadow volume that a renderer must draw: McGuire's three cases.

1. No caster stands between the near rectangle and the light, so the viewport is lit:
   sides alone, counted before the visible surface (z-pass).
2. The viewport may be shadowed, but the light cap is out of view: sides and dark cap,
   counted behind the visible surface (z-fail).
3. The light cap is in view: light cap, sides and dark cap, z-fail.

Case 1 is exact: z-pass is right for every pixel if and only if no casting triangle meets the
occlusion pyramid, the hull of near rectangle and light (docs/papers.md, M6). It holds for volumes
that are clipped at the near plane: draw z-pass without depth clamping. Bounds decide most casters,
all at once; triangles decide the rest, by Sutherland and Hodgman's clipping (1974) of their
corners' distances from planes.

Sources: McGuire et al. 2003, section 5.2 and figure 2; docs/papers.md, M3, M5 and M6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.kernels import inlined, kernel
from umbra.scene.camera import Camera
from umbra.volume.adjacency import Caster
from umbra.volume.regions import Regions, make_regions

__all__ = [
    "CastingFaces",
    "Placement",
    "Placements",
    "any_meets",
    "ask_faces",
    "dark_cap_is_fan",
    "find_placement",
    "find_placements",
    "place_box",
]


@dataclass(frozen=True)
class Placement:
    """Drawing case of one caster's shadow volume for one light."""

    case: int  # 1, 2 or 3
    reason: str  # explanation of the case
    needs_light_cap: bool  # whether the light cap is counted and in view
    needs_dark_cap: bool  # whether the dark cap is; a directional light has none
    dark_cap_is_fan: bool  # whether the dark cap is a fan over the silhouette, else extruded


@dataclass(frozen=True, eq=False)
class Placements:
    """
    Drawing cases of many casters' shadow volumes, decided by their bounds, (n,) each.

    Every case is correct; where ``undecided``, a test of triangles may find less to draw. Other
    fields as in ``Placement``.
    """

    case: NDArray[np.int8]
    undecided: NDArray[np.bool_]
    needs_light_cap: NDArray[np.bool_]
    needs_dark_cap: NDArray[np.bool_]
    dark_cap_is_fan: NDArray[np.bool_]


def dark_cap_is_fan(bounds: NDArray[np.float64], light: ArrayLike) -> NDArray[np.bool_]:
    """
    Return whether casters' (..., 2, 3) dark caps may be fans over the silhouette, (...).

    A fan around an enclosed light (4,) can close the wrong way and shift every z-fail count
    (docs/papers.md, M3): only a light outside the bounds is safe. A directional light has no dark
    cap.
    """
    boxes = np.asarray(bounds, np.float64)
    is_fan = np.ones(boxes.shape[:-2], np.bool_)
    for index in np.ndindex(is_fan.shape):
        is_fan[index] = _is_fan(boxes[index], np.asarray(light, np.float64))
    return is_fan


def find_placements(
    bounds: NDArray[np.float64],
    regions: Regions,
    *,
    is_drawn: NDArray[np.bool_] | bool = True,
) -> Placements:
    """
    Find the cases of many casters by their bounds (n, 2, 3), in the frame of the regions [m].

    Where ``is_drawn`` is False, a caster is not in the depth buffer: its light cap, if in view, is
    counted in case 1, too.
    """
    n = len(bounds)
    case, flags = np.zeros(n, np.int8), np.zeros((4, n), np.bool_)
    drawn = np.broadcast_to(np.asarray(is_drawn, np.bool_), n)
    bounds = np.asarray(bounds, np.float64)
    _place(bounds, regions.pyramid, regions.view, regions.light, drawn, case, flags)
    return Placements(case, *flags)


@kernel
def _sort_box(planes, box):
    """Return whether a box lies wholly beyond a plane, and whether it lies within all."""
    beyond, within = False, True
    for k in range(planes.shape[0]):
        lowest = highest = planes[k, 3]
        for axis in range(3):
            a, b = planes[k, axis] * box[0, axis], planes[k, axis] * box[1, axis]
            lowest += min(a, b)
            highest += max(a, b)
        beyond |= highest < 0.0
        within &= lowest >= 0.0
    return beyond, within


@kernel
def _is_thrown_beyond(planes, box, light):
    """Return whether the far end of a box's volume, at infinity, lies wholly beyond a plane."""
    for k in range(planes.shape[0]):
        highest = 0.0
        for axis in range(3):
            a, b = planes[k, axis] * box[0, axis], planes[k, axis] * box[1, axis]
            highest += light[3] * max(a, b) - planes[k, axis] * light[axis]
        if highest <= 0.0:
            return True
    return False


@kernel
def _is_fan(box, light):
    """Return ``dark_cap_is_fan`` of one box."""
    margin = 0.0
    for axis in range(3):
        margin = max(margin, 1e-6 * (box[1, axis] - box[0, axis]))  # as for the cap itself
    for axis in range(3):
        coordinate = light[axis] / light[3] if light[3] != 0.0 else np.inf
        if not (box[0, axis] - margin < coordinate < box[1, axis] + margin):
            return True
    return False


@kernel
def place_box(box, pyramid, view, light, is_drawn):
    """Return the case of one box (2, 3) and the other four fields of ``Placements``."""
    beyond, within = _sort_box(pyramid, box)
    unseen, seen_whole = _sort_box(view, box)
    is_fan = _is_fan(box, light)
    case = 1 if beyond else 2 if unseen else 3
    is_undecided = not beyond and not (within and (seen_whole or unseen))
    light_cap = not unseen and not (beyond and is_drawn)
    dark_cap = False
    if not beyond and light[3] != 0.0:
        dark_cap = not is_fan or not _is_thrown_beyond(view, box, light)
    return case, is_undecided, light_cap, dark_cap, is_fan


@kernel
def _place(bounds, pyramid, view, light, is_drawn, case, flags):
    """Write cases, and the other four fields of ``Placements``, into rows of ``flags``."""
    for i in range(bounds.shape[0]):
        case[i], flags[0, i], flags[1, i], flags[2, i], flags[3, i] = place_box(
            bounds[i], pyramid, view, light, is_drawn[i]
        )


def find_placement(
    caster: Caster | tuple[NDArray[np.float64], NDArray[np.int32]],
    camera: Camera | None = None,
    light: ArrayLike | None = None,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    *,
    regions: Regions | None = None,
    transform: NDArray[np.float64] | None = None,
    bounds: NDArray[np.float64] | None = None,
    is_drawn: bool = True,
) -> Placement:
    """
    Find the case of one caster by its bounds or, if undecided, by its triangles.

    Parameters
    ----------
    caster : Caster, or vertices (n, 3) and faces (m, 3)
        Of bare triangles all cast.
    camera, light, origin
        The light (4,) is relative to the origin (3,) [m]. Not needed with ``regions``.
    regions : Regions, optional
        Regions of camera and light, to reuse them.
    transform : (4, 4) float64, optional
        Affine, from the caster's frame to the regions'.
    bounds : (2, 3) float64, optional
        Bounds of the caster in its own frame; by default of all its vertices [m].
    is_drawn : bool
        Whether the caster is in the depth buffer; if not, case 1 needs the light cap if it is in
        view.
    """
    if regions is None:
        if camera is None or light is None:
            msg = "a placement needs a camera and a light, or their regions"
            raise TypeError(msg)
        regions = make_regions(camera, light, origin)
    if transform is not None:
        regions = regions.within(np.asarray(transform, np.float64))
    vertices, faces = (caster.vertices, caster.faces) if isinstance(caster, Caster) else caster
    if not len(faces):
        return Placement(1, "it has no triangles", False, False, True)
    if 3 * len(faces) < len(vertices):  # a few faces of a larger mesh
        vertices, faces = (
            vertices[faces.ravel()],
            np.arange(faces.size, dtype=np.int32).reshape(-1, 3),
        )
    if bounds is None:
        bounds = _find_bounds(vertices)

    rough = find_placements(bounds[None], regions, is_drawn=is_drawn)
    is_fan = bool(rough.dark_cap_is_fan[0])
    if rough.case[0] == 1 and not rough.needs_light_cap[0]:
        return Placement(1, "its bounds do not meet the occlusion pyramid", False, False, is_fan)
    casts = CastingFaces(caster if isinstance(caster, Caster) else None, regions.light)
    blocks = rough.case[0] != 1 and any_meets(vertices, faces, regions.pyramid, casts)
    light_cap = bool(rough.needs_light_cap[0]) and any_meets(vertices, faces, regions.view, casts)
    if not blocks:
        reason = "no casting triangle meets the occlusion pyramid"
        return Placement(1, reason, light_cap and not is_drawn, False, is_fan)
    dark_cap = bool(rough.needs_dark_cap[0]) and any_meets(
        vertices, faces, regions.view, casts, away=regions.light
    )
    if light_cap:
        reason = "a casting triangle meets the occlusion pyramid, and one is in view"
        return Placement(3, reason, True, dark_cap, is_fan)
    reason = "a casting triangle meets the occlusion pyramid, but none is in view"
    return Placement(2, reason, False, dark_cap, is_fan)


def _find_bounds(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lowest and the highest corner, (2, 3) float64."""
    # NumPy reduces long rows many times faster than rows of three.
    whole = len(vertices) // 64 * 64
    rows, rest = vertices[:whole].reshape(-1, 192), vertices[whole:]
    if whole:
        rest = np.concatenate([rest, rows.min(0).reshape(64, 3), rows.max(0).reshape(64, 3)])
    return np.stack([rest.min(0), rest.max(0)])


@dataclass(frozen=True, eq=False)
class CastingFaces:
    """Data to decide which faces cast: lit faces, or all but edge-on ones in open components."""

    caster: Caster | None
    light: NDArray[np.float64]

    def list_facts(self) -> tuple[NDArray, NDArray, NDArray]:
        """Return planes, components and their closedness; empty if all faces cast."""
        if self.caster is None:
            return np.zeros((4, 0)), np.zeros(0, np.int32), np.zeros(0, np.bool_)
        return self.caster.planes, self.caster.component, self.caster.is_closed


def any_meets(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    planes: NDArray[np.float64],
    casting: CastingFaces,
    away: NDArray[np.float64] | None = None,
) -> bool:
    """
    Return whether any casting triangle, or its extrusion to infinity, meets a region.

    Triangles beyond one of the ``planes`` (k, 4), inward and in the frame of the vertices, are
    skipped; the rest is clipped. With ``away``, a homogeneous light, the triangles' extrusion to
    infinity is tested instead.
    """
    thrown = np.zeros(4) if away is None else away
    facts = casting.list_facts()
    planes = np.ascontiguousarray(planes)
    return bool(_any_meets(vertices, faces, planes, *facts, casting.light, thrown))


@kernel
def _any_meets(vertices, faces, planes, sides, component, is_closed, light, away):
    """Kernel of ``any_meets``; ``away`` of zeros tests the triangles themselves."""
    slack = np.zeros(planes.shape[0])
    if _is_given(away):  # directions have no length: widen by an angle instead
        for k in range(planes.shape[0]):
            slack[k] = 1e-9 * np.sqrt(planes[k, 0] ** 2 + planes[k, 1] ** 2 + planes[k, 2] ** 2)
    room = 3 + planes.shape[0]
    values, clipped = np.zeros((room, planes.shape[0])), np.zeros((room, planes.shape[0]))
    for face in range(faces.shape[0]):
        if not _measure(vertices, faces[face], planes, away, slack, values):
            continue
        if sides.shape[1] and not _casts(sides, face, light, is_closed[component[face]]):
            continue
        if _survives(values, clipped):
            return True
    return False


@kernel
def ask_faces(vertices, faces, chosen, sides, component, is_closed, light, pyramid, view):
    """
    Return whether any casting face of ``chosen`` (n,) meets the pyramid, and whether any the view.

    Parameters are those of a caster, and of ``Regions`` in its frame; ``is_closed`` is of one
    instance.
    """
    away, slack = np.zeros(4), np.zeros(pyramid.shape[0] + view.shape[0])
    room = 3 + slack.size
    values, clipped = np.zeros((2, room, pyramid.shape[0]))
    shown, cut = np.zeros((2, room, view.shape[0]))
    blocks = is_seen = False
    for i in range(chosen.size):
        face = chosen[i]
        if not _casts(sides, face, light, is_closed[component[face]]):
            continue
        if not blocks and _measure(vertices, faces[face], pyramid, away, slack, values):
            blocks = _survives(values, clipped)
        if not is_seen and _measure(vertices, faces[face], view, away, slack, shown):
            is_seen = _survives(shown, cut)
        if blocks and is_seen:
            break
    return blocks, is_seen


@kernel
def _casts(sides, face, light, is_closed):
    """Return whether a face casts: lit, or unlit in an open component."""
    side = sides[0, face] * light[0] + sides[1, face] * light[1]
    side += sides[2, face] * light[2]
    side += sides[3, face] * light[3]
    return side > 0.0 or (side < 0.0 and not is_closed)


@inlined
def _is_given(light):
    return light[0] != 0.0 or light[1] != 0.0 or light[2] != 0.0 or light[3] != 0.0


@kernel
def _measure(vertices, corners, planes, away, slack, values):
    """Write a face's distances from planes (3, k); return whether it is beyond none of them."""
    is_thrown = _is_given(away)
    for k in range(planes.shape[0]):
        beyond = True
        for corner in range(3):
            point = vertices[corners[corner]]
            if is_thrown:
                x = away[3] * point[0] - away[0]
                y = away[3] * point[1] - away[1]
                z = away[3] * point[2] - away[2]
                value = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z
                value += slack[k] * np.sqrt(x * x + y * y + z * z)
            else:
                value = planes[k, 0] * point[0] + planes[k, 1] * point[1]
                value += planes[k, 2] * point[2] + planes[k, 3]
            values[corner, k] = value
            beyond &= value < 0.0
        if beyond:
            return False
    return True


@kernel
def _survives(values, clipped):
    """
    Clip a triangle, given as its corners' distances from planes; return whether any is left.

    Distances are linear along an edge, so the clipper needs no coordinates. Both arrays (3 + k, k)
    are overwritten.
    """
    n_planes, n = values.shape[1], 3
    for plane in range(n_planes):
        m = 0
        for here in range(n):
            ahead = here + 1 if here + 1 < n else 0
            start, end = values[here, plane], values[ahead, plane]
            if start >= 0.0:
                for k in range(n_planes):
                    clipped[m, k] = values[here, k]
                m += 1
            if (start >= 0.0) != (end >= 0.0):
                along = start / (start - end)
                for k in range(n_planes):
                    clipped[m, k] = values[here, k] + along * (values[ahead, k] - values[here, k])
                clipped[m, plane] = 0.0
                m += 1
        if m == 0:
            return False
        n = m
        for here in range(n):
            for k in range(n_planes):
                values[here, k] = clipped[here, k]
    return True
