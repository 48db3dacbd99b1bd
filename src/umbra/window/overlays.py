"""Diagnostic overlays of a picture: volumes, cases, edges, counts."""

import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import release_all
from umbra.gl.programs import Program, Programs
from umbra.gl.resources import Indices, TextureBuffer
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.state import Pass, State
from umbra.gl.target import PLACE, PictureTargets
from umbra.gl.volume_counter import VolumeCounter, find_slack
from umbra.gl.volume_plan import LIGHT_CAP, Z_FAIL, Z_PASS, VolumePlan
from umbra.gl.volumes import BodyVolumes

__all__ = [
    "ASIDE",
    "CASES",
    "COMPONENTS",
    "EDGES",
    "OPEN",
    "PALETTE",
    "VOLUMES",
    "Overlays",
    "find_count_colors",
    "find_scale_ticks",
    "find_top",
]

PALETTE = (
    np.array(
        [
            [238, 236, 228], [253, 221, 150], [252, 178, 93], [244, 128, 77], [222, 79, 86],
            [178, 50, 103], [128, 37, 109], [79, 27, 98], [40, 16, 66],
        ],
        np.float64,
    )
    / 255
)  # fmt: skip
"""sRGB from a count of 0 to the highest, (9, 3)."""

_FEW = 8
_SOFT = 0.2  # of the light from aside, on counts


def find_top(highest: int) -> int:
    """Return the count of the last colour, rounded to the scale's steps if small."""
    return max(int(highest), 4)


def find_count_colors(counts: NDArray, top: int) -> NDArray[np.float64]:
    """Return the colours of counts, sRGB (..., 3); ``top`` has the last colour."""
    position = np.clip(np.asarray(counts) / top, 0.0, 1.0) * (len(PALETTE) - 1)
    low = np.minimum(position.astype(int), len(PALETTE) - 2)
    part = (position - low)[..., None]
    return (1 - part) * PALETTE[low] + part * PALETTE[low + 1]


def find_scale_ticks(top: int) -> list[int]:
    """Return the counts to label on the scale, with 0 and ``top``."""
    if top <= _FEW:
        return list(range(top + 1))
    return sorted({round(top * k / 4) for k in range(5)})


CASES = {
    0: (0.60, 0.60, 0.60), 1: (0.27, 0.52, 0.93), 2: (0.98, 0.72, 0.12), 3: (0.20, 0.72, 0.36)
}  # fmt: skip
"""sRGB of casters by McGuire's case; 0 casts no visible shadow."""

VOLUMES = {Z_PASS: (0.98, 0.66, 0.20), Z_FAIL: (0.35, 0.45, 0.98), LIGHT_CAP: (0.20, 0.75, 0.38)}
"""sRGB of volumes by how they are counted."""

COMPONENTS = (
    (0.30, 0.60, 0.85), (0.35, 0.72, 0.45), (0.55, 0.50, 0.85), (0.25, 0.70, 0.72),
    (0.62, 0.75, 0.30), (0.40, 0.55, 0.62), (0.75, 0.60, 0.85),
)  # fmt: skip
"""sRGB of closed components, in turn."""
OPEN = (0.95, 0.35, 0.15)
"""sRGB of components that are not closed."""

EDGES = (1.0, 0.22, 0.30)

_OPACITY = {"cases": 0.6, "components": 0.7, "volumes": 0.10, "edges": 1.0, "hidden": 0.22}
_SOME = 1500  # triangles of volumes at this opacity
_EDGE_WIDTH = 1.3  # [pixels], total
_OVER = Pass(depth_test="lequal", color_write=True, blend="over")
_BEFORE = replace(_OVER, depth_test="less")
_NEARER = replace(_OVER, polygon_offset=(-1.0, -2.0))
_HIDDEN = replace(_OVER, depth_test="greater")
_WHOLE = Pass(color_write=True)
OPEN_GROUP = -1  # outside the indices of COMPONENTS
Tints = Mapping[int, tuple[float, float, float]]
ASIDE = np.array([0.45, -0.55, 0.70]) / np.linalg.norm([0.45, -0.55, 0.70])
"""Where the soft light on colours comes from."""


class Overlays:
    """Draws over the picture of a renderer, with hidden parts by its depth."""

    def __init__(self, renderer: SceneRenderer) -> None:
        self._renderer = renderer
        self._device = device = renderer.device
        self._counter = VolumeCounter(device, renderer.geometry, renderer.planner.indices)
        self._faces = Program(device, "surface.vert.glsl", "tint.frag.glsl")
        self._volumes = Programs(device, "surface.vert.glsl", "tint.frag.glsl")
        self._lines = Program(device, "edge.vert.glsl", "tint.frag.glsl")
        self._heat = Program(device, "picture.vert.glsl", "heat.frag.glsl")
        self._by_case = FaceGroups(renderer)
        self._by_component = FaceGroups(renderer)
        self._case: bytes | None = None
        self.n_components: tuple[int, int] | None = None
        self._edges: TextureBuffer | None = None
        self._edges_of: Sequence[BodyVolumes] = ()
        self.n_edges = 0

    def draw(
        self,
        state: State,
        targets: PictureTargets,
        plan: VolumePlan,
        overlays: frozenset[str],
        shrink: float = 1.0,
    ) -> int:
        """
        Draw overlays over ``targets.picture``; return its highest count, if counts are shown.

        The depth of the targets holds the scene; the plan is of one light. Lines are thinner
        by ``shrink``, by which the picture will be enlarged.
        """
        highest = self.draw_counts(state, targets, plan) if "counts" in overlays else 0
        targets.picture.use()
        if "components" in overlays:
            self.draw_components(state, plan)
        if "cases" in overlays:
            self.draw_cases(state, plan)
        if "edges" in overlays:
            self.draw_edges(state, targets, plan, _EDGE_WIDTH / shrink)
        if "volumes" in overlays:
            self.draw_volumes(state, plan)
        return highest

    def draw_volumes(self, state: State, plan: VolumePlan) -> None:
        """Draw the plan's volumes, translucent, into the target in use."""
        program = self._counter.prepare(self._volumes, plan)
        # The more triangles, the more transparent each.
        total = max(sum(draw.count for draw in plan.draws) // 3, 1)
        opacity = float(np.clip(_OPACITY["volumes"] * np.sqrt(_SOME / total), 0.02, 0.2))
        for draw in plan.draws:
            tint = np.array([*VOLUMES[draw.kind], opacity])
            program.set(
                tint=tint, is_cut=draw.is_cut, is_low=draw.is_low, slack=find_slack(plan, draw)
            )
            state.use(_NEARER if draw.kind == LIGHT_CAP else _BEFORE)
            self._renderer.planner.indices.draw(program, draw.first, draw.count)

    def draw_cases(self, state: State, plan: VolumePlan) -> None:
        """Colour casters by case, in the target in use."""
        if self._case != plan.case.tobytes():
            self._case = plan.case.tobytes()
            self._by_case.write(list_faces_by_case(self._renderer, plan.case))
        self._draw_groups(state, plan, self._by_case, CASES, _OPACITY["cases"])

    def draw_components(self, state: State, plan: VolumePlan) -> None:
        """Colour the casters' components, in the target in use; open ones share a colour."""
        if self.n_components is None:
            lists, self.n_components = list_faces_by_component(self._renderer)
            self._by_component.write(lists)
        tints = {OPEN_GROUP: OPEN, **dict(enumerate(COMPONENTS))}
        self._draw_groups(state, plan, self._by_component, tints, _OPACITY["components"])

    def _draw_groups(
        self, state: State, plan: VolumePlan, groups: "FaceGroups", tints: Tints, opacity: float
    ) -> None:
        """Draw groups of faces, each in its colour, over the target in use."""
        self._set_up(self._faces, plan)
        state.use(_NEARER)
        for number, (first, count) in groups.ranges.items():
            self._faces.set(tint=np.array([*tints[number], opacity]))
            groups.indices.draw(self._faces, first, count)

    def draw_edges(
        self, state: State, targets: PictureTargets, plan: VolumePlan, width: float = _EDGE_WIDTH
    ) -> None:
        """Draw the silhouettes of a plan into the target in use; faint where hidden."""
        if len(self._edges_of) != len(plan.volumes) or not all(
            map(operator.is_, self._edges_of, plan.volumes)
        ):
            self._edges_of = plan.volumes
            edges = list_edges(plan.volumes)
            self.n_edges = len(edges)
            release_all(self._edges)
            filled = edges if len(edges) else np.zeros((1, 2), np.int32)
            self._edges = TextureBuffer(self._device, filled, "rg32i")
        if not self.n_edges or self._edges is None:
            return
        self._set_up(self._lines, plan)
        self._edges.bind(0)
        self._lines.set(edges=0, size=np.array(targets.size, float), width=width)
        for settings, opacity in ((_HIDDEN, "hidden"), (_OVER, "edges")):
            state.use(settings)
            self._lines.set(tint=np.array([*EDGES, _OPACITY[opacity]]))
            self._lines.draw(6 * self.n_edges)

    def draw_counts(self, state: State, targets: PictureTargets, plan: VolumePlan) -> int:
        """Draw the counts of a light's volumes over the whole picture; return the highest."""
        self._renderer.draw_surface(state)
        floats = self._counter.count_in_floats(state, targets.light, plan)
        seen = targets.surface.read_depth() < 1.0
        highest = int(np.where(seen, floats.read(), 0).max(initial=0))
        targets.picture.use()
        state.use(_WHOLE)
        floats.bind(0)
        targets.surface.bind(1, PLACE)
        self._heat.set(
            counts=0, places=1, top=float(find_top(highest)), palette=PALETTE,
            soft=_SOFT,
            aside=ASIDE,
        )  # fmt: skip
        self._heat.draw(3)
        return highest

    def release(self) -> None:
        """Free the device objects."""
        release_all(self._counter, self._faces, self._volumes, self._lines, self._heat)
        release_all(self._by_case.indices, self._by_component.indices, self._edges)
        self._edges, self._edges_of = None, ()

    def _set_up(self, program: Program, plan: VolumePlan) -> None:
        self._renderer.geometry.bind(program)
        program.set(**plan.uniforms(), is_cut=False)


class FaceGroups:
    """Vertex numbers of casting faces on the device, by group, so that each is one draw."""

    def __init__(self, renderer: SceneRenderer) -> None:
        self.indices = Indices(renderer.device, 2 * renderer.geometry.n_points)
        self.ranges: dict[int, tuple[int, int]] = {}

    def write(self, lists: dict[int, NDArray[np.uint32]]) -> None:
        """Upload the vertex numbers of each group."""
        starts = np.cumsum([0, *(len(faces) for faces in lists.values())]).tolist()
        self.ranges = {c: (s, len(lists[c])) for c, s in zip(lists, starts, strict=False)}
        self.indices.write(np.concatenate(list(lists.values())))


def list_faces_by_component(
    renderer: SceneRenderer,
) -> tuple[dict[int, NDArray[np.uint32]], tuple[int, int]]:
    """List the vertex numbers of casters by colour; count closed and open components."""
    face_groups, counts = [], np.zeros(2, np.intp)
    for body in renderer.planner.bodies:
        is_closed = body.caster.is_closed
        for _ in body.groups:
            colors = (np.cumsum(is_closed) + counts[0]) % len(COMPONENTS)
            face_groups.append(np.where(is_closed, colors, OPEN_GROUP)[body.caster.component])
            counts += [is_closed.sum(), (~is_closed).sum()]
    lists = _group_faces(renderer, range(OPEN_GROUP, len(COMPONENTS)), face_groups)
    return lists, (int(counts[0]), int(counts[1]))


def list_faces_by_case(
    renderer: SceneRenderer, case: NDArray[np.int8]
) -> dict[int, NDArray[np.uint32]]:
    """List the vertex numbers of casters for each of ``CASES``."""
    face_groups, first = [], 0
    for body in renderer.planner.bodies:
        shell = body.component_shell[body.caster.component]
        for _ in body.groups:
            face_groups.append(case[first + shell])
            first += body.n_shells
    return _group_faces(renderer, CASES, face_groups)


def _group_faces(
    renderer: SceneRenderer, groups: Iterable[int], face_groups: Sequence[NDArray[np.integer]]
) -> dict[int, NDArray[np.uint32]]:
    """List the vertex numbers of faces by group, which ``face_groups`` holds by instance."""
    instances = [(body, first) for body in renderer.planner.bodies for first in body.first.tolist()]
    corners = [2 * (body.caster.faces.astype(np.uint32) + first) for body, first in instances]
    empty = np.zeros(0, np.uint32)
    return {
        number: np.concatenate(
            [
                empty,
                *(
                    faces[of == number].ravel()
                    for faces, of in zip(corners, face_groups, strict=True)
                ),
            ]
        )
        for number in groups
    }


def list_edges(volumes: Sequence[BodyVolumes]) -> NDArray[np.int32]:
    """List the silhouette edges of the volumes once each, (n_edges, 2) vertex numbers."""
    side_lists = (body_volumes.list_sides()[0] for body_volumes in volumes)
    lists = [np.zeros((0, 2), np.int32), *(sides[:, :2].astype(np.int32) for sides in side_lists)]
    return np.unique(np.concatenate(lists), axis=0)
