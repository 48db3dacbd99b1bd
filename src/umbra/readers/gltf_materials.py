"""glTF's materials and textures: base colours, metals, roughness, normals, opacity, emission."""

import base64
from collections import Counter
from functools import partial
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.readers.checks import Companions, OutsideError, encoded_image, image_beside
from umbra.readers.gltf_buffers import Buffers, find_item
from umbra.scene import Image, Material

__all__ = ["GltfSurface", "Materials"]

WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
LOST = "textures that are missing or in an unknown format, left out"
OUTSIDE = "textures outside the model's folder left out (allow_outside=True reads them)"
APART = "textures with coordinates of their own, left out"
SPECULAR = "KHR_materials_pbrSpecularGlossiness"


class GltfSurface:
    """A material, and how its texture is placed on a mesh."""

    def __init__(
        self,
        kind: str = "",
        material: Material | None = None,
        texture: dict[str, Any] | None = None,
    ) -> None:
        self.kind = kind
        self.material = material or Material()
        info = texture or {}
        self._transform = info.get("extensions", {}).get("KHR_texture_transform", {})
        #: Number of the TEXCOORD attribute, or None without a texture.
        self.coordinates: int | None = None
        if texture is not None:
            self.coordinates = int(self._transform.get("texCoord", info.get("texCoord", 0)))

    def transform(self, uv: NDArray[np.floating]) -> NDArray[np.floating]:
        """Apply KHR_texture_transform to coordinates (n, 2): scale, turn, move."""
        if not self._transform:
            return uv
        scale = np.array(self._transform.get("scale", (1, 1)), np.float64).reshape(2)
        offset = np.array(self._transform.get("offset", (0, 0)), np.float64).reshape(2)
        angle = float(self._transform.get("rotation", 0.0))
        # Counter-clockwise to the eye, and v runs down.
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return (uv * scale) @ turn.T + offset


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
        self._images: dict[tuple[int, bool], Image | None] = {}

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
        image = None if texture is None else self._find_image(texture["index"])
        is_unlit = "KHR_materials_unlit" in extensions
        placing = texture if image is not None else None
        gloss, bumps = base.get("metallicRoughnessTexture"), given.get("normalTexture")
        placing, gloss_image = self._find_more(gloss, placing)
        placing, normal_image = self._find_more(None if is_unlit else bumps, placing)
        # Without the texture the factors alone would make everything metal.
        is_known = gloss is None or gloss_image is not None
        is_metal_rough = is_known and not is_unlit and SPECULAR not in extensions
        mode = str(given.get("alphaMode", "OPAQUE")).lower()
        cutoff = float(given.get("alphaCutoff", 0.5))
        emission = (0.0, 0.0, 0.0)
        if given.get("emissiveTexture") is not None:
            self._counts["emissive textures left out"] += 1
        elif not is_unlit:
            strength = extensions.get("KHR_materials_emissive_strength", {})
            glow = max(float(strength.get("emissiveStrength", 1.0)), 0.0)
            r, g, b = (glow * max(float(v), 0.0) for v in given.get("emissiveFactor", (0, 0, 0)))
            emission = (r, g, b)
        material = Material(
            (red, green, blue),
            image,
            opacity=alpha if mode == "blend" else 1.0,
            emission=emission,
            is_unlit=is_unlit,
            alpha_mode=mode if mode in {"mask", "blend"} else "opaque",
            # The factor multiplies the texture's alpha before the cut.
            alpha_cutoff=cutoff / alpha if mode == "mask" and alpha > 0 else cutoff,
            roughness=_clip(base.get("roughnessFactor", 1.0)) if is_metal_rough else None,
            metallic=_clip(base.get("metallicFactor", 1.0)) if is_metal_rough else 0.0,
            gloss_image=gloss_image if is_metal_rough else None,
            normal_image=normal_image,
            normal_scale=float((bumps or {}).get("scale", 1.0)),
        )
        name = str(given.get("name") or f"material {index}")
        return GltfSurface(name, material, placing)

    def _find_more(
        self, texture: dict[str, Any] | None, placing: dict[str, Any] | None
    ) -> tuple[dict[str, Any] | None, Image | None]:
        """Find a texture of numbers beside others, and how all are placed: a mesh has one uv."""
        if texture is None:
            return placing, None
        if placing is not None and _find_placing(texture) != _find_placing(placing):
            self._counts[APART] += 1
            return placing, None
        image = self._find_image(texture["index"], is_data=True)
        return (texture if placing is None and image is not None else placing), image

    def _find_image(self, index: int, *, is_data: bool = False) -> Image | None:
        if (index, is_data) not in self._images:
            what, image = LOST, None
            # Shadows do not need it.
            try:
                image = self._read_texture(index, is_data=is_data)
            except OutsideError:
                what = OUTSIDE
            except (InputError, AttributeError, LookupError, TypeError, ValueError):
                pass
            if image is None:
                self._counts[what] += 1
            self._images[index, is_data] = image
        return self._images[index, is_data]

    def _read_texture(self, index: int, *, is_data: bool) -> Image | None:
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
            return encoded_image(name, lambda: data, wrap, is_data=is_data)
        if uri.startswith("data:"):
            fetch = partial(base64.b64decode, uri.partition(",")[2])
            return encoded_image(name, fetch, wrap, is_data=is_data)
        return image_beside(self._companions, unquote(uri), wrap, is_data=is_data)


def _clip(share: Any) -> float:
    return min(max(float(share), 0.0), 1.0)


def _find_placing(texture: dict[str, Any]) -> tuple[Any, ...]:
    """Return a key that is equal for textures that can share one uv."""
    moved = texture.get("extensions", {}).get("KHR_texture_transform", {})
    number = int(moved.get("texCoord", texture.get("texCoord", 0)))
    return number, *(str(moved.get(name)) for name in ("scale", "offset", "rotation"))
