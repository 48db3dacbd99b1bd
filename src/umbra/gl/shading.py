"""
Light laid over the picture: each light where no shadow falls, then the sky and sRGB.

All passes are one triangle over the picture and read the surface target. What lights
add is summed up in float16, so that 64 dim ones do not band; ``rgba8`` is there for
comparison. There is no limit on lights.
"""

import numpy as np

from umbra.gl.context import Device
from umbra.gl.indices import draw_plain
from umbra.gl.programs import Program
from umbra.gl.projection import Projection
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.surfaces import ALBEDO, PLACE, find_rays
from umbra.gl.target import Target
from umbra.gl.textures import Texture
from umbra.scene import Light
from umbra.scene.look import HORIZON, SKY

__all__ = ["Shading"]

_TEXTURE0, _TEXTURE_2D = 0x84C0, 0x0DE1
_PLACES, _ALBEDOS, _IMAGE = range(3)  # texture units


class Shading:
    """
    The programs that light a picture.

    Parameters
    ----------
    device : Device
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._finish = Program(device, "picture.vert.glsl", "finish.frag.glsl")
        self._lights: dict[tuple[str, ...], Program] = {}
        self._images: dict[int, tuple[Light, Texture]] = {}

    def add_light(
        self,
        state: State,
        surface: Target,
        projection: Projection,
        light: Light,
        origin: np.ndarray,
        exposure: float,
        scissor: tuple[int, int, int, int] | None = None,
    ) -> None:
        """
        Add what a light gives where the stencil is 0.

        Before: the light target is in use and shares its stencil, which counts shadows.
        After: it holds the light's contribution, too; the stencil is as before.

        Parameters
        ----------
        state : State
        surface : Target
        projection : Projection
        light : Light
        origin : (3,) float64
            Of the scene.
        exposure : float
            Multiplies the light's colour.
        scissor : (int, int, int, int), optional
            The light reaches nothing outside, see ``Pass``.
        """
        state.use(
            Pass(
                color_write=True, blend="add", scissor=scissor,
                stencil=Stencil(test="equal", reference=0),
            )
        )  # fmt: skip
        self._bind(surface)
        place = light.local(origin)
        place[:3] -= place[3] * projection.eye
        uniforms = {
            "light": place,
            "color": exposure * np.array(light.color),
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
        if light.image is not None:
            needs.append("HAS_IMAGE")
            self._find_image(light).bind(_IMAGE)
            right, up, _ = light.axes() / np.tan(np.radians(light.half_angle))
            uniforms |= {"image_right": right, "image_up": up}
        program = self._find_program(tuple(needs))
        program.set(
            places=_PLACES, albedos=_ALBEDOS, image=_IMAGE,
            **find_rays(projection), **uniforms,
        )  # fmt: skip
        draw_plain(self._device, program, 3)

    def finish(self, state: State, lit: Target) -> None:
        """Turn the light in ``lit`` over the sky into sRGB, in the target in use."""
        state.use(Pass(color_write=True))
        self._device.gl.ActiveTexture(_TEXTURE0)
        self._device.gl.BindTexture(_TEXTURE_2D, lit.textures[0])
        self._finish.set(
            light=0, sky=np.array(SKY), horizon=np.array(HORIZON), size=np.array(lit.size, float)
        )
        draw_plain(self._device, self._finish, 3)

    def release(self) -> None:
        """Free programs and projected pictures."""
        for owned in (self._finish, *self._lights.values()):
            owned.release()
        for _, texture in self._images.values():
            texture.release()
        self._images = {}

    def _bind(self, surface: Target) -> None:
        gl = self._device.gl
        for unit, place in ((_PLACES, PLACE), (_ALBEDOS, ALBEDO)):
            gl.ActiveTexture(_TEXTURE0 + unit)
            gl.BindTexture(_TEXTURE_2D, surface.textures[place])

    def _find_program(self, needs: tuple[str, ...]) -> Program:
        if needs not in self._lights:
            self._lights[needs] = Program(
                self._device, "picture.vert.glsl", "light.frag.glsl", dict.fromkeys(needs, 1)
            )
        return self._lights[needs]

    def _find_image(self, light: Light) -> Texture:
        # The light is kept, so that no other gets its image's number.
        key = id(light.image)
        if key not in self._images and light.image is not None:
            self._images[key] = (light, Texture(self._device, light.image, ("clamp", "clamp")))
        return self._images[key][1]
