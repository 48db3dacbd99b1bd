"""
What to draw for each light of a frame: cases, culling and cuts, and one upload for all.

For every thing that casts McGuire's case is found (``umbra.volume.placement``), what is
out of view is left out, and volumes end below the lowest receiver. The triangles that
remain are put into one list. While nothing moves, the last plan is still right and
nothing is done at all.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.anchor import find_anchor
from umbra.errors import InputError
from umbra.gl.casters import make_bodies
from umbra.gl.context import Device
from umbra.gl.geometry import Geometry
from umbra.gl.indices import Indices
from umbra.gl.openings import find_opened
from umbra.gl.overlap import bound_count, find_most
from umbra.gl.projection import Projection
from umbra.gl.volumes import BodyVolumes, make_volumes
from umbra.scene import Light, Scene
from umbra.volume.bounds import can_end_at_floor, find_near_rectangle, find_visible_parts
from umbra.volume.placement import dark_cap_is_fan, find_placement, find_placements, make_regions

__all__ = ["METHODS", "Choices", "Draw", "Plan", "Planner", "Statistics"]

METHODS = ("auto", "z-pass", "z-fail", "lengyel", "mcguire")
MARGIN = 1e-5
"""By how much the occlusion pyramid is widened, since the device computes in float32."""

_FACES_ASKED = 50_000  # in a plan; the bounds' answer is right for the rest, if not the least
_DRAWN_FLOOR = 0.01  # volumes end so much of the scene's size below the lowest receiver
Z_PASS, Z_FAIL, LIGHT_CAP = "z_pass", "z_fail", "light_cap"


@dataclass(frozen=True, kw_only=True)
class Choices:
    """
    What may be left out; none of it changes a count.

    Parameters
    ----------
    cull : bool
        Leave out volumes and caps that are out of view or out of the light's range.
    cut : bool
        End volumes where no receiver can lie.
    ask_triangles : bool
        Let triangles decide the case where bounds cannot.
    """

    cull: bool = True
    cut: bool = True
    ask_triangles: bool = True


@dataclass(frozen=True)
class Draw:
    """Triangles of one kind: ``z_pass``, ``z_fail`` or ``light_cap``, in the plan's list."""

    kind: str
    is_cut: bool
    first: int
    count: int


@dataclass(frozen=True)
class Statistics:
    """
    What one light's plan draws.

    Parameters
    ----------
    things, culled, cut : int
        Things that cast; those out of view; those whose volumes end at the floor.
    cases : (int, int, int)
        Things in view of case 1, 2 and 3.
    sides, dark_caps, light_caps : int
        Triangles.
    sides_z_pass : int
        Those of ``sides`` that are counted before the visible surface.
    index_bytes : int
        That travelled to the device.
    deepest : int
        No count can be larger.
    counts_in : {'stencil', 'float'}
        Where they are kept: 8 bits, or a float where more than 255 may overlap.
    """

    things: int = 0
    culled: int = 0
    cut: int = 0
    cases: tuple[int, int, int] = (0, 0, 0)
    sides: int = 0
    sides_z_pass: int = 0
    dark_caps: int = 0
    light_caps: int = 0
    index_bytes: int = 0
    deepest: int = 0
    counts_in: str = "stencil"


@dataclass(frozen=True, eq=False)
class Plan:
    """
    One light's volumes, ready to draw.

    Parameters
    ----------
    projection : Projection
    light : (4,) float64
        Relative to the eye.
    bottom : float
        z, relative to the eye, where cut volumes end.
    draws : tuple of Draw
    start : int
        The count from which to start: of the far ends of rays, in orthographic views.
    case : (n_things,) int8
        McGuire's; 0 where culled.
    statistics : Statistics
    """

    projection: Projection
    light: NDArray[np.float64]
    bottom: float
    draws: tuple[Draw, ...]
    start: int
    case: NDArray[np.int8]
    statistics: Statistics


@dataclass(eq=False)
class _Lit:
    """What is kept of one light between frames."""

    key: bytes
    volumes: list[BodyVolumes]
    deepest: int


@dataclass(eq=False)
class Planner:
    """
    Plans the shadow volumes of a scene.

    Parameters
    ----------
    device : Device
    scene : Scene
    geometry : Geometry
        Of the scene; the planner does not release it.
    casters : sequence of int, optional
        Indices of the parts that cast; all by default. All parts must be in the depth
        buffer when counts are made.
    ground : float, optional
        z, relative to the scene's origin, of a plane that receives too [m].
    """

    device: Device
    scene: Scene
    geometry: Geometry
    casters: Sequence[int] | None = None
    ground: float | None = None
    _lights: list[_Lit] = field(default_factory=list)
    _last: tuple[bytes, list[Plan]] | None = None
    _version: int = 0

    def __post_init__(self) -> None:
        self.bodies = make_bodies(self.scene, self.geometry, self.casters)
        self.indices = Indices(self.device, 2 * self.geometry.n_points)
        self._measure()

    def _measure(self) -> None:
        boxes = [body.world_bounds() for body in self.bodies]
        self.bounds = np.concatenate(boxes) if boxes else np.zeros((0, 2, 3))
        whole = self.scene.bounds() - self.scene.origin
        low = min(whole[0, 2], np.inf if self.ground is None else self.ground)
        self._floor = low - _DRAWN_FLOOR * max(float(np.ptp(whole, axis=0).max()), 1e-3)

    def move(self, scene: Scene) -> None:
        """
        Take new transforms from a scene of the same parts.

        Only bodies whose transforms changed are built anew.
        """
        found = [scene.parts[g.parts[0]].transform for g in self.geometry.groups]
        self.scene = scene
        self.geometry.move(np.array([t for t in found if t is not None]))
        of = {id(g): t for g, t in zip(self.geometry.groups, found, strict=True) if t is not None}
        for body in self.bodies:
            body.transforms = np.array([of.get(id(g), np.eye(4)) for g in body.groups])
            body.mirrored = np.linalg.det(body.transforms[:, :3, :3]) < 0
        self._version += 1
        self._measure()

    def plan(
        self,
        projection: Projection,
        lights: Sequence[Light],
        method: str = "auto",
        *,
        choices: Choices | None = None,
        warn: Callable[[str], object] = lambda _: None,
    ) -> list[Plan]:
        """
        Plan all lights of a frame, and upload their triangles at once.

        Parameters
        ----------
        projection : Projection
        lights : sequence of Light
        method : {'auto', 'z-pass', 'z-fail', 'lengyel', 'mcguire'}
        choices : Choices, optional
        warn : callable
            Told, in a line, where the method is wrong for this view.

        Returns
        -------
        plans : list of Plan
            One for each light; valid until the next call.

        Raises
        ------
        InputError
            If there is no such method.
        """
        if method not in METHODS:
            msg = f"the gl device has no method '{method}'; it has {', '.join(METHODS)}"
            raise InputError(msg, method=method)
        choices = choices or Choices()
        view = projection.matrix.tobytes() + projection.eye.tobytes()
        sources = b"".join(light.position.tobytes() for light in lights)
        ranges = np.array([getattr(light, "range", np.inf) for light in lights]).tobytes()
        key = view + sources + ranges + f"{method}{choices}{self._version}".encode()
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        del self._lights[len(lights) :]
        plans, lists, place = [], [], 0
        for number, light in enumerate(lights):
            plan, triangles = self._plan(number, projection, light, method, choices, warn, place)
            place += sum(map(len, triangles))
            plans.append(plan)
            lists += triangles
        self.indices.write(np.concatenate(lists) if lists else np.zeros(0, np.uint32))
        size = self.indices.dtype.itemsize
        plans = [
            replace(
                plan,
                statistics=replace(
                    plan.statistics, index_bytes=size * sum(draw.count for draw in plan.draws)
                ),
            )
            for plan in plans
        ]
        self._last = key, plans
        return plans

    def _plan(
        self,
        number: int,
        projection: Projection,
        light: Light,
        method: str,
        choices: Choices,
        warn: Callable[[str], object],
        place: int,
    ) -> tuple[Plan, list[NDArray[np.uint32]]]:
        camera, origin = projection.camera, self.scene.origin
        source = light.local(origin)
        source /= np.linalg.norm(source[:3]) if source[3] == 0 else 1.0
        lit = self._light_up(number, projection, source)
        bounds, reach = self.bounds, getattr(light, "range", np.inf)
        corners = find_near_rectangle(camera, origin)
        may_cut = choices.cut and bool((corners[:, 2] > self._floor).all())
        cut = np.zeros(len(bounds), np.bool_)
        if may_cut:
            cut = can_end_at_floor(bounds, source)
        parts = find_visible_parts(
            bounds, source, camera, origin, floor=self._floor if may_cut else None, reach=reach
        )
        volume, light_cap = parts.volume, parts.light_cap
        is_fan = dark_cap_is_fan(bounds, source)
        dark_cap = volume & (parts.dark_cap | ~is_fan)
        if not choices.cull:
            volume = light_cap = dark_cap = np.ones(len(bounds), np.bool_)
        dark_cap = dark_cap & (cut | (source[3] > 0)) & (cut | camera.is_perspective)
        case, sees_cap = self._place(lit, projection, source, volume, choices, method)
        if method == "z-pass" and (case > 1).any():
            warn(
                f"z-pass is wrong for this view: {int((case > 1).sum())} casters stand between the "
                "near plane and the light; use auto or z-fail"
            )
        z_fail = {"z-pass": case < 0, "z-fail": volume}.get(method, case > 1)
        caps = light_cap & z_fail
        if method in ("auto", "mcguire"):
            caps = caps & sees_cap
        dark = dark_cap & z_fail
        triangles, draws, counted = [], [], {}
        for kind, name, chosen in (
            (Z_PASS, "sides", volume & ~z_fail),
            (Z_FAIL, "sides", volume & z_fail),
            (Z_FAIL, "dark", dark),
            (LIGHT_CAP, "light", caps),
        ):
            for is_cut in (False, True) if name != "light" else (False,):
                some = chosen & (cut == is_cut) if name != "light" else chosen
                if not some.any():
                    continue
                found = self._gather(lit, name, some, is_fan, source[3] > 0 or is_cut)
                counted[kind, name] = counted.get((kind, name), 0) + found.size // 3
                if found.size and draws and (draws[-1].kind, draws[-1].is_cut) == (kind, is_cut):
                    draws[-1] = replace(draws[-1], count=draws[-1].count + found.size)
                elif found.size:
                    draws.append(Draw(kind, is_cut, place, found.size))
                place += found.size
                triangles.append(found)
        eye = projection.eye
        statistics = Statistics(
            things=len(bounds),
            culled=int((~volume).sum()),
            cut=int((cut & volume).sum()),
            cases=tuple(int((case == k).sum()) for k in (1, 2, 3)),  # type: ignore[arg-type]
            sides=counted.get((Z_PASS, "sides"), 0) + counted.get((Z_FAIL, "sides"), 0),
            sides_z_pass=counted.get((Z_PASS, "sides"), 0),
            dark_caps=counted.get((Z_FAIL, "dark"), 0),
            light_caps=counted.get((LIGHT_CAP, "light"), 0),
            deepest=lit.deepest,
            counts_in="stencil" if lit.deepest <= 255 else "float",
        )
        plan = Plan(
            projection=projection,
            light=np.append(source[:3] - source[3] * eye, source[3]),
            bottom=float(self._floor - eye[2]),
            draws=tuple(draws),
            start=self._find_start(lit, camera.apex(), source, z_fail & volume & ~cut),
            case=case,
            statistics=statistics,
        )
        return plan, triangles

    def _light_up(self, number: int, projection: Projection, source: NDArray) -> _Lit:
        """Find a light's volumes, or those of the last frame where nothing moved."""
        old = self._lights[number] if number < len(self._lights) else None
        volumes, is_new = [], old is None
        for index, body in enumerate(self.bodies):
            lights = body.lights(source)
            opened = find_opened(body, projection.camera, self.scene.origin, lights)
            kept = old.volumes[index] if old is not None else None
            if (
                kept is not None
                and np.array_equal(kept.lights, lights)
                and np.array_equal(kept.opened, opened)
            ):
                volumes.append(kept)
                continue
            volumes.append(make_volumes(body, source, opened))
            is_new = True
        if not is_new and old is not None:
            return old
        most = [find_most(v.body, v.opened) for v in volumes]
        lit = _Lit(source.tobytes(), volumes, bound_count(self.bodies, most, source))
        self._lights[number : number + 1] = [lit]
        return lit

    def _place(
        self,
        lit: _Lit,
        projection: Projection,
        source: NDArray,
        volume: NDArray[np.bool_],
        choices: Choices,
        method: str,
    ) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
        """Find each thing's case, 0 where culled, and whether its light cap may be in view."""
        regions = make_regions(projection.camera, source, self.scene.origin, margin=MARGIN)
        rough = find_placements(self.bounds, regions)
        case = np.where(volume, rough.case, 0).astype(np.int8)
        sees_cap = rough.needs_light_cap.copy()
        left = _FACES_ASKED if choices.ask_triangles and method != "z-fail" else 0
        for number in np.flatnonzero(rough.undecided & volume):
            volumes, instance, thing = self._find(lit, int(number))
            body, caster = volumes.body, volumes.caster
            faces = body.faces[body.face_starts[thing] : body.face_starts[thing + 1]]
            left -= len(faces)
            if left < 0:
                break
            side = volumes.lights[instance] @ caster.planes[:, faces]
            is_closed = caster.is_closed[caster.component[faces]]
            faces = faces[(side > 0) | ((side != 0) & ~is_closed)]
            found = find_placement(
                (caster.vertices, caster.faces[faces]),
                regions=regions,
                transform=body.transforms[instance],
                bounds=body.bounds[thing],
            )
            case[number], sees_cap[number] = found.case, found.needs_light_cap
        return case, sees_cap

    @staticmethod
    def _find(lit: _Lit, number: int) -> tuple[BodyVolumes, int, int]:
        """Give the volumes, the instance and the thing of a number among all things."""
        for volumes in lit.volumes:
            n = volumes.body.n_things * len(volumes.body.groups)
            if number < n:
                return volumes, *divmod(number, volumes.body.n_things)
            number -= n
        raise IndexError(number)

    def _gather(
        self, lit: _Lit, name: str, chosen: NDArray, is_fan: NDArray, is_quad: bool
    ) -> NDArray[np.uint32]:
        """Put the triangles of the chosen things together, flat."""
        lists, offset = [np.zeros(0, np.uint32)], 0
        for volumes in lit.volumes:
            n = volumes.body.n_things * len(volumes.body.groups)
            mine = chosen[offset : offset + n]
            if mine.any():
                if name == "sides":
                    sides = volumes.sides[:, : 6 if is_quad else 3]
                    found = sides if mine.all() else sides[mine[volumes.side_thing]]
                elif name == "dark":
                    found = volumes.dark_cap(mine, is_fan[offset : offset + n])
                else:
                    found = volumes.light_cap(mine)
                lists.append(found.ravel())
            offset += n
        return np.concatenate(lists)

    def _find_start(
        self, lit: _Lit, apex: NDArray, source: NDArray, chosen: NDArray[np.bool_]
    ) -> int:
        """
        Count the volumes, of those drawn to infinity behind the surface, that rays end in.

        In perspective the dark cap is drawn there; parallel rays all end in one point.
        """
        if apex[3] or not source[3] or not chosen.any():
            return 0
        start, offset = 0, 0
        for volumes in lit.volumes:
            body = volumes.body
            thing = np.zeros(len(body.caster.is_closed), np.intp)
            thing[body.caster.component[body.caster.edge_faces[:, 0]]] = body.edge_thing
            for instance, light in enumerate(volumes.lights):
                way = np.linalg.solve(body.transforms[instance], -apex)
                anchor = find_anchor(body.caster, body.blocks, np.append(way[:3], 0.0), light)
                among = chosen[offset + thing]
                unlit = anchor.unlit * ~volumes.caster.is_closed
                start += int((among * (anchor.lit + unlit)).sum())
                offset += body.n_things
        return start

    def release(self) -> None:
        """Free the index buffer."""
        self.indices.release()
