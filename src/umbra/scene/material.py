"""Materials: reflection, emission and textures of surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umbra.errors import InputError, show_value
from umbra.scene.numbers import read_array, read_number

__all__ = ["GREY", "Image", "Material", "make_image", "sample", "to_linear"]

GREY = (0.72, 0.70, 0.67)
ALPHA_MODES = ("opaque", "mask", "blend")
_OPAQUE = 255  # level of a texture's alpha
_NEAR_LEVEL = 1e-3
WRAPS = ("repeat", "mirror", "clamp")
MORE_IMAGES = ("gloss_image", "normal_image", "emission_image", "occlusion_image")
"""Images of a material beside its colour's, by field; only these may have a ``uv_set`` of 1."""

Color = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Image:
    """
    A picture, decoded on first access to its pixels.

    Parameters
    ----------
    name : str
        For errors: the file, or the texture's name in it.
    load : function of () -> (rows, cols, 4) uint8
        Called once.
    wrap : (str, str)
        Beyond 0 to 1 in u and in v: ``repeat``, ``mirror`` or ``clamp``.
    is_data : bool
        Whether it holds numbers, such as normals, rather than colours in sRGB.
    uv_set : int
        Which coordinates of a mesh place it: 0 for ``uv``, 1 for ``uv2``; a material's ``image``
        has 0.

    Raises
    ------
    InputError
        From ``pixels``, if the picture cannot be decoded (which).
    """

    name: str
    load: Callable[[], NDArray[np.uint8]]
    wrap: tuple[str, str] = ("repeat", "repeat")
    is_data: bool = False
    uv_set: int = 0

    def __post_init__(self) -> None:
        wrap = self.wrap
        if not (
            isinstance(wrap, (tuple, list)) and len(wrap) == 2 and all(w in WRAPS for w in wrap)
        ):
            shown = show_value(wrap)
            msg = f"texture '{self.name}': wrap is two of {', '.join(WRAPS)}; got {shown}"
            raise InputError(msg, texture=self.name)

    @cached_property
    def pixels(self) -> NDArray[np.uint8]:
        """
        Return the pixels, (rows, cols, 4) uint8.

        sRGB and a linear alpha; row 0 is the top, where v is 0.
        """
        pixels = np.asarray(self.load())
        shape = pixels.shape
        if pixels.dtype != np.uint8 or len(shape) != 3 or shape[2] not in {3, 4} or 0 in shape:
            msg = (
                f"texture '{self.name}' is {shape} {pixels.dtype}; "
                "give (rows, cols, 3 or 4) of uint8"
            )
            raise InputError(msg, texture=self.name)
        if shape[2] == 3:
            pixels = np.concatenate([pixels, np.full((*shape[:2], 1), 255, np.uint8)], axis=2)
        return np.ascontiguousarray(pixels)


def make_image(
    pixels: ArrayLike,
    name: str = "image",
    wrap: tuple[str, str] = ("repeat", "repeat"),
    *,
    is_data: bool = False,
    uv_set: int = 0,
) -> Image:
    """
    Make an image from pixels.

    Parameters
    ----------
    pixels : (rows, cols, 3 or 4) uint8
        sRGB; row 0 is the top.
    name : str
    wrap : (str, str)
    is_data : bool
    uv_set : int
        See `Image`.

    Raises
    ------
    InputError
        If the pixels have another shape or type.
    """
    array = read_array("pixels", pixels, None)
    image = Image(name, lambda: array, wrap, is_data, uv_set)
    _ = image.pixels  # refused here rather than at the first frame
    return image


@dataclass(frozen=True, eq=False)
class Material:
    """
    Material of a surface: diffuse reflection (Lambert), and optional emission.

    What is transparent weakens and tints the light, holes in a texture let it through, in
    pictures on both devices; all else casts whole shadows (`umbra.rays.transmission`).

    Parameters
    ----------
    color : (3,) float
        Diffuse reflectance, linear RGB in 0 to 1; multiplies the texture.
    image : Image, optional
        Placed by the mesh's ``uv``.
    opacity : float
        1 is opaque; multiplies the texture's alpha if ``alpha_mode`` is ``blend``.
    emission : (3,) float
        Emitted radiance, linear RGB.
    is_unlit : bool
        Whether its colour ignores light and shadow.
    alpha_mode : {'opaque', 'mask', 'blend'}
        Effect of the texture's alpha: none, holes where it is below ``alpha_cutoff``, or
        transparency.
    alpha_cutoff : float
    roughness : float, optional
        0 (a mirror) to 1, of a surface that reflects lights and sky as glTF's materials do; None
        for one that only scatters.
    metallic : float
        0 (a dielectric, which reflects 4 % head-on) to 1 (a metal, which reflects its colour).
    gloss_image : Image, optional
        Multiplies roughness by its green and metallic by its blue.
    normal_image : Image, optional
        Normals in the surface's frame: red along u, green against v, blue outward, each from
        -1 to 1.
    normal_scale : float
        Multiplies red and green of the normals.
    emission_image : Image, optional
        Multiplies ``emission``.
    occlusion_image : Image, optional
        Its red is the share of the even light of sky and ground that reaches the surface.
    occlusion : float
        0 (the image has no effect) to 1.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    color: Color = GREY
    image: Image | None = None
    opacity: float = 1.0
    emission: Color = (0.0, 0.0, 0.0)
    is_unlit: bool = False
    alpha_mode: str = "opaque"
    alpha_cutoff: float = 0.5
    roughness: float | None = None
    metallic: float = 0.0
    gloss_image: Image | None = None
    normal_image: Image | None = None
    normal_scale: float = 1.0
    emission_image: Image | None = None
    occlusion_image: Image | None = None
    occlusion: float = 1.0

    def __post_init__(self) -> None:
        for name, high in (("color", 1.0), ("emission", np.inf)):
            value = tuple(read_array(f"a material's {name}", getattr(self, name)).ravel().tolist())
            if len(value) != 3 or not all(0 <= v <= high and v < np.inf for v in value):
                limits = "between 0 and 1" if high == 1 else "of at least 0"
                msg = f"a material's {name} is three numbers {limits}; got {value}"
                raise InputError(msg)
            object.__setattr__(self, name, value)
        for name in ("opacity", "metallic", "roughness", "occlusion"):
            share = getattr(self, name)
            if share is not None and not 0 <= read_number(f"a material's {name}", share) <= 1:
                msg = f"a material's {name} lies between 0 and 1; got {share:g}"
                raise InputError(msg)
        if self.alpha_mode not in ALPHA_MODES:
            msg = f"alpha_mode is one of {', '.join(ALPHA_MODES)}; got '{self.alpha_mode}'"
            raise InputError(msg)
        if self.image is not None and self.image.uv_set:
            msg = f"texture '{self.image.name}': a material's image has uv_set=0; make it with 0"
            raise InputError(msg, texture=self.image.name)

    @property
    def texture(self) -> NDArray[np.uint8] | None:
        """The texture's pixels, (rows, cols, 4) uint8 sRGB, decoded now; None without one."""
        return None if self.image is None else self.image.pixels

    @property
    def images(self) -> tuple[Image, ...]:
        """All its images."""
        given = (self.image, *(getattr(self, name) for name in MORE_IMAGES))
        return tuple(image for image in given if image is not None)

    @cached_property
    def is_transparent(self) -> bool:
        """Whether any of it is transparent, apart from holes."""
        return self.opacity < 1 or (self.alpha_mode == "blend" and self._least_alpha < _OPAQUE)

    @cached_property
    def has_holes(self) -> bool:
        """Whether its texture's alpha cuts holes into it."""
        return self.alpha_mode == "mask" and self._least_alpha < self.cutoff_level

    @property
    def transmits(self) -> bool:
        """Whether light passes through any of it; `InputError` if its texture cannot be decoded."""
        return self.is_transparent or self.has_holes

    @cached_property
    def cutoff_level(self) -> float:
        """
        The texture's alpha, 0 to 255, below which a mask is a hole; the same on every device.

        Cutoffs written in decimals (0.502) may mean a whole level, so what is near one is that.
        """
        level = _OPAQUE * self.alpha_cutoff / self.opacity if self.opacity > 0 else np.inf
        whole = np.rint(level)
        return float(np.float32(whole if abs(level - whole) < _NEAR_LEVEL else level))

    @property
    def _least_alpha(self) -> int:
        """The lowest alpha of its texture, 0 to 255."""
        return _OPAQUE if self.texture is None else int(self.texture[..., 3].min())


_DARK = 0.04045  # up to here sRGB is straight


def find_linear(srgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn sRGB levels in 0 to 1 into linear light, as in IEC 61966-2-1."""
    return np.where(srgb <= _DARK, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


_LINEAR = find_linear(np.arange(256) / 255)


def to_linear(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Turn sRGB pixels (..., 4) into linear light in 0 to 1; alpha is linear as it is."""
    linear = _LINEAR[pixels]
    linear[..., 3] = pixels[..., 3] / 255
    return linear


def _to_share(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    return pixels / 255.0


def sample(
    image: Image, uv: NDArray[np.floating], wrap: tuple[str, str] | None = None
) -> NDArray[np.float64]:
    """
    Look up an image at uv (..., 2) between its four nearest texels.

    Linear RGB and alpha; of data what is stored, 0 to 1.
    """
    decode = _to_share if image.is_data else to_linear
    pixels = image.pixels
    rows, cols = pixels.shape[:2]
    coordinates = np.nan_to_num(np.asarray(uv, np.float64), posinf=0.0, neginf=0.0)
    how = wrap or image.wrap
    (left, right), along = _find_texels(coordinates[..., 0], cols, how[0])
    (above, below), down = _find_texels(coordinates[..., 1], rows, how[1])
    along, down = along[..., None], down[..., None]
    # Mixed in linear light, as graphics hardware does with sRGB textures.
    upper = (1 - along) * decode(pixels[above, left]) + along * decode(pixels[above, right])
    lower = (1 - along) * decode(pixels[below, left]) + along * decode(pixels[below, right])
    return (1 - down) * upper + down * lower


def _find_texels(
    coordinate: NDArray[np.float64], count: int, wrap: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the texels on both sides of places, (2, ...), and how far to the second."""
    at = coordinate * count - 0.5
    first = np.floor(at)
    share = at - first
    texel = np.stack([first, first + 1])
    if wrap == "clamp":
        texel = np.clip(texel, 0, count - 1)
    elif wrap == "repeat":
        texel = np.mod(texel, count)
    else:
        texel = np.mod(texel, 2 * count)
        texel = np.minimum(texel, 2 * count - 1 - texel)
    return texel.astype(np.int64), share
