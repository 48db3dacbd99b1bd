"""A floor that glows and lies in its own shade, texel by texel, and its colours in float64."""

import numpy as np

import umbra
from umbra.scene import Material, Mesh, Part, make_image, make_scene

SIZE = 8
CAMERA = umbra.Camera((0, 0, 9), (0, 0, 0), (0, 1, 0), (3 * SIZE, 3 * SIZE), height=2.0)
TEXELS = slice(1, None, 3)  # the pixels in the middle of texels: devices filter finer pictures
SUN = umbra.directional_light((0.3, 0.2, 0.6), (0.5, 0.4, 0.3))
COLOR, GLOW, STRENGTH = (0.5, 0.4, 0.3), (0.9, 0.5, 0.2), 0.75
_CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
_UV = _CORNERS[:, :2] * (0.5, -0.5) + 0.5


def make_textures():
    """Return the texels of emission (sRGB) and of occlusion, (8, 8, 3) uint8 each."""
    random = np.random.default_rng(7)
    return random.integers(0, 255, (2, SIZE, SIZE, 3)).astype(np.uint8)


def make_floor(roughness=None):
    """Make a floor whose emission is placed by uv, and whose occlusion, turned, by uv2."""
    glow, shade = make_textures()
    material = Material(
        COLOR, emission=GLOW, emission_image=make_image(glow), roughness=roughness,
        occlusion_image=make_image(np.rot90(shade, 2), is_data=True, uv_set=1),
        occlusion=STRENGTH,
    )  # fmt: skip
    mesh = Mesh(_CORNERS, [(0, 1, 2), (0, 2, 3)], uv=_UV, uv2=1 - _UV)
    return make_scene([Part("floor", "", mesh, material=material)])


def find_truth(even, lit):
    """Return linear RGB (8, 8, 3) under even light and another, (3,) each, of a colour of 1."""
    glow, shade = make_textures() / 255
    glow = np.where(glow <= 0.04045, glow / 12.92, ((glow + 0.055) / 1.055) ** 2.4)
    opening = 1 - STRENGTH * (1 - shade[..., :1])
    return np.array(GLOW) * glow + np.array(COLOR) * (np.array(even) * opening + np.array(lit))
