"""
Surfaces on the device, drawn in batches of one material: normals, textures, materials.

The scene is drawn once a frame into a *surface target* that says for each pixel what is
seen: depth key, normal, reflectance, and what it shows before any light is switched on.
Lights are then laid over the picture (``shading.py``) without touching the geometry
again, so textures are looked up once, however many lights there are (McGuire et al.
2003, section 8). Where there is at most one light, nothing needs to be remembered: a
pixel's colours in its light and in its shadow are drawn *at once*.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from umbra.gl.casters import Body
from umbra.gl.context import Device, release_all
from umbra.gl.geometry import Geometry, is_mirrored
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import Projection, find_rays
from umbra.gl.resources import Indices, Texture, TextureBuffer
from umbra.gl.shading import Lamp
from umbra.gl.state import Pass, State
from umbra.scene import Material, Part, Scene
from umbra.scene.camera import AMBIENT, GROUND_COLOR
from umbra.scene.mesh import transform_points

__all__ = ["SurfaceRenderer", "find_solid_faces"]

_OPEN, _SOLID, _SOUND = range(3)
_NORMALS, _UVS, _TINTS, _IMAGE = range(4)  # texture units


@dataclass(frozen=True, eq=False)
class Batch:
    """
    Faces of one material that are drawn together.

    Parameters
    ----------
    first, count : int
        In the list of faces.
    material : Material
    has : tuple of str
        What the faces carry, as ``surface.frag.glsl`` is told: nothing else is fetched.
    is_solid : bool
        Outward faces of closed components, whose backs nobody outside sees.
    is_sound : bool
        Solid, and the normals at all corners lean to the outside, too: no pixel need ask.
    center : (3,) float64
        Of what is transparent.
    """

    first: int
    count: int
    material: Material
    has: tuple[str, ...]
    is_solid: bool
    is_sound: bool
    center: NDArray[np.float64]


def make_batches(
    scene: Scene, is_solid: NDArray[np.bool_] | None = None, bent: Container[int] = ()
) -> tuple[NDArray[np.intp], list[Batch]]:
    """
    Put faces of one material together, those of a transparent part by themselves.

    Returns the order of the faces (n_faces,), batch after batch, in terms of
    ``scene.triangles()``, and the batches. ``is_solid`` is of ``find_solid_faces``; of the
    parts that are ``bent`` no normals are taken to be sound.
    """
    numbers: dict[tuple, int] = {}
    kinds: list[tuple[Material, tuple[str, ...]]] = []
    batch_of_part = []
    for index, part in enumerate(scene.parts):
        material, has = part.material, _list_carried(part)
        # Transparent parts are drawn far to near, so each is a batch.
        key = (_describe(material), has, index if material.is_transparent else -1)
        batch_of_part.append(numbers.setdefault(key, len(numbers)))
        if len(kinds) < len(numbers):
            kinds.append((material, has))
    soup = scene.triangles()
    bodies = (
        np.full(len(soup.faces), _OPEN) if is_solid is None else _sort_solid(scene, is_solid, bent)
    )
    batch = 3 * np.array(batch_of_part)[soup.part] + bodies
    order = np.argsort(batch, kind="stable")
    starts = np.searchsorted(batch[order], np.arange(3 * len(kinds) + 1)).tolist()
    batches = []
    for number, (first, end) in enumerate(pairwise(starts)):
        if first == end:
            continue
        (material, has), body = kinds[number // 3], number % 3
        corners = soup.vertices[soup.faces[order[first:end]]]
        center = corners.mean((0, 1)) if material.is_transparent else np.zeros(3)
        solid, sound = body != _OPEN, body == _SOUND
        batches.append(Batch(first, end - first, material, has, solid, sound, center))
    return order, batches


def _list_carried(part: Part) -> tuple[str, ...]:
    """Name what the faces of a part carry, in the words of ``surface.frag.glsl``."""
    carried = {
        "HAS_NORMALS": part.mesh.normals is not None,
        "HAS_UV": part.material.image is not None,
        "HAS_TINTS": part.mesh.colors is not None,
        "IS_UNLIT": part.material.is_unlit,
    }
    return tuple(name for name, is_carried in carried.items() if is_carried)


def _sort_solid(
    scene: Scene, is_solid: NDArray[np.bool_], bent: Container[int]
) -> NDArray[np.intp]:
    """Tell open faces from solid ones, and from solid ones whose normals are sound."""
    bodies = np.where(is_solid, _SOLID, _OPEN)
    known: dict[tuple, NDArray[np.bool_]] = {}
    first = 0
    for index, part in enumerate(scene.parts):
        rows = slice(first, first + part.triangles)
        first += part.triangles
        if (
            index in bent
            or part.mesh.normals is None
            or is_mirrored(part.transform)
            or not is_solid[rows].any()
        ):
            continue
        turn = b"" if part.transform is None else part.transform[:3, :3].tobytes()
        key = (id(part.mesh), turn)
        if key not in known:
            known[key] = _find_sound(part)
        bodies[rows][is_solid[rows] & known[key]] = _SOUND
    return bodies


def _find_sound(part: Part) -> NDArray[np.bool_]:
    """Tell at which faces all three normals lean to the side from which they wind outward."""
    mesh = part.mesh
    assert mesh.normals is not None
    vertices, normals = mesh.vertices, mesh.normals
    if part.transform is not None:
        vertices = transform_points(part.transform, vertices)
        x, y, z = part.transform[:3, :3]
        normals = normals @ np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)]).T
    a, b, c = vertices[mesh.faces].transpose(1, 0, 2)
    outward = np.cross(b - a, c - a)
    lean = np.einsum("ij,ikj->ik", outward, normals[mesh.faces])
    return np.asarray((lean > 0).all(1))


def _describe(material: Material) -> tuple:
    """Give what must be equal for two materials to be drawn together."""
    return (
        material.color, id(material.image), material.opacity, material.emission,
        material.is_unlit, material.alpha_mode, material.alpha_cutoff,
    )  # fmt: skip


def find_solid_faces(
    scene: Scene, bodies: Sequence[Body], casters: Sequence[int] | None = None
) -> NDArray[np.bool_]:
    """
    Find the outward faces of closed components: from outside, their backs are never seen.

    Returns (n_faces,) bool in the order of ``scene.triangles()``; False for what does not cast.
    """
    chosen = set(range(len(scene.parts)) if casters is None else casters)
    counts = np.array([part.triangles for part in scene.parts])
    starts = np.cumsum(counts) - counts
    solid = np.zeros(counts.sum(), np.bool_)
    for body in bodies:
        caster = body.caster
        for group in body.groups:
            mine = [index for index in group.parts if index in chosen]
            # The caster's faces are those of the group's parts, one part after another.
            faces = np.concatenate([starts[i] + np.arange(counts[i]) for i in mine])
            solid[faces[caster.source]] = (caster.is_closed & ~body.is_inward)[caster.component]
    return solid


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
        self._bent: set[int] = set()
        self._scene, self._solid = scene, is_solid
        self._indices = Indices(device, 2 * geometry.n_points)
        self._batches = self._sort(scene)
        self._tables = self._make_tables(scene)

    @property
    def has_transparent(self) -> bool:
        """Whether anything lets what lies behind shine through."""
        return any(batch.material.is_transparent for batch in self._batches)

    @property
    def has_normals(self) -> bool:
        """Whether anything has smooth normals."""
        return any("HAS_NORMALS" in batch.has for batch in self._batches)

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

    def bend(self, scene: Scene, is_solid: NDArray[np.bool_] | None = None) -> None:
        """
        Take a pose of the same parts, of which meshes have other vertices and normals.

        ``is_solid`` is given where it changed. Of a mesh that was bent once each pixel asks
        whether its normal leans to the outside.
        """
        bent = {
            index
            for index, (old, new) in enumerate(zip(self._scene.parts, scene.parts, strict=True))
            if old.mesh is not new.mesh
        }
        sees_through = any(scene.parts[index].material.is_transparent for index in bent)
        self._scene = scene
        self._solid = self._solid if is_solid is None else is_solid
        if is_solid is not None or sees_through or not bent <= self._bent:
            self._bent |= bent
            self._batches = self._sort(scene)
        for index, first in self._geometry.places():
            normals = scene.parts[index].mesh.normals
            if index in bent and normals is not None:
                rows = np.zeros((len(normals), 4), np.float32)
                rows[:, :3] = normals
                self._tables[_NORMALS].write(rows, first)

    def _sort(self, scene: Scene) -> list[Batch]:
        """Put the faces into batches, and upload them in that order."""
        order, batches = make_batches(scene, self._solid, self._bent)
        self._indices.write(self._geometry.faces[order].ravel())
        return batches

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
