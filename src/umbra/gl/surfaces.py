"""
What surfaces are made of, on the device: normals, textures and materials of a scene.

The scene is drawn once a frame into a *surface target* that says for each pixel what is
seen: depth key, normal, reflectance, and what it shows before any light is switched on.
Lights are then laid over the picture (``shading.py``) without touching the geometry
again, so textures are looked up once, however many lights there are (McGuire et al.
2003, section 8). Where there is at most one light, nothing needs to be remembered: a
pixel's colours in its light and in its shadow are drawn *at once*.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.batches import Batch, make_batches
from umbra.gl.context import Device, release_all
from umbra.gl.geometry import Geometry
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import Projection, find_rays
from umbra.gl.resources import Indices, Texture, TextureBuffer
from umbra.gl.shading import Lamp
from umbra.gl.state import Pass, State
from umbra.scene import Scene
from umbra.scene.palette import AMBIENT, GROUND_COLOR

__all__ = ["SurfaceRenderer"]

_NORMALS, _UVS, _TINTS, _IMAGE = range(4)  # texture units


class SurfaceRenderer:
    """
    Draws a scene's surfaces.

    ``is_solid`` (n_faces,) tells which triangles are outward faces of closed components.
    Raises `InputError` if a texture cannot be decoded (which).
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        geometry: Geometry,
        is_solid: NDArray[np.bool_] | None = None,
    ) -> None:
        self._device, self._geometry = device, geometry
        self._surface = Programs(device, "shaded.vert.glsl", "surface.frag.glsl")
        self._ground = Programs(device, "ground.vert.glsl", "ground.frag.glsl")
        self._images: dict[int, Texture] = {}
        for image in (part.material.image for part in scene.parts):
            if image is not None and id(image) not in self._images:
                self._images[id(image)] = Texture(device, image)
        order, self._batches = make_batches(scene, is_solid)
        self._indices = Indices(device, 2 * geometry.n_points)
        self._indices.write(geometry.faces[order].ravel())
        self._tables = self._make_tables(scene)

    @property
    def has_transparent(self) -> bool:
        """Whether anything lets what lies behind shine through."""
        return any(batch.material.is_transparent for batch in self._batches)

    def draw(
        self, state: State, projection: Projection, ground: float | None, *, cull: bool = False
    ) -> None:
        """
        Draw what is opaque into the surface target in use.

        Before: the target is cleared. After: depth, key, normal, albedo and, as the light so
        far, glow and ambient light of the nearest surface; a key of 0 where there is none.

        Parameters
        ----------
        state : State
        projection : Projection
        ground : float, optional
            z of a plane to draw too, relative to the scene's origin [m].
        cull : bool
            Leave out the backs of solids: right unless the near plane cuts one open.
        """
        self._draw(state, projection, ground, cull, (), None)

    def draw_at_once(
        self,
        state: State,
        projection: Projection,
        ground: float | None,
        lamp: Lamp | None,
        *,
        cull: bool = False,
    ) -> None:
        """
        Draw what is opaque in the only light, if any, and as it is in shadow.

        Before: the depth in use is cleared. After: attachment ``LIT`` holds the nearest
        surface's colours in sRGB where a light reaches it, ``DARK`` where none does.
        Parameters as in ``draw``.
        """
        needs = ("AT_ONCE",) if lamp is None else ("AT_ONCE", "HAS_LAMP", *lamp.needs)
        self._draw(state, projection, ground, cull, needs, lamp)

    def _draw(
        self,
        state: State,
        projection: Projection,
        ground: float | None,
        cull: bool,
        needs: tuple[str, ...],
        lamp: Lamp | None,
    ) -> None:
        both = Pass(depth_test="less", depth_write=True, color_write=True)
        fronts = replace(both, cull="back")
        programs: dict[tuple[str, ...], Program] = {}
        for batch in self._batches:
            if batch.material.is_transparent:
                continue
            carried = (*batch.has, "IS_SOUND") if batch.is_sound and cull else batch.has
            if carried not in programs:
                programs[carried] = self._set_up(projection, (*carried, *needs), lamp)
            state.use(fronts if batch.is_solid and cull else both)
            self._draw_batch(programs[carried], batch)
        if ground is not None:
            state.use(both)
            plane = self._ground.find(*needs)
            if lamp is not None:
                lamp.set(plane)
            plane.set(
                projection=projection.clip_matrix,
                height=float(ground - projection.eye[2]),
                albedo=np.array(GROUND_COLOR),
                ambient=AMBIENT,
                **find_rays(projection),
            )
            plane.draw(12)

    def draw_transparent(self, state: State, projection: Projection) -> None:
        """
        Blend what is transparent over the picture in use, the farthest part first.

        It is lit evenly, without shadows; depth is tested and not written.
        """
        glass = [batch for batch in self._batches if batch.material.is_transparent]
        forward = projection.camera.axes()[2]
        glass.sort(key=lambda batch: -float(forward @ batch.center))
        state.use(Pass(depth_test="less", color_write=True, blend="premultiplied"))
        for batch in glass:
            program = self._set_up(projection, (*batch.has, "IS_TRANSPARENT"))
            self._draw_batch(program, batch)

    def release(self) -> None:
        """Free programs, buffers and textures."""
        images, programs = self._images.values(), (self._surface, self._ground)
        release_all(*programs, *self._tables, *images, self._indices)

    def _set_up(
        self, projection: Projection, needs: tuple[str, ...], lamp: Lamp | None = None
    ) -> Program:
        program = self._surface.find(*needs)
        self._geometry.bind(program)
        if lamp is not None:
            lamp.set(program)
        for unit, table in enumerate(self._tables):
            table.bind(unit)
        program.set(
            normals=_NORMALS, uvs=_UVS, tints=_TINTS, image=_IMAGE, ambient=AMBIENT,
            **projection.uniforms(), **find_rays(projection),
        )  # fmt: skip
        return program

    def _draw_batch(self, program: Program, batch: Batch) -> None:
        material = batch.material
        if material.image is not None:
            self._images[id(material.image)].bind(_IMAGE)
        program.set(
            color=np.array(material.color), opacity=material.opacity,
            emission=np.array(material.emission),
            is_mask=int(material.alpha_mode == "mask"),
            is_blend=int(material.alpha_mode == "blend"), cutoff=material.alpha_cutoff,
        )  # fmt: skip
        self._indices.draw(program, 3 * batch.first, 3 * batch.count)

    def _make_tables(self, scene: Scene) -> list[TextureBuffer]:
        """Upload for each point its normal, uv and tint."""
        count = self._geometry.n_stored
        normals, uvs = np.zeros((count, 4), np.float32), np.zeros((count, 2), np.float32)
        tints = np.full((count, 4), 255, np.uint8)
        for index, first in self._geometry.places():
            mesh = scene.parts[index].mesh
            rows = slice(first, first + len(mesh.vertices))
            if mesh.normals is not None:
                normals[rows, :3] = mesh.normals
            if mesh.uv is not None:
                uvs[rows] = mesh.uv
            if mesh.colors is not None:
                tints[rows, :3] = np.clip(mesh.colors, 0, 1) * 255 + 0.5
        return [
            TextureBuffer(self._device, normals, "rgba32f"),
            TextureBuffer(self._device, uvs, "rg32f"),
            TextureBuffer(self._device, tints, "rgba8"),
        ]
