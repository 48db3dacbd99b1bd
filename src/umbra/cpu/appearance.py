"""What visible surfaces look like: textures, vertex colours, smooth normals and reliefs."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.scene import Image, Material, Part, Scene
from umbra.scene.exposure import GROUND_COLOR
from umbra.scene.material import sample
from umbra.scene.mesh import transform_points

__all__ = ["PixelLooks", "find_appearance"]

_GROUND = Material(GROUND_COLOR)


@dataclass(frozen=True, eq=False)
class PixelLooks:
    """
    PixelLooks of the visible pixels, row by row.

    Parameters
    ----------
    albedo : (n, 3) float64
        Reflectance, linear RGB.
    normal : (n, 3) float64
        Unit normals, toward the visible side.
    emission : (n, 3) float64
        Emitted radiance, linear RGB.
    openness : (n,) float64
        Share of the even light that occlusion images leave.
    glossy : (k,) int
        Pixels of materials with a roughness.
    metallic, roughness : (k,) float64
        Of the glossy pixels.
    """

    albedo: NDArray[np.float64]
    normal: NDArray[np.float64]
    emission: NDArray[np.float64]
    openness: NDArray[np.float64]
    glossy: NDArray[np.intp]
    metallic: NDArray[np.float64]
    roughness: NDArray[np.float64]


def find_appearance(
    scene: Scene, frame: VisibleSurface, view: DepthBuffer | None = None
) -> PixelLooks:
    """
    Find the appearance of the visible pixels.

    Without a view, parts have one colour and no gloss, and faces are flat. `InputError` if a
    texture cannot be decoded.
    """
    seen = frame.part != NOTHING
    part = frame.part[seen]
    materials = [part.material for part in scene.parts] + [_GROUND]
    which = np.where(part == GROUND, len(scene.parts), part)
    looks = PixelLooks(
        albedo=np.array([part.color for part in materials])[which],
        normal=frame.normal[seen],
        emission=np.array([part.emission for part in materials])[which],
        openness=np.ones(len(part)),
        glossy=np.flatnonzero(np.array([_is_glossy(part) for part in materials])[which])
        if view is not None
        else np.zeros(0, np.intp),
        metallic=np.array([part.metallic for part in materials])[which],
        roughness=np.array([part.roughness or 0.0 for part in materials])[which],
    )
    if view is not None:
        faces, position = view.face[seen], frame.position[seen] - scene.origin
        first = 0  # a part's first face, in the order of `Scene.triangles`
        for index, model_part in enumerate(scene.parts):
            mesh = model_part.mesh
            if model_part.material.images or mesh.normals is not None or mesh.colors is not None:
                at = np.flatnonzero(part == index)
                if len(at):
                    _look_at_part(_Points(model_part, faces[at] - first, position[at]), at, looks)
            first += model_part.triangles
    glossy = looks.glossy
    return replace(looks, metallic=looks.metallic[glossy], roughness=looks.roughness[glossy])


def _is_glossy(material: Material) -> bool:
    return material.roughness is not None and not material.is_unlit


class _Points:
    """Visible points (n,) of a part, and their place between the corners of their faces."""

    def __init__(self, part: Part, faces: NDArray[np.intp], position: NDArray[np.float64]) -> None:
        self.part = part
        self.corners = part.mesh.faces[faces]
        self.shares = _find_shares(part, self.corners, position)

    def mix(self, values: NDArray[np.float32]) -> NDArray[np.float64]:
        """Interpolate values (n_vertices, k) of the mesh's vertices."""
        return np.einsum("ij,ijk->ik", self.shares, values[self.corners].astype(np.float64))

    def look_up(self, image: Image) -> NDArray[np.float64]:
        """Sample an image of the material, (n, 4)."""
        uv = self.part.mesh.find_uv(image)
        # As on a graphics device: without coordinates, all points use the first corner's texel.
        return sample(image, np.zeros((len(self.corners), 2)) if uv is None else self.mix(uv))


def _look_at_part(points: _Points, at: NDArray[np.intp], looks: PixelLooks) -> None:
    """Write the appearance of a part's points into the rows ``at``."""
    mesh, material = points.part.mesh, points.part.material
    if mesh.colors is not None:
        looks.albedo[at] *= points.mix(mesh.colors)
    if material.image is not None:
        looks.albedo[at] *= points.look_up(material.image)[:, :3]
    if material.emission_image is not None:
        looks.emission[at] *= points.look_up(material.emission_image)[:, :3]
    if material.occlusion_image is not None:
        red = points.look_up(material.occlusion_image)[:, 0]
        looks.openness[at] = 1.0 + material.occlusion * (red - 1.0)
    if material.gloss_image is not None:
        gloss = points.look_up(material.gloss_image)
        looks.roughness[at] *= gloss[:, 1]
        looks.metallic[at] *= gloss[:, 2]
    side = np.ones(len(at))
    if mesh.normals is not None:
        looks.normal[at], side = _find_normals(points, mesh.normals, looks.normal[at])
    image = material.normal_image
    uv = None if image is None else mesh.find_uv(image)
    if image is not None and uv is not None:
        looks.normal[at] = _bend_normals(points, image, uv, looks.normal[at], side)


def _find_shares(
    part: Part, corners: NDArray[np.int32], position: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return barycentric coordinates (n, 3) of points on triangles; they sum to 1."""
    a, b, c = _find_corners(part, corners)
    across = np.cross(b - a, c - a)
    area = np.maximum(np.einsum("ij,ij->i", across, across), np.finfo(np.float64).tiny)
    second = np.einsum("ij,ij->i", np.cross(position - a, c - a), across) / area
    third = np.einsum("ij,ij->i", np.cross(b - a, position - a), across) / area
    # Points that rounding puts outside a sliver are clamped to its boundary.
    shares = np.clip(np.stack([1 - second - third, second, third], axis=1), 0.0, 1.0)
    return shares / np.maximum(shares.sum(1, keepdims=True), np.finfo(np.float64).tiny)


def _find_normals(
    points: _Points, normals: NDArray[np.float32], flat: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Interpolate normals, or use the face's own, and flip them to the visible side.

    Returns them (n, 3), and -1 where they were flipped, else 1 (n,).
    """
    part, smooth = points.part, points.mix(normals)
    if part.transform is not None:
        x, y, z = part.transform[:3, :3]
        # The inverse transpose, up to scale.
        cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
        smooth = smooth @ cofactors.T * _find_mirror(part)
    length = np.linalg.norm(smooth, axis=1, keepdims=True)
    smooth = np.where(length > 0, smooth / np.where(length > 0, length, 1.0), flat)
    side = np.where(np.einsum("ij,ij->i", smooth, flat) < 0, -1.0, 1.0)
    return smooth * side[:, None], side


def _find_mirror(part: Part) -> float:
    """Return -1 for a transform that mirrors, else 1."""
    assert part.transform is not None
    return -1.0 if np.linalg.det(part.transform[:3, :3]) < 0 else 1.0


def _bend_normals(
    points: _Points,
    image: Image,
    uv: NDArray[np.float32],
    normal: NDArray[np.float64],
    side: NDArray[np.float64],
) -> NDArray[np.float64]:
    """
    Perturb normals by the material's normal map, in a frame along the tangents, or u and v.

    What bulges on the ``side`` 1 of a surface is a dent on its side -1.
    """
    part, corners = points.part, points.corners
    a, b, c = _find_corners(part, corners)
    (u1, v1), (u2, v2) = (
        (uv[corners[:, k]] - uv[corners[:, 0]]).T.astype(np.float64)[..., None] for k in (1, 2)
    )
    # Tangents along u and against v, up to a factor with the sign of the area in the image.
    sign = np.where(u1 * v2 - u2 * v1 < 0, -1.0, 1.0)
    along, against = sign * ((b - a) * v2 - (c - a) * v1), sign * ((b - a) * u2 - (c - a) * u1)
    if part.mesh.tangents is not None:
        tangents = points.mix(part.mesh.tangents)
        ways, hand = tangents[:, :3], np.where(tangents[:, 3:] < 0, -1.0, 1.0) * side[:, None]
        if part.transform is not None:
            ways, hand = ways @ part.transform[:3, :3].T, hand * _find_mirror(part)
        has_one = (ways != 0).any(1, keepdims=True)
        along = np.where(has_one, ways, along)
        against = np.where(has_one, hand * np.cross(normal, ways), against)
    along -= normal * np.einsum("ij,ij->i", along, normal)[:, None]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along /= np.maximum(length, np.finfo(np.float64).tiny)
    across = np.cross(normal, along)
    across *= np.where(np.einsum("ij,ij->i", across, against) < 0, -1.0, 1.0)[:, None]
    bend = 2.0 * points.look_up(image)[:, :3] - 1.0
    bend[:, :2] *= part.material.normal_scale * side[:, None]
    bent = bend[:, :1] * along + bend[:, 1:2] * across + bend[:, 2:] * normal
    size = np.linalg.norm(bent, axis=1, keepdims=True)
    is_sound = (length > 0) & (size > 0)  # else the image has no extent or no direction here
    return np.where(is_sound, bent / np.where(size > 0, size, 1.0), normal)


def _find_corners(part: Part, corners: NDArray[np.int32]) -> list[NDArray[np.float64]]:
    """Return the three corners of triangles, (n, 3) each, in the scene's frame."""
    vertices = part.mesh.vertices
    if part.transform is not None:
        vertices = transform_points(part.transform, vertices)
    return [vertices[corners[:, k]] for k in range(3)]
