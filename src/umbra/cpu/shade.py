"""Colours of a frame: textures, smooth normals, diffuse surfaces, shadows hard or soft, a sky."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.gloss import reflect_light, reflect_sky
from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.scene import Camera, Light, Material, Part, Scene
from umbra.scene.camera import GROUND_COLOR, HORIZON, SKY, find_ambient, find_exposure
from umbra.scene.material import sample
from umbra.scene.mesh import transform_points
from umbra.soft import AreaLight

__all__ = ["encode", "find_colors", "find_reached", "find_surfaces", "shade"]


_LINEAR = 0.0031308  # below, sRGB is a straight line
_COMPRESSED, _DESATURATION = 0.8, 0.15  # from where highlights are compressed, how they pale
_NO_SIZE = 1e-12  # sine of a light's angular radius
_ALIKE = 0.99999  # cosine between a face's normal and a smooth one that is the same


def shade(
    scene: Scene,
    frame: VisibleSurface,
    lights: Sequence[Light],
    lit: Sequence[NDArray],
    view: DepthBuffer | None = None,
    counts: Sequence[NDArray[np.integer]] | None = None,
    areas: Sequence[AreaLight] = (),
    camera: Camera | None = None,
) -> NDArray[np.uint8]:
    """
    Shade the visible surface: by Lambert's cosine law, and what is glossy as glTF says.

    Each light weakens as its attenuation, range and cone say; several share the
    exposure of one. What a material emits is added, and an unlit one shows its colour
    as it is.

    What can be seen through is shaded as if it were opaque: it is a layer of ``layers.py``.

    Parameters
    ----------
    scene : Scene
    frame : VisibleSurface
    lights : sequence of Light
    lit : sequence of (rows, cols) bool or float
        Where each light reaches the surface, or what share of it does.
    view : DepthBuffer, optional
        Of the frame; without it neither textures, vertex colours nor smooth normals
        show.
    counts : sequence of (rows, cols) int, optional
        Shadow counts of each light, or of its middle: with them the terminator of smooth normals
        is smooth, see ``find_reached``.
    areas : sequence of AreaLight
        The lights with their sizes, where ``lit`` are shares of soft shadows.
    camera : Camera, optional
        Of the frame; without it nothing is glossy.

    Returns
    -------
    rgb : (rows, cols, 3) uint8
        sRGB.

    Raises
    ------
    InputError
        If a texture cannot be decoded (which).
    """
    return encode(find_colors(scene, frame, lights, lit, view, counts, areas, camera))


def find_colors(
    scene: Scene,
    frame: VisibleSurface,
    lights: Sequence[Light],
    lit: Sequence[NDArray],
    view: DepthBuffer | None = None,
    counts: Sequence[NDArray[np.integer]] | None = None,
    areas: Sequence[AreaLight] = (),
    camera: Camera | None = None,
    transmission: Sequence[NDArray] | None = None,
) -> NDArray[np.float64]:
    """
    Find the linear RGB that ``shade`` shows, (rows, cols, 3).

    Parameters as there; ``transmission``, (rows, cols, 3) for each light, is what glass and leaves
    leave of it.
    """
    rows, cols = frame.part.shape
    seen = frame.part != NOTHING
    materials = [part.material for part in scene.parts] + [Material(GROUND_COLOR)]
    part = np.where(frame.part[seen] == GROUND, len(scene.parts), frame.part[seen])
    albedo, normal = find_surfaces(scene, frame, view)
    position = frame.position[seen]
    ambient = find_ambient(normal[:, 2])
    is_unlit = np.array([material.is_unlit for material in materials])[part]
    shown = albedo * np.where(is_unlit[:, None], 1.0, ambient)
    glossy = np.zeros(0, np.intp)
    if camera is not None and view is not None:
        glossy, (metallic, roughness) = find_gloss(scene, frame, view)
        eye = -np.tile(camera.axes()[2], (len(glossy), 1))
        if camera.is_perspective:
            eye = camera.eye - position[glossy]
            eye /= np.linalg.norm(eye, axis=1, keepdims=True)
        mirror = albedo[glossy], metallic, roughness, normal[glossy]
        shown[glossy] = reflect_sky(*mirror, eye, ambient[glossy])
    is_bumped = np.array([material.normal_image is not None for material in materials])[part]
    is_smooth = (np.einsum("ij,ij->i", normal, frame.normal[seen]) < _ALIKE) & ~is_bumped
    exposure = find_exposure(len(lights))
    for number, (light, reached) in enumerate(zip(lights, lit, strict=True)):
        way = light.position[:3] - light.position[3] * position
        away = np.maximum(np.linalg.norm(way, axis=1), np.finfo(np.float64).tiny)
        cosine = np.einsum("ij,ij->i", normal, way) / away
        share = reached[seen]
        if counts is not None:
            facing = np.einsum("ij,ij->i", frame.normal[seen], way) / away
            sine = areas[number].radius / (away if light.is_point else 1.0) if areas else 0.0
            share = find_reached(share, counts[number][seen], facing, cosine, sine, is_smooth)
        share = exposure * np.where(is_unlit, 0.0, share)
        reflected = albedo * np.maximum(cosine, 0.0)[:, None]
        if len(glossy):
            toward = way[glossy] / away[glossy, None]
            reflected[glossy] = reflect_light(*mirror, toward, eye)
        color = light.find_intensity(position)
        if transmission is not None:
            color = color * transmission[number][seen]
        shown += share[:, None] * reflected * color
    fade = np.linspace(0, 1, rows)[:, None, None]
    linear = np.broadcast_to((1 - fade) * SKY + fade * np.array(HORIZON), (rows, cols, 3)).copy()
    shown += np.array([material.emission for material in materials])[part]
    linear[seen] = np.where(is_unlit[:, None], shown, compress(shown))
    return linear


def compress(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Compress what is brighter than a screen shows, linear RGB (..., 3), toward white.

    The highlights of Khronos' PBR Neutral tone mapper (2024): the largest channel approaches 1
    from 0.8 on, and colours lose saturation above 1. What is darker stays as it is: the offset
    by which that mapper makes up for reflections would darken matte surfaces.
    """
    peak = linear.max(-1, keepdims=True)
    room = 1.0 - _COMPRESSED
    bright = np.maximum(peak, _COMPRESSED)
    new = 1.0 - room * room / (bright + room - _COMPRESSED)
    pale = 1.0 - 1.0 / (_DESATURATION * (bright - new) + 1.0)
    scaled = linear * (new / bright)
    return np.where(peak > _COMPRESSED, scaled + pale * (new - scaled), linear)


def find_reached(
    share: NDArray,
    count: NDArray[np.integer],
    facing: NDArray[np.float64],
    smooth: NDArray[np.float64],
    sine: NDArray[np.float64] | float,
    is_smooth: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """
    Find what share of a light smooth surfaces show, so that their terminator has no teeth.

    Past the terminator of the faces, up to that of the smooth normals, a face is in the shadow
    of its own body alone where the count is 1: it is lit, and Lambert's cosine fades it out.
    Before it a soft share lacks the part of the light that is below the face's own horizon:
    the share is of what is above it.

    Parameters
    ----------
    share : (n,) bool or float
        Of the light that reaches the faces as they are.
    count : (n,) int
        Shadow volumes that hold the point.
    facing, smooth : (n,) float64
        Cosines between the way to the light and the normals of face and surface.
    sine : (n,) float64 or float
        Of the light's angular radius.
    is_smooth : (n,) bool
        Whether both normals differ at all.

    Returns
    -------
    share : (n,) float64
        As it was where the normals are one.
    """
    turned = (facing <= 0) & (smooth > 0)
    above = np.clip(facing / np.maximum(sine, _NO_SIZE), -1.0, 1.0)
    rise = 0.5 + (above * np.sqrt(1 - above**2) + np.arcsin(above)) / np.pi
    whole = np.where(is_smooth, np.minimum(share / np.maximum(rise, 0.5), 1.0), share)
    return np.where(turned & is_smooth, (count == 0) | (count == 1), whole)


def encode(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Encode linear RGB as sRGB (IEC 61966-2-1)."""
    value = np.clip(linear, 0.0, 1.0)
    encoded = np.where(value <= _LINEAR, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)


def find_surfaces(
    scene: Scene, frame: VisibleSurface, view: DepthBuffer | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Find reflectance (linear RGB) and unit normal of visible pixels, (n, 3) each, row by row.

    Without a view parts are of one colour and faces are flat. `InputError` if a texture cannot
    be decoded (which).
    """
    seen = frame.part != NOTHING
    part = frame.part[seen]
    palette = np.array([part.color for part in scene.parts] + [GROUND_COLOR])
    albedo = palette[np.where(part == GROUND, len(scene.parts), part)]
    normal = frame.normal[seen]
    if view is None:
        return albedo, normal
    faces, position = view.face[seen], frame.position[seen] - scene.origin
    first = 0  # of a part's faces, in the order of `Scene.triangles`
    for index, one in enumerate(scene.parts):
        mesh = one.mesh
        has_look = one.material.image is not None or one.material.normal_image is not None
        if has_look or mesh.normals is not None or mesh.colors is not None:
            at = np.flatnonzero(part == index)
            if len(at):
                corners = mesh.faces[faces[at] - first]
                shares = _find_shares(one, corners, position[at])
                albedo[at] *= _find_tint(one, corners, shares)
                if mesh.normals is not None:
                    normal[at] = _find_normals(one, corners, shares, normal[at])
                if one.material.normal_image is not None and mesh.uv is not None:
                    normal[at] = _bend_normals(one, corners, shares, normal[at])
        first += one.triangles
    return albedo, normal


def _find_shares(
    part: Part, corners: NDArray[np.int32], position: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return barycentric coordinates (n, 3) of places on triangles; they sum to 1."""
    a, b, c = _find_corners(part, corners)
    across = np.cross(b - a, c - a)
    area = np.maximum(np.einsum("ij,ij->i", across, across), np.finfo(np.float64).tiny)
    second = np.einsum("ij,ij->i", np.cross(position - a, c - a), across) / area
    third = np.einsum("ij,ij->i", np.cross(b - a, position - a), across) / area
    # What a sliver's rounding throws outside comes back to its rim.
    shares = np.clip(np.stack([1 - second - third, second, third], axis=1), 0.0, 1.0)
    return shares / np.maximum(shares.sum(1, keepdims=True), np.finfo(np.float64).tiny)


def _mix(
    values: NDArray[np.float32], corners: NDArray[np.int32], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.einsum("ij,ijk->ik", shares, values[corners].astype(np.float64))


def _find_tint(
    part: Part, corners: NDArray[np.int32], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what multiplies the material's colour, (n, 3): vertex colours, texture."""
    mesh, image = part.mesh, part.material.image
    tint = np.ones((len(corners), 3))
    if mesh.colors is not None:
        tint *= _mix(mesh.colors, corners, shares)
    if image is not None:
        # As on a graphics device: without coordinates all see the first corner's texel.
        uv = np.zeros((len(corners), 2)) if mesh.uv is None else _mix(mesh.uv, corners, shares)
        tint *= sample(image, uv)[:, :3]
    return tint


def _find_normals(
    part: Part,
    corners: NDArray[np.int32],
    shares: NDArray[np.float64],
    flat: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Mix normals and turn them to the side that is seen; the face's own where there is none."""
    assert part.mesh.normals is not None
    smooth = _mix(part.mesh.normals, corners, shares)
    if part.transform is not None:
        x, y, z = part.transform[:3, :3]
        # The inverse transposed, but for its size and sign.
        smooth = smooth @ np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)]).T
    length = np.linalg.norm(smooth, axis=1, keepdims=True)
    smooth = np.where(length > 0, smooth / np.where(length > 0, length, 1.0), flat)
    away = np.einsum("ij,ij->i", smooth, flat) < 0
    smooth[away] *= -1.0
    return smooth


def _bend_normals(
    part: Part,
    corners: NDArray[np.int32],
    shares: NDArray[np.float64],
    normal: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Bend normals as the material's image says, in a frame along the face's own u and v."""
    image, uv = part.material.normal_image, part.mesh.uv
    assert image is not None
    assert uv is not None
    a, b, c = _find_corners(part, corners)
    (u1, v1), (u2, v2) = (
        (uv[corners[:, k]] - uv[corners[:, 0]]).T.astype(np.float64)[..., None] for k in (1, 2)
    )
    # Places along u and against v, but for a factor whose sign is that of the area in the image.
    sign = np.where(u1 * v2 - u2 * v1 < 0, -1.0, 1.0)
    along, against = sign * ((b - a) * v2 - (c - a) * v1), sign * ((b - a) * u2 - (c - a) * u1)
    along -= normal * np.einsum("ij,ij->i", along, normal)[:, None]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along /= np.maximum(length, np.finfo(np.float64).tiny)
    across = np.cross(normal, along)
    across *= np.where(np.einsum("ij,ij->i", across, against) < 0, -1.0, 1.0)[:, None]
    bend = 2.0 * sample(image, _mix(uv, corners, shares))[:, :3] - 1.0
    bend[:, :2] *= part.material.normal_scale
    bent = bend[:, :1] * along + bend[:, 1:2] * across + bend[:, 2:] * normal
    size = np.linalg.norm(bent, axis=1, keepdims=True)
    is_sound = (length > 0) & (size > 0)  # else the image has no extent here, or no direction
    return np.where(is_sound, bent / np.where(size > 0, size, 1.0), normal)


def _find_corners(part: Part, corners: NDArray[np.int32]) -> list[NDArray[np.float64]]:
    """Return the three corners of triangles, (n, 3) each, where the part stands."""
    vertices = part.mesh.vertices
    if part.transform is not None:
        vertices = transform_points(part.transform, vertices)
    return [vertices[corners[:, k]] for k in range(3)]


def find_gloss(
    scene: Scene, frame: VisibleSurface, view: DepthBuffer
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Find which visible pixels (n,), row by row, are glossy, and how metallic and rough (2, n)."""
    seen = frame.part != NOTHING
    part, faces, position = frame.part[seen], view.face[seen], frame.position[seen] - scene.origin
    places, values = [np.zeros(0, np.intp)], [np.zeros((2, 0))]
    first = 0
    for index, one in enumerate(scene.parts):
        material, mesh = one.material, one.mesh
        if material.roughness is not None and not material.is_unlit:
            at = np.flatnonzero(part == index)
            found = np.tile([[material.metallic], [material.roughness]], len(at))
            if material.gloss_image is not None and mesh.uv is not None and len(at):
                corners = mesh.faces[faces[at] - first]
                shares = _find_shares(one, corners, position[at])
                found *= sample(material.gloss_image, _mix(mesh.uv, corners, shares))[:, 2:0:-1].T
            places.append(at)
            values.append(found)
        first += one.triangles
    return np.concatenate(places), np.concatenate(values, axis=1)
