"""Frames on the wgpu device: same interface and results as ``umbra.gl.frame_counter``."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.face_keys import find_face_keys, settle_edge_on
from umbra.gl.geometry import RINGS
from umbra.gl.plan_arrays import ArrayPlanner, PlannedVolumes, place_points
from umbra.gl.projection import CameraProjection
from umbra.gl.selection import VolumeOptions
from umbra.gl.volume_plan import VolumePlan
from umbra.methods import METHODS, Softness
from umbra.rays import VisibleSurface, locate
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.rays.transmission import Transmitters, find_opaque, make_transmitters
from umbra.scene import Camera, Light, Scene
from umbra.soft import AreaLight
from umbra.soft.frames import FrameCounts, OneByOne
from umbra.webgpu.adapter import open_adapter
from umbra.webgpu.frame_passes import FramePasses

__all__ = ["WgpuFrameCounter"]


class WgpuFrameCounter(OneByOne):
    """
    Count shadows in frames of one scene, hard or of area lights, on the wgpu device.

    Parameters
    ----------
    scene : Scene
    casters : sequence of int, optional
        Indices of the parts that cast; all by default.
    ground : float, optional
        z of a plane that receives shadows, in the model's own coordinates [m].
    warn : callable
        Called with one line where a forced method is wrong for a view.
    choices : VolumeOptions, optional
        Permitted simplifications; by default all but clipping to a light's range.
    transmits : bool
        As in ``umbra.cpu.frame.FrameCounter``.

    Raises
    ------
    InputError
        If parts transmit light, which this device does not.
    UmbraError
        If there is no adapter that can count.
    """

    transmitters: Transmitters | None = None
    moved = 0.0

    def __init__(
        self,
        scene: Scene,
        casters: Sequence[int] | None = None,
        ground: float | None = None,
        *,
        warn: Callable[[str], object] = lambda _: None,
        choices: VolumeOptions | None = None,
        transmits: bool = True,
    ) -> None:
        if transmits and make_transmitters(scene, casters) is not None:
            parts = range(len(scene.parts)) if casters is None else casters
            opaque = set(find_opaque(scene, casters) or ())
            through = [scene.parts[k].name for k in parts if k not in opaque]
            msg = (
                f"device='wgpu' counts opaque parts alone, and {len(through)} let light through "
                f"(first: '{through[0] if through else ''}'); use device='gl' or 'cpu'"
            )
            raise InputError(msg, option="device")
        self.scene, self.ground, self.warn = scene, ground, warn
        self.choices = choices or VolumeOptions(narrow=False)
        self.triangles = scene.triangles()
        self._casters = casters
        self._local_ground = None if ground is None else ground - scene.origin[2]
        self._arrays = ArrayPlanner(scene, casters, self._local_ground)
        self.planner, self._table = self._arrays.planner, self._arrays.table
        self._drawing = FramePasses(open_adapter(), self._table.faces >> np.uint32(1))
        self._seen: tuple[Camera, CameraProjection] | None = None
        self.plan: VolumePlan | None = None

    def see(self, camera: Camera) -> tuple[DepthBuffer, VisibleSurface]:
        """Find the visible surface of a camera."""
        view = self.look(camera)
        return view, self.locate(view, camera)

    def look(self, camera: Camera, before: DepthBuffer | None = None) -> DepthBuffer:
        """Find the visible face at each pixel, with float64 depth keys from the faces' planes."""
        if before is not None:
            msg = "device='wgpu' draws no layers behind what transmits light; use device='gl'"
            raise InputError(msg, option="device")
        projection = self.planner.project(camera)
        face = self._draw(camera, projection)
        self._seen = camera, projection
        keys = find_face_keys(face, camera, self.triangles, self.scene.origin, self._local_ground)
        return DepthBuffer(keys, face, None)

    def locate(self, view: DepthBuffer, camera: Camera) -> VisibleSurface:
        """Find the positions of the visible points of this camera's view."""
        return locate(view, camera, self.triangles, self.ground)

    def transmit(
        self, view: DepthBuffer, camera: Camera, light: Light
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Find the light that transmitting parts leave, all of it: see `Sight.transmit`."""
        return np.ones(view.face.shape, np.float32), np.zeros(view.face.shape, np.int32)

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
            One of the device's ``Methods.volumes``; else `InputError`.

        Returns
        -------
        counts : (rows, cols) int32
            0 for the background.
        """
        METHODS["wgpu"].check(method)
        volumes = self._plan(camera, light, method)
        counts = np.where(view.face != NOTHING, self._drawing.count(volumes), 0).astype(np.int32)
        return settle_edge_on(
            counts, view, self.locate, self.scene, self.triangles, self._casters, camera, light
        )

    def find_visibility(
        self,
        view: DepthBuffer,
        camera: Camera,
        lights: Sequence[AreaLight],
        method: str,
        softness: Softness | None = None,
    ) -> list[NDArray[np.float32]]:
        """
        Find the share of each area light that each visible point sees, by points of the light.

        The counts of all points are added up on the device.

        Parameters
        ----------
        method : str
            'samples', with as many points as ``softness`` says; else `InputError`.

        Returns
        -------
        visibility : list of (rows, cols) float32
            Per light; 1 is fully lit, 0 umbra, 1 for the background.
        """
        METHODS["wgpu"].check_soft(method)
        n = (softness or Softness()).samples
        shares = []
        for light in lights:
            plans = (self._plan(camera, point, "auto") for point in light.points(n))
            share = self._drawing.find_share(plans)
            shares.append(np.where(view.face != NOTHING, share, np.float32(1)))
        return shares

    def _plan(self, camera: Camera, light: Light, method: str) -> PlannedVolumes:
        """Plan a light's volumes in a camera's view, drawn again if another replaced it."""
        if self._seen is None or self._seen[0] is not camera:
            self.look(camera)
        assert self._seen is not None
        self.plan, volumes = self._arrays.plan(
            self._seen[1], light, method, self.choices, self.warn
        )
        return volumes

    def _draw(self, camera: Camera, projection: CameraProjection) -> NDArray[np.int32]:
        height = None
        if self._local_ground is not None:
            height = float(self._local_ground - projection.eye[2])
        points = place_points(self._table, projection.eye)
        matrix = projection.clip_matrix.astype(np.float32)
        return self._drawing.find_faces(camera.size, matrix, points, height, 24 * RINGS)

    def release(self) -> None:
        """Free the device's objects."""
        self._drawing.release()
        self.planner.release()

    def __enter__(self) -> FrameCounts:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()
