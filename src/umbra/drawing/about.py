"""What a drawing says of itself: its units and scale, and what it leaves out."""

from collections.abc import Sequence

from umbra.scene import Camera, Light, Scene

__all__ = ["list_losses", "tell_scale"]

_INCH, _UNITS = 0.0254, 96  # metres, and units of a drawing to the inch


def list_losses(scene: Scene, lights: Sequence[Light]) -> list[str]:
    """Say what a drawing leaves out of the picture of a scene."""
    parts: dict[str, int] = {}
    for part in scene.parts:
        material, mesh = part.material, part.mesh
        has = {
            "textures and vertex colours (a part has its mean colour)": material.image is not None
            or mesh.colors is not None,
            "smooth normals (faces are flat)": mesh.normals is not None,
            "normal textures": material.normal_image is not None,
            "occlusion textures": material.occlusion_image is not None,
            "emissive textures": material.emission_image is not None,
            "gloss": material.roughness is not None,
            "holes": part.has_holes,
            "light through transparent parts": part.is_transparent,
        }
        for what, is_there in has.items():
            parts[what] = parts.get(what, 0) + is_there
    left = [f"{what} of {count} parts" for what, count in parts.items() if count]
    if any(light.is_point for light in lights):
        left.append("the change of a lamp's light across a face")
    return [f"vectors leave out {'; '.join(left)}"] if left else []


def tell_scale(camera: Camera) -> str:
    """State a drawing's units and scale."""
    if camera.height is None:
        return "One unit is a pixel; a perspective view has no scale."
    metres = camera.height / camera.size[1]
    return (
        f"One unit is {metres:g} m across the view; printed at 96 units to the inch, the scale is "
        f"1:{metres * _UNITS / _INCH:.6g}."
    )
