"""Transmitting triangles on the device, for shaders that include ``transmission.glsl``."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.context import Device, release_all
from umbra.gl.geometry import Geometry
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import FloatPicture, Indices, TextureBuffer
from umbra.gl.shading import Lamp
from umbra.gl.state import Pass, State
from umbra.gl.target import Target
from umbra.rays.depth import NOTHING, DepthBuffer
from umbra.rays.transmission import POINTS, Transmitters, make_transmitters
from umbra.scene import Light, Scene
from umbra.soft import AreaLight

__all__ = ["SheerSurfaces", "TransmitterTables"]

_NEAREST = Pass(depth_test="less", depth_write=True, color_write=True)

_FIRST_UNIT = 12  # texture units of the tables
_NAMES = ("sheer_nodes", "sheer_rows", "sheer_looks", "sheer_texels")
_MOST_TEXELS = 0x8C2B  # of a texture buffer
_MOST_WHOLE = 2**24  # float32 holds every integer up to here


class TransmitterTables:
    """
    The arrays of `Transmitters` as texture buffers.

    Raises `InputError` where the driver's texture buffers are too small.
    """

    def __init__(self, device: Device, transmitters: Transmitters) -> None:
        self.transmitters = t = transmitters
        self.n_nodes = len(t.nodes)
        most = device.gl.integers(_MOST_TEXELS)[0]
        sizes = (2 * len(t.nodes), 8 * len(t.rows), 3 * len(t.materials), len(t.texels))
        if max(sizes) > most or 8 * len(t.rows) > _MOST_WHOLE:
            msg = (
                f"{len(t.rows):,} triangles with holes or transparency and {len(t.texels):,} "
                f"texels of their textures are too many for {device.renderer}; use device='cpu'"
            )
            raise InputError(msg, option="device")
        arrays = (
            table if len(table) else np.zeros((1, 4)) for table in (t.nodes, t.rows, t.materials)
        )
        self._buffers = [
            TextureBuffer(device, table.astype(np.float32), "rgba32f") for table in arrays
        ]
        self._buffers.append(TextureBuffer(device, t.texels, "rgba8"))

    @classmethod
    def of(
        cls, device: Device, scene: Scene, casters: Sequence[int] | None
    ) -> "TransmitterTables | None":
        """Gather the triangles of a scene that transmit light; see ``make_transmitters``."""
        transmitters = make_transmitters(scene, casters)
        return None if transmitters is None else cls(device, transmitters)

    def bind(self) -> None:
        """Bind the tables to the texture units of ``transmission.glsl``."""
        for unit, buffer in enumerate(self._buffers, _FIRST_UNIT):
            buffer.bind(unit)

    def uniforms(self, projection: CameraProjection) -> dict[str, object]:
        """Return the uniforms of ``transmission.glsl``."""
        high = projection.eye.astype(np.float32)
        return {
            **{name: _FIRST_UNIT + k for k, name in enumerate(_NAMES)},
            "n_sheer_nodes": self.n_nodes,
            "eye_high": high,
            "eye_low": (projection.eye - high).astype(np.float32),
        }

    def weaken(
        self,
        lamp: Lamp,
        light: Light | AreaLight,
        projection: CameraProjection,
        origin: NDArray[np.float64],
    ) -> Lamp:
        """Attenuate a lamp by the triangles; an area light from several points."""
        points = light.points(POINTS) if isinstance(light, AreaLight) else [light]
        places = np.array([point.local(origin) for point in points])
        places[:, :3] -= places[:, 3:] * projection.eye
        more = {"n_sheer_lamps": len(points), "sheer_lamps": np.resize(places, (POINTS, 4))}
        needs, uniforms = (*lamp.needs, "IS_TRANSMITTED"), {**lamp.uniforms, **more}
        return replace(
            lamp, needs=needs, uniforms={**uniforms, **self.uniforms(projection)}, tables=self
        )

    def release(self) -> None:
        """Free the buffers."""
        release_all(*self._buffers)
        self._buffers = []


class SheerSurfaces:
    """
    Draws transmitting triangles and traces light through them, for frames that are read back.

    Parameters
    ----------
    device : Device
    geometry : Geometry
    tables : TransmitterTables
        Tables of the same scene; released with this object.
    """

    def __init__(self, device: Device, geometry: Geometry, tables: TransmitterTables) -> None:
        self._device, self._geometry, self._tables = device, geometry, tables
        self._transmitters = transmitters = tables.transmitters
        self._light = Program(device, "picture.vert.glsl", "transmit.frag.glsl")
        self._faces = Programs(device, "surface.vert.glsl", "sheer.frag.glsl")
        self._indices = Indices(device, 2 * geometry.n_points)
        self._indices.write(geometry.faces[transmitters.faces].ravel())

    def draw(
        self,
        state: State,
        projection: CameraProjection,
        first: int,
        before: DepthBuffer | None = None,
    ) -> None:
        """
        Draw the numbers of visible triangles, from ``first`` on, into the target in use.

        Before: its depth holds the opaque surfaces. ``before`` is the previous layer in front;
        nothing is drawn over its background.
        """
        program = self._faces.find(*(() if before is None else ("HAS_BEFORE",)))
        values = np.full((1, 1, 2), -np.inf, np.float32)
        if before is not None:
            key = np.where(before.face == NOTHING, -np.inf, before.key)
            row = self._transmitters.find_rows(before.face.ravel()).reshape(key.shape)
            values = np.stack([key, row], 2).astype(np.float32)
        with FloatPicture(self._device, values) as picture:
            picture.bind(0)
            self._geometry.bind(program)
            self._tables.bind()
            program.set(
                first=first, nearer=0, **projection.uniforms, **projection.rays,
            )  # fmt: skip
            program.set(**self._tables.uniforms(projection))
            state.use(_NEAREST)
            self._indices.draw(program, 0, 3 * len(self._transmitters.faces))

    def trace(
        self,
        places: NDArray[np.float64],
        projection: CameraProjection,
        light: Light,
        origin: NDArray[np.float64],
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """
        Find the transmitted fraction of a light, (rows, cols, 3), and the number of opaque hits.

        ``places`` (rows, cols, 3) are in the model's own coordinates, NaN for the background.
        """
        seen = ~np.isnan(places[..., 0])
        values = np.zeros((*seen.shape, 4), np.float32)
        values[seen, :3] = places[seen] - origin - projection.eye
        values[..., 3] = seen
        lamp = light.local(origin)
        lamp[:3] -= lamp[3] * projection.eye
        size = (seen.shape[1], seen.shape[0])
        with (
            State(self._device) as state,
            FloatPicture(self._device, values) as picture,
            Target(self._device, size, ("rgba32f",)) as target,
        ):
            target.begin(state)
            state.use(Pass(color_write=True))
            picture.bind(0)
            self._tables.bind()
            self._light.set(places=0, lamp=lamp, **self._tables.uniforms(projection))
            self._light.draw(3)
            pixels = target.read()
        return np.ascontiguousarray(pixels[..., :3]), pixels[..., 3].astype(np.int32)

    def release(self) -> None:
        """Free the device objects."""
        release_all(self._tables, self._light, self._faces, self._indices)
