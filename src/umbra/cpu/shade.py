"""
Colours of a frame: textures, smooth normals, diffuse surfaces, hard or soft shadows, a sky.

Reflection of glossy surfaces: glTF's metallic-roughness model, under lights and an even sky.

``shaders/gloss.glsl`` is the OpenGL version; a test compares both. A light of intensity 1 makes a
white matte surface that faces it as bright as 1, so the formulas are multiplied by pi.

Sources: glTF 2.0, appendix B (GGX after Trowbridge and Reitz, masking after Smith and Heitz,
Fresnel after Schlick); Karis 2014, "Physically based shading on mobile", for the sky.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.cpu.appearance import find_appearance
from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, NOTHING, DepthBuffer
from umbra.scene import Camera, Light, Material, Scene
from umbra.scene.exposure import DAY, GROUND_COLOR, Sky, find_ambient, find_exposure
from umbra.soft import AreaLight

__all__ = [
    "encode_srgb",
    "find_colors",
    "find_reached",
    "find_sky_color",
    "reflect_light",
    "reflect_sky",
    "shade",
]

_DIELECTRIC = 0.04  # head-on reflectance of non-metals
_LEAST = 0.045  # roughness: a mirror would show a point light as a single point
_TINY = 1e-9

Vectors = NDArray[np.float64]


def reflect_light(
    albedo: Vectors,
    metallic: NDArray[np.float64],
    roughness: NDArray[np.float64],
    normal: Vectors,
    toward: Vectors,
    eye: Vectors,
) -> Vectors:
    """
    Find the light that surfaces reflect to the eye, from a light of intensity 1.

    Parameters
    ----------
    albedo : (n, 3) float64
        Base colour, linear RGB.
    metallic, roughness : (n,) float64
    normal, toward, eye : (n, 3) float64
        Unit vectors: outward, to the light, to the eye.

    Returns
    -------
    reflected : (n, 3) float64
        Linear RGB, times the cosine to the light; 0 behind the surface.
    """
    half = toward + eye
    half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), _TINY)
    to_light, to_eye = _dot(normal, toward), np.maximum(_dot(normal, eye), 1e-4)
    to_half, between = _dot(normal, half), np.maximum(_dot(eye, half), 0.0)
    lit = np.maximum(to_light, 0.0)
    square = np.maximum(roughness, _LEAST) ** 4  # alpha squared; alpha is the roughness squared
    spread = square / np.maximum((to_half**2 * (square - 1.0) + 1.0) ** 2, _TINY)  # pi D
    masked = 0.5 / np.maximum(
        lit * np.sqrt(to_eye**2 * (1.0 - square) + square)
        + to_eye * np.sqrt(lit**2 * (1.0 - square) + square),
        _TINY,
    )
    head_on = _find_head_on(albedo, metallic)
    fresnel = head_on + (1.0 - head_on) * ((1.0 - between) ** 5)[:, None]
    matte = (1.0 - fresnel) * (1.0 - metallic)[:, None] * albedo
    return lit[:, None] * (matte + fresnel * (spread * masked)[:, None])


def reflect_sky(
    albedo: Vectors,
    metallic: NDArray[np.float64],
    roughness: NDArray[np.float64],
    normal: Vectors,
    eye: Vectors,
    ambient: Vectors,
    sky: Sky = DAY,
) -> Vectors:
    """
    Find the ambient and sky light that surfaces reflect.

    Parameters as in ``reflect_light``; ``ambient`` (n, 3) is the uniform light on a matte surface.
    """
    to_eye = np.maximum(_dot(normal, eye), 0.0)
    mirrored = 2.0 * to_eye[:, None] * normal - eye
    # Karis's fit of the share of an even sky that a rough mirror reflects.
    x, y = 1.0 - roughness, 0.0425 - 0.0275 * roughness
    z, w = 1.04 - 0.572 * roughness, 0.022 * roughness - 0.04
    low = np.minimum(x * x, 2.0 ** (-9.28 * to_eye)) * x + y
    head_on = _find_head_on(albedo, metallic)
    shown = head_on * (z - 1.04 * low)[:, None] + (w + 1.04 * low)[:, None]
    matte = (1.0 - shown) * (1.0 - metallic)[:, None] * albedo
    return matte * ambient + shown * find_sky_color(mirrored[:, 2], roughness, sky)


def find_sky_color(
    up: NDArray[np.float64], roughness: NDArray[np.float64], sky: Sky = DAY
) -> Vectors:
    """Find the sky colour (n, 3) at sines of altitude ``up``, blurred by roughness."""
    blur = 0.05 + 0.95 * roughness
    above = np.clip(0.5 + 0.5 * up / blur, 0.0, 1.0)[:, None]
    rise = np.clip(up, 0.0, 1.0)[:, None]
    dome = (1.0 - rise) * np.array(sky.horizon) + rise * np.array(sky.zenith)
    return (1.0 - above) * np.array(sky.bounce) + above * dome


def _find_head_on(albedo: Vectors, metallic: NDArray[np.float64]) -> Vectors:
    """Find the head-on reflectance."""
    return _DIELECTRIC * (1.0 - metallic[:, None]) + metallic[:, None] * albedo


def _dot(first: Vectors, second: Vectors) -> NDArray[np.float64]:
    return np.asarray(np.einsum("ij,ij->i", first, second))


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

    Transparent surfaces are shaded as if opaque: each is a layer of ``picture_layers.py``.

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
    return encode_srgb(find_colors(scene, frame, lights, lit, view, counts, areas, camera))


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
    sky: Sky = DAY,
) -> NDArray[np.float64]:
    """
    Find the linear RGB that ``shade`` encodes, (rows, cols, 3).

    Parameters as there; ``transmission``, (rows, cols, 3) for each light, is the share of it that
    passes glass and leaves; ``openness``, (rows, cols), the share of the sky that is not hidden.
    ``sky`` gives the even light, and is seen behind the model and in mirrors.
    """
    rows, cols = frame.part.shape
    seen = frame.part != NOTHING
    materials = [part.material for part in scene.parts] + [Material(GROUND_COLOR)]
    part = np.where(frame.part[seen] == GROUND, len(scene.parts), frame.part[seen])
    looks = find_appearance(scene, frame, view)
    albedo, normal = looks.albedo, looks.normal
    position = frame.position[seen]
    ambient = find_ambient(normal[:, 2], sky)
    if openness is not None:
        ambient *= _OPEN * (_INDIRECT + (1 - _INDIRECT) * openness[seen])[:, None]
    is_unlit = np.array([material.is_unlit for material in materials])[part]
    shown = albedo * np.where(is_unlit[:, None], 1.0, ambient * looks.openness[:, None])
    glossy = looks.glossy if camera is not None else looks.glossy[:0]
    if camera is not None:
        eye = -np.tile(camera.axes()[2], (len(glossy), 1))
        if camera.is_perspective:
            eye = camera.eye - position[glossy]
            eye /= np.linalg.norm(eye, axis=1, keepdims=True)
        mirror = albedo[glossy], looks.metallic, looks.roughness, normal[glossy]
        even = reflect_sky(*mirror, eye, ambient[glossy], sky)
        shown[glossy] = looks.openness[glossy, None] * even
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
        if light.bend != 1.0:
            share = share * light.find_bend(cosine)
        if transmission is not None:
            color = color * transmission[number][seen]
        shown += share[:, None] * reflected * color
    fade = np.linspace(0, 1, rows)[:, None, None]
    behind = (1 - fade) * np.array(sky.zenith) + fade * np.array(sky.horizon)
    linear = np.broadcast_to(behind, (rows, cols, 3)).copy()
    shown += looks.emission
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


def encode_srgb(linear: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Encode linear RGB as sRGB (IEC 61966-2-1)."""
    value = np.clip(linear, 0.0, 1.0)
    encoded = np.where(value <= _LINEAR, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)
