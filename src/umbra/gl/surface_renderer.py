"""
Surfaces on the device, drawn in batches of one material: normals, textures, materials.

The scene is drawn once per frame into a *surface target* (G-buffer): depth key, normal,
reflectance, and emitted and ambient light of each pixel. Lights are then added in screen
space (``shading.py``) without redrawing the geometry, so textures are fetched once for
any number of lights (McGuire et al. 2003, section 8). With at most one light, no surface
target is needed: a pixel's colours in light and in shadow are drawn *at once*.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.gl.batches import IMAGES, Batch, FaceBatches
from umbra.gl.context import Device, release_all
from umbra.gl.geometry import RINGS, Geometry, draw_ground
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Indices, Texture, TextureBuffer
from umbra.gl.shading import Lamp
from umbra.gl.state import Pass, State
from umbra.gl.target import PLACE, Target
from umbra.scene import Scene
from umbra.scene.exposure import GROUND_COLOR
from umbra.scene.material import WRAPS

__all__ = ["SurfaceRenderer", "decode_images"]

_NORMALS, _UVS, _TINTS, _IMAGE = range(4)  # texture units; the next is the lamp's
_BEHIND, _TANGENTS = 7, 11
_UNITS = dict(zip(IMAGES, (5, 6, 16, 17), strict=True))  # OpenGL 3.3 has 48 units, 16 a shader
_UV2S = 18
_NOT_PLAIN = {"IS_GLOSSY", "IS_GLOWING", "IS_UNLIT", "HAS_OPENINGS"}


class SurfaceRenderer:
    """
    Draws a scene's surfaces.

    ``is_solid`` (n_faces,) marks the outward faces of closed components, ``ground_color`` is of a
    plane, linear RGB. Raises `InputError` if a texture cannot be decoded.

    Attributes
    ----------
    batches : list of Batch
    """

    def __init__(
        self,
        device: Device,
        scene: Scene,
        geometry: Geometry,
        is_solid: NDArray[np.bool_] | None = None,
        ground_color: tuple[float, float, float] = GROUND_COLOR,
    ) -> None:
        self._device, self._geometry, self._ground_color = device, geometry, ground_color
        self._surface = Programs(device, "shaded.vert.glsl", "surface.frag.glsl")
        self._ground = Programs(device, "ground.vert.glsl", "ground.frag.glsl")
        self._images: dict[int, Texture] = {}
        for image in (image for part in scene.parts for image in part.material.images):
            if id(image) not in self._images:
                self._images[id(image)] = Texture(device, image)
        self._scene, self._solid = scene, is_solid
        self._indices = Indices(device, geometry.n_points)
        self._faces = FaceBatches(scene, is_solid)
        self._sort()
        self._tables = self._make_tables(scene)

    @property
    def has_transparent(self) -> bool:
        """Whether any surface is transparent."""
        return any(batch.is_transparent for batch in self.batches)

    @property
    def is_glossy(self) -> bool:
        """Whether any surface is glossy."""
        return any("IS_GLOSSY" in batch.has for batch in self.batches)

    @property
    def is_plain(self) -> bool:
        """Whether all surfaces are matte and not emissive."""
        return not any(_NOT_PLAIN & set(batch.has) for batch in self.batches)

    @property
    def has_normals(self) -> bool:
        """Whether any surface has smooth normals."""
        return any("HAS_NORMALS" in batch.has for batch in self.batches)

    def draw(
        self,
        state: State,
        projection: CameraProjection,
        ground: float | None,
        *,
        cull: bool = False,
    ) -> None:
        """
        Draw opaque surfaces into the surface target in use.

        Before: the target is cleared. After: depth, key, normal, albedo and, as initial light,
        glow and ambient light of the nearest surface; the key is 0 in the background.

        Parameters
        ----------
        state : State
        projection : Projection
        ground : float, optional
            z of a plane drawn, too, relative to the scene's origin [m].
        cull : bool
            Leave out the backs of solids: valid unless the near plane cuts one open.
        """
        self._draw(state, projection, ground, cull, (), None)

    def draw_at_once(
        self,
        state: State,
        projection: CameraProjection,
        ground: float | None,
        lamp: Lamp | None,
        *,
        cull: bool = False,
    ) -> None:
        """
        Draw opaque surfaces both in the only light, if any, and in shadow.

        Before: the depth in use is cleared. After: attachments ``LIT`` and ``DARK`` hold the
        nearest surface's sRGB colours in light and in shadow. Parameters as in ``draw``.
        """
        needs = ("AT_ONCE",) if lamp is None else ("AT_ONCE", "HAS_LAMP", *lamp.needs)
        self._draw(state, projection, ground, cull, needs, lamp)

    def bend(self, scene: Scene, is_solid: NDArray[np.bool_] | None = None) -> None:
        """
        Update to a pose of the same parts with other vertices and normals.

        ``is_solid`` is given where it changed.
        """
        pairs = zip(self._scene.parts, scene.parts, strict=True)
        bent = [index for index, (old, new) in enumerate(pairs) if old.mesh is not new.mesh]
        self._scene = scene
        if is_solid is not None:
            self._solid = is_solid
        if self._solid is not None and self._faces.classify(
            scene, self._solid, bent if is_solid is None else None
        ):
            self._sort()
        for index, first in self._geometry.places():
            normals = scene.parts[index].mesh.normals
            if index in bent and normals is not None:
                rows = np.zeros((len(normals), 4), np.float32)
                rows[:, :3] = normals
                self._tables[_NORMALS].write(rows, first)

    def _sort(self) -> None:
        """Sort the faces into batches, and upload them in that order."""
        order, self.batches = self._faces.sort()
        self._indices.write((self._geometry.faces[order] >> np.uint32(1)).ravel())

    def _draw(
        self,
        state: State,
        projection: CameraProjection,
        ground: float | None,
        cull: bool,
        needs: tuple[str, ...],
        lamp: Lamp | None,
    ) -> None:
        both = Pass(depth_test="less", depth_write=True, color_write=True)
        fronts = replace(both, cull="back")
        programs: dict[tuple[str, ...], Program] = {}
        for batch in self.batches:
            if batch.is_transparent:
                continue
            carried = (*batch.has, "IS_SOUND") if batch.is_sound and cull else batch.has
            if carried not in programs:
                programs[carried] = self._set_up(projection, (*carried, *needs), lamp)
            state.use(fronts if batch.is_solid and cull else both)
            self._draw_batch(programs[carried], batch)
        if ground is not None:
            plane = self._ground.find(*needs, RINGS=RINGS)
            if lamp is not None:
                lamp.set(plane)
            shown = {"albedo": np.array(self._ground_color), **projection.rays}
            draw_ground(state, plane, projection, ground, shown)

    def draw_layer(
        self,
        state: State,
        projection: CameraProjection,
        behind: Target,
        ground: float | None,
        *,
        is_first: bool,
    ) -> None:
        """
        Draw the farthest transparent surface in front of ``behind`` into the target in use.

        Before: the target is cleared to 0, its depth to the nearest; ``behind`` is another surface
        target, at first the opaque one. After: as after ``draw``, but with opacity in the light's
        alpha. A transparent surface in the plane of the ``ground`` is in front of it.
        """
        state.use(Pass(depth_test="greater", depth_write=True, color_write=True))
        behind.bind(_BEHIND, PLACE)
        for batch in self.batches:
            if batch.is_transparent:
                program = self._set_up(projection, (*batch.has, "IS_LAYER"))
                height = np.inf if ground is None else float(ground - projection.eye[2])
                program.set(is_first=is_first, behind=_BEHIND, floor_height=height)
                self._draw_batch(program, batch)

    def release(self) -> None:
        """Free the programs, buffers and textures."""
        images, programs = self._images.values(), (self._surface, self._ground)
        release_all(*programs, *self._tables.values(), *images, self._indices)

    def _set_up(
        self, projection: CameraProjection, needs: tuple[str, ...], lamp: Lamp | None = None
    ) -> Program:
        program = self._surface.find("BY_POINT", *needs)
        self._geometry.bind(program)
        if lamp is not None:
            lamp.set(program)
        for unit, table in self._tables.items():
            table.bind(unit)
        program.set(
            normals=_NORMALS, uvs=_UVS, tints=_TINTS, image=_IMAGE, tangents=_TANGENTS,
            more_uvs=_UV2S, **{IMAGES[name].lower(): unit for name, unit in _UNITS.items()},
            **projection.uniforms, **projection.rays,
        )  # fmt: skip
        return program

    def _draw_batch(self, program: Program, batch: Batch) -> None:
        material = batch.material
        images = {name: getattr(material, name) for name in ("image", *_UNITS)}
        for name, unit in {"image": _IMAGE, **_UNITS}.items():
            if images[name] is not None:
                self._images[id(images[name])].bind(unit)
        if material.image is not None:
            program.set(wraps=np.array([WRAPS.index(how) for how in material.image.wrap], float))
        program.set(
            color=np.array(material.color), opacity=material.opacity,
            emission=np.array(material.emission),
            cutoff=material.cutoff_level,
            metallic=float(material.metallic), roughness=float(material.roughness or 0.0),
            bump_scale=float(material.normal_scale), occlusion=float(material.occlusion),
            seconds=np.array([getattr(images[name], "uv_set", 0) for name in _UNITS], float),
        )  # fmt: skip
        self._indices.draw(program, 3 * batch.first, 3 * batch.count)

    def _make_tables(self, scene: Scene) -> dict[int, TextureBuffer]:
        """Upload the normal, uv, tint and, if any has one, tangent and second uv of each point."""
        count = self._geometry.n_stored
        normals, uvs = np.zeros((count, 4), np.float32), np.zeros((count, 2), np.float32)
        has_tints = any("HAS_TINTS" in batch.has for batch in self.batches)
        tints = np.ones((count if has_tints else 1, 4), np.float32)
        has_tangents = any(part.mesh.tangents is not None for part in scene.parts)
        tangents = np.zeros((count if has_tangents else 1, 4), np.float32)
        has_second = any(image.uv_set for part in scene.parts for image in part.material.images)
        more = np.zeros((count if has_second else 1, 2), np.float32)
        for index, first in self._geometry.places():
            mesh = scene.parts[index].mesh
            rows = slice(first, first + len(mesh.vertices))
            if mesh.normals is not None:
                normals[rows, :3] = mesh.normals
            if mesh.uv is not None:
                uvs[rows] = mesh.uv
            if mesh.colors is not None:
                tints[rows, :3] = np.clip(mesh.colors, 0, 1)
            if mesh.alpha is not None:
                tints[rows, 3:] = np.clip(mesh.alpha, 0, 1)
            if mesh.tangents is not None:
                tangents[rows] = mesh.tangents
            if mesh.uv2 is not None and has_second:
                more[rows] = mesh.uv2
        return {
            _NORMALS: TextureBuffer(self._device, normals, "rgba32f"),
            _UVS: TextureBuffer(self._device, uvs, "rg32f"),
            _TINTS: TextureBuffer(self._device, tints, "rgba32f"),
            _TANGENTS: TextureBuffer(self._device, tangents, "rgba32f"),
            _UV2S: TextureBuffer(self._device, more, "rg32f"),
        }


def decode_images(scene: Scene) -> None:
    """Decode all textures; raise `InputError` where one cannot be, before anything is made."""
    for image in (image for part in scene.parts for image in part.material.images):
        _ = image.pixels
