"""glTF's materials: colour, metal, roughness, normals, opacity, emission, occlusion, textures."""

import base64
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import Companions, OutsideError, encoded_image, image_beside
from umbra.readers.gltf_buffers import Buffers, find_item
from umbra.scene import Image, Material
from umbra.scene.material import Color

__all__ = ["GltfSurface", "Materials", "TextureTransform"]

WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
LOST = "textures that are missing or in an unknown format, left out"
OUTSIDE = "textures outside the model's folder left out (allow_outside=True reads them)"
APART = "textures of a material with a third set of coordinates, left out"
SPECULAR = "KHR_materials_pbrSpecularGlossiness"
TRANSMISSION = "KHR_materials_transmission"
READ = {SPECULAR, TRANSMISSION, "KHR_materials_emissive_strength", "KHR_materials_unlit"}
REFLECTED = 0.04
"""Of the light at right angles, by one surface of glass of glTF's default index, 1.5."""
MOST = 2  # sets of coordinates of a mesh


@dataclass(frozen=True)
class TextureTransform:
    """A TEXCOORD attribute, and what KHR_texture_transform does to it."""

    coordinates: int = 0
    scale: tuple[float, ...] = (1.0, 1.0)
    offset: tuple[float, ...] = (0.0, 0.0)
    rotation: float = 0.0

    @classmethod
    def of(cls, texture: dict[str, Any]) -> "TextureTransform":
        """Return the placing of a texture as a material names it."""
        moved = texture.get("extensions", {}).get("KHR_texture_transform", {})
        scale, offset = (
            tuple(np.array(moved.get(name, default), np.float64).reshape(2).tolist())
            for name, default in (("scale", (1, 1)), ("offset", (0, 0)))
        )
        number = int(moved.get("texCoord", texture.get("texCoord", 0)))
        return cls(number, scale, offset, float(moved.get("rotation", 0.0)))

    def transform(self, uv: NDArray[np.floating]) -> NDArray[np.floating]:
        """Move coordinates (n, 2): scale, turn, shift."""
        if self == TextureTransform(self.coordinates):
            return uv
        # Counter-clockwise to the eye, and v runs down.
        sine, cosine = np.sin(self.rotation), np.cos(self.rotation)
        turn = np.array([[cosine, sine], [-sine, cosine]])
        return (uv * np.array(self.scale)) @ turn.T + np.array(self.offset)


class GltfSurface:
    """A material, and the coordinates of a mesh that place its textures: at most two."""

    def __init__(
        self,
        kind: str = "",
        material: Material | None = None,
        placings: Sequence[TextureTransform] = (),
    ) -> None:
        self.kind = kind
        self.material = material or Material()
        self.placings = tuple(placings)


class Materials:
    """The materials of one file, each read once; losses are counted."""

    def __init__(
        self, tree: dict[str, Any], buffers: Buffers, companions: Companions, counts: Counter[str]
    ) -> None:
        self._tree = tree
        self._buffers = buffers
        self._companions = companions
        self._counts = counts
        self._surfaces: dict[int, GltfSurface] = {}
        self._images: dict[tuple[int, bool, int], Image | None] = {}

    def find(self, index: int | None) -> GltfSurface:
        """Return a material by its number; a plain one for None."""
        if index is None:
            return GltfSurface()
        if index not in self._surfaces:
            self._surfaces[index] = self._read(index)
        return self._surfaces[index]

    def _read(self, index: int) -> GltfSurface:
        given = find_item(self._tree, "materials", index)
        extensions = given.get("extensions", {})
        base = given.get("pbrMetallicRoughness", {})
        factor, texture = base.get("baseColorFactor"), base.get("baseColorTexture")
        if SPECULAR in extensions:
            factor = extensions[SPECULAR].get("diffuseFactor", factor)
            texture = extensions[SPECULAR].get("diffuseTexture", texture)
        red, green, blue, alpha = (min(max(float(v), 0.0), 1.0) for v in factor or (1, 1, 1, 1))
        is_unlit = "KHR_materials_unlit" in extensions
        placings: list[TextureTransform] = []
        image = self._find_image(texture, placings)
        gloss = base.get("metallicRoughnessTexture")
        gloss_image = self._find_image(gloss, placings, is_data=True)
        # Without the texture the factors alone would make everything metal.
        is_known = gloss is None or gloss_image is not None
        is_metal_rough = is_known and not is_unlit and SPECULAR not in extensions
        lit = {} if is_unlit else given
        bumps, opening = lit.get("normalTexture") or {}, lit.get("occlusionTexture") or {}
        normal_image = self._find_image(bumps, placings, is_data=True)
        emission, emission_image = self._read_emission(lit, placings)
        mode = str(given.get("alphaMode", "OPAQUE")).lower()
        cutoff = float(given.get("alphaCutoff", 0.5))
        cover = alpha if mode == "blend" else 1.0
        glass = extensions.get(TRANSMISSION, {})
        clear = _clip(glass.get("transmissionFactor", 0.0))
        if clear and mode != "mask":  # a surface that is covered by what it does not let through
            cover *= 1 - (1 - REFLECTED) * clear
            mode = "blend"
        if clear and (mode == "mask" or "transmissionTexture" in glass):
            what = f"{TRANSMISSION} of masks" if mode == "mask" else "textures of transmission"
            self._counts[f"materials' {what} left out"] += 1
        material = Material(
            (red, green, blue),
            image,
            opacity=cover,
            emission=emission,
            is_unlit=is_unlit,
            alpha_mode=mode if mode in {"mask", "blend"} else "opaque",
            # The factor multiplies the texture's alpha before the cut.
            alpha_cutoff=cutoff / alpha if mode == "mask" and alpha > 0 else cutoff,
            roughness=_clip(base.get("roughnessFactor", 1.0)) if is_metal_rough else None,
            metallic=_clip(base.get("metallicFactor", 1.0)) if is_metal_rough else 0.0,
            gloss_image=gloss_image if is_metal_rough else None,
            normal_image=normal_image,
            normal_scale=float(bumps.get("scale", 1.0)),
            emission_image=emission_image,
            occlusion_image=self._find_image(opening, placings, is_data=True),
            occlusion=_clip(opening.get("strength", 1.0)),
        )
        for extension in sorted(extensions.keys() - READ):
            self._counts[f"materials' {extension} left out"] += 1
        name = str(given.get("name") or f"material {index}")
        return GltfSurface(name, material, placings)

    def _read_emission(
        self, given: dict[str, Any], placings: list[TextureTransform]
    ) -> tuple[Color, Image | None]:
        strength = given.get("extensions", {}).get("KHR_materials_emissive_strength", {})
        glow = max(float(strength.get("emissiveStrength", 1.0)), 0.0)
        r, g, b = (glow * max(float(v), 0.0) for v in given.get("emissiveFactor", (0, 0, 0)))
        texture = given.get("emissiveTexture")
        if texture is None or not any((r, g, b)):
            return (r, g, b), None
        image = self._find_image(texture, placings)
        # Without its texture, which is mostly black, all of the surface would glow.
        return ((0.0, 0.0, 0.0) if image is None else (r, g, b)), image

    def _find_image(
        self,
        texture: dict[str, Any] | None,
        placings: list[TextureTransform],
        *,
        is_data: bool = False,
    ) -> Image | None:
        """Find the image of a texture as a material names it, and add its placing."""
        if not texture:
            return None
        placing = TextureTransform.of(texture)
        if placing not in placings and len(placings) == MOST:
            self._counts[APART] += 1
            return None
        uv_set = placings.index(placing) if placing in placings else len(placings)
        image = self._load(texture["index"], is_data=is_data, uv_set=uv_set)
        if image is not None and uv_set == len(placings):
            placings.append(placing)
        return image

    def _load(self, index: int, *, is_data: bool, uv_set: int) -> Image | None:
        key = index, is_data, uv_set
        if key not in self._images:
            what, image = LOST, None
            # Shadows do not need it.
            try:
                image = self._read_texture(index, is_data=is_data, uv_set=uv_set)
            except OutsideError:
                what = OUTSIDE
            except (InputError, AttributeError, LookupError, TypeError, ValueError):
                pass
            if image is None:
                self._counts[what] += 1
            self._images[key] = image
        return self._images[key]

    def _read_texture(self, index: int, **more: Any) -> Image | None:
        texture = find_item(self._tree, "textures", index)
        webp = texture.get("extensions", {}).get("EXT_texture_webp", {})
        number = webp.get("source", texture.get("source"))
        if number is None:
            return None  # only in a compressed form
        given = find_item(self._tree, "images", number)
        sampler = {}
        if "sampler" in texture:
            sampler = find_item(self._tree, "samplers", texture["sampler"])
        wrap = (
            WRAPS.get(sampler.get("wrapS", 10497), "repeat"),
            WRAPS.get(sampler.get("wrapT", 10497), "repeat"),
        )
        name = f"{self._companions.path.name}: image {number}"
        if given.get("name"):
            name += f", {given['name']}"
        uri = given.get("uri")
        if uri is None:
            data = self._buffers.read_bytes(given["bufferView"], f"image {number}")
            return encoded_image(name, lambda: data, wrap, **more)
        if uri.startswith("data:"):
            fetch = partial(base64.b64decode, uri.partition(",")[2])
            return encoded_image(name, fetch, wrap, **more)
        return image_beside(self._companions, unquote(uri), wrap, **more)


def _clip(share: Any) -> float:
    return min(max(float(share), 0.0), 1.0)
