"""
The windows of a model: elements of IFC, and surfaces of CityJSON, CityGML and Honeybee.

An element has a thickness: its pane lies across its thinnest side, of glass where its material is
transparent. Outside is the side from which more of the sky and the land is seen; a window that sees
nothing on either side is within the building.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import Casting
from umbra.rays.hidden import find_hidden
from umbra.receivers.samples import join_coplanar
from umbra.scene import Part, Scene
from umbra.scene.named_places import Window
from umbra.volume.adjacency import weld_vertices

__all__ = ["ELEMENTS", "SURFACES", "count_windows", "find_model_windows"]

ELEMENTS = frozenset({"IfcWindow", "IfcWindowStandardCase"})
"""Kinds of parts that are windows with a thickness."""
SURFACES = frozenset({"Window", "WindowSurface", "Aperture"})
"""Kinds of parts whose surfaces are windows."""
_GLAZED = {"IfcCurtainWall": "curtain walls", "IfcDoor": "doors", "IfcPlate": "plates"}
"""Kinds of parts of which some have glass that is no window, and what several are called."""
_FRONT = 0.05  # distance before and behind a pane from which the side is judged [m]
_FLAT = 1e-3  # distance from their plane of triangles that make one pane [m]
_PARALLEL = 0.999
_DIRECTIONS = 8  # of an element's largest faces
_LEAST_SHARE = 0.1  # of the largest area of a direction: less is an edge or a handle
_DEEPEST = 0.6  # reveal [m]
_AROUND = 0.3  # distance from a pane within which the wall around it lies [m]
_MOST = 1e9  # panes times faces of which reveals are measured


def count_windows(scene: Scene) -> int:
    """Return the number of windows that a model has, those within it included."""
    return len(list_panes(scene))


def find_model_windows(scene: Scene, casting: Casting) -> tuple[list[Window], list[str]]:
    """
    Find the windows of a model.

    Parameters
    ----------
    scene : Scene
    casting : Casting

    Returns
    -------
    windows : list of Window
    notes : list of str
        What was left out.
    """
    panes, notes = list_panes(scene), _note_glazed(scene)
    if not panes:
        return [], notes
    centers, normals = (
        np.array([getattr(pane, k) for pane in panes]) for k in ("center", "normal")
    )
    thick = np.array([pane.reveal or 0.0 for pane in panes])
    front = _count_free(casting, centers + _FRONT * normals, normals)
    back = _count_free(casting, centers - (thick + _FRONT)[:, None] * normals, -normals)
    is_turned, is_inside = back > front, np.maximum(front, back) == 0
    windows = []
    for k in np.flatnonzero(~is_inside).tolist():
        pane, sign = panes[k], -1.0 if is_turned[k] else 1.0
        middle = pane.center - (thick[k] * pane.normal if is_turned[k] else 0.0)
        windows.append(
            Window(
                pane.name, middle + scene.origin, sign * pane.normal, pane.width, pane.height,
                storey=pane.storey, room=pane.room, is_of_model=True,
            )
        )  # fmt: skip
    if is_inside.any():
        first = panes[int(np.flatnonzero(is_inside)[0])].name
        notes.append(
            f"windows within the building, which see nothing outside, left out: "
            f"{int(is_inside.sum())} (first: '{first}')"
        )
    return _measure_reveals(windows, scene), notes


def _note_glazed(scene: Scene) -> list[str]:
    """Name the elements with glass, whole façades among them, that the model calls no windows."""
    labels = scene.labels()
    found: dict[str, dict[str, None]] = {}
    for k, part in enumerate(scene.parts):
        is_glass = part.kind in _GLAZED and part.material.opacity < 1
        if is_glass and not _find_tagged(part):
            found.setdefault(part.kind, {})[labels[k]] = None
    if not found:
        return []
    counts = ", ".join(f"{_GLAZED[kind]} {len(names)}" for kind, names in sorted(found.items()))
    first = next(iter(found[min(found)]))
    note = f"glass outside windows is not judged: {counts} (first: '{first}'); give its panes in"
    return [f"{note} a table (windows=)"]


def list_panes(scene: Scene) -> list[Window]:
    """
    List the panes of a model's windows in its local frame, either side outward.

    The ``reveal`` of each is the thickness of its element.
    """
    labels, panes = scene.labels(), []
    objects: dict[str, list[int]] = {}
    for k, part in enumerate(scene.parts):
        if part.kind in ELEMENTS or _find_tagged(part):
            objects.setdefault(labels[k], []).append(k)
    for name, parts in objects.items():
        pane = _measure_element(scene, name, parts)
        if pane is not None:
            panes.append(pane)
    for k, part in enumerate(scene.parts):
        if part.kind in SURFACES and part.triangles:
            panes += _measure_surfaces(scene, labels[k], k)
    return panes


def _find_tagged(part: Part) -> bool:
    """Return whether a part is a window of an assembly, whose kind it has."""
    return part.kind.startswith("Ifc") and not ELEMENTS.isdisjoint(part.tags)


def _find_word(parts: Sequence[Part], key: str) -> str:
    """Return what the tags of parts say of a key: of ``storey=EG`` ``EG``."""
    for part in parts:
        for tag in part.tags:
            if tag.startswith(f"{key}="):
                return tag.partition("=")[2]
    return ""


def _measure_element(scene: Scene, name: str, parts: Sequence[int]) -> Window | None:
    """Measure the pane of an element, of its glass where some is transparent."""
    soup = scene.triangles(parts)
    corners = soup.vertices[soup.faces]
    glass = [k for k in parts if scene.parts[k].material.opacity < 1]
    seen = corners[np.isin(soup.part, glass)] if glass else corners
    normal = _find_thinnest(seen)
    if normal is None:
        return None
    own = [scene.parts[k] for k in parts]
    words = _find_word(own, "storey"), _find_word(own, "space")
    return _frame(name, seen.reshape(-1, 3), normal, *words, corners)


def _find_thinnest(corners: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """
    Return the normal of faces (n, 3, 3) across which a body is thinnest, (3,) of length 1.

    Of small windows the sides of a deep frame, across the width, have more area than the pane.
    """
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    unit = across / np.where(area > 0, area, 1.0)[:, None]
    found: list[tuple[float, float, NDArray[np.float64]]] = []
    left = area.copy()
    while len(found) < _DIRECTIONS and left.any():
        normal = unit[int(left.argmax())]
        alike = np.abs(unit @ normal) > _PARALLEL
        left[alike] = 0.0
        thickness = float(np.ptp(corners.reshape(-1, 3) @ normal))
        found.append((float(area[alike].sum()), thickness, normal))
    least = _LEAST_SHARE * max((share for share, *_ in found), default=0.0)
    found = [one for one in found if one[0] >= least]
    return min(found, key=lambda one: one[1])[2] if found else None


def _measure_surfaces(scene: Scene, name: str, part: int) -> list[Window]:
    """Measure the panes of a part whose coplanar connected triangles are windows."""
    soup = scene.triangles([part])
    corners = soup.vertices[soup.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    unit = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    owner, _ = join_coplanar(weld_vertices(soup.vertices)[soup.faces], unit, soup.part)
    rooms = scene.parts[part].name if scene.parts[part].kind == "Aperture" else ""
    panes = []
    for k in range(int(owner.max(initial=-1)) + 1):
        own = corners[owner == k]
        whole = across[owner == k].sum(0)
        area = np.linalg.norm(whole)
        if area > 0:
            panes.append((own.reshape(-1, 3), whole / area))
    word = _find_word([scene.parts[part]], "storey")
    return [
        _frame(f"{name} window {n}" if len(panes) > 1 else name, points, normal, word, rooms)
        for n, (points, normal) in enumerate(panes, 1)
    ]


def _frame(
    name: str,
    points: NDArray[np.float64],
    normal: NDArray[np.float64],
    storey: str,
    room: str,
    body: NDArray[np.float64] | None = None,
) -> Window:
    """
    Return the smallest upright frame around points across a normal.

    Its outer face is that of the body (m, 3, 3) before its middle: glass may lie within a frame.
    """
    flat = Window(name, points[0], normal, 1.0, 1.0)
    right, up = flat.axes
    axes = np.stack([right, up, normal])
    low, high = (f(points @ axes.T, axis=0) for f in (np.min, np.max))
    middle = (low[:2] + high[:2]) / 2
    back, front = (low[2], high[2]) if body is None else _pierce(body @ axes.T, middle, low, high)
    return Window(
        name, np.append(middle, front) @ axes, normal, float(high[0] - low[0]),
        float(high[1] - low[1]), reveal=float(front - back), storey=storey, room=room,
    )  # fmt: skip


def _pierce(
    body: NDArray[np.float64],
    at: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[float, float]:
    """Return where a line along the third axis enters and leaves triangles (m, 3, 3)."""
    a, b, c = (body[:, k, :2] - at for k in range(3))
    parts = np.stack([p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((b, c), (c, a), (a, b))])
    whole = parts.sum(0)
    met = (whole != 0) & ((parts >= 0).all(0) | (parts <= 0).all(0))
    if not met.any():
        return float(low[2]), float(high[2])
    depth = (parts[:, met].T * body[met, :, 2]).sum(1) / whole[met]
    return min(float(depth.min()), float(low[2])), max(float(depth.max()), float(high[2]))


def _count_free(
    casting: Casting, points: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Count the ways from each place, upward and level, on which there is nothing."""
    turn = np.arange(16) * (2.0 * np.pi / 16) + 0.1
    ways = [
        np.stack([np.cos(turn) * np.cos(a), np.sin(turn) * np.cos(a), np.full(16, np.sin(a))], 1)
        for a in np.radians([2.0, 20.0, 45.0, 70.0])
    ]
    hidden = find_hidden(casting.tree, points, normals, np.concatenate(ways), casting.threads)
    return np.asarray((hidden == 0).sum(0))


def _measure_reveals(windows: Sequence[Window], scene: Scene) -> list[Window]:
    """Measure how deep panes lie behind the faces around them that look their way."""
    own = [k for k, p in enumerate(scene.parts) if p.kind not in SURFACES | ELEMENTS]
    soup = scene.triangles(own)
    if not len(soup.faces) or len(windows) * len(soup.faces) > _MOST:
        return list(windows)
    corners = soup.vertices[soup.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    unit = across / np.where(area > 0, area, 1.0)[:, None]
    measured = []
    for window in windows:
        right, up = window.axes
        facing = np.flatnonzero(unit @ window.normal > _PARALLEL)
        local = (corners[facing] + scene.origin - window.center) @ np.stack(
            [right, up, window.normal], 1
        )
        low, high = local.min(1), local.max(1)
        reach = np.array([window.width / 2 + _AROUND, window.height / 2 + _AROUND])
        is_near = ((low[:, :2] < reach) & (high[:, :2] > -reach)).all(1)
        is_near &= (high[:, 2] > _FLAT) & (high[:, 2] <= _DEEPEST)
        # The wall is the largest of them: not the front of a sill, or of a verge.
        depths, which = np.unique(np.round(high[is_near, 2], 3), return_inverse=True)
        sizes = np.bincount(which.ravel(), area[facing][is_near], len(depths))
        reveal = float(depths[np.argmax(sizes)]) if len(depths) else 0.0
        measured.append(replace(window, reveal=reveal))
    return measured
