"""Lights as shaders take them (``lamp.glsl``), and the pictures that they project."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.textures import Texture
from umbra.scene import Light

__all__ = ["Lamp", "Lamps"]

_SLIDE = 4  # texture unit; those below are the surfaces'


@dataclass(frozen=True, eq=False)
class Lamp:
    """
    A light in one view.

    Parameters
    ----------
    needs : tuple of str
        What a program must define to include ``lamp.glsl`` for it.
    uniforms : dict
    slide : Texture, optional
        What it projects.
    """

    needs: tuple[str, ...]
    uniforms: dict[str, object]
    slide: Texture | None

    def set(self, program: Program) -> None:
        """Tell a program that includes ``lamp.glsl``."""
        if self.slide is not None:
            self.slide.bind(_SLIDE)
        program.set(slide=_SLIDE, **self.uniforms)


class Lamps:
    """
    Makes lamps, and keeps the pictures that they project.

    Parameters
    ----------
    device : Device
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._slides: dict[int, tuple[Light, Texture]] = {}

    def make(
        self, light: Light, projection: Projection, origin: NDArray[np.float64], exposure: float
    ) -> Lamp:
        """
        Describe a light to shaders.

        Parameters
        ----------
        light : Light
        projection : Projection
        origin : (3,) float64
            Of the scene.
        exposure : float
            Multiplies the light's colour.

        Returns
        -------
        lamp : Lamp
        """
        place = light.local(origin)
        place[:3] -= place[3] * projection.eye
        uniforms: dict[str, object] = {
            "lamp": place,
            "lamp_color": exposure * np.array(light.color),
            "attenuation": np.array(light.attenuation),
            "fade": 1.0 / light.range**2,
        }
        needs = []
        if light.is_point:
            needs.append("IS_POINT")
            if light.attenuation != (1.0, 0.0, 0.0) or light.range < np.inf:
                needs.append("IS_WEAKENING")
        else:
            place[:3] /= np.linalg.norm(place[:3])
        if light.axis is not None:
            needs.append("IS_SPOT")
            inner = light.half_angle if light.inner_angle is None else light.inner_angle
            rim, full = np.cos(np.radians([light.half_angle, inner]))
            uniforms |= {"axis": light.axis, "cone": np.array([rim, 1 / max(full - rim, 1e-7)])}
        slide = None
        if light.image is not None:
            needs.append("HAS_SLIDE")
            slide = self._find_slide(light)
            right, up, _ = light.axes() / np.tan(np.radians(light.half_angle))
            uniforms |= {"slide_right": right, "slide_up": up}
        return Lamp(tuple(needs), uniforms, slide)

    def _find_slide(self, light: Light) -> Texture:
        # The light is kept, so that no other gets its image's number.
        key = id(light.image)
        if key not in self._slides and light.image is not None:
            self._slides[key] = (light, Texture(self._device, light.image, ("clamp", "clamp")))
        return self._slides[key][1]

    def release(self) -> None:
        """Free the pictures."""
        for _, texture in self._slides.values():
            texture.release()
        self._slides = {}
