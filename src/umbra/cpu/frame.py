"""
Camera frames: the visible surface, and the shadow count at each visible point.

``auto`` is z-pass started at the eye's own count: right wherever z-fail is, with no caps and far
less fill. ``z-fail`` counts all faces, caps included, behind the surface. ``z-pass`` is Heidmann's,
which assumes a lit eye.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.polygons import count_polygons, make_dark_cap, make_light_cap, make_sides
from umbra.cpu.volume_rasteriser import SurfaceKeys, count_sides
from umbra.errors import InputError, check_type, show_value
from umbra.machine import choose_threads, use_threads
from umbra.methods import METHODS, Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.rays.eye_count import FaceBlocks, find_cut_open, find_eye_count, find_faces_before
from umbra.rays.holding import find_edge_on, find_holders, recount_edge_on
from umbra.rays.sight import Sight
from umbra.rays.transmission import Transmitters, find_opaque, make_transmitters
from umbra.scene import Camera, Light, Scene
from umbra.scene.derived import derive
from umbra.scene.numbers import read_number
from umbra.soft import AreaLight, find_method
from umbra.soft.frames import OneByOne
from umbra.volume.adjacency import Caster, find_caster
from umbra.volume.silhouette import find_silhouettes

__all__ = ["FrameCounter", "count_shadows"]

_STEP = 2.0**-30  # of the largest coordinate


@dataclass(eq=False)
class FrameCounter(OneByOne):
    """
    Count shadows in frames of one scene.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int, optional
        Indices of the casting parts; all by default.
    ground : float, optional
        z of a plane that receives shadows, in the model's own coordinates [m].
    threads : int
    warn : callable
        Receives one line where a forced method is wrong for a view.
    transmits : bool
        Leave transmitting parts out of the volumes; ``transmit`` traces light through them.
        Otherwise they are opaque, without holes, as in a study.
    """

    scene: Scene
    casters: list[int] | None = None
    ground: float | None = None
    threads: int = 1
    warn: Callable[[str], object] = lambda _: None
    transmits: bool = True
    moved: float = field(init=False, default=0.0)
    caster: Caster = field(init=False)
    transmitters: Transmitters | None = field(init=False, default=None)
    _surface: tuple[DepthBuffer, SurfaceKeys] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        if self.transmits:
            self.transmitters = make_transmitters(self.scene, self.casters)
        if self.transmitters is not None:
            self.casters = find_opaque(self.scene, self.casters)
        self.sight = Sight(self.scene, self.transmitters, self.ground, self.threads)
        self.triangles = self.sight.triangles
        parts = range(len(self.scene.parts)) if self.casters is None else self.casters
        self.caster = find_caster(self.scene, parts)
        self.blocks = FaceBlocks.of(self.caster)
        self.ends = derive(self.caster, "own ends", None, self.caster.ends)
        low = derive(self.triangles, "lowest", None, self._find_lowest)
        self.floor = min(low, np.inf if self.ground is None else self.ground - self.scene.origin[2])

    def see(self, camera: Camera) -> tuple[DepthBuffer, VisibleSurface]:
        """Find the visible surface of a camera."""
        view = self.look(camera)
        return view, self.locate(view, camera)

    def look(self, camera: Camera, before: DepthBuffer | None = None) -> DepthBuffer:
        """Find the visible face and depth of each pixel behind a layer: `Sight.look`."""
        return self.sight.look(camera, before)

    def locate(self, view: DepthBuffer, camera: Camera) -> VisibleSurface:
        """Find the visible points of a view of this camera."""
        return self.sight.locate(view, camera)

    def transmit(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Find the light that transmitting parts leave, and what hides it: `Sight.transmit`."""
        return self.sight.transmit(view, camera, light)

    def count(
        self, view: DepthBuffer, camera: Camera, light: Light, method: str = "auto"
    ) -> NDArray[np.signedinteger]:
        """
        Count the shadow volumes that hold each visible point.

        Parameters
        ----------
        view : DepthBuffer
            From this camera's ``see``.
        camera : Camera
        light : Light
        method : {'auto', 'z-pass', 'z-fail'}

        Returns
        -------
        counts : (rows, cols) int16 or int32
            int16 where all counts fit. 0 where nothing is seen.

        Raises
        ------
        InputError
            If the method is unknown.
        """
        METHODS["cpu"].check(method)
        use_threads(self.threads)
        origin = self.scene.origin
        lamp = light.local(origin)
        near = camera.key_range()[1]
        casting = self.find_casting(lamp)
        source, lamp = lamp, self._lift(lamp, camera)
        eye = find_eye_count(casting, self.blocks, camera, origin, lamp)
        near_faces = find_faces_before(casting, self.blocks, camera, origin)
        cut_open = find_cut_open(casting, self.blocks, near_faces, lamp)
        caster = casting.opened(eye.start.enclosed | cut_open)
        start = eye.start.count(caster.is_closed)
        before: NDArray[np.int32] | np.int32 = np.int32(0)  # caps that the near plane cuts off
        if len(near_faces) and method != "z-fail":
            caps = make_light_cap(caster, lamp, near_faces)
            before = count_polygons(caps, eye.matrix, near, camera.size, nearer=True)
        if method == "z-pass":
            self._judge_z_pass(start, bool(((before != 0) & (view.face != NOTHING)).any()))
        # Rays that start in the light end at its first surface; rays straight to the light meet no
        # sides, only faces behind.
        if (method == "z-fail" and eye.along <= 0) or (method == "auto" and eye.along < 0):
            counts = -self._behind(caster, view, eye.matrix, lamp, near)
            if not camera.is_perspective:  # there the dark cap is a single point, or invisible
                counts += eye.end.count(caster.is_closed)
        else:
            if eye.along > 0:
                counts = np.zeros(view.key.shape, np.int16)
            else:
                floor = self._find_floor(camera)
                counts = self._in_front(caster, view, eye.matrix, lamp, floor)
            if method != "z-pass" and (start or np.any(before)):
                counts = counts + (start + before)
        if start or np.ndim(before) or eye.along < 0 or method == "z-fail":
            counts = counts * (view.face != NOTHING)  # else nothing was counted there
        edge_on = find_edge_on(view, self.triangles, source)
        if edge_on is not None:
            frame = self.locate(view, camera)
            return recount_edge_on(counts, edge_on, frame, self.caster, camera, source, origin)
        return counts

    def find_visibility(
        self,
        view: DepthBuffer,
        camera: Camera,
        lights: Sequence[AreaLight],
        method: str,
        softness: Softness | None = None,
    ) -> list[NDArray[np.float32]]:
        """
        Find the share of each area light that each visible point sees.

        Returns (rows, cols) float32 for each light: 1 is fully lit, 0 umbra, 1 where nothing is
        seen. ``method`` is one of ``umbra.methods.SOFT``, else `InputError`; ``softness`` sets its
        resolution.
        """
        find = find_method(method)
        more = (softness or Softness()).select(method)
        frame = self.locate(view, camera)
        return [find(self, view, frame, camera, light, **more) for light in lights]

    def with_caster(self, caster: Caster) -> FrameCounter:
        """Return a counter of the same scene with another caster, for ``count_undrawn``."""
        other = copy(self)
        other.caster, other.blocks, other.ends = caster, FaceBlocks.of(caster), caster.ends()
        return other

    def count_undrawn(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> NDArray[np.signedinteger]:
        """
        Count the shadow volumes of casters that are not drawn, at each visible point.

        Their light caps are in no depth buffer, so they are tested like sides. Drawn casters get
        the same counts, except at points on them, which lie within their caps.
        """
        use_threads(self.threads)
        lamp = light.local(self.scene.origin)
        casting = self.find_casting(lamp)
        lamp = self._lift(lamp, camera)
        eye = find_eye_count(casting, self.blocks, camera, self.scene.origin, lamp)
        matrix = eye.matrix
        caster = casting.opened(eye.start.enclosed)
        size = view.key.shape[::-1]
        cap = make_light_cap(caster, lamp)
        counts: NDArray[np.signedinteger]
        if eye.along < 0:  # rays to the light see sides edge-on: count behind
            counts = np.zeros(view.key.shape, np.int32)
            for faces in (make_sides(caster, lamp), cap, make_dark_cap(caster, lamp)):
                counts -= count_polygons(faces, matrix, view.key, size, nearer=False)
            if not camera.is_perspective:
                counts += eye.end.count(caster.is_closed)
        else:
            counts = count_polygons(cap, matrix, view.key, size, nearer=True)
            counts += eye.start.count(caster.is_closed)
            if eye.along == 0:
                floor = self._find_floor(camera)
                counts = counts + self._in_front(caster, view, matrix, lamp, floor)
        return counts * (view.face != NOTHING)

    def find_casting(self, light: NDArray[np.float64]) -> Caster:
        """Return the caster without the faces that hold a light, (4,) in its frame."""
        held = find_holders(self.caster, self.blocks, light, self.scene.origin)
        return self.caster.without(held)

    def _lift(self, light: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
        """
        Move a light that lies in the ground's plane by ``_STEP`` to the viewer's side of it.

        There sides lie in the ground itself, and rounding would tell which is nearer. A point is
        meant as the limit from the viewer's side, whence it sees the light just above.
        """
        ground = np.inf if self.ground is None else self.ground - self.scene.origin[2]
        if light[2] != light[3] * ground if light[3] else light[2] or np.isinf(ground):
            return light
        apex = camera.apex(self.scene.origin)
        size = np.abs(self.caster.vertices).max(initial=0.0) if light[3] else 0.0
        step = _STEP * (size + np.abs(light[:3]).max())
        above = apex[2] > apex[3] * ground if apex[3] else apex[2] > 0
        return light + np.array([0.0, 0.0, step if above else -step, 0.0])

    def _in_front(
        self, caster: Caster, view: DepthBuffer, matrix: NDArray, light: NDArray, floor: float
    ) -> NDArray:
        """Count the sides in front of the visible surface, in int16 if the counts fit."""
        if self._surface is None or self._surface[0] is not view:
            self._surface = view, SurfaceKeys.of(view)  # the same for every light
        ((_, silhouettes),) = find_silhouettes(caster, light[None])
        return count_sides(
            self._surface[1], self.ends, silhouettes.codes[: silhouettes.starts[1]],
            caster.weight, matrix, light, floor, self.threads,
        )  # fmt: skip

    def _find_lowest(self) -> float:
        """Return the least z of all faces, in the scene's frame."""
        return float(self.triangles.vertices[self.triangles.faces.ravel(), 2].min())

    def _find_floor(self, camera: Camera) -> float:
        """Return a height below which neither receivers nor the eye lie; -inf if there is none."""
        apex = camera.apex(self.scene.origin)
        is_above = apex[2] >= self.floor if apex[3] else apex[2] >= 0
        return float(self.floor) if is_above else -np.inf

    def _behind(
        self, caster: Caster, view: DepthBuffer, matrix: NDArray, light: NDArray, near: float
    ) -> NDArray[np.int32]:
        """Count all faces of the volumes behind the visible surface."""
        size = view.key.shape[::-1]
        sums = count_polygons(make_sides(caster, light), matrix, view.key, size, nearer=False)
        # Casters are drawn, so no cap past the near plane lies in front of the surface: caps need
        # no depth test, and their own surface counts as behind.
        for cap in (make_light_cap(caster, light), make_dark_cap(caster, light)):
            sums += count_polygons(cap, matrix, near, size, nearer=False)
        return sums

    def _judge_z_pass(self, start: int, is_cut: bool) -> None:
        """Warn where z-pass is wrong: an eye in shadow, or faces in front of the near plane."""
        if start:
            self.warn(
                f"z-pass is wrong for this view: the eye stands in {start} shadow "
                "volumes, which it cannot see; use auto or z-fail"
            )
        elif is_cut:
            self.warn(
                "z-pass is wrong for this view: casting faces lie before the near plane, "
                "where it cannot see them; use auto or z-fail"
            )


def count_shadows(
    scene: Scene,
    camera: Camera,
    light: Light,
    *,
    ground: float | None = None,
    method: str = "auto",
    threads: int = 1,
) -> NDArray[np.int32]:
    """
    Count the shadow volumes that hold each visible point.

    In closed meshes this is the number of lit surfaces between the point and the light; a triangle
    of an open mesh counts on its own, and so does one with holes in its texture, outside the holes.
    A point is in shadow where the count is not 0, or where its surface faces away from the light.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    light : Light
    ground : float, optional
        z of a plane that receives shadows [m].
    method : {'auto', 'z-pass', 'z-fail'}
    threads : int

    Returns
    -------
    counts : (rows, cols) int32
        Row 0 is the top; 0 where nothing is seen.

    Raises
    ------
    InputError
        If the method is unknown, or an argument has the wrong type.

    Examples
    --------
    >>> scene = umbra.read("tower.glb")
    >>> camera = umbra.Camera(eye=(40, -60, 30), target=(0, 0, 10))
    >>> counts = umbra.count_shadows(scene, camera, umbra.point_light((4, -3, 8)), ground=0)
    """
    check_type("scene", scene, Scene)
    check_type("camera", camera, Camera)
    check_type("light", light, Light)
    if ground is not None:
        ground = read_number("the ground's height", ground)
        if not np.isfinite(ground):
            msg = f"the ground's height must be a finite number; got {ground:g}"
            raise InputError(msg, ground=ground)
    if not isinstance(threads, Integral) or threads < 1:
        msg = f"threads must be at least 1, a whole number; got {show_value(threads)}"
        raise InputError(msg, threads=threads)
    counter = FrameCounter(scene, ground=ground, threads=choose_threads(int(threads)))
    view = counter.look(camera)
    counts = counter.count(view, camera, light, method).astype(np.int32)
    if counter.transmitters is not None:
        counts += counter.transmit(view, camera, light)[1]
    return counts
