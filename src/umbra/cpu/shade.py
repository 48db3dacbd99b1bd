"""Colours of a frame: textures, smooth normals, diffuse surfaces, hard or soft shadows, a sky."""

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


_LINEAR = 0.0031308  # below, sRGB is linear
_COMPRESSED, _DESATURATION = 0.8, 0.15  # start of highlight compression; desaturation of highlights
_OPEN = 1.8  # of the even light, where all of the sky is seen
_INDIRECT = 0.2  # of the sky's light, where none of the sky is seen: from other surfaces
_NO_SIZE = 1e-12  # sine of a light's angular radius
_ALIKE = 0.99999  # cosine above which a face's normal and a smooth normal count as equal


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
    Shade the visible surface by Lambert's cosine law, and glossy materials by glTF's model.

    Each light falls off by its attenuation, range and cone; several lights share the exposure of
    one. Emission is added, and unlit materials keep their colour.

    Transparent surfaces are shaded as if opaque: each is a layer of ``layers.py``.

    Parameters
    ----------
    scene : Scene
    frame : VisibleSurface
    lights : sequence of Light
    lit : sequence of (rows, cols) bool or float
        Where each light reaches the surface, or the share of it that does.
    view : DepthBuffer, optional
        View of the frame, needed for textures, vertex colours and smooth normals.
    counts : sequence of (rows, cols) int, optional
        Shadow counts of each light, or of its centre; they smooth the terminator of smooth normals,
        see ``find_reached``.
    areas : sequence of AreaLight
        The lights with their sizes, where ``lit`` holds shares of soft shadows.
    camera : Camera, optional
        Camera of the frame, needed for gloss.

    Returns
    -------
    rgb : (rows, cols, 3) uint8
        sRGB.

    Raises
    ------
    InputError
        If a texture cannot be decoded; the error names it.
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
    openness: NDArray[np.floating] | None = None,
) -> NDArray[np.float64]:
    """
    Find the linear RGB that ``shade`` encodes, (rows, cols, 3).

    Parameters as there; ``transmission``, (rows, cols, 3) for each light, is the share of it that
    passes glass and leaves; ``openness``, (rows, cols), the share of the sky that is not hidden.
    """
    rows, cols = frame.part.shape
    seen = frame.part != NOTHING
    materials = [part.material for part in scene.parts] + [Material(GROUND_COLOR)]
    part = np.where(frame.part[seen] == GROUND, len(scene.parts), frame.part[seen])
    albedo, normal = find_surfaces(scene, frame, view)
    position = frame.position[seen]
    ambient = find_ambient(normal[:, 2])
    if openness is not None:
        ambient *= _OPEN * (_INDIRECT + (1 - _INDIRECT) * openness[seen])[:, None]
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
    Compress highlights beyond a screen's range, linear RGB (..., 3), toward white.

    The highlights of Khronos' PBR Neutral tone mapper (2024): the largest channel approaches 1 from
    0.8 on, and colours lose saturation above 1. Darker colours are unchanged: the mapper's offset,
    which compensates for reflections, would darken matte surfaces.
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
    Find the share of a light on smooth surfaces, so that their terminator is not jagged.

    Between the terminators of the faces and of the smooth normals, a count of 1 means that only the
    face's own body shadows it: it is lit, and Lambert's cosine fades it out. On the lit side of the
    face's terminator, a soft share misses the part of the light below the face's horizon, so it is
    taken relative to the part above.

    Parameters
    ----------
    share : (n,) bool or float
        Share of the light that reaches the flat faces.
    count : (n,) int
        Shadow volumes that hold the point.
    facing, smooth : (n,) float64
        Cosines between the direction to the light and the normals of face and surface.
    sine : (n,) float64 or float
        Sine of the light's angular radius.
    is_smooth : (n,) bool
        Whether both normals differ at all.

    Returns
    -------
    share : (n,) float64
        Unchanged where the normals are equal.
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
    Find reflectance (linear RGB) and unit normals of visible pixels, (n, 3) each, row by row.

    Without a view, parts have one colour and faces are flat. `InputError` if a texture cannot be
    decoded.
    """
    seen = frame.part != NOTHING
    part = frame.part[seen]
    palette = np.array([part.color for part in scene.parts] + [GROUND_COLOR])
    albedo = palette[np.where(part == GROUND, len(scene.parts), part)]
    normal = frame.normal[seen]
    if view is None:
        return albedo, normal
    faces, position = view.face[seen], frame.position[seen] - scene.origin
    first = 0  # a part's first face, in the order of `Scene.triangles`
    for index, one in enumerate(scene.parts):
        mesh = one.mesh
        has_look = one.material.image is not None or one.material.normal_image is not None
        if has_look or mesh.normals is not None or mesh.colors is not None:
            at = np.flatnonzero(part == index)
            if len(at):
                corners = mesh.faces[faces[at] - first]
                shares = _find_shares(one, corners, position[at])
                albedo[at] *= _find_tint(one, corners, shares)
                side = np.ones(len(at))
                if mesh.normals is not None:
                    normal[at], side = _find_normals(one, corners, shares, normal[at])
                if one.material.normal_image is not None and mesh.uv is not None:
                    normal[at] = _bend_normals(one, corners, shares, normal[at], side)
        first += one.triangles
    return albedo, normal


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


def _mix(
    values: NDArray[np.float32], corners: NDArray[np.int32], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.einsum("ij,ijk->ik", shares, values[corners].astype(np.float64))


def _find_tint(
    part: Part, corners: NDArray[np.int32], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the factors of the material's colour, (n, 3): vertex colours times texture."""
    mesh, image = part.mesh, part.material.image
    tint = np.ones((len(corners), 3))
    if mesh.colors is not None:
        tint *= _mix(mesh.colors, corners, shares)
    if image is not None:
        # As on a graphics device: without coordinates, all points use the first corner's texel.
        uv = np.zeros((len(corners), 2)) if mesh.uv is None else _mix(mesh.uv, corners, shares)
        tint *= sample(image, uv)[:, :3]
    return tint


def _find_normals(
    part: Part,
    corners: NDArray[np.int32],
    shares: NDArray[np.float64],
    flat: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Interpolate normals, or use the face's own, and flip them to the visible side.

    Returns them (n, 3), and -1 where they were flipped, else 1 (n,).
    """
    assert part.mesh.normals is not None
    smooth = _mix(part.mesh.normals, corners, shares)
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
    part: Part,
    corners: NDArray[np.int32],
    shares: NDArray[np.float64],
    normal: NDArray[np.float64],
    side: NDArray[np.float64],
) -> NDArray[np.float64]:
    """
    Perturb normals by the material's normal map, in a frame along the tangents, or u and v.

    What bulges on the ``side`` 1 of a surface is a dent on its side -1.
    """
    image, uv = part.material.normal_image, part.mesh.uv
    assert image is not None
    assert uv is not None
    a, b, c = _find_corners(part, corners)
    (u1, v1), (u2, v2) = (
        (uv[corners[:, k]] - uv[corners[:, 0]]).T.astype(np.float64)[..., None] for k in (1, 2)
    )
    # Tangents along u and against v, up to a factor with the sign of the area in the image.
    sign = np.where(u1 * v2 - u2 * v1 < 0, -1.0, 1.0)
    along, against = sign * ((b - a) * v2 - (c - a) * v1), sign * ((b - a) * u2 - (c - a) * u1)
    if part.mesh.tangents is not None:
        tangents = _mix(part.mesh.tangents, corners, shares)
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
    bend = 2.0 * sample(image, _mix(uv, corners, shares))[:, :3] - 1.0
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


def find_gloss(
    scene: Scene, frame: VisibleSurface, view: DepthBuffer
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Find the glossy visible pixels (n,), row by row, and their metallic and roughness (2, n)."""
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
