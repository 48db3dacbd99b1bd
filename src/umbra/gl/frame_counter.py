"""
Frames on the gl device: same interface and results as ``umbra.cpu.frame``.

The device finds the face at each pixel and counts; the visible point is then computed
in float64 from the face's plane, so positions are as accurate as the CPU's. Edges are
rasterised in float32: faces and counts differ from the CPU's within 1/128 of a pixel of
an edge, and where two surfaces are closer than the depth buffer's resolution,
d^2 / (2^24 near) at the distance d [m].
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, DeviceUser, on_device, release_all
from umbra.gl.face_keys import find_face_keys, settle_edge_on
from umbra.gl.geometry import RINGS, Geometry, draw_ground
from umbra.gl.masks.counter import MaskCounters
from umbra.gl.planner import Planner
from umbra.gl.programs import Program
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Indices
from umbra.gl.selection import VolumeOptions
from umbra.gl.soft import SoftMethods
from umbra.gl.state import Pass, State
from umbra.gl.target import Target
from umbra.gl.transmitters import SheerSurfaces, TransmitterTables
from umbra.gl.volume_counter import VolumeCounter
from umbra.gl.volume_plan import VolumePlan
from umbra.methods import Softness
from umbra.rays import VisibleSurface, locate
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.rays.transmission import find_opaque, make_transmitters
from umbra.scene import Camera, Light, Scene
from umbra.soft import AreaLight
from umbra.soft.frames import OneByOne

__all__ = ["GlFrameCounter"]

_SURFACE = Pass(depth_test="less", depth_write=True, color_write=True)


class GlFrameCounter(DeviceUser, OneByOne):
    """
    Count shadows in frames of one scene, on the gl device.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int, optional
        Indices of the parts that cast; all by default.
    ground : float, optional
        z of a plane that receives shadows, in the model's own coordinates [m].
    device : Device, optional
        A new one by default, released with the counter.
    warn : callable
        Called with one line where a forced method is wrong for a view.
    choices : VolumeOptions, optional
        Permitted simplifications; by default all but clipping to a light's range.
    two_sided : bool
        As in ``VolumeCounter``.
    transmits : bool
        As in ``umbra.cpu.frame.FrameCounter``.
    detail : float
        As in `VolumeOptions`, for hard shadows; `moved` is how far any of the casters counted so
        far is off [m].
    """

    def __init__(
        self,
        scene: Scene,
        casters: Sequence[int] | None = None,
        ground: float | None = None,
        *,
        device: Device | None = None,
        warn: Callable[[str], object] = lambda _: None,
        choices: VolumeOptions | None = None,
        two_sided: bool = True,
        transmits: bool = True,
        detail: float = 0.0,
    ) -> None:
        self.scene, self.ground, self.warn = scene, ground, warn
        self.choices = choices or VolumeOptions(narrow=False, detail=detail)
        self.moved = 0.0
        super().__init__(device)
        self.triangles = scene.triangles()
        self.transmitters = make_transmitters(scene, casters) if transmits else None
        faces = np.arange(len(self.triangles.faces))
        self._n_opaque = len(faces)
        if self.transmitters is not None:
            casters = find_opaque(scene, casters)
            opaque = np.setdiff1d(faces, self.transmitters.faces, assume_unique=True)
            faces, self._n_opaque = np.append(opaque, self.transmitters.faces), len(opaque)
        self._order = faces.astype(np.int32)  # opaque faces first
        self._casters = casters
        local = None if ground is None else ground - scene.origin[2]
        with self.device.current():
            tables = None
            if self.transmitters is not None:
                tables = TransmitterTables(self.device, self.transmitters)
            self.geometry = Geometry(self.device, scene)
            self.planner = Planner(self.device, scene, self.geometry, casters, local)
            self.counter = VolumeCounter(
                self.device, self.geometry, self.planner.indices, two_sided=two_sided
            )
            self.masks = MaskCounters(self.device, self.geometry, warn)
            self.soft = SoftMethods(self.planner, self.counter, choices=self.choices)
            self._local_ground = local
            self._faces = Indices(self.device, 2 * self.geometry.n_points)
            self._faces.write(self.geometry.faces[self._order[: self._n_opaque]].ravel())
            self._surface = Program(self.device, "surface.vert.glsl", "face.frag.glsl")
            self._plane = Program(
                self.device, "ground.vert.glsl", "face.frag.glsl", {"RINGS": RINGS}
            )
            self._sheer = SheerSurfaces(self.device, self.geometry, tables) if tables else None
        self._target: Target | None = None
        self._seen: tuple[Camera, CameraProjection, DepthBuffer | None] | None = None
        self.plan: VolumePlan | None = None

    def see(self, camera: Camera) -> tuple[DepthBuffer, VisibleSurface]:
        """Find the visible surface of a camera."""
        view = self.look(camera)
        return view, self.locate(view, camera)

    @on_device
    def look(self, camera: Camera, before: DepthBuffer | None = None) -> DepthBuffer:
        """
        Find the visible face at each pixel, with float64 depth keys from the faces' planes.

        ``before`` as in `Sight.look`.
        """
        projection = self.planner.project(camera)
        face = self._draw(camera, projection, before)
        self._seen = camera, projection, before
        origin = self.scene.origin
        keys = find_face_keys(face, camera, self.triangles, origin, self._local_ground)
        return DepthBuffer(keys, face, before)

    def locate(self, view: DepthBuffer, camera: Camera) -> VisibleSurface:
        """Find the positions of the visible points of this camera's view."""
        return locate(view, camera, self.triangles, self.ground)

    @on_device
    def transmit(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Find transmitted light and the number of opaque hits; see `Sight.transmit`."""
        places = self.locate(view, camera).position
        if self._sheer is None:
            return np.ones(places.shape, np.float32), np.zeros(places.shape[:2], np.int32)
        projection = self.planner.project(camera)
        return self._sheer.trace(places, projection, light, self.scene.origin)

    @on_device
    def count(
        self, view: DepthBuffer, camera: Camera, light: Light, method: str = "auto"
    ) -> NDArray[np.int32]:
        """
        Count the shadow volumes that hold each visible point.

        Parameters
        ----------
        view : DepthBuffer
            View of this camera, from ``see``.
        camera : Camera
        light : Light
        method : str
            One of the device's ``Methods.hard``; else `InputError`.

        Returns
        -------
        counts : (rows, cols) int32
            0 for the background; 1 for any shadow by a method of ``umbra.gl.masks``.
        """
        projection, target = self._recall(view, camera)
        counter, method = self.masks.choose(method, self.counter)
        choices = self.choices if counter is self.counter else replace(self.choices, detail=0.0)
        (self.plan,) = self.planner.plan(
            projection, [light], method, choices=choices, warn=self.warn
        )
        self.moved = max(self.moved, self.plan.statistics.moved)
        with State(self.device) as state:
            counter.count(state, target, self.plan)
        counts = np.where(view.face != NOTHING, counter.read(target, self.plan), 0)
        if counter is not self.counter:
            return counts.astype(np.int32)
        return settle_edge_on(
            counts.astype(np.int32), view, self.locate, self.scene, self.triangles, self._casters,
            camera, light,
        )  # fmt: skip

    @on_device
    def find_visibility(
        self,
        view: DepthBuffer,
        camera: Camera,
        lights: Sequence[AreaLight],
        method: str,
        softness: Softness | None = None,
    ) -> list[NDArray[np.float32]]:
        """
        Find the visible fraction of area lights at each visible point.

        Parameters as in ``count``; the method is one of ``umbra.methods.SOFT``, with the
        resolution of ``softness``.

        Returns
        -------
        visibility : list of (rows, cols) float32
            Per light; 1 is fully lit, 0 umbra, 1 for the background.
        """
        self.soft.refine(softness or Softness())
        soft = self.soft.choose(method)
        projection, target = self._recall(view, camera)
        middles = [light.light for light in lights]
        exact = replace(self.choices, detail=0.0)
        plans = self.planner.plan(projection, middles, choices=exact, warn=self.warn)
        fractions = []
        soft.begin(projection, lights, plans)
        for number in range(len(lights)):
            with State(self.device) as state:
                shares = soft.draw(state, target, number)
            fractions.append(np.where(view.face != NOTHING, shares.read(), 1).astype(np.float32))
        return fractions

    def _recall(self, view: DepthBuffer, camera: Camera) -> tuple[CameraProjection, Target]:
        """Return the projection and target of a view; redraw it if another replaced it."""
        last = self._seen
        if last is None or last[0] is not camera or last[2] is not view.before:
            self.look(camera, view.before)
        assert self._seen is not None
        assert self._target is not None
        return self._seen[1], self._target

    def _draw(
        self, camera: Camera, projection: CameraProjection, before: DepthBuffer | None
    ) -> NDArray[np.int32]:
        if self._target is None or self._target.size != tuple(camera.size):
            release_all(self._target)
            self._target = Target(self.device, camera.size, ("r32i",))
        with State(self.device) as state:
            self._target.begin(state, NOTHING)
            state.use(_SURFACE)
            self.geometry.bind(self._surface)
            self._surface.set(**projection.uniforms, first=0, step=1)
            self._faces.draw(self._surface, 0, 3 * self._n_opaque)
            if self._local_ground is not None:
                faces = {"first": GROUND, "step": 0}
                draw_ground(state, self._plane, projection, self._local_ground, faces)
            if self._sheer is not None:
                self._sheer.draw(state, projection, self._n_opaque, before)
        face = np.ascontiguousarray(self._target.read())
        if before is not None:
            face[before.face == NOTHING] = NOTHING
        if self._sheer is not None:
            face[face >= 0] = self._order[face[face >= 0]]
        return face

    def _list_held(self) -> Iterable[Any]:
        yield from (self._target, self._faces, self._surface, self._plane, self._sheer)
        yield from (self.soft, self.counter, self.masks, self.planner, self.geometry)
