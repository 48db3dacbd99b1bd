"""
Shadow counts judged by rays: each count that differs is tried and told apart.

right    the count is the number of pierced triangles, and is 0 exactly where
         nothing at all is pierced
edge     it differs, within ``EDGE`` of a place where the true count changes
rim      it differs, within ``EDGE`` of where the viewer's line grazes a triangle's edge
contact  it differs, but another triangle touches the point within rounding
grazing  it differs, on a surface that the light sees edge-on: attached shadow anyway
nudged   it differs, but is right for a lamp as near to this one as float64 can tell: near
         an edge of the mesh, that turns the edge's shadow
wrong    anything else; tests let none pass
"""

from dataclasses import dataclass, field

import numpy as np

from support.raycaster import RayCaster
from umbra.cpu.frame import FrameCounter
from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.rays.depth import NOTHING, rasterise_depth
from umbra.scene import make_scene
from umbra.volume.adjacency import make_caster

EDGE = 1e-6
"""[m], in the receiver's plane."""

GRAZING = 1e-9
"""Sine of the angle between a surface and the light, below which it is seen edge-on."""

NUDGE = 2.0**-47
"""Of the largest coordinate: what sums and products of float64 lose of it."""

ZENITH = np.array([0.0, 0.0, 1.0, 0.0])
UP = np.array([0.0, 0.0, 1.0])

PLAN = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]], np.float64)
"""Straight down, x and y already in cells; the key is z."""


@dataclass(eq=False)
class Verdicts:
    """How many counts were right, and which were not."""

    right: int = 0
    edge: int = 0
    rim: int = 0
    contact: int = 0
    grazing: int = 0
    nudged: int = 0
    wrong: list[str] = field(default_factory=list)
    deepest: int = 0

    def __add__(self, other):
        return Verdicts(
            self.right + other.right,
            self.edge + other.edge,
            self.rim + other.rim,
            self.contact + other.contact,
            self.grazing + other.grazing,
            self.nudged + other.nudged,
            self.wrong + other.wrong,
            max(self.deepest, other.deepest),
        )

    def check(self, most_on_edges=0.002):
        """Fail if any count is wrong, or if suspiciously many lie on edges."""
        excused = self.edge + self.rim + self.contact + self.grazing + self.nudged
        judged = self.right + excused + len(self.wrong)
        assert not self.wrong, f"{len(self.wrong)} of {judged} counts are wrong: " + "\n".join(
            self.wrong[:5]
        )
        assert judged > 0
        assert self.edge + self.contact + self.nudged <= most_on_edges * judged + 1, self
        assert self.rim <= 0.1 * most_on_edges * judged + 2, self
        return self


@dataclass(frozen=True, eq=False)
class Seen:
    """
    Places whose shadow is asked.

    Parameters
    ----------
    points, normals : (n, 3) float64
    own : (n,) int
        Face of the soup that each point lies on; negative for none.
    eye : (4,) float64
    """

    points: np.ndarray
    normals: np.ndarray
    own: np.ndarray
    eye: np.ndarray

    def __getitem__(self, which):
        return Seen(self.points[which], self.normals[which], self.own[which], self.eye)


def judge(caster, seen, light, is_closed, counts, edge=EDGE, grazing=GRAZING):
    """
    Compare counts with rays.

    Parameters
    ----------
    caster : RayCaster
    seen : Seen
    light : (4,) float64
    is_closed : (n_faces,) bool
    counts : (n,) int
    edge : float or (n,) float
        Within how much of an edge or a rim a count may differ [m].
    grazing : float
    """
    edge = np.broadcast_to(edge, len(seen.points))
    light = np.asarray(light, np.float64)
    counts = np.asarray(counts).ravel()
    pierced = caster.count(seen.points, seen.own, seen.eye, light, is_closed)
    right = (counts == pierced.count) & ((counts > 0) == pierced.any)
    verdicts = Verdicts(right=int(right.sum()), deepest=int(pierced.count.max(initial=0)))
    wrong = np.flatnonzero(~right)
    if not len(wrong):
        return verdicts
    is_few = len(wrong) <= 0.05 * len(right) + 20  # nothing else is worth the time
    apart = caster.distance_to_shadow_edges(
        seen.points[wrong], seen.normals[wrong], seen.own[wrong], light, is_closed
    )
    # Seen from the viewer instead of the light, with every edge of the mesh that it can have.
    rim = caster.distance_to_shadow_edges(
        seen.points[wrong],
        seen.normals[wrong],
        seen.own[wrong],
        seen.eye,
        np.zeros(len(caster.faces), bool),
    )
    for i, distance, aside in zip(wrong, apart, rim):
        way = light[:3] - light[3] * seen.points[i]
        if abs(way @ seen.normals[i]) <= grazing * np.linalg.norm(way):
            verdicts.grazing += 1
        elif distance <= edge[i]:
            verdicts.edge += 1
        elif aside <= edge[i]:
            verdicts.rim += 1
        elif pierced.touching[i]:
            verdicts.contact += 1
        elif is_few and is_nudged(caster, seen[i : i + 1], light, is_closed, counts[i]):
            verdicts.nudged += 1
        else:
            verdicts.wrong.append(
                f"point {i} at {seen.points[i].tolist()} on face {seen.own[i]}, light "
                f"{light.tolist()}: counted {counts[i]}, pierced {pierced.count[i]} by the rule, "
                f"{'some' if pierced.any[i] else 'none'} at all, {distance:.2g} m from an edge"
            )
    return verdicts


def is_nudged(caster, seen, light, is_closed, count, tries=40):
    """Tell whether a count is right for some lamp that float64 can hardly tell from this one."""
    if light[3] == 0.0:
        return False
    rng = np.random.default_rng(0)
    size = max(np.abs(places).max() for places in (light[:3], caster.vertices, seen.points))
    size += caster.origin
    for _ in range(tries):
        beside = np.append(light[:3] + NUDGE * size * rng.uniform(-1, 1, 3), light[3])
        pierced = caster.count(seen.points, seen.own, seen.eye, beside, is_closed)
        if pierced.count[0] == count and pierced.any[0] == (count > 0):
            return True
    return False


def closed_faces(caster, n_faces):
    """Give for each face of the soup whether it follows the closed rule."""
    is_closed = np.zeros(n_faces, bool)
    is_closed[caster.source] = caster.face_is_closed
    return is_closed


def directions(suns):
    """Give suns (n, 3) as unit directions."""
    suns = np.asarray(suns, np.float64).reshape(-1, 3)
    return suns / np.linalg.norm(suns, axis=1, keepdims=True)


def look_down(mesh, grid, ground=None, threads=1):
    """
    Find the topmost surface of a plan.

    Returns
    -------
    heights : (rows, cols) float64
    own : (rows, cols) int
    """
    # Cells of vertices exactly as the sweeps have them, else a wall in line with the cells'
    # centres would be on one side of them here and on the other there.
    view = rasterise_depth(
        grid.to_cells(mesh[0]), mesh[1], PLAN, (grid.cols, grid.rows), threads=threads
    )
    if ground is None:
        return view.key, view.face
    return np.maximum(view.key, ground), np.where(view.key > ground, view.face, NOTHING)


def on_plane(grid, height):
    """Give the cells' centres on a plane, seen from above."""
    x, y = np.meshgrid(grid.x, grid.y)
    points = np.stack([x, y, np.full(x.shape, height)], -1).reshape(-1, 3)
    n = len(points)
    return Seen(points, np.broadcast_to(UP, (n, 3)), np.full(n, NOTHING), ZENITH)


def on_field(mesh, grid, heights, own):
    """Give the cells' centres on the topmost surface."""
    x, y = np.meshgrid(grid.x, grid.y)
    points = np.stack([x, y, heights], -1).reshape(-1, 3)
    own = own.ravel()
    normals = np.broadcast_to(UP, points.shape).copy()
    corners = mesh[0][mesh[1][own[own >= 0]]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across[across[:, 2] < 0] *= -1.0  # a sheet may show the sky its back
    normals[own >= 0] = across / np.linalg.norm(across, axis=1, keepdims=True)
    return Seen(points, normals, own, ZENITH)


def judge_plane(mesh, grid, suns, height=0.0, threads=1, group=None):
    """Judge every cell of a plane under some suns; return the verdicts and the counts."""
    suns = directions(suns)
    sweep = PlaneSweep(make_caster(*mesh, group), grid, height, threads)
    counts = sweep.counts(suns)
    rays, seen = RayCaster(*mesh), on_plane(grid, height)
    is_closed = closed_faces(sweep.caster, len(mesh[1]))
    verdicts = Verdicts()
    for sun, count in zip(suns, counts):
        verdicts += judge(rays, seen, np.append(sun, 0.0), is_closed, count)
    return verdicts, counts


def judge_field(mesh, grid, suns, ground=0.0, threads=1, group=None):
    """Judge every cell of the topmost surface under some suns."""
    suns = directions(suns)
    caster = make_caster(*mesh, group)
    heights, own = look_down(mesh, grid, ground)
    counts = HeightFieldSweep(caster, grid, heights, threads).counts(suns)
    rays, seen = RayCaster(*mesh), on_field(mesh, grid, heights, own)
    is_closed = closed_faces(caster, len(mesh[1]))
    verdicts = Verdicts()
    for sun, count in zip(suns, counts):
        verdicts += judge(rays, seen, np.append(sun, 0.0), is_closed, count)
    return verdicts, counts


def find_opened(rays, component, camera, eye, light, origin):
    """
    Find the closed components whose unlit faces must count too in a frame.

    Those that hold the light more often than the eye does; and, where the near plane
    cuts one open, those that hold the light at all or are wound inward.
    """
    opened = rays.winding_excess(eye, light, component) < 0
    depth = (rays.vertices[rays.faces] + origin - camera.eye) @ camera.axes()[2]
    cut = np.zeros(len(opened), bool)
    cut[component[depth.min(1) < camera.near]] = True
    # A light in a face is neither inside nor outside.
    opened |= np.bincount(component, rays.holds(light), len(opened)) > 0
    sky = np.array([0.36, 0.48, 0.8, 0.0])
    a, b, c = (rays.vertices[rays.faces[:, k]] for k in range(3))
    volume = np.bincount(component, np.einsum("ij,ij->i", a, np.cross(b, c)), len(opened))
    holds = rays.winding_excess(sky, light, component) != 0
    return opened | (cut & (holds | (volume < 0)))


def judge_frame(mesh, camera, light, ground=0.0, threads=1):
    """
    Judge every pixel of a frame, and z-fail against auto.

    Returns
    -------
    verdicts : Verdicts
    counts : (rows, cols) int32
    """
    scene = make_scene(*mesh)
    counter = FrameCounter(scene, ground=ground, threads=threads)
    view, frame = counter.see(camera)
    counts = counter.count(view, camera, light)
    again = counter.count(view, camera, light, "z-fail")
    is_seen = view.face != NOTHING
    assert not counts[~is_seen].any()
    # Toward the horizon the ground runs off to where float64 knows no metres.
    is_seen &= (np.abs(frame.position - scene.origin) < 1e9).all(-1)
    if not is_seen.any():
        return Verdicts(), counts
    soup = scene.triangles()
    rays = RayCaster(soup.vertices, soup.faces, scene.origin)
    eye, place = camera.apex(scene.origin), light.local(scene.origin)
    component = np.zeros(len(soup.faces), np.int64)
    component[counter.caster.source] = counter.caster.component
    is_closed = closed_faces(counter.caster, len(soup.faces))
    is_closed &= ~find_opened(rays, component, camera, eye, place, scene.origin)[component]
    seen = Seen(
        frame.position[is_seen] - scene.origin, frame.normal[is_seen], view.face[is_seen], eye
    )
    # Where z-fail and auto differ one of them is wrong, on an edge or in a tie.
    verdicts = judge(rays, seen, place, is_closed, counts[is_seen])
    differ = (again != counts)[is_seen]
    if differ.any():
        verdicts.wrong += [
            f"z-fail: {line}"
            for line in judge(rays, seen[differ], place, is_closed, again[is_seen][differ]).wrong
        ]
    return verdicts, counts


def judge_edge_on(counter, camera, light, method="auto"):
    """
    Judge the faces in a light's plane by rays to the light, moved to the viewer's side of each.

    Returns how many of their pixels are wrong, and how many are in another's shadow.
    """
    scene, triangles = counter.scene, counter.triangles
    view, frame = counter.see(camera)
    counts, place = counter.count(view, camera, light, method), light.local(scene.origin)
    points, normals = frame.position - scene.origin, frame.normal
    way = place[:3] - place[3] * points
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    seen = (view.face >= 0) & (np.abs(np.einsum("ijk,ijk->ij", way, normals)) < 1e-11)
    rays = RayCaster(triangles.vertices, triangles.faces, scene.origin)
    caster = make_caster(triangles.vertices, triangles.faces)
    is_closed = closed_faces(caster, len(triangles.faces))
    wrong = shaded = 0
    for normal in np.unique(np.round(normals[seen], 9), axis=0):
        here = seen & (np.abs(normals - normal) < 1e-8).all(-1)
        beside = place + np.append(1e-7 * normal, 0.0)
        eye = camera.apex(scene.origin)
        true = rays.count(points[here], view.face[here], eye, beside, is_closed).count
        wrong += int((counts[here] != true).sum())
        shaded += int((true > 0).sum())
    return wrong, shaded
