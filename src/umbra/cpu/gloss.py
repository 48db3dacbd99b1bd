"""
Reflection of glossy surfaces: glTF's metallic-roughness model, under lights and an even sky.

``shaders/gloss.glsl`` is the OpenGL version; a test compares both. A light of intensity 1 makes a
white matte surface that faces it as bright as 1, so the formulas are multiplied by pi.

Sources: glTF 2.0, appendix B (GGX after Trowbridge and Reitz, masking after Smith and Heitz,
Fresnel after Schlick); Karis 2014, "Physically based shading on mobile", for the sky.
"""

import numpy as np
from numpy.typing import NDArray

from umbra.scene.camera import DAY, Sky

__all__ = ["find_sky_color", "reflect_light", "reflect_sky"]

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


def _dot(one: Vectors, two: Vectors) -> NDArray[np.float64]:
    return np.asarray(np.einsum("ij,ij->i", one, two))
